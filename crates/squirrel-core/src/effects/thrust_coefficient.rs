//! Thrust coefficient off by a fraction: `k_f (1 + e)`; scales thrust, roll and pitch, not yaw.

use super::{Alteration, Effect, EffectParameter};
use crate::math::Real;

/// Fraction by which thrust exceeds the nominal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThrustCoefficient<T>(pub(super) [T; 1]);

impl<T: Real> Effect<T> for ThrustCoefficient<T> {
    const NAME: &'static str = "thrust_coefficient";
    const PARAMETERS: &'static [EffectParameter] = &[EffectParameter::signed("thrust_fraction", 0.04, 0.15)];

    fn alter(&self, airframe: &mut Alteration<T>) {
        for factor in &mut airframe.thrust {
            *factor *= T::one() + self.0[0];
        }
    }
}
