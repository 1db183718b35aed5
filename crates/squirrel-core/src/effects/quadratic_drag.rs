//! Parasitic drag: `F -= 1/2 rho C_d A V (u, v, w)`.

use super::{Effect, EffectParameter, Situation};
use crate::frames::{Body, Wrench};
use crate::math::{AIR_DENSITY_KG_M3, Real, real};

/// Drag area on top of the vehicle's own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuadraticDrag<T>(pub(super) [T; 1]);

impl<T: Real> Effect<T> for QuadraticDrag<T> {
    const NAME: &'static str = "quadratic_drag";
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::size("extra_drag_area_m2", 0.008, 0.05)];

    #[inline(always)]
    fn wrench(&self, situation: &Situation<'_, T>) -> Wrench<Body, T> {
        let scale = real::<T>(0.5 * AIR_DENSITY_KG_M3) * self.0[0] * situation.air.speed;
        Wrench::from_force(situation.air.velocity * -scale)
    }
}
