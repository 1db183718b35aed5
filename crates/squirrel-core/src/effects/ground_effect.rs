//! Ground effect (Cheeseman and Bennett, with an effective radius): `T <- T / (1 - R^2 / (16 h^2))`.
//!
//! `h` is the height above the origin's level, not below `R / 2`.

use super::{Effect, EffectParameter};
use crate::aero::Air;
use crate::math::{Real, real, upper};

/// Effective radius of the rotors together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroundEffect<T>(pub(super) [T; 1]);

impl<T: Real> Effect<T> for GroundEffect<T> {
    const NAME: &'static str = "ground_effect";
    const PARAMETERS: &'static [EffectParameter] = &[EffectParameter::size("effective_radius_m", 0.25, 0.55)];

    #[inline(always)]
    fn thrust_factor(&self, _air: &Air<T>, height_m: T) -> T {
        let radius = self.0[0];
        if radius == T::zero() {
            return T::one();
        }
        let ratio = radius / upper(height_m, radius * real(0.5));
        T::one() / (T::one() - ratio * ratio * real(1.0 / 16.0))
    }
}
