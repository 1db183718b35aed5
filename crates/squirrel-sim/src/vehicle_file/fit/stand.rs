//! A thrust stand: CSV with a header, one row a point, of one motor with its propeller.
//!
//! Columns, with their unit in the name; others are left alone:
//!
//! | column | what |
//! |---|---|
//! | `thrust_n`, or `thrust_g`, `thrust_kgf` | thrust; needed |
//! | `rotor_speed_rad_s`, or `rotor_speed_rpm` | speed of the rotor |
//! | `command` (0 to 1), or `command_pwm_us` (1000 to 2000) | what was asked for |
//! | `torque_n_m` | reaction torque |
//! | `voltage_v` | of the battery, at the motor controller |
//!
//! Speed or command is needed; with both the command's map to speed is fitted, too.

use super::{Fitted, spread};
use crate::vehicle_file::VehicleFile;
use squirrel_core::math::GRAVITY_M_S2;
use squirrel_core::vehicle::CommandKind;

/// Points below this part of the largest thrust are noise.
const FLOOR: f64 = 0.03;
const FEWEST: usize = 4;
/// More than any stand takes.
const MOST: usize = 1_000_000;

/// Points of a thrust stand, one a row; what a file has not is empty.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Stand {
    /// N.
    pub thrust_n: Vec<f64>,
    /// rad/s.
    pub speed_rad_s: Vec<f64>,
    /// 0 to 1.
    pub command: Vec<f64>,
    /// N m.
    pub torque_n_m: Vec<f64>,
    /// V.
    pub voltage_v: Vec<f64>,
}

/// What a stand says.
#[derive(Debug, Clone, PartialEq)]
pub struct StandFit {
    /// Numbers for the file.
    pub numbers: Vec<Fitted>,
    /// Root mean square of what the fit misses of the thrust, N.
    pub residual_n: f64,
}

/// A column: its name, which list it fills, and what a cell can be at all, in its own unit. What is
/// not is of another unit, or of another column.
struct Column {
    name: &'static str,
    list: usize,
    scale: f64,
    offset: f64,
    can_be: [f64; 2],
}

const fn column(
    name: &'static str,
    list: usize,
    [scale, offset]: [f64; 2],
    can_be: [f64; 2],
) -> Column {
    Column { name, list, scale, offset, can_be }
}

const COLUMNS: [Column; 9] = [
    // A scale that is not zeroed shows a little less than nothing.
    column("thrust_n", 0, [1.0, 0.0], [-1e4, 1e4]),
    column("thrust_g", 0, [1e-3 * GRAVITY_M_S2, 0.0], [-1e6, 1e6]),
    column("thrust_kgf", 0, [GRAVITY_M_S2, 0.0], [-1e3, 1e3]),
    column("rotor_speed_rad_s", 1, [1.0, 0.0], [0.0, 2e4]),
    column("rotor_speed_rpm", 1, [std::f64::consts::TAU / 60.0, 0.0], [0.0, 2e5]),
    column("command", 2, [1.0, 0.0], [0.0, 1.0]),
    column("command_pwm_us", 2, [1e-3, -1.0], [1000.0, 2000.0]),
    column("torque_n_m", 3, [1.0, 0.0], [-1e3, 1e3]),
    column("voltage_v", 4, [1.0, 0.0], [0.1, 1e3]),
];

impl Stand {
    /// Reads a CSV file's text.
    ///
    /// * `name` - what errors call it
    ///
    /// # Errors
    /// One line with file, row, column and value.
    pub fn parse(text: &str, name: &str) -> Result<Self, String> {
        let mut rows = text.lines().enumerate().filter(|(_, line)| {
            let line = line.trim();
            !line.is_empty() && !line.starts_with('#')
        });
        let header = rows.next().map(|(_, line)| line).unwrap_or_default();
        let names: Vec<&str> = header
            .trim_start_matches('\u{feff}')
            .split(',')
            .map(|n| n.trim().trim_matches('"'))
            .collect();
        let mut places: [Option<(usize, &Column)>; 5] = [None; 5];
        for (place, own) in names.iter().enumerate() {
            if let Some(column) = COLUMNS.iter().find(|column| column.name == *own) {
                if places[column.list].is_some() {
                    return Err(format!("{name}: {own}: a second column for the same"));
                }
                places[column.list] = Some((place, column));
            }
        }
        if places[0].is_none() {
            return Err(format!("{name}: has no column thrust_n, thrust_g or thrust_kgf"));
        }
        if places[1].is_none() && places[2].is_none() {
            return Err(format!(
                "{name}: has no column rotor_speed_rad_s, rotor_speed_rpm, command or command_pwm_us"
            ));
        }
        let mut stand = Self::default();
        for (row, line) in rows {
            if stand.thrust_n.len() == MOST {
                return Err(format!("{name}: more than {MOST} rows"));
            }
            let cells: Vec<&str> = line.split(',').collect();
            let lists = [
                &mut stand.thrust_n,
                &mut stand.speed_rad_s,
                &mut stand.command,
                &mut stand.torque_n_m,
                &mut stand.voltage_v,
            ];
            for (list, place) in lists.into_iter().zip(places) {
                let Some((place, column)) = place else { continue };
                let cell = cells.get(place).map_or("", |cell| cell.trim());
                let wrong = |what: &str| {
                    Err(format!("{name}, line {}: {} = {cell}: {what}", row + 1, column.name))
                };
                let Some(value) = cell.parse::<f64>().ok().filter(|x| x.is_finite()) else {
                    return wrong("is no number");
                };
                let [low, high] = column.can_be;
                if !(low..=high).contains(&value) {
                    return wrong(&format!("must be {low} to {high}"));
                }
                list.push(value * column.scale + column.offset);
            }
        }
        Ok(stand)
    }

    /// Coefficients of thrust and torque, the map of commands, top speed.
    ///
    /// # Errors
    /// One line: too few points, or points that no rotor makes.
    pub fn fit(&self, file: &VehicleFile, name: &str) -> Result<StandFit, String> {
        let largest = self.thrust_n.iter().copied().fold(0.0, f64::max);
        let used: Vec<usize> =
            (0..self.thrust_n.len()).filter(|i| self.thrust_n[*i] > FLOOR * largest).collect();
        if used.len() < FEWEST {
            return Err(format!(
                "{name}: {} points with thrust, at least {FEWEST} are needed",
                used.len()
            ));
        }
        let pick = |list: &[f64]| -> Option<Vec<f64>> {
            (!list.is_empty()).then(|| used.iter().map(|i| list[*i]).collect())
        };
        let thrust: Vec<f64> = used.iter().map(|i| self.thrust_n[*i]).collect();
        let (speed, command) = (pick(&self.speed_rad_s), pick(&self.command));
        let own = &file.vehicle.parameters().propulsion;
        let source = format!("fitted: {name}, {} points", used.len());
        let mut numbers = Vec::new();
        let mut top = own.speed_max_rad_s;
        if let Some(speed) = &speed {
            if let Some(bad) = speed.iter().find(|s| **s <= 0.0) {
                return Err(format!("{name}: rotor speed {bad} with thrust"));
            }
            if let Some(command) =
                command.as_ref().filter(|_| own.command != CommandKind::ThrustNewton)
            {
                // Speed at full command, by a line through the origin: the map that a vehicle has.
                let (value, sd, _) = slope(command, speed, 1);
                top = value;
                numbers.push(Fitted::one("propulsion.speed_max_rad_s", value, sd, &source));
            }
        }
        // Without a tachometer the command stands for the speed: only the product is known.
        let at: Vec<f64> = match (&speed, &command) {
            (Some(speed), _) => speed.clone(),
            (None, Some(command)) => command.iter().map(|u| u * top).collect(),
            (None, None) => return Err(format!("{name}: has neither speeds nor commands")),
        };
        let (k_f, k_f_sd, residual_n) = slope(&at, &thrust, 2);
        let curve = command.as_ref().and_then(|command| curve(command, &thrust, residual_n));
        numbers.push(Fitted::one("propulsion.thrust_coefficient_n_s2", k_f, k_f_sd, &source));
        let mut most = k_f * top * top;
        let volts = pick(&self.voltage_v).map(|volts| {
            let mean = volts.iter().sum::<f64>() / volts.len() as f64;
            (mean, spread(&volts, mean))
        });
        let reference_v = volts.map_or(own.reference_voltage_v, |(mean, _)| mean);
        if let (Some([line, square]), true) = (curve, own.command != CommandKind::ThrustNewton) {
            let value = vec![0.0, line / reference_v, square / reference_v.powi(2), 0.0];
            let sd = value.iter().map(|a| a.abs() * (k_f_sd / k_f).max(0.01)).collect();
            most = line + square;
            numbers.push(Fitted {
                field: "propulsion.pwm_to_thrust_n".to_owned(),
                value,
                sd,
                source: format!("{source}: thrust over command is no square"),
            });
        }
        if let Some(torque) = pick(&self.torque_n_m) {
            let (k_m, k_m_sd, _) = slope(&at, &torque, 2);
            numbers.push(Fitted::one(
                "propulsion.torque_coefficient_n_m_s2",
                k_m.abs(),
                k_m_sd,
                &source,
            ));
        } else {
            let k_m = own.torque_coefficient_n_m_s2 * k_f / own.thrust_coefficient_n_s2;
            numbers.push(Fitted::one(
                "propulsion.torque_coefficient_n_m_s2",
                k_m,
                0.3 * k_m,
                &format!("{source}: torque over thrust as before; 30 %"),
            ));
        }
        if let Some((mean, sd)) = volts {
            numbers.push(Fitted::one(
                "propulsion.reference_voltage_v",
                mean,
                sd.max(0.01 * mean),
                &source,
            ));
        }
        let count = file.vehicle.rotors().len() as f64;
        let spread = k_f_sd / k_f;
        numbers.push(Fitted::one(
            "limits.thrust_max_n",
            count * most,
            count * most * spread,
            &source,
        ));
        Ok(StandFit { numbers: super::finite(numbers, name)?, residual_n })
    }
}

/// Factor of `y = k x^power` by least squares, its sd, and the root mean square of the rest. Another
/// propeller of the kind differs by 2 % at least.
fn slope(x: &[f64], y: &[f64], power: i32) -> (f64, f64, f64) {
    let basis: Vec<f64> = x.iter().map(|x| x.powi(power)).collect();
    let square: f64 = basis.iter().map(|b| b * b).sum();
    let k = basis.iter().zip(y).map(|(b, y)| b * y).sum::<f64>() / square;
    let rest: f64 = basis.iter().zip(y).map(|(b, y)| (y - k * b).powi(2)).sum();
    let rms = (rest / y.len() as f64).sqrt();
    let scale = (y.iter().map(|y| y * y).sum::<f64>() / y.len() as f64).sqrt();
    // What a wrong shape misses does not average out.
    (k, k.abs() * (rms / scale).hypot(0.02), rms)
}

/// `a u + b u^2` where it misses less than half of what the square misses.
fn curve(command: &[f64], thrust: &[f64], _: f64) -> Option<[f64; 2]> {
    let (_, _, of_square) = slope(command, thrust, 2);
    let sum = |p: i32| command.iter().map(|u| u.powi(p)).sum::<f64>();
    let with = |p: i32| command.iter().zip(thrust).map(|(u, t)| u.powi(p) * t).sum::<f64>();
    let (uu, uuu, uuuu) = (sum(2), sum(3), sum(4));
    let determinant = uu * uuuu - uuu * uuu;
    if determinant <= 1e-9 * uu * uuuu {
        return None;
    }
    let line = (with(1) * uuuu - with(2) * uuu) / determinant;
    let square = (with(2) * uu - with(1) * uuu) / determinant;
    let rest: f64 =
        command.iter().zip(thrust).map(|(u, t)| (t - line * u - square * u * u).powi(2)).sum();
    let of_curve = (rest / thrust.len() as f64).sqrt();
    let rises = line >= 0.0 && line + 2.0 * square > 0.0;
    (rises && of_curve < 0.5 * of_square).then_some([line, square])
}
