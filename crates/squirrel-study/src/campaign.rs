//! Flights of every arm under every condition on paired seeds: what the studies of controllers have
//! in common.
//!
//! Trial `k` has one seed, whichever arm flies it and under whatever condition, so that differences
//! between arms are of pairs.

use crate::journal::{Journal, Keep, check_trials, identity};
use serde::Serialize;
use serde::de::DeserializeOwned;
use squirrel_core::guidance::mission::scramble;
use squirrel_core::stack::wire::{HASH_START, hash};
use squirrel_plan::pilot;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{FlightError, Integrator, Metrics, Setup};
use squirrel_sim::scenario::{Conditions, Scenario, WindTable};
use squirrel_sim::vehicle_file::VehicleFile;

/// What to run.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Vehicle.
    pub vehicle: VehicleFile,
    /// Arms.
    pub arms: Vec<Arm>,
    /// Flights per arm and condition.
    pub trials: u32,
    /// Seed of all trials.
    pub seed: u64,
    /// What the day brings.
    pub conditions: Conditions,
}

impl Plan {
    /// On a calm day.
    pub fn calm(vehicle: VehicleFile, arms: Vec<Arm>, trials: u32, seed: u64) -> Self {
        Self { vehicle, arms, trials, seed, conditions: Conditions::Calm }
    }

    /// With `arm` among the arms, each of them once and in their order.
    ///
    /// # Errors
    /// No trials.
    pub fn beside(&self, arm: Arm) -> Result<Self, FlightError> {
        check_trials(self.trials)?;
        let mut plan = self.clone();
        plan.arms.push(arm);
        plan.arms.sort_unstable();
        plan.arms.dedup();
        Ok(plan)
    }

    /// Seed of a trial.
    pub fn trial_seed(&self, trial: u32) -> u64 {
        self.seed.wrapping_mul(1_000_003).wrapping_add(u64::from(trial))
    }

    /// What a result depends on beside its number, in one line.
    ///
    /// * `scenarios` - of all conditions
    pub fn identity<'a>(
        &self,
        study: &str,
        scenarios: impl IntoIterator<Item = &'a Scenario>,
    ) -> String {
        let arms: Vec<&str> = self.arms.iter().map(|arm| arm.name()).collect();
        let texts = scenarios.into_iter().fold(HASH_START, |h, s| hash(h, s.to_toml().as_bytes()));
        let arms = arms.join(" ");
        format!(
            "{}, arms {arms}, scenarios {texts:016x}",
            identity(study, &self.vehicle, self.seed)
        )
    }

    /// A scenario on this plan's day, which outdoors has its own wind and gusts.
    #[must_use]
    pub fn outside(&self, mut scenario: Scenario) -> Scenario {
        scenario.conditions = self.conditions;
        if self.conditions == Conditions::Outdoors {
            scenario.wind = WindTable::default();
        }
        scenario
    }

    /// That every arm can fly a scenario: asked before anything is kept.
    ///
    /// # Errors
    /// The first number that cannot be used, by the file's name for the vehicle and its field.
    pub fn check(&self, vehicle: &VehicleFile, scenario: &Scenario) -> Result<(), FlightError> {
        scenario.check().map_err(FlightError)?;
        for arm in &self.arms {
            let (vehicle, scenario) = (vehicle.clone(), scenario.clone());
            Setup { vehicle, arm: *arm, scenario, integrator: Integrator::Rk4 }.stack()?;
        }
        Ok(())
    }

    /// A setup of this vehicle.
    pub fn setup(&self, arm: Arm, scenario: Scenario) -> Setup {
        Setup { vehicle: self.vehicle.clone(), arm, scenario, integrator: Integrator::Rk4 }
    }
}

/// All flights of a campaign.
#[derive(Debug)]
pub struct Flown<T> {
    arms: Vec<Arm>,
    conditions: usize,
    all: Vec<T>,
}

/// Flies what the journal does not hold yet; without a result where it is a part's.
///
/// * `fly` - arm, number of the condition, trial
///
/// # Errors
/// A flight that fails, or a journal that cannot be written.
pub fn run<T: Serialize + DeserializeOwned + Send>(
    plan: &Plan,
    conditions: usize,
    journal: &Journal<'_>,
    fly: impl Fn(Arm, usize, u32) -> Result<T, FlightError> + Sync,
) -> Result<Option<Flown<T>>, FlightError> {
    let arms = plan.arms.len();
    // Trials are the slowest to change, so that a study may go on to more of them.
    let one = |k: u32| {
        let (trial, rest) = (k as usize / (conditions * arms), k as usize % (conditions * arms));
        fly(plan.arms[rest % arms], rest / arms, trial as u32)
    };
    let all = journal.run(plan.trials * (conditions * arms) as u32, one)?;
    Ok(all.map(|all| Flown { arms: plan.arms.clone(), conditions, all }))
}

/// Flies scenarios with a plan's own vehicle; the conditions are their numbers. `None` where only a
/// part is flown here.
///
/// * `name` - of the study
/// * `amounts` - what is kept of a flight
///
/// # Errors
/// A vehicle that cannot fly, or a folder that cannot be written.
pub fn run_scenarios<T: Serialize + DeserializeOwned + Send>(
    plan: &Plan,
    name: &str,
    scenarios: &[Scenario],
    keep: &Keep<'_>,
    amounts: impl Fn(&Metrics) -> T + Sync,
) -> Result<Option<Flown<T>>, FlightError> {
    for scenario in scenarios {
        plan.check(&plan.vehicle, scenario)?;
    }
    let journal = Journal::open(keep, name, &plan.identity(name, scenarios))?;
    let fly = |arm, condition: usize, trial| {
        let scenario = Scenario { seed: plan.trial_seed(trial), ..scenarios[condition].clone() };
        Ok(amounts(&pilot::fly(&plan.setup(arm, scenario), false, |_| {})?.metrics))
    };
    run(plan, scenarios.len(), &journal, fly)
}

impl<T> Flown<T> {
    /// The flights of an arm under a condition, by trial; none for an arm that did not fly.
    pub fn of(&self, arm: Arm, condition: usize) -> Vec<&T> {
        let Some(place) = self.arms.iter().position(|other| *other == arm) else {
            return Vec::new();
        };
        let first = condition * self.arms.len() + place;
        self.all.iter().skip(first).step_by(self.conditions * self.arms.len()).collect()
    }

    /// A figure of each of them.
    pub fn figures(&self, arm: Arm, condition: usize, figure: impl Fn(&T) -> f64) -> Vec<f64> {
        self.of(arm, condition).into_iter().map(figure).collect()
    }
}

/// Numbers of one trial, drawn one after the other.
pub(crate) struct Draw {
    state: u32,
}

impl Draw {
    pub(crate) fn new(seed: u64, trial: u32) -> Self {
        let seed = (seed ^ (seed >> 32)) as u32;
        Self { state: scramble(scramble(seed).wrapping_add(trial)) }
    }

    /// Uniform.
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        self.state = scramble(self.state.wrapping_add(0x9E37_79B9));
        low + (high - low) * f64::from(self.state) / f64::from(u32::MAX)
    }

    pub(crate) fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        let at = self.between(0.0, all.len() as f64) as usize;
        all[at.min(all.len() - 1)]
    }
}
