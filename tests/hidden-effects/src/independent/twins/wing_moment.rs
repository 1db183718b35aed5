//! The wings' pressure acts beside its declared place, in the middle between the two:
//! `M = (x, 0, z) x F` with the force `F` of the wings as it is. In the form `travelling` the place
//! moves back to the declared one as the wings stall: `x (1 - |sin alpha|)`.
//!
//! The flat wings of this generator push along `z` alone, so that `place_z_m` would do nothing: none
//! is drawn. Farther ahead than is drawn, no autopilot of the bench holds the nose down.

use super::Sight;
use crate::catalogue::{Entry, HiddenEffect, Kind, along, entry};
use nalgebra::Vector3;

pub(crate) const ENTRY: Entry =
    entry("wing_moment", Kind::Wing, &["travelling"], &[along("place_x_m", 0.006, 0.025)])
        .flown_by(acts, &[4]);

fn acts(effect: &HiddenEffect, at: &Sight) -> [Vector3<f64>; 2] {
    let mut place = effect.number("place_x_m");
    if effect.form == "travelling" {
        place *= 1.0 - at.sin_alpha().abs();
    }
    let pushed = Vector3::new(0.0, 0.0, at.wings.force_z_n);
    [Vector3::zeros(), Vector3::new(place, 0.0, effect.number("place_z_m")).cross(&pushed)]
}
