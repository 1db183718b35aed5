//! Bias of the heading: the attitude is measured turned by `+b` about down,
//! `psi_measured = psi + b`.
//!
//! Form `drifting`: `b + drift t`, `t` the time since the flight began.

use super::{Declared, Effect, EffectParameter, Fitted, Shown, Words, is};
use crate::math::Real;

const DRIFTING: usize = 1;

/// Heading error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct HeadingBias<T>(pub(super) [T; 3]);

impl<T: Real> Effect<T> for HeadingBias<T> {
    const NAME: &'static str = "heading_bias";
    const IS_OF_SENSORS: bool = true;
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("bias_rad", 0.087, 0.35).declared(Declared::HeadingBias),
        EffectParameter::signed("drift_rad_per_s", 2e-3, 0.01).only_in(&["drifting"]),
        EffectParameter::form(&["constant", "drifting"]),
    ];
    const WORDS: Words = Words {
        what: "heading bias",
        more: "The heading reads off",
        less: "The heading reads off",
        fly: "hard horizontal accelerations along and across the heading",
    };
    const SHOWN: Shown = Shown::NOTHING;
    const FITTED: Fitted = Fitted::Never;

    fn heading_bias_rad(&self, time_s: T) -> T {
        let [bias, drift, form] = self.0;
        if is(form, DRIFTING) { bias + drift * time_s } else { bias }
    }
}
