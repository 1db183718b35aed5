//! Motor lag on top of the vehicle's own: `Omega' = (Omega_target - Omega) / (tau + extra)`.

use super::{Effect, EffectParameter};
use crate::math::Real;

/// Extra first-order lag of every rotor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorLag<T>([T; 1]);

impl<T: Real> Effect<T> for MotorLag<T> {
    const NAME: &'static str = "motor_lag";
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter { key: "extra_time_constant_s", smallest: 0.015, largest: 0.06, signed: false }];
    fn absent() -> Self {
        Self([T::zero()])
    }
    fn values(&mut self) -> &mut [T] {
        &mut self.0
    }
    #[inline(always)]
    fn rotor_extra_time_constant_s(&self) -> T {
        self.0[0]
    }
}
