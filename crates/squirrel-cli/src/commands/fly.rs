//! `squirrel fly`: one scenario, one arm, one log.

use super::hil::EmulatedM7;
use super::{commit, facts, figures, vehicle, view};
use crate::output::{self, Table, say, talk};
use crate::paths::Paths;
use serde::Serialize;
use squirrel_core::nalgebra::Vector3;
use squirrel_core::stack::Stack;
use squirrel_log::{FlightLog, LogError, LogWriter};
use squirrel_plan::pilot::offboard;
use squirrel_report::flight::{Heading, Shown, render_with_scene};
use squirrel_sim::arm::Arm;
use squirrel_sim::estimator::Estimator;
use squirrel_sim::flight::{
    FlightError, Follower, InProcess, Integrator, Metrics, Offboard, Recipient, Recording, Setup,
};
use squirrel_sim::scenario::{BUILT_IN, Conditions, MissionTable, Scenario};
use squirrel_sim::track::Track;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_sim::weights::PolicyWeights;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Options of a flight.
#[derive(Debug, clap::Args)]
pub(crate) struct Fly {
    /// Vehicle file, or the name of a bundled vehicle; squirrel if left out.
    #[arg(long)]
    vehicle: Option<PathBuf>,
    #[arg(long, help = arms())]
    arm: Option<String>,
    /// Policy that flies instead of the arm's outer loop (.safetensors); the mission goes straight
    /// on, to avoid is its own business.
    #[arg(long)]
    policy: Option<PathBuf>,
    /// Plan to fly along instead of the mission (.mcap, as `squirrel plan` writes it, or any log
    /// with a reference), to its end.
    #[arg(long, conflicts_with = "policy")]
    reference: Option<PathBuf>,
    #[arg(long, default_value = "avoid", help = scenarios())]
    scenario: String,
    /// Seed of everything random; overrides the scenario's.
    #[arg(long)]
    seed: Option<u64>,
    /// What the day brings: nothing (calm), or wind with turbulence, battery sag and late fixes
    /// (outdoors); overrides the scenario's.
    #[arg(long)]
    conditions: Option<String>,
    /// Largest collective thrust over weight; overrides vehicle and scenario.
    #[arg(long)]
    thrust_to_weight: Option<f64>,
    /// Who estimates attitude, velocity and position: eskf, mekf, mahony, rkf_mtf, rkf_stf, kalman,
    /// external (what [sensors.attitude] says), oracle (the truth); if left out, the vehicle's.
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

/// The help of `--arm`, with all names that there are.
fn arms() -> String {
    let names: Vec<&str> = Arm::all().map(Arm::name).collect();
    format!(
        "Controller and what it flies: {}; if left out, twcc_flat, or pc with a policy or a reference",
        names.join(", ")
    )
}

/// The help of `--scenario`, likewise.
fn scenarios() -> String {
    format!("{}, or a scenario file (.toml)", BUILT_IN.join(", "))
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

/// Where a flight goes while it is flown.
struct Recorded<'a> {
    out: Option<&'a Path>,
    writer: Option<LogWriter>,
    /// For the report.
    shown: Option<Shown>,
    /// Why the log could not be written.
    refused: Option<String>,
}

impl Recorded<'_> {
    fn written<T>(&mut self, result: Result<T, LogError>) -> Result<T, FlightError> {
        result.map_err(|problem| {
            self.refused = Some(problem.to_string());
            FlightError(problem.to_string())
        })
    }

    /// The log has its name.
    fn finish(&mut self) -> Result<(), String> {
        if let (Some(writer), Some(path)) = (self.writer.take(), self.out) {
            writer.finish().map_err(|e| e.to_string())?;
            talk(&format!("wrote {}", path.display()));
        }
        Ok(())
    }
}

impl Recipient for Recorded<'_> {
    fn begin(&mut self, metadata: &BTreeMap<String, String>) -> Result<(), FlightError> {
        if let Some(shown) = &mut self.shown {
            shown.begin(metadata);
        }
        let Some(path) = self.out else { return Ok(()) };
        let mut metadata = metadata.clone();
        metadata.extend([commit()]);
        let writer = LogWriter::at(path, &metadata);
        self.writer = Some(self.written(writer)?);
        Ok(())
    }

    fn take(&mut self, piece: FlightLog, now_s: f64) -> Result<(), FlightError> {
        if let Some(shown) = &mut self.shown {
            shown.push(&piece);
        }
        let Some(writer) = &mut self.writer else { return Ok(()) };
        let pushed = writer.push(piece, now_s);
        self.written(pushed)
    }
}

/// How far from the start of a scenario a plan may begin, m.
const START_M: f64 = 1.0;

/// Who commands from outside of the flight code, if anybody.
fn offboard_of(
    setup: &Setup,
    stack: &Stack,
    policy: Option<PolicyWeights>,
    track: Option<Track>,
) -> Result<Option<Box<dyn Offboard + Send>>, FlightError> {
    if let Some(track) = track {
        let mut follower = Follower::new(setup)?;
        follower.follow(track, 0);
        return Ok(Some(Box::new(follower)));
    }
    offboard(setup, stack, policy)
}

/// Writes the report.
fn report(
    setup: &Setup,
    who: &str,
    shown: &Shown,
    cells: Vec<(String, String)>,
    path: &Path,
) -> Result<(), String> {
    let mut facts = facts(setup);
    if shown.every() > 1 {
        let of = format!("every {}th sample, the flight is long", shown.every());
        facts.push(("shown".to_owned(), of));
    }
    let heading = Heading {
        title: format!("{}: {who}", setup.scenario.name),
        lead: String::new(),
        facts,
        card: setup.scenario.pilot_card().map_err(|e| e.to_string())?.unwrap_or_default(),
    };
    let log = shown.log();
    let scene = super::view::scene_of(&[(setup, log)])?;
    let html = render_with_scene(&heading, &[view(setup, log, cells)], &scene);
    output::write_file(path, html.as_bytes())?;
    talk(&format!("wrote {}", path.display()));
    Ok(())
}

impl Fly {
    /// The plan of `--reference`.
    fn track(&self, vehicle: &VehicleFile, scenario: &Scenario) -> Result<Option<Track>, String> {
        let Some(path) = &self.reference else { return Ok(None) };
        let log = FlightLog::read(path).map_err(|e| e.to_string())?;
        let mass_kg = vehicle.vehicle.parameters().mass_kg;
        let track =
            Track::of(&log, mass_kg).map_err(|problem| format!("{}: {problem}", path.display()))?;
        if matches!(scenario.mission, MissionTable::Excite(_) | MissionTable::Runs(_)) {
            return Err(format!(
                "scenario = {}: has manoeuvres of its own, nothing else is followed",
                scenario.name
            ));
        }
        if self.arm.as_deref().is_some_and(|arm| Arm::parse(arm).is_ok_and(Arm::plans)) {
            return Err("--arm: plans by itself, and follows no --reference".to_owned());
        }
        let start = Vector3::new(0.0, 0.0, -scenario.height_m);
        let apart_m = track.points().first().map_or(0.0, |point| (point.position - start).norm());
        if apart_m > START_M {
            return Err(format!(
                "{}: begins {apart_m:.1} m from where scenario {} does; must be within {START_M} m",
                path.display(),
                scenario.name
            ));
        }
        if let Some(name) = log.metadata.get("vehicle").filter(|name| **name != vehicle.name) {
            talk(&format!(
                "{}: was made for {name}, and {} flies it",
                path.display(),
                vehicle.name
            ));
        }
        Ok(Some(track))
    }

    /// What is read and what is written.
    fn paths(&self) -> Paths {
        Paths::default()
            .vehicle("--vehicle", &self.vehicle)
            .scenario(&self.scenario)
            .reads("--policy", &self.policy)
            .reads("--reference", &self.reference)
            .reads("--hil-image", self.hil.map(|_| &self.hil_image))
            .writes("--out", &self.out)
            .writes("--report", &self.report)
            .writes("--json", &self.json)
    }

    /// A problem that its vehicle has, by the file that it is from.
    fn of_vehicle(&self, problem: &FlightError) -> String {
        match &self.vehicle {
            Some(file) => format!("{}: {problem}", file.display()),
            None => problem.to_string(),
        }
    }

    pub(crate) fn run(&self) -> Result<(), String> {
        self.paths().check()?;
        let mut scenario = Scenario::find(&self.scenario)?;
        if let Some(seed) = self.seed {
            scenario.seed = seed;
        }
        if let Some(name) = &self.conditions {
            scenario.conditions = Conditions::parse(name)?;
        }
        if self.thrust_to_weight.is_some() {
            scenario.thrust_to_weight = self.thrust_to_weight;
        }
        let offboard = self.policy.is_some() || self.reference.is_some();
        let by_default = if offboard { Arm::Pc } else { Arm::TwccFlat };
        // What the options changed is the scenario's, and so are errors in it; the rest is the
        // vehicle's.
        scenario.check().map_err(|e| format!("scenario {}: {e}", self.scenario))?;
        let mut vehicle = vehicle(self.vehicle.as_deref())?;
        if let Some(name) = &self.estimator {
            vehicle.estimator = Estimator::parse(name)?;
        }
        let track = self.track(&vehicle, &scenario)?;
        if let Some(track) = &track {
            scenario.duration_s = scenario.duration_s.min(track.end_s());
            scenario.measured_window_s = 0.0;
        }
        let setup = Setup {
            vehicle,
            arm: self.arm.as_deref().map_or(Ok(by_default), Arm::parse)?,
            scenario,
            integrator: Integrator::parse(&self.integrator)?,
        };
        let stack = setup.stack().map_err(|e| self.of_vehicle(&e))?;
        let weights = self
            .policy
            .as_deref()
            .map(PolicyWeights::load)
            .transpose()
            .map_err(|e| e.to_string())?;
        // What flies, in words.
        let who = match (&weights, &self.reference) {
            (Some(weights), _) => format!("policy {} over {}", weights.name, setup.arm.name()),
            (None, Some(file)) => {
                format!("the plan of {} over {}", file.display(), setup.arm.name())
            }
            (None, None) => setup.arm.name().to_owned(),
        };
        let policy = weights.as_ref().map(PolicyWeights::hash);
        let mut pilot = offboard_of(&setup, &stack, weights, track).map_err(|e| e.to_string())?;
        let mut recorded = Recorded {
            out: self.out.as_deref(),
            writer: None,
            shown: self.report.is_some().then(Shown::default),
            refused: None,
        };
        let bar = output::progress((setup.scenario.duration_s * 10.0) as u64, "x 0.1 s");
        let progress = |t: f64| bar.set_position((t * 10.0) as u64);
        let pilot = pilot.as_mut().map(|pilot| &mut **pilot as &mut dyn Offboard);
        let recording = if self.out.is_some() || self.report.is_some() {
            Recording::Given(&mut recorded)
        } else {
            Recording::None
        };
        let flown = match self.hil {
            None => setup.fly_recorded(&mut InProcess::new(stack), pilot, recording, progress),
            Some(Hil::Qemu) => setup.fly_recorded(
                &mut EmulatedM7::start(&self.hil_image, &stack)?,
                pilot,
                recording,
                progress,
            ),
        };
        bar.finish_and_clear();
        let flight = match flown {
            Ok(flight) => flight,
            // What is wrong with the log is not the vehicle's.
            Err(e) => return Err(recorded.refused.take().unwrap_or_else(|| self.of_vehicle(&e))),
        };
        let ratio = setup.thrust_to_weight();
        say(&format!(
            "{} flies {} with {who}, seed {}, effective thrust-to-weight {ratio:.2}\n",
            setup.vehicle.name, setup.scenario.name, setup.scenario.seed,
        ));
        let cells = figures(&flight.metrics);
        let mut table = Table::new(&cells.iter().map(|(n, _)| n.as_str()).collect::<Vec<_>>());
        table.row(cells.iter().map(|(_, v)| v.clone()).collect());
        table.print();
        if setup.scenario.measured_window_s > 0.0 && flight.metrics.encounters == 0 {
            let duration_s = setup.scenario.duration_s;
            talk(&format!(
                "no encounter in duration_s = {duration_s}: the figures are of the whole flight"
            ));
        }
        let is_inside = flight.metrics.clearance_m.is_some_and(|clearance| clearance < 0.0);
        if is_inside && !setup.scenario.solid_obstacles {
            talk(
                "clearance is below 0: it flew through an obstacle, which in this scenario is only seen, not solid",
            );
        }
        recorded.finish()?;
        if let (Some(shown), Some(path)) = (&recorded.shown, &self.report) {
            report(&setup, &who, shown, cells, path)?;
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
