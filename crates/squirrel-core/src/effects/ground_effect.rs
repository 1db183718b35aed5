//! Ground effect (Cheeseman and Bennett 1955, with an effective radius): `T <- T / (1 - R^2 / (16 h^2))`.
//!
//! `h` is the height above the origin's level, not below `R / 2`. Form `exponential`: `T <- T (1 + g exp(-h / R))`, as fitted
//! to multirotors, with `h` not below 0.

use super::{Effect, EffectParameter, Scale, is};
use crate::aero::Air;
use crate::math::{Real, real, upper};

const EXPONENTIAL: usize = 1;

/// Effective radius of the rotors together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroundEffect<T>(pub(super) [T; 3]);

impl<T: Real> Effect<T> for GroundEffect<T> {
    const NAME: &'static str = "ground_effect";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::size("effective_radius_m", 0.25, 0.55).growing_with(Scale::Arm),
        EffectParameter::size("gain", 0.1, 0.5).only_in(&["exponential"]),
        EffectParameter::form(&["cheeseman_bennett", "exponential"]),
    ];

    #[inline(always)]
    fn thrust_factor(&self, _air: &Air<T>, height_m: T) -> T {
        let [radius, gain, form] = self.0;
        if radius == T::zero() {
            return T::one();
        }
        if is(form, EXPONENTIAL) {
            return T::one() + gain * (-upper(height_m, T::zero()) / radius).exp();
        }
        let ratio = radius / upper(height_m, radius * real(0.5));
        T::one() / (T::one() - ratio * ratio * real(1.0 / 16.0))
    }
}
