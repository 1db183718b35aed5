//! Arming: who may turn the rotors, decided ten times a second.
//!
//! ```text
//! Disarmed --switch turned on, and nothing against it--> Armed --switch off--> Disarmed
//!                                                          |--the failsafe cuts for CUT_MAX_US--> Ended --switch off--> Disarmed
//! ```
//! The switch must be seen off before it can arm, so that a board that starts with the switch on
//! does not fly. While armed, core's failsafe decides what flies; one that cut for long ends the
//! flight, because a vehicle on the ground must not start again by itself.

use squirrel_core::stack::failsafe::FailsafeMode;

/// A failsafe that cuts for this long ends the flight, us.
pub const CUT_MAX_US: u64 = 2_000_000;
/// Everything must be well for this long before arming, us.
pub const WELL_US: u64 = 1_000_000;

/// What the switch and the sensors say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Inputs {
    /// Time since the board started, us, never backwards.
    pub time_us: u64,
    /// The pilot's switch.
    pub switch_on: bool,
    /// Every sensor speaks, and the vehicle lies level and still.
    pub ready: bool,
    /// What flew in the last step.
    pub failsafe: FailsafeMode,
}

/// Whether the rotors may turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum State {
    /// They may not.
    #[default]
    Disarmed,
    /// The flight code has them since this time, us.
    Armed {
        /// When the flight began.
        since_us: u64,
    },
    /// The failsafe ended the flight; the switch must be turned off.
    Ended,
}

/// What arming remembers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Arming {
    state: State,
    /// The switch was off when it was last looked at.
    was_off: bool,
    /// Since when everything is well, us.
    well_since_us: Option<u64>,
    /// Since when the failsafe cuts, us.
    cut_since_us: Option<u64>,
}

impl Arming {
    /// Looks at the inputs; what holds from now on.
    pub fn update(&mut self, now: &Inputs) -> State {
        let since = |start: Option<u64>, holds: bool| holds.then(|| start.unwrap_or(now.time_us));
        let lasts = |start: Option<u64>, us: u64| {
            start.is_some_and(|t| now.time_us.saturating_sub(t) >= us)
        };
        self.well_since_us = since(self.well_since_us, now.ready);
        let armed = matches!(self.state, State::Armed { .. });
        self.cut_since_us = since(self.cut_since_us, armed && now.failsafe == FailsafeMode::Cut);
        let turned_on = now.switch_on && self.was_off;
        self.was_off = !now.switch_on;
        self.state = match self.state {
            _ if !now.switch_on => State::Disarmed,
            State::Disarmed if turned_on && lasts(self.well_since_us, WELL_US) => {
                State::Armed { since_us: now.time_us }
            }
            State::Armed { .. } if lasts(self.cut_since_us, CUT_MAX_US) => State::Ended,
            as_before => as_before,
        };
        self.state
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ticks of 0.1 s with these inputs; the state after the last.
    fn run(
        arming: &mut Arming,
        time_us: &mut u64,
        ticks: u64,
        inputs: (bool, bool, FailsafeMode),
    ) -> State {
        let (switch_on, ready, failsafe) = inputs;
        let mut state = arming.state;
        for _ in 0..ticks {
            *time_us += 100_000;
            state = arming.update(&Inputs { time_us: *time_us, switch_on, ready, failsafe });
        }
        state
    }

    const OFF: FailsafeMode = FailsafeMode::Off;

    #[test]
    fn a_switch_that_is_on_from_the_start_does_not_arm() {
        let (mut arming, mut t) = (Arming::default(), 0);
        assert_eq!(run(&mut arming, &mut t, 100, (true, true, OFF)), State::Disarmed);
        assert_eq!(run(&mut arming, &mut t, 1, (false, true, OFF)), State::Disarmed);
        assert_eq!(run(&mut arming, &mut t, 1, (true, true, OFF)), State::Armed { since_us: t });
    }

    #[test]
    fn what_is_not_well_for_a_second_does_not_arm_and_neither_does_waiting_for_it() {
        let (mut arming, mut t) = (Arming::default(), 0);
        run(&mut arming, &mut t, 20, (false, true, OFF));
        run(&mut arming, &mut t, 1, (false, false, OFF));
        run(&mut arming, &mut t, 5, (false, true, OFF));
        assert_eq!(
            run(&mut arming, &mut t, 100, (true, true, OFF)),
            State::Disarmed,
            "turned on too early"
        );
    }

    #[test]
    fn the_switch_always_disarms() {
        let (mut arming, mut t) = (Arming::default(), 0);
        run(&mut arming, &mut t, 20, (false, true, OFF));
        assert!(matches!(run(&mut arming, &mut t, 1, (true, true, OFF)), State::Armed { .. }));
        let begin = t;
        // In flight nobody lies still.
        assert_eq!(
            run(&mut arming, &mut t, 50, (true, false, OFF)),
            State::Armed { since_us: begin }
        );
        assert_eq!(run(&mut arming, &mut t, 1, (false, false, OFF)), State::Disarmed);
    }

    #[test]
    fn a_long_cut_ends_the_flight_and_a_short_one_does_not() {
        let (mut arming, mut t) = (Arming::default(), 0);
        run(&mut arming, &mut t, 20, (false, true, OFF));
        run(&mut arming, &mut t, 1, (true, true, OFF));
        assert!(matches!(
            run(&mut arming, &mut t, 15, (true, false, FailsafeMode::Cut)),
            State::Armed { .. }
        ));
        assert!(matches!(
            run(&mut arming, &mut t, 1, (true, false, FailsafeMode::Level)),
            State::Armed { .. }
        ));
        assert_eq!(run(&mut arming, &mut t, 21, (true, false, FailsafeMode::Cut)), State::Ended);
        assert_eq!(
            run(&mut arming, &mut t, 50, (true, true, OFF)),
            State::Ended,
            "well again is not enough"
        );
        assert_eq!(run(&mut arming, &mut t, 1, (false, true, OFF)), State::Disarmed);
    }
}
