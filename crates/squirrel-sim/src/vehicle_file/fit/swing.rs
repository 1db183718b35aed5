//! A free swing: the inertia about one axis from a bifilar pendulum.
//!
//! The vehicle hangs by two parallel threads at equal distance from its centre of mass and turns
//! about the vertical: `J = m g d^2 T^2 / (16 pi^2 L)`, with the distance `d` of the threads, their
//! length `L` and the period `T` (Jardin and Mueller 2009). A CSV with a header, one row an axis and
//! a try: `axis` (x, y, z of the body: the vertical one), `period_s`, `thread_length_m`,
//! `thread_distance_m`; `mass_kg` where it is not that of the file. A flight log with a gyroscope
//! can say the period itself: [`period_s`].

use super::{Fitted, spread};
use crate::vehicle_file::VehicleFile;
use squirrel_core::math::GRAVITY_M_S2;
use squirrel_log::FlightLog;
use std::f64::consts::PI;

/// What rulers, watches and what is not parallel make of an inertia at least.
const LEAST_SD: f64 = 0.02;
const COLUMNS: [&str; 4] = ["axis", "period_s", "thread_length_m", "thread_distance_m"];
const MOST: usize = 10_000;

/// One swing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Swing {
    /// 0 to 2: x, y, z.
    pub axis: usize,
    /// s.
    pub period_s: f64,
    /// m.
    pub thread_length_m: f64,
    /// m.
    pub thread_distance_m: f64,
    /// kg; `None` for that of the file.
    pub mass_kg: Option<f64>,
}

/// What swings say.
#[derive(Debug, Clone, PartialEq)]
pub struct SwingFit {
    /// The inertia for the file.
    pub numbers: Vec<Fitted>,
}

impl Swing {
    /// Reads a CSV file's text.
    ///
    /// # Errors
    /// One line with file, row, column and value.
    pub fn parse(text: &str, name: &str) -> Result<Vec<Self>, String> {
        let mut rows = text.lines().enumerate().filter(|(_, line)| {
            let line = line.trim();
            !line.is_empty() && !line.starts_with('#')
        });
        let header = rows.next().map(|(_, line)| line).unwrap_or_default();
        let names: Vec<&str> =
            header.trim_start_matches('\u{feff}').split(',').map(str::trim).collect();
        let place = |key: &str| names.iter().position(|own| *own == key);
        let mut places = [0; 4];
        for (slot, key) in places.iter_mut().zip(COLUMNS) {
            *slot = place(key).ok_or_else(|| format!("{name}: has no column {key}"))?;
        }
        let mass = place("mass_kg");
        let mut swings = Vec::new();
        for (row, line) in rows {
            if swings.len() == MOST {
                return Err(format!("{name}: more than {MOST} rows"));
            }
            let cells: Vec<&str> = line.split(',').map(str::trim).collect();
            let cell = |column: usize| cells.get(column).copied().unwrap_or("");
            let number = |column: usize| {
                cell(column).parse::<f64>().ok().filter(|x| x.is_finite() && *x > 0.0).ok_or_else(
                    || {
                        format!(
                            "{name}, line {}: {} = {}: must be a number > 0",
                            row + 1,
                            names[column],
                            cell(column)
                        )
                    },
                )
            };
            let axis = ["x", "y", "z"]
                .iter()
                .position(|axis| *axis == cell(places[0]))
                .ok_or_else(|| {
                    format!(
                        "{name}, line {}: axis = {}: must be x, y or z",
                        row + 1,
                        cell(places[0])
                    )
                })?;
            swings.push(Self {
                axis,
                period_s: number(places[1])?,
                thread_length_m: number(places[2])?,
                thread_distance_m: number(places[3])?,
                mass_kg: mass.map(number).transpose()?,
            });
        }
        if swings.is_empty() {
            return Err(format!("{name}: has no swings"));
        }
        Ok(swings)
    }

    /// kg m^2.
    fn inertia(&self, mass_kg: f64) -> f64 {
        let mass = self.mass_kg.unwrap_or(mass_kg);
        mass * GRAVITY_M_S2 * (self.thread_distance_m * self.period_s).powi(2)
            / (16.0 * PI * PI * self.thread_length_m)
    }
}

/// The inertia of a file with what swings say of it; axes that did not swing keep theirs.
///
/// # Errors
/// One line where the file has products of inertia, or swings that give none.
pub fn fit(file: &VehicleFile, swings: &[Swing], name: &str) -> Result<SwingFit, String> {
    let p = file.vehicle.parameters();
    let j = p.inertia_kg_m2;
    if j != squirrel_core::nalgebra::Matrix3::from_diagonal(&j.diagonal()) {
        return Err(format!(
            "{}: mass.inertia_kg_m2: has products, which a swing does not tell",
            file.name
        ));
    }
    let declared = file.provenance.iter().find(|(field, _)| field == "mass.inertia_kg_m2");
    let sds: Vec<f64> = declared
        .and_then(|(_, p)| p.sd.as_ref())
        .map(|text| {
            text.split(|c: char| "[], ".contains(c)).filter_map(|x| x.parse().ok()).collect()
        })
        .unwrap_or_default();
    let (mut value, mut sd) = (Vec::new(), Vec::new());
    for axis in 0..3 {
        let of: Vec<f64> =
            swings.iter().filter(|s| s.axis == axis).map(|s| s.inertia(p.mass_kg)).collect();
        if of.is_empty() {
            value.push(j[(axis, axis)]);
            sd.push(sds.get(axis).or(sds.first()).copied().unwrap_or(0.3 * j[(axis, axis)]));
            continue;
        }
        let mean = of.iter().sum::<f64>() / of.len() as f64;
        value.push(mean);
        sd.push((spread(&of, mean) / (of.len() as f64).sqrt()).hypot(LEAST_SD * mean));
    }
    let axes: Vec<&str> = ["x", "y", "z"]
        .into_iter()
        .enumerate()
        .filter(|(axis, _)| swings.iter().any(|s| s.axis == *axis))
        .map(|(_, name)| name)
        .collect();
    let source = format!("fitted: swings about {} in {name}", axes.join(", "));
    let numbers = vec![Fitted { field: "mass.inertia_kg_m2".to_owned(), value, sd, source }];
    Ok(SwingFit { numbers: super::finite(numbers, name)? })
}

/// The axis that swings in a log, 0 to 2, and its period, s: of the body rate that turns most, the
/// mean time between rising passages of its mean.
///
/// # Errors
/// One line: no gyroscope, or fewer than four whole swings.
pub fn period_s(log: &FlightLog, name: &str) -> Result<(usize, f64), String> {
    let (time_s, rate) = log
        .channel("imu.omega_body_rad_s")
        .ok_or_else(|| format!("{name}: has no imu.omega_body_rad_s, which --spin needs"))?;
    let of = |axis: usize| -> Vec<f64> { (0..time_s.len()).map(|i| rate.row(i)[axis]).collect() };
    let mut best = (0, 0.0, Vec::new());
    for axis in 0..3 {
        let values = of(axis);
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        let size = spread(&values, mean);
        if size > best.1 {
            best = (axis, size, values.iter().map(|x| x - mean).collect());
        }
    }
    let (axis, size, values) = best;
    // A passage counts when the rate had been well below: noise around zero is none.
    let (mut armed, mut passages) = (false, Vec::new());
    for i in 1..values.len() {
        armed |= values[i - 1] < -0.3 * size;
        if armed && values[i - 1] < 0.0 && values[i] >= 0.0 {
            let part = values[i - 1] / (values[i - 1] - values[i]);
            passages.push(time_s[i - 1] + part * (time_s[i] - time_s[i - 1]));
            armed = false;
        }
    }
    match (passages.first(), passages.last()) {
        (Some(first), Some(last)) if passages.len() >= 5 => {
            Ok((axis, (last - first) / (passages.len() - 1) as f64))
        }
        _ => Err(format!(
            "{name}: {} swings in it, at least 4 are needed",
            passages.len().saturating_sub(1)
        )),
    }
}
