//! `squirrel fly`: one scenario, one arm, one log.

use super::hil::EmulatedM7;
use super::{facts, figures, vehicle, view, write_log};
use crate::output::{self, Table, say, talk};
use serde::Serialize;
use squirrel_sim::arm::Arm;
use squirrel_sim::estimator::Estimator;
use squirrel_sim::flight::{InProcess, Integrator, Metrics, Pilot, Setup};
use squirrel_sim::report::flight::{Heading, render};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::weights::PolicyWeights;
use std::path::PathBuf;

/// Options of a flight.
#[derive(Debug, clap::Args)]
pub(crate) struct Fly {
    /// Vehicle file; the shipped squirrel if left out.
    #[arg(long)]
    vehicle: Option<PathBuf>,
    /// Controller and what it flies: pc, pc_wings_open, wiic_no_wings, phantom, twcc_flat, twcc_parnn, twcc_oracle; if left
    /// out, twcc_flat, or pc with a policy.
    #[arg(long)]
    arm: Option<String>,
    /// Policy that flies instead of the arm's outer loop (.safetensors); the mission goes straight on, to avoid is its own
    /// business.
    #[arg(long)]
    policy: Option<PathBuf>,
    /// hover, avoid, steer, track, excite_calm, excite_normal, excite_rich, or a scenario file (.toml).
    #[arg(long, default_value = "avoid")]
    scenario: String,
    /// Seed of everything random; overrides the scenario's.
    #[arg(long)]
    seed: Option<u64>,
    /// Largest collective thrust over weight; overrides vehicle and scenario.
    #[arg(long)]
    thrust_to_weight: Option<f64>,
    /// Who estimates attitude, velocity and position: eskf, mekf, mahony, rkf_mtf, rkf_stf, kalman, external (what [sensors.attitude]
    /// says), oracle (the truth); if left out, the vehicle's.
    #[arg(long)]
    estimator: Option<String>,
    /// rk4 (rapier near contact), or rapier throughout (first order).
    #[arg(long, default_value = "rk4")]
    integrator: String,
    /// Run the flight code elsewhere: qemu, an emulated Cortex-M7.
    #[arg(long)]
    hil: Option<Hil>,
    /// Image for --hil, as `cargo xtask firmware` builds it.
    #[arg(long, default_value = "firmware/target/thumbv7em-none-eabihf/release/link")]
    hil_image: PathBuf,
    /// Flight log to write.
    #[arg(long)]
    out: Option<PathBuf>,
    /// HTML report to write.
    #[arg(long)]
    report: Option<PathBuf>,
    /// Write the figures here as JSON.
    #[arg(long)]
    json: Option<PathBuf>,
}

/// Where the flight code may run instead of here.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Hil {
    Qemu,
}

#[derive(Serialize)]
struct Flown {
    vehicle: String,
    arm: &'static str,
    estimator: &'static str,
    /// Hash of the policy's weights.
    policy: Option<String>,
    scenario: String,
    seed: u64,
    thrust_to_weight: f64,
    #[serde(flatten)]
    metrics: Metrics,
}

impl Fly {
    pub(crate) fn run(&self) -> Result<(), String> {
        let mut scenario = Scenario::find(&self.scenario)?;
        if let Some(seed) = self.seed {
            scenario.seed = seed;
        }
        if self.thrust_to_weight.is_some() {
            scenario.thrust_to_weight = self.thrust_to_weight;
        }
        let by_default = if self.policy.is_some() { Arm::Pc } else { Arm::TwccFlat };
        // What the options changed is the scenario's, and so are errors in it; the rest is the vehicle's.
        scenario.check().map_err(|e| format!("scenario {}: {e}", self.scenario))?;
        let mut vehicle = vehicle(self.vehicle.as_deref())?;
        if let Some(name) = &self.estimator {
            vehicle.estimator = Estimator::parse(name)?;
        }
        let setup = Setup {
            vehicle,
            arm: self.arm.as_deref().map_or(Ok(by_default), Arm::parse)?,
            scenario,
            integrator: Integrator::parse(&self.integrator)?,
        };
        let stack = setup.stack().map_err(|e| match &self.vehicle {
            Some(file) => format!("{}: {e}", file.display()),
            None => e.to_string(),
        })?;
        let pilot = self.policy.as_deref().map(|path| {
            let weights = PolicyWeights::load(path).map_err(|e| e.to_string())?;
            Pilot::new(weights, &setup, &stack).map_err(|e| e.to_string())
        });
        let pilot = pilot.transpose()?;
        // What flies, in words.
        let who = match &pilot {
            Some(pilot) => format!("policy {} over {}", pilot.weights().name, setup.arm.name()),
            None => setup.arm.name().to_owned(),
        };
        let policy = pilot.as_ref().map(|pilot| pilot.weights().hash());
        let record = self.out.is_some() || self.report.is_some();
        let bar = output::progress((setup.scenario.duration_s * 10.0) as u64, "x 0.1 s");
        let progress = |t: f64| bar.set_position((t * 10.0) as u64);
        let flown = match self.hil {
            None => setup.fly_on(&mut InProcess::new(stack), pilot, record, progress),
            Some(Hil::Qemu) => {
                setup.fly_on(&mut EmulatedM7::start(&self.hil_image, &stack)?, pilot, record, progress)
            }
        };
        bar.finish_and_clear();
        let mut flight = flown.map_err(|e| e.to_string())?;
        let ratio = setup.thrust_to_weight();
        say(&format!(
            "{} flies {} with {who}, seed {}, effective thrust-to-weight {ratio:.2}\n",
            setup.vehicle.name, setup.scenario.name, setup.scenario.seed,
        ));
        let cells = figures(&flight.metrics);
        let mut table = Table::new(&cells.iter().map(|(n, _)| n.as_str()).collect::<Vec<_>>());
        table.row(cells.iter().map(|(_, v)| v.clone()).collect());
        table.print();
        if let Some(log) = &mut flight.log {
            if let Some(path) = &self.out {
                write_log(log, path)?;
                talk(&format!("wrote {}", path.display()));
            }
            if let Some(path) = &self.report {
                let heading = Heading {
                    title: format!("{}: {who}", setup.scenario.name),
                    lead: String::new(),
                    facts: facts(&setup),
                    card: setup.scenario.pilot_card().map_err(|e| e.to_string())?.unwrap_or_default(),
                };
                output::write_file(path, render(&heading, &[view(&setup, log, cells)]).as_bytes())?;
                talk(&format!("wrote {}", path.display()));
            }
        }
        let result = Flown {
            vehicle: setup.vehicle.name.clone(),
            arm: setup.arm.name(),
            estimator: setup.vehicle.estimator.name(),
            policy,
            scenario: setup.scenario.name.clone(),
            seed: setup.scenario.seed,
            thrust_to_weight: ratio,
            metrics: flight.metrics,
        };
        output::write_json(self.json.as_deref(), &result)
    }
}
