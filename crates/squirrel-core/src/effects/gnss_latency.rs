//! The satellite receiver speaks late: what arrives at `t` was true at `t - d`. The log stamps the arrival.

use super::{Effect, EffectParameter};
use crate::math::Real;

/// Latency on top of the receiver's own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GnssLatency<T>(pub(super) [T; 1]);

impl<T: Real> Effect<T> for GnssLatency<T> {
    const NAME: &'static str = "gnss_latency";
    const IS_OF_SENSORS: bool = true;
    const PARAMETERS: &'static [EffectParameter] = &[EffectParameter::size("latency_s", 0.08, 0.35)];

    fn gnss_latency_s(&self) -> T {
        self.0[0]
    }
}
