//! The vehicle file of an individual: its numbers, sensors, battery, gains, and the hidden effects.

use super::Order;
use crate::catalogue::{HiddenEffect, Value};
use crate::independent::{OF_THRUST, white};
use std::fmt::Write as _;

/// Gains per second: they hold for every vehicle of the class, and low enough for the largest lag
/// and latency.
const CONTROL: &str = "
[control]
thrust_min_n = 0.5
[control.attitude]
form = \"quaternion\"
c1_per_s = [6.0, 6.0, 3.0]
c2_per_s = [9.0, 9.0, 4.0]
lambda_per_s2 = [4.0, 4.0, 1.5]
integral_max_rad_s = 0.1
filter_frequency_rad_s = 20.0
filter_damping = 1.0
[control.position]
angle_law = \"exact\"
position_per_s = [1.6, 1.6, 2.2]
velocity_per_s = [2.5, 2.5, 3.5]
integral_per_s2 = [0.15, 0.15, 1.0]
derivative = [0.05, 0.05, 0.05]
velocity_feed_forward = 0.0
acceleration_max_horizontal_m_s2 = 11.0
acceleration_max_vertical_m_s2 = 6.0
integral_max_m = 2.0
[control.wing]
test = \"normal\"
thrust_law = \"exact\"
trigger = \"angle\"
open_above_n = 0.1
close_below_n = 0.05
dwell_s = 0.3
";

/// White noise of the attitude estimate, rad.
const ATTITUDE_NOISE_RAD: f64 = 0.001;

pub(super) fn vehicle(order: &Order<'_>) -> String {
    let mut text = order.real.to_toml();
    let heavy = order.real.mass_kg / crate::catalogue::CLASS_MASS_KG;
    let _ = write!(
        text,
        "\n[battery]\ncells = 4\ncapacity_ah = {:e}\nr0_ohm = {:e}\nr1_ohm = {:e}\ntau1_s = 4.0\n\
         ocv_v_of_charge = [[0.0, 3.4], [0.2, 3.74], [0.5, 3.87], [0.8, 4.05], [1.0, 4.22]]\nefficiency = 0.85\n",
        1.3 * heavy,
        order.resistance_ohm,
        0.3 * order.resistance_ohm
    );
    text += CONTROL;
    sensors(&mut text, order);
    for effect in order.effects {
        text += &effect_table(effect);
    }
    text
}

fn sensors(text: &mut String, order: &Order<'_>) {
    let list = |v: nalgebra::Vector3<f64>| format!("[{:e}, {:e}, {:e}]", v.x, v.y, v.z);
    let noise = order.noise;
    // One number a sensor: the receiver's noise is the mean over its axes.
    let velocity = white::GNSS_VELOCITY_M_S.iter().sum::<f64>() / 3.0;
    let _ = write!(
        text,
        "\n[estimation]\nfilter = \"external\"\n[sensors.imu]\ntiming = {{ rate_hz = 300.0 }}\ngyro_noise_rad_s = {:e}\ngyro_bias_rad_s = {}\n\
         accel_noise_m_s2 = {:e}\naccel_bias_m_s2 = {}\n\
         [sensors.attitude]\ntiming = {{ rate_hz = 300.0 }}\nnoise_rad = {ATTITUDE_NOISE_RAD:e}\n\
         bias_rad = [0.0, 0.0, {:e}]\n\
         [sensors.gnss]\ntiming = {{ rate_hz = 10.0 }}\nposition_noise_m = {:e}\nvelocity_noise_m_s = {:e}\n\
         [sensors.baro]\ntiming = {{ rate_hz = 50.0 }}\nnoise_m = {:e}\n\
         [sensors.battery]\ntiming = {{ rate_hz = 50.0 }}\nvoltage_noise_v = {:e}\ncurrent_noise_a = {:e}\n",
        noise * white::GYRO_RAD_S,
        list(order.errors.gyro_bias_rad_s),
        noise * white::ACCEL_M_S2,
        list(order.errors.accel_bias_m_s2),
        order.errors.heading_rad,
        noise * white::GNSS_POSITION_M,
        noise * velocity,
        noise * white::BARO_M,
        noise * white::VOLTAGE_V,
        noise * white::CURRENT_A
    );
}

/// The table `[effects.NAME]` of a vehicle file: the same physics in squirrel's words.
pub fn effect_table(effect: &HiddenEffect) -> String {
    let x = |key: &str| effect.number(key);
    let form = effect.form.as_str();
    // Keys of the standard form that squirrel's other form has too, and what it needs beyond them.
    let (mut kept, mut more) = (effect.parameters.clone(), Vec::new());
    match (effect.name.as_str(), form) {
        ("linear_drag", "anisotropic") => {
            more.push(("anisotropy", 0.3));
            more.push(("extra_drag_z_n_s_per_m", 0.2 * x("extra_drag_n_s_per_m")));
        }
        ("linear_drag", "at_rotors") => {
            more.push(("extra_drag_z_n_s_per_m", 0.3 * x("extra_drag_n_s_per_m")));
        }
        ("quadratic_drag", "anisotropic") => {
            let area = x("extra_drag_area_m2");
            kept.insert("extra_drag_area_m2".to_owned(), Value::Number(0.9 * area));
            more.push(("anisotropy", -0.2 / 0.9));
            more.push(("extra_drag_area_z_m2", 1.6 * area));
        }
        ("constant_wind", "log_profile") => {
            // Stated at 3 m there, at 10 m here.
            let grown = (10.0_f64 / ROUGHNESS_M).ln() / (3.0_f64 / ROUGHNESS_M).ln();
            for key in ["wind_north_m_s", "wind_east_m_s"] {
                kept.insert(key.to_owned(), Value::Number(grown * x(key)));
            }
            more.push(("roughness_m", ROUGHNESS_M));
        }
        ("ground_effect", "exponential") => {
            let radius = Value::Number(0.38 * x("effective_radius_m"));
            kept.insert("effective_radius_m".to_owned(), radius);
            more.push(("gain", 0.9));
        }
        ("battery_sag", "load_dependent") => more.push(("load_gain", 0.8)),
        ("motor_lag", "asymmetric") => more.push(("asymmetry", 0.5)),
        ("translational_lift", "linear") => {
            kept.clear();
            more.push(("gain_s_per_m", x("gain_s2_per_m2") * 6.0 / (1.0 + 0.004 * 36.0)));
        }
        ("angular_damping", "quadratic") => {
            kept.clear();
            more.push(("damping_n_m_s2_per_rad2", x("damping_n_m_s_per_rad")));
        }
        ("rotor_wash", "of_thrust") => {
            kept.clear();
            more.push(("thrust_fraction", OF_THRUST * x("gain")));
        }
        // Nothing where the wings are flat, but a file must say it.
        ("wing_moment", _) => more.push(("place_z_m", 0.0)),
        ("wing_membrane", "speed_dependent") => more.push(("full_speed_m_s", 5.0)),
        ("accel_bias", "drifting") => {
            // Half at the start, one and a half after 40 s.
            for (key, drift) in DRIFTS {
                kept.insert(key.to_owned(), Value::Number(0.5 * x(key)));
                more.push((drift, x(key) / 40.0));
            }
        }
        ("payload_swing", "damped") => more.push(("damping_per_s", 1.2)),
        // Forms that need no more than their name, and the standard one.
        _ => {}
    }
    let mut text = format!("\n[effects.{}]\n", effect.name);
    for (key, value) in &kept {
        let _ = match value {
            Value::Number(x) => writeln!(text, "{key} = {x:e}"),
            Value::Name(name) => writeln!(text, "{key} = \"{name}\""),
        };
    }
    for (key, value) in more {
        let _ = writeln!(text, "{key} = {value:e}");
    }
    if form != "standard" {
        let _ = writeln!(text, "form = \"{form}\"");
    }
    text
}

const ROUGHNESS_M: f64 = 0.05;
const DRIFTS: [(&str, &str); 3] = [
    ("bias_x_m_s2", "drift_x_m_s3"),
    ("bias_y_m_s2", "drift_y_m_s3"),
    ("bias_z_m_s2", "drift_z_m_s3"),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::airframe::Airframe;
    use crate::catalogue::CATALOGUE;
    use crate::draw::Draw;
    use squirrel_sim::vehicle_file::VehicleFile;

    #[test]
    fn squirrel_knows_every_effect_and_form_of_the_bench() {
        let nominal = Airframe::draw(&mut Draw::new(1));
        for entry in CATALOGUE {
            for form in ["standard"].iter().chain(entry.forms) {
                let effect = entry.draw(&mut Draw::new(2), form, 0.5, 4);
                let text = nominal.to_toml() + &effect_table(&effect);
                let file = VehicleFile::parse(&text, "vehicle.toml").unwrap();
                assert!(file.effects.has(entry.name), "{} {form}", entry.name);
            }
        }
    }
}
