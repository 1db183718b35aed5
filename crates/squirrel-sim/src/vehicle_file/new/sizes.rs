//! What the numbers of a file follow from, given or guessed: sizes, and what its rotors can do.

use super::text::Number;
use super::{Frame, Given, Said, SaidRotor, gains, scaling};
use squirrel_core::math::{AIR_DENSITY_KG_M3, GRAVITY_M_S2};
use std::f64::consts::{PI, TAU};

pub(super) const INCH_M: f64 = 0.0254;
/// Tolerance of what is weighed and measured with kitchen scales and a ruler.
const WEIGHED: f64 = 0.02;
const RULED: f64 = 0.02;

/// What is given, with the tolerance that such a number has, or a guess.
pub(super) fn said_or(
    said: Option<&Said>,
    sd_fraction: f64,
    guess: impl FnOnce() -> Number,
) -> Number {
    said.map_or_else(guess, |said| Number {
        value: said.value,
        sd: sd_fraction * said.value,
        source: format!("given: {}", said.source),
    })
}

/// The numbers that others follow from.
pub(super) struct Sizes {
    pub(super) mass_kg: Number,
    pub(super) arm_m: Number,
    pub(super) diameter_m: Number,
    pub(super) rotors: Vec<SaidRotor>,
    pub(super) cells: u32,
    pub(super) cells_source: String,
    pub(super) speed_max_rad_s: Number,
    pub(super) thrust_coefficient_n_s2: Number,
    pub(super) torque_coefficient_n_m_s2: Number,
    pub(super) thrust_max_n: Number,
    pub(super) tilt_max_rad: f64,
}

impl Sizes {
    /// Of a [`Given`] that misses nothing.
    pub(super) fn of(given: &Given) -> Self {
        let none = Said { value: f64::NAN, source: String::new() };
        let mass_kg = said_or(given.mass_kg.as_ref().or(Some(&none)), WEIGHED, no_guess);
        let places = given.frame.unwrap_or(Frame::QuadX).places();
        let count = given.rotors.as_ref().map_or(places.len(), |(rotors, _)| rotors.len());
        let inches = given
            .propeller_inch
            .as_ref()
            .map(|inch| Said { value: inch.value * INCH_M, source: inch.source.clone() });
        let arm_m = arm(given, inches.as_ref(), count);
        let diameter_m = said_or(inches.as_ref(), 0.01, || Number {
            value: apart(arm_m.value, count) / scaling::SPACING.value,
            sd: scaling::SPACING.sd_fraction * apart(arm_m.value, count) / scaling::SPACING.value,
            source: format!("guess: hubs are {} diameters apart; 10 %", scaling::SPACING.value),
        });
        let rotors = match &given.rotors {
            Some((rotors, _)) => rotors.clone(),
            None => places
                .iter()
                .map(|place| SaidRotor {
                    position_body_m: [
                        place.ahead_right[0] * arm_m.value,
                        place.ahead_right[1] * arm_m.value,
                        0.0,
                    ],
                    yaw_sign: place.yaw_sign,
                })
                .collect(),
        };
        let (cells, cells_source) = match &given.cells {
            Some(said) => (said.value as u32, format!("given: {}", said.source)),
            None => (scaling::usual_cells(mass_kg.value), "guess by mass".to_owned()),
        };
        let mut sizes = Self {
            speed_max_rad_s: no_guess(),
            thrust_coefficient_n_s2: no_guess(),
            torque_coefficient_n_m_s2: no_guess(),
            thrust_max_n: no_guess(),
            tilt_max_rad: 0.61,
            mass_kg,
            arm_m,
            diameter_m,
            rotors,
            cells,
            cells_source,
        };
        sizes.propulsion(given);
        sizes
    }

    fn propulsion(&mut self, given: &Given) {
        let pitch = given.pitch_over_diameter();
        let pitch_ratio = pitch.as_ref().map_or(scaling::PITCH_OVER_DIAMETER, |said| said.value);
        let c_t = scaling::thrust_coefficient(pitch_ratio);
        let diameter = self.diameter_m.value;
        let k_f = c_t.value * AIR_DENSITY_KG_M3 * diameter.powi(4) / (TAU * TAU);
        let of_propeller = format!(
            "C_T = {:.3} of a small propeller with a pitch of {:.2} diameters{} (UIUC propeller data), 25 %",
            c_t.value,
            pitch_ratio,
            if pitch.is_some() { "" } else { ", guessed" },
        );
        let weight = self.mass_kg.value * GRAVITY_M_S2;
        let count = self.rotors.len() as f64;
        // Commands show only the product of the coefficient with the square of the top speed, so
        // the coefficient's tolerance is that of the product.
        let (speed, product_sd, why) = match (&given.hover_thrust_fraction, &given.kv_rpm_per_v) {
            (Some(hover), _) => (
                (weight / hover.value / (count * k_f)).sqrt(),
                0.10,
                format!("hover at {} of the most thrust ({}), 10 %", hover.value, hover.source),
            ),
            (None, Some(kv)) => {
                let loaded = scaling::LOADED_SPEED;
                let volts = scaling::CELL_V.value * f64::from(self.cells);
                (
                    loaded.value * kv.value * TAU / 60.0 * volts,
                    c_t.sd_fraction.hypot(2.0 * loaded.sd_fraction),
                    format!(
                        "{} of the speed without load, {} rpm/V at {volts:.1} V ({}); 15 %, whose square counts in thrust",
                        loaded.value, kv.value, kv.source
                    ),
                )
            }
            (None, None) => {
                let ratio = scaling::THRUST_TO_WEIGHT;
                (
                    (ratio.value * weight / (count * k_f)).sqrt(),
                    ratio.sd_fraction,
                    format!(
                        "most thrust of {} times the weight, as published machines; 40 %",
                        ratio.value
                    ),
                )
            }
        };
        self.speed_max_rad_s =
            Number { value: speed, sd: 0.15 * speed, source: format!("guess: {why}") };
        self.thrust_coefficient_n_s2 = Number {
            value: k_f,
            sd: product_sd * k_f,
            source: format!(
                "guess: {of_propeller}; sd is that of its product with speed_max_rad_s squared, {:.0} %",
                100.0 * product_sd
            ),
        };
        self.thrust_max_n = Number {
            value: count * k_f * speed * speed,
            sd: product_sd * count * k_f * speed * speed,
            source: format!("all rotors at speed_max_rad_s; {:.0} %", 100.0 * product_sd),
        };
        let lever = scaling::TORQUE_PER_THRUST_DIAMETER;
        let (ratio, spread, source) = match &given.torque_per_thrust_m {
            Some(said) => (said.value, 0.3, format!("torque over thrust, {}; 30 %", said.source)),
            None => (
                lever.value * diameter,
                lever.sd_fraction,
                "guess by scaling: torque over thrust of 0.12 diameters, as published machines; 30 %".to_owned(),
            ),
        };
        self.torque_coefficient_n_m_s2 =
            Number { value: ratio * k_f, sd: spread * ratio * k_f, source };
    }

    pub(super) fn airframe(&self) -> gains::Airframe {
        gains::Airframe {
            weight_n: self.mass_kg.value * GRAVITY_M_S2,
            thrust_max_n: self.thrust_max_n.value,
            lag_s: scaling::MOTOR_LAG_S.value,
            torque_per_thrust_m: self.torque_coefficient_n_m_s2.value
                / self.thrust_coefficient_n_s2.value,
            arm_m: self.arm_m.value,
            inertia_z_kg_m2: self.mass_kg.value
                * (scaling::GYRATION_Z.value * self.arm_m.value).powi(2),
            tilt_max_rad: self.tilt_max_rad,
            restoring: [(scaling::GYRATION_Z.value / scaling::GYRATION_XY.value).powi(2); 2],
        }
    }
}

fn no_guess() -> Number {
    Number { value: f64::NAN, sd: f64::NAN, source: String::new() }
}

/// Distance of neighbouring hubs on a circle, m.
fn apart(arm_m: f64, count: usize) -> f64 {
    2.0 * arm_m * (PI / count as f64).sin()
}

fn arm(given: &Given, diameter_m: Option<&Said>, count: usize) -> Number {
    if let Some((rotors, source)) = &given.rotors {
        let mean =
            rotors.iter().map(|r| r.position_body_m[0].hypot(r.position_body_m[1])).sum::<f64>()
                / count as f64;
        return Number { value: mean, sd: 0.05 * mean, source: source.clone() };
    }
    let diameter = diameter_m.map_or(f64::NAN, |said| said.value);
    said_or(given.arm_m.as_ref(), RULED, || {
        let rule = scaling::SPACING;
        let value = rule.value * diameter / (2.0 * (PI / count as f64).sin());
        Number {
            value,
            sd: rule.sd_fraction * value,
            source: format!(
                "guess by scaling: hubs {} propeller diameters apart; 10 %",
                rule.value
            ),
        }
    })
}
