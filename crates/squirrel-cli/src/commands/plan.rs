//! `squirrel plan`: a trajectory through a scenario, with wings and without.

use super::{vehicle, write_log};
use crate::output::{self, Table, say, talk};
use crate::paths::Paths;
use serde::Serialize;
use squirrel_log::FlightLog;
use squirrel_plan::pilot::{SPARE_M, half_width_m};
use squirrel_plan::trajectory::{self, Air, Craft, Plan, Planner, RESERVE, Shown, Task};
use squirrel_plan::wing::WingModel;
use squirrel_report::flight::FlightView;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{Integrator, Setup};
use squirrel_sim::scenario::Scenario;
use std::path::PathBuf;

/// Options of a plan.
#[derive(Debug, clap::Args)]
pub(crate) struct PlanCommand {
    /// Vehicle file, or the name of a bundled vehicle; squirrel if left out.
    #[arg(long)]
    vehicle: Option<PathBuf>,
    /// hover, avoid, steer, track, forest, or a scenario file (.toml).
    #[arg(long, default_value = "avoid")]
    scenario: String,
    /// Seed of everything random; overrides the scenario's.
    #[arg(long)]
    seed: Option<u64>,
    /// Largest collective thrust over weight; overrides vehicle and scenario.
    #[arg(long)]
    thrust_to_weight: Option<f64>,
    /// What is believed of the wings: flat, membrane, parnn, or none to plan without; if left out,
    /// flat where there are wings.
    #[arg(long)]
    wing: Option<String>,
    /// How much of the scenario, s; at most its duration.
    #[arg(long, default_value_t = 10.0)]
    horizon_s: f64,
    /// From node to node, s.
    #[arg(long, default_value_t = 0.1)]
    step_s: f64,
    /// Plan to write, for `squirrel fly --reference` (.mcap).
    #[arg(long)]
    out: Option<PathBuf>,
    /// HTML report to write.
    #[arg(long)]
    report: Option<PathBuf>,
    /// Write the plans here as JSON.
    #[arg(long)]
    json: Option<PathBuf>,
}

/// What was believed of the wings, the task, and the plan.
type Made = (Option<WingModel>, Task, Plan);

#[derive(Serialize)]
struct Planned {
    vehicle: String,
    scenario: String,
    seed: u64,
    thrust_to_weight: f64,
    /// The scenario's steady wind, which is planned for.
    wind_ned_m_s: [f64; 3],
    step_s: f64,
    /// With wings, if they were asked for, and without.
    plans: Vec<Outcome>,
}

#[derive(Serialize)]
struct Outcome {
    wing: &'static str,
    status: &'static str,
    cost: f64,
    violation_m: f64,
    overspeed_m_s: f64,
    iterations: u32,
    rmse_m: f64,
    height_lost_m: f64,
    height_gained_m: f64,
    wings_open_s: f64,
    time_s: Vec<f64>,
    position_ned_m: Vec<[f64; 3]>,
    velocity_ned_m_s: Vec<[f64; 3]>,
    thrust_ned_n: Vec<[f64; 3]>,
    deployment: Vec<f64>,
}

impl Outcome {
    fn of(wing: Option<WingModel>, task: &Task, plan: &Plan) -> Self {
        let points = plan.track.points();
        let off = || {
            points.iter().zip(task.wanted()).map(|(point, wanted)| point.position - wanted.position)
        };
        let open = points.iter().filter(|point| point.wing > 0.5).count();
        Self {
            wing: wing.map_or("none", WingModel::name),
            status: plan.status.name(),
            cost: plan.cost,
            violation_m: plan.violation_m,
            overspeed_m_s: plan.overspeed_m_s,
            iterations: plan.iterations,
            rmse_m: (off().map(|e| e.norm_squared()).sum::<f64>() / points.len() as f64).sqrt(),
            height_lost_m: off().map(|e| e.z).fold(0.0, f64::max),
            height_gained_m: off().map(|e| -e.z).fold(0.0, f64::max),
            wings_open_s: open as f64 * task.step_s(),
            time_s: plan.track.time_s().to_vec(),
            position_ned_m: points.iter().map(|point| point.position.into()).collect(),
            velocity_ned_m_s: points.iter().map(|point| point.velocity.into()).collect(),
            thrust_ned_n: points.iter().map(|point| point.thrust.into()).collect(),
            deployment: points.iter().map(|point| point.wing).collect(),
        }
    }
}

impl PlanCommand {
    pub(crate) fn run(&self) -> Result<(), String> {
        Paths::default()
            .vehicle("--vehicle", &self.vehicle)
            .scenario(&self.scenario)
            .writes("--out", &self.out)
            .writes("--report", &self.report)
            .writes("--json", &self.json)
            .check()?;
        let mut scenario = Scenario::find(&self.scenario)?;
        scenario.seed = self.seed.unwrap_or(scenario.seed);
        scenario.thrust_to_weight = self.thrust_to_weight.or(scenario.thrust_to_weight);
        scenario.check().map_err(|e| format!("scenario {}: {e}", self.scenario))?;
        let vehicle = vehicle(self.vehicle.as_deref())?;
        let wing = match self.wing.as_deref() {
            Some("none") => None,
            Some(name) => Some(WingModel::parse(name).map_err(|e| format!("{e}, none"))?),
            None => vehicle.vehicle.parameters().wing.map(|_| WingModel::Flat),
        };
        let setup = Setup { vehicle, arm: Arm::Pc, scenario, integrator: Integrator::Rk4 };
        let thrust_max_n = setup.thrust_to_weight() * setup.vehicle.vehicle.weight_n();
        let spare_m = half_width_m(&setup) + SPARE_M;
        let mut plans: Vec<Made> = Vec::new();
        let models = if wing.is_some() { vec![wing, None] } else { vec![None] };
        let bar = output::spinner();
        for model in models {
            bar.set_message(format!(
                "planning with wings: {}",
                model.map_or("none", WingModel::name)
            ));
            let mut craft = Craft::of(&setup.vehicle, thrust_max_n, model, RESERVE)?;
            craft.air = Air::windy(setup.scenario.wind.mean_ned_m_s.into())?;
            let task = Task::of(&setup.scenario, &craft, spare_m, self.horizon_s, self.step_s)?;
            let plan = Planner::default().plan(&craft, &task, None);
            plans.push((model, task, plan));
        }
        bar.finish_and_clear();
        show(&setup, &plans);
        if let (Some(path), Some((model, task, plan))) = (&self.out, plans.first()) {
            let mut log = log(&setup, *model, task, plan);
            write_log(&mut log, path)?;
            talk(&format!("wrote {}", path.display()));
        }
        if let Some(path) = &self.report {
            output::write_file(path, page(&setup, &plans).as_bytes())?;
            talk(&format!("wrote {}", path.display()));
        }
        let result = Planned {
            vehicle: setup.vehicle.name.clone(),
            scenario: setup.scenario.name.clone(),
            seed: setup.scenario.seed,
            thrust_to_weight: setup.thrust_to_weight(),
            wind_ned_m_s: setup.scenario.wind.mean_ned_m_s,
            step_s: self.step_s,
            plans: plans
                .iter()
                .map(|(model, task, plan)| Outcome::of(*model, task, plan))
                .collect(),
        };
        output::write_json(self.json.as_deref(), &result)
    }
}

fn show(setup: &Setup, plans: &[Made]) {
    let ratio = setup.thrust_to_weight();
    let [north, east, down] = setup.scenario.wind.mean_ned_m_s;
    let is_calm = [north, east, down] == [0.0; 3];
    let wind = if is_calm { String::new() } else { format!(", wind to {north} {east} {down} m/s") };
    say(&format!(
        "{} through {}, seed {}, thrust-to-weight {ratio:.2}{wind}, {:.1} s of it\n",
        setup.vehicle.name,
        setup.scenario.name,
        setup.scenario.seed,
        plans.first().map_or(0.0, |(_, _, plan)| plan.track.end_s()),
    ));
    let mut table = Table::new(&[
        "wings",
        "status",
        "cost",
        "RMSE m",
        "height lost m",
        "gained m",
        "wings open s",
        "too near m",
        "problems",
    ]);
    for (model, task, plan) in plans {
        let o = Outcome::of(*model, task, plan);
        table.row(vec![
            o.wing.to_owned(),
            o.status.to_owned(),
            format!("{:.2}", o.cost),
            format!("{:.2}", o.rmse_m),
            format!("{:.2}", o.height_lost_m),
            format!("{:.2}", o.height_gained_m),
            format!("{:.1}", o.wings_open_s),
            format!("{:.2}", o.violation_m),
            o.iterations.to_string(),
        ]);
    }
    table.print();
}

fn page(setup: &Setup, plans: &[Made]) -> String {
    let logs: Vec<FlightLog> = plans.iter().map(|made| drawn(setup, made)).collect();
    let view = |((model, task, plan), log): (&Made, _)| {
        let o = Outcome::of(*model, task, plan);
        FlightView {
            arm: o.wing,
            log,
            obstacles: setup.scenario.all_obstacles(),
            tilt_max_rad: setup.vehicle.vehicle.parameters().limits.tilt_max_rad,
            thrust_max_n: setup.thrust_to_weight() * setup.vehicle.vehicle.weight_n(),
            summary: vec![
                ("status".to_owned(), o.status.to_owned()),
                ("cost".to_owned(), format!("{:.2}", o.cost)),
                ("RMSE m".to_owned(), format!("{:.2}", o.rmse_m)),
                ("wings open s".to_owned(), format!("{:.1}", o.wings_open_s)),
            ],
        }
    };
    let views: Vec<FlightView<'_>> = plans.iter().zip(&logs).map(view).collect();
    let shown: Vec<Shown<'_>> = plans
        .iter()
        .zip(&views)
        .map(|((_, task, plan), view)| Shown { view, task, plan })
        .collect();
    trajectory::page(&format!("{}: planned", setup.scenario.name), &super::facts(setup), &shown)
}

/// A plan as a log: what to fly, and the reference behind it.
fn log(setup: &Setup, wing: Option<WingModel>, task: &Task, plan: &Plan) -> FlightLog {
    let mut log = FlightLog::default();
    for (key, value) in [
        ("vehicle", setup.vehicle.name.clone()),
        ("vehicle_toml", setup.vehicle.text.clone()),
        ("scenario_toml", setup.scenario.to_toml()),
        ("seed", setup.scenario.seed.to_string()),
        ("wing", wing.map_or("none", WingModel::name).to_owned()),
        ("status", plan.status.name().to_owned()),
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
    ] {
        log.metadata.insert(key.to_owned(), value);
    }
    plan.track.record(&mut log);
    for (time_s, wanted) in plan.track.time_s().iter().zip(task.wanted()) {
        let rows: [(&str, &[f64]); 2] = [
            ("position_ned_m", wanted.position.as_slice()),
            ("velocity_ned_m_s", wanted.velocity.as_slice()),
        ];
        log.source_mut("reference").push(*time_s, &rows);
    }
    log
}

/// The same for the page, which draws flights: planned motion stands where a flight has the truth.
/// No such log is written, for nothing flew.
fn drawn(setup: &Setup, (model, task, plan): &Made) -> FlightLog {
    let mut log = log(setup, *model, task, plan);
    for (time_s, point) in plan.track.time_s().iter().zip(plan.track.points()) {
        let rows: [(&str, &[f64]); 2] = [
            ("position_ned_m", point.position.as_slice()),
            ("velocity_ned_m_s", point.velocity.as_slice()),
        ];
        log.source_mut("truth").push(*time_s, &rows);
    }
    log
}
