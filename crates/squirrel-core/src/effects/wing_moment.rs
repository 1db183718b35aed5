//! Centre of pressure of the wings beside their declared place: `M += r x F`, `r = (x, 0, z)`.
//!
//! `F` is the force of the wings that the vehicle flies, effects on it apart. Form `travelling`: the
//! pressure is ahead along the flow, wherever that comes from, and moves back to the declared place
//! as the wings stand across it: `r = x (1 - |sin alpha|) (u, v)/|(u, v)| + (0, 0, z)`.

use super::profile::WINGS_AT_SPEED;
use super::{Acts, Effect, EffectParameter, Forms, Mimic, Scale, Shown, Situation, Words, is};
use crate::aero::BodyWrench;
use crate::lane::Lane;
use crate::lane::functions::size;
use crate::lane::vector::cross;
use crate::math::Real;
use crate::numbers;
use crate::vehicle::Vehicle;

const TRAVELLING: usize = 1;
/// Stands for 0 where a division must stay finite, m/s.
const TINY: f64 = 1e-12;

/// Where the wings push, from where the file says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct WingMoment<T>(pub(super) [T; 3]);

impl<T: Real> Effect<T> for WingMoment<T> {
    const NAME: &'static str = "wing_moment";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("place_x_m", 0.006, 0.05).growing_with(Scale::Arm),
        EffectParameter::signed("place_z_m", 0.012, 0.05).growing_with(Scale::Arm),
        EffectParameter::form(&["fixed", "travelling"]).seeking(&["travelling"]),
    ];
    const WORDS: Words = Words {
        what: "place of the wings' pressure",
        more: "The wings push ahead of their place",
        less: "The wings push behind their place",
        fly: WINGS_AT_SPEED,
    };
    const SHOWN: Shown = Shown::MOMENTS;
    const MIMIC: Mimic = Mimic::Gusts;
    const IS_OF_MOMENTS: bool = true;
    const IS_OF_WINGS: bool = true;
}

numbers! {
    /// Place.
    Numbers {
        /// Ahead and down, m.
        place_m [2],
        /// Upstream at small angles of attack, m.
        upstream_m
    }
}

impl<T: Real> WingMoment<T> {
    pub(super) fn prepare(&self, _vehicle: &Vehicle<T>) -> Numbers<T> {
        let [x_m, z_m, form] = self.0;
        let none = T::zero();
        let [ahead_m, upstream_m] = if is(form, TRAVELLING) { [none, x_m] } else { [x_m, none] };
        Numbers { place_m: [ahead_m, z_m], upstream_m }
    }
}

impl<L: Lane> Acts<L> for Numbers<L> {
    #[inline(always)]
    fn wrench(&self, at: &Situation<'_, L>, _: Forms) -> BodyWrench<L> {
        let [u, v, w] = at.flow.velocity;
        let in_plane = (u * u + v * v).root().upper(L::of(TINY));
        let sine = size(w) / at.flow.speed.upper(L::of(TINY));
        let upstream = self.upstream_m * (L::of(1.0) - sine) / in_plane;
        let [ahead, down] = self.place_m;
        let place = [ahead + upstream * u, upstream * v, down];
        BodyWrench::from_moment(cross(&place, &at.wing_force))
    }
}
