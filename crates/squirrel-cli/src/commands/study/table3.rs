//! `squirrel study table3`: the paper's real flights.

use super::sheet::{Cell, Sheet, TRACKING, tracking};
use super::{Flown, write_page};
use crate::output::{self, say};
use squirrel_study::pages;
use squirrel_study::table3;

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
        let (plan, command) = self.flown.plan("table3", self.trials, &[])?;
        let common = &self.flown.common;
        let keep = common.keep(&command);
        let bar = output::progress(table3::flights(&plan, &keep).map_err(|e| e.to_string())?, "flights");
        let study = table3::run(&plan, &keep, || bar.inc(1));
        let Some(study) = common.ended(&bar, study)? else { return Ok(()) };

        say(&format!(
            "The paper's real flights, {} trials an arm on paired seeds from {}; measured by satellite fix and barometer.",
            study.trials, study.seed
        ));
        say("Gain is mean error of pc over mean error of the arm, minus 1, with its paired 95 % interval.\n");
        let own = [
            ("T/W", "thrust_to_weight"),
            ("measured gain %", "gain_measured"),
            ("95 % interval", "gain_measured_low,gain_measured_high"),
        ];
        let mut sheet = Sheet::new(&[&own[..1], &TRACKING[..1], &own[1..], &TRACKING[1..]].concat());
        for point in &study.points {
            for row in &point.rows {
                let [arm, rest @ ..] = tracking(row);
                let mut cells = vec![
                    Cell::Number(point.thrust_to_weight, 2),
                    arm,
                    Cell::Percent(row.gain_measured.value, 1),
                    Cell::PercentInterval(Some(row.gain_measured), 1),
                ];
                cells.extend(rest);
                sheet.row(&cells);
            }
        }
        let csv = sheet.print();
        let Some(folder) = common.end("table3", &csv, &study)? else { return Ok(()) };
        let page = pages::table3(&study, &plan).map_err(|e| e.to_string())?;
        write_page(folder, "table3", &page)
    }
}
