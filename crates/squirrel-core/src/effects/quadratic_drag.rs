//! Parasitic drag: `F -= 1/2 rho C_d A V (u, v, w)`.
//!
//! Form `anisotropic`: its own drag area along each body axis, `A (1 + e)`, `A (1 - e)`, `A_z`.

use super::{
    Acts, Declared, Effect, EffectParameter, Forms, Scale, Shown, Situation, Words, absent, is,
};
use crate::aero::BodyWrench;
use crate::lane::Lane;
use crate::math::{AIR_DENSITY_KG_M3, Real, real};
use crate::numbers;
use crate::vehicle::Vehicle;

const ANISOTROPIC: usize = 1;

/// Drag area on top of the vehicle's own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuadraticDrag<T>(pub(super) [T; 4]);

impl<T: Real> Effect<T> for QuadraticDrag<T> {
    const NAME: &'static str = "quadratic_drag";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("extra_drag_area_m2", 0.008, 0.05)
            .growing_with(Scale::Mass)
            .declared(Declared::DragArea),
        EffectParameter::signed("anisotropy", 0.1, 0.5).only_in(&["anisotropic"]),
        EffectParameter::signed("extra_drag_area_z_m2", 0.008, 0.05)
            .growing_with(Scale::Mass)
            .declared(Declared::DragArea)
            .only_in(&["anisotropic"]),
        EffectParameter::form(&["isotropic", "anisotropic"]),
    ];
    const WORDS: Words = Words {
        what: "drag with the square of speed",
        more: "More drag at high speed",
        less: "Less drag at high speed",
        fly: "dashes at several speeds from 2 to 9 m/s, both ways",
    };
    const SHOWN: Shown = Shown::HORIZONTAL;
}

numbers! {
    /// Drag over speed squared, N s^2/m^2.
    Numbers {
        /// Along each axis.
        per_square [3]
    }
}

impl<T: Real> QuadraticDrag<T> {
    pub(super) fn prepare(&self, _vehicle: &Vehicle<T>) -> Numbers<T> {
        let [area, anisotropy, area_z, form] = self.0;
        let areas = if is(form, ANISOTROPIC) {
            [area * (T::one() + anisotropy), area * (T::one() - anisotropy), area_z]
        } else {
            [area; 3]
        };
        Numbers { per_square: areas.map(|area| real::<T>(0.5 * AIR_DENSITY_KG_M3) * area) }
    }
}

impl<L: Lane> Acts<L> for Numbers<L> {
    #[inline(always)]
    fn wrench(&self, at: &Situation<'_, L>, _: Forms) -> BodyWrench<L> {
        let mut force = at.flow.velocity;
        for i in 0..3 {
            force[i] = absent::<L>() - self.per_square[i] * at.flow.velocity[i] * at.flow.speed;
        }
        BodyWrench::from_force(force)
    }
}
