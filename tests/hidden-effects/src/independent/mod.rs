//! The second flight generator: no dynamics, control, sensor or battery code of squirrel's.
//!
//! Heun's rule at 1/1200 s, an autopilot of its own, and the effects from their published
//! equations. What it shares with the rest is the format of logs and vehicle files. An inertial row
//! at `t` holds what was measured at `t`; the commands of that row are in force from `t` on.

mod air;
mod battery;
mod controller;
mod extras;
mod features;
mod physics;
mod programme;
mod sensors;
mod state;
pub(crate) mod twins;
mod unknown;
mod unmodelled;

pub use battery::Pack;
pub use features::FEATURES;
pub(crate) use features::weights;
pub(crate) use programme::DURATION_S;
pub use programme::Excitation;
pub use sensors::white;
pub(crate) use twins::rotor_wash::OF_THRUST;
pub use unmodelled::{Misfit, Unmodelled, unmodelled};
#[cfg(test)]
pub(crate) use unmodelled::{Watched, watched};

use crate::airframe::{Airframe, MAX_ROTORS, SensorErrors};
use crate::catalogue::HiddenEffect;
use crate::draw::{Draw, mix};
use crate::further::Further;
use crate::outside::Outside;
use air::Air;
use battery::Battery;
use controller::{Controller, Estimate};
use extras::Extras;
use nalgebra::{Quaternion, Vector2, Vector3, Vector4};
use physics::{Input, World};
use programme::{Programme, WITH_A_LOAD};
use sensors::Inertial;
use squirrel_log::FlightLog;
use state::State;

/// Rate of the inertial unit and of the autopilot.
const IMU_HZ: f64 = 300.0;
/// Steps of the dynamics between two of its samples.
const STEPS: usize = 4;
/// Ticks flown beyond the log, so that a fast clock has commands to write.
const MARGIN: usize = 60;

/// One flight to be made.
#[derive(Debug, Clone)]
pub struct Order<'a> {
    /// The vehicle as its file states it; the autopilot believes it.
    pub nominal: &'a Airframe,
    /// The individual that flies.
    pub real: &'a Airframe,
    /// Its sensors.
    pub errors: SensorErrors,
    /// Its battery.
    pub pack: Pack,
    /// Hidden effects.
    pub effects: &'a [HiddenEffect],
    /// Hidden physics that no catalogue has.
    pub outside: Option<Outside>,
    /// What is flown.
    pub excitation: Excitation,
    /// What is flown after that.
    pub further: Further,
    /// Factor on the white noise of all sensors.
    pub noise: f64,
    /// Charge at take-off, 0 to 1.
    pub charge: f64,
    /// What nobody has an equation for.
    pub unmodelled: Option<&'a Unmodelled>,
    /// Order of manoeuvres, turbulence and noise.
    pub seed: u64,
}

impl Order<'_> {
    /// Length of the log, s.
    fn duration_s(&self) -> f64 {
        DURATION_S + self.further.duration_s()
    }
}

/// What happened at one tick.
#[derive(Debug, Clone, Copy)]
struct Truth {
    position: Vector3<f64>,
    velocity: Vector3<f64>,
    attitude: Quaternion<f64>,
    specific_force: Vector3<f64>,
    gyro: Vector3<f64>,
    attitude_measured: Quaternion<f64>,
    rotor: [f64; MAX_ROTORS],
    wing: Vector2<f64>,
    voltage_v: f64,
    current_a: f64,
}

/// Flies an order and logs it.
///
/// # Errors
/// The vehicle fell or tumbled: time, height and rate.
pub fn fly(order: &Order<'_>) -> Result<FlightLog, String> {
    let extras = Extras::new(order.effects);
    let world = World {
        airframe: order.real.clone(),
        extras: extras.clone(),
        outside: order.outside,
        unmodelled: order.unmodelled.cloned(),
    };
    let stream = |salt: u64| Draw::new(mix(order.seed, salt));
    let truth = simulate(order, &world, stream, |_, _, _| {})?;
    let mut log = sensors::log(order, &truth, &extras, stream(3));
    // The arrays have room for the largest layout.
    if let Some(command) = log.source_mut("rotor").channels.get_mut("command") {
        let rotors = order.nominal.rotors.len();
        command.values =
            command.values.chunks(MAX_ROTORS).flat_map(|row| row[..rotors].to_vec()).collect();
        command.width = rotors;
    }
    Ok(log)
}

/// * `watch` - sees state and input after every step, and the commands that were sent last
fn simulate(
    order: &Order<'_>,
    world: &World,
    stream: impl Fn(u64) -> Draw,
    mut watch: impl FnMut(&State, &Input, &Truth),
) -> Result<Vec<Truth>, String> {
    let tick_s = 1.0 / IMU_HZ;
    let dt_s = tick_s / STEPS as f64;
    let (excitation, pace) =
        if world.extras.payload_kg > 0.0 { WITH_A_LOAD } else { (order.excitation, 1.0) };
    let mut programme = Programme::new(excitation, order.further, &mut stream(0));
    let mut controller = Controller::new(order.nominal);
    let mut air = Air::new(world.extras.gust, stream(1));
    let mut inertial =
        Inertial::new(order.errors, world.extras.heading_rad, order.noise, stream(2));
    let mut noise = unmodelled::Noise::new(stream(4));
    let mut followed = [order.real.hover_command(); MAX_ROTORS];

    let reference = programme.step(0.0, 0.0);
    let mut state = at_hover(order.real, reference.position, reference.yaw);
    let hover_power = power_w(order.real, &state);
    let mut battery = Battery::new(order.pack, order.charge, hover_power);
    let hover_current = battery.current_a;
    let ticks = (order.duration_s() * IMU_HZ) as usize + MARGIN;
    let mut truth: Vec<Truth> = Vec::with_capacity(ticks);
    let mut input = Input {
        time_s: 0.0,
        rotor: followed,
        wing: Vector2::zeros(),
        voltage_v: battery.voltage_v,
        current_ratio: 1.0,
        moving_air: Vector3::zeros(),
        noise: [0.0; 6],
    };
    for tick in 0..ticks {
        let time_s = tick as f64 * tick_s;
        let wanted = programme.step(pace * time_s, pace * tick_s).slower(pace);
        let (gyro, attitude) = inertial.step(state.omega, state.attitude);
        let estimate =
            Estimate { position: state.position, velocity: state.velocity, attitude, omega: gyro };
        let rotor = controller.step(&estimate, &wanted, tick_s);
        input.time_s = time_s;
        let specific_force = world.rates(&state, &input, 0.0).specific_force;
        truth.push(Truth {
            position: state.position,
            velocity: state.velocity,
            attitude: state.attitude,
            specific_force,
            gyro,
            attitude_measured: attitude.into_inner(),
            rotor,
            wing: wanted.wing,
            voltage_v: battery.voltage_v,
            current_a: battery.current_a,
        });
        for step in 0..STEPS {
            input.time_s = time_s + step as f64 * dt_s;
            let sent = ((input.time_s - world.extras.latency_s) * IMU_HZ + 1e-9).max(0.0) as usize;
            follow(&mut followed, &truth[sent].rotor, world.outside);
            (input.rotor, input.wing) = (followed, truth[sent].wing);
            input.voltage_v = battery.voltage_v;
            input.current_ratio = battery.current_a / hover_current;
            input.moving_air = air.step(dt_s, state.velocity.norm());
            if let Some(unmodelled) = &world.unmodelled {
                input.noise = noise.step(dt_s, unmodelled);
            }
            state = state.heun(dt_s, |s, ahead| world.rates(s, &input, ahead).state);
            battery.step(power_w(order.real, &state), dt_s);
            watch(&state, &input, &truth[tick]);
        }
        let height_m = -state.position.z;
        if !(state.omega.norm() < 25.0 && height_m > -1.0 && height_m < 60.0) {
            return Err(format!(
                "lost at {time_s:.2} s: height {height_m:.2} m, rate {:.1} rad/s",
                state.omega.norm()
            ));
        }
    }
    Ok(truth)
}

/// Motors take the command, or a sticking one only its larger changes.
fn follow(followed: &mut [f64; MAX_ROTORS], command: &[f64; MAX_ROTORS], outside: Option<Outside>) {
    let least = match outside {
        Some(Outside::MotorStiction { command_step }) => command_step,
        _ => 0.0,
    };
    for (now, wanted) in followed.iter_mut().zip(command) {
        if (wanted - *now).abs() >= least {
            *now = *wanted;
        }
    }
}

fn at_hover(airframe: &Airframe, position: Vector3<f64>, yaw: f64) -> State {
    let mut state = State {
        position,
        velocity: Vector3::zeros(),
        attitude: Quaternion::new((0.5 * yaw).cos(), 0.0, 0.0, (0.5 * yaw).sin()),
        omega: Vector3::zeros(),
        rotors: nalgebra::SVector::zeros(),
        deployment: Vector2::zeros(),
        swing: Vector4::zeros(),
        memory: Vector4::zeros(),
    };
    let speed = airframe.hover_command() * airframe.speed_max_rad_s;
    for speed_now in state.rotors.iter_mut().take(airframe.rotors.len()) {
        *speed_now = speed;
    }
    state
}

fn power_w(airframe: &Airframe, state: &State) -> f64 {
    let rotors = airframe.rotors.iter().zip(state.rotors.iter());
    rotors.map(|(rotor, speed)| rotor.torque_coefficient_n_m_s2 * speed.abs().powi(3)).sum()
}

#[cfg(test)]
mod tests;
