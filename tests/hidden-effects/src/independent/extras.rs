//! Sizes of all effects as the equations of this generator take them; zero means absent.

use super::twins::{Equation, Sight};
use crate::airframe::MAX_ROTORS;
use crate::catalogue::{CATALOGUE, HiddenEffect};
use nalgebra::{Vector2, Vector3};

/// A thrust gain over the speed across the rotors, m/s.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) enum Lift {
    #[default]
    None,
    /// `k V^2 / (1 + 0.004 V^2)`
    Saturating(f64),
    /// `k V`, s/m
    Linear(f64),
    /// `k V^2`
    Quadratic(f64),
    /// A force `k V^2` of the weight, whatever the thrust, by the air at each hub
    AtRotors(f64),
}

/// A thrust gain over height.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) enum Ground {
    #[default]
    None,
    /// `1 / (1 - R^2 / 16 h^2)`, effective radius, m
    Image(f64),
    /// `1 + a exp(-h / l)`: gain, length in m
    Exponential(f64, f64),
}

/// How rotor speed follows the battery.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) enum Sag {
    #[default]
    None,
    /// `(V / V_ref)^k`
    Power(f64),
    /// `1 + k (V / V_ref - 1)`
    Linear(f64),
    /// The power law with an exponent that grows with the current over that of hover.
    LoadDependent(f64),
}

/// Gusts.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Gust {
    pub(super) sigma_m_s: f64,
    pub(super) dryden: bool,
}

/// All of them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Extras {
    pub(super) linear_drag: Vector3<f64>,
    /// Drag at the rotors' hubs along each axis, all rotors at hover, N s/m.
    pub(super) hub_drag: Vector3<f64>,
    /// Of the weight, s/m.
    pub(super) hub_inflow: f64,
    pub(super) drag_area: Vector3<f64>,
    pub(super) wind_ned: Vector3<f64>,
    pub(super) log_wind: bool,
    pub(super) gust: Gust,
    pub(super) ground: Ground,
    pub(super) sag: Sag,
    pub(super) thrust: [f64; MAX_ROTORS],
    pub(super) torque: [f64; MAX_ROTORS],
    pub(super) mass: f64,
    pub(super) inertia: Vector3<f64>,
    /// Seconds added to the rotor lag upwards and downwards.
    pub(super) lag_s: [f64; 2],
    pub(super) latency_s: f64,
    pub(super) cg_m: Vector3<f64>,
    pub(super) tilt: Vector2<f64>,
    pub(super) lift: Lift,
    pub(super) inflow: f64,
    pub(super) rotor_inertia: f64,
    pub(super) wing_gain: f64,
    /// Airspeed from which the gain is full, m/s.
    pub(super) wing_gain_speed_m_s: f64,
    pub(super) wing_angle_rad: f64,
    pub(super) wing_loss: [f64; 2],
    pub(super) servo_lag_s: f64,
    pub(super) added_mass_kg: f64,
    pub(super) accel_bias: Vector3<f64>,
    /// Share of the accelerometer bias that is there from the start; the rest grows over the
    /// flight.
    pub(super) accel_bias_start: f64,
    pub(super) heading_rad: f64,
    pub(super) gnss_latency_s: f64,
    pub(super) skew: f64,
    pub(super) payload_kg: f64,
    pub(super) payload_length_m: f64,
    pub(super) payload_damping_per_s: f64,
    /// Those whose equation stands in a file of its own.
    own: Vec<(HiddenEffect, Equation)>,
}

impl Extras {
    /// Force and moment of those whose equation stands in a file of its own.
    pub(super) fn wrenches(&self, at: &Sight) -> impl Iterator<Item = [Vector3<f64>; 2]> {
        self.own.iter().map(move |(effect, equation)| equation(effect, at))
    }

    pub(super) fn new(effects: &[HiddenEffect]) -> Self {
        let mut extras = Self {
            linear_drag: Vector3::zeros(),
            hub_drag: Vector3::zeros(),
            hub_inflow: 0.0,
            drag_area: Vector3::zeros(),
            wind_ned: Vector3::zeros(),
            log_wind: false,
            gust: Gust::default(),
            ground: Ground::None,
            sag: Sag::None,
            thrust: [1.0; MAX_ROTORS],
            torque: [1.0; MAX_ROTORS],
            mass: 1.0,
            inertia: Vector3::repeat(1.0),
            lag_s: [0.0; 2],
            latency_s: 0.0,
            cg_m: Vector3::zeros(),
            tilt: Vector2::zeros(),
            lift: Lift::None,
            inflow: 0.0,
            own: Vec::new(),
            rotor_inertia: 0.0,
            wing_gain: 0.0,
            wing_gain_speed_m_s: 0.0,
            wing_angle_rad: 0.0,
            wing_loss: [0.0; 2],
            servo_lag_s: 0.0,
            added_mass_kg: 0.0,
            accel_bias: Vector3::zeros(),
            accel_bias_start: 1.0,
            heading_rad: 0.0,
            gnss_latency_s: 0.0,
            skew: 0.0,
            payload_kg: 0.0,
            payload_length_m: 1.0,
            payload_damping_per_s: PAYLOAD_DAMPING_PER_S,
        };
        for effect in effects {
            extras.add(effect);
        }
        extras
    }

    /// # Panics
    /// For a name or a form that this generator does not know, which is a mistake in the catalogue.
    fn add(&mut self, effect: &HiddenEffect) {
        let x = |key: &str| effect.number(key);
        let form = effect.form.as_str();
        let standard = form == "standard";
        match effect.name.as_str() {
            "linear_drag" if form == "at_rotors" => {
                self.hub_drag = x("extra_drag_n_s_per_m") * Vector3::new(1.0, 1.0, 0.3);
            }
            "linear_drag" => {
                let shape = if standard { [1.0, 1.0, 0.0] } else { ANISOTROPIC_LINEAR };
                self.linear_drag = x("extra_drag_n_s_per_m") * Vector3::from(shape);
            }
            "quadratic_drag" => {
                let shape = if standard { [1.0; 3] } else { ANISOTROPIC_AREA };
                self.drag_area = x("extra_drag_area_m2") * Vector3::from(shape);
            }
            "constant_wind" => {
                self.wind_ned = Vector3::new(x("wind_north_m_s"), x("wind_east_m_s"), 0.0);
                self.log_wind = !standard;
            }
            "gust" => self.gust = Gust { sigma_m_s: x("sigma_m_s"), dryden: !standard },
            "ground_effect" => {
                let radius = x("effective_radius_m");
                // The exponential passes near the image's gain from half to one and a half
                // effective radii.
                self.ground = if standard {
                    Ground::Image(radius)
                } else {
                    Ground::Exponential(0.9, 0.38 * radius)
                };
            }
            "battery_sag" => {
                let k = x("voltage_exponent");
                self.sag = match form {
                    "linear" => Sag::Linear(k),
                    "load_dependent" => Sag::LoadDependent(k),
                    _ => Sag::Power(k),
                };
            }
            "thrust_coefficient" => {
                self.thrust.iter_mut().for_each(|t| *t *= 1.0 + x("thrust_fraction"));
            }
            "motor_lag" => {
                let tau = x("extra_time_constant_s");
                self.lag_s = if standard { [tau; 2] } else { [0.5 * tau, 1.5 * tau] };
            }
            "weak_rotor" => {
                let rotor = x("rotor") as usize - 1;
                let left = 1.0 - x("thrust_loss_fraction");
                self.thrust[rotor] *= left;
                // What a blade that is chipped near its root loses of lift it gains in drag.
                self.torque[rotor] *= if standard { left } else { 1.0 };
            }
            "mass_error" => self.mass *= 1.0 + x("mass_fraction"),
            "inertia_error" => {
                let axis = ["x", "y", "z"]
                    .iter()
                    .position(|name| *name == effect.text("axis"))
                    .unwrap_or(0);
                self.inertia[axis] *= 1.0 + x("inertia_fraction");
            }
            "cg_offset" => self.cg_m = Vector3::new(x("cg_x_m"), x("cg_y_m"), 0.0),
            "thrust_misalignment" => self.tilt = Vector2::new(x("tilt_x_rad"), x("tilt_y_rad")),
            "translational_lift" => {
                let k = x("gain_s2_per_m2");
                self.lift = match form {
                    // The same gain at 6 m/s.
                    "linear" => Lift::Linear(k * 6.0 / (1.0 + 0.004 * 36.0)),
                    "quadratic" => Lift::Quadratic(k),
                    "at_rotors" => Lift::AtRotors(k),
                    _ => Lift::Saturating(k),
                };
            }
            "axial_inflow" if form == "at_rotors" => self.hub_inflow = x("gain_s_per_m"),
            "axial_inflow" => self.inflow = x("gain_s_per_m"),
            "rotor_gyro_torque" => self.rotor_inertia = x("rotor_inertia_kg_m2"),
            "yaw_torque_coeff" => {
                self.torque.iter_mut().for_each(|q| *q *= 1.0 + x("torque_fraction"));
            }
            "actuation_latency" => self.latency_s = x("latency_s"),
            "wing_membrane" => {
                self.wing_gain = x("gain");
                self.wing_angle_rad = x("angle_of_attack_offset_rad");
                self.wing_gain_speed_m_s = if standard { 0.0 } else { 5.0 };
            }
            "wing_asymmetry" => {
                self.wing_loss[usize::from(effect.text("side") == "right")] = x("loss_fraction");
            }
            "wing_servo_lag" => self.servo_lag_s = x("extra_time_constant_s"),
            "added_mass" => self.added_mass_kg = x("mass_kg"),
            "accel_bias" => {
                self.accel_bias =
                    Vector3::new(x("bias_x_m_s2"), x("bias_y_m_s2"), x("bias_z_m_s2"));
                self.accel_bias_start = if standard { 1.0 } else { 0.5 };
            }
            "heading_bias" => self.heading_rad = x("bias_rad"),
            "gnss_latency" => self.gnss_latency_s = x("latency_s"),
            "clock_skew" => self.skew = 1e-6 * x("skew_ppm"),
            "payload_swing" => {
                self.payload_kg = x("mass_kg");
                self.payload_length_m = x("length_m");
                self.payload_damping_per_s = if standard { PAYLOAD_DAMPING_PER_S } else { 1.2 };
            }
            other => {
                let own = CATALOGUE
                    .iter()
                    .find(|entry| entry.name == other)
                    .and_then(|entry| entry.equation);
                let Some(equation) = own else { panic!("no equation for the effect `{other}`") };
                self.own.push((effect.clone(), equation));
            }
        }
    }
}

/// Damping of a payload's swing in the standard form, 1/s.
const PAYLOAD_DAMPING_PER_S: f64 = 0.1;
const ANISOTROPIC_LINEAR: [f64; 3] = [1.3, 0.7, 0.2];
const ANISOTROPIC_AREA: [f64; 3] = [0.7, 1.1, 1.6];
