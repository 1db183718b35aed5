//! One wing gives less: `N (1 - e)` on its side, taken from the flat plate's force.

use super::profile::WINGS_AT_SPEED;
use super::{
    Acts, Declared, Effect, EffectParameter, Fitted, Forms, Kind, Mimic, Shown, Situation, Words,
    absent, is,
};
use crate::aero::BodyWrench;
use crate::lane::Lane;
use crate::math::Real;
use crate::numbers;
use crate::vehicle::Vehicle;

/// Which side, and the fraction that it lacks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WingAsymmetry<T>(pub(super) [T; 2]);

impl<T: Real> Effect<T> for WingAsymmetry<T> {
    const NAME: &'static str = "wing_asymmetry";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::new("side", Kind::OneOf(&["left", "right"])),
        EffectParameter::size("loss_fraction", 0.12, 0.5).declared(Declared::WingForce),
    ];
    const WORDS: Words = Words {
        what: "force of the @ wing",
        more: "The @ wing gives less force",
        less: "The @ wing gives more force",
        fly: WINGS_AT_SPEED,
    };
    const SHOWN: Shown = Shown::MOMENTS;
    const FITTED: Fitted = Fitted::ExceptToBaselines;
    const MIMIC: Mimic = Mimic::Gusts;
    const IS_OF_WINGS: bool = true;
}

numbers! {
    /// What each side lacks.
    Numbers {
        /// Left and right, as a fraction.
        loss [2]
    }
}

impl<T: Real> WingAsymmetry<T> {
    pub(super) fn prepare(&self, _vehicle: &Vehicle<T>) -> Numbers<T> {
        let [side, loss] = self.0;
        Numbers { loss: if is(side, 0) { [loss, T::zero()] } else { [T::zero(), loss] } }
    }
}

impl<L: Lane> Acts<L> for Numbers<L> {
    #[inline(always)]
    fn wrench(&self, at: &Situation<'_, L>, _: Forms) -> BodyWrench<L> {
        let [left, right] = at.wings.normal_forces(at.flow, &at.deployment);
        at.wings.wrench([absent::<L>() - left * self.loss[0], absent::<L>() - right * self.loss[1]])
    }
}
