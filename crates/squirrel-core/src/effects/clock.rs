//! The clock that stamps commands: what it shows, and when what has a stamp was commanded.
//!
//! ```text
//! s = t (1 + e)          s < t_s: shown as it is          s >= t_s: shown as s + dt
//! ```

use crate::math::Real;

/// How the clock of commands runs, all effects together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CommandClock<T> {
    /// What it counts in a second, s.
    pub rate: T,
    /// By how much it jumps, s.
    pub step_s: T,
    /// What it shows when it does, s.
    pub at_s: T,
}

impl<T: Real> CommandClock<T> {
    pub(super) fn right() -> Self {
        Self { rate: T::one(), step_s: T::zero(), at_s: T::zero() }
    }
    /// What it shows, s.
    ///
    /// * `time_s` - since the flight began
    pub fn stamp_s(&self, time_s: T) -> T {
        let shown_s = time_s * self.rate;
        if shown_s >= self.at_s { shown_s + self.step_s } else { shown_s }
    }
    /// When it showed a stamp, s since the flight began. Of what it showed twice, the later one;
    /// what it never showed was when it jumped.
    pub fn time_s(&self, stamp_s: T) -> T {
        let shown_s =
            if stamp_s >= self.at_s { (stamp_s - self.step_s).max(self.at_s) } else { stamp_s };
        shown_s / self.rate
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_lead_back_to_their_times() {
        let right = CommandClock::<f64>::right();
        assert_eq!((right.stamp_s(3.7), right.time_s(3.7)), (3.7, 3.7));
        let jumps = |step_s: f64| CommandClock { rate: 1.001, step_s, at_s: 10.0 };
        for step_s in [0.05, -0.05] {
            let clock = jumps(step_s);
            for time_s in [0.0, 3.0, 9.98, 10.2, 30.0] {
                assert!(
                    (clock.time_s(clock.stamp_s(time_s)) - time_s).abs() < 1e-12,
                    "{step_s}, {time_s}"
                );
            }
        }
        // Forward: nothing has stamps from 10 to 10.05 s. Back: what is stamped 9.95 to 10 s again
        // is taken for the first.
        assert_eq!(jumps(0.05).time_s(10.03), 10.0 / 1.001);
        assert_eq!(jumps(-0.05).time_s(9.97), 9.97 / 1.001);
    }
}
