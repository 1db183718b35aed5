//! The satellite receiver speaks late: what arrives at `t` was true at `t - d`. The log stamps the
//! arrival.

use super::{Effect, EffectParameter, Fitted, Response, Shown, Timing, Tolerance, Words};
use crate::math::Real;

/// By how much a filter's velocity is late, s.
const VELOCITY_LAG_S: f64 = 0.02;

/// Latency on top of the receiver's own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct GnssLatency<T>(pub(super) [T; 1]);

impl<T: Real> Effect<T> for GnssLatency<T> {
    const NAME: &'static str = "gnss_latency";
    const IS_OF_SENSORS: bool = true;
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::size("latency_s", 0.08, 0.35).within(Tolerance::Usual(VELOCITY_LAG_S))];
    const WORDS: Words = Words {
        what: "late position fixes",
        more: "Position fixes come late",
        less: "Position fixes come sooner",
        fly: "hard horizontal accelerations along and across the heading",
    };
    const SHOWN: Shown = Shown::ACCELEROMETER;
    const RESPONSE: Response = Response::Bends;
    const FITTED: Fitted = Fitted::Never;
    const TIMING: Option<Timing> = Some(Timing::Latency);

    fn gnss_latency_s(&self) -> T {
        self.0[0]
    }
}
