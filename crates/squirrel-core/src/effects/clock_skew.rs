//! The clock that stamps commands runs fast: a command of the time `t` is stamped `t (1 + s)`.

use super::{CommandClock, Effect, EffectParameter, Fitted, Response, Shown, Timing, Words};
use crate::math::{Real, real};

/// How fast, in parts per million.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ClockSkew<T>(pub(super) [T; 1]);

impl<T: Real> Effect<T> for ClockSkew<T> {
    const NAME: &'static str = "clock_skew";
    const IS_OF_SENSORS: bool = true;
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::signed("skew_ppm", 400.0, 1500.0)];
    const WORDS: Words = Words {
        what: "clock of the commands",
        more: "The clock of commands runs fast",
        less: "The clock of commands runs slow",
        fly: "a flight of more than a minute with doublets at its beginning and end",
    };
    const SHOWN: Shown = Shown::COMMANDS;
    const RESPONSE: Response = Response::Bends;
    const FITTED: Fitted = Fitted::Never;
    const TIMING: Option<Timing> = Some(Timing::ClockRate);

    fn command_clock(&self, clock: &mut CommandClock<T>) {
        clock.rate *= T::one() + self.0[0] * real(1e-6);
    }
}
