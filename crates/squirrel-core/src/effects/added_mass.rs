//! Air that moves with the vehicle along body z: `F_z -= m_a w'`, with `w'` the rate of the body z
//! component of the velocity through the air.
//!
//! `w'` depends on the force, so the dynamics solve for both: with all other forces `F_z`,
//! `w' = (F_z / m + g_z - (w x V)_z) / (1 + m_a / m)`. Unlike `mass_error` it has no weight.

use super::{Acts, Effect, EffectParameter, Scale, Shown, Words};
use crate::lane::Lane;
use crate::math::Real;
use crate::numbers;
use crate::vehicle::Vehicle;

/// Mass of that air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AddedMass<T>(pub(super) [T; 1]);

impl<T: Real> Effect<T> for AddedMass<T> {
    const NAME: &'static str = "added_mass";
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::size("mass_kg", 0.03, 0.15).growing_with(Scale::Mass)];
    const WORDS: Words = Words {
        what: "air that moves along",
        more: "More air moves with the vehicle",
        less: "Less air moves with the vehicle",
        fly: "climbs and descents of 3 m/s with heave doublets, wings folded",
    };
    const SHOWN: Shown = Shown::HORIZONTAL;
}

numbers! {
    /// Mass of that air.
    Numbers {
        /// kg.
        mass_kg
    }
}

impl<T: Real> AddedMass<T> {
    pub(super) fn prepare(&self, _vehicle: &Vehicle<T>) -> Numbers<T> {
        Numbers { mass_kg: self.0[0] }
    }
}

impl<L: Lane> Acts<L> for Numbers<L> {
    #[inline(always)]
    fn added_mass_kg(&self) -> L {
        self.mass_kg
    }
}
