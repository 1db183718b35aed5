//! `squirrel demo`: the paper's avoidance manoeuvre in front of a solid trunk, with the paper's
//! controllers and ours, on numbers that are part of the program.

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

/// The paper's two, then ours; of each pair the first keeps its wings folded.
const ARMS: [Arm; 4] = [Arm::Pc, Arm::TwccFlat, Arm::PcPlus, Arm::TwccPlus];
const REPORT: &str = "report.html";
const SPEED_M_S: f64 = 7.3;
/// Where the trunk is seen. The paper's flights saw theirs, which was not there, at 4 m: nothing
/// that is as fast stops within that, with or without wings.
const SEEN_M: f64 = 6.0;

/// Figures that the table leaves to the page, so that a terminal has room for a row.
const LEFT_OUT: [&str; 2] = ["RMSE horiz. m", "height gained m"];

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
    /// Flies; `program` is how the user called the program, for the commands to go on with.
    pub(crate) fn run(&self, program: &str) -> Result<(), String> {
        let names = ARMS.map(flight_file).into_iter().chain([REPORT.to_owned()]);
        Paths::default().writes_into(&self.out, names).writes("--json", &self.json).check()?;
        output::folder(&self.out)?;
        let setups = ARMS.map(|arm| Setup {
            vehicle: VehicleFile::squirrel(),
            arm,
            scenario: scenario(self.seed),
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
            "A quadrotor with foldable wings flies at {SPEED_M_S} m/s, sees a trunk {SEEN_M} m ahead and turns away\n\
             by 110 to 130 deg. Its rotors lift {ratio:.2} times its weight; seed {}.\n\
             Clearance is from its centre to the bark.\n",
            self.seed
        ));
        let row = |(setup, flight): (&Setup, &Flight)| Row {
            arm: setup.arm.name(),
            metrics: flight.metrics,
        };
        let rows: Vec<Row> = setups.iter().zip(&flights).map(row).collect();
        let mut views = Vec::new();
        let mut table: Option<Table> = None;
        for (setup, flight) in setups.iter().zip(&mut flights) {
            let cells = figures(&flight.metrics);
            // The page has all of them.
            let shown = || cells.iter().filter(|(name, _)| !LEFT_OUT.contains(&name.as_str()));
            let table = table.get_or_insert_with(|| {
                let names: Vec<&str> =
                    std::iter::once("arm").chain(shown().map(|(n, _)| n.as_str())).collect();
                Table::new(&names)
            });
            let name = std::iter::once(setup.arm.name().to_owned());
            table.row(name.chain(shown().map(|(_, v)| v.clone())).collect());
            if let Some(log) = &mut flight.log {
                let path = self.out.join(flight_file(setup.arm));
                write_log(log, &path)?;
                views.push(view(setup, log, cells));
            }
        }
        if let Some(table) = table {
            table.print();
        }
        say(&format!("\n{}", seen(&rows)));
        let heading = Heading {
            title: "A trunk at 7.3 m/s: the paper's controllers and ours".to_owned(),
            lead: format!(
                "A quadrotor with foldable wings flies straight at {SPEED_M_S} m/s, sees a trunk {SEEN_M} m ahead and turns away. {}",
                seen(&rows).replace("\n  ", " ")
            ),
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
            "\nThe report is {}, beside it a log of each flight (MCAP). Next:",
            report.display()
        ));
        for next in self.next() {
            talk(&format!("  {program} {next}"));
        }
        Ok(())
    }

    /// What to do next, each a command that runs as it stands.
    fn next(&self) -> [String; 3] {
        let [without, with] = [Arm::Pc, Arm::TwccPlus]
            .map(|arm| quoted(&self.out.join(flight_file(arm)).to_string_lossy()));
        [
            format!("view {without} {with} --out view.html"),
            "fly --arm twcc_plus --scenario forest --out forest.mcap --report forest.html"
                .to_owned(),
            "vehicle new --frame quad-x --mass-kg 0.75 --propeller-inch 5 --out mine.toml"
                .to_owned(),
        ]
    }
}

/// The paper's manoeuvre, but the trunk is solid and is seen in time to do something about it.
fn scenario(seed: u64) -> Scenario {
    Scenario {
        seed,
        thrust_to_weight: Some(1.25),
        solid_obstacles: true,
        ..Scenario::turn("demo", SPEED_M_S, SEEN_M, 110.0, 130.0)
    }
}

/// What to see in two sentences, each on two lines: the paper's pair and ours.
fn seen(rows: &[Row]) -> String {
    let fate = |row: &Row| match (row.metrics.contact_s, row.metrics.clearance_m) {
        (Some(time), _) => format!("{} hits the trunk after {time:.1} s", row.arm),
        (None, Some(clearance)) => format!("{} passes it by {clearance:.2} m", row.arm),
        (None, None) => format!("{} does not come near it", row.arm),
    };
    let pair =
        |rows: &[Row]| rows.iter().map(fate).collect::<Vec<_>>().join(" with folded wings,\n  ");
    let (theirs, ours) = rows.split_at(rows.len() / 2);
    format!(
        "The paper's controllers: {} with open ones.\nOurs: {} with open ones.",
        pair(theirs),
        pair(ours)
    )
}

/// A word of a command line, for a shell.
pub(crate) fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+:\\".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

/// The log of one controller.
fn flight_file(arm: Arm) -> String {
    format!("flight-{}.mcap", arm.name())
}

#[cfg(test)]
mod tests {
    use super::quoted;

    #[test]
    fn words_of_a_shell_stay_words() {
        assert_eq!(quoted("target/release/squirrel"), "target/release/squirrel");
        assert_eq!(quoted("my drone's"), "'my drone'\\''s'");
        assert_eq!(quoted(""), "''");
    }
}
