//! The numbers of the wing servos; their equations are [`squirrel_core::dynamics::servo`].

use crate::setting::SettingError;
use squirrel_core::dynamics::servo::{self, SHORTEST_S, Servo};

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
pub type ServoState = servo::ServoState<f64>;

/// Moves wing servos under a command; their mean deployment, left and right, on the way.
///
/// * `servo` - over steps of `dt_s`
/// * `command` - left, right, 0..1
#[inline]
pub fn lead_servos(
    servo: &Servo<f64>,
    servos: &mut [ServoState; 2],
    command: [f64; 2],
    dt_s: f64,
) -> [f64; 2] {
    let mut mean = [0.0; 2];
    for side in 0..2 {
        servos[side].ask(command[side].clamp(0.0, 1.0), servo.dead_time_s);
        mean[side] = servo.lead_one(&mut servos[side], dt_s);
    }
    mean
}

impl ServoParameters {
    pub(crate) fn check(&self) -> Result<(), SettingError> {
        if !(0.0..=1.0).contains(&self.dead_time_s) {
            return Err(SettingError::value(
                "wing.dead_time_s",
                self.dead_time_s,
                "must be 0 to 1",
            ));
        }
        if !(self.rate_max_per_s > 0.0) {
            return Err(SettingError::value(
                "wing.rate_max_per_s",
                self.rate_max_per_s,
                "must be > 0",
            ));
        }
        Ok(())
    }

    /// The servo over steps of one length.
    ///
    /// * `extra_s` - added to the time constant, opening and closing
    pub fn over(&self, extra_s: [f64; 2], dt_s: f64) -> Servo<f64> {
        // An effect may take away more than there is; what is left is then no lag.
        let [opening_s, closing_s] =
            extra_s.map(|extra| (self.time_constant_s + extra).max(SHORTEST_S));
        let keep = |tau: f64| (-dt_s / tau).exp();
        Servo {
            dead_time_s: self.dead_time_s,
            rate_max_per_s: self.rate_max_per_s,
            opening_s,
            closing_s,
            keep_opening: keep(opening_s),
            keep_closing: keep(closing_s),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lead(servo: &Servo<f64>, state: &mut ServoState, command: f64, dt_s: f64) {
        state.ask(command.clamp(0.0, 1.0), servo.dead_time_s);
        servo.lead(state, dt_s);
    }

    /// The short way of one servo has the bits of the way that registers go.
    #[test]
    fn one_servo_moves_as_on_registers() {
        let servo =
            ServoParameters { dead_time_s: 0.021, rate_max_per_s: 6.0, time_constant_s: 0.03 };
        let over = servo.over([0.0, 0.2], 0.004);
        let mut alone = ServoState::at_rest();
        let mut other = alone;
        for step in 0..1000 {
            let command = [1.0, 0.4, 0.45, 0.0][step / 100 % 4];
            alone.ask(command, over.dead_time_s);
            other.ask(command, over.dead_time_s);
            let means = [over.lead_one(&mut alone, 0.004), over.lead(&mut other, 0.004)];
            assert_eq!((means[0], alone), (means[1], other), "{step}");
        }
    }

    fn opening_time(servo: &ServoParameters, to: f64) -> f64 {
        let mut state = ServoState::at_rest();
        let servo = servo.over([0.0; 2], 1e-3);
        for step in 0..2000 {
            lead(&servo, &mut state, 1.0, 1e-3);
            if state.deployment >= to {
                return f64::from(step + 1) * 1e-3;
            }
        }
        f64::INFINITY
    }

    #[test]
    fn dead_time_rate_and_lag_each_cost_their_time() {
        let free = ServoParameters {
            dead_time_s: 0.0,
            rate_max_per_s: f64::INFINITY,
            time_constant_s: 0.03,
        };
        assert!((opening_time(&free, 1.0 - (-1.0_f64).exp()) - 0.03).abs() < 2e-3);
        let late = ServoParameters { dead_time_s: 0.02, ..free };
        assert!((opening_time(&late, 0.5) - opening_time(&free, 0.5) - 0.02).abs() < 1.5e-3);
        let slow = ServoParameters { rate_max_per_s: 5.0, ..free };
        assert!(
            (opening_time(&slow, 0.8) - 0.16).abs() < 0.02,
            "0.8 of the stroke at 5 per second"
        );
    }

    /// Dead time, rate limit and lag end inside steps; where a servo gets to does not depend on
    /// them.
    #[test]
    fn long_and_short_steps_end_at_the_same_place() {
        let servo =
            ServoParameters { dead_time_s: 0.021, rate_max_per_s: 6.0, time_constant_s: 0.03 };
        let after = |steps: u32, command: f64, mut state: ServoState| {
            let dt_s = 0.21 / f64::from(steps);
            let servo = servo.over([0.0; 2], dt_s);
            (0..steps).for_each(|_| lead(&servo, &mut state, command, dt_s));
            state
        };
        let (long, short) =
            (after(1, 1.0, ServoState::at_rest()), after(999, 1.0, ServoState::at_rest()));
        // 21 ms dead, 0.82 at 6 per second, then the lag.
        let by_hand = 1.0 - 0.18 * (-(0.21 - 0.021 - 0.82 / 6.0) / 0.03_f64).exp();
        assert!((long.deployment - by_hand).abs() < 1e-12, "{} for {by_hand}", long.deployment);
        assert!((short.deployment - by_hand).abs() < 1e-12, "{}", short.deployment);
        let folded = after(1, 0.3, long).deployment;
        assert!((folded - after(77, 0.3, long).deployment).abs() < 1e-12 && folded < 0.35);
    }

    #[test]
    fn opening_and_closing_may_lag_differently() {
        let servo = ServoParameters {
            dead_time_s: 0.0,
            rate_max_per_s: f64::INFINITY,
            time_constant_s: 0.1,
        };
        let servo = servo.over([0.1, 0.3], 0.2);
        let mut state = ServoState::at_rest();
        lead(&servo, &mut state, 1.0, 0.2);
        assert!((state.deployment - (1.0 - (-1.0_f64).exp())).abs() < 1e-12, "0.2 s to open");
        let open = state.deployment;
        lead(&servo, &mut state, 0.0, 0.2);
        assert!((state.deployment - open * (-0.5_f64).exp()).abs() < 1e-12, "0.4 s to close");
    }

    #[test]
    fn deployment_stays_between_folded_and_spread() {
        let servo =
            ServoParameters { dead_time_s: 0.01, rate_max_per_s: 50.0, time_constant_s: 0.01 };
        let mut state = ServoState::at_rest();
        let servo = servo.over([0.0; 2], 1e-3);
        let (mut least, mut most) = (1.0_f64, 0.0_f64);
        for k in 0..4000 {
            lead(&servo, &mut state, if k % 400 < 200 { 7.0 } else { -3.0 }, 1e-3);
            assert!((0.0..=1.0).contains(&state.deployment));
            most = most.max(state.deployment);
            if k > 400 {
                least = least.min(state.deployment);
            }
        }
        assert!(most > 0.999 && least < 0.001, "{least} to {most}");
    }
}
