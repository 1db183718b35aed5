//! Flights: plant, sensors and flight code in closed loop.
//!
//! The plant steps at its own rate (1 kHz by default); the flight code runs at the first plant step
//! at or after each 1/300 s, wind and sensors are sampled there. Everything random comes from the
//! scenario's seed. Before the flight the flight code hears its sensors at rest for a second, as it
//! would on the ground.

mod commands;
mod failing;
mod integrator;
mod metrics;
mod offboard;
mod pilot;
mod record;
mod surroundings;

pub use integrator::Integrator;
pub use metrics::{Flags, Metrics};
pub use offboard::{Follower, Offboard};
pub use pilot::Pilot;
pub(crate) use record::{ESTIMATOR, PARNN_WEIGHTS};
pub use record::{Recipient, Recording};

use crate::arm::Arm;
use crate::estimator::Estimator;
use crate::plant::{Meeting, Plant, PlantState, Wind, WingPlant};
use crate::scenario::{FaultKind, SAG, Scenario};
use crate::sensors::{SensorParameters, Sensors, Truth};
use crate::vehicle_file::VehicleFile;
use commands::{Command, CommandLine};
use failing::Failing;
use integrator::Mover;
use squirrel_core::control::supply::ThrustByVoltage;
use squirrel_core::dynamics::{State, specific_force, total_wind};
use squirrel_core::effects::Effects;
use squirrel_core::estimate::navigator::{Navigation, NavigationTerms};
use squirrel_core::estimate::rest::Preflight;
use squirrel_core::frames::{In, Ned};
use squirrel_core::math::GRAVITY_M_S2;
use squirrel_core::nalgebra::Vector3;
use squirrel_core::stack::{Gnss, Imu, SensorFrame, Stack, StackOutput, StackState};
use squirrel_core::vehicle::{MAX_ROTORS, Vehicle};
use squirrel_log::FlightLog;
use surroundings::Surroundings;

/// Rate of the flight code, Hz (paper, section III.A).
pub const CONTROL_RATE_HZ: u64 = 300;
/// Default step of the plant, us.
pub const PLANT_STEP_US: u64 = 1000;

/// What to fly.
#[derive(Debug, Clone)]
pub struct Setup {
    /// Vehicle.
    pub vehicle: VehicleFile,
    /// Controller and plant pairing.
    pub arm: Arm,
    /// Mission, air, obstacles, seed.
    pub scenario: Scenario,
    /// What moves the body.
    pub integrator: Integrator,
}

/// A flight that was flown.
#[derive(Debug, Clone)]
pub struct Flight {
    /// What it amounted to.
    pub metrics: Metrics,
    /// The log, if one was asked for.
    pub log: Option<FlightLog>,
}

/// Why a flight could not be flown; one line.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct FlightError(pub String);

/// Where the flight code runs: in this process, or somewhere that takes frames and gives outputs.
pub trait FlightComputer {
    /// One step: its output, and how many obstacles were met so far.
    ///
    /// # Errors
    /// Where the computer does not answer.
    fn step(&mut self, frame: &SensorFrame) -> Result<(StackOutput, u32), FlightError>;
}

/// The flight code in this process.
#[derive(Debug, Clone, PartialEq)]
pub struct InProcess {
    stack: Stack,
    state: StackState,
}

impl InProcess {
    /// Before the first step.
    pub fn new(stack: Stack) -> Self {
        Self { stack, state: StackState::default() }
    }
}

impl FlightComputer for InProcess {
    fn step(&mut self, frame: &SensorFrame) -> Result<(StackOutput, u32), FlightError> {
        let output = self.stack.step(&mut self.state, frame);
        Ok((output, self.state.mission.encounters))
    }
}

impl Setup {
    /// The flight code of this setup.
    ///
    /// # Errors
    /// The first number that cannot be used, with its field.
    pub fn stack(&self) -> Result<Stack, FlightError> {
        let fail = |e: squirrel_core::vehicle::ParameterError| FlightError(e.to_string());
        let Some(mut parameters) = self.vehicle.control else {
            return Err(FlightError(format!(
                "{}: [control] is missing; a flight needs gains",
                self.vehicle.name
            )));
        };
        if let (Some(plus), Some(speed)) = (&mut parameters.twcc.plus, self.scenario.speed_max_m_s)
        {
            plus.position.speed_max_m_s = speed as f32;
        }
        self.arm
            .configure(&mut parameters.twcc, self.vehicle.weights.as_ref())
            .map_err(|e| FlightError(format!("{}: {e}", self.vehicle.name)))?;
        let vehicle = self.limited_vehicle()?.cast().map_err(fail)?;
        parameters.navigation = self.navigation()?;
        parameters.thrust = self.thrust(parameters.thrust);
        Stack::new(vehicle, parameters, self.scenario.mission().map_err(fail)?).map_err(fail)
    }

    /// What the sensors of this setup are: without error where the truth is told.
    fn sensors(&self) -> SensorParameters {
        if self.vehicle.estimator == Estimator::Oracle {
            SensorParameters::ideal()
        } else {
            self.scenario.conditions.sensors(self.vehicle.sensors)
        }
    }

    /// The effects that act on this setup's plant: its vehicle's, and those of the conditions.
    fn effects(&self) -> Effects<f64> {
        self.scenario.conditions.effects(&self.vehicle)
    }

    /// What the flight code knows of thrust and voltage: what its vehicle's file says, and the sag
    /// that comes with the day.
    fn thrust(&self, said: ThrustByVoltage) -> ThrustByVoltage {
        if self.vehicle.effects.has(SAG) {
            return said;
        }
        match self.effects().get_mut(SAG) {
            Some(sag) => ThrustByVoltage { exponent: sag.values[0] as f32, ..said },
            None => said,
        }
    }

    /// Who estimates, and from where on.
    fn navigation(&self) -> Result<Navigation, FlightError> {
        let parameters = self.sensors();
        let filter = self.vehicle.estimator.filter(&parameters);
        let altitude = Estimator::altitude(&parameters);
        let mut navigation = Navigation { filter, altitude, ..Navigation::external() };
        if self.vehicle.estimator.is_filter() {
            let sensors = Sensors::new(parameters, &self.effects(), self.scenario.seed);
            let mut preflight = Preflight::default();
            let position = self.start_position();
            for frame in sensors.at_rest(position, 0.0) {
                preflight.hear(&frame);
            }
            let unheard = || {
                FlightError(format!(
                    "{}: sensors.imu is not at rest before the flight: its bias is larger than a gyro at rest may read",
                    self.vehicle.name
                ))
            };
            navigation.start =
                preflight.start(In::new(position.vector.map(|x| x as f32))).ok_or_else(unheard)?;
        }
        Ok(navigation)
    }

    /// The scenario, and that its faults hit something of this vehicle: one that hits nothing would
    /// prove nothing.
    fn check(&self) -> Result<(), FlightError> {
        self.scenario.check().map_err(FlightError)?;
        let sensors = self.sensors();
        let rotors = self.vehicle.vehicle.rotors().len();
        for (kind, table) in &self.scenario.faults {
            let name = kind.name();
            let which = table.which.unwrap_or(1) as usize;
            let problem = match kind {
                FaultKind::MotorWeak if which > rotors => {
                    format!("which = {which}: must be 1 to {rotors}")
                }
                FaultKind::CompassSwung if sensors.magnetometer.is_none() => {
                    "start_s: given, but there is no magnetometer".to_owned()
                }
                FaultKind::ImuSpike
                | FaultKind::ImuStuck
                | FaultKind::ImuNan
                | FaultKind::ImuDead
                    if which > sensors.imu.units as usize =>
                {
                    format!("which = {which}: must be 1, there is one inertial unit")
                }
                FaultKind::WingStuck if self.vehicle.wing == WingPlant::None => {
                    "start_s: given, but there is no wing".to_owned()
                }
                _ => continue,
            };
            return Err(FlightError(format!("faults.{name}.{problem}")));
        }
        Ok(())
    }

    fn start_position(&self) -> In<Ned, f64> {
        In::new(Vector3::new(0.0, 0.0, -self.scenario.height_m))
    }

    /// The vehicle as the flight code may use it: with the scenario's thrust-to-weight ratio, no
    /// rotor is asked for more than its share. The plant keeps its rotors, so that a command means
    /// the same in every flight of the vehicle.
    fn limited_vehicle(&self) -> Result<Vehicle<f64>, FlightError> {
        let mut p = *self.vehicle.vehicle.parameters();
        if let Some(ratio) = self.scenario.thrust_to_weight {
            p.limits.thrust_max_n = ratio * self.vehicle.vehicle.weight_n();
            p.limits.rotor_thrust_max_n = Some(p.limits.thrust_max_n / p.rotor_count as f64);
        }
        Vehicle::new(p).map_err(|e| FlightError(e.to_string()))
    }

    /// Most collective thrust that the flight code may ask for, over the weight.
    pub fn thrust_to_weight(&self) -> f64 {
        let vehicle = &self.vehicle.vehicle;
        let rotors =
            vehicle.rotor_thrust_max_n() * vehicle.rotors().len() as f64 / vehicle.weight_n();
        let limit = vehicle.parameters().limits.thrust_max_n / vehicle.weight_n();
        self.scenario.thrust_to_weight.unwrap_or(limit).min(rotors)
    }

    /// Flies.
    ///
    /// * `record` - keep a log
    /// * `progress` - called with the time flown, s, ten times a second of flight
    ///
    /// # Errors
    /// A setup that cannot be used, or a plant that left the finite numbers.
    pub fn fly(&self, record: bool, progress: impl FnMut(f64)) -> Result<Flight, FlightError> {
        self.scenario.check().map_err(FlightError)?;
        if self.arm.plans() {
            let name = self.arm.name();
            return Err(FlightError(format!(
                "arm = {name}: needs its planner, which is no part of the flight code"
            )));
        }
        self.fly_on(&mut InProcess::new(self.stack()?), None, record, progress)
    }

    /// As [`Setup::fly`], with the flight code on `computer`, which has this setup's
    /// [`Setup::stack`].
    ///
    /// * `pilot` - commands instead of the flight code's outer loop
    ///
    /// # Errors
    /// As [`Setup::fly`], and where the computer does not answer.
    pub fn fly_on(
        &self,
        computer: &mut dyn FlightComputer,
        pilot: Option<&mut dyn Offboard>,
        record: bool,
        progress: impl FnMut(f64),
    ) -> Result<Flight, FlightError> {
        let recording = if record { Recording::Whole } else { Recording::None };
        self.fly_recorded(computer, pilot, recording, progress)
    }

    /// As [`Setup::fly_on`], where somebody may take what is recorded.
    ///
    /// # Errors
    /// As [`Setup::fly_on`], and what who takes it says.
    pub fn fly_recorded(
        &self,
        computer: &mut dyn FlightComputer,
        mut pilot: Option<&mut dyn Offboard>,
        recording: Recording<'_>,
        mut progress: impl FnMut(f64),
    ) -> Result<Flight, FlightError> {
        self.check()?;
        let dt_s = PLANT_STEP_US as f64 * 1e-6;
        let plant_with = |effects| {
            let (wing, battery) =
                (self.arm.plant_wing(&self.vehicle.wing), self.vehicle.battery.clone());
            Plant::new(self.vehicle.vehicle, effects, wing, battery, dt_s).map_err(FlightError)
        };
        let well = plant_with(self.effects())?;
        let mut failing = Failing::new(&self.scenario);
        let weak = failing.weakened(well.effects())?.map(plant_with).transpose()?;
        let plant_at = |failing: &Failing, time_us| match &weak {
            Some(weak) if failing.is_weak(time_us) => weak,
            _ => &well,
        };
        let plant = &well;
        let mut obstacles = Surroundings::new(self.scenario.all_obstacles());
        let mut mover = Mover::new(self, obstacles.all())?;
        let mut state = plant.initial_state(self.hovering(plant), self.scenario.start_charge());
        let seed = self.scenario.seed;
        let mut winds =
            Wind::of_flight(self.scenario.wind(), &self.vehicle.vehicle, plant.effects(), seed);
        let mut air = velocity_of(&winds);
        let mut sensors = Sensors::new(self.sensors(), plant.effects(), seed);
        let mut metrics = metrics::Meter::new(&self.scenario);
        let rotors = plant.vehicle().rotors().len();
        let mut recorder = record::Recorder::new(self, pilot.as_deref(), rotors, recording)?;
        let hover = Command { rotor: [hover_command(plant.vehicle()); MAX_ROTORS], wing: [0.0; 2] };
        let mut commands = CommandLine::new(plant.effects().command_latency_s(), hover);
        let (mut tick, mut last_tick_us) = (0u64, 0u64);
        let mut contact_specific_force: Option<In<Ned, f64>> = None;
        let mut believed: Option<NavigationTerms> = None;
        let estimates = self.vehicle.estimator.is_filter();
        let steps = (self.scenario.duration_s / dt_s).round() as u64;
        for step in 0..=steps {
            let time_us = step * PLANT_STEP_US;
            let plant = plant_at(&failing, time_us);
            if time_us * CONTROL_RATE_HZ >= tick * 1_000_000 {
                let through_air =
                    state.body.velocity - total_wind(plant.acting(), &state.body, air);
                let height_m = -state.body.position.vector.z;
                for wind in &mut winds {
                    let passed_s = (time_us - last_tick_us) as f64 * 1e-6;
                    wind.advance(passed_s, || Meeting { through_air, height_m });
                }
                air = velocity_of(&winds);
                state.air_omega = winds.iter().find_map(Wind::angular_velocity);
                let mut truth = truth(plant, &state, air);
                if let Some(push) = contact_specific_force {
                    truth.specific_force = state.body.ned_from_body().inverse() * push;
                }
                let (mut frame, logged) = sensors.poll(time_us, &truth);
                failing.spoil(&mut frame);
                frame.set_obstacles(&obstacles.seen(&state.body, believed.as_ref()));
                if self.arm.is_given_the_force() {
                    let as_if_spread =
                        state.body.ned_from_body() * plant.wing_force(&state, air, [1.0; 2]);
                    frame.wing_force = Some(In::new(as_if_spread.vector.map(|x| x as f32)));
                }
                if let Some(pilot) = &mut pilot {
                    let known = if estimates { seen(&frame, believed.as_ref()) } else { frame };
                    frame.command = pilot.command(tick, &known);
                }
                let (output, met) = computer.step(&frame)?;
                believed = output.navigation.or(believed);
                let encounters = pilot.as_ref().map_or(met, |pilot| met.max(pilot.encounters()));
                if !state.body.is_finite() {
                    // A plant that left the numbers has nothing more to tell.
                    return Err(self.fails_at(time_us, "the vehicle's state is not finite"));
                }
                commands.send(time_us, Command::of(&output));
                let followed = pilot.as_ref().and_then(|pilot| pilot.reference());
                let reference = followed.unwrap_or(output.reference);
                metrics.tick(&state, &frame, &output, &reference, encounters, &mut obstacles);
                if let Some(recorder) = &mut recorder {
                    recorder.followed(time_us, followed.as_ref(), pilot.as_deref());
                    recorder.tick(
                        &frame,
                        &logged,
                        &output,
                        &state,
                        total_wind(plant.acting(), &state.body, air),
                        plant.wing_force(&state, air, state.deployment()),
                    )?;
                }
                if tick % (CONTROL_RATE_HZ / 10) == 0 {
                    progress(time_us as f64 * 1e-6);
                }
                if metrics.is_over() {
                    break;
                }
                (tick, last_tick_us) = (tick + 1, time_us);
            }
            let before = state.body.velocity;
            let mut command = commands.acting(time_us);
            failing.hold(time_us, &mut command);
            let moved = mover.step(plant, &mut state, &command.rotor, command.wing, air);
            let contact = moved.map_err(|e| self.fails_at(time_us, &e.0))?;
            metrics.contact(contact, before.vector.norm());
            // While something pushes back, an accelerometer reads the whole change of velocity less
            // gravity.
            contact_specific_force = (contact == integrator::Contact::Touching).then(|| {
                (state.body.velocity - before) * (1.0 / dt_s) - In::new(Vector3::z() * GRAVITY_M_S2)
            });
        }
        let log = recorder.map_or(Ok(None), record::Recorder::finish)?;
        Ok(Flight { metrics: metrics.finish(), log })
    }

    /// What went wrong in a flight, of which vehicle and when.
    fn fails_at(&self, time_us: u64, problem: &str) -> FlightError {
        let (vehicle, time_s) = (&self.vehicle.name, time_us as f64 * 1e-6);
        FlightError(format!("{vehicle}: at {time_s:.3} s: {problem}"))
    }

    /// At the start of the mission, level, rotors at hover speed.
    fn hovering(&self, plant: &Plant) -> State<f64> {
        let vehicle = plant.vehicle();
        let speed = vehicle.parameters().propulsion.target_speed_rad_s(hover_command(vehicle));
        let mut state = State::at_rest();
        state.position = self.start_position();
        state.rotor_speed_rad_s[..vehicle.rotors().len()].fill(speed);
        state
    }
}

/// The command of each rotor that carries the weight.
fn hover_command(vehicle: &Vehicle<f64>) -> f64 {
    let share = vehicle.weight_n() / vehicle.rotors().len() as f64;
    vehicle.parameters().propulsion.command_for_thrust(share)
}

/// A frame with what the flight code believes instead of what sensors say: for who commands from
/// outside.
fn seen(frame: &SensorFrame, believed: Option<&NavigationTerms>) -> SensorFrame {
    let mut seen = SensorFrame::empty(frame.time_us);
    seen.set_obstacles(frame.obstacles());
    if let Some(terms) = believed {
        seen.attitude = Some(terms.ned_from_body);
        seen.gnss = Some(Gnss { position: terms.position, velocity: terms.velocity });
        seen.imu = frame.imu.map(|imu| Imu { omega: imu.omega - terms.gyro_bias, ..imu });
    }
    seen
}

/// Velocity of the air, m/s.
fn velocity_of(winds: &[Wind]) -> In<Ned, f64> {
    winds.iter().fold(In::zero(), |sum, wind| sum + wind.velocity())
}

fn truth(plant: &Plant, state: &PlantState, air: In<Ned, f64>) -> Truth {
    let through_air = state.body.velocity - total_wind(plant.acting(), &state.body, air);
    Truth {
        position: state.body.position,
        velocity: state.body.velocity,
        through_air: state.body.ned_from_body().inverse() * through_air,
        ned_from_body: state.body.ned_from_body(),
        omega: state.body.omega,
        specific_force: specific_force(
            plant.vehicle(),
            plant.effects(),
            state.body.omega,
            &plant.wrench(state, air),
        ),
        rotor_speed_rad_s: state.body.rotor_speed_rad_s,
        rotor_count: plant.vehicle().rotors().len(),
        rotor_load: plant.vehicle().rotor_load(&state.body.rotor_speed_rad_s),
        deployment: state.deployment(),
        voltage_v: state.battery.voltage_v,
        current_a: state.battery.current_a,
    }
}
