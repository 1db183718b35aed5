//! `squirrel study faults`: flights in which one thing fails.

use super::Common;
use crate::output::{self, Table, say};
use squirrel_study::faults::{self, Plan, Row};
use std::fmt::Write as _;

/// Options of the study.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Flights, each with one random fault.
    #[arg(long, default_value_t = 1000)]
    trials: u32,
    #[command(flatten)]
    pub(super) common: Common,
}

impl Options {
    pub(super) fn run(&self) -> Result<(), String> {
        let (trials, seed) = (self.trials, self.common.seed);
        let plan = Plan { vehicle: self.common.begin("faults", trials, [])?, trials, seed };
        let command = self.common.command("faults", &[("trials", trials.to_string())]);
        let keep = self.common.keep(&command);
        let bar = output::progress(keep.share(u64::from(trials)), "flights");
        let study = faults::run(&plan, &keep, || bar.inc(1));
        let Some(study) = self.common.ended(&bar, study)? else { return Ok(()) };

        say(&format!(
            "{} single faults in flights of {} from seed {}.\n",
            study.trials, study.vehicle, study.seed
        ));
        let names =
            ["fault", "flights", "survivable", "survived", "flagged", "lost", "lost unflagged", "not finite"];
        let mut table = Table::new(&names);
        let mut csv = names.join(",").replace(' ', "_") + "\n";
        for row in &study.rows {
            let Row { fault, flights, survivable, survived, flagged, lost, lost_unflagged, not_finite } = row;
            let numbers = [flights, survivable, survived, flagged, lost, lost_unflagged, not_finite];
            let mut cells = vec![(*fault).to_owned()];
            cells.extend(numbers.iter().map(ToString::to_string));
            let _ = writeln!(csv, "{}", cells.join(","));
            table.row(cells);
        }
        table.print();
        say(&format!("\nSurvived {:.1} % of the survivable faults.", 100.0 * study.survived_share));
        self.common.end("faults", &csv, &study).map(|_| ())
    }
}
