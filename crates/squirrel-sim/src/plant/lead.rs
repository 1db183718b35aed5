//! The plant led along a measured motion: what it says there, without integrating the rigid body.
//!
//! A residual of a flight compares what sensors measured with what the model says at the measured
//! motion. Only what is not measured moves by itself here: rotors and wing servos by their exact
//! solutions, the membrane by RK4 in steps that its own time constants allow. A call costs less
//! than one RK4 step and may span any time.
//!
//! A slung load swings with the vehicle's acceleration, which is taken from successive measured
//! velocities: their difference is the mean acceleration that the load of the flying plant felt
//! too, so that a perfect log gives the same swing, while the model's own prediction would feed
//! each of its errors to the load. It is known when the next motion arrives.

use super::{Membrane, Plant, PlantState, WingPlant, lead_servos};
use squirrel_core::aero::Air;
use squirrel_core::dynamics::servo::Servo;
use squirrel_core::dynamics::{self, RotorDrive, State, rk4};
use squirrel_core::effects::Swing;
use squirrel_core::frames::{Body, In, Wrench};
use squirrel_core::rnn::parnn::{STEP_S, WINDOW};
use squirrel_core::vehicle::PerRotor;

/// What a led plant says at a measured motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Led {
    /// Force and moment without gravity, N and N m.
    pub wrench: Wrench<Body, f64>,
    /// What the accelerometer reads, m/s^2, its scale and bias by effects included.
    pub specific_force: In<Body, f64>,
    /// Angular acceleration, rad/s^2.
    pub angular_acceleration: In<Body, f64>,
}

/// The rotors at one moment of a led flight: what depends on commands, voltage and their lags
/// alone, so that plants which share those can be led along the same ones.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rotors {
    speed_rad_s: PerRotor<f64>,
    drive: RotorDrive<f64>,
}

impl PlantState {
    /// The rotors as they are at another moment.
    pub fn take_rotors(&mut self, rotors: &Rotors) {
        self.body.rotor_speed_rad_s = rotors.speed_rad_s;
        self.drive = rotors.drive;
    }
}

impl Plant {
    /// What the plant says at a measured motion, in air that moves only by effects; then moves on
    /// what is not measured (rotors, wing servos, membrane, slung load) under held commands. The
    /// battery is not stepped: its voltage is measured.
    ///
    /// Of the effects on sensors only those on the accelerometer are in the answer; command
    /// latency, clocks and the other sensors belong to whoever reads the measurements.
    ///
    /// * `motion` - measured; its rotor speeds are not looked at
    /// * `rotor_command` - in the vehicle's unit; `wing_command` - left, right, 0..1
    /// * `dt_s` - time until the next motion, of any length, not below 0
    pub fn lead(
        &self,
        state: &mut PlantState,
        motion: &State<f64>,
        rotor_command: &PerRotor<f64>,
        wing_command: [f64; 2],
        battery_voltage_v: f64,
        dt_s: f64,
    ) -> Led {
        let rotors = self.tell(state, rotor_command, battery_voltage_v);
        let swing = self.load.map(|load| load.over(state.led_s));
        self.meet(state, motion, &rotors, swing.as_ref());
        let (led, before) = (self.led(state), state.deployment());
        self.lead_rotors(state, dt_s);
        if let Some(over) = self.servos().filter(|_| dt_s > 0.0) {
            lead_servos(&over(dt_s), &mut state.servo, wing_command, dt_s);
        }
        self.pass(state, Some([before, state.deployment()]), dt_s);
        led
    }

    /// Tells the rotors of a state a command; the rotors as they are then.
    ///
    /// * arguments as in [`Self::lead`]
    pub fn tell(
        &self,
        state: &mut PlantState,
        rotor_command: &PerRotor<f64>,
        battery_voltage_v: f64,
    ) -> Rotors {
        state.battery.voltage_v = battery_voltage_v;
        self.drive(state, rotor_command);
        Rotors { speed_rad_s: state.body.rotor_speed_rad_s, drive: state.drive }
    }

    /// Moves the rotors alone, under the command that they were told.
    ///
    /// * `dt_s` - of any length; nothing moves if it is not above 0
    pub fn lead_rotors(&self, state: &mut PlantState, dt_s: f64) {
        if dt_s > 0.0 {
            let drive = state.drive;
            drive.lead(&mut state.body.rotor_speed_rad_s, dt_s);
        }
    }

    /// The wing servos over steps of a length, s; `None` without wings.
    pub fn servos(&self) -> Option<impl Fn(f64) -> Servo<f64> + use<>> {
        let extra_s = self.effects.wing_extra_time_constant_s();
        self.wing.servo().map(|servo| move |dt_s| servo.over(extra_s, dt_s))
    }

    /// Puts a state into a measured motion with the rotors as they are there; a slung load has swung
    /// until then.
    ///
    /// * `swing` - over the time since the last motion, where there is a load
    pub fn meet(
        &self,
        state: &mut PlantState,
        motion: &State<f64>,
        rotors: &Rotors,
        swing: Option<&Swing<f64>>,
    ) {
        if let Some(swing) = swing.filter(|_| state.led_s > 0.0) {
            let acceleration = (motion.velocity - state.body.velocity) * (1.0 / state.led_s);
            swing.lead(&mut state.load, acceleration.vector.into());
        }
        state.body = *motion;
        state.take_rotors(rotors);
    }

    /// What the plant says at the motion that a state has met.
    pub fn led(&self, state: &PlantState) -> Led {
        let wrench = self.wrench(state, In::zero());
        let specific_force =
            dynamics::specific_force(&self.vehicle, &self.effects, state.body.omega, &wrench);
        Led {
            wrench,
            specific_force: self.read(specific_force, state.time_s),
            angular_acceleration: dynamics::angular_acceleration(
                &self.vehicle,
                state.body.omega,
                &wrench,
            ),
        }
    }

    /// What the accelerometer makes of a specific force.
    pub(super) fn read(&self, specific_force: In<Body, f64>, time_s: f64) -> In<Body, f64> {
        if !self.effects.any() {
            return specific_force;
        }
        let scale = self.effects.accel_scale().vector.add_scalar(1.0);
        In::new(specific_force.vector.component_mul(&scale))
            + self.effects.specific_force_bias(time_s)
    }

    /// Time after which nothing is left of what the wings went through, s.
    pub fn wing_memory_s(&self) -> f64 {
        match &self.wing {
            WingPlant::None | WingPlant::Flat { .. } => 0.0,
            WingPlant::Membrane { membrane, .. } => {
                let p = membrane.parameters();
                8.0 * (p.camber_time_constant_s + p.creep_time_constant_s + 4.0 * p.chord_m)
            }
            WingPlant::Parnn { .. } => WINDOW as f64 * f64::from(STEP_S),
        }
    }

    /// Lets time pass until the next motion: what is neither measured nor an actuator moves on.
    ///
    /// * `deployment` - of the wings, left and right, at the beginning and the end; `None` if they
    ///   are folded and stay so for longer than [`Self::wing_memory_s`], which saves most of the
    ///   time
    pub fn pass(&self, state: &mut PlantState, deployment: Option<[[f64; 2]; 2]>, dt_s: f64) {
        state.led_s = dt_s;
        state.time_s += dt_s;
        let Some([before, after]) = deployment.filter(|_| dt_s > 0.0) else { return };
        let air = || self.air(state, In::zero());
        match &self.wing {
            WingPlant::None | WingPlant::Flat { .. } => {}
            WingPlant::Membrane { membrane, .. } => {
                let deployment = [0, 1].map(|side| 0.5 * (before[side] + after[side]));
                let air = air();
                self.lead_membrane(state, membrane, &air, deployment, dt_s);
            }
            WingPlant::Parnn { parnn, .. } => {
                let air = air();
                parnn.pass(&mut state.parnn, &air, dt_s);
            }
        }
    }

    fn lead_membrane(
        &self,
        state: &mut PlantState,
        membrane: &Membrane,
        air: &Air<f64>,
        deployment: [f64; 2],
        dt_s: f64,
    ) {
        state.turn_wings(membrane.angle_of_attack(air), dt_s);
        // A quarter of the shortest lag is far inside what RK4 follows; after many of the longest
        // the wing has settled.
        let span_s = dt_s.min(self.wing_memory_s());
        let steps = (4.0 * span_s / membrane.parameters().camber_time_constant_s).ceil();
        for _ in 0..steps as usize {
            state.membrane = rk4(state.membrane, span_s / steps, |s| {
                membrane.evaluate(air, state.wing_angle_rate_rad_s, deployment, s).1
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle_file::{SQUIRREL_TOML, VehicleFile};
    use squirrel_core::nalgebra::Vector3;
    use std::convert::Infallible;

    const STEP_S: f64 = 1e-3;
    const EFFECTS: &str = "[effects.linear_drag]\nextra_drag_n_s_per_m = 0.1\n[effects.motor_lag]\n\
        extra_time_constant_s = 0.02\n[effects.cg_offset]\ncg_x_m = 0.005\ncg_y_m = -0.004\n\
        [effects.battery_sag]\nvoltage_exponent = 0.8\n[effects.payload_swing]\nmass_kg = 0.05\n\
        length_m = 0.6\n[effects.wing_servo_lag]\nextra_time_constant_s = 0.1\n[effects.wing_membrane]\n\
        gain = 0.2\nangle_of_attack_offset_rad = 0.05\n[effects.rotor_gyro_torque]\n\
        rotor_inertia_kg_m2 = 1e-5\n[effects.added_mass]\nmass_kg = 0.05\n";

    fn plant(model: &str, effects: &str) -> Plant {
        let text = match model {
            "flat" => SQUIRREL_TOML.replace("model = \"membrane\"", "model = \"flat\""),
            _ => SQUIRREL_TOML.to_owned(),
        };
        let file = VehicleFile::parse(&format!("{text}\n{effects}"), "test").unwrap();
        let wing = if model == "none" { WingPlant::None } else { file.wing };
        Plant::new(file.vehicle, file.effects, wing, None, STEP_S).unwrap()
    }

    /// Commands that change every 40 ms and open and close the wings.
    fn command(step: usize) -> (PerRotor<f64>, [f64; 2]) {
        let k = (step / 40) as f64;
        let rotor = [0, 1, 2, 3, 4, 5, 6, 7].map(|i| 0.5 + 0.01 * (k + 1.7 * f64::from(i)).sin());
        (rotor, if (step / 200).is_multiple_of(2) { [1.0, 0.8] } else { [0.0, 0.1] })
    }

    /// Largest difference of force, N, and moment, N m, between a plant that steps and one led
    /// along it.
    fn worst(plant: &Plant, stride: usize) -> (f64, f64) {
        let mut start = State::at_rest();
        start.velocity = In::new(Vector3::new(5.0, 1.0, 0.5));
        start.rotor_speed_rad_s[..4].fill(1500.0);
        let mut truth = plant.initial_state(start, 1.0);
        let mut state = truth;
        let (mut force, mut moment) = (0.0_f64, 0.0_f64);
        for step in 0..600 {
            let (rotor, wing) = command(step);
            if step % stride == 0 {
                let unmeasured = State { rotor_speed_rad_s: [f64::NAN; 8], ..truth.body };
                let led = plant.lead(
                    &mut state,
                    &unmeasured,
                    &rotor,
                    wing,
                    truth.battery.voltage_v,
                    STEP_S * stride as f64,
                );
                let (mut was, mut copy) = (Wrench::zero(), truth);
                let Ok(()) = plant.step_with::<Infallible>(
                    &mut copy,
                    &rotor,
                    wing,
                    In::zero(),
                    |body, w| {
                        was = *w;
                        Ok(*body)
                    },
                );
                force = force.max((led.wrench.force - was.force).vector.norm());
                moment = moment.max((led.wrench.moment - was.moment).vector.norm());
                let rate = plant.vehicle().inertia_inverse() * led.wrench.moment.vector;
                let spin = plant.vehicle().parameters().inertia_kg_m2 * truth.body.omega.vector;
                let gyroscopic =
                    plant.vehicle().inertia_inverse() * truth.body.omega.vector.cross(&spin);
                assert!((led.angular_acceleration.vector - (rate - gyroscopic)).norm() < 1e-9);
            }
            plant.step(&mut truth, &rotor, wing, In::zero());
        }
        (force, moment)
    }

    #[test]
    fn leading_along_a_flight_gives_its_wrench() {
        for effects in ["", EFFECTS] {
            for model in ["none", "flat"] {
                for stride in [1, 8, 40] {
                    let (force, moment) = worst(&plant(model, effects), stride);
                    // Over several steps the load has felt their mean acceleration and tension, and
                    // wings their mean lag.
                    let force_max = if stride == 1 || effects.is_empty() { 1e-9 } else { 4e-3 };
                    assert!(force < force_max, "{model}, {stride}: {force:e} N");
                    assert!(moment < 1e-9, "{model}, {stride}: {moment:e} N m");
                }
            }
            // Between samples the membrane does not see the air change.
            for (stride, force_max) in [(1, 5e-3), (8, 0.03)] {
                let (force, _) = worst(&plant("membrane", effects), stride);
                assert!(force < force_max, "{stride}: {force:e} N");
            }
        }
    }

    #[test]
    fn no_time_moves_nothing_and_long_times_settle() {
        for model in ["none", "flat", "membrane"] {
            let plant = plant(model, "");
            let mut motion = State::at_rest();
            motion.velocity = In::new(Vector3::new(4.0, 0.0, 1.0));
            let start = plant.initial_state(motion, 1.0);
            let mut state = start;
            plant.lead(&mut state, &motion, &[0.5; 8], [1.0; 2], start.battery.voltage_v, 0.0);
            assert_eq!(state.body, start.body, "{model}");
            assert_eq!((state.servo, state.membrane), (start.servo, start.membrane), "{model}");
            plant.lead(&mut state, &motion, &[0.5; 8], [1.0; 2], 14.8, 1e9);
            plant.lead(&mut state, &motion, &[0.5; 8], [1.0; 2], 14.8, 1e9);
            assert!((state.body.rotor_speed_rad_s[0] - 1500.0).abs() < 1e-9);
            let spread = if model == "none" { [0.0; 2] } else { [1.0; 2] };
            assert_eq!(state.deployment(), spread);
            assert!(plant.wrench(&state, In::zero()).force.vector.iter().all(|x| x.is_finite()));
        }
    }
}
