//! Air that moves with the vehicle along body z: `F_z -= m_a w'`, with `w'` the rate of the body z component of the velocity
//! through the air.
//!
//! `w'` depends on the force, so the dynamics solve for both: with all other forces `F_z`,
//! `w' = (F_z / m + g_z - (w x V)_z) / (1 + m_a / m)`. Unlike `mass_error` it has no weight.

use super::{Effect, EffectParameter, Scale};
use crate::math::Real;

/// Mass of that air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AddedMass<T>(pub(super) [T; 1]);

impl<T: Real> Effect<T> for AddedMass<T> {
    const NAME: &'static str = "added_mass";
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::size("mass_kg", 0.03, 0.15).growing_with(Scale::Mass)];

    #[inline(always)]
    fn added_mass_kg(&self) -> T {
        self.0[0]
    }
}
