//! Motor lag on top of the vehicle's own: `Omega' = (Omega_target - Omega) / (tau + extra)`.

use super::{Effect, EffectParameter};
use crate::math::Real;

/// Extra first-order lag of every rotor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorLag<T>(pub(super) [T; 1]);

impl<T: Real> Effect<T> for MotorLag<T> {
    const NAME: &'static str = "motor_lag";
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::size("extra_time_constant_s", 0.015, 0.06)];

    #[inline(always)]
    fn rotor_extra_time_constant_s(&self) -> T {
        self.0[0]
    }
}
