//! The paper's avoidance manoeuvre, flown by every arm under every condition, and what became of
//! the tracking error: what the studies [`crate::thrust`], [`crate::table3`] and
//! [`crate::steering`] have in common.

use crate::campaign::{self, Flown, Plan};
use crate::journal::{Journal, Keep};
use crate::sheet::{Cell, Column};
use crate::statistics::{Estimate, gain, mean, paired};
use serde::{Deserialize, Serialize};
use squirrel_plan::pilot;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{FlightError, Integrator, Setup};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;

/// Standard deviation of the gusts, m/s.
pub const GUST_M_S: f64 = 0.5;

/// Under what is flown: everything but arm and seed.
#[derive(Debug, Clone)]
pub struct Condition {
    /// What flies.
    pub vehicle: VehicleFile,
    /// What it flies, in which air.
    pub scenario: Scenario,
}

/// One flight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Flight {
    /// Root mean square of the distance to the reference, m.
    pub rmse_m: f64,
    /// The same without height, m.
    pub rmse_horizontal_m: f64,
    /// The same by satellite fix and barometer, as a log of the paper's flights has it, m.
    pub rmse_measured_m: f64,
    /// Largest sink, m.
    pub height_lost_m: f64,
    /// Largest climb, m.
    pub height_gained_m: f64,
    /// Time with wings more than half spread, s.
    pub wings_open_s: f64,
    /// Mean voltage of the battery in the window, V.
    pub voltage_v: f64,
    /// It never came to the obstacle: its figures are of the whole flight.
    pub unmet: bool,
}

/// One arm under one condition.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Arm.
    pub arm: &'static str,
    /// Mean over the trials of [`Flight::rmse_m`].
    pub rmse_m: f64,
    /// Of [`Flight::rmse_horizontal_m`].
    pub rmse_horizontal_m: f64,
    /// Of [`Flight::rmse_measured_m`].
    pub rmse_measured_m: f64,
    /// Of [`Flight::height_lost_m`].
    pub height_lost_m: f64,
    /// Of [`Flight::height_gained_m`].
    pub height_gained_m: f64,
    /// Of [`Flight::wings_open_s`].
    pub wings_open_s: f64,
    /// Of [`Flight::voltage_v`].
    pub voltage_v: f64,
    /// How many flights are [`Flight::unmet`].
    pub unmet: u32,
    /// The paper's gain, `mean(pc) / mean(arm) - 1`, with its 95 % interval over paired trials.
    pub gain: Estimate,
    /// The same of the errors without height.
    pub gain_horizontal: Estimate,
    /// The same of the measured errors.
    pub gain_measured: Estimate,
    /// The gain over `phantom`, which decides like `twcc_flat` and has no wings; absent where it
    /// did not fly.
    pub gain_over_phantom: Option<Estimate>,
    /// The gain over `pc_plus`, which is `twcc_plus` with the wings folded; absent where it did not
    /// fly.
    pub gain_over_pc_plus: Option<Estimate>,
}

/// Flies conditions with the arms of a plan and [`Arm::Pc`]; rows by condition. `None` where only a
/// part is flown here.
///
/// * `name` - of the journal
///
/// # Errors
/// A vehicle that cannot fly, or a folder that cannot be written.
pub fn run(
    plan: &Plan,
    name: &str,
    conditions: &[Condition],
    keep: &Keep<'_>,
) -> Result<Option<Vec<Vec<Row>>>, FlightError> {
    let plan = plan.beside(Arm::Pc)?;
    for condition in conditions {
        plan.check(&condition.vehicle, &condition.scenario)?;
    }
    let scenarios: Vec<_> =
        conditions.iter().map(|condition| plan.outside(condition.scenario.clone())).collect();
    let journal = Journal::open(keep, name, &plan.identity(name, &scenarios))?;
    let one = |arm, condition: usize, trial| fly(&plan, &conditions[condition], arm, trial);
    let flown = campaign::run(&plan, conditions.len(), &journal, one)?;
    let rows = |flown: Flown<Flight>| {
        let of = |condition| plan.arms.iter().map(|arm| row(&flown, *arm, condition)).collect();
        (0..conditions.len()).map(of).collect()
    };
    Ok(flown.map(rows))
}

/// The flight of a trial.
pub fn setup(plan: &Plan, condition: &Condition, arm: Arm, trial: u32) -> Setup {
    let Condition { vehicle, mut scenario } = condition.clone();
    scenario.seed = plan.trial_seed(trial);
    let scenario = plan.outside(scenario);
    Setup { vehicle, arm, scenario, integrator: Integrator::Rk4 }
}

fn fly(plan: &Plan, condition: &Condition, arm: Arm, trial: u32) -> Result<Flight, FlightError> {
    let m = pilot::fly(&setup(plan, condition, arm, trial), false, |_| {})?.metrics;
    Ok(Flight {
        rmse_m: m.rmse_m,
        rmse_horizontal_m: m.rmse_horizontal_m,
        rmse_measured_m: m.rmse_measured_m.unwrap_or(m.rmse_m),
        height_lost_m: m.height_lost_m,
        height_gained_m: m.height_gained_m,
        wings_open_s: m.wings_open_s,
        voltage_v: m.voltage_mean_v,
        unmet: m.encounters == 0,
    })
}

fn row(flown: &Flown<Flight>, arm: Arm, condition: usize) -> Row {
    let of = |arm, figure: fn(&Flight) -> f64| flown.figures(arm, condition, figure);
    let average = |figure| mean(&of(arm, figure));
    let over =
        |rival, figure: fn(&Flight) -> f64| paired(&of(rival, figure), &of(arm, figure), gain);
    let gain_over = |rival| {
        (!flown.of(rival, condition).is_empty())
            .then(|| over(rival, |flight: &Flight| flight.rmse_m))
    };
    Row {
        arm: arm.name(),
        rmse_m: average(|flight| flight.rmse_m),
        rmse_horizontal_m: average(|flight| flight.rmse_horizontal_m),
        rmse_measured_m: average(|flight| flight.rmse_measured_m),
        height_lost_m: average(|flight| flight.height_lost_m),
        height_gained_m: average(|flight| flight.height_gained_m),
        wings_open_s: average(|flight| flight.wings_open_s),
        voltage_v: average(|flight| flight.voltage_v),
        unmet: flown.of(arm, condition).iter().filter(|flight| flight.unmet).count() as u32,
        gain: over(Arm::Pc, |flight| flight.rmse_m),
        gain_horizontal: over(Arm::Pc, |flight| flight.rmse_horizontal_m),
        gain_measured: over(Arm::Pc, |flight| flight.rmse_measured_m),
        gain_over_phantom: gain_over(Arm::Phantom),
        gain_over_pc_plus: gain_over(Arm::PcPlus),
    }
}

/// A row of a sheet.
pub fn columns(row: &Row) -> [Column<'_>; 12] {
    [
        ("arm", "arm", Cell::Text(row.arm)),
        ("RMSE 3-D m", "rmse_m", Cell::Number(row.rmse_m, 2)),
        ("horiz. m", "rmse_horizontal_m", Cell::Number(row.rmse_horizontal_m, 2)),
        ("measured m", "rmse_measured_m", Cell::Number(row.rmse_measured_m, 2)),
        ("gain %", "gain", Cell::Percent(row.gain.value, 1)),
        ("95 % interval", "gain_low,gain_high", Cell::PercentInterval(Some(row.gain), 1)),
        (
            "over phantom",
            "over_phantom_low,over_phantom_high",
            Cell::PercentInterval(row.gain_over_phantom, 1),
        ),
        (
            "over pc_plus",
            "over_pc_plus_low,over_pc_plus_high",
            Cell::PercentInterval(row.gain_over_pc_plus, 1),
        ),
        ("lost m", "height_lost_m", Cell::Number(row.height_lost_m, 2)),
        ("gained m", "height_gained_m", Cell::Number(row.height_gained_m, 2)),
        ("wings s", "wings_open_s", Cell::Number(row.wings_open_s, 2)),
        ("unmet", "unmet", Cell::Number(f64::from(row.unmet), 0)),
    ]
}
