//! Table III of the paper: its real flights, 7.3 m/s, `R_d` 4 m, a turn of 110 to 130 deg, with the error as its log has it, by
//! satellite fix and barometer, beside the true one.
//!
//! The paper does not say how much thrust there was, and the answer depends on little else: its drone without wings sank, which it does
//! below a ratio of about 1.3.

use crate::campaign::Plan;
use crate::journal::Keep;
use crate::pages;
use crate::sheet::{Cell, Sheet};
use crate::study::{Arms, Found, Study};
use crate::tracking::{self, Condition, GUST_M_S, Row};
use serde::Serialize;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::FlightError;
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;

/// Effective thrust-to-weight ratios.
pub const THRUST_TO_WEIGHT: [f64; 4] = [1.20, 1.25, 1.30, 2.00];

/// On the command line.
pub const STUDY: Study = Study {
    arms: Arms::Asked(&Arm::ALONE),
    ..Study::new(
        "table3",
        "The paper's Table III: its real flights, with the error as satellite fix and barometer have it",
        (12, "Flights per arm and condition, on paired seeds"),
        fly,
    )
};

/// Arms at one ratio.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Point {
    /// Effective thrust-to-weight ratio.
    pub thrust_to_weight: f64,
    /// By arm.
    pub rows: Vec<Row>,
}

/// The study.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Table3 {
    /// Name of the vehicle.
    pub vehicle: String,
    /// Trials per arm and ratio; 3 in the paper.
    pub trials: u32,
    /// Seed of all trials.
    pub seed: u64,
    /// By ratio.
    pub points: Vec<Point>,
}

/// Flies the study; `None` where only a part is flown here.
///
/// # Errors
/// A vehicle that cannot fly, or a folder that cannot be written.
pub fn run(plan: &Plan, keep: &Keep<'_>) -> Result<Option<Table3>, FlightError> {
    let rows = tracking::run(plan, "table3", &conditions(&plan.vehicle)?, keep)?;
    let points = |rows: Vec<Vec<Row>>| {
        let point = |(thrust_to_weight, rows)| Point { thrust_to_weight, rows };
        THRUST_TO_WEIGHT.into_iter().zip(rows).map(point).collect()
    };
    let vehicle = plan.vehicle.name.clone();
    Ok(rows.map(|rows| Table3 { vehicle, trials: plan.trials, seed: plan.seed, points: points(rows) }))
}

/// What is flown at each ratio.
///
/// # Errors
/// Never in a program that has the built-in scenario.
pub fn conditions(vehicle: &VehicleFile) -> Result<Vec<Condition>, FlightError> {
    let condition = |ratio: &f64| {
        let mut scenario = Scenario::find("avoid").map_err(FlightError)?;
        scenario.thrust_to_weight = Some(*ratio);
        scenario.wind.gust_sigma_m_s = GUST_M_S;
        Ok(Condition { vehicle: vehicle.clone(), scenario })
    };
    THRUST_TO_WEIGHT.iter().map(condition).collect()
}

fn fly(plan: &Plan, _: &[f64], keep: &Keep<'_>) -> Result<Option<Found>, FlightError> {
    let Some(study) = run(plan, keep)? else { return Ok(None) };
    let mut found = Found::of(&study)?;
    found.say(format!(
        "The paper's real flights, {} trials an arm on paired seeds from {}; measured by satellite fix and barometer.",
        study.trials, study.seed
    ));
    found.say(
        "Gain is mean error of pc over mean error of the arm, minus 1, with its paired 95 % interval.\n",
    );
    let mut sheet = Sheet::default();
    for point in &study.points {
        for row in &point.rows {
            let (gain, columns) = (row.gain_measured, tracking::columns(row));
            let ratio = ("T/W", "thrust_to_weight", Cell::Number(point.thrust_to_weight, 2));
            let measured = [
                ("measured gain %", "gain_measured", Cell::Percent(gain.value, 1)),
                (
                    "95 % interval",
                    "gain_measured_low,gain_measured_high",
                    Cell::PercentInterval(Some(gain), 1),
                ),
            ];
            sheet.row(&[&[ratio, columns[0]], &measured[..], &columns[1..]].concat());
        }
    }
    found.csv = found.sheet(sheet);
    if keep.folder.is_some() {
        found.page = Some(pages::table3(&study, plan)?);
    }
    Ok(Some(found))
}
