//! A vehicle that hovers under its flight code and is shaken: how its attitude loop answers, measured
//! in the plant. Sensors tell the truth, the air is still, wings are folded.

use super::VehicleFile;
use super::margins::STEP_S;
use crate::plant::{Plant, PlantState};
use serde::Serialize;
use squirrel_core::control::AttitudeThrust;
use squirrel_core::control::mixer::{Mixer, ThrustTorque};
use squirrel_core::dynamics::State;
use squirrel_core::estimate::navigator::Navigation;
use squirrel_core::frames::{In, Rotation};
use squirrel_core::guidance::mission::Mission;
use squirrel_core::math::GRAVITY_M_S2;
use squirrel_core::nalgebra::{UnitQuaternion, Vector3};
use squirrel_core::policy::PilotCommand;
use squirrel_core::stack::{Imu, SensorFrame, Stack, StackParameters, StackState};
use squirrel_core::vehicle::Vehicle;

/// Steps of the plant in one of the flight code's.
const PLANT_STEPS: usize = 10;
/// Step of the attitude command by which an answer is measured, rad.
const COMMAND_RAD: f64 = 0.1;
/// For how long the answer is watched, s.
const WATCHED_S: f64 = 3.0;

/// Plant and flight code in closed loop.
#[derive(Debug, Clone)]
pub struct Hovering {
    plant: Plant,
    state: PlantState,
    stack: Stack,
    mixer: Mixer,
    flight_code: StackState,
    tick: u64,
}

/// How attitude follows a step of its command, with the command filter before it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StepAnswer {
    /// From a tenth to nine tenths, s.
    pub rise_s: f64,
    /// Beyond the command, share of it.
    pub overshoot: f64,
    /// Until it stays within a twentieth, s.
    pub settling_s: f64,
}

/// At rest in the air, rotors sharing the weight.
pub(super) fn hovering_body(vehicle: &Vehicle<f64>) -> State<f64> {
    let mut body = State::at_rest();
    let rotors = vehicle.rotors().len();
    let rotor_n = vehicle.weight_n() / rotors as f64;
    let speed = (rotor_n / vehicle.parameters().propulsion.thrust_coefficient_n_s2).sqrt();
    body.rotor_speed_rad_s[..rotors].fill(speed);
    body
}

impl Hovering {
    /// At rest in the air, rotors at the speed of hover.
    ///
    /// # Errors
    /// One line where the vehicle cannot fly.
    pub fn new(file: &VehicleFile) -> Result<Self, String> {
        let vehicle = file.vehicle;
        let Some(control) = file.control else {
            return Err("[control]: missing; the flight code needs gains".to_owned());
        };
        let plant = Plant::new(
            vehicle,
            file.effects,
            file.wing.clone(),
            None,
            STEP_S / PLANT_STEPS as f64,
        )?;
        let state = plant.initial_state(hovering_body(&vehicle), 1.0);
        let parameters = StackParameters { navigation: Navigation::external(), ..control };
        let here = Mission::Hover { position: In::zero() };
        let narrow = vehicle.cast().map_err(|e| e.to_string())?;
        let mixer = Mixer::new(&narrow).map_err(|e| e.to_string())?;
        let stack = Stack::new(narrow, parameters, here).map_err(|e| e.to_string())?;
        Ok(Self { plant, state, stack, mixer, flight_code: StackState::default(), tick: 0 })
    }

    /// One step of the flight code and what the plant makes of it; the torque that was asked for,
    /// N m.
    ///
    /// * `angle_rad` - commanded roll, pitch
    /// * `torque_n_m` - added to what the rotors are asked for
    pub fn step(&mut self, angle_rad: [f64; 2], torque_n_m: &Vector3<f64>) -> Vector3<f64> {
        let mut frame = SensorFrame::empty(self.tick * 1_000_000 / 300);
        self.tick += 1;
        let body = &self.state.body;
        let specific_force = In::new(Vector3::new(0.0, 0.0, -GRAVITY_M_S2 as f32));
        frame.imu =
            Some(Imu { omega: In::new(body.omega.vector.map(|x| x as f32)), specific_force });
        let quaternion = body.ned_from_body().quaternion.into_inner().cast::<f32>();
        frame.attitude = Some(Rotation::new(UnitQuaternion::new_unchecked(quaternion)));
        frame.command = Some(PilotCommand {
            attitude: AttitudeThrust {
                roll_rad: angle_rad[0] as f32,
                pitch_rad: angle_rad[1] as f32,
                thrust_n: self.stack.vehicle().weight_n(),
            },
            wing: 0.0,
        });
        let output = self.stack.control(&mut self.flight_code, &frame);
        let asked = output.inner.map_or(Vector3::zeros(), |inner| inner.demand.torque_n_m);
        let asked = asked.map(f64::from);
        let vehicle = self.stack.vehicle();
        let demand = ThrustTorque {
            thrust_n: vehicle.weight_n(),
            torque_n_m: (asked + torque_n_m).map(|x| x as f32),
        };
        let propulsion = &vehicle.parameters().propulsion;
        let rotors_n = self.mixer.allocate(&demand).rotor_thrust_n;
        let command = rotors_n.map(|n| f64::from(propulsion.command_for_thrust(n)));
        for _ in 0..PLANT_STEPS {
            self.plant.step(&mut self.state, &command, [0.0; 2], In::zero());
        }
        asked
    }

    /// How roll (0) or pitch (1) follows a step of its command.
    pub fn answer(mut self, axis: usize) -> StepAnswer {
        let mut command = [0.0; 2];
        command[axis.min(1)] = COMMAND_RAD;
        let steps = (WATCHED_S / STEP_S) as usize;
        let followed: Vec<f64> = (0..steps)
            .map(|_| {
                self.step(command, &Vector3::zeros());
                let (roll, pitch, _) = self.state.body.ned_from_body().euler();
                [roll, pitch][axis.min(1)] / COMMAND_RAD
            })
            .collect();
        let first = |share: f64| followed.iter().position(|x| *x >= share).unwrap_or(steps);
        let last_off = followed.iter().rposition(|x| (x - 1.0).abs() > 0.05).unwrap_or(0);
        StepAnswer {
            rise_s: (first(0.9) - first(0.1)) as f64 * STEP_S,
            overshoot: followed.iter().fold(0.0, |most, x| f64::max(most, x - 1.0)),
            settling_s: (last_off + 1) as f64 * STEP_S,
        }
    }
}
