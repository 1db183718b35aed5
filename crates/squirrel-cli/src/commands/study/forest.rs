//! `squirrel study forest`: the paper's forest.

use super::sheet::{Cell, Sheet};
use super::{Flown, write_page};
use crate::output::{self, say};
use squirrel_study::forest::{self, BAND_M, Row};
use squirrel_study::pages;

/// Options of the study.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Flights per arm, on paired seeds.
    #[arg(long, default_value_t = 105)]
    trials: u32,
    /// Effective thrust-to-weight ratio.
    #[arg(long, default_value_t = 2.0)]
    thrust_to_weight: f64,
    #[command(flatten)]
    pub(super) flown: Flown,
}

impl Options {
    pub(super) fn run(&self) -> Result<(), String> {
        let ratio = self.thrust_to_weight;
        let own = [("thrust-to-weight", ratio.to_string())];
        let (plan, command) = self.flown.plan("forest", self.trials, &own)?;
        let common = &self.flown.common;
        let keep = common.keep(&command);
        let flights = forest::flights(&plan, &keep).map_err(|e| e.to_string())?;
        let bar = output::progress(flights, "flights");
        let study = forest::run(&plan, ratio, &keep, || bar.inc(1));
        let Some(study) = common.ended(&bar, study)? else { return Ok(()) };

        say(&format!(
            "The paper's forest: {} flights of {} an arm on paired seeds from {}, thrust-to-weight {ratio:.2}.",
            study.trials, study.vehicle, study.seed
        ));
        say(&format!(
            "Through: 400 m without contact; in band: and never {BAND_M} m above or below. Wilson's 95 % intervals, in %."
        ));
        say(
            "Over phantom: in band, less that of the controller without wings on the same trials, in points.\n",
        );
        let mut csv = sheet(&study.rows, "as it is").print();
        say("\nThe same, with the limit of speed that ours has for the paper's laws too.\n");
        let limited = sheet(&study.limited, "limited").print();
        csv.extend(limited.split_inclusive('\n').skip(1));
        say("");
        for word in forest::words(&study) {
            say(&word);
        }
        let Some(folder) = common.end("forest", &csv, &study)? else { return Ok(()) };
        let page = pages::forest(&study, &plan).map_err(|e| e.to_string())?;
        write_page(folder, "forest", &page)
    }
}

fn sheet(rows: &[Row], speed: &str) -> Sheet {
    let mut sheet = Sheet::new(&[
        ("arm", "arm"),
        ("speed", "speed"),
        ("through", "through"),
        ("95 %", "through_low,through_high"),
        ("in band", "in_band"),
        ("95 %", "in_band_low,in_band_high"),
        ("over phantom", "over_phantom_low,over_phantom_high"),
        ("over pc_plus", "over_pc_plus_low,over_pc_plus_high"),
        ("path m", "path_m"),
        ("from start m", "displacement_m"),
        ("climb m", "height_gained_m"),
        ("sink m", "height_lost_m"),
        ("met", "encounters"),
        ("wings s", "wings_open_s"),
    ]);
    for row in rows {
        sheet.row(&[
            Cell::Text(row.arm),
            Cell::Text(speed),
            Cell::Number(f64::from(row.through.count), 0),
            Cell::PercentInterval(Some(row.through.share), 0),
            Cell::Number(f64::from(row.in_band.count), 0),
            Cell::PercentInterval(Some(row.in_band.share), 0),
            Cell::PercentInterval(row.over_phantom, 0),
            Cell::PercentInterval(row.over_pc_plus, 0),
            Cell::Number(row.path_m, 0),
            Cell::Number(row.displacement_m, 0),
            Cell::Number(row.height_gained_m, 1),
            Cell::Number(row.height_lost_m, 1),
            Cell::Number(row.encounters, 1),
            Cell::Number(row.wings_open_s, 1),
        ]);
    }
    sheet
}
