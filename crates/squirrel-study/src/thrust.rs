//! What wings are worth as a function of thrust: every arm through the avoidance manoeuvre at several effective
//! thrust-to-weight ratios, on paired seeds.
//!
//! The paper's real flights: 7.3 m/s, `R_d` 4 m, a turn of 110 to 130 deg; error over 6 s from the encounter. The limit
//! is the collective thrust that the flight code may ask for, so that it is the same for all arms.

use crate::statistics::{Estimate, gain, mean, paired};
use rayon::prelude::*;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{FlightError, Integrator, Metrics, Setup};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;

/// Ratios of the largest collective thrust to the weight.
pub const THRUST_TO_WEIGHT: [f64; 6] = [1.15, 1.20, 1.25, 1.30, 1.50, 2.00];
/// Standard deviation of the gusts, m/s.
const GUST_M_S: f64 = 0.5;

/// What to run.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Vehicle.
    pub vehicle: VehicleFile,
    /// Arms; `pc` is flown in any case, as the reference of the gain.
    pub arms: Vec<Arm>,
    /// Trials per arm and ratio.
    pub trials: u32,
    /// Seed of the first trial.
    pub seed: u64,
}

/// One arm at one ratio.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Row {
    /// Effective thrust-to-weight ratio.
    pub thrust_to_weight: f64,
    /// Arm.
    pub arm: &'static str,
    /// Mean over the trials of the distance to the reference, root mean square, m.
    pub rmse_m: f64,
    /// The same without height, m.
    pub rmse_horizontal_m: f64,
    /// Mean of the largest sink, m.
    pub height_lost_m: f64,
    /// Mean of the largest climb, m.
    pub height_gained_m: f64,
    /// Mean time with wings more than half spread, s.
    pub wings_open_s: f64,
    /// `mean(pc) / mean(arm) - 1` with its 95 % interval over paired trials.
    pub gain: Estimate,
}

/// The study's result.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Thrust {
    /// Trials per arm and ratio.
    pub trials: u32,
    /// Seed of the first trial.
    pub seed: u64,
    /// Ratios from small to large, arms in their order.
    pub rows: Vec<Row>,
}

/// Flies the study on all cores; the result does not depend on how many there are.
///
/// * `progress` - called once for each flight that has ended
///
/// # Errors
/// A vehicle that cannot fly.
pub fn run(plan: &Plan, progress: impl Fn() + Sync) -> Result<Thrust, FlightError> {
    if plan.trials == 0 {
        return Err(FlightError("trials = 0: must be at least 1".to_owned()));
    }
    let mut arms = plan.arms.clone();
    arms.push(Arm::Pc);
    arms.sort_unstable();
    arms.dedup();
    let mut tasks = Vec::new();
    for ratio in THRUST_TO_WEIGHT {
        for arm in &arms {
            tasks.extend((0..plan.trials).map(|trial| (ratio, *arm, trial)));
        }
    }
    let flown: Vec<Metrics> = tasks
        .par_iter()
        .map(|(ratio, arm, trial)| {
            let metrics = fly(plan, *ratio, *arm, *trial);
            progress();
            metrics
        })
        .collect::<Result<_, _>>()?;

    let trials = plan.trials as usize;
    let errors = |flights: &[Metrics]| flights.iter().map(|m| m.rmse_m).collect::<Vec<f64>>();
    let mut rows = Vec::new();
    for (flights, ratio) in flown.chunks(trials * arms.len()).zip(THRUST_TO_WEIGHT) {
        let of = |arm: usize| &flights[arm * trials..(arm + 1) * trials];
        let pc = arms.iter().position(|a| *a == Arm::Pc).map_or_else(Vec::new, |i| errors(of(i)));
        for (i, arm) in arms.iter().enumerate() {
            let average = |f: fn(&Metrics) -> f64| mean(&of(i).iter().map(f).collect::<Vec<f64>>());
            rows.push(Row {
                thrust_to_weight: ratio,
                arm: arm.name(),
                rmse_m: average(|m| m.rmse_m),
                rmse_horizontal_m: average(|m| m.rmse_horizontal_m),
                height_lost_m: average(|m| m.height_lost_m),
                height_gained_m: average(|m| m.height_gained_m),
                wings_open_s: average(|m| m.wings_open_s),
                gain: paired(&pc, &errors(of(i)), gain),
            });
        }
    }
    Ok(Thrust { trials: plan.trials, seed: plan.seed, rows })
}

/// Number of flights that [`run`] will fly.
pub fn flights(plan: &Plan) -> u64 {
    let arms = plan.arms.len() + usize::from(!plan.arms.contains(&Arm::Pc));
    THRUST_TO_WEIGHT.len() as u64 * arms as u64 * u64::from(plan.trials)
}

fn fly(plan: &Plan, ratio: f64, arm: Arm, trial: u32) -> Result<Metrics, FlightError> {
    let mut scenario = Scenario::find("avoid").map_err(FlightError)?;
    // Paired: the seed does not depend on arm or ratio.
    scenario.seed = plan.seed.wrapping_mul(1_000_003).wrapping_add(u64::from(trial));
    scenario.thrust_to_weight = Some(ratio);
    scenario.wind.gust_sigma_m_s = GUST_M_S;
    let setup = Setup { vehicle: plan.vehicle.clone(), arm, scenario, integrator: Integrator::Rk4 };
    Ok(setup.fly(false, |_| {})?.metrics)
}
