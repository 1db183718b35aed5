//! Commands on their way from the flight code to the plant: the effect `actuation_latency`.

use super::PLANT_STEP_US;
use squirrel_core::stack::StackOutput;
use squirrel_core::vehicle::PerRotor;
use std::collections::VecDeque;

/// What rotors and wings are told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Command {
    /// In the vehicle's unit.
    pub(super) rotor: PerRotor<f64>,
    /// Left, right, 0..1.
    pub(super) wing: [f64; 2],
}

impl Command {
    /// Of the flight code.
    pub(super) fn of(output: &StackOutput) -> Self {
        Self {
            rotor: output.rotor_command.map(f64::from),
            wing: output.wing_command.map(f64::from),
        }
    }
}

/// Commands that wait for their latency.
pub(super) struct CommandLine {
    latency_us: u64,
    waiting: VecDeque<(u64, Command)>,
    acting: Command,
}

impl CommandLine {
    /// * `first` - acts until the first command arrives
    pub(super) fn new(latency_s: f64, first: Command) -> Self {
        Self {
            latency_us: (latency_s * 1e6).round() as u64,
            waiting: VecDeque::new(),
            acting: first,
        }
    }

    /// Sends a command. Times must not run backwards.
    pub(super) fn send(&mut self, time_us: u64, command: Command) {
        self.waiting.push_back((time_us.saturating_add(self.latency_us), command));
    }

    /// The command that acts in the plant step from a time on: it begins to at the step nearest to
    /// its arrival.
    pub(super) fn acting(&mut self, time_us: u64) -> Command {
        while self
            .waiting
            .front()
            .is_some_and(|(arrival, _)| *arrival < time_us + PLANT_STEP_US.div_ceil(2))
        {
            if let Some((_, command)) = self.waiting.pop_front() {
                self.acting = command;
            }
        }
        self.acting
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn command(x: f64) -> Command {
        Command { rotor: [x; 8], wing: [x; 2] }
    }

    #[test]
    fn commands_act_at_the_step_nearest_to_their_arrival() {
        for (latency_s, late_steps) in [(0.0, 0), (0.0204, 20), (0.0206, 21)] {
            let mut line = CommandLine::new(latency_s, command(-1.0));
            for step in 0..100u64 {
                line.send(step * PLANT_STEP_US, command(step as f64));
                let expected = step as f64 - f64::from(late_steps);
                assert_eq!(
                    line.acting(step * PLANT_STEP_US),
                    command(expected.max(-1.0)),
                    "{latency_s} s"
                );
            }
        }
        let mut never = CommandLine::new(1e300, command(-1.0));
        never.send(1000, command(0.0));
        assert_eq!(never.acting(1_000_000_000), command(-1.0));
    }
}
