//! `squirrel study filters`: estimators of attitude on the same flights.

use crate::commands::vehicle;
use crate::output::{self, Table, say, talk};
use squirrel_study::filters::{self, Plan};
use std::fmt::Write as _;
use std::path::PathBuf;

/// Options of the study.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Flights.
    #[arg(long, default_value_t = 20)]
    trials: u32,
    /// Seed of all trials.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Vehicle file; the shipped squirrel if left out.
    #[arg(long)]
    vehicle: Option<PathBuf>,
    /// Folder for filters.csv, filters.json and the scenarios of the flights, for `squirrel fly`.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Write the figures here as JSON.
    #[arg(long)]
    json: Option<PathBuf>,
}

impl Options {
    pub(super) fn run(&self) -> Result<(), String> {
        let plan = Plan { vehicle: vehicle(self.vehicle.as_deref())?, trials: self.trials, seed: self.seed };
        if let Some(folder) = &self.out {
            output::folder(folder)?;
            output::writable(&folder.join("filters.csv"))?;
        }
        if let Some(path) = &self.json {
            output::writable(path)?;
        }
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
        if let Some(folder) = &self.out {
            output::write_file(&folder.join("filters.csv"), csv.as_bytes())?;
            output::write_json(Some(&folder.join("filters.json")), &study)?;
            let flights = folder.join("flights");
            output::folder(&flights)?;
            for scenario in filters::scenarios(&plan).map_err(|e| e.to_string())? {
                let file = flights.join(format!("{}.toml", scenario.name));
                output::write_file(&file, scenario.to_toml().as_bytes())?;
            }
            talk(&format!("wrote {}", folder.join("filters.csv").display()));
        }
        output::write_json(self.json.as_deref(), &study)
    }
}
