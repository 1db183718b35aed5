//! Table III of the paper: its real flights, 7.3 m/s, `R_d` 4 m, a turn of 110 to 130 deg, with the
//! error as its log has it, by satellite fix and barometer, beside the true one.
//!
//! The paper does not say how much thrust there was, and the answer depends on little else: its
//! drone without wings sank, which it does below a ratio of about 1.3.

use crate::campaign::Plan;
use crate::journal::Keep;
use crate::pages::{begin, chart_row, facts, figure, numbers, tracks};
use crate::sheet::{Cell, Sheet};
use crate::study::{Arms, Found, Study};
use crate::thrust::PAPER_GAIN;
use crate::tracking::{self, Condition, GUST_M_S, Row};
use serde::Serialize;
use squirrel_report::chart::{Axis, Extent, Ink, RowChart, Svg};
use squirrel_report::page::{Columns, Figure};
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::FlightError;
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;

/// Arms whose tracks are shown.
const SHOWN: [Arm; 4] = [Arm::Pc, Arm::TwccParnn, Arm::TwccPlus, Arm::PcPlus];
/// Effective thrust-to-weight ratios.
pub const THRUST_TO_WEIGHT: [f64; 4] = [1.20, 1.25, 1.30, 2.00];

/// On the command line.
pub const STUDY: Study = Study {
    arms: Arms::Asked(&Arm::ALONE),
    days: true,
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
    Ok(rows.map(|rows| Table3 {
        vehicle,
        trials: plan.trials,
        seed: plan.seed,
        points: points(rows),
    }))
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
        found.page = Some(page(&study, plan)?);
    }
    Ok(Some(found))
}

/// Table III as a page without network.
///
/// # Errors
/// A flight that fails.
pub fn page(study: &Table3, plan: &Plan) -> Result<String, FlightError> {
    let lead = "The paper's real flights, 7.3 m/s, R_d 4 m, a turn of 110 to 130 deg, with the error as its log has it, by satellite \
                fix and barometer. The paper does not say how much thrust there was. Gain is the mean error of pc over that of \
                the arm, minus 1.";
    let facts = facts(&study.vehicle, study.trials, study.seed);
    let mut page = begin("Table III: the paper's real flights", lead, &facts, &[]);
    page.section(
        "Measured gain",
        "Gain of the measured errors over pc with its paired 95 % interval; the red stroke is the paper's gain of twcc_parnn.",
    );
    let of_point = |point: &Point| {
        figure(format!("T/W {:.2}", point.thrust_to_weight), String::new(), measured(point))
    };
    page.figures(Columns::Two, &study.points.iter().map(of_point).collect::<Vec<Figure>>());
    if let (Some(point), Some(condition)) =
        (study.points.first(), conditions(&plan.vehicle)?.first())
    {
        page.section(
            &format!("The first trial at T/W {:.2}", point.thrust_to_weight),
            "Tracks are coloured by speed. The paper's drone without wings sank.",
        );
        tracks(&mut page, plan, condition, &SHOWN)?;
    }
    let rows = study.points.iter().flat_map(|point| {
        point.rows.iter().map(|row| (vec![format!("{:.2}", point.thrust_to_weight)], row))
    });
    numbers(&mut page, &["T/W"], rows);
    Ok(page.html())
}

fn measured(point: &Point) -> Svg {
    let axis = Axis::new("measured gain over pc", "%");
    let label = format!("measured gain by arm at T/W {:.2}", point.thrust_to_weight);
    let mut chart = RowChart::new(&label, Columns::Two.width(), axis);
    let paper = || Extent {
        from: 100.0 * PAPER_GAIN,
        to: 100.0 * PAPER_GAIN,
        ink: Ink::Limit,
        name: format!("the paper's {:.1} %", 100.0 * PAPER_GAIN),
    };
    chart.rows.extend(point.rows.iter().filter(|row| row.arm != Arm::Pc.name()).map(|row| {
        // Plus zero turns a rounded minus zero round.
        let note = format!("{:+.1} %", (1e3 * row.gain_measured.value).round() / 10.0 + 0.0);
        let mut row = chart_row(row.arm, row.gain_measured, note);
        row.bars.push(paper());
        row
    }));
    chart.svg()
}
