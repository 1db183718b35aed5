//! Blades flap back in forward flight and pitch the nose up: `M = g (-v, u, 0)`.

use super::Sight;
use crate::catalogue::{Entry, HiddenEffect, Kind, entry, extensive};
use nalgebra::Vector3;

pub(crate) const ENTRY: Entry =
    entry("flapping_moment", Kind::Moment, &[], &[extensive("gain_n_m_s_per_m", 1e-3, 6e-3)])
        .flown_by(acts, &[3, 4]);

fn acts(effect: &HiddenEffect, at: &Sight) -> [Vector3<f64>; 2] {
    let v = at.air_body;
    [Vector3::zeros(), effect.number("gain_n_m_s_per_m") * Vector3::new(-v.y, v.x, 0.0)]
}
