//! What estimation costs in the loop: the avoidance manoeuvre on estimates beside the same flight
//! on the truth, over suites of sensors.

use crate::journal::Journal;
use crate::sheet::{Cell, Sheet};
use crate::statistics::{self, Estimate, mean, paired};
use serde::{Deserialize, Serialize};
use squirrel_sim::arm::Arm;
use squirrel_sim::estimator::Estimator;
use squirrel_sim::flight::{FlightError, Integrator, Metrics, Setup};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::sensors::{SUITES, SensorParameters};
use squirrel_sim::vehicle_file::VehicleFile;

/// Standard deviation of the gusts, m/s.
const GUST_M_S: f64 = 0.5;

/// Two flights with the same seed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Pair {
    /// Distance to the reference, root mean square, m: on estimates, on the truth.
    rmse_m: [f64; 2],
    lost: bool,
    flags: Vec<String>,
}

/// One suite of sensors.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Suite.
    pub suite: &'static str,
    /// Pairs of flights.
    pub flights: u32,
    /// Mean of the distance to the reference on estimates, m.
    pub rmse_m: f64,
    /// The same on the truth, m.
    pub oracle_rmse_m: f64,
    /// The former over the latter.
    pub ratio: Estimate,
    /// Flights on estimates that touched something or turned over.
    pub lost: u32,
    /// Flights in which something was reported.
    pub flagged: u32,
}

/// Flies `trials` pairs for each suite; without a result where the journal is a part's.
///
/// # Errors
/// A vehicle that cannot fly, or a journal that cannot be written.
pub fn run(
    vehicle: &VehicleFile,
    trials: u32,
    seed: u64,
    journal: &Journal<'_>,
) -> Result<Option<Vec<Row>>, FlightError> {
    let count = SUITES.len() as u32;
    let pairs = journal.run(trials * count, |k| {
        pair(
            vehicle,
            SUITES[(k % count) as usize],
            seed.wrapping_mul(1_000_003) + u64::from(k / count),
        )
    })?;
    let Some(pairs) = pairs else { return Ok(None) };
    let row = |(i, suite): (usize, &&'static str)| {
        let of: Vec<&Pair> = pairs.iter().skip(i).step_by(SUITES.len()).collect();
        let [ours, oracle] =
            [0, 1].map(|k| of.iter().map(|pair| pair.rmse_m[k]).collect::<Vec<_>>());
        Row {
            suite,
            flights: trials,
            rmse_m: mean(&ours),
            oracle_rmse_m: mean(&oracle),
            ratio: paired(&ours, &oracle, |a, b| statistics::gain(a, b) + 1.0),
            lost: of.iter().filter(|pair| pair.lost).count() as u32,
            flagged: of.iter().filter(|pair| !pair.flags.is_empty()).count() as u32,
        }
    };
    Ok(Some(SUITES.iter().enumerate().map(row).collect()))
}

fn pair(vehicle: &VehicleFile, suite: &str, seed: u64) -> Result<Pair, FlightError> {
    let fly = |estimator| {
        let mut vehicle = vehicle.clone();
        vehicle.sensors = SensorParameters::suite(suite).unwrap_or(vehicle.sensors);
        vehicle.estimator = estimator;
        let mut scenario = Scenario::find("avoid").map_err(FlightError)?;
        scenario.seed = seed;
        scenario.wind.gust_sigma_m_s = GUST_M_S;
        // The whole flight, so that one which a gust carries past the obstacle counts too.
        scenario.measured_window_s = 0.0;
        let setup = Setup { vehicle, arm: Arm::TwccFlat, scenario, integrator: Integrator::Rk4 };
        Ok::<Metrics, FlightError>(setup.fly(false, |_| {})?.metrics)
    };
    let (ours, oracle) = (fly(vehicle.estimator)?, fly(Estimator::Oracle)?);
    Ok(Pair {
        rmse_m: [ours.rmse_m, oracle.rmse_m],
        lost: ours.is_lost(0.0),
        flags: ours.flags.names(),
    })
}

/// The rows.
pub fn sheet(rows: &[Row]) -> Sheet {
    let mut sheet = Sheet::default();
    for row in rows {
        sheet.row(&[
            ("sensors", "suite", Cell::Text(row.suite)),
            ("flights", "flights", Cell::Number(f64::from(row.flights), 0)),
            ("RMSE", "rmse_m", Cell::Number(row.rmse_m, 2)),
            ("on the truth", "oracle_rmse_m", Cell::Number(row.oracle_rmse_m, 2)),
            ("ratio", "ratio", Cell::Number(row.ratio.value, 3)),
            ("95 % interval", "ratio_low,ratio_high", Cell::Interval(Some(row.ratio), 3)),
            ("lost", "lost", Cell::Number(f64::from(row.lost), 0)),
            ("flagged", "flagged", Cell::Number(f64::from(row.flagged), 0)),
        ]);
    }
    sheet
}
