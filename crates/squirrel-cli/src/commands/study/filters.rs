//! `squirrel study filters`: estimators of attitude on the same flights.

use super::Common;
use crate::output::{self, Table, say};
use squirrel_study::filters::{self, Plan};
use std::fmt::Write as _;

/// Options of the study.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Flights.
    #[arg(long, default_value_t = 20)]
    trials: u32,
    #[command(flatten)]
    common: Common,
}

impl Options {
    pub(super) fn run(&self) -> Result<(), String> {
        let (trials, seed) = (self.trials, self.common.seed);
        let plan = Plan { vehicle: self.common.begin("filters")?, trials, seed };
        let bar = output::progress(u64::from(plan.trials), "flights");
        let study = filters::run(&plan, || bar.inc(1));
        bar.finish_and_clear();
        let study = study.map_err(|e| e.to_string())?;

        say(&format!(
            "Random runs of {} with spread wings in gusts, {} flights from seed {}; inclination, deg.\n",
            study.vehicle, study.trials, study.seed
        ));
        let mut table = Table::new(&["filter", "gyro", "RMS", "95 % interval", "largest"]);
        let mut csv = String::from("filter,calibrated,rms_deg,rms_low_deg,rms_high_deg,max_deg\n");
        for row in &study.rows {
            let rms = row.inclination_rms_deg;
            let [b, c, d] = study.bias_deg_s;
            let gyro =
                if row.calibrated { "calibrated".to_owned() } else { format!("off by {b}, {c}, {d} deg/s") };
            table.row(vec![
                row.filter.to_owned(),
                gyro,
                format!("{:.2}", rms.value),
                format!("{:.2} to {:.2}", rms.low, rms.high),
                format!("{:.1}", row.inclination_max_deg),
            ]);
            let _ = writeln!(
                csv,
                "{},{},{},{},{},{}",
                row.filter, row.calibrated, rms.value, rms.low, rms.high, row.inclination_max_deg
            );
        }
        table.print();
        let Some(folder) = self.common.end("filters", &csv, &study)? else { return Ok(()) };
        let flights = folder.join("flights");
        output::folder(&flights)?;
        for scenario in filters::scenarios(&plan).map_err(|e| e.to_string())? {
            let file = flights.join(format!("{}.toml", scenario.name));
            output::write_file(&file, scenario.to_toml().as_bytes())?;
        }
        Ok(())
    }
}
