//! The paper's forest (section V.C): who comes 400 m through trunks, and who owes it to wings.
//!
//! 7 m/s, `R_d` 5 m, turns of 110 to 130 deg, trunks of 1 m every 10.5 to 13.5 m, solid, the drone
//! with its real size. A flight that is more than [`BAND_M`] above or below its height at any time
//! has come through the plane, but not through the forest that the paper means: both counts are
//! given. An arm owes its success to wings where it comes through in the band more often than, on
//! the same trials, the arm that decides alike and has none: `phantom` for `twcc_flat`, `pc_plus`
//! for `twcc_plus`. What the others have over `phantom`, which believes in the flat plate, they owe
//! to wings and to what they believe, together.
//!
//! All of it is flown three times: with the laws as they are; with the limit of speed that ours has
//! for the paper's too; and with that limit, turning away from each trunk's axis. The paper does not
//! say to which side its drones turn, and a side that is drawn leads into the trunk in every other
//! encounter: there the turn has to end in front of it.

mod page;
mod table;

pub use page::page;
pub use table::STUDY;

use crate::campaign::{self, Flown, Plan};
use crate::journal::{Journal, Keep};
use crate::statistics::{Estimate, FEW, Share, mean, paired_shares};
use serde::{Deserialize, Serialize};
use squirrel_plan::pilot;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::FlightError;
use squirrel_sim::scenario::{MissionTable, Scenario};

/// Height that may be lost or gained, m.
pub const BAND_M: f64 = 3.0;

/// One flight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Flight {
    /// Horizontal way until the first contact, m.
    pub path_m: f64,
    /// Where it was then from the start, north and east, m.
    pub displacement_m: [f64; 2],
    /// Largest climb, m.
    pub height_gained_m: f64,
    /// Largest sink, m.
    pub height_lost_m: f64,
    /// Trunks that were avoided, or tried to.
    pub encounters: u32,
    /// Time with wings more than half spread, s.
    pub wings_open_s: f64,
    /// All of the way, without contact.
    pub through: bool,
}

impl Flight {
    /// Through, and never out of the height band.
    pub fn in_band(&self) -> bool {
        self.through && self.height_gained_m < BAND_M && self.height_lost_m < BAND_M
    }
}

/// One arm.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Arm.
    pub arm: &'static str,
    /// Flights that came through, whatever their height.
    pub through: Share,
    /// Flights that came through in the height band.
    pub in_band: Share,
    /// The latter, less that of `phantom` on the same trials.
    pub over_phantom: Option<Estimate>,
    /// And less that of `pc_plus`.
    pub over_pc_plus: Option<Estimate>,
    /// And less that of `plan_no_wings`; each absent where the rival did not fly.
    pub over_plan_no_wings: Option<Estimate>,
    /// Mean way until the first contact, m.
    pub path_m: f64,
    /// Mean distance from the start there, m.
    pub displacement_m: f64,
    /// Mean of the largest climbs, m.
    pub height_gained_m: f64,
    /// Mean of the largest sinks, m.
    pub height_lost_m: f64,
    /// Mean number of encounters.
    pub encounters: f64,
    /// Mean time with wings open, s.
    pub wings_open_s: f64,
    /// Where each flight ended.
    pub ends: Vec<End>,
}

/// Where a flight ended.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct End {
    /// From the start, north and east, m.
    pub displacement_m: [f64; 2],
    /// After all of the way, and not at a trunk or the ground.
    pub through: bool,
}

/// The study.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Forest {
    /// Name of the vehicle.
    pub vehicle: String,
    /// Flights an arm.
    pub trials: u32,
    /// Seed.
    pub seed: u64,
    /// Effective thrust-to-weight ratio.
    pub thrust_to_weight: f64,
    /// By arm, each as its law is.
    pub rows: Vec<Row>,
    /// By arm, with the scenario's limit of speed for the paper's laws too, which have none: what
    /// of the difference is that limit.
    pub limited: Vec<Row>,
    /// By arm, with that limit, turning away from the trunk instead of to a side that is drawn.
    pub away: Vec<Row>,
}

/// Flies the study on all cores; the result depends neither on threads nor on how often it was
/// stopped.
///
/// * `thrust_to_weight` - effective ratio
/// * `plan` - `phantom` is flown in any case
/// * `keep` - keeps the flights; without a result where it is a part of them
///
/// # Errors
/// A vehicle that cannot fly, or a folder that cannot be written.
pub fn run(
    plan: &Plan,
    thrust_to_weight: f64,
    keep: &Keep<'_>,
) -> Result<Option<Forest>, FlightError> {
    let plan = &plan.beside(Arm::Phantom)?;
    let first = scenario(plan, thrust_to_weight, 0)?;
    plan.check(&plan.vehicle, &first)?;
    let journal = Journal::open(keep, "forest", &plan.identity("forest", [&first]))?;
    let limited = with_limit(plan, &first);
    let fly = |arm, condition, trial| {
        let plan = if condition == AS_IT_IS { plan } else { &limited };
        let mut scenario = scenario(plan, thrust_to_weight, trial)?;
        if condition == AWAY {
            turn_away(&mut scenario);
        }
        fly(plan, arm, scenario)
    };
    let Some(flown) = campaign::run(plan, CONDITIONS, &journal, fly)? else { return Ok(None) };
    let rows = |condition| plan.arms.iter().map(|arm| row(&flown, *arm, condition)).collect();
    Ok(Some(Forest {
        vehicle: plan.vehicle.name.clone(),
        trials: plan.trials,
        seed: plan.seed,
        thrust_to_weight,
        rows: rows(AS_IT_IS),
        limited: rows(LIMITED),
        away: rows(AWAY),
    }))
}

const CONDITIONS: usize = 3;
/// As the laws are.
const AS_IT_IS: usize = 0;
/// With the limit of speed for all.
const LIMITED: usize = 1;
/// With that limit, turning away from the trunk.
const AWAY: usize = 2;

/// The plan with the scenario's limit of speed in the primary controller too.
fn with_limit(plan: &Plan, scenario: &Scenario) -> Plan {
    let mut plan = plan.clone();
    if let (Some(control), Some(speed)) = (&mut plan.vehicle.control, scenario.speed_max_m_s) {
        control.twcc.position.speed_max_m_s = speed as f32;
    }
    plan
}

/// The scenario of a trial.
///
/// # Errors
/// Never in a program that has the built-in scenario.
pub fn scenario(plan: &Plan, thrust_to_weight: f64, trial: u32) -> Result<Scenario, FlightError> {
    let mut scenario = Scenario::find("forest").map_err(FlightError)?;
    scenario.seed = plan.trial_seed(trial);
    scenario.thrust_to_weight = Some(thrust_to_weight);
    Ok(plan.outside(scenario))
}

fn turn_away(scenario: &mut Scenario) {
    if let MissionTable::Avoid { both_sides, turns_away, .. } = &mut scenario.mission {
        (*both_sides, *turns_away) = (false, true);
    }
}

fn fly(plan: &Plan, arm: Arm, scenario: Scenario) -> Result<Flight, FlightError> {
    let way_m = scenario.forest.as_ref().map_or(f64::INFINITY, |forest| forest.path_m);
    let m = pilot::fly(&plan.setup(arm, scenario), false, |_| {})?.metrics;
    Ok(Flight {
        path_m: m.path_m,
        displacement_m: m.displacement_m,
        height_gained_m: m.height_gained_m,
        height_lost_m: m.height_lost_m,
        encounters: m.encounters,
        wings_open_s: m.wings_open_s,
        through: m.path_m >= way_m && !m.is_lost(0.0),
    })
}

fn row(flown: &Flown<Flight>, arm: Arm, condition: usize) -> Row {
    let average = |figure: fn(&Flight) -> f64| mean(&flown.figures(arm, condition, figure));
    let in_band =
        |arm| flown.of(arm, condition).into_iter().map(Flight::in_band).collect::<Vec<_>>();
    let of = flown.of(arm, condition);
    let over = |rival| {
        (!flown.of(rival, condition).is_empty())
            .then(|| paired_shares(&in_band(arm), &in_band(rival)))
    };
    Row {
        arm: arm.name(),
        through: Share::of(of.iter().map(|flight| flight.through)),
        in_band: Share::of(of.iter().map(|flight| flight.in_band())),
        over_phantom: over(Arm::Phantom),
        over_pc_plus: over(Arm::PcPlus),
        over_plan_no_wings: over(Arm::PlanNoWings),
        path_m: average(|flight| flight.path_m),
        displacement_m: average(|flight| flight.displacement_m[0].hypot(flight.displacement_m[1])),
        ends: of
            .iter()
            .map(|flight| End { displacement_m: flight.displacement_m, through: flight.through })
            .collect(),
        height_gained_m: average(|flight| flight.height_gained_m),
        height_lost_m: average(|flight| flight.height_lost_m),
        encounters: average(|flight| f64::from(flight.encounters)),
        wings_open_s: average(|flight| flight.wings_open_s),
    }
}

/// What the rows say, in words: who owes its success to wings.
pub fn words(study: &Forest) -> Vec<String> {
    if study.trials < FEW {
        return vec![format!("Fewer than {FEW} trials tell nothing about wings.")];
    }
    let mut words = Vec::new();
    for row in &study.rows {
        let is = |arm: Arm| arm.name() == row.arm;
        let (rival, over) = match row.arm {
            arm if arm == Arm::TwccPlus.name() => ("pc_plus", row.over_pc_plus),
            arm if arm == Arm::PlanWings.name() => ("plan_no_wings", row.over_plan_no_wings),
            _ => ("phantom", row.over_phantom),
        };
        let Some(over) = over else { continue };
        let [value, low, high] = [over.value, over.low, over.high].map(|points| 100.0 * points);
        let points = format!("{value:+.0} points ({low:+.0} to {high:+.0}) over {rival}");
        let verdict = if is(Arm::TwccParnn) || is(Arm::TwccOracle) {
            "is, by wings and by what it believes together,"
        } else if !(is(Arm::TwccFlat) || is(Arm::TwccPlus) || is(Arm::PlanWings)) {
            continue;
        } else if over.low > 0.0 {
            "owes part of its success to wings:"
        } else if over.high < 0.0 {
            "is worse for its wings:"
        } else {
            "does not owe its success to wings, as far as these trials tell:"
        };
        let share = 100.0 * row.in_band.share.value;
        words.push(format!("{} ({share:.0} % in band) {verdict} {points}.", row.arm));
    }
    words
}
