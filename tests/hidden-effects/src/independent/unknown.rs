//! Equations of what no catalogue has.

use super::features;
use super::state::State;
use crate::airframe::GRAVITY_M_S2;
use crate::outside::{Formula, Makes, Outside};
use nalgebra::{Matrix3, Vector3, Vector4};
use std::f64::consts::TAU;

/// What the equations may look at.
#[derive(Debug, Clone, Copy)]
pub(super) struct Motion<'a> {
    pub(super) time_s: f64,
    pub(super) state: &'a State,
    pub(super) rotation: &'a Matrix3<f64>,
    pub(super) air_body: Vector3<f64>,
    /// Mean command of the rotors, and what it is in hover.
    pub(super) throttle: f64,
    pub(super) hover_throttle: f64,
}

/// What they do.
#[derive(Debug, Clone, Copy)]
pub(super) struct Action {
    pub(super) force_ned: Vector3<f64>,
    pub(super) force_body: Vector3<f64>,
    pub(super) moment_body: Vector3<f64>,
    pub(super) thrust_factor: f64,
    pub(super) mass_factor: f64,
    pub(super) weak_rotor: Option<usize>,
    pub(super) weak_loss: f64,
    /// Deployment at which both wings are held.
    pub(super) jammed_wings: Option<f64>,
    pub(super) memory_rate: Vector4<f64>,
}

impl Default for Action {
    fn default() -> Self {
        Self {
            force_ned: Vector3::zeros(),
            force_body: Vector3::zeros(),
            moment_body: Vector3::zeros(),
            thrust_factor: 1.0,
            mass_factor: 1.0,
            weak_rotor: None,
            weak_loss: 0.0,
            jammed_wings: None,
            memory_rate: Vector4::zeros(),
        }
    }
}

/// Height of the places in the air, m: that of most manoeuvres.
const PLACE_HEIGHT_M: f64 = 3.0;
/// Of the sloshing tank, m.
const TANK_HEIGHT_M: f64 = 0.15;

pub(super) fn act(outside: &Outside, motion: &Motion<'_>) -> Action {
    let mut action = Action::default();
    let (state, time_s) = (motion.state, motion.time_s);
    let position = state.position;
    let towards =
        |north: f64, east: f64, height: f64| Vector3::new(north, east, -height) - position;
    match *outside {
        Outside::MassLost { mass_fraction, at_s } => {
            if time_s >= at_s {
                action.mass_factor = 1.0 - mass_fraction;
            }
        }
        Outside::Tether { stiffness_n_per_m, length_m, north_m, east_m } => {
            let line = towards(north_m, east_m, 0.0);
            let stretch = line.norm() - length_m;
            if stretch > 0.0 {
                // A worn cord: stiff at first, then yielding, so that a long dash does not tear the
                // vehicle down.
                let pull = stiffness_n_per_m * 6.0 * (stretch / 6.0).tanh();
                action.force_ned = line / line.norm() * pull;
            }
        }
        Outside::Magnet { force_n, reach_m, north_m, east_m } => {
            let line = towards(north_m, east_m, PLACE_HEIGHT_M) / reach_m;
            action.force_ned = force_n * line * (0.5 - 0.5 * line.norm_squared()).exp();
        }
        Outside::RotorStep { rotor, loss_fraction, at_s } => {
            action.weak_rotor = (time_s >= at_s).then_some(rotor);
            action.weak_loss = loss_fraction;
        }
        Outside::VibrationLine { frequency_hz, force_n, direction_rad } => {
            let force = force_n * (TAU * frequency_hz * time_s).sin();
            action.force_body = force * Vector3::new(direction_rad.cos(), direction_rad.sin(), 0.0);
        }
        Outside::Updraft { force_n, radius_m, north_m, east_m } => {
            let line = towards(north_m, east_m, 0.0).xy() / radius_m;
            action.force_ned.z = -force_n * (-line.norm_squared()).exp();
        }
        Outside::YawRateThrust { gain_s_per_rad } => {
            action.thrust_factor = 1.0 + gain_s_per_rad * state.omega.z;
        }
        Outside::WingFlutter { frequency_hz, gain_n_s2_per_m2 } => {
            let size = gain_n_s2_per_m2 * motion.air_body.norm_squared() * state.deployment.mean();
            let swing = (TAU * frequency_hz * time_s).sin();
            action.force_body.z = size * swing;
            action.moment_body.x = 0.04 * size * swing;
        }
        Outside::ThrustHeating { loss_fraction, time_constant_s } => {
            action.thrust_factor = 1.0 - loss_fraction * (1.0 - (-time_s / time_constant_s).exp());
        }
        Outside::RotorInterference { slope, above_hover } => {
            let above = motion.throttle - motion.hover_throttle - above_hover;
            action.thrust_factor = 1.0 - slope * above.clamp(0.0, 0.2);
        }
        Outside::HeadingSideForce { force_n, phase_rad } => {
            let heading = motion.rotation[(1, 0)].atan2(motion.rotation[(0, 0)]);
            action.force_body.y = force_n * (2.0 * heading + phase_rad).sin();
        }
        Outside::Slosh { frequency_hz, mass_kg } => {
            // The liquid's place, forward and right, swings as the tank turns about it; its weight
            // tips the vehicle.
            let natural = TAU * frequency_hz;
            let [x, y, x_rate, y_rate] =
                [state.memory.x, state.memory.y, state.memory.z, state.memory.w];
            let drive = TANK_HEIGHT_M * natural * Vector3::new(state.omega.y, -state.omega.x, 0.0);
            let back = |place: f64, rate: f64| -natural * natural * place - 0.3 * natural * rate;
            action.memory_rate =
                Vector4::new(x_rate, y_rate, drive.x + back(x, x_rate), drive.y + back(y, y_rate));
            action.moment_body = mass_kg * GRAVITY_M_S2 * Vector3::new(y, -x, 0.0);
        }
        // Acts on the commands, before the motors.
        Outside::MotorStiction { .. } => {}
        Outside::YawMemory { damping_n_m_s_per_rad, memory_s } => {
            action.memory_rate.x = (state.omega.z - state.memory.x) / memory_s;
            let side = if state.memory.x > 0.0 { 1.0 } else { 0.5 };
            action.moment_body.z = -damping_n_m_s_per_rad * side * state.memory.x;
        }
        Outside::MomentSwitch { roll_n_m, pitch_n_m, at_s } => {
            if time_s >= at_s {
                action.moment_body = Vector3::new(roll_n_m, pitch_n_m, 0.0);
            }
        }
        Outside::Wall { force_n, reach_m, distance_m, direction_rad } => {
            let normal = Vector3::new(direction_rad.cos(), direction_rad.sin(), 0.0);
            // Behind the wall the pull is that at the wall: the wall itself is not in the way.
            let gap = (distance_m - normal.dot(&position)).abs();
            action.force_ned = normal * (force_n * (-gap / reach_m).exp());
        }
        Outside::WingJam { deployment, from_s } => {
            action.jammed_wings = (time_s >= from_s).then_some(deployment);
        }
        Outside::Formula(formula) => by_formula(&formula, motion, &mut action),
    }
    action
}

/// The sums follow motion and commands behind a lag: the state's memory.
fn by_formula(formula: &Formula, motion: &Motion<'_>, action: &mut Action) {
    let (x, memory) = (features::of(motion), motion.state.memory);
    let rate = |weights, now: f64| (features::dot(weights, &x) - now) / formula.lag_s;
    action.memory_rate.x = rate(&formula.first, memory.x);
    action.memory_rate.y = rate(&formula.second, memory.y);
    let open = formula.gate.map_or(1.0, |gate| 0.5 + 0.5 * (4.0 * features::dot(&gate, &x)).tanh());
    let size = formula.size * open * formula.of(memory.x, memory.y);
    let along = size * Vector3::from(formula.axis);
    match formula.makes {
        Makes::BodyForce => action.force_body = along,
        Makes::NedForce => action.force_ned = along,
        Makes::Moment => action.moment_body = along,
        Makes::ThrustFactor => action.thrust_factor = 1.0 + size,
    }
}
