//! Force of the wings along themselves, against the motion: `F_xy -= 1/2 rho S V g (u, v)`.
//!
//! A coefficient of friction and edges, `C_T = g cos alpha`. Form `camber`: `C_T = g |C_N| cos
//! alpha` with the flat plate's normal force, which a cambered wing tilts back.

use super::profile::WINGS_AT_SPEED;
use super::{Acts, Effect, EffectParameter, Forms, Mimic, Shown, Situation, Words, absent, is};
use crate::aero::BodyWrench;
use crate::lane::Lane;
use crate::lane::functions::size;
use crate::math::{AIR_DENSITY_KG_M3, Real, real};
use crate::numbers;
use crate::vehicle::Vehicle;

const CAMBER: usize = 1;
/// Stands for 0 where a division must stay finite, m/s.
const TINY: f64 = 1e-12;

/// Coefficient of the force along the wings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct WingTangential<T>(pub(super) [T; 2]);

impl<T: Real> Effect<T> for WingTangential<T> {
    const NAME: &'static str = "wing_tangential";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("gain", 0.06, 0.4),
        EffectParameter::form(&["friction", "camber"]),
    ];
    const WORDS: Words = Words {
        what: "drag along the wings",
        more: "The wings drag more along themselves",
        less: "The wings drag less along themselves",
        fly: WINGS_AT_SPEED,
    };
    const SHOWN: Shown = Shown::HORIZONTAL;
    const MIMIC: Mimic = Mimic::Gusts;
    const IS_OF_WINGS: bool = true;
}

numbers! {
    /// Coefficients.
    Numbers {
        /// `1/2 rho S g` of one side, N s^2/m^2.
        per_square,
        /// Over the normal force.
        of_normal
    }
}

impl<T: Real> WingTangential<T> {
    pub(super) fn prepare(&self, vehicle: &Vehicle<T>) -> Numbers<T> {
        let [gain, form] = self.0;
        if is(form, CAMBER) {
            return Numbers { per_square: T::zero(), of_normal: gain };
        }
        let area_m2 = vehicle.parameters().wing.map_or(T::zero(), |wing| wing.area_per_side_m2);
        let per_square = real::<T>(0.5 * AIR_DENSITY_KG_M3) * area_m2 * gain;
        Numbers { per_square, of_normal: T::zero() }
    }
}

impl<L: Lane> Acts<L> for Numbers<L> {
    #[inline(always)]
    fn wrench(&self, at: &Situation<'_, L>, _: Forms) -> BodyWrench<L> {
        let ([u, v, _], speed) = (at.flow.velocity, at.flow.speed);
        let spread = at.deployment[0] + at.deployment[1];
        let [left, right] = at.wings.normal_forces(at.flow, &at.deployment);
        let tilted = self.of_normal * size(left + right) / speed.upper(L::of(TINY));
        let slope = self.per_square * spread * speed + tilted;
        BodyWrench::from_force([absent::<L>() - slope * u, absent::<L>() - slope * v, absent()])
    }
}
