//! Commands of rotors and wings act late: `u(t - d)`.
//!
//! Whoever hands commands to the plant holds them back; a lag (`motor_lag`) also smooths, a latency
//! only shifts.

use super::{Effect, EffectParameter, Response, Shown, Timing, Words};
use crate::math::Real;

/// Time from a command to its effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ActuationLatency<T>(pub(super) [T; 1]);

impl<T: Real> Effect<T> for ActuationLatency<T> {
    const NAME: &'static str = "actuation_latency";
    const ACTS_BETWEEN_STEPS: bool = true;
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::size("latency_s", 0.015, 0.06)];
    const WORDS: Words = Words {
        what: "late commands",
        more: "Commands act late",
        less: "Commands act sooner",
        fly: "a multisine from 0.3 to 6 Hz in roll and pitch",
    };
    const SHOWN: Shown = Shown::COMMANDS;
    const RESPONSE: Response = Response::Bends;
    const TIMING: Option<Timing> = Some(Timing::Latency);

    fn command_latency_s(&self) -> T {
        self.0[0]
    }
}
