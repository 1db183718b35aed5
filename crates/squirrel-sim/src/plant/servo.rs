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

    /// One step; returns the mean deployment over it. A command that changes again within the dead time replaces the one
    /// that waits.
    ///
    /// * `lag` - `1 - exp(-dt / time_constant)`
    pub fn step(&self, state: &mut ServoState, command: f64, dt_s: f64, lag: f64) -> f64 {
        let command = command.clamp(0.0, 1.0);
        let last_asked = state.pending.map_or(state.target, |(waiting, _)| waiting);
        if command != last_asked {
            state.pending = Some((command, self.dead_time_s));
        }
        if let Some((waiting, left)) = state.pending {
            if left <= 0.5 * dt_s {
                state.target = waiting;
                state.pending = None;
            } else {
                state.pending = Some((waiting, left - dt_s));
            }
        }
        let before = state.deployment;
        let most = self.rate_max_per_s * dt_s;
        state.deployment += ((state.target - before) * lag).clamp(-most, most);
        0.5 * (before + state.deployment)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn opening_time(servo: &ServoParameters, to: f64) -> f64 {
        let mut state = ServoState::default();
        let lag = 1.0 - (-1e-3 / servo.time_constant_s).exp();
        for step in 0..2000 {
            servo.step(&mut state, 1.0, 1e-3, lag);
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

    #[test]
    fn deployment_stays_between_folded_and_spread() {
        let servo = ServoParameters { dead_time_s: 0.01, rate_max_per_s: 50.0, time_constant_s: 0.01 };
        let mut state = ServoState::default();
        let (mut least, mut most) = (1.0_f64, 0.0_f64);
        for k in 0..4000 {
            servo.step(&mut state, if k % 400 < 200 { 7.0 } else { -3.0 }, 1e-3, 0.1);
            assert!((0.0..=1.0).contains(&state.deployment));
            most = most.max(state.deployment);
            if k > 400 {
                least = least.min(state.deployment);
            }
        }
        assert!(most > 0.999 && least < 0.001, "{least} to {most}");
    }
}
