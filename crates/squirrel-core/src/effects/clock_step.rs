//! The clock that stamps commands jumps: from the time `t_s` on, what is stamped is `dt` later (or
//! earlier) than it was.
//!
//! See [`CommandClock`] for what a log then says.

use super::{
    CommandClock, Effect, EffectParameter, Fitted, Response, Shown, Timing, Tolerance, Words,
};
use crate::math::Real;

/// Size and time of the jump.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ClockStep<T>(pub(super) [T; 2]);

impl<T: Real> Effect<T> for ClockStep<T> {
    const NAME: &'static str = "clock_step";
    const IS_OF_SENSORS: bool = true;
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("step_s", 0.02, 0.2).within(Tolerance::Nothing),
        EffectParameter::size("at_s", 0.3, 600.0),
    ];
    const WORDS: Words = Words {
        what: "jump of the commands' clock",
        more: "The clock of commands jumps forwards",
        less: "The clock of commands jumps back",
        fly: "a flight of more than a minute with doublets at its beginning and end",
    };
    const SHOWN: Shown = Shown::COMMANDS;
    const RESPONSE: Response = Response::Jumps { at: "at_s" };
    const FITTED: Fitted = Fitted::Never;
    const TIMING: Option<Timing> = Some(Timing::ClockJump);

    fn command_clock(&self, clock: &mut CommandClock<T>) {
        [clock.step_s, clock.at_s] = self.0;
    }
}
