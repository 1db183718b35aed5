//! Mass off by a fraction: `m (1 + e)`.

use super::{Alteration, Declared, Effect, EffectParameter, Fitted, Ratio, Shown, SideOf, Words};
use crate::math::Real;

/// Fraction by which the mass exceeds the nominal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassError<T>(pub(super) [T; 1]);

impl<T: Real> Effect<T> for MassError<T> {
    const NAME: &'static str = "mass_error";
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::signed("mass_fraction", 0.04, 0.2).declared(Declared::Mass)];
    const WORDS: Words = Words {
        what: "mass",
        more: "The vehicle is heavier",
        less: "The vehicle is lighter",
        fly: "roll and pitch doublets, yaw steps and thrust steps in hover; and weigh the vehicle",
    };
    const SHOWN: Shown = Shown::LASTING;
    const FITTED: Fitted = Fitted::ExceptToBaselines;
    const SIDE_OF: Option<SideOf> = Some(SideOf { ratio: Ratio::ThrustOverMass, choice: None });

    fn alter(&self, airframe: &mut Alteration<T>) {
        airframe.mass_kg *= T::one() + self.0[0];
    }
}
