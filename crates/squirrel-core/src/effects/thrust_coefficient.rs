//! Thrust coefficient off by a fraction: `k_f (1 + e)`; scales thrust, roll and pitch, not yaw.

use super::{Alteration, Declared, Effect, EffectParameter, Ratio, Shown, SideOf, Words};
use crate::math::Real;

/// Fraction by which thrust exceeds the nominal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThrustCoefficient<T>(pub(super) [T; 1]);

impl<T: Real> Effect<T> for ThrustCoefficient<T> {
    const NAME: &'static str = "thrust_coefficient";
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::signed("thrust_fraction", 0.04, 0.15).declared(Declared::Thrust)];
    const WORDS: Words = Words {
        what: "thrust of all rotors",
        more: "All rotors give more thrust",
        less: "All rotors give less thrust",
        fly: "roll and pitch doublets, yaw steps and thrust steps in hover; and weigh the vehicle",
    };
    const SHOWN: Shown = Shown::LASTING;
    const SIDE_OF: Option<SideOf> = Some(SideOf { ratio: Ratio::ThrustOverMass, choice: None });

    fn alter(&self, airframe: &mut Alteration<T>) {
        for factor in &mut airframe.thrust {
            *factor *= T::one() + self.0[0];
        }
    }
}
