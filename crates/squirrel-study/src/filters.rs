//! How far estimators of attitude are off in flight: each filter on the same agile flights, with a
//! calibrated gyro and with one whose bias nobody took off.
//!
//! Flights are random runs at up to 11 m/s with spread wings in gusts ([`crate::wing_flights`],
//! kind `t1`), flown on the vehicle's own estimator; the filters hear the recorded inertial unit,
//! receiver and barometer, and no compass. Errors count from five seconds on.

use crate::campaign::Plan;
use crate::in_loop;
use crate::journal::{self, Journal, Keep, check_trials};
use crate::sheet::{Cell, Sheet};
use crate::statistics::{Estimate, mean, paired};
use crate::study::{Found, Study};
use crate::wing_flights::Kind;
use squirrel_core::estimate::eskf::Eskf;
use squirrel_core::estimate::mahony::Mahony;
use squirrel_core::estimate::mekf::Mekf;
use squirrel_core::estimate::navigator::Filter;
use squirrel_core::estimate::rkf::Rkf;
use squirrel_core::estimate::{Estimator as Estimates, Sensed};
use squirrel_core::frames::{Body, In, Ned, Rotation};
use squirrel_core::nalgebra::Vector3;
use squirrel_core::stack::Imu;
use squirrel_log::FlightLog;
use squirrel_log::flight_code::frames;
use squirrel_sim::arm::Arm;
use squirrel_sim::estimator::Estimator;
use squirrel_sim::flight::{FlightError, Integrator, Setup};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;

/// Bias that an uncalibrated gyro keeps, deg/s: docs/equations.md C.2.
pub const BIAS_DEG_S: [f64; 3] = [0.4, -0.3, 0.2];
/// Before that, errors do not count, s.
const SETTLED_S: f64 = 5.0;

/// Filters, in the order of tables.
const FILTERS: [Estimator; 6] = [
    Estimator::Kalman,
    Estimator::RkfStf,
    Estimator::RkfMtf,
    Estimator::Mahony,
    Estimator::Mekf,
    Estimator::Eskf,
];

/// The filter of a name with what the vehicle's sensors are said to be; one that nobody told a
/// bias.
fn make(
    estimator: Estimator,
    vehicle: &VehicleFile,
    start: Rotation<Ned, Body, f32>,
) -> Option<Box<dyn Estimates>> {
    let mut sensors = vehicle.sensors;
    // It hears the first unit alone, and no compass.
    (sensors.imu.units, sensors.magnetometer) = (1, None);
    match estimator.filter(&sensors) {
        Filter::External => None,
        Filter::Rkf(p) => Some(Box::new(Rkf::new(p, start, In::zero()))),
        Filter::Mahony(p) => Some(Box::new(Mahony::new(p, start, In::zero()))),
        Filter::Mekf(p) => Some(Box::new(Mekf::new(p, start, In::zero()))),
        Filter::Eskf(p) => Some(Box::new(Eskf::new(p, start, In::zero()))),
    }
}

/// On the command line.
pub const STUDY: Study = Study {
    others: |trials| {
        let flown = (0..trials).map(|trial| format!("{FLIGHTS}/{}.toml", name(trial)));
        flown.chain([IN_LOOP, "filters_in_loop.trials.jsonl"].map(str::to_owned)).collect()
    },
    ..Study::new(
        "filters",
        "How far estimators of attitude are off in flight, with a calibrated gyro and without",
        (20, "Flights"),
        study,
    )
};

/// What is written beside the files that every study has.
const FLIGHTS: &str = "flights";
const IN_LOOP: &str = "filters_in_loop.csv";

/// A filter with one kind of gyro.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Row {
    /// Name of the filter.
    pub filter: &'static str,
    /// Whether the gyro's bias was taken off before the flight.
    pub calibrated: bool,
    /// RMS of the inclination's error, deg, mean of the trials.
    pub inclination_rms_deg: Estimate,
    /// Largest error of all trials, deg.
    pub inclination_max_deg: f64,
    /// RMS of each trial, deg.
    pub trials_deg: Vec<f64>,
}

/// The study.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Filters {
    /// Name of the vehicle.
    pub vehicle: String,
    /// Flights.
    pub trials: u32,
    /// Seed.
    pub seed: u64,
    /// Bias of the uncalibrated gyro, deg/s.
    pub bias_deg_s: [f64; 3],
    /// Calibrated gyros first, filters in their order.
    pub rows: Vec<Row>,
    /// The vehicle's own estimator in the loop, over suites of sensors.
    pub in_loop: Vec<in_loop::Row>,
}

/// RMS and largest error of a filter in a flight, deg.
type Errors = [f64; 2];

/// Flies the study on all cores; the result does not depend on how many there are.
///
/// * `plan` - whose arms do not matter: nobody decides
/// * `keep` - keeps the trials, so that a study that was stopped goes on; without a result where it
///   is a part of one
///
/// # Errors
/// A vehicle that cannot fly, or a folder that cannot be written.
pub fn run(plan: &Plan, keep: &Keep<'_>) -> Result<Option<Filters>, FlightError> {
    check_trials(plan.trials)?;
    let kinds: Vec<(bool, Estimator)> = [true, false]
        .into_iter()
        .flat_map(|calibrated| FILTERS.map(|filter| (calibrated, filter)))
        .collect();
    let identity = journal::identity("filters", &plan.vehicle, plan.seed);
    let journal = |name| Journal::open(keep, name, &identity);
    let all = |trial| -> Result<Vec<Errors>, FlightError> {
        let log = fly(plan, trial)?;
        kinds.iter().map(|(calibrated, filter)| heard(plan, &log, *filter, *calibrated)).collect()
    };
    let flown = journal("filters")?.run(plan.trials, all)?;
    let in_loop =
        in_loop::run(&plan.vehicle, plan.trials, plan.seed, &journal("filters_in_loop")?)?;
    let (Some(flown), Some(in_loop)) = (flown, in_loop) else { return Ok(None) };
    let rows = kinds.iter().enumerate().map(|(k, (calibrated, filter))| {
        let trials_deg: Vec<f64> = flown.iter().map(|trial| trial[k][0]).collect();
        Row {
            filter: filter.name(),
            calibrated: *calibrated,
            inclination_rms_deg: paired(&trials_deg, &trials_deg, |x, _| mean(x)),
            inclination_max_deg: flown.iter().fold(0.0, |max, trial| trial[k][1].max(max)),
            trials_deg,
        }
    });
    Ok(Some(Filters {
        vehicle: plan.vehicle.name.clone(),
        trials: plan.trials,
        seed: plan.seed,
        bias_deg_s: BIAS_DEG_S,
        rows: rows.collect(),
        in_loop,
    }))
}

/// The flights, named by their trial.
///
/// # Errors
/// Never in a program that has the built-in scenario.
pub fn scenarios(plan: &Plan) -> Result<Vec<Scenario>, FlightError> {
    (0..plan.trials).map(|trial| scenario(plan, trial)).collect()
}

fn scenario(plan: &Plan, trial: u32) -> Result<Scenario, FlightError> {
    let scenario = Kind::T1.scenario(plan.trial_seed(trial))?;
    Ok(Scenario { name: name(trial), ..scenario })
}

/// The name of a trial's scenario.
pub fn name(trial: u32) -> String {
    format!("trial-{trial:03}")
}

fn fly(plan: &Plan, trial: u32) -> Result<FlightLog, FlightError> {
    let scenario = scenario(plan, trial)?;
    let setup = Setup {
        vehicle: plan.vehicle.clone(),
        arm: Arm::PcWingsOpen,
        scenario,
        integrator: Integrator::Rk4,
    };
    Ok(setup.fly(true, |_| {})?.log.unwrap_or_default())
}

/// What a filter makes of a flight.
fn heard(
    plan: &Plan,
    log: &FlightLog,
    filter: Estimator,
    calibrated: bool,
) -> Result<Errors, FlightError> {
    let frames = frames(log).map_err(|error| FlightError(error.to_string()))?;
    let Some((time_s, truth)) = log.channel("truth.q_ned_from_body_wxyz") else {
        return Err(FlightError("truth.q_ned_from_body_wxyz: missing".to_owned()));
    };
    let attitude = |i: usize| {
        let row: [f64; 4] = truth.row(i).try_into().ok()?;
        Rotation::<Ned, Body, f64>::from_wxyz(row)
    };
    let unreadable = || FlightError("truth.q_ned_from_body_wxyz: not a rotation".to_owned());
    let first = attitude(0).ok_or_else(unreadable)?;
    let start = Rotation::from_wxyz(first.wxyz().map(|x| x as f32)).ok_or_else(unreadable)?;
    let Some(mut filter) = make(filter, &plan.vehicle, start) else {
        return Err(FlightError(format!("{}: is no filter", filter.name())));
    };
    // What the file says of the gyro is what was calibrated.
    let known = Vector3::from(plan.vehicle.sensors.imu.gyro_bias_rad_s);
    let left =
        if calibrated { Vector3::zeros() } else { Vector3::from(BIAS_DEG_S).map(f64::to_radians) };
    let change = (left - known).map(|x| x as f32);

    let (mut before_us, mut at) = (None, 0);
    let (mut sum, mut count, mut max) = (0.0, 0.0, 0.0_f64);
    for frame in &frames {
        let Some(imu) = frame.imu else { continue };
        let dt_s =
            before_us.map_or(0.0, |before: u64| frame.time_us.saturating_sub(before) as f32 * 1e-6);
        before_us = Some(frame.time_us);
        filter.step(&Sensed {
            dt_s,
            imu: Imu { omega: In::new(imu.omega.vector + change), ..imu },
            gnss: frame.gnss,
            altitude_m: frame.altitude_m,
            magnetic: None,
        });
        let now_s = frame.time_us as f64 * 1e-6;
        while time_s.get(at + 1).is_some_and(|next| *next <= now_s + 1e-9) {
            at += 1;
        }
        if now_s >= SETTLED_S {
            let down = |r: Rotation<Ned, Body, f64>| {
                (r.inverse() * In::<Ned, f64>::new(Vector3::z())).vector
            };
            let believed = filter.estimate().ned_from_body.wxyz().map(f64::from);
            let Some(truth) = attitude(at).map(down) else { continue };
            // What is no attitude errs as much as can be.
            let error_deg = Rotation::from_wxyz(believed).map(down).map_or(180.0, |believed| {
                believed.cross(&truth).norm().atan2(believed.dot(&truth)).to_degrees()
            });
            sum += error_deg * error_deg;
            count += 1.0;
            max = max.max(error_deg);
        }
    }
    Ok([f64::sqrt(sum / count), max])
}

fn study(plan: &Plan, _: &[f64], keep: &Keep<'_>) -> Result<Option<Found>, FlightError> {
    let Some(study) = run(plan, keep)? else { return Ok(None) };
    let mut found = Found::of(&study)?;
    found.say(format!(
        "Random runs of {} with spread wings in gusts, {} flights from seed {}; inclination, deg.\n",
        study.vehicle, study.trials, study.seed
    ));
    let mut sheet = Sheet::default();
    let [b, c, d] = study.bias_deg_s;
    let off = format!("off by {b}, {c}, {d} deg/s");
    for row in &study.rows {
        let rms = row.inclination_rms_deg;
        sheet.row(&[
            ("filter", "filter", Cell::Text(row.filter)),
            (
                "gyro",
                "calibrated",
                if row.calibrated {
                    Cell::Named("calibrated", "true")
                } else {
                    Cell::Named(&off, "false")
                },
            ),
            ("RMS", "rms_deg", Cell::Number(rms.value, 2)),
            ("95 % interval", "rms_low_deg,rms_high_deg", Cell::Interval(Some(rms), 2)),
            ("largest", "max_deg", Cell::Number(row.inclination_max_deg, 1)),
        ]);
    }
    found.csv = found.sheet(sheet);
    found.say(
        "\nThe avoidance manoeuvre on estimates over the same flight on the truth; distance to the reference, m.\n",
    );
    let in_loop = found.sheet(in_loop::sheet(&study.in_loop));
    let named = |s: Scenario| (format!("{FLIGHTS}/{}.toml", s.name), s.to_toml());
    found.others = vec![(IN_LOOP.to_owned(), in_loop)];
    found.others.extend(scenarios(plan)?.into_iter().map(named));
    Ok(Some(found))
}
