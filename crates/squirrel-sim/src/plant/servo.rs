//! Wing servos: dead time, rate limit, first-order lag (docs/equations.md D.4).

/// Numbers of a wing servo with its crank.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServoParameters {
    /// Time before a new command has any effect, s.
    pub dead_time_s: f64,
    /// Largest rate of deployment, 1/s.
    pub rate_max_per_s: f64,
    /// First-order lag, s.
    pub time_constant_s: f64,
}

/// What one servo remembers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ServoState {
    /// Deployment, 0 folded to 1 spread.
    pub deployment: f64,
    target: f64,
    /// A command that waits for its dead time, and how long still, s.
    pending: Option<(f64, f64)>,
}

/// The lag of a servo over a step of one length; each pair is opening, closing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServoLag {
    dt_s: f64,
    time_constant_s: [f64; 2],
    /// What is left of a gap after a whole step.
    keep: [f64; 2],
}

/// A lag that no step resolves, s.
const SHORTEST_S: f64 = 1e-6;

impl ServoParameters {
    pub(crate) fn check(&self) -> Result<(), String> {
        if !(0.0..=1.0).contains(&self.dead_time_s) {
            return Err(format!("wing.dead_time_s = {}: must be 0 to 1", self.dead_time_s));
        }
        if !(self.rate_max_per_s > 0.0) {
            return Err(format!("wing.rate_max_per_s = {}: must be > 0", self.rate_max_per_s));
        }
        Ok(())
    }

    /// Whether a command leaves a servo where it is, for any time.
    pub fn rests(&self, state: &ServoState, command: f64) -> bool {
        state.pending.is_none() && state.deployment == state.target && command.clamp(0.0, 1.0) == state.target
    }

    /// The lag over a step.
    ///
    /// * `extra_s` - added to the time constant, opening and closing
    pub fn lag(&self, extra_s: [f64; 2], dt_s: f64) -> ServoLag {
        // An effect may take away more than there is; what is left is then no lag.
        let time_constant_s = extra_s.map(|extra| (self.time_constant_s + extra).max(SHORTEST_S));
        ServoLag { dt_s, time_constant_s, keep: time_constant_s.map(|tau| (-dt_s / tau).exp()) }
    }

    /// Moves a servo exactly over a step of any length; a command that changes again within the dead time replaces the one
    /// that waits.
    pub fn lead(&self, state: &mut ServoState, command: f64, lag: &ServoLag) {
        let command = command.clamp(0.0, 1.0);
        let last_asked = state.pending.map_or(state.target, |(waiting, _)| waiting);
        if command != last_asked {
            state.pending = Some((command, self.dead_time_s));
        }
        let mut left_s = lag.dt_s;
        if let Some((waiting, wait_s)) = state.pending {
            let before_s = wait_s.min(lag.dt_s);
            self.follow(state, before_s, lag);
            left_s = lag.dt_s - before_s;
            if wait_s <= lag.dt_s {
                state.target = waiting;
                state.pending = None;
            } else {
                state.pending = Some((waiting, wait_s - lag.dt_s));
            }
        }
        self.follow(state, left_s, lag);
    }

    /// Towards the target for a part of a step: at the largest rate while further than `rate tau`, then by the lag.
    fn follow(&self, state: &mut ServoState, time_s: f64, lag: &ServoLag) {
        let gap = state.target - state.deployment;
        if gap == 0.0 || time_s <= 0.0 {
            return;
        }
        let way = usize::from(gap < 0.0);
        let time_constant_s = lag.time_constant_s[way];
        let mut lag_s = time_s;
        let beyond = gap.abs() - self.rate_max_per_s * time_constant_s;
        if beyond > 0.0 {
            let at_rate_s = (beyond / self.rate_max_per_s).min(time_s);
            state.deployment += (self.rate_max_per_s * at_rate_s).copysign(gap);
            lag_s -= at_rate_s;
        }
        if lag_s > 0.0 {
            let keep = if lag_s == lag.dt_s { lag.keep[way] } else { (-lag_s / time_constant_s).exp() };
            state.deployment = state.target - (state.target - state.deployment) * keep;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn opening_time(servo: &ServoParameters, to: f64) -> f64 {
        let mut state = ServoState::default();
        let lag = servo.lag([0.0; 2], 1e-3);
        for step in 0..2000 {
            servo.lead(&mut state, 1.0, &lag);
            if state.deployment >= to {
                return f64::from(step + 1) * 1e-3;
            }
        }
        f64::INFINITY
    }

    #[test]
    fn dead_time_rate_and_lag_each_cost_their_time() {
        let free = ServoParameters { dead_time_s: 0.0, rate_max_per_s: f64::INFINITY, time_constant_s: 0.03 };
        assert!((opening_time(&free, 1.0 - (-1.0_f64).exp()) - 0.03).abs() < 2e-3);
        let late = ServoParameters { dead_time_s: 0.02, ..free };
        assert!((opening_time(&late, 0.5) - opening_time(&free, 0.5) - 0.02).abs() < 1.5e-3);
        let slow = ServoParameters { rate_max_per_s: 5.0, ..free };
        assert!((opening_time(&slow, 0.8) - 0.16).abs() < 0.02, "0.8 of the stroke at 5 per second");
    }

    /// Dead time, rate limit and lag end inside steps; where a servo gets to does not depend on them.
    #[test]
    fn long_and_short_steps_end_at_the_same_place() {
        let servo = ServoParameters { dead_time_s: 0.021, rate_max_per_s: 6.0, time_constant_s: 0.03 };
        let after = |steps: u32, command: f64, mut state: ServoState| {
            let dt_s = 0.21 / f64::from(steps);
            let lag = servo.lag([0.0; 2], dt_s);
            (0..steps).for_each(|_| servo.lead(&mut state, command, &lag));
            state
        };
        let (long, short) = (after(1, 1.0, ServoState::default()), after(999, 1.0, ServoState::default()));
        // 21 ms dead, 0.82 at 6 per second, then the lag.
        let by_hand = 1.0 - 0.18 * (-(0.21 - 0.021 - 0.82 / 6.0) / 0.03_f64).exp();
        assert!((long.deployment - by_hand).abs() < 1e-12, "{} for {by_hand}", long.deployment);
        assert!((short.deployment - by_hand).abs() < 1e-12, "{}", short.deployment);
        let folded = after(1, 0.3, long).deployment;
        assert!((folded - after(77, 0.3, long).deployment).abs() < 1e-12 && folded < 0.35);
    }

    #[test]
    fn opening_and_closing_may_lag_differently() {
        let servo = ServoParameters { dead_time_s: 0.0, rate_max_per_s: f64::INFINITY, time_constant_s: 0.1 };
        let lag = servo.lag([0.1, 0.3], 0.2);
        let mut state = ServoState::default();
        servo.lead(&mut state, 1.0, &lag);
        assert!((state.deployment - (1.0 - (-1.0_f64).exp())).abs() < 1e-12, "0.2 s to open");
        let open = state.deployment;
        servo.lead(&mut state, 0.0, &lag);
        assert!((state.deployment - open * (-0.5_f64).exp()).abs() < 1e-12, "0.4 s to close");
    }

    #[test]
    fn deployment_stays_between_folded_and_spread() {
        let servo = ServoParameters { dead_time_s: 0.01, rate_max_per_s: 50.0, time_constant_s: 0.01 };
        let mut state = ServoState::default();
        let lag = servo.lag([0.0; 2], 1e-3);
        let (mut least, mut most) = (1.0_f64, 0.0_f64);
        for k in 0..4000 {
            servo.lead(&mut state, if k % 400 < 200 { 7.0 } else { -3.0 }, &lag);
            assert!((0.0..=1.0).contains(&state.deployment));
            most = most.max(state.deployment);
            if k > 400 {
                least = least.min(state.deployment);
            }
        }
        assert!(most > 0.999 && least < 0.001, "{least} to {most}");
    }
}
