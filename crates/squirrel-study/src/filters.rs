//! How far estimators of attitude are off in flight: each filter on the same agile flights, with a calibrated gyro and with one whose bias
//! nobody took off.
//!
//! Flights are random runs at up to 11 m/s with spread wings in gusts ([`crate::wing_flights`], kind `t1`), flown on the attitude that the
//! vehicle's file has a sensor for; the filters hear the recorded inertial unit, receiver and barometer, and no compass. Errors count
//! from five seconds on.

use crate::statistics::{Estimate, mean, paired};
use crate::wing_flights::Kind;
use rayon::prelude::*;
use squirrel_core::estimate::eskf::{Eskf, EskfParameters};
use squirrel_core::estimate::mahony::{Mahony, MahonyParameters};
use squirrel_core::estimate::mekf::{Mekf, MekfParameters};
use squirrel_core::estimate::rkf::{Fading, Rkf, RkfParameters};
use squirrel_core::estimate::{Estimator, Sensed};
use squirrel_core::frames::{Body, In, Ned, Rotation};
use squirrel_core::nalgebra::Vector3;
use squirrel_core::stack::Imu;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{FlightError, Integrator, Setup, frames};
use squirrel_sim::log::FlightLog;
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;

/// Bias that an uncalibrated gyro keeps, deg/s: docs/equations.md C.2.
pub const BIAS_DEG_S: [f64; 3] = [0.4, -0.3, 0.2];
/// Before that, errors do not count, s.
const SETTLED_S: f64 = 5.0;

/// Filters, in the order of tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Filter {
    /// Plain Kalman filter of the direction of gravity.
    Kalman,
    /// With a single factor.
    RkfStf,
    /// With multiple factors, the paper's.
    RkfMtf,
    /// Gated complementary filter.
    Mahony,
    /// Attitude and bias, aided by velocities of fixes.
    Mekf,
    /// Fifteen states, the default.
    Eskf,
}

impl Filter {
    /// All filters.
    pub const ALL: [Self; 6] =
        [Self::Kalman, Self::RkfStf, Self::RkfMtf, Self::Mahony, Self::Mekf, Self::Eskf];

    /// Name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Kalman => "kalman",
            Self::RkfStf => "rkf_stf",
            Self::RkfMtf => "rkf_mtf",
            Self::Mahony => "mahony",
            Self::Mekf => "mekf",
            Self::Eskf => "eskf",
        }
    }

    fn make(self, vehicle: &VehicleFile, start: Rotation<Ned, Body, f32>) -> Box<dyn Estimator> {
        let imu = &vehicle.sensors.imu;
        let (gyro, accel) = (imu.gyro_noise_rad_s as f32, imu.accel_noise_m_s2 as f32);
        let gnss = &vehicle.sensors.gnss;
        let rkf = |fading| {
            let noise =
                RkfParameters { gyro_noise_rad_s: gyro, accel_noise_m_s2: accel, ..RkfParameters::default() };
            Box::new(Rkf::new(RkfParameters { fading, ..noise }, start, In::zero()))
        };
        match self {
            Self::Kalman => rkf(Fading::None),
            Self::RkfStf => rkf(Fading::Single),
            Self::RkfMtf => rkf(Fading::Multiple),
            Self::Mahony => Box::new(Mahony::new(MahonyParameters::default(), start, In::zero())),
            Self::Mekf => {
                let noise = MekfParameters { gyro_noise_rad_s: gyro, ..MekfParameters::default() };
                Box::new(Mekf::new(noise, start, In::zero()))
            }
            Self::Eskf => {
                let parameters = EskfParameters {
                    gyro_noise_rad_s: gyro,
                    accel_noise_m_s2: accel,
                    gnss_position_noise_m: gnss.position_noise_m as f32,
                    gnss_velocity_noise_m_s: gnss.velocity_noise_m_s as f32,
                    gnss_latency_s: gnss.timing.latency_s as f32,
                    baro_noise_m: vehicle.sensors.baro.noise_m as f32,
                    ..EskfParameters::default()
                };
                Box::new(Eskf::new(parameters, start, In::zero()))
            }
        }
    }
}

/// What to run.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Vehicle.
    pub vehicle: VehicleFile,
    /// Flights.
    pub trials: u32,
    /// Seed of all trials.
    pub seed: u64,
}

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
}

/// RMS and largest error of a filter in a flight, deg.
type Errors = [f64; 2];

/// Flies the study on all cores; the result does not depend on how many there are.
///
/// * `progress` - called once for each flight that has ended
///
/// # Errors
/// A vehicle that cannot fly.
pub fn run(plan: &Plan, progress: impl Fn() + Sync) -> Result<Filters, FlightError> {
    if plan.trials == 0 {
        return Err(FlightError("trials = 0: must be at least 1".to_owned()));
    }
    let kinds: Vec<(bool, Filter)> = [true, false]
        .into_iter()
        .flat_map(|calibrated| Filter::ALL.map(|filter| (calibrated, filter)))
        .collect();
    let flown: Vec<Vec<Errors>> = (0..plan.trials)
        .into_par_iter()
        .map(|trial| {
            let log = fly(plan, trial)?;
            let errors = kinds.iter().map(|(calibrated, filter)| heard(plan, &log, *filter, *calibrated));
            let errors = errors.collect::<Result<_, _>>();
            progress();
            errors
        })
        .collect::<Result<_, _>>()?;
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
    Ok(Filters {
        vehicle: plan.vehicle.name.clone(),
        trials: plan.trials,
        seed: plan.seed,
        bias_deg_s: BIAS_DEG_S,
        rows: rows.collect(),
    })
}

/// The flights, named by their trial.
///
/// # Errors
/// Never in a program that has the built-in scenario.
pub fn scenarios(plan: &Plan) -> Result<Vec<Scenario>, FlightError> {
    (0..plan.trials).map(|trial| scenario(plan, trial)).collect()
}

fn scenario(plan: &Plan, trial: u32) -> Result<Scenario, FlightError> {
    let scenario = Kind::T1.scenario(plan.seed.wrapping_mul(1_000_003).wrapping_add(u64::from(trial)))?;
    Ok(Scenario { name: format!("trial-{trial:03}"), ..scenario })
}

fn fly(plan: &Plan, trial: u32) -> Result<FlightLog, FlightError> {
    let scenario = scenario(plan, trial)?;
    let setup =
        Setup { vehicle: plan.vehicle.clone(), arm: Arm::PcWingsOpen, scenario, integrator: Integrator::Rk4 };
    Ok(setup.fly(true, |_| {})?.log.unwrap_or_default())
}

/// What a filter makes of a flight.
fn heard(plan: &Plan, log: &FlightLog, filter: Filter, calibrated: bool) -> Result<Errors, FlightError> {
    let frames = frames(log).map_err(FlightError)?;
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
    let mut filter = filter.make(&plan.vehicle, start);
    // What the file says of the gyro is what was calibrated.
    let known = Vector3::from(plan.vehicle.sensors.imu.gyro_bias_rad_s);
    let left = if calibrated { Vector3::zeros() } else { Vector3::from(BIAS_DEG_S).map(f64::to_radians) };
    let change = (left - known).map(|x| x as f32);

    let (mut before_us, mut at) = (None, 0);
    let (mut sum, mut count, mut max) = (0.0, 0.0, 0.0_f64);
    for frame in &frames {
        let Some(imu) = frame.imu else { continue };
        let dt_s = before_us.map_or(0.0, |before: u64| frame.time_us.saturating_sub(before) as f32 * 1e-6);
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
            let down = |r: Rotation<Ned, Body, f64>| (r.inverse() * In::<Ned, f64>::new(Vector3::z())).vector;
            let believed = filter.estimate().ned_from_body.wxyz().map(f64::from);
            let (Some(believed), Some(truth)) = (Rotation::from_wxyz(believed), attitude(at)) else {
                continue;
            };
            let (believed, truth) = (down(believed), down(truth));
            let error_deg = believed.cross(&truth).norm().atan2(believed.dot(&truth)).to_degrees();
            sum += error_deg * error_deg;
            count += 1.0;
            max = max.max(error_deg);
        }
    }
    Ok([f64::sqrt(sum / count), max])
}
