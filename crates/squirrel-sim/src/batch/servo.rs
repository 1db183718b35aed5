//! Wing servos on registers: dead time, rate limit and lag of `crate::plant::ServoParameters`, without branches.

use super::maths::{all, exp, sign, size};
use super::rows::rows;
use super::simd::{Lanes, Paths};
use crate::plant::ServoParameters;
use squirrel_core::math::real;

/// A lag that no step resolves, s.
const SHORTEST_S: f64 = 1e-6;

rows! {
    /// What does not change.
    Servo {
        dead_time, rate_max, opening_s, closing_s,
        /// What is left of a gap after a whole step.
        keep_opening, keep_closing
    }
}

rows! {
    /// What changes, left and right; a servo that waits for nothing has `waiting` as its target.
    Deployment { now [2], target [2], waiting [2], wait_s [2] }
}

impl<S: Paths> Servo<S> {
    /// * `extra_s` - added to the time constant, opening and closing
    pub(super) fn new(p: &ServoParameters, extra_s: [f64; 2], dt_s: f64) -> Self {
        let [opening, closing] = extra_s.map(|extra| (p.time_constant_s + extra).max(SHORTEST_S));
        Self {
            dead_time: real(p.dead_time_s),
            rate_max: real(p.rate_max_per_s),
            opening_s: real(opening),
            closing_s: real(closing),
            keep_opening: real((-dt_s / opening).exp()),
            keep_closing: real((-dt_s / closing).exp()),
        }
    }
}

impl<S: Paths> Deployment<S> {
    /// Folded.
    pub(super) fn at_rest() -> Self {
        let none = [real(0.0); 2];
        Self { now: none, target: none, waiting: none, wait_s: none }
    }
}

impl<L: Lanes> Servo<L> {
    /// Moves on by a step; the mean deployment over it.
    #[inline(always)]
    pub(super) fn lead(&self, state: &mut Deployment<L>, dt: L) -> [L; 2] {
        let mut mean = state.now;
        for side in 0..2 {
            let wait = state.wait_s[side];
            let before = wait.lower(dt);
            let early = self.follow(state.now[side], state.target[side], before, dt);
            state.target[side] = (wait - dt).where_positive(state.target[side], state.waiting[side]);
            state.wait_s[side] = (wait - dt).upper(L::zero());
            let now = self.follow(early, state.target[side], dt - before, dt);
            mean[side] = all::<L>(0.5) * (state.now[side] + now);
            state.now[side] = now;
        }
        mean
    }

    #[inline(always)]
    fn follow(&self, now: L, target: L, time: L, dt: L) -> L {
        let gap = target - now;
        let closing = L::zero() - gap;
        let time_constant = closing.where_positive(self.closing_s, self.opening_s);
        let beyond = size(gap) - self.rate_max * time_constant;
        let at_rate = beyond.where_positive((beyond / self.rate_max).lower(time), L::zero());
        let moved = beyond.where_positive(now + self.rate_max * at_rate * sign(gap), now);
        let lag = time - at_rate;
        let whole = closing.where_positive(self.keep_closing, self.keep_opening);
        let keep = (dt - lag).where_positive(exp(L::zero() - lag / time_constant), whole);
        lag.where_positive(target - (target - moved) * keep, moved)
    }
}
