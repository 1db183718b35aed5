//! `squirrel study filters`: estimators of attitude on the same flights.

use super::Common;
use crate::output::{self, Table, say};
use squirrel_study::filters::{self, Plan};
use squirrel_study::in_loop::Row;
use std::fmt::Write as _;

/// What is written beside the files that every study has.
const FLIGHTS: &str = "flights";
const IN_LOOP: &str = "filters_in_loop.csv";
const IN_LOOP_TRIALS: &str = "filters_in_loop.trials.jsonl";

/// Options of the study.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Flights.
    #[arg(long, default_value_t = 20)]
    trials: u32,
    #[command(flatten)]
    pub(super) common: Common,
}

impl Options {
    pub(super) fn run(&self) -> Result<(), String> {
        let (trials, seed) = (self.trials, self.common.seed);
        let flown = (0..trials).map(|trial| format!("{FLIGHTS}/{}.toml", filters::name(trial)));
        let others = flown.chain([IN_LOOP, IN_LOOP_TRIALS].map(str::to_owned));
        let plan = Plan { vehicle: self.common.begin("filters", trials, others)?, trials, seed };
        let command = self.common.command("filters", &[("trials", trials.to_string())]);
        let keep = self.common.keep(&command);
        let bar = output::progress(filters::steps(&plan, &keep), "flights");
        let study = filters::run(&plan, &keep, || bar.inc(1));
        let Some(study) = self.common.ended(&bar, study)? else { return Ok(()) };

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
        say(
            "\nThe avoidance manoeuvre on estimates over the same flight on the truth; distance to the reference, m.\n",
        );
        let mut table = Table::new(&[
            "sensors",
            "flights",
            "RMSE",
            "on the truth",
            "ratio",
            "95 % interval",
            "lost",
            "flagged",
        ]);
        let mut in_loop =
            String::from("suite,flights,rmse_m,oracle_rmse_m,ratio,ratio_low,ratio_high,lost,flagged\n");
        for row in &study.in_loop {
            let Row { suite, flights, rmse_m, oracle_rmse_m, ratio: r, lost, flagged } = row;
            table.row(vec![
                (*suite).to_owned(),
                flights.to_string(),
                format!("{rmse_m:.2}"),
                format!("{oracle_rmse_m:.2}"),
                format!("{:.3}", r.value),
                format!("{:.3} to {:.3}", r.low, r.high),
                lost.to_string(),
                flagged.to_string(),
            ]);
            let _ = writeln!(
                in_loop,
                "{suite},{flights},{rmse_m},{oracle_rmse_m},{},{},{},{lost},{flagged}",
                r.value, r.low, r.high
            );
        }
        table.print();
        let Some(folder) = self.common.end("filters", &csv, &study)? else { return Ok(()) };
        output::write_file(&folder.join(IN_LOOP), in_loop.as_bytes())?;
        let flights = folder.join(FLIGHTS);
        output::folder(&flights)?;
        for scenario in filters::scenarios(&plan).map_err(|e| e.to_string())? {
            let file = flights.join(format!("{}.toml", scenario.name));
            output::write_file(&file, scenario.to_toml().as_bytes())?;
        }
        Ok(())
    }
}
