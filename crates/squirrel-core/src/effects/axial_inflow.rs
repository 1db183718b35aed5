//! Axial inflow: `T <- T (1 + k w)`, `w` the airspeed along body z: air from below lifts, climbing costs thrust.

use super::{Effect, EffectParameter};
use crate::aero::Air;
use crate::math::Real;

/// Gain of thrust with speed along the rotor axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxialInflow<T>(pub(super) [T; 1]);

impl<T: Real> Effect<T> for AxialInflow<T> {
    const NAME: &'static str = "axial_inflow";
    const PARAMETERS: &'static [EffectParameter] = &[EffectParameter::size("gain_s_per_m", 0.012, 0.06)];

    #[inline(always)]
    fn thrust_factor(&self, air: &Air<T>, _height_m: T) -> T {
        T::one() + self.0[0] * air.velocity.vector.z
    }
}
