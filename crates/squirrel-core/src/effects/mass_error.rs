//! Mass off by a fraction: `m (1 + e)`.

use super::{Alteration, Effect, EffectParameter};
use crate::math::Real;

/// Fraction by which the mass exceeds the nominal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassError<T>(pub(super) [T; 1]);

impl<T: Real> Effect<T> for MassError<T> {
    const NAME: &'static str = "mass_error";
    const PARAMETERS: &'static [EffectParameter] = &[EffectParameter::signed("mass_fraction", 0.04, 0.2)];

    fn alter(&self, airframe: &mut Alteration<T>) {
        airframe.mass_kg *= T::one() + self.0[0];
    }
}
