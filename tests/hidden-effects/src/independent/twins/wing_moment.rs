//! The wings' pressure acts beside its declared place, in the middle between the two:
//! `M = (x, 0, z) x F` with the force `F` of the wings as it is. In the form `travelling` the place
//! is ahead towards the wind in the wings' plane, and moves back to the declared one as they stall:
//! `x (1 - |sin alpha|)`.
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
    let ahead = effect.number("place_x_m");
    let mut place = Vector3::x() * ahead;
    if effect.form == "travelling" {
        let along = Vector3::new(at.air_body.x, at.air_body.y, 0.0);
        let towards_wind = along.try_normalize(1e-6).unwrap_or_default();
        place = towards_wind * ahead * (1.0 - at.sin_alpha().abs());
    }
    place.z += effect.number("place_z_m");
    [Vector3::zeros(), place.cross(&Vector3::new(0.0, 0.0, at.wings.force_z_n))]
}
