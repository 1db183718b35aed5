//! What becomes of flights in which one thing fails, or two: a thousand random faults, by kind.
//!
//! Each trial draws a fault, its size and time, a suite of sensors, a scenario, a thrust-to-weight
//! ratio and gusts; with `--faults 2` another kind on top. A flight is *lost* where it turns over,
//! meets the ground faster than a landing, or leaves the numbers. Faults are *survivable* unless a
//! rotor lacks thrust at a ratio below [`HEALTHY_RATIO`], or both inertial units are stuck, silent
//! or no number at once. A flight is *flagged* where the flight code reports anything from the fault on, be
//! it health or a reason of its failsafe. A stuck wing is *costly* where the flight errs by
//! [`COSTLY_M`] more than the same one without it.

use crate::campaign::{Draw, Plan};
use crate::journal::{Journal, Keep, check_trials};
use crate::sheet::{Cell, Sheet};
use crate::study::{Arms, Choice, Found, Study};
use serde::{Deserialize, Serialize};
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{FlightError, Integrator, Metrics, Setup};
use squirrel_sim::scenario::{FaultKind, FaultTable, Scenario};
use squirrel_sim::sensors::{SUITES, SensorParameters};
use std::collections::BTreeMap;

/// Thrust-to-weight ratio from which a weak rotor is survivable.
pub const HEALTHY_RATIO: f64 = 1.6;
/// What a rotor loses.
const ROTOR_LOSS: f64 = 0.3;
/// What a costly wing makes a flight err by, m RMSE.
pub const COSTLY_M: f64 = 0.5;
/// A vehicle that comes down slower has landed, m/s.
pub(crate) const LANDING_M_S: f64 = 2.0;
const SCENARIOS: [&str; 3] = ["avoid", "track", "hover"];

/// On the command line.
pub const STUDY: Study = Study {
    arms: Arms::Asked(&[Arm::TwccPlus]),
    options: &[Choice {
        name: "faults",
        help: "What fails in each flight: one thing, or two",
        default: 1.0,
        whole: true,
    }],
    ..Study::new(
        "faults",
        "What becomes of flights in which something fails",
        (1000, "Flights of each arm, each with random faults"),
        study,
    )
};

/// One flight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    /// Who flies.
    pub arm: String,
    /// What fails first of all kinds; by it flights are counted.
    pub fault: FaultKind,
    /// What fails: when, how much, which.
    pub faults: BTreeMap<FaultKind, FaultTable>,
    /// Sensors.
    pub suite: String,
    /// Mission.
    pub scenario: String,
    /// Effective thrust-to-weight ratio.
    pub thrust_to_weight: f64,
    /// Whether a vehicle can fly on.
    pub survivable: bool,
    /// Whether it did.
    pub survived: bool,
    /// What was reported from the fault on.
    pub flags: Vec<String>,
    /// What a stuck wing makes it err by, m RMSE, where one is.
    pub wing_cost_m: Option<f64>,
    /// Whether a command was not finite.
    pub not_finite: bool,
    /// Largest tilt, deg.
    pub tilt_max_deg: f64,
    /// Speed with which it met the ground, m/s, where it did.
    pub contact_speed_m_s: Option<f64>,
}

/// All flights of an arm with one kind of fault.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Who flies.
    pub arm: &'static str,
    /// Name of the fault.
    pub fault: &'static str,
    /// Flights.
    pub flights: u32,
    /// With a survivable fault.
    pub survivable: u32,
    /// Of those, survived.
    pub survived: u32,
    /// Flights in which something was reported.
    pub flagged: u32,
    /// Lost flights.
    pub lost: u32,
    /// Of those, without any report.
    pub lost_unflagged: u32,
    /// Flights with a costly wing.
    pub costly: u32,
    /// Of those, reported.
    pub costly_flagged: u32,
    /// Flights with a command that is not finite.
    pub not_finite: u32,
}

/// The study.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Faults {
    /// Name of the vehicle.
    pub vehicle: String,
    /// Flights of each arm.
    pub trials: u32,
    /// Seed.
    pub seed: u64,
    /// Things that fail in each.
    pub together: u32,
    /// Share of survivable flights that were survived, of all arms.
    pub survived_share: f64,
    /// By arm and fault.
    pub rows: Vec<Row>,
    /// All flights.
    pub flights: Vec<Trial>,
}

/// Flies the study; the result depends neither on threads nor on how often it was stopped.
///
/// * `plan` - its sensors are those of a drawn suite
/// * `together` - things that fail in each flight, 1 or 2
/// * `keep` - keeps the trials, so that a study that was stopped goes on; without a result where it
///   is a part of one
///
/// # Errors
/// A vehicle that cannot fly, another number of faults, or a folder that cannot be written.
pub fn run(plan: &Plan, together: u32, keep: &Keep<'_>) -> Result<Option<Faults>, FlightError> {
    check_trials(plan.trials)?;
    if !(1..=2).contains(&together) {
        return Err(FlightError(format!("--faults {together}: must be 1 or 2")));
    }
    let named = format!("{}, {together} at once", plan.identity("faults", []));
    let journal = Journal::open(keep, "faults", &named)?;
    let Some(trials) = journal.run(plan.trials, |trial| fly(plan, together, trial))? else {
        return Ok(None);
    };
    let flights: Vec<Trial> = trials.into_iter().flatten().collect();
    let rows: Vec<Row> = plan
        .arms
        .iter()
        .flat_map(|arm| FaultKind::ALL.iter().map(|kind| row(*arm, *kind, &flights)))
        .filter(|row| row.flights > 0)
        .collect();
    let sum = |of: fn(&Row) -> u32| f64::from(rows.iter().map(of).sum::<u32>());
    Ok(Some(Faults {
        vehicle: plan.vehicle.name.clone(),
        trials: plan.trials,
        seed: plan.seed,
        together,
        survived_share: sum(|row| row.survived) / sum(|row| row.survivable),
        rows,
        flights,
    }))
}

fn is_costly(trial: &Trial) -> bool {
    trial.wing_cost_m.is_some_and(|cost_m| cost_m > COSTLY_M)
}

fn row(arm: Arm, kind: FaultKind, flights: &[Trial]) -> Row {
    let of = |t: &&Trial| t.arm == arm.name() && t.fault == kind;
    let count =
        |is: fn(&Trial) -> bool| flights.iter().filter(of).filter(|trial| is(trial)).count() as u32;
    Row {
        arm: arm.name(),
        fault: kind.name(),
        flights: count(|_| true),
        survivable: count(|t| t.survivable),
        survived: count(|t| t.survivable && t.survived),
        flagged: count(|t| !t.flags.is_empty()),
        lost: count(|t| !t.survived),
        lost_unflagged: count(|t| !t.survived && t.flags.is_empty()),
        costly: count(is_costly),
        costly_flagged: count(|t| is_costly(t) && !t.flags.is_empty()),
        not_finite: count(|t| t.not_finite),
    }
}

/// What is flown in a trial, and by which sensors.
struct Drawn {
    scenario: Scenario,
    suite: &'static str,
    first: FaultKind,
}

fn draw(plan: &Plan, together: u32, trial: u32) -> Result<Drawn, FlightError> {
    let mut draw = Draw::new(plan.seed, trial);
    // Kinds take turns, so that each has its share of the flights.
    let turn = trial as usize % FaultKind::ALL.len();
    let suite = draw.one_of(&SUITES);
    let mut scenario = Scenario::find(draw.one_of(&SCENARIOS)).map_err(FlightError)?;
    scenario.seed = plan.trial_seed(trial);
    scenario.thrust_to_weight = Some(draw.between(1.2, 2.0));
    scenario.wind.gust_sigma_m_s = draw.between(0.0, 1.0);
    // Also what follows the manoeuvre counts.
    scenario.measured_window_s = 0.0;
    let rotors = plan.vehicle.vehicle.rotors().len() as u32;
    let first = FaultKind::ALL[turn];
    let table = fault(first, scenario.duration_s, rotors, &mut draw);
    scenario.faults.insert(first, table);
    if together > 1 {
        let others = FaultKind::ALL.len() - 1;
        let further = 1 + (draw.between(0.0, others as f64) as usize).min(others - 1);
        let second = FaultKind::ALL[(turn + further) % FaultKind::ALL.len()];
        let mut table = fault(second, scenario.duration_s, rotors, &mut draw);
        if weakens_rotors(first) && weakens_rotors(second) {
            // A vehicle's effects change once in a flight.
            let one = &scenario.faults[&first];
            (table.start_s, table.duration_s) = (one.start_s, one.duration_s);
        }
        scenario.faults.insert(second, table);
    }
    Ok(Drawn { scenario, suite, first })
}

fn weakens_rotors(kind: FaultKind) -> bool {
    matches!(kind, FaultKind::MotorWeak | FaultKind::BatterySag)
}

/// Whether a vehicle can fly on.
fn is_survivable(faults: &BTreeMap<FaultKind, FaultTable>, thrust_to_weight: f64) -> bool {
    let strong = thrust_to_weight >= HEALTHY_RATIO || !faults.contains_key(&FaultKind::MotorWeak);
    let silent = [FaultKind::ImuStuck, FaultKind::ImuNan, FaultKind::ImuDead];
    let mut out = faults.iter().filter(|(kind, _)| silent.contains(kind)).map(|(_, table)| table);
    let until = |table: &FaultTable| table.start_s + table.duration_s.unwrap_or(f64::INFINITY);
    let sees = match (out.next(), out.next()) {
        (Some(one), Some(other)) => {
            let apart = one.start_s >= until(other) || other.start_s >= until(one);
            one.which.is_some() && other.which.is_some() && (one.which == other.which || apart)
        }
        (Some(one), None) => one.which.is_some(),
        _ => true,
    };
    strong && sees
}

fn fault(kind: FaultKind, flight_s: f64, rotors: u32, draw: &mut Draw) -> FaultTable {
    let start_s = draw.between(2.0, 0.7 * flight_s);
    let duration_s = draw.one_of(&[None, Some(0.5), Some(2.0), Some(4.0)]);
    let sign = draw.one_of(&[-1.0, 1.0]);
    let size = match kind {
        FaultKind::GnssLost | FaultKind::ImuStuck | FaultKind::ImuNan | FaultKind::ImuDead => None,
        FaultKind::BaroStep => Some(sign * draw.between(2.0, 20.0)),
        FaultKind::ImuSpike => Some(draw.between(2.0, 30.0)),
        FaultKind::CompassSwung => Some(sign * draw.between(0.5, 3.1)),
        FaultKind::MotorWeak => Some(ROTOR_LOSS),
        FaultKind::WingStuck => Some(draw.one_of(&[0.0, 1.0])),
        FaultKind::BatterySag => Some(draw.between(0.05, 0.15)),
    };
    let which = match kind {
        FaultKind::ImuSpike | FaultKind::ImuStuck | FaultKind::ImuDead => {
            Some(draw.one_of(&[1, 2]))
        }
        FaultKind::ImuNan | FaultKind::WingStuck => draw.one_of(&[None, Some(1), Some(2)]),
        FaultKind::MotorWeak => Some(1 + draw.between(0.0, f64::from(rotors)) as u32),
        _ => None,
    };
    FaultTable { start_s, duration_s, size, which: which.map(|which: u32| which.min(rotors)) }
}

fn fly(plan: &Plan, together: u32, trial: u32) -> Result<Vec<Trial>, FlightError> {
    let Drawn { scenario, suite, first } = draw(plan, together, trial)?;
    let mut vehicle = plan.vehicle.clone();
    vehicle.sensors = SensorParameters::suite(suite).unwrap_or(vehicle.sensors);
    let thrust_to_weight = scenario
        .thrust_to_weight
        .ok_or_else(|| FlightError("a trial without a thrust-to-weight ratio".to_owned()))?;
    let survivable = is_survivable(&scenario.faults, thrust_to_weight);
    let flown = |arm: Arm, scenario: Scenario| {
        let setup = Setup { vehicle: vehicle.clone(), arm, scenario, integrator: Integrator::Rk4 };
        setup.fly(false, |_| {}).map(|flight| flight.metrics)
    };
    plan.arms
        .iter()
        .map(|arm| {
            let metrics: Metrics = flown(*arm, scenario.clone())?;
            let mut sound = scenario.clone();
            let wing_cost_m = match sound.faults.remove(&FaultKind::WingStuck) {
                Some(_) => Some(metrics.rmse_m - flown(*arm, sound)?.rmse_m),
                None => None,
            };
            Ok(Trial {
                arm: arm.name().to_owned(),
                fault: first,
                faults: scenario.faults.clone(),
                suite: suite.to_owned(),
                scenario: scenario.name.clone(),
                thrust_to_weight,
                survivable,
                survived: !metrics.is_lost(LANDING_M_S),
                flags: metrics.flags.names(),
                wing_cost_m,
                not_finite: metrics.not_finite,
                tilt_max_deg: metrics.tilt_max_rad.to_degrees(),
                contact_speed_m_s: metrics.contact_speed_m_s,
            })
        })
        .collect()
}

fn study(plan: &Plan, asked: &[f64], keep: &Keep<'_>) -> Result<Option<Found>, FlightError> {
    let Some(study) = run(plan, asked[0] as u32, keep)? else { return Ok(None) };
    let mut found = Found::of(&study)?;
    found.say(format!(
        "{} flights of {} from seed {}, in each of which {} fails.\n",
        study.trials,
        study.vehicle,
        study.seed,
        if study.together == 1 { "one thing" } else { "this and another thing" }
    ));
    let mut sheet = Sheet::default();
    for row in &study.rows {
        let count = |n: u32| Cell::Number(f64::from(n), 0);
        sheet.row(&[
            ("arm", "arm", Cell::Text(row.arm)),
            ("fault", "fault", Cell::Text(row.fault)),
            ("flights", "flights", count(row.flights)),
            ("survivable", "survivable", count(row.survivable)),
            ("survived", "survived", count(row.survived)),
            ("flagged", "flagged", count(row.flagged)),
            ("lost", "lost", count(row.lost)),
            ("lost unflagged", "lost_unflagged", count(row.lost_unflagged)),
            ("costly wing", "costly", count(row.costly)),
            ("flagged", "costly_flagged", count(row.costly_flagged)),
            ("not finite", "not_finite", count(row.not_finite)),
        ]);
    }
    found.csv = found.sheet(sheet);
    found.say(format!(
        "\nSurvived {:.1} % of the survivable flights.",
        100.0 * study.survived_share
    ));
    Ok(Some(found))
}
