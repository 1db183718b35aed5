//! Blades flap back in forward flight and pitch the nose up: `M = g (-v, u, 0)`, in the form
//! `at_rotors` of each rotor its part, by its speed and the air at its hub.

use super::Sight;
use crate::catalogue::{Entry, HiddenEffect, Kind, entry, extensive};
use nalgebra::Vector3;

pub(crate) const ENTRY: Entry = entry(
    "flapping_moment",
    Kind::Moment,
    &["at_rotors"],
    &[extensive("gain_n_m_s_per_m", 1e-3, 6e-3)],
)
.flown_by(acts, &[3, 4]);

fn acts(effect: &HiddenEffect, at: &Sight) -> [Vector3<f64>; 2] {
    let (v, rotors) = (at.air_body, at.rotors.all());
    let gain = effect.number("gain_n_m_s_per_m");
    if effect.form == "at_rotors" {
        let count = rotors.len() as f64;
        let parts = rotors.iter().map(|jet| {
            let (hub, speed) =
                (v + at.omega.cross(&jet.position), jet.thrust_n * count / at.weight_n);
            gain / count * speed.max(0.0).sqrt() * Vector3::new(-hub.y, hub.x, 0.0)
        });
        return [Vector3::zeros(), parts.sum()];
    }
    [Vector3::zeros(), gain * Vector3::new(-v.y, v.x, 0.0)]
}
