//! A first vehicle file from what its owner knows: mass, frame, propeller.
//!
//! What is given keeps its source. What is not is guessed by rules that published machines hold to,
//! each with how far these lie apart as its `sd`: the gap workflow then knows which numbers it may
//! move, and by how much.

mod by_rule;
mod frame;
mod gains;
mod parameters;
mod scaling;
mod sizes;
mod text;

pub use frame::{Frame, Place};
pub use parameters::LogParameters;

use super::{VehicleFile, VehicleFileError};
use scaling::Rule;
use sizes::{Sizes, said_or};
use text::{Lines, Number};

/// Open-circuit voltage of a lithium polymer cell at rest over its charge.
const CELL_OCV: &str = "[[0.0, 3.27], [0.05, 3.55], [0.1, 3.66], [0.2, 3.72], [0.4, 3.78], [0.6, 3.87], [0.8, 4.02], [1.0, 4.20]]";

/// A number that somebody stated, and who.
#[derive(Debug, Clone, PartialEq)]
pub struct Said {
    /// In the unit of its field.
    pub value: f64,
    /// `--mass-kg`, or `CA_ROTOR0_KM of the log`.
    pub source: String,
}

/// A rotor whose place is known.
#[derive(Debug, Clone, PartialEq)]
pub struct SaidRotor {
    /// Hub, body FRD, m.
    pub position_body_m: [f64; 3],
    /// Sign of the reaction torque about +z.
    pub yaw_sign: f64,
}

/// What is known of a vehicle; all else is guessed.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Given {
    /// Name of the vehicle.
    pub name: String,
    /// How its rotors are laid out.
    pub frame: Option<Frame>,
    /// Where they are, where that is known one by one, and who says so; goes before the frame.
    pub rotors: Option<(Vec<SaidRotor>, String)>,
    /// Ready to fly, with battery, kg.
    pub mass_kg: Option<Said>,
    /// From the centre to a hub, m.
    pub arm_m: Option<Said>,
    /// Diameter of a propeller, inch.
    pub propeller_inch: Option<Said>,
    /// Its pitch, inch.
    pub pitch_inch: Option<Said>,
    /// Cells of the battery in series.
    pub cells: Option<Said>,
    /// Speed of a motor without load over voltage, rpm/V.
    pub kv_rpm_per_v: Option<Said>,
    /// Capacity of the battery, Ah.
    pub capacity_ah: Option<Said>,
    /// Thrust in hover over the most thrust.
    pub hover_thrust_fraction: Option<Said>,
    /// Part of thrust that grows with the square of the command; the rest grows with it.
    pub thrust_square_fraction: Option<Said>,
    /// Reaction torque over thrust, m.
    pub torque_per_thrust_m: Option<Said>,
    /// Whether commands are pulses of 1000 to 2000 us instead of 0 to 1.
    pub pwm_commands: bool,
}

/// Why there is no file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum NewError {
    /// What nobody can guess.
    #[error("missing: {}", .0.join(", "))]
    Missing(Vec<&'static str>),
    /// A number that cannot be.
    #[error("{field} = {value}: {reason}")]
    Number {
        /// As in [`Given`].
        field: &'static str,
        /// As given.
        value: f64,
        /// What must hold.
        reason: &'static str,
    },
    /// What came out is no vehicle.
    #[error("{0}")]
    Vehicle(#[from] VehicleFileError),
}

impl Given {
    /// What must be given and is not, by its option on the command line.
    pub fn missing(&self) -> Vec<&'static str> {
        let mut missing = Vec::new();
        if self.frame.is_none() && self.rotors.is_none() {
            missing.push("--frame");
        }
        if self.mass_kg.is_none() {
            missing.push("--mass-kg");
        }
        if self.propeller_inch.is_none() && self.arm_m.is_none() && self.rotors.is_none() {
            missing.push("--propeller-inch");
        }
        missing
    }

    /// The file: its text, and read again.
    ///
    /// # Errors
    /// What is missing, or the first number that cannot be.
    pub fn vehicle_file(&self) -> Result<VehicleFile, NewError> {
        let missing = self.missing();
        if !missing.is_empty() {
            return Err(NewError::Missing(missing));
        }
        self.check()?;
        let text = self.text();
        Ok(VehicleFile::parse(&text, &self.name)?)
    }

    fn check(&self) -> Result<(), NewError> {
        let ranges: [(&'static str, &Option<Said>, f64, f64, &'static str); 11] = [
            ("mass_kg", &self.mass_kg, 1e-3, 500.0, "must be 0.001 to 500 kg"),
            ("arm_m", &self.arm_m, 5e-3, 10.0, "must be 0.005 to 10 m"),
            ("propeller_inch", &self.propeller_inch, 0.4, 100.0, "must be 0.4 to 100 inch"),
            ("pitch_inch", &self.pitch_inch, 0.1, 100.0, "must be 0.1 to 100 inch"),
            ("cells", &self.cells, 1.0, 24.0, "must be 1 to 24"),
            ("kv_rpm_per_v", &self.kv_rpm_per_v, 10.0, 1e5, "must be 10 to 100000 rpm/V"),
            ("capacity_ah", &self.capacity_ah, 0.01, 1000.0, "must be 0.01 to 1000 Ah"),
            (
                "hover_thrust_fraction",
                &self.hover_thrust_fraction,
                0.02,
                0.98,
                "must be 0.02 to 0.98",
            ),
            ("thrust_square_fraction", &self.thrust_square_fraction, 0.0, 1.0, "must be 0 to 1"),
            ("torque_per_thrust_m", &self.torque_per_thrust_m, 1e-4, 5.0, "must be 0.0001 to 5 m"),
            (
                "pitch_inch over propeller_inch",
                &self.pitch_over_diameter(),
                0.1,
                2.0,
                "must be 0.1 to 2",
            ),
        ];
        for (field, said, least, most, reason) in ranges {
            match said {
                Some(said) if !(least..=most).contains(&said.value) => {
                    return Err(NewError::Number { field, value: said.value, reason });
                }
                Some(said) if field == "cells" && said.value.fract() != 0.0 => {
                    return Err(NewError::Number {
                        field,
                        value: said.value,
                        reason: "must be a whole number",
                    });
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn pitch_over_diameter(&self) -> Option<Said> {
        let (pitch, diameter) = (self.pitch_inch.as_ref()?, self.propeller_inch.as_ref()?);
        let source = format!("{} over {}", pitch.source, diameter.source);
        Some(Said { value: pitch.value / diameter.value, source })
    }

    fn text(&self) -> String {
        let sizes = Sizes::of(self);
        let mut lines = Lines::default();
        lines.line("# A first file, made by `squirrel vehicle new`. What nobody gave is guessed from published machines: `sd` is how far those lie");
        lines.line("# apart, and `squirrel gap run` moves a number within it. A thrust stand, a hover or a swing narrow it: `squirrel vehicle fit`.");
        lines.line(&format!("name = {}", text::quoted(&self.name)));
        mass(&mut lines, &sizes);
        self.rotors(&mut lines, &sizes);
        self.propulsion(&mut lines, &sizes);
        drag(&mut lines, &sizes);
        self.battery(&mut lines, &sizes);
        lines.table("[limits]");
        lines.plain("tilt_max_rad", sizes.tilt_max_rad, "usual: 35 deg");
        lines.plain("thrust_max_n", sizes.thrust_max_n.value, &sizes.thrust_max_n.source);
        lines.table("[sensors]");
        lines.line("suite = \"nominal\"");
        lines.append(&gains::toml(&sizes.airframe()));
        lines.text()
    }

    fn rotors(&self, lines: &mut Lines, sizes: &Sizes) {
        let numbered = match (&self.rotors, self.frame) {
            (Some((_, source)), _) => format!("# Rotors as in {source}."),
            (None, Some(frame)) => {
                format!("# {}, rotors numbered as {} do.", frame.name(), frame.numbering())
            }
            (None, None) => String::new(),
        };
        lines.append(numbered.as_str());
        let sd = sizes.arm_m.sd;
        let beside = [sd, sd, (0.1 * sizes.arm_m.value).max(sd)];
        for rotor in &sizes.rotors {
            lines.table("[[rotor]]");
            lines.list("position_body_m", &rotor.position_body_m, &beside, &sizes.arm_m.source);
            lines.line(&format!("yaw_sign = {}", rotor.yaw_sign));
        }
    }

    fn propulsion(&self, lines: &mut Lines, sizes: &Sizes) {
        lines.table("[propulsion]");
        lines.line(if self.pwm_commands { "command = \"pwm_us\"" } else { "command = \"duty\"" });
        lines.number("speed_max_rad_s", &sizes.speed_max_rad_s);
        lines.number("thrust_coefficient_n_s2", &sizes.thrust_coefficient_n_s2);
        lines.number("torque_coefficient_n_m_s2", &sizes.torque_coefficient_n_m_s2);
        let lag = scaling::MOTOR_LAG_S;
        lines.number(
            "time_constant_s",
            &Number {
                value: lag.value,
                sd: lag.value * lag.sd_fraction,
                source: "guess: 0.033 to 0.072 s are published, with no trend over size".to_owned(),
            },
        );
        lines.number("propeller_diameter_m", &sizes.diameter_m);
        let cells = f64::from(sizes.cells);
        let volt = scaling::CELL_V;
        lines.number(
            "reference_voltage_v",
            &Number {
                value: volt.value * cells,
                sd: volt.value * cells * volt.sd_fraction,
                source: format!("3.7 V a cell, cells: {}", sizes.cells_source),
            },
        );
        if let Some(square) = self.thrust_square_fraction.as_ref().filter(|said| said.value < 1.0) {
            let volts = volt.value * cells;
            let most = sizes.thrust_max_n.value / sizes.rotors.len() as f64;
            let curve = [
                0.0,
                (1.0 - square.value) * most / volts,
                square.value * most / volts.powi(2),
                0.0,
            ];
            let spread = sizes.thrust_coefficient_n_s2.sd / sizes.thrust_coefficient_n_s2.value;
            let source = format!(
                "{} = {}: that part of thrust goes with the square of the command; N, N/V, N/V^2, N/V^3",
                square.source, square.value
            );
            lines.list("pwm_to_thrust_n", &curve, &curve.map(|a| a * spread), &source);
        }
    }

    fn battery(&self, lines: &mut Lines, sizes: &Sizes) {
        let cells = f64::from(sizes.cells);
        let share = scaling::BATTERY_OF_MASS;
        let capacity = said_or(self.capacity_ah.as_ref(), 0.05, || Number {
            value: share.value * sizes.mass_kg.value * 150.0 / (3.7 * cells),
            sd: share.sd_fraction * share.value * sizes.mass_kg.value * 150.0 / (3.7 * cells),
            source: "guess: 0.28 of the mass at 150 Wh/kg; 35 %".to_owned(),
        });
        let resistance = 0.012 * cells / capacity.value;
        lines.table("[battery]");
        lines.line(&format!("cells = {}", sizes.cells));
        lines.number("capacity_ah", &capacity);
        lines.plain("r0_ohm", resistance, "guess: 12 mohm Ah a cell, with leads");
        lines.plain("r1_ohm", 0.3 * resistance, "guess: 0.3 of r0_ohm");
        lines.plain("tau1_s", 4.0, "usual: 3 to 5 s");
        lines.line(&format!(
            "ocv_v_of_charge = {{ value = {CELL_OCV}, source = \"usual lithium polymer cell at rest\" }}"
        ));
    }
}

fn mass(lines: &mut Lines, sizes: &Sizes) {
    lines.table("[mass]");
    lines.number("mass_kg", &sizes.mass_kg);
    let arm = sizes.arm_m.value;
    let arm_spread = sizes.arm_m.sd / arm;
    let moment = |rule: Rule| {
        let value = sizes.mass_kg.value * (rule.value * arm).powi(2);
        let spread = 2.0 * rule.sd_fraction.hypot(arm_spread);
        (value, value * spread)
    };
    let ((xy, xy_sd), (z, z_sd)) = (moment(scaling::GYRATION_XY), moment(scaling::GYRATION_Z));
    // No body has more about z than about x and y together.
    let z = z.min(1.98 * xy);
    let source = format!(
        "guess by scaling: radii of gyration of {} and {} arms, as published quadrotors; {:.0} and {:.0} %",
        scaling::GYRATION_XY.value,
        scaling::GYRATION_Z.value,
        100.0 * xy_sd / xy,
        100.0 * z_sd / z,
    );
    lines.list("inertia_kg_m2", &[xy, xy, z], &[xy_sd, xy_sd, z_sd], &source);
}

fn drag(lines: &mut Lines, sizes: &Sizes) {
    lines.table("[drag]");
    let (linear, area) = (scaling::DRAG_PER_MASS_PER_S, scaling::DRAG_AREA_PER_ARM_SQUARED);
    let force = linear.value * sizes.mass_kg.value;
    lines.list(
        "linear_n_s_per_m",
        &[force, force, force],
        &[linear.sd_fraction * force, linear.sd_fraction * force, 0.8 * force],
        "guess by scaling: 0.4 1/s of the mass, drag of rotors; 40 %, along z 80 %",
    );
    let area_m2 = area.value * sizes.arm_m.value.powi(2);
    lines.number(
        "area_m2",
        &Number {
            value: area_m2,
            sd: area.sd_fraction * area_m2,
            source: "guess by scaling: 0.3 of the arm squared; 70 %".to_owned(),
        },
    );
}

#[cfg(test)]
mod tests;
