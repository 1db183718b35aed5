//! How each controller holds in wind: a circle of 6 m at 4 m/s (the scenario `track`) and the
//! paper's avoidance manoeuvre (`avoid`) in a steady wind with light gusts.
//!
//! Wind comes from ahead, from behind or from the left of a vehicle that heads north: on the circle
//! it does so all along, in the manoeuvre up to the turn. The vehicle does not know the wind. On
//! the circle wings hardly open, so that arms which differ only in wings fly nearly alike; in the
//! turn they do, and what follows is measured for 18 s. Outdoors the winds are still those of the
//! study; the rest of the day comes on top. A flight is *lost* where the vehicle turns over, meets
//! the ground or leaves the numbers, and *flagged* where the flight code reports anything.

use crate::campaign::{self, Flown, Plan};
use crate::faults::LANDING_M_S;
use crate::journal::Keep;
use crate::sheet::{Cell, Sheet};
use crate::statistics::{Estimate, Share, mean, paired};
use crate::study::{Arms, Found, Study};
use crate::tracking::GUST_M_S;
use serde::{Deserialize, Serialize};
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{FlightError, Metrics};
use squirrel_sim::scenario::Scenario;

/// On the command line.
pub const STUDY: Study = Study {
    arms: Arms::Asked(&[Arm::Pc, Arm::TwccFlat, Arm::TwccPlus, Arm::PcPlus]),
    days: true,
    ..Study::new(
        "wind",
        "How each controller holds in wind from ahead, from behind and from the side, on a circle and in a turn",
        (12, "Flights per arm and condition, on paired seeds"),
        study,
    )
};

/// Scenarios.
const MISSIONS: [&str; 2] = ["track", "avoid"];
/// Where the wind comes from, and where it blows to, north and east.
const FROM: [(&str, [f64; 2]); 3] =
    [("head", [-1.0, 0.0]), ("tail", [1.0, 0.0]), ("side", [0.0, 1.0])];
/// Speeds of the wind beside calm air, m/s.
const SPEEDS_M_S: [f64; 3] = [3.0, 5.0, 8.0];
/// Effective thrust-to-weight ratios.
const THRUST_TO_WEIGHT: [f64; 4] = [1.2, 1.25, 1.5, 2.0];
/// For so long the manoeuvre is measured, s: a vehicle that sinks has the time to show it.
pub(crate) const MEASURED_S: f64 = 18.0;

/// One flight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Flight {
    pub(crate) rmse_m: f64,
    pub(crate) height_lost_m: f64,
    /// Of that, before the first report.
    pub(crate) height_lost_unflagged_m: f64,
    wings_open_s: f64,
    pub(crate) lost: bool,
    pub(crate) flagged: bool,
}

/// An arm in one wind at one ratio.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// `track` or `avoid`.
    pub mission: &'static str,
    /// Effective thrust-to-weight ratio.
    pub thrust_to_weight: f64,
    /// `calm`, `head`, `tail` or `side`.
    pub from: &'static str,
    /// Of the steady wind, m/s.
    pub wind_m_s: f64,
    /// Arm.
    pub arm: &'static str,
    /// Root mean square of the distance to the reference, m, mean of the trials.
    pub rmse_m: Estimate,
    /// Mean of the deepest sinks, m.
    pub height_lost_m: f64,
    /// Deepest sink of all trials, m.
    pub height_lost_max_m: f64,
    /// Mean time with wings more than half spread, s.
    pub wings_open_s: f64,
    /// Lost flights.
    pub lost: Share,
    /// Of those, without any report.
    pub lost_unflagged: u32,
}

/// The study.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Wind {
    /// Name of the vehicle.
    pub vehicle: String,
    /// Flights per arm and condition.
    pub trials: u32,
    /// Seed of all trials.
    pub seed: u64,
    /// By mission, ratio, wind and arm.
    pub rows: Vec<Row>,
}

/// Mission, ratio, where the wind comes from, its speed, and what is flown in it.
type Condition = (&'static str, f64, &'static str, f64, Scenario);

fn conditions(plan: &Plan) -> Result<Vec<Condition>, FlightError> {
    let mut all = Vec::new();
    for (mission, ratio) in
        MISSIONS.into_iter().flat_map(|m| THRUST_TO_WEIGHT.map(|ratio| (m, ratio)))
    {
        let blown =
            FROM.into_iter().flat_map(|(from, to)| SPEEDS_M_S.map(|speed| (from, to, speed)));
        for (from, to, speed) in std::iter::once(("calm", [0.0; 2], 0.0)).chain(blown) {
            let mut scenario = Scenario::find(mission).map_err(FlightError)?;
            scenario.thrust_to_weight = Some(ratio);
            measure_for_long(&mut scenario);
            scenario.conditions = plan.conditions;
            scenario.wind.mean_ned_m_s = [speed * to[0], speed * to[1], 0.0];
            scenario.wind.gust_sigma_m_s = GUST_M_S;
            all.push((mission, ratio, from, speed, scenario));
        }
    }
    Ok(all)
}

/// Has a manoeuvre measured for [`MEASURED_S`]; what is measured as a whole stays so.
pub(crate) fn measure_for_long(scenario: &mut Scenario) {
    if scenario.measured_window_s > 0.0 {
        scenario.duration_s += MEASURED_S - scenario.measured_window_s;
        scenario.measured_window_s = MEASURED_S;
    }
}

/// Flies the study; `None` where only a part is flown here.
///
/// # Errors
/// A vehicle that cannot fly, or a folder that cannot be written.
pub fn run(plan: &Plan, keep: &Keep<'_>) -> Result<Option<Wind>, FlightError> {
    let all = conditions(plan)?;
    let scenarios: Vec<Scenario> = all.iter().map(|(.., scenario)| scenario.clone()).collect();
    let flown = campaign::run_scenarios(plan, "wind", &scenarios, keep, Flight::of)?;
    let Some(flown) = flown else { return Ok(None) };
    let rows = all.iter().enumerate().flat_map(|(place, condition)| {
        let flown = &flown;
        plan.arms.iter().map(move |arm| row(flown, *arm, place, condition))
    });
    let vehicle = plan.vehicle.name.clone();
    Ok(Some(Wind { vehicle, trials: plan.trials, seed: plan.seed, rows: rows.collect() }))
}

impl Flight {
    pub(crate) fn of(m: &Metrics) -> Self {
        Self {
            rmse_m: m.rmse_m,
            height_lost_m: m.height_lost_m,
            height_lost_unflagged_m: m.height_lost_unflagged_m,
            wings_open_s: m.wings_open_s,
            lost: m.is_lost(LANDING_M_S),
            flagged: !m.flags.names().is_empty(),
        }
    }
}

fn row(flown: &Flown<Flight>, arm: Arm, place: usize, condition: &Condition) -> Row {
    let (mission, thrust_to_weight, from, wind_m_s, _) = *condition;
    let (of, rmse) = (flown.of(arm, place), flown.figures(arm, place, |flight| flight.rmse_m));
    Row {
        mission,
        thrust_to_weight,
        from,
        wind_m_s,
        arm: arm.name(),
        rmse_m: paired(&rmse, &rmse, |x, _| mean(x)),
        height_lost_m: mean(&flown.figures(arm, place, |flight| flight.height_lost_m)),
        height_lost_max_m: of.iter().map(|flight| flight.height_lost_m).fold(0.0, f64::max),
        wings_open_s: mean(&flown.figures(arm, place, |flight| flight.wings_open_s)),
        lost: Share::of(of.iter().map(|flight| flight.lost)),
        lost_unflagged: of.iter().filter(|flight| flight.lost && !flight.flagged).count() as u32,
    }
}

fn study(plan: &Plan, _: &[f64], keep: &Keep<'_>) -> Result<Option<Found>, FlightError> {
    let Some(study) = run(plan, keep)? else { return Ok(None) };
    let mut found = Found::of(&study)?;
    found.say(format!(
        "A circle of 6 m at 4 m/s and the avoidance manoeuvre in wind, {} trials an arm on paired seeds from {}.",
        study.trials, study.seed
    ));
    found.say("RMSE with its 95 % interval, mean and worst of the deepest sinks, lost flights with Wilson's 95 % interval in %.\n");
    let mut sheet = Sheet::default();
    for row in &study.rows {
        sheet.row(&[
            ("mission", "mission", Cell::Text(row.mission)),
            ("T/W", "thrust_to_weight", Cell::Number(row.thrust_to_weight, 2)),
            ("wind", "wind_from", Cell::Text(row.from)),
            ("m/s", "wind_m_s", Cell::Number(row.wind_m_s, 0)),
            ("arm", "arm", Cell::Text(row.arm)),
            ("RMSE 3-D m", "rmse_m", Cell::Number(row.rmse_m.value, 2)),
            ("95 % interval", "rmse_low_m,rmse_high_m", Cell::Interval(Some(row.rmse_m), 2)),
            ("sink m", "height_lost_m", Cell::Number(row.height_lost_m, 2)),
            ("worst m", "height_lost_max_m", Cell::Number(row.height_lost_max_m, 2)),
            ("wings s", "wings_open_s", Cell::Number(row.wings_open_s, 2)),
            ("lost", "lost", Cell::Number(f64::from(row.lost.count), 0)),
            ("95 %", "lost_low,lost_high", Cell::PercentInterval(Some(row.lost.share), 0)),
            ("unflagged", "lost_unflagged", Cell::Number(f64::from(row.lost_unflagged), 0)),
        ]);
    }
    found.csv = found.sheet(sheet);
    Ok(Some(found))
}
