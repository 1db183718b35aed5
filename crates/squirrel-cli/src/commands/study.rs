//! `squirrel study`: experiments with many flights.

mod faults;
mod filters;
mod table2;

use super::vehicle;
use crate::output::{self, Table, say, talk};
use squirrel_sim::arm::Arm;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_study::thrust::{self, Plan};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// The experiments.
#[derive(Debug, clap::Subcommand)]
pub(crate) enum Study {
    /// What becomes of flights in which one thing fails.
    Faults(faults::Options),
    /// How far estimators of attitude are off in flight, with a calibrated gyro and without.
    Filters(filters::Options),
    /// What models of the wing force predict, the paper's Table II: to labels and to truth, 30 to 300 s of training.
    Table2(table2::Options),
    /// What wings are worth as a function of the thrust-to-weight ratio.
    Thrust(Options),
}

/// What every experiment is told.
#[derive(Debug, clap::Args)]
struct Common {
    /// Seed of all trials.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Vehicle file; the shipped squirrel if left out.
    #[arg(long)]
    vehicle: Option<PathBuf>,
    /// Folder for the figures as CSV and JSON, and for what else there is to look at.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Write the figures here as JSON.
    #[arg(long)]
    json: Option<PathBuf>,
}

impl Common {
    /// The vehicle, once it is known that results can be written: nobody wants to learn that afterwards.
    ///
    /// * `name` - of the study's files
    fn begin(&self, name: &str) -> Result<VehicleFile, String> {
        if let Some(folder) = &self.out {
            output::folder(folder)?;
            output::writable(&folder.join(format!("{name}.csv")))?;
        }
        if let Some(path) = &self.json {
            output::writable(path)?;
        }
        vehicle(self.vehicle.as_deref())
    }

    /// Writes the figures; the folder, where there is one.
    fn end(&self, name: &str, csv: &str, study: &impl serde::Serialize) -> Result<Option<&Path>, String> {
        if let Some(folder) = &self.out {
            let file = folder.join(format!("{name}.csv"));
            output::write_file(&file, csv.as_bytes())?;
            output::write_json(Some(&folder.join(format!("{name}.json"))), study)?;
            talk(&format!("wrote {}", file.display()));
        }
        output::write_json(self.json.as_deref(), study)?;
        Ok(self.out.as_deref())
    }
}

/// Options of the study of thrust.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Arms to fly beside pc, separated by commas; all if left out.
    #[arg(long, value_delimiter = ',')]
    arms: Vec<String>,
    /// Flights per arm and condition, on paired seeds.
    #[arg(long, default_value_t = 12)]
    trials: u32,
    #[command(flatten)]
    common: Common,
}

impl Study {
    pub(crate) fn run(&self) -> Result<(), String> {
        match self {
            Self::Faults(options) => options.run(),
            Self::Filters(options) => options.run(),
            Self::Table2(options) => options.run(),
            Self::Thrust(options) => options.thrust(),
        }
    }
}

impl Options {
    fn thrust(&self) -> Result<(), String> {
        let vehicle = self.common.begin("thrust")?;
        let mut arms = if self.arms.is_empty() {
            Arm::ALL.to_vec()
        } else {
            self.arms.iter().map(|name| Arm::parse(name)).collect::<Result<_, _>>()?
        };
        if self.arms.is_empty() && vehicle.weights.is_none() {
            arms.retain(|arm| *arm != Arm::TwccParnn);
            talk(&format!("{} names no parnn_weights: twcc_parnn is left out", vehicle.name));
        }
        let plan = Plan { vehicle, arms, trials: self.trials, seed: self.common.seed };
        let bar = output::progress(thrust::flights(&plan), "flights");
        let study = thrust::run(&plan, || bar.inc(1));
        bar.finish_and_clear();
        let study = study.map_err(|e| e.to_string())?;

        say(&format!(
            "Avoidance manoeuvre, {} trials an arm on paired seeds from {}.",
            study.trials, study.seed
        ));
        say("Gain is mean error of pc over mean error of the arm, minus 1, with its paired 95 % interval.\n");
        let mut table = Table::new(&[
            "T/W",
            "arm",
            "RMSE 3-D m",
            "RMSE horiz. m",
            "gain %",
            "95 % interval",
            "height lost m",
            "height gained m",
            "wings open s",
        ]);
        let mut csv = String::from(
            "thrust_to_weight,arm,rmse_m,rmse_horizontal_m,gain,gain_low,gain_high,height_lost_m,height_gained_m,wings_open_s\n",
        );
        for r in &study.rows {
            table.row(vec![
                format!("{:.2}", r.thrust_to_weight),
                r.arm.to_owned(),
                format!("{:.2}", r.rmse_m),
                format!("{:.2}", r.rmse_horizontal_m),
                format!("{:+.1}", 100.0 * r.gain.value),
                format!("{:+.1} to {:+.1}", 100.0 * r.gain.low, 100.0 * r.gain.high),
                format!("{:.2}", r.height_lost_m),
                format!("{:.2}", r.height_gained_m),
                format!("{:.2}", r.wings_open_s),
            ]);
            let g = r.gain;
            let _ = writeln!(
                csv,
                "{},{},{},{},{},{},{},{},{},{}",
                r.thrust_to_weight,
                r.arm,
                r.rmse_m,
                r.rmse_horizontal_m,
                g.value,
                g.low,
                g.high,
                r.height_lost_m,
                r.height_gained_m,
                r.wings_open_s
            );
        }
        table.print();
        self.common.end("thrust", &csv, &study).map(drop)
    }
}
