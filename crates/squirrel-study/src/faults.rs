//! What becomes of flights in which one thing fails: a thousand random single faults, by kind.
//!
//! Each trial draws a fault, its size and time, a suite of sensors, a scenario, a thrust-to-weight
//! ratio and gusts. A flight is *lost* where it turns over, meets the ground faster than a landing,
//! or leaves the numbers. A fault is *survivable* unless it is a rotor that lacks thrust at a ratio
//! below [`HEALTHY_RATIO`], or both inertial units that say nothing that is a number. A fault is
//! *flagged* where the flight code reports anything from the fault on, be it health or a reason of
//! its failsafe.

use crate::campaign::{Draw, Plan};
use crate::journal::{Journal, Keep, check_trials, identity};
use crate::sheet::{Cell, Sheet};
use crate::study::{Found, Study};
use serde::{Deserialize, Serialize};
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{FlightError, Integrator, Metrics, Setup};
use squirrel_sim::scenario::{FaultKind, FaultTable, Scenario};
use squirrel_sim::sensors::{SUITES, SensorParameters};

/// Thrust-to-weight ratio from which a weak rotor is survivable.
pub const HEALTHY_RATIO: f64 = 1.6;
/// What a rotor loses.
const ROTOR_LOSS: f64 = 0.3;
/// A vehicle that comes down slower has landed, m/s.
pub(crate) const LANDING_M_S: f64 = 2.0;
const SCENARIOS: [&str; 3] = ["avoid", "track", "hover"];

/// On the command line.
pub const STUDY: Study = Study::new(
    "faults",
    "What becomes of flights in which one thing fails",
    (1000, "Flights, each with one random fault"),
    study,
);

/// One flight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    /// What fails.
    pub fault: FaultKind,
    /// When, how much, which.
    pub table: FaultTable,
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
    /// Whether a command was not finite.
    pub not_finite: bool,
    /// Largest tilt, deg.
    pub tilt_max_deg: f64,
    /// Speed with which it met the ground, m/s, where it did.
    pub contact_speed_m_s: Option<f64>,
}

/// All flights with one kind of fault.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
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
    /// Flights with a command that is not finite.
    pub not_finite: u32,
}

/// The study.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Faults {
    /// Name of the vehicle.
    pub vehicle: String,
    /// Flights.
    pub trials: u32,
    /// Seed.
    pub seed: u64,
    /// Share of survivable faults that were survived.
    pub survived_share: f64,
    /// By fault.
    pub rows: Vec<Row>,
    /// All flights.
    pub flights: Vec<Trial>,
}

/// Flies the study; the result depends neither on threads nor on how often it was stopped.
///
/// * `plan` - whose sensors are drawn, and whose arms do not matter: [`Arm::TwccFlat`] flies
/// * `keep` - keeps the trials, so that a study that was stopped goes on; without a result where it
///   is a part of one
///
/// # Errors
/// A vehicle that cannot fly, or a folder that cannot be written.
pub fn run(plan: &Plan, keep: &Keep<'_>) -> Result<Option<Faults>, FlightError> {
    check_trials(plan.trials)?;
    let journal = Journal::open(keep, "faults", &identity("faults", &plan.vehicle, plan.seed))?;
    let Some(flights) = journal.run(plan.trials, |trial| fly(plan, trial))? else {
        return Ok(None);
    };
    let rows: Vec<Row> = FaultKind::ALL
        .iter()
        .map(|kind| row(*kind, &flights))
        .filter(|row| row.flights > 0)
        .collect();
    let sum = |of: fn(&Row) -> u32| f64::from(rows.iter().map(of).sum::<u32>());
    Ok(Some(Faults {
        vehicle: plan.vehicle.name.clone(),
        trials: plan.trials,
        seed: plan.seed,
        survived_share: sum(|row| row.survived) / sum(|row| row.survivable),
        rows,
        flights,
    }))
}

fn row(kind: FaultKind, flights: &[Trial]) -> Row {
    let count = |is: fn(&Trial) -> bool| {
        flights.iter().filter(|trial| trial.fault == kind && is(trial)).count() as u32
    };
    Row {
        fault: kind.name(),
        flights: count(|_| true),
        survivable: count(|t| t.survivable),
        survived: count(|t| t.survivable && t.survived),
        flagged: count(|t| !t.flags.is_empty()),
        lost: count(|t| !t.survived),
        lost_unflagged: count(|t| !t.survived && t.flags.is_empty()),
        not_finite: count(|t| t.not_finite),
    }
}

/// The scenario of a trial with its fault, and its sensors.
///
/// # Errors
/// Never in a program that has the built-in scenarios.
pub fn scenario(plan: &Plan, trial: u32) -> Result<(Scenario, &'static str), FlightError> {
    let mut draw = Draw::new(plan.seed, trial);
    // Kinds take turns, so that each has its share of the flights.
    let kind = FaultKind::ALL[trial as usize % FaultKind::ALL.len()];
    let suite = draw.one_of(&SUITES);
    let mut scenario = Scenario::find(draw.one_of(&SCENARIOS)).map_err(FlightError)?;
    scenario.seed = plan.trial_seed(trial);
    scenario.thrust_to_weight = Some(draw.between(1.2, 2.0));
    scenario.wind.gust_sigma_m_s = draw.between(0.0, 1.0);
    // Also what follows the manoeuvre counts.
    scenario.measured_window_s = 0.0;
    let start_s = draw.between(2.0, 0.7 * scenario.duration_s);
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
        FaultKind::MotorWeak => {
            Some(1 + draw.between(0.0, plan.vehicle.vehicle.rotors().len() as f64) as u32)
        }
        _ => None,
    };
    let which = which.map(|which: u32| which.min(plan.vehicle.vehicle.rotors().len() as u32));
    scenario.faults.insert(kind, FaultTable { start_s, duration_s, size, which });
    Ok((scenario, suite))
}

fn fly(plan: &Plan, trial: u32) -> Result<Trial, FlightError> {
    let (scenario, suite) = scenario(plan, trial)?;
    let mut vehicle = plan.vehicle.clone();
    vehicle.sensors = SensorParameters::suite(suite).unwrap_or(vehicle.sensors);
    let (Some((fault, table)), Some(ratio)) =
        (scenario.faults.first_key_value(), scenario.thrust_to_weight)
    else {
        return Err(FlightError("a trial without a fault".to_owned()));
    };
    let (fault, table) = (*fault, *table);
    let survivable = match fault {
        FaultKind::MotorWeak => ratio >= HEALTHY_RATIO,
        FaultKind::ImuNan => table.which.is_some(),
        _ => true,
    };
    let name = scenario.name.clone();
    let setup = Setup { vehicle, arm: Arm::TwccFlat, scenario, integrator: Integrator::Rk4 };
    let metrics: Metrics = setup.fly(false, |_| {})?.metrics;
    Ok(Trial {
        fault,
        table,
        suite: suite.to_owned(),
        scenario: name,
        thrust_to_weight: ratio,
        survivable,
        survived: !metrics.is_lost(LANDING_M_S),
        flags: metrics.flags.names(),
        not_finite: metrics.not_finite,
        tilt_max_deg: metrics.tilt_max_rad.to_degrees(),
        contact_speed_m_s: metrics.contact_speed_m_s,
    })
}

fn study(plan: &Plan, _: &[f64], keep: &Keep<'_>) -> Result<Option<Found>, FlightError> {
    let Some(study) = run(plan, keep)? else { return Ok(None) };
    let mut found = Found::of(&study)?;
    found.say(format!(
        "{} single faults in flights of {} from seed {}.\n",
        study.trials, study.vehicle, study.seed
    ));
    let mut sheet = Sheet::default();
    for row in &study.rows {
        let count = |n: u32| Cell::Number(f64::from(n), 0);
        sheet.row(&[
            ("fault", "fault", Cell::Text(row.fault)),
            ("flights", "flights", count(row.flights)),
            ("survivable", "survivable", count(row.survivable)),
            ("survived", "survived", count(row.survived)),
            ("flagged", "flagged", count(row.flagged)),
            ("lost", "lost", count(row.lost)),
            ("lost unflagged", "lost_unflagged", count(row.lost_unflagged)),
            ("not finite", "not_finite", count(row.not_finite)),
        ]);
    }
    found.csv = found.sheet(sheet);
    found
        .say(format!("\nSurvived {:.1} % of the survivable faults.", 100.0 * study.survived_share));
    Ok(Some(found))
}
