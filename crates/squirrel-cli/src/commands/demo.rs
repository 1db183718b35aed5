//! `squirrel demo`: the paper's avoidance manoeuvre with three controllers, on numbers that are
//! part of the program.

use super::{facts, figures, view, write_log};
use crate::output::{self, Table, say, talk};
use crate::paths::Paths;
use serde::Serialize;
use squirrel_report::flight::{Heading, render_with_scene};
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{Flight, Integrator, Metrics, Setup};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;
use std::path::PathBuf;

const ARMS: [Arm; 3] = [Arm::Pc, Arm::TwccFlat, Arm::TwccOracle];
const REPORT: &str = "report.html";

/// Options of the demo.
#[derive(Debug, clap::Args)]
pub(crate) struct Demo {
    /// Folder for logs and report.
    #[arg(long, default_value = "squirrel-demo")]
    out: PathBuf,
    /// Seed of sensors, gusts and steering angle.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Write the figures here as JSON.
    #[arg(long)]
    json: Option<PathBuf>,
}

#[derive(Serialize)]
struct Row {
    arm: &'static str,
    gain: f64,
    #[serde(flatten)]
    metrics: Metrics,
}

#[derive(Serialize)]
struct Figures {
    vehicle: String,
    thrust_to_weight: f64,
    seed: u64,
    arms: Vec<Row>,
}

impl Demo {
    pub(crate) fn run(&self) -> Result<(), String> {
        let names = ARMS.map(flight_file).into_iter().chain([REPORT.to_owned()]);
        Paths::default().writes_into(&self.out, names).writes("--json", &self.json).check()?;
        output::folder(&self.out)?;
        let mut scenario = Scenario::find("avoid")?;
        scenario.seed = self.seed;
        let setups = ARMS.map(|arm| Setup {
            vehicle: VehicleFile::squirrel(),
            arm,
            scenario: scenario.clone(),
            integrator: Integrator::Rk4,
        });
        let bar = output::progress(ARMS.len() as u64, "flights");
        let mut flights: Vec<Flight> = Vec::new();
        for setup in &setups {
            bar.set_message(setup.arm.name());
            flights.push(setup.fly(true, |_| {}).map_err(|e| e.to_string())?);
            bar.inc(1);
        }
        bar.finish_and_clear();

        let ratio = setups[0].thrust_to_weight();
        say(&format!(
            "Avoidance manoeuvre of the paper: 7.3 m/s, obstacle seen at 4 m, turn of 110 to 130 deg, error over 6 s.\n\
             Effective thrust-to-weight {ratio:.2}, seed {}. Gain is mean error of pc over mean error of the arm, minus 1.\n",
            self.seed
        ));
        let reference = flights[0].metrics.rmse_m;
        let mut rows = Vec::new();
        let mut views = Vec::new();
        let mut table: Option<Table> = None;
        for (setup, flight) in setups.iter().zip(&mut flights) {
            let gain = reference / flight.metrics.rmse_m - 1.0;
            let mut cells = figures(&flight.metrics);
            cells.insert(2, ("gain %".to_owned(), format!("{:+.1}", 100.0 * gain)));
            let table = table.get_or_insert_with(|| {
                let names: Vec<&str> =
                    std::iter::once("arm").chain(cells.iter().map(|(n, _)| n.as_str())).collect();
                Table::new(&names)
            });
            let name = std::iter::once(setup.arm.name().to_owned());
            table.row(name.chain(cells.iter().map(|(_, v)| v.clone())).collect());
            rows.push(Row { arm: setup.arm.name(), gain, metrics: flight.metrics });
            if let Some(log) = &mut flight.log {
                let path = self.out.join(flight_file(setup.arm));
                write_log(log, &path)?;
                views.push(view(setup, log, cells));
            }
        }
        if let Some(table) = table {
            table.print();
        }
        let heading = Heading {
            title: "Avoidance at high speed: three controllers".to_owned(),
            lead: "A quadrotor with foldable wings flies straight at 7.3 m/s, sees an obstacle 4 m ahead and turns away. \
                   pc keeps the wings folded; the others may open them to brake."
                .to_owned(),
            facts: facts(&setups[0]),
            card: String::new(),
        };
        let report = self.out.join(REPORT);
        let flown: Vec<_> =
            setups.iter().zip(&views).map(|(setup, view)| (setup, view.log)).collect();
        let scene = super::view::scene_of(&flown)?;
        output::write_file(&report, render_with_scene(&heading, &views, &scene).as_bytes())?;
        let result = Figures {
            vehicle: setups[0].vehicle.name.clone(),
            thrust_to_weight: ratio,
            seed: self.seed,
            arms: rows,
        };
        output::write_json(self.json.as_deref(), &result)?;
        talk(&format!(
            "\nwrote {} and flight-*.mcap (open in Foxglove) beside it",
            report.display()
        ));
        Ok(())
    }
}

/// The log of one controller.
fn flight_file(arm: Arm) -> String {
    format!("flight-{}.mcap", arm.name())
}
