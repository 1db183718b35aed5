//! Every controller beside the paper's simplest one, `pc`, in every built-in scenario and from
//! hardly any thrust to spare to plenty: who is cleverer must not lose what the simplest holds.
//!
//! A flight is *lost* where it touches anything at all, turns over or leaves the numbers; errors
//! are compared on the trials that both hold. In the forest a flight ends at a trunk, and who gets
//! on has the larger ones: there only losses count.

use crate::campaign::{self, Flown, Plan};
use crate::journal::Keep;
use crate::sheet::{Cell, Sheet};
use crate::statistics::{Estimate, mean, paired};
use crate::study::{Arms, Found, Study};
use serde::{Deserialize, Serialize};
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{FlightError, Metrics};
use squirrel_sim::scenario::{BUILT_IN, Scenario};

/// On the command line.
pub const STUDY: Study = Study {
    arms: Arms::Asked(&[Arm::TwccPlus, Arm::PcPlus, Arm::Indi]),
    days: true,
    ..Study::new(
        "rivals",
        "Every controller beside the simplest one, pc, in every scenario, from hardly any thrust to plenty",
        (3, "Flights per arm, scenario and thrust-to-weight ratio, on paired seeds"),
        study,
    )
};

/// Effective thrust-to-weight ratios.
const THRUST_TO_WEIGHT: [f64; 6] = [1.1, 1.15, 1.2, 1.25, 1.5, 2.0];
/// Errors so much larger are as good, as a share and in m.
const AS_GOOD: f64 = 1.05;
const AS_GOOD_M: f64 = 0.05;
/// Where errors are not compared.
const BY_LOSSES: &str = "forest";

/// One flight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Flight {
    rmse_m: f64,
    height_lost_m: f64,
    lost: bool,
    flagged: bool,
}

/// An arm in one scenario at one ratio.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Scenario.
    pub scenario: &'static str,
    /// Effective thrust-to-weight ratio.
    pub thrust_to_weight: f64,
    /// Arm.
    pub arm: &'static str,
    /// Lost flights.
    pub lost: u32,
    /// Of those, flights that `pc` holds.
    pub lost_that_pc_holds: u32,
    /// Of the lost ones, those without any report of the flight code.
    pub lost_unflagged: u32,
    /// Trials that the arm and `pc` hold.
    pub held_by_both: u32,
    /// Mean of the root mean square distances to the reference on those, m.
    pub rmse_m: Option<f64>,
    /// The same of `pc`, m.
    pub rmse_pc_m: Option<f64>,
    /// The former less the latter, with its 95 % interval over paired trials, m.
    pub over_pc_m: Option<Estimate>,
    /// Deepest sink on those, m.
    pub height_lost_max_m: f64,
    /// Nothing lost that `pc` holds, and no error more than a twentieth or 5 cm above its.
    pub as_good_as_pc: bool,
}

/// The study.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rivals {
    /// Name of the vehicle.
    pub vehicle: String,
    /// Flights per arm, scenario and ratio.
    pub trials: u32,
    /// Seed of all trials.
    pub seed: u64,
    /// By scenario, ratio and arm.
    pub rows: Vec<Row>,
}

/// Scenario, ratio, and what is flown.
type Condition = (&'static str, f64, Scenario);

fn conditions(plan: &Plan) -> Result<Vec<Condition>, FlightError> {
    let mut all = Vec::new();
    for name in BUILT_IN {
        for ratio in THRUST_TO_WEIGHT {
            let mut scenario = plan.outside(Scenario::find(name).map_err(FlightError)?);
            scenario.thrust_to_weight = Some(ratio);
            all.push((name, ratio, scenario));
        }
    }
    Ok(all)
}

/// Flies the study; `None` where only a part is flown here.
///
/// * `plan` - `pc` is flown in any case
///
/// # Errors
/// A vehicle that cannot fly, or a folder that cannot be written.
pub fn run(plan: &Plan, keep: &Keep<'_>) -> Result<Option<Rivals>, FlightError> {
    let plan = &plan.beside(Arm::Pc)?;
    let all = conditions(plan)?;
    let scenarios: Vec<Scenario> = all.iter().map(|(.., scenario)| scenario.clone()).collect();
    let flown = campaign::run_scenarios(plan, "rivals", &scenarios, keep, Flight::of)?;
    let Some(flown) = flown else { return Ok(None) };
    let rows = all.iter().enumerate().flat_map(|(place, condition)| {
        let flown = &flown;
        let rivals = plan.arms.iter().filter(|arm| **arm != Arm::Pc);
        rivals.map(move |arm| row(flown, *arm, place, condition))
    });
    let vehicle = plan.vehicle.name.clone();
    Ok(Some(Rivals { vehicle, trials: plan.trials, seed: plan.seed, rows: rows.collect() }))
}

impl Flight {
    fn of(m: &Metrics) -> Self {
        Self {
            rmse_m: m.rmse_m,
            height_lost_m: m.height_lost_m,
            lost: m.is_lost(0.0),
            flagged: !m.flags.names().is_empty(),
        }
    }
}

fn row(flown: &Flown<Flight>, arm: Arm, place: usize, condition: &Condition) -> Row {
    let (scenario, thrust_to_weight, _) = *condition;
    let (ours, pcs) = (flown.of(arm, place), flown.of(Arm::Pc, place));
    let count = |is: fn(&Flight, &Flight) -> bool| {
        ours.iter().zip(&pcs).filter(|(our, pc)| is(our, pc)).count() as u32
    };
    let both: Vec<_> = ours.iter().zip(&pcs).filter(|(our, pc)| !our.lost && !pc.lost).collect();
    let errors: Vec<f64> = both.iter().map(|(our, _)| our.rmse_m).collect();
    let rival: Vec<f64> = both.iter().map(|(_, pc)| pc.rmse_m).collect();
    let compared =
        (!both.is_empty() && scenario != BY_LOSSES).then(|| (mean(&errors), mean(&rival)));
    let lost_that_pc_holds = count(|our, pc| our.lost && !pc.lost);
    let is_close =
        compared.is_none_or(|(error, rival)| error <= (AS_GOOD * rival).max(rival + AS_GOOD_M));
    Row {
        scenario,
        thrust_to_weight,
        arm: arm.name(),
        lost: count(|our, _| our.lost),
        lost_that_pc_holds,
        lost_unflagged: count(|our, _| our.lost && !our.flagged),
        held_by_both: both.len() as u32,
        rmse_m: compared.map(|(error, _)| error),
        rmse_pc_m: compared.map(|(_, rival)| rival),
        over_pc_m: compared.map(|_| paired(&errors, &rival, |ours, pc| mean(ours) - mean(pc))),
        height_lost_max_m: both.iter().map(|(our, _)| our.height_lost_m).fold(0.0, f64::max),
        as_good_as_pc: lost_that_pc_holds == 0 && is_close,
    }
}

fn study(plan: &Plan, _: &[f64], keep: &Keep<'_>) -> Result<Option<Found>, FlightError> {
    let Some(study) = run(plan, keep)? else { return Ok(None) };
    let mut found = Found::of(&study)?;
    found.say(format!(
        "Every scenario beside pc, {} trials each on paired seeds from {}; RMSE of those that both hold, with the 95 % interval of the difference.\n",
        study.trials, study.seed
    ));
    let mut sheet = Sheet::default();
    for row in &study.rows {
        let number = |x: Option<f64>| x.map_or(Cell::Text("-"), |x| Cell::Number(x, 2));
        let good = if row.as_good_as_pc { "yes" } else { "NO" };
        sheet.row(&[
            ("scenario", "scenario", Cell::Text(row.scenario)),
            ("T/W", "thrust_to_weight", Cell::Number(row.thrust_to_weight, 2)),
            ("arm", "arm", Cell::Text(row.arm)),
            ("lost", "lost", Cell::Number(f64::from(row.lost), 0)),
            ("pc holds", "lost_that_pc_holds", Cell::Number(f64::from(row.lost_that_pc_holds), 0)),
            ("unflagged", "lost_unflagged", Cell::Number(f64::from(row.lost_unflagged), 0)),
            ("RMSE 3-D m", "rmse_m", number(row.rmse_m)),
            ("pc m", "rmse_pc_m", number(row.rmse_pc_m)),
            ("over pc m", "over_pc_low_m,over_pc_high_m", Cell::Interval(row.over_pc_m, 2)),
            ("sink m", "height_lost_max_m", Cell::Number(row.height_lost_max_m, 2)),
            ("as good", "as_good_as_pc", Cell::Text(good)),
        ]);
    }
    found.csv = found.sheet(sheet);
    let worse = study.rows.iter().filter(|row| !row.as_good_as_pc).count();
    found.words(vec![format!(
        "As good as pc (nothing lost that it holds, error at most {AS_GOOD} times its or {AS_GOOD_M} m above): {} of {}.",
        study.rows.len() - worse,
        study.rows.len()
    )]);
    Ok(Some(found))
}
