//! What wings are worth as a function of thrust: every arm through the avoidance manoeuvre at
//! several effective thrust-to-weight ratios.
//!
//! The paper's real flights: 7.3 m/s, `R_d` 4 m, a turn of 110 to 130 deg; error over 6 s from the
//! encounter. Two series:
//! - `limit`: the collective thrust that the flight code may ask for, at a battery that does not
//!   sag;
//! - `battery`: slower rotors, which give [`BATTERY_RATIO`] at full speed and the reference
//!   voltage, and a battery that is emptier from flight to flight. Thrust follows its voltage
//!   (`battery_sag`), which the flight code knows; what the voltage leaves is the effective ratio.
//!
//! The last rows, `battery_alone`, have the vehicle's own rotors, to see where the battery alone
//! brings it. Little is expected of wings from the ratio on at which the tilt limit holds height, 1.155
//! with one angle at 30 deg and 1.33 with both (docs/equations.md E.4); what is gained there is
//! said beside the fair rival `pc_plus`.

mod page;

pub use page::page;

use crate::campaign::Plan;
use crate::journal::Keep;
use crate::sheet::{Cell, Sheet};
use crate::statistics::{Estimate, FEW};
use crate::study::{Arms, Found, Study};
use crate::tracking::{self, Condition, GUST_M_S, Row};
use serde::Serialize;
use squirrel_core::vehicle::Vehicle;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::FlightError;
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;

/// Ratios of the largest collective thrust to the weight.
pub const THRUST_TO_WEIGHT: [f64; 7] = [1.15, 1.20, 1.25, 1.30, 1.50, 2.00, 3.00];
/// What rotors give at the reference voltage, of which the battery takes its share.
pub const BATTERY_RATIO: f64 = 1.4;
/// Charges of the battery.
const CHARGE: [f64; 7] = [1.0, 0.6, 0.3, 0.15, 0.08, 0.05, 0.02];
/// Charges at which the vehicle's own limit is flown.
const FREE_CHARGE: [f64; 2] = [1.0, 0.02];
/// How rotor speed follows voltage: a motor between no load (1) and full load (about 0.8).
const VOLTAGE_EXPONENT: f64 = 0.9;
/// The paper's tracking gain.
pub const PAPER_GAIN: f64 = 0.131;

/// On the command line.
pub const STUDY: Study = Study {
    arms: Arms::Asked(&Arm::ALONE),
    days: true,
    ..Study::new(
        "thrust",
        "What wings are worth as a function of the thrust-to-weight ratio, with a battery that sags and without",
        (12, "Flights per arm and condition, on paired seeds"),
        fly,
    )
};

/// Arms at one ratio.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Point {
    /// `limit`, `battery` or `battery_alone`.
    pub series: &'static str,
    /// Charge of the battery at the start, where it counts.
    pub charge: Option<f64>,
    /// Effective thrust-to-weight ratio: as flown, mean of all arms.
    pub thrust_to_weight: f64,
    /// By arm.
    pub rows: Vec<Row>,
}

/// Where an arm's gain is the paper's.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Crossing {
    /// [`Point::series`].
    pub series: &'static str,
    /// Arm.
    pub arm: &'static str,
    /// Largest effective ratio at which the gain is [`PAPER_GAIN`], between neighbouring points;
    /// absent where it is nowhere.
    pub thrust_to_weight: Option<f64>,
}

/// The study's result.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Thrust {
    /// Name of the vehicle.
    pub vehicle: String,
    /// Trials per arm and ratio.
    pub trials: u32,
    /// Seed of all trials.
    pub seed: u64,
    /// By series, from small ratios to large.
    pub points: Vec<Point>,
    /// By series and arm.
    pub crossings: Vec<Crossing>,
    /// Ratios of the series `limit` at which `twcc_plus` is better than `pc_plus` by an interval
    /// that excludes zero, with the gain.
    pub headline: Vec<(f64, Estimate)>,
}

/// Flies the study on all cores; the result depends neither on threads nor on how often it was
/// stopped. `None` where only a part is flown here.
///
/// # Errors
/// A vehicle that cannot fly, or a folder that cannot be written.
pub fn run(plan: &Plan, keep: &Keep<'_>) -> Result<Option<Thrust>, FlightError> {
    let planned = planned(&plan.vehicle);
    let conditions = conditions(&plan.vehicle)?;
    let Some(rows) = tracking::run(plan, "thrust", &conditions, keep)? else {
        return Ok(None);
    };
    let reference_v = plan.vehicle.vehicle.parameters().propulsion.reference_voltage_v;
    let mut points: Vec<Point> = planned
        .into_iter()
        .zip(rows)
        .map(|((series, charge, ratio), rows)| {
            let voltage_v = rows.iter().map(|row| row.voltage_v).sum::<f64>() / rows.len() as f64;
            let sag =
                charge.map_or(1.0, |_| (voltage_v / reference_v).powf(2.0 * VOLTAGE_EXPONENT));
            Point { series, charge, thrust_to_weight: ratio * sag, rows }
        })
        .collect();
    let order = |point: &Point| SERIES.iter().position(|series| *series == point.series);
    points.sort_by(|a, b| {
        order(a).cmp(&order(b)).then(a.thrust_to_weight.total_cmp(&b.thrust_to_weight))
    });
    let mut crossings = Vec::new();
    for series in &SERIES[..2] {
        let of: Vec<&Point> = points.iter().filter(|point| point.series == *series).collect();
        for row in of.first().map_or(&[][..], |point| &point.rows) {
            let crossing =
                Crossing { series, arm: row.arm, thrust_to_weight: crossing(&of, row.arm) };
            crossings.push(crossing);
        }
    }
    let excludes_zero = |point: &Point| {
        let plus = point.rows.iter().find(|row| row.arm == "twcc_plus")?;
        plus.gain_over_pc_plus
            .filter(|gain| gain.low > 0.0)
            .map(|gain| (point.thrust_to_weight, gain))
    };
    let headline =
        points.iter().filter(|point| point.series == SERIES[0]).filter_map(excludes_zero).collect();
    let vehicle = plan.vehicle.name.clone();
    Ok(Some(Thrust { vehicle, trials: plan.trials, seed: plan.seed, points, crossings, headline }))
}

const SERIES: [&str; 3] = ["limit", "battery", "battery_alone"];

/// Series, charge and limit of each point. Without a battery there is only a limit.
fn planned(vehicle: &VehicleFile) -> Vec<(&'static str, Option<f64>, f64)> {
    let mut all: Vec<_> = THRUST_TO_WEIGHT.iter().map(|ratio| (SERIES[0], None, *ratio)).collect();
    if vehicle.battery.is_some() {
        let count = vehicle.vehicle.rotors().len() as f64;
        let own = count * vehicle.vehicle.rotor_thrust_max_n() / vehicle.vehicle.weight_n();
        all.extend(CHARGE.iter().map(|charge| (SERIES[1], Some(*charge), BATTERY_RATIO)));
        all.extend(FREE_CHARGE.iter().map(|charge| (SERIES[2], Some(*charge), own)));
    }
    all
}

/// What is flown at each point.
///
/// # Errors
/// Never in a program that has the built-in scenario and the effect.
pub fn conditions(vehicle: &VehicleFile) -> Result<Vec<Condition>, FlightError> {
    let condition = |(_, charge, ratio): (&str, Option<f64>, f64)| {
        let mut scenario = Scenario::find("avoid").map_err(FlightError)?;
        scenario.wind.gust_sigma_m_s = GUST_M_S;
        let mut vehicle = vehicle.clone();
        if let Some(charge) = charge {
            scenario.thrust_to_weight = None;
            scenario.battery_charge = charge;
            vehicle.vehicle = with_rotors(&vehicle.vehicle, ratio)?;
            let Some(sag) = vehicle.effects.insert("battery_sag") else {
                return Err(FlightError("effects.battery_sag: unknown".to_owned()));
            };
            sag.values[0] = VOLTAGE_EXPONENT;
            if let Some(control) = &mut vehicle.control {
                control.thrust.exponent = VOLTAGE_EXPONENT as f32;
            }
        } else {
            scenario.thrust_to_weight = Some(ratio);
        }
        Ok(Condition { vehicle, scenario })
    };
    planned(vehicle).into_iter().map(condition).collect()
}

/// The same vehicle with rotors that turn as fast as a ratio asks for at the reference voltage.
fn with_rotors(vehicle: &Vehicle<f64>, ratio: f64) -> Result<Vehicle<f64>, FlightError> {
    let mut p = *vehicle.parameters();
    let rotor_n = ratio * vehicle.weight_n() / vehicle.rotors().len() as f64;
    p.propulsion.speed_max_rad_s = (rotor_n / p.propulsion.thrust_coefficient_n_s2).sqrt();
    Vehicle::new(p).map_err(|e| FlightError(e.to_string()))
}

/// The largest ratio at which an arm's gain passes the paper's, on straight lines between points.
fn crossing(points: &[&Point], arm: &str) -> Option<f64> {
    let gains: Vec<[f64; 2]> = points
        .iter()
        .filter_map(|point| {
            let row = point.rows.iter().find(|row| row.arm == arm)?;
            Some([point.thrust_to_weight, row.gain.value - PAPER_GAIN])
        })
        .collect();
    gains.windows(2).rev().find_map(|pair| {
        let [[x0, y0], [x1, y1]] = pair else { return None };
        ((*y0 > 0.0) != (*y1 > 0.0)).then(|| x0 + (x1 - x0) * y0 / (y0 - y1))
    })
}

/// What the points say, in words: where the paper's gain lies, and what wings are worth to the best
/// controller.
pub fn words(study: &Thrust) -> Vec<String> {
    if study.trials < FEW {
        return vec![format!("Fewer than {FEW} trials tell nothing about wings.")];
    }
    let mut words = Vec::new();
    for (series, how) in [(SERIES[0], "by the limit"), (SERIES[1], "by the battery")] {
        let at: Vec<String> = study
            .crossings
            .iter()
            // Of the paper's arms; ours are above it at every ratio.
            .filter(|crossing| crossing.series == series && crossing.arm.starts_with("twcc_"))
            .filter_map(|crossing| {
                Some(format!("{} {:.2}", crossing.arm, crossing.thrust_to_weight?))
            })
            .collect();
        let none = || "at none of the ratios for any arm".to_owned();
        let at = if at.is_empty() {
            none()
        } else {
            format!("at an effective T/W of {}", at.join(", "))
        };
        words.push(format!("A gain of {:.1} % lies, {how}, {at}.", 100.0 * PAPER_GAIN));
    }
    let alone = study.points.iter().filter(|point| point.series == SERIES[2]);
    if let Some(least) = alone.map(|point| point.thrust_to_weight).min_by(f64::total_cmp) {
        words.push(format!(
            "The battery alone, empty, leaves the vehicle's own rotors at an effective T/W of {least:.2}."
        ));
    }
    let gains: Vec<String> = study
        .headline
        .iter()
        .map(|(ratio, gain)| {
            format!(
                "{ratio:.2}: {:+.1} % ({:+.1} to {:+.1})",
                100.0 * gain.value,
                100.0 * gain.low,
                100.0 * gain.high
            )
        })
        .collect();
    words.push(if gains.is_empty() {
        "twcc_plus over pc_plus: at no ratio does the interval exclude zero.".to_owned()
    } else {
        format!(
            "twcc_plus over pc_plus, where the interval excludes zero, at T/W {}.",
            gains.join("; ")
        )
    });
    words
}

fn fly(plan: &Plan, _: &[f64], keep: &Keep<'_>) -> Result<Option<Found>, FlightError> {
    let Some(study) = run(plan, keep)? else { return Ok(None) };
    let mut found = Found::of(&study)?;
    found.say(format!(
        "Avoidance manoeuvre, {} trials an arm on paired seeds from {}.",
        study.trials, study.seed
    ));
    found.say(
        "Gain is mean error of pc over mean error of the arm, minus 1, with its paired 95 % interval; over phantom and over",
    );
    found.say(
        "pc_plus likewise. T/W is what there was: the limit, less what the battery did not give.\n",
    );
    let mut sheet = Sheet::default();
    for point in &study.points {
        let charge = point.charge.map_or_else(|| "-".to_owned(), |charge| format!("{charge:.2}"));
        let place = [
            ("series", "series", Cell::Text(point.series)),
            ("T/W", "thrust_to_weight", Cell::Number(point.thrust_to_weight, 2)),
            ("charge", "charge", Cell::Text(&charge)),
        ];
        for row in &point.rows {
            sheet.row(&[&place[..], &tracking::columns(row)].concat());
        }
    }
    found.csv = found.sheet(sheet);
    found.words(words(&study));
    found.page = Some(page(&study));
    Ok(Some(found))
}
