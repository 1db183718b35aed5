//! Numbers of a vehicle file from a bench: a thrust stand, a hover, a swing.
//!
//! What is fitted replaces a number with its value, the standard deviation that the residual shows,
//! and where it comes from. Comments and order of the file stay.

mod stand;
mod swing;

pub use stand::{Stand, StandFit};
pub use swing::{Swing, SwingFit, fit as swings, period_s};

use super::VehicleFile;
use squirrel_core::math::GRAVITY_M_S2;
use squirrel_log::FlightLog;

/// A vertical specific force this close to g is hover, as a fraction of g.
const HOVER_FORCE: f64 = 0.08;
/// Fewer samples than these tell nothing.
const FEWEST_SAMPLES: usize = 50;

/// A number for the file.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Fitted {
    /// Its field.
    pub field: String,
    /// Value, or values of a list.
    pub value: Vec<f64>,
    /// One standard deviation of each.
    pub sd: Vec<f64>,
    /// What it comes from.
    pub source: String,
}

impl Fitted {
    fn one(field: &str, value: f64, sd: f64, source: &str) -> Self {
        Self {
            field: field.to_owned(),
            value: vec![value],
            sd: vec![sd],
            source: source.to_owned(),
        }
    }
}

/// What was fitted, if these are numbers.
fn finite(numbers: Vec<Fitted>, name: &str) -> Result<Vec<Fitted>, String> {
    let is_none = |f: &&Fitted| !f.value.iter().chain(&f.sd).all(|x| x.is_finite());
    numbers.iter().find(is_none).map_or(Ok(()), |Fitted { field, value, sd, .. }| {
        Err(format!("{name}: {field} comes out as {value:?}, sd {sd:?}"))
    })?;
    Ok(numbers)
}

/// Scales thrust so that the mean rotor commands of a hover carry the weight.
///
/// Samples count in which the vertical specific force is that of hover, within 8 %; with no
/// accelerometer, all.
///
/// # Errors
/// One line: a log without commands, or that hovers too little.
pub fn hover(file: &VehicleFile, log: &FlightLog, name: &str) -> Result<Vec<Fitted>, String> {
    let (time_s, command) = log
        .channel("rotor.command")
        .ok_or_else(|| format!("{name}: has no rotor.command, which --hover needs"))?;
    let p = file.vehicle.parameters();
    let count = file.vehicle.rotors().len();
    if command.width != count {
        return Err(format!(
            "{name}: rotor.command has {} rotors, {} has {count}",
            command.width, file.name
        ));
    }
    let force = log.channel("imu.specific_force_body_m_s2");
    let factors = file.vehicle.rotor_factors();
    let k_f = p.propulsion.thrust_coefficient_n_s2;
    let mut thrusts = Vec::new();
    for (i, time) in time_s.iter().enumerate() {
        let hovering = match force {
            None => true,
            Some((at_s, channel)) => {
                let k = at_s.partition_point(|t| t < time).min(at_s.len().saturating_sub(1));
                let z = channel.row(k).get(2).copied().unwrap_or(f64::NAN);
                (z / -GRAVITY_M_S2 - 1.0).abs() < HOVER_FORCE
            }
        };
        if !hovering {
            continue;
        }
        let row = command.row(i);
        let speed = |u: &f64| p.propulsion.target_speed_rad_s(*u);
        let thrust: f64 =
            row.iter().enumerate().map(|(r, u)| k_f * factors[0][r] * speed(u).powi(2)).sum();
        if thrust.is_finite() && thrust > 0.05 * file.vehicle.weight_n() {
            thrusts.push(thrust);
        }
    }
    if thrusts.len() < FEWEST_SAMPLES {
        return Err(format!(
            "{name}: hovers in {} samples, at least {FEWEST_SAMPLES} are needed",
            thrusts.len()
        ));
    }
    let mean = thrusts.iter().sum::<f64>() / thrusts.len() as f64;
    let spread = spread(&thrusts, mean) / mean;
    let scale = file.vehicle.weight_n() / mean;
    // Samples follow each other: a tenth of the scatter stays, beside the mass and the voltage.
    let mass_sd = 0.02;
    let sd = (0.1 * spread).hypot(mass_sd);
    let source = format!("fitted: hover in {name}, {} samples", thrusts.len());
    let mut fitted = Vec::new();
    match p.propulsion.thrust_curve {
        None => fitted.push(Fitted::one(
            "propulsion.thrust_coefficient_n_s2",
            k_f * scale,
            k_f * scale * sd,
            &source,
        )),
        Some(curve) => {
            let value: Vec<f64> = curve.coefficients().iter().map(|a| a * scale).collect();
            let sds = value.iter().map(|a| a.abs() * sd).collect();
            fitted.push(Fitted {
                field: "propulsion.pwm_to_thrust_n".to_owned(),
                value,
                sd: sds,
                source: source.clone(),
            });
        }
    }
    // The reaction torque over thrust stays what it was.
    let k_m = p.propulsion.torque_coefficient_n_m_s2;
    if p.propulsion.thrust_curve.is_none() && k_m > 0.0 {
        fitted.push(Fitted::one(
            "propulsion.torque_coefficient_n_m_s2",
            k_m * scale,
            0.3 * k_m * scale,
            &format!("{source}: torque over thrust as before; 30 %"),
        ));
    }
    fitted.push(Fitted::one(
        "limits.thrust_max_n",
        p.limits.thrust_max_n * scale,
        p.limits.thrust_max_n * scale * sd,
        &source,
    ));
    if let Some(volts) = mean_voltage(log) {
        fitted.push(Fitted::one("propulsion.reference_voltage_v", volts.0, volts.1, &source));
    }
    Ok(fitted)
}

/// Mean and scatter of a log's battery voltage, V.
fn mean_voltage(log: &FlightLog) -> Option<(f64, f64)> {
    let (_, channel) = log.channel("battery.voltage_v")?;
    let all: Vec<f64> = channel.values.iter().copied().filter(|v| v.is_finite()).collect();
    let mean = all.iter().sum::<f64>() / all.len().max(1) as f64;
    (mean > 0.0).then(|| (mean, spread(&all, mean)))
}

fn spread(values: &[f64], mean: f64) -> f64 {
    let squares: f64 = values.iter().map(|x| (x - mean).powi(2)).sum();
    (squares / values.len().saturating_sub(1).max(1) as f64).sqrt()
}

/// The text of a file with numbers replaced.
///
/// # Errors
/// One line: a field that the file has not, or numbers that make no vehicle.
pub fn patched(file: &VehicleFile, fitted: &[Fitted]) -> Result<String, String> {
    let mut document: toml::Table = file
        .text
        .parse()
        .map_err(|e: toml::de::Error| format!("{}: {}", file.name, e.message()))?;
    let mut text = file.text.clone();
    for number in fitted {
        text = replaced(&text, &mut document, number)
            .ok_or_else(|| format!("{}: {}: no such line to write to", file.name, number.field))?;
    }
    VehicleFile::parse(&text, &file.name).map_err(|e| format!("the fitted vehicle: {e}"))?;
    Ok(text)
}

/// Replaces the line of `table.key`; a key that is missing follows the header of its table.
fn replaced(text: &str, document: &mut toml::Table, number: &Fitted) -> Option<String> {
    let (table, key) = number.field.rsplit_once('.')?;
    let list = |values: &[f64]| {
        let rounded: Vec<f64> =
            values.iter().map(|x| format!("{x:.5e}").parse().unwrap_or(*x)).collect();
        if rounded.len() == 1 { format!("{:?}", rounded[0]) } else { format!("{rounded:?}") }
    };
    let source = toml::Value::String(number.source.clone());
    let line = format!(
        "{key} = {{ value = {}, sd = {}, source = {source} }}",
        list(&number.value),
        list(&number.sd)
    );
    document.get(table)?;
    let header = format!("[{table}]");
    let (mut lines, mut inside, mut at, mut place) = (Vec::new(), false, None, None);
    for (i, old) in text.lines().enumerate() {
        let trimmed = old.trim();
        if trimmed.starts_with('[') && !trimmed.contains('=') {
            inside = trimmed == header;
            if inside {
                at = Some(i);
            }
        } else if inside && trimmed.split('=').next().is_some_and(|own| own.trim() == key) {
            place = Some(i);
        }
        lines.push(old.to_owned());
    }
    match place {
        Some(place) => lines[place] = line,
        None => lines.insert(at? + 1, line),
    }
    let mut out = lines.join("\n");
    out.push('\n');
    Some(out)
}

#[cfg(test)]
mod tests;
