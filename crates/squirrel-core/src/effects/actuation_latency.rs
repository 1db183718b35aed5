//! Commands of rotors and wings act late: `u(t - d)`.
//!
//! Whoever hands commands to the plant holds them back; a lag (`motor_lag`) also smooths, a latency only shifts.

use super::{Effect, EffectParameter};
use crate::math::Real;

/// Time from a command to its effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ActuationLatency<T>(pub(super) [T; 1]);

impl<T: Real> Effect<T> for ActuationLatency<T> {
    const NAME: &'static str = "actuation_latency";
    const PARAMETERS: &'static [EffectParameter] = &[EffectParameter::size("latency_s", 0.015, 0.06)];

    fn command_latency_s(&self) -> T {
        self.0[0]
    }
}
