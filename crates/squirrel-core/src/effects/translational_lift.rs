//! Translational lift: `T <- T (1 + k V_h^2 / (1 + 0.004 V_h^2))`, `V_h` the airspeed in the rotor plane.
//!
//! Form `linear`: `T (1 + k V_h)`. Form `quadratic`: `T (1 + k V_h^2)`, without saturation.

use super::{Effect, EffectParameter, is};
use crate::aero::Air;
use crate::math::{Real, real};

const LINEAR: usize = 1;
const QUADRATIC: usize = 2;

/// Gain of thrust with speed across the rotors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TranslationalLift<T>(pub(super) [T; 3]);

impl<T: Real> Effect<T> for TranslationalLift<T> {
    const NAME: &'static str = "translational_lift";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("gain_s2_per_m2", 6e-4, 3e-3).only_in(&["saturating", "quadratic"]),
        EffectParameter::signed("gain_s_per_m", 3e-3, 0.02).only_in(&["linear"]),
        EffectParameter::form(&["saturating", "linear", "quadratic"]),
    ];

    #[inline(always)]
    fn thrust_factor(&self, air: &Air<T>, _height_m: T) -> T {
        let [gain, linear_gain, form] = self.0;
        let across = air.velocity.vector.xy().norm_squared();
        let rise = if is(form, LINEAR) {
            linear_gain * across.sqrt()
        } else if is(form, QUADRATIC) {
            gain * across
        } else {
            gain * across / (T::one() + across * real(0.004))
        };
        T::one() + rise
    }
}
