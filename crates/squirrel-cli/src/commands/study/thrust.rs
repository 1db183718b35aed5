//! `squirrel study thrust`: what wings are worth as a function of thrust.

use super::sheet::{Cell, Sheet, TRACKING, tracking};
use super::{Flown, write_page};
use crate::output::{self, say};
use squirrel_study::pages;
use squirrel_study::thrust::{self, Thrust};

/// Options of the study.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Flights per arm and condition, on paired seeds.
    #[arg(long, default_value_t = 12)]
    trials: u32,
    #[command(flatten)]
    pub(super) flown: Flown,
}

impl Options {
    pub(super) fn run(&self) -> Result<(), String> {
        let (plan, command) = self.flown.plan("thrust", self.trials, &[])?;
        let common = &self.flown.common;
        let keep = common.keep(&command);
        let bar = output::progress(thrust::flights(&plan, &keep).map_err(|e| e.to_string())?, "flights");
        let study = thrust::run(&plan, &keep, || bar.inc(1));
        let Some(study) = common.ended(&bar, study)? else { return Ok(()) };

        say(&format!(
            "Avoidance manoeuvre, {} trials an arm on paired seeds from {}.",
            study.trials, study.seed
        ));
        say(
            "Gain is mean error of pc over mean error of the arm, minus 1, with its paired 95 % interval; over phantom and over",
        );
        say("pc_plus likewise. T/W is what there was: the limit, less what the battery did not give.\n");
        let csv = sheet(&study).print();
        say("");
        for word in thrust::words(&study) {
            say(&word);
        }
        let Some(folder) = common.end("thrust", &csv, &study)? else { return Ok(()) };
        write_page(folder, "thrust", &pages::thrust(&study))
    }
}

fn sheet(study: &Thrust) -> Sheet {
    let own = [("series", "series"), ("T/W", "thrust_to_weight"), ("charge", "charge")];
    let mut sheet = Sheet::new(&[&own[..], &TRACKING].concat());
    for point in &study.points {
        let charge = point.charge.map_or_else(|| "-".to_owned(), |charge| format!("{charge:.2}"));
        for row in &point.rows {
            let mut cells =
                vec![Cell::Text(point.series), Cell::Number(point.thrust_to_weight, 2), Cell::Text(&charge)];
            cells.extend(tracking(row));
            sheet.row(&cells);
        }
    }
    sheet
}
