//! A compass that follows the current of the motors: `psi_measured = psi + b L`,
//! `L = sum n^3 / (N n_hover^3)`.
//!
//! Power leads make a field in proportion to their current, which turns the heading in proportion
//! to it while it is small. At one voltage the current goes as the rotors' power, with the cube of
//! their speed, so that any log with commands tells it.

use super::{Effect, EffectParameter, Fitted, Shown, Tolerance, Words};
use crate::math::Real;

/// By how much a heading near power leads may be off in hover without anybody minding, rad: about a
/// degree at full throttle.
const HEADING_RAD: f64 = 0.006;

/// Heading error in hover.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CompassCurrent<T>(pub(super) [T; 1]);

impl<T: Real> Effect<T> for CompassCurrent<T> {
    const NAME: &'static str = "compass_current";
    const IS_OF_SENSORS: bool = true;
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::signed("heading_in_hover_rad", 0.05, 0.35)
            .within(Tolerance::Usual(HEADING_RAD))];
    const WORDS: Words = Words {
        what: "heading that follows the motors' current",
        more: "The heading follows the motors' current",
        less: "The heading follows the motors' current",
        fly: "climbs at full thrust and descents at one heading, then at another",
    };
    const SHOWN: Shown = Shown::TURNS;
    const FITTED: Fitted = Fitted::Never;

    fn heading_per_load_rad(&self) -> T {
        self.0[0]
    }
}
