//! The equations of motion: rotors, drag, wings, every effect, a rigid body. World NED, body FRD.

use super::extras::{Extras, Ground, Lift, Sag};
use super::features::{self, FEATURES};
use super::state::State;
use super::twins::{Jet, Rotors, Sight, Wings};
use super::unknown::{self, Motion};
use super::unmodelled::Unmodelled;
use crate::airframe::{AIR_DENSITY_KG_M3, Airframe, GRAVITY_M_S2, MAX_ROTORS};
use crate::outside::Outside;
use nalgebra::{Matrix3, Vector2, Vector3, Vector4};

/// What is held over a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Input {
    /// Time at the start of the step, s.
    pub(super) time_s: f64,
    /// Share of the top speed, a number a rotor.
    pub(super) rotor: [f64; MAX_ROTORS],
    /// Left, right, 0 to 1.
    pub(super) wing: Vector2<f64>,
    pub(super) voltage_v: f64,
    /// Over that of hover.
    pub(super) current_ratio: f64,
    /// Turbulence and gusts, NED, m/s.
    pub(super) moving_air: Vector3<f64>,
    /// Unmodelled noise: force x, y, z, N, moment x, y, z, N m.
    pub(super) noise: [f64; 6],
}

/// A vehicle and what acts on it.
#[derive(Debug, Clone)]
pub(super) struct World {
    pub(super) airframe: Airframe,
    pub(super) extras: Extras,
    pub(super) outside: Option<Outside>,
    pub(super) unmodelled: Option<Unmodelled>,
}

/// Rate of the state and what an accelerometer at the geometric centre feels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rates {
    pub(super) state: State,
    pub(super) specific_force: Vector3<f64>,
}

/// Height at which a logarithmic wind has its stated speed, and roughness, m.
const LOG_WIND: [f64; 2] = [3.0, 0.05];

impl World {
    fn wind(&self, height_m: f64) -> Vector3<f64> {
        let wind = self.extras.wind_ned;
        if !self.extras.log_wind {
            return wind;
        }
        let [reference, roughness] = LOG_WIND;
        wind * ((height_m.max(2.0 * roughness) / roughness).ln() / (reference / roughness).ln())
    }

    fn speed_ratio(&self, input: &Input) -> f64 {
        let volts = input.voltage_v / self.airframe.reference_voltage_v;
        match self.extras.sag {
            Sag::None => 1.0,
            Sag::Power(k) => volts.powf(k),
            Sag::Linear(k) => 1.0 + k * (volts - 1.0),
            Sag::LoadDependent(k) => volts.powf(k * (0.6 + 0.4 * input.current_ratio.min(3.0))),
        }
    }

    fn lift_and_ground(&self, across: f64, down: f64, height_m: f64) -> f64 {
        let lift = match self.extras.lift {
            Lift::None | Lift::AtRotors(_) => 0.0,
            Lift::Saturating(k) => k * across * across / (1.0 + 0.004 * across * across),
            Lift::Linear(k) => k * across,
            Lift::Quadratic(k) => k * across * across,
        };
        let ground = match self.extras.ground {
            Ground::None => 1.0,
            Ground::Image(radius) => {
                let ratio = radius / height_m.max(0.5 * radius);
                1.0 / (1.0 - ratio * ratio / 16.0)
            }
            Ground::Exponential(gain, length) => 1.0 + gain * (-height_m.max(0.0) / length).exp(),
        };
        (1.0 + lift) * (1.0 + self.extras.inflow * down) * ground
    }

    /// Force and moment of what the air does at the hub of each rotor.
    fn at_hubs(&self, v: Vector3<f64>, omega: Vector3<f64>, state: &State) -> [Vector3<f64>; 2] {
        let (a, x) = (&self.airframe, &self.extras);
        let (weight_n, rotors) = (a.mass_kg * GRAVITY_M_S2, a.rotors.len() as f64);
        let drag = x.hub_drag + Vector3::z() * (x.hub_inflow * weight_n);
        let hover_rad_s = a.hover_command() * a.speed_max_rad_s;
        let mut sum = [Vector3::zeros(); 2];
        for (i, rotor) in a.rotors.iter().enumerate() {
            let hub = v + omega.cross(&rotor.position_body_m);
            let mut pull = -drag.component_mul(&hub) * (state.rotors[i] / hover_rad_s);
            if let Lift::AtRotors(k) = x.lift {
                pull.z -= k * hub.xy().norm_squared() * weight_n;
            }
            pull /= rotors;
            sum[0] += pull;
            sum[1] += rotor.position_body_m.cross(&pull);
        }
        sum
    }

    /// Force and moment of the wings.
    fn wings(&self, v: Vector3<f64>, roll_rate: f64, deployment: Vector2<f64>) -> (f64, f64) {
        let (a, x) = (&self.airframe, &self.extras);
        let speed = v.norm();
        let gain = if x.wing_gain_speed_m_s > 0.0 {
            x.wing_gain * (speed / x.wing_gain_speed_m_s).min(1.0)
        } else {
            x.wing_gain
        };
        let scale = 0.5 * AIR_DENSITY_KG_M3 * a.wing_area_m2 * a.wing_slope * (1.0 + gain) * speed;
        let side = |sign: f64, open: f64, loss: f64| {
            scale
                * (v.z + sign * a.wing_arm_m * roll_rate + x.wing_angle_rad * v.x)
                * open
                * (1.0 - loss)
        };
        let left = side(-1.0, deployment.x, x.wing_loss[0]);
        let right = side(1.0, deployment.y, x.wing_loss[1]);
        (-(left + right), a.wing_arm_m * (left - right))
    }

    /// What formulas may look at.
    fn motion<'a>(
        &self,
        state: &'a State,
        input: &Input,
        rotation: &'a Matrix3<f64>,
        air_body: Vector3<f64>,
        ahead_s: f64,
    ) -> Motion<'a> {
        let throttle = input.rotor.iter().sum::<f64>() / self.airframe.rotors.len() as f64;
        Motion {
            time_s: input.time_s + ahead_s,
            state,
            rotation,
            air_body,
            throttle,
            hover_throttle: self.airframe.hover_command(),
        }
    }

    /// Velocity through the air, body axes.
    fn air_body(&self, state: &State, input: &Input, rotation: &Matrix3<f64>) -> Vector3<f64> {
        rotation.tr_mul(&(state.velocity - self.wind(-state.position.z) - input.moving_air))
    }

    /// What is unmodelled at a state: its smooth part with the noise of the step.
    pub(super) fn unmodelled_at(&self, state: &State, input: &Input) -> [f64; 6] {
        let Some(unmodelled) = &self.unmodelled else { return [0.0; 6] };
        let smooth = unmodelled.of_features(&self.features_at(state, input));
        std::array::from_fn(|c| smooth[c] + input.noise[c])
    }

    /// What random formulas look at.
    pub(super) fn features_at(&self, state: &State, input: &Input) -> [f64; FEATURES] {
        let rotation = state.ned_from_body();
        let air_body = self.air_body(state, input, &rotation);
        features::of(&self.motion(state, input, &rotation, air_body, 0.0))
    }

    /// To where a load hangs, and what it pulls, N. A rod between two masses keeps its length,
    /// whatever they do.
    fn rod(&self, state: &State, force_ned: &Vector3<f64>, mass_kg: f64) -> (Vector3<f64>, f64) {
        let x = &self.extras;
        let (s, s_rate) = (state.swing.xy(), Vector2::new(state.swing.z, state.swing.w));
        let below = (x.payload_length_m.powi(2) - s.norm_squared()).max(0.0).sqrt();
        let rod = Vector3::new(s.x, s.y, below) / x.payload_length_m;
        let sinking = -s.dot(&s_rate) / below.max(1e-9);
        let round = (s_rate.norm_squared() + sinking * sinking) / x.payload_length_m;
        let shared = 1.0 + x.payload_kg / mass_kg;
        (rod, x.payload_kg * (round - rod.dot(force_ned) / mass_kg) / shared)
    }

    /// Rates of everything at a state, `ahead_s` after the start of the step.
    pub(super) fn rates(&self, state: &State, input: &Input, ahead_s: f64) -> Rates {
        let (a, x) = (&self.airframe, &self.extras);
        let rotation = state.ned_from_body();
        let height_m = -state.position.z;
        let v = self.air_body(state, input, &rotation);
        let speed = v.norm();
        let omega = state.omega;
        let motion = self.motion(state, input, &rotation, v, ahead_s);
        let unknown =
            self.outside.map(|outside| unknown::act(&outside, &motion)).unwrap_or_default();

        let factor = self.lift_and_ground(v.x.hypot(v.y), v.z, height_m) * unknown.thrust_factor;
        let ratio = self.speed_ratio(input);
        let [mut force, mut moment] = self.at_hubs(v, omega, state);
        let (mut thrust, mut spin, mut spin_rate) = (0.0, 0.0, 0.0);
        let mut rotor_rates = state.rotors * 0.0;
        let mut rotors = Rotors::default();
        for (i, rotor) in a.rotors.iter().enumerate() {
            let weak = if unknown.weak_rotor == Some(i) { 1.0 - unknown.weak_loss } else { 1.0 };
            let square = state.rotors[i] * state.rotors[i] * weak;
            let t = rotor.thrust_coefficient_n_s2 * x.thrust[i] * square * factor;
            thrust += t;
            rotors.push(Jet { position: rotor.position_body_m, thrust_n: t });
            moment += rotor.position_body_m.cross(&Vector3::new(0.0, 0.0, -t));
            moment.z += rotor.yaw_sign * rotor.torque_coefficient_n_m_s2 * x.torque[i] * square;
            let gap = input.rotor[i] * a.speed_max_rad_s * ratio - state.rotors[i];
            rotor_rates[i] = gap / (a.rotor_time_constant_s + x.lag_s[usize::from(gap < 0.0)]);
            spin -= rotor.yaw_sign * state.rotors[i];
            spin_rate -= rotor.yaw_sign * rotor_rates[i];
        }
        force.z -= thrust;
        let half_density = 0.5 * AIR_DENSITY_KG_M3 * speed;
        force -= (a.drag_n_s_per_m + x.linear_drag).component_mul(&v);
        force -= half_density * (x.drag_area.add_scalar(a.drag_area_m2)).component_mul(&v);
        let deployment = unknown.jammed_wings.map_or(state.deployment, Vector2::repeat);
        let (wing_force, wing_moment) = self.wings(v, omega.x, deployment);
        force.z += wing_force;
        moment.x += wing_moment;
        let planform = a.planform();
        moment.y -= planform.longitudinal_arm_m * wing_force;
        // The centre of mass is off the point that all this refers to.
        moment -= x.cg_m.cross(&force);
        force -= thrust * Vector3::new(x.tilt.x, x.tilt.y, 0.0);
        let pushed = |jet: &Jet| jet.position.cross(&Vector3::new(0.0, 0.0, -jet.thrust_n));
        let sight = Sight {
            air_body: v,
            omega,
            rotors,
            thrust_wrench: [
                -thrust * Vector3::new(x.tilt.x, x.tilt.y, 1.0),
                rotors.all().iter().map(pushed).sum(),
            ],
            weight_n: a.mass_kg * GRAVITY_M_S2,
            propeller_radius_m: planform.propeller_radius_m,
            wings: Wings {
                area_m2: a.wing_area_m2,
                slope: a.wing_slope,
                lateral_arm_m: a.wing_arm_m,
                longitudinal_arm_m: planform.longitudinal_arm_m,
                vertical_arm_m: planform.vertical_arm_m,
                chord_m: planform.chord_m,
                deployment,
                force_z_n: wing_force,
            },
        };
        for [own_force, own_moment] in x.wrenches(&sight) {
            force += own_force;
            moment += own_moment - x.cg_m.cross(&own_force);
        }
        let e3 = Vector3::z();
        moment -= x.rotor_inertia * (omega.cross(&e3) * spin + e3 * spin_rate);
        force += unknown.force_body + rotation.tr_mul(&unknown.force_ned);
        moment += unknown.moment_body;
        if let Some(unmodelled) = &self.unmodelled {
            let smooth = unmodelled.at(&motion);
            let sum = |c: usize| smooth[c] + input.noise[c];
            force += Vector3::new(sum(0), sum(1), sum(2));
            moment += Vector3::new(sum(3), sum(4), sum(5));
        }
        let mass = a.mass_kg * x.mass * unknown.mass_factor;
        let (rod, pull) = self.rod(state, &(rotation * force), mass);
        force += rotation.tr_mul(&(rod * pull));

        let gravity_body = rotation.tr_mul(&Vector3::new(0.0, 0.0, GRAVITY_M_S2));
        let mut specific = force / mass;
        if x.added_mass_kg > 0.0 {
            // (m + m_a) w' = F_z + m g_z - m (omega x v)_z, all in the body frame.
            let turning = omega.cross(&rotation.tr_mul(&state.velocity)).z;
            let w_rate = (force.z + mass * (gravity_body.z - turning)) / (mass + x.added_mass_kg);
            specific.z = w_rate - gravity_body.z + turning;
        }
        let inertia = Matrix3::from_diagonal(&a.inertia_kg_m2.component_mul(&x.inertia));
        let torque = moment - omega.cross(&(inertia * omega));
        let omega_rate = torque.component_div(&inertia.diagonal());
        let acceleration = rotation * specific + GRAVITY_M_S2 * e3;
        let servo = a.servo_time_constant_s + x.servo_lag_s;
        let swing_rate = |rod: f64, rate: f64, a: f64| {
            -pull / x.payload_kg * rod - x.payload_damping_per_s * rate - a
        };
        let swing = state.swing;
        let lever = -x.cg_m;
        Rates {
            state: State {
                position: state.velocity,
                velocity: acceleration,
                attitude: state.attitude_rate(),
                omega: omega_rate,
                rotors: rotor_rates,
                deployment: (input.wing - state.deployment) / servo,
                swing: if x.payload_kg > 0.0 {
                    Vector4::new(
                        swing.z,
                        swing.w,
                        swing_rate(rod.x, swing.z, acceleration.x),
                        swing_rate(rod.y, swing.w, acceleration.y),
                    )
                } else {
                    Vector4::zeros()
                },
                memory: unknown.memory_rate,
            },
            specific_force: specific + omega_rate.cross(&lever) + omega.cross(&omega.cross(&lever)),
        }
    }
}
