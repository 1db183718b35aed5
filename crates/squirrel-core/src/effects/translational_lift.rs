//! Translational lift: `T <- T (1 + k V_h^2 / (1 + 0.004 V_h^2))`, `V_h` the airspeed in the rotor plane.

use super::{Effect, EffectParameter};
use crate::aero::Air;
use crate::math::{Real, real};

/// Gain of thrust with speed across the rotors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TranslationalLift<T>(pub(super) [T; 1]);

impl<T: Real> Effect<T> for TranslationalLift<T> {
    const NAME: &'static str = "translational_lift";
    const PARAMETERS: &'static [EffectParameter] = &[EffectParameter::size("gain_s2_per_m2", 6e-4, 3e-3)];

    #[inline(always)]
    fn thrust_factor(&self, air: &Air<T>, _height_m: T) -> T {
        let across = air.velocity.vector.xy().norm_squared();
        T::one() + self.0[0] * across / (T::one() + across * real(0.004))
    }
}
