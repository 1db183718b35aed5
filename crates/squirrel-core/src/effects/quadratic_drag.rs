//! Parasitic drag: `F -= 1/2 rho C_d A V (u, v, w)`.
//!
//! Form `anisotropic`: its own drag area along each body axis, `A (1 + e)`, `A (1 - e)`, `A_z`.

use super::{Effect, EffectParameter, Scale, Situation, is};
use crate::frames::{Body, In, Wrench};
use crate::math::{AIR_DENSITY_KG_M3, Real, real};
use nalgebra::Vector3;

const ANISOTROPIC: usize = 1;

/// Drag area on top of the vehicle's own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuadraticDrag<T>(pub(super) [T; 4]);

impl<T: Real> Effect<T> for QuadraticDrag<T> {
    const NAME: &'static str = "quadratic_drag";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("extra_drag_area_m2", 0.008, 0.05).growing_with(Scale::Mass),
        EffectParameter::signed("anisotropy", 0.1, 0.5).only_in(&["anisotropic"]),
        EffectParameter::signed("extra_drag_area_z_m2", 0.008, 0.05)
            .growing_with(Scale::Mass)
            .only_in(&["anisotropic"]),
        EffectParameter::form(&["isotropic", "anisotropic"]),
    ];

    #[inline(always)]
    fn wrench(&self, situation: &Situation<'_, T>) -> Wrench<Body, T> {
        let [area, anisotropy, area_z, form] = self.0;
        let areas = if is(form, ANISOTROPIC) {
            Vector3::new(area * (T::one() + anisotropy), area * (T::one() - anisotropy), area_z)
        } else {
            Vector3::repeat(area)
        };
        let scale = real::<T>(-0.5 * AIR_DENSITY_KG_M3) * situation.air.speed;
        Wrench::from_force(In::new(areas.component_mul(&situation.air.velocity.vector) * scale))
    }
}
