//! Wing servo: dead time, rate limit, first-order lag (docs/equations.md D.4), exact over steps of
//! any length.

use crate::lane::Lane;
use crate::lane::functions::{exp, sign, size};
use crate::math::{Real, real};
use crate::numbers;

/// A lag that no step resolves, s.
pub const SHORTEST_S: f64 = 1e-6;

numbers! {
    /// What does not change, for steps of one length.
    Servo {
        /// Time before a new command has any effect, s.
        dead_time_s,
        /// Largest rate of deployment, 1/s.
        rate_max_per_s,
        /// Lag of opening, s.
        opening_s,
        /// Lag of closing, s.
        closing_s,
        /// What is left of a gap after a whole step of opening.
        keep_opening,
        /// What is left of a gap after a whole step of closing.
        keep_closing
    }
}

numbers! {
    /// What one servo remembers; one that waits for nothing has `waiting` as its target.
    ServoState {
        /// Deployment, 0 folded to 1 spread.
        deployment,
        /// Where it goes.
        target,
        /// Where it will go once the dead time has passed.
        waiting,
        /// How long that still takes, s.
        wait_s
    }
}

impl<L: Lane> Servo<L> {
    /// Moves a servo over a step; the mean deployment over it.
    ///
    /// * `dt` - the step that `keep_opening` and `keep_closing` are for, s
    #[inline(always)]
    pub fn lead(&self, state: &mut ServoState<L>, dt: L) -> L {
        let start = state.deployment;
        let before = state.wait_s.lower(dt);
        let early = self.follow(start, state.target, before, dt);
        state.target = (state.wait_s - dt).where_positive(state.target, state.waiting);
        state.wait_s = (state.wait_s - dt).upper(L::of(0.0));
        state.deployment = self.follow(early, state.target, dt - before, dt);
        L::of(0.5) * (start + state.deployment)
    }

    /// Towards the target for a part of a step: at the largest rate while further than `rate tau`,
    /// then by the lag.
    #[inline(always)]
    fn follow(&self, now: L, target: L, time: L, dt: L) -> L {
        let gap = target - now;
        let closing = L::of(0.0) - gap;
        let time_constant = closing.where_positive(self.closing_s, self.opening_s);
        let beyond = size(gap) - self.rate_max_per_s * time_constant;
        let at_rate = beyond.where_positive((beyond / self.rate_max_per_s).lower(time), L::of(0.0));
        let moved = beyond.where_positive(now + self.rate_max_per_s * at_rate * sign(gap), now);
        let lag = time - at_rate;
        let whole = closing.where_positive(self.keep_closing, self.keep_opening);
        let keep = (dt - lag).where_positive(exp(L::of(0.0) - lag / time_constant), whole);
        lag.where_positive(target - (target - moved) * keep, moved)
    }
}

impl<L: Lane> ServoState<L> {
    /// Folded.
    #[inline(always)]
    pub fn at_rest() -> Self {
        Self::all(L::of(0.0))
    }
}

impl<T: Real> Servo<T> {
    /// [`Self::lead`] of one number, with its bits; in no time where nothing but the lag acts.
    #[inline]
    pub fn lead_one(&self, state: &mut ServoState<T>, dt: T) -> T {
        let ServoState { deployment: start, target, waiting, wait_s } = *state;
        let gap = target - start;
        let [time_constant, keep] = if gap < T::zero() {
            [self.closing_s, self.keep_closing]
        } else {
            [self.opening_s, self.keep_opening]
        };
        let waits = wait_s > T::zero() || waiting != target;
        if waits || !(gap.abs() <= self.rate_max_per_s * time_constant) {
            return self.lead(state, dt);
        }
        state.deployment = target - gap * keep;
        (start + state.deployment) * real(0.5)
    }
}

impl<T: Real> ServoState<T> {
    /// Tells it where to go; a command that changes again within the dead time replaces the one
    /// that waits.
    pub fn ask(&mut self, command: T, dead_time_s: T) {
        if command != self.waiting {
            self.waiting = command;
            self.wait_s = dead_time_s;
        }
    }
}
