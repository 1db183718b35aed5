//! Reaction torque coefficient off by a fraction: `k_m (1 + e)`.

use super::{Alteration, Declared, Effect, EffectParameter, Ratio, Shown, SideOf, Words};
use crate::math::Real;

/// Fraction by which the reaction torque exceeds the nominal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct YawTorqueCoeff<T>(pub(super) [T; 1]);

impl<T: Real> Effect<T> for YawTorqueCoeff<T> {
    const NAME: &'static str = "yaw_torque_coeff";
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::signed("torque_fraction", 0.12, 0.4).declared(Declared::Torque)];
    const WORDS: Words = Words {
        what: "yaw torque of rotors",
        more: "Rotors give more yaw torque",
        less: "Rotors give less yaw torque",
        fly: "yaw steps",
    };
    const SHOWN: Shown = Shown::MOMENTS;
    const IS_OF_MOMENTS: bool = true;
    const SIDE_OF: Option<SideOf> = Some(SideOf { ratio: Ratio::TorqueOverInertia, choice: None });

    fn alter(&self, airframe: &mut Alteration<T>) {
        for factor in &mut airframe.torque {
            *factor *= T::one() + self.0[0];
        }
    }
}
