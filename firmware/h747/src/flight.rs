//! One step of the board: sensors in, outputs and log records out, 300 times a second.

use crate::arming::State;
use crate::outputs::{ROTORS, dshot_value, servo_pulses_us};
use crate::sensors::Sensors;
use squirrel_core::estimate::navigator::Filter;
use squirrel_core::stack::failsafe::FailsafeMode;
use squirrel_core::stack::wire::{HASH_START, Record, hash, written};
use squirrel_core::stack::{Stack, StackState};

/// What the motor controllers and servos are told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Outputs {
    /// DShot value of each rotor.
    pub dshot: [u16; ROTORS],
    /// Pulse of the left and the right wing's servo, us.
    pub servo_us: [u32; 2],
}

impl Outputs {
    /// Rotors stand, wings are folded.
    #[must_use]
    pub fn safe() -> Self {
        Self { dshot: [0; ROTORS], servo_us: servo_pulses_us([0.0; 2]) }
    }
}

/// The flight code with its state.
#[derive(Debug)]
pub struct Flight {
    stack: Stack,
    state: StackState,
    /// When the flight that flies now began, us.
    since_us: Option<u64>,
    /// It began: the sensors knew where.
    begun: bool,
    hash: u64,
}

impl Flight {
    /// `None` where this board cannot fly the vehicle: not four rotors, commands in newtons, or an
    /// estimate from elsewhere.
    #[must_use]
    pub fn new(stack: Stack) -> Option<Self> {
        let propulsion = stack.vehicle().parameters().propulsion;
        let fits = stack.vehicle().rotors().len() == ROTORS
            && dshot_value(propulsion.command, 0.0).is_some()
            && stack.parameters().navigation.filter != Filter::External;
        let state = StackState::default();
        fits.then_some(Self { stack, state, since_us: None, begun: false, hash: HASH_START })
    }

    /// What flew in the last step. A flight that could not begin is cut, so that arming ends it.
    #[must_use]
    pub fn failsafe(&self) -> FailsafeMode {
        let could_not = self.since_us.is_some() && !self.begun;
        if could_not { FailsafeMode::Cut } else { self.state.failsafe.active.mode }
    }

    /// One step.
    ///
    /// * `arming` - whether the rotors may turn; a new flight starts from a new state, where the
    ///   ground has told
    /// * `now_us` - since the board started, never backwards
    /// * `log` - is given each record: a setup where a flight begins, then a frame a step
    pub fn step(
        &mut self,
        arming: State,
        sensors: &mut Sensors,
        now_us: u64,
        mut log: impl FnMut(&[u8]),
    ) -> Outputs {
        let State::Armed { since_us } = arming else {
            if self.since_us.take().is_some() {
                sensors.forget();
            }
            sensors.listen(now_us);
            return Outputs::safe();
        };
        if self.since_us != Some(since_us) {
            (self.state, self.hash, self.since_us) =
                (StackState::default(), HASH_START, Some(since_us));
            let stack = sensors.start().and_then(|start| self.stack.starting(start).ok());
            self.begun = stack.is_some();
            if let Some(stack) = stack {
                self.stack = stack;
                send(&Record::Setup(stack), &mut log);
            }
        }
        if !self.begun {
            return Outputs::safe();
        }
        let frame = sensors.frame(now_us.saturating_sub(since_us));
        let output = self.stack.step(&mut self.state, &frame);
        self.hash = written(&output, |bytes| hash(self.hash, bytes)).unwrap_or(self.hash);
        send(&Record::Frame(frame, self.hash), &mut log);
        let kind = self.stack.vehicle().parameters().propulsion.command;
        let mut dshot = [0; ROTORS];
        for (value, command) in dshot.iter_mut().zip(output.rotor_command) {
            *value = dshot_value(kind, command).unwrap_or(0);
        }
        Outputs { dshot, servo_us: servo_pulses_us(output.wing_command) }
    }
}

fn send(record: &Record, log: &mut impl FnMut(&[u8])) {
    // Every record fits: RECORD_MAX says so, and a test.
    let _ = written(record, |bytes| log(bytes));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::{LINE_MAX, framed};
    use crate::sensors::tests::{fix, rest};
    use crate::setup::{self, tests::SETUP};
    use squirrel_core::estimate::navigator::Navigation;
    use squirrel_core::frames::In;
    use squirrel_core::guidance::mission::Mission;
    use squirrel_core::stack::StackParameters;
    use squirrel_core::stack::wire::{Reader, Wire};

    /// A board on the bench: sensors at rest, each at its rate, until `silent_from_us`.
    struct Bench {
        flight: Flight,
        sensors: Sensors,
        now_us: u64,
        line: Vec<u8>,
    }

    impl Bench {
        fn new() -> Self {
            let flight = Flight::new(setup::read(SETUP).unwrap()).unwrap();
            Self { flight, sensors: Sensors::new(0.0), now_us: 0, line: Vec::new() }
        }

        fn steps(&mut self, count: u64, arming: State, imu_speaks: bool) -> Outputs {
            let mut outputs = Outputs::safe();
            for k in 0..count {
                self.now_us += 3333;
                if imu_speaks {
                    // A sensor at rest still has noise.
                    let (mut omega, force) = rest();
                    omega.vector.x = 1e-3 * (k % 7) as f32;
                    self.sensors.imu(omega, force, self.now_us);
                }
                if k % 30 == 0 {
                    self.sensors.fix(fix(), self.now_us);
                }
                if k % 6 == 0 {
                    self.sensors.pressure(97_000.0 + (k % 5) as f32, self.now_us);
                }
                let line = &mut self.line;
                outputs = self.flight.step(arming, &mut self.sensors, self.now_us, |record| {
                    line.extend(framed(record, &mut [0; LINE_MAX]).unwrap());
                });
            }
            outputs
        }
    }

    #[test]
    fn nothing_turns_and_nothing_is_logged_before_arming() {
        let mut bench = Bench::new();
        assert_eq!(bench.steps(300, State::Disarmed, true), Outputs::safe());
        assert!(bench.line.is_empty());
        assert_eq!(bench.steps(10, State::Ended, true), Outputs::safe());
    }

    #[test]
    fn a_flight_that_does_not_know_where_it_begins_is_cut() {
        let mut bench = Bench::new();
        bench.steps(10, State::Disarmed, true);
        let armed = State::Armed { since_us: bench.now_us };
        assert_eq!(bench.steps(600, armed, true), Outputs::safe());
        assert_eq!(bench.flight.failsafe(), FailsafeMode::Cut);
        assert!(bench.line.is_empty());
    }

    #[test]
    fn a_vehicle_that_leaves_estimation_to_others_is_none_for_this_board() {
        let stack = setup::read(SETUP).unwrap();
        let p = *stack.parameters();
        let parameters = StackParameters { navigation: Navigation::external(), ..p };
        let mission = Mission::Hover { position: In::zero() };
        assert!(Flight::new(Stack::new(*stack.vehicle(), parameters, mission).unwrap()).is_none());
    }

    #[test]
    fn armed_it_flies_and_a_sensor_that_falls_silent_stops_it() {
        let mut bench = Bench::new();
        bench.steps(330, State::Disarmed, true);
        let armed = State::Armed { since_us: bench.now_us };
        let flying = bench.steps(300, armed, true);
        assert!(flying.dshot.iter().all(|value| (48..=2047).contains(value)), "{flying:?}");
        assert_eq!(bench.flight.failsafe(), FailsafeMode::Off);
        assert_eq!(bench.steps(40, armed, false), Outputs::safe());
        assert_eq!(bench.flight.failsafe(), FailsafeMode::Cut);
        bench.steps(330, State::Disarmed, true);
        let again = State::Armed { since_us: bench.now_us };
        assert_ne!(
            bench.steps(100, again, true),
            Outputs::safe(),
            "a new flight remembers nothing"
        );
    }

    /// What the host does with the line: the flight again, with the same outputs to the bit.
    #[test]
    fn the_log_flies_again() {
        let mut bench = Bench::new();
        bench.steps(330, State::Disarmed, true);
        bench.steps(600, State::Armed { since_us: bench.now_us }, true);
        let (mut flight, mut frames) = (None, 0);
        for sent in bench.line.split(|byte| *byte == 0).filter(|sent| !sent.is_empty()) {
            let record = cobs::decode_vec(sent).unwrap();
            match Record::take(&mut Reader::new(&record)).unwrap() {
                Record::Setup(stack) => {
                    let start = stack.parameters().navigation.start;
                    let bias = start.gyro_bias.vector.x;
                    assert!((bias - 3e-3).abs() < 1e-4, "the start is the ground's: {bias}");
                    flight = Some((stack, StackState::default(), HASH_START));
                }
                Record::Frame(frame, expected) => {
                    let (stack, state, seen) = flight.as_mut().unwrap();
                    let output = stack.step(state, &frame);
                    *seen = written(&output, |bytes| hash(*seen, bytes)).unwrap();
                    assert_eq!(*seen, expected, "frame {frames}");
                    frames += 1;
                }
            }
        }
        assert_eq!(frames, 600);
        // A line of 921600 baud carries 92 bytes a millisecond.
        assert!(bench.line.len() < 4200 + 600 * 100, "{} bytes", bench.line.len());
    }
}
