//! The plant: what really flies. Rigid body and rotors by RK4, wings, battery, servos, wind. f64.
//!
//! One step holds the commands, the battery voltage, the wind and the pull of a slung load, and
//! integrates rigid body, rotor speeds and membrane together by RK4. Battery, servos, load and wind
//! are stepped exactly beside it.

mod battery;
mod jacobian;
mod lead;
mod membrane;
mod parnn_wing;
mod servo;
mod side_by_side;
mod wind;

pub use battery::{BatteryParameters, BatteryState};
pub use jacobian::{Jacobian, VARIABLES};
pub use lead::{Led, Rotors};
pub use membrane::{Membrane, MembraneParameters, MembraneState};
pub use parnn_wing::{ParnnWing, ParnnWingState};
pub use servo::{ServoParameters, ServoState, lead_servos};
pub use side_by_side::SideBySide;
pub use wind::{GustModel, Meeting, Wind, WindParameters};

use squirrel_core::aero::Air;
use squirrel_core::aero::flat_plate;
use squirrel_core::dynamics::battery::{Pack, shaft_power_w};
use squirrel_core::dynamics::servo::Servo;
use squirrel_core::dynamics::{self, Held, RotorDrive, State, VectorSpace, rk4};
use squirrel_core::effects::{Acting, Effects, Pendulum, PendulumState, Swing};
use squirrel_core::frames::{Body, In, Ned, Wrench};
use squirrel_core::vehicle::{PerRotor, Vehicle, Wing};

/// How the wings of the plant behave. Independent of what the controller believes.
#[derive(Debug, Clone, PartialEq)]
pub enum WingPlant {
    /// No wing.
    None,
    /// The paper's flat plate, left and right.
    Flat {
        /// The wings.
        wing: Wing<f64>,
        /// What moves them.
        servo: ServoParameters,
    },
    /// Silicone membrane.
    Membrane {
        /// The wings.
        membrane: Box<Membrane>,
        /// What moves them.
        servo: ServoParameters,
    },
    /// The paper's network, as in the paper's simulations.
    Parnn {
        /// The wings.
        parnn: Box<ParnnWing>,
        /// What moves them.
        servo: ServoParameters,
    },
}

impl WingPlant {
    /// What moves the wings, where there are any.
    pub fn servo(&self) -> Option<ServoParameters> {
        match self {
            Self::None => None,
            Self::Flat { servo, .. } | Self::Membrane { servo, .. } | Self::Parnn { servo, .. } => {
                Some(*servo)
            }
        }
    }
}

/// Everything of the plant that does not change in flight.
#[derive(Debug, Clone)]
pub struct Plant {
    vehicle: Vehicle<f64>,
    effects: Effects<f64>,
    acting: Acting<f64>,
    wing: WingPlant,
    battery: Option<(BatteryParameters, Pack<f64>)>,
    dt_s: f64,
    servo: Option<Servo<f64>>,
    load: Option<Pendulum<f64>>,
    /// The load over a step.
    swing: Option<Swing<f64>>,
    /// Commands are rotor speeds, rad/s, that the rotors have at once.
    rotor_speeds: bool,
}

/// Everything that changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlantState {
    /// Rigid body and rotors.
    pub body: State<f64>,
    /// Membrane, left and right.
    pub membrane: MembraneState,
    /// What the network saw, where it is the wing.
    pub parnn: ParnnWingState,
    /// Angle of attack of each side at the last step, rad.
    wing_angle_rad: [f64; 2],
    wing_angle_rate_rad_s: [f64; 2],
    /// Left and right servo.
    pub servo: [ServoState; 2],
    /// Battery; constant at the reference voltage for a vehicle without one.
    pub battery: BatteryState,
    /// Time since the flight began, s: effects may drift.
    pub time_s: f64,
    /// The load under the vehicle; at rest without one.
    pub load: PendulumState<f64>,
    /// Angular velocity of the air about the vehicle, rad/s, where it turns: held, as the wind that
    /// comes with each step, until whoever moves the air says another.
    pub air_omega: Option<In<Ned, f64>>,
    /// What the rotors were last told.
    drive: RotorDrive<f64>,
    /// Time from the body's motion to the next measured one, s; 0 unless the plant was led there.
    led_s: f64,
}

impl PlantState {
    /// Deployment of the left and the right wing, 0..1.
    pub fn deployment(&self) -> [f64; 2] {
        self.servo.map(|servo| servo.deployment)
    }

    /// New angles of attack, rad, a step after the last ones: their rate is held until the next.
    fn turn_wings(&mut self, angle_rad: [f64; 2], dt_s: f64) {
        for side in 0..2 {
            self.wing_angle_rate_rad_s[side] = (angle_rad[side] - self.wing_angle_rad[side]) / dt_s;
        }
        self.wing_angle_rad = angle_rad;
    }
}

/// Rigid body and membrane, integrated together.
#[derive(Clone, Copy)]
struct Moving {
    body: State<f64>,
    membrane: MembraneState,
}

impl VectorSpace<f64> for Moving {
    #[inline(always)]
    fn plus_scaled(&self, h: f64, rate: &Self) -> Self {
        Self {
            body: self.body.plus_scaled(h, &rate.body),
            membrane: self.membrane.plus_scaled(h, &rate.membrane),
        }
    }
}

impl Plant {
    /// # Errors
    /// A step that is not positive, or longer than twice a rotor time constant, which RK4 could not
    /// follow.
    pub fn new(
        vehicle: Vehicle<f64>,
        effects: Effects<f64>,
        wing: WingPlant,
        battery: Option<BatteryParameters>,
        dt_s: f64,
    ) -> Result<Self, String> {
        if !(dt_s.is_finite() && dt_s > 0.0) {
            return Err(format!("dt_s = {dt_s}: must be finite and > 0"));
        }
        let p = &vehicle.parameters().propulsion;
        let [extra_up_s, extra_down_s] = effects.rotor_extra_time_constant_s();
        for (key, tau) in [
            ("time_constant_up_s", p.time_constant_up_s + extra_up_s),
            ("time_constant_down_s", p.time_constant_down_s + extra_down_s),
        ] {
            if tau > 0.0 && dt_s > 2.0 * tau {
                return Err(format!(
                    "dt_s = {dt_s}: must be at most twice propulsion.{key} = {tau}, effects included"
                ));
            }
        }
        let vehicle = effects.alter(&vehicle).map_err(|e| format!("with effects, {e}"))?;
        let servo =
            wing.servo().map(|servo| servo.over(effects.wing_extra_time_constant_s(), dt_s));
        let load = effects.pendulum();
        let swing = load.map(|load| load.over(dt_s));
        let battery = battery.map(|battery| {
            let pack = battery.pack(dt_s);
            (battery, pack)
        });
        let acting = Acting::new(&effects, &vehicle);
        let rotor_speeds = false;
        Ok(Self { vehicle, effects, acting, wing, battery, dt_s, servo, load, swing, rotor_speeds })
    }

    /// The airframe, with what effects change of it.
    pub fn vehicle(&self) -> &Vehicle<f64> {
        &self.vehicle
    }
    /// The effects that act.
    pub fn effects(&self) -> &Effects<f64> {
        &self.effects
    }
    /// What of them acts in every step.
    pub fn acting(&self) -> &Acting<f64> {
        &self.acting
    }
    /// Step, s.
    pub fn dt_s(&self) -> f64 {
        self.dt_s
    }

    /// A plant at rest in a given pose, wings folded.
    ///
    /// * `charge` - of the battery, 0..1
    pub fn initial_state(&self, body: State<f64>, charge: f64) -> PlantState {
        let battery = match &self.battery {
            Some((battery, _)) => battery.rested(charge),
            None => BatteryState {
                charge,
                rc_voltage_v: 0.0,
                voltage_v: self.vehicle.parameters().propulsion.reference_voltage_v,
                current_a: 0.0,
            },
        };
        PlantState {
            body,
            membrane: MembraneState::at_rest(),
            parnn: ParnnWingState::new(),
            wing_angle_rad: [0.0; 2],
            wing_angle_rate_rad_s: [0.0; 2],
            servo: [ServoState::at_rest(); 2],
            battery,
            time_s: 0.0,
            load: PendulumState::at_rest(),
            air_omega: None,
            drive: RotorDrive::holding(body.rotor_speed_rad_s),
            led_s: 0.0,
        }
    }

    /// One step by RK4.
    ///
    /// * `rotor_command` - in the vehicle's unit; `wing_command` - left, right, 0..1; `wind` - m/s;
    ///   all held
    pub fn step(
        &self,
        state: &mut PlantState,
        rotor_command: &PerRotor<f64>,
        wing_command: [f64; 2],
        wind: In<Ned, f64>,
    ) {
        self.drive(state, rotor_command);
        self.advance(state, wing_command, wind, |next| next);
    }

    /// One step in which another integrator moves the rigid body: rotors and wings as in
    /// [`Self::step`], while `body` gets the wrench without gravity at the start of the step and
    /// gives the new body. Its rotor speeds are not looked at.
    ///
    /// # Errors
    /// What `body` says.
    pub fn step_with<E>(
        &self,
        state: &mut PlantState,
        rotor_command: &PerRotor<f64>,
        wing_command: [f64; 2],
        wind: In<Ned, f64>,
        body: impl FnOnce(&State<f64>, &Wrench<Body, f64>) -> Result<State<f64>, E>,
    ) -> Result<(), E> {
        self.drive(state, rotor_command);
        let wrench = self.wrench(state, wind);
        let moved = body(&state.body, &wrench)?;
        self.advance(state, wing_command, wind, |next| State {
            rotor_speed_rad_s: next.rotor_speed_rad_s,
            ..moved
        });
        Ok(())
    }

    /// The same plant whose rotor commands are speeds, rad/s, that its rotors have at once: they
    /// were measured.
    #[must_use]
    pub fn told_rotor_speeds(mut self) -> Self {
        self.rotor_speeds = true;
        self
    }

    /// What a command asks of the rotors at a battery's voltage.
    pub fn rotor_drive(
        &self,
        rotor_command: &PerRotor<f64>,
        battery_voltage_v: f64,
    ) -> RotorDrive<f64> {
        if self.rotor_speeds {
            RotorDrive::holding(*rotor_command)
        } else {
            RotorDrive::new(&self.vehicle, &self.acting, rotor_command, battery_voltage_v)
        }
    }

    fn drive(&self, state: &mut PlantState, rotor_command: &PerRotor<f64>) {
        state.drive = self.rotor_drive(rotor_command, state.battery.voltage_v);
        state.drive.settle(&mut state.body.rotor_speed_rad_s);
    }

    #[inline(always)]
    fn held(&self, state: &PlantState, wind: In<Ned, f64>, deployment: [f64; 2]) -> Held<f64> {
        let tether = self.swing.map(|swing| swing.tether(&state.load));
        Held { drive: state.drive, wind, air_omega: state.air_omega, deployment, tether }
    }

    /// Motion of the airframe through the air.
    #[inline(always)]
    fn air(&self, state: &PlantState, wind: In<Ned, f64>) -> Air<f64> {
        let wind = dynamics::total_wind(&self.acting, &state.body, wind);
        dynamics::air(&state.body, wind, state.air_omega)
    }

    #[inline(always)]
    fn advance(
        &self,
        state: &mut PlantState,
        wing_command: [f64; 2],
        wind: In<Ned, f64>,
        body: impl FnOnce(State<f64>) -> State<f64>,
    ) {
        let (vehicle, effects, dt) = (&self.vehicle, &self.acting, self.dt_s);
        let before = state.body;
        let next = match &self.wing {
            WingPlant::None => {
                let held = self.held(state, wind, [0.0; 2]);
                rk4(before, dt, |s| {
                    dynamics::derivative(vehicle, effects, s, &held, |_| Wrench::zero())
                })
            }
            WingPlant::Flat { wing, .. } => {
                let deployment = self.deploy(state, wing_command);
                let held = self.held(state, wind, deployment);
                rk4(before, dt, |s| {
                    dynamics::derivative(vehicle, effects, s, &held, |air| {
                        flat_plate::wing_pair(wing, air, deployment)
                    })
                })
            }
            WingPlant::Membrane { membrane, .. } => {
                let deployment = self.deploy(state, wing_command);
                let held = self.held(state, wind, deployment);
                let air = self.air(state, wind);
                state.turn_wings(membrane.angle_of_attack(&air), dt);
                let rate = state.wing_angle_rate_rad_s;
                let moved = rk4(Moving { body: before, membrane: state.membrane }, dt, |s| {
                    let mut membrane_rate = s.membrane;
                    let body = dynamics::derivative(vehicle, effects, &s.body, &held, |air| {
                        let (wrench, change) =
                            membrane.evaluate(air, rate, deployment, &s.membrane);
                        membrane_rate = change;
                        wrench
                    });
                    Moving { body, membrane: membrane_rate }
                });
                state.membrane = moved.membrane;
                moved.body
            }
            WingPlant::Parnn { parnn, .. } => {
                let deployment = self.deploy(state, wing_command);
                let held = self.held(state, wind, deployment);
                let said = &state.parnn;
                rk4(before, dt, |s| {
                    dynamics::derivative(vehicle, effects, s, &held, |air| {
                        parnn.wrench(said, air, deployment)
                    })
                })
            }
        };
        state.body = body(next).normalised();
        if let WingPlant::Parnn { parnn, .. } = &self.wing {
            let air = self.air(state, wind);
            parnn.pass(&mut state.parnn, &air, dt);
        }
        if let Some((battery, pack)) = &self.battery {
            let k_m = vehicle.parameters().propulsion.torque_coefficient_n_m_s2;
            let power: f64 = before.rotor_speed_rad_s.iter().map(|w| shaft_power_w(k_m, *w)).sum();
            battery.step(pack, &mut state.battery, power, dt);
        }
        if let Some(swing) = &self.swing {
            let acceleration = (state.body.velocity - before.velocity) * (1.0 / dt);
            swing.lead(&mut state.load, acceleration.vector.into());
        }
        state.time_s += dt;
        state.led_s = 0.0;
    }

    /// Mean deployment over a step.
    #[inline(always)]
    fn deploy(&self, state: &mut PlantState, command: [f64; 2]) -> [f64; 2] {
        let Some(servo) = &self.servo else { return [0.0; 2] };
        lead_servos(servo, &mut state.servo, command, self.dt_s)
    }

    /// Wrench of the wings alone at a deployment, left and right.
    fn wing_wrench(
        &self,
        state: &PlantState,
        air: &Air<f64>,
        deployment: [f64; 2],
    ) -> Wrench<Body, f64> {
        match &self.wing {
            WingPlant::None => Wrench::zero(),
            WingPlant::Flat { wing, .. } => flat_plate::wing_pair(wing, air, deployment),
            WingPlant::Membrane { membrane, .. } => {
                membrane.evaluate(air, state.wing_angle_rate_rad_s, deployment, &state.membrane).0
            }
            WingPlant::Parnn { parnn, .. } => parnn.wrench(&state.parnn, air, deployment),
        }
    }

    /// Force and moment on the airframe now, without gravity.
    pub fn wrench(&self, state: &PlantState, wind: In<Ned, f64>) -> Wrench<Body, f64> {
        let deployment = state.deployment();
        let held = self.held(state, wind, deployment);
        dynamics::wrench(&self.vehicle, &self.acting, &state.body, &held, |air| {
            self.wing_wrench(state, air, deployment)
        })
    }

    /// Force of the wings at a deployment, left and right, N: [`PlantState::deployment`] for now, 1
    /// for as if spread.
    pub fn wing_force(
        &self,
        state: &PlantState,
        wind: In<Ned, f64>,
        deployment: [f64; 2],
    ) -> In<Body, f64> {
        let air = self.air(state, wind);
        self.wing_wrench(state, &air, deployment).force
    }
}
