//! The air drags the wings along themselves: `F = -1/2 rho S V g (u, v, 0)` for every spread side,
//! which is `C_T = g cos alpha`. In the form `camber` it is `C_T = g |C_N| cos alpha` with the flat
//! plate's `C_N`. Both sides open alike, so that there is no moment about the middle.

use super::Sight;
use crate::airframe::AIR_DENSITY_KG_M3;
use crate::catalogue::{Entry, HiddenEffect, Kind, entry, signed};
use nalgebra::Vector3;

pub(crate) const ENTRY: Entry =
    entry("wing_tangential", Kind::Wing, &["camber"], &[signed("gain", 0.06, 0.4)])
        .flown_by(acts, &[0, 1]);

fn acts(effect: &HiddenEffect, at: &Sight) -> [Vector3<f64>; 2] {
    let mut coefficient = effect.number("gain");
    if effect.form == "camber" {
        coefficient *= (at.wings.slope * at.sin_alpha()).abs();
    }
    let open_m2 = at.wings.area_m2 * at.wings.deployment.sum();
    let per_speed = 0.5 * AIR_DENSITY_KG_M3 * open_m2 * coefficient * at.air_body.norm();
    [-per_speed * Vector3::new(at.air_body.x, at.air_body.y, 0.0), Vector3::zeros()]
}
