//! Air damps rotation: `M = -c (p, q, r / 2)`, in the form `quadratic`
//! `M = -c (p |p|, q |q|, r |r| / 2)`.

use super::Sight;
use crate::catalogue::{Entry, HiddenEffect, Kind, entry, extensive};
use nalgebra::Vector3;

pub(crate) const ENTRY: Entry = entry(
    "angular_damping",
    Kind::Moment,
    &["quadratic"],
    &[extensive("damping_n_m_s_per_rad", 4e-3, 0.03)],
)
.flown_by(acts, &[3, 4, 5]);

fn acts(effect: &HiddenEffect, at: &Sight) -> [Vector3<f64>; 2] {
    let omega = at.omega;
    let damped = Vector3::new(omega.x, omega.y, 0.5 * omega.z);
    let damped =
        if effect.form == "quadratic" { damped.component_mul(&omega.abs()) } else { damped };
    [Vector3::zeros(), -effect.number("damping_n_m_s_per_rad") * damped]
}
