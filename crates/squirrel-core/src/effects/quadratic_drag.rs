//! Parasitic drag: `F -= 1/2 rho C_d A V (u, v, w)`.

use super::{Effect, EffectParameter};
use crate::aero::Air;
use crate::frames::{Body, Wrench};
use crate::math::{AIR_DENSITY_KG_M3, Real, real};

/// Drag area on top of the vehicle's own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuadraticDrag<T>([T; 1]);

impl<T: Real> Effect<T> for QuadraticDrag<T> {
    const NAME: &'static str = "quadratic_drag";
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter { key: "extra_drag_area_m2", smallest: 0.008, largest: 0.05, signed: false }];
    fn absent() -> Self {
        Self([T::zero()])
    }
    fn values(&mut self) -> &mut [T] {
        &mut self.0
    }
    #[inline(always)]
    fn wrench(&self, air: &Air<T>) -> Wrench<Body, T> {
        Wrench::from_force(air.velocity * (-real::<T>(0.5 * AIR_DENSITY_KG_M3) * self.0[0] * air.speed))
    }
}
