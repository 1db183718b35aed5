//! `squirrel study`: experiments with many flights.

mod faults;
mod filters;
mod forest;
mod merge;
mod planning;
mod sheet;
mod steering;
mod table2;
mod table3;
mod thrust;

use super::vehicle;
use crate::output::{self, talk};
use crate::paths::Paths;
use indicatif::ProgressBar;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::FlightError;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_study::campaign::Plan;
use squirrel_study::journal::{Keep, Part, Shard, check_trials};
use std::path::{Path, PathBuf};

/// The experiments.
#[derive(Debug, clap::Subcommand)]
pub(crate) enum Study {
    /// What becomes of flights in which one thing fails.
    Faults(faults::Options),
    /// How far estimators of attitude are off in flight, with a calibrated gyro and without.
    Filters(filters::Options),
    /// Who comes through the paper's forest, in its height band and at all, and who owes it to wings.
    Forest(forest::Options),
    /// Put the parts of a study together that were flown with --shard.
    Merge(merge::Options),
    /// What wings buy where both plan: avoidance tasks, planned with wings and without, and flown.
    Planning(planning::Options),
    /// The paper's figure of steering angles and speeds, in paper mode and on the independent plant.
    Steering(steering::Options),
    /// What models of the wing force predict, the paper's Table II: to labels and to truth, 30 to 300 s of training.
    Table2(table2::Options),
    /// The paper's Table III: its real flights, with the error as satellite fix and barometer have it.
    Table3(table3::Options),
    /// What wings are worth as a function of the thrust-to-weight ratio, with a battery that sags and without.
    Thrust(thrust::Options),
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
    /// Folder for the figures as CSV and JSON, and for what else there is to look at; it keeps the trials, so that a study that was
    /// stopped goes on.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Write the figures here as JSON.
    #[arg(long)]
    json: Option<PathBuf>,
    /// Fly a part of the trials only, K/N, into an --out of its own; `squirrel study merge` puts the parts together.
    #[arg(long, value_name = "K/N")]
    shard: Option<Shard>,
    /// Fly nothing: all trials are there.
    #[arg(skip)]
    merged: bool,
}

/// Arms and trials of the experiments that compare controllers.
#[derive(Debug, clap::Args)]
struct Flown {
    /// Arms to fly beside the reference, separated by commas; all if left out.
    #[arg(long, value_delimiter = ',')]
    arms: Vec<String>,
    #[command(flatten)]
    common: Common,
}

impl Common {
    /// The vehicle, once it is known that results can be written: nobody wants to learn that afterwards.
    ///
    /// * `name` - of the study's files
    /// * `others` - what it writes beside them
    fn begin(
        &self,
        name: &str,
        trials: u32,
        others: impl IntoIterator<Item = String>,
    ) -> Result<VehicleFile, String> {
        if self.shard.is_some() && self.json.is_some() {
            return Err("--json: a part of a study has no figures; merge the parts first".to_owned());
        }
        check_trials(trials).map_err(|e| e.to_string())?;
        let kept = self.out.as_ref().map(|folder| folder.join(format!("{name}.json")));
        let paths = Paths::default().vehicle("--vehicle", &self.vehicle);
        let mut paths = paths.writes_json(self.json.as_ref(), kept.as_ref());
        if let Some(folder) = &self.out {
            let names = ["csv", "json", "html", "trials.jsonl"].map(|kind| format!("{name}.{kind}"));
            paths = paths.writes_into(folder, names.into_iter().chain(others));
        }
        paths.check()?;
        let vehicle = vehicle(self.vehicle.as_deref())?;
        if let Some(folder) = &self.out {
            output::folder(folder)?;
        }
        Ok(vehicle)
    }

    /// Where trials are kept, and which are flown.
    fn keep<'a>(&'a self, command: &'a [String]) -> Keep<'a> {
        let part = match self.shard {
            _ if self.merged => Part::Merged,
            Some(shard) => Part::Shard(shard),
            None => Part::All,
        };
        Keep { folder: self.out.as_deref(), part, command }
    }

    /// The arguments that describe a study, without those that say where it is flown.
    fn command(&self, study: &str, own: &[(&str, String)]) -> Vec<String> {
        let mut words = vec![study.to_owned(), format!("--seed={}", self.seed)];
        words.extend(own.iter().map(|(name, value)| format!("--{name}={value}")));
        words
    }

    /// Ends the progress bar; the study, or `None` where only a part was flown, with a word about it.
    fn ended<T>(
        &self,
        bar: &ProgressBar,
        study: Result<Option<T>, FlightError>,
    ) -> Result<Option<T>, String> {
        bar.finish_and_clear();
        let study = study.map_err(|e| e.to_string())?;
        if let (None, Some(shard), Some(folder)) = (&study, self.shard, &self.out) {
            talk(&format!(
                "part {shard} is in {}; `squirrel study merge` puts the parts together",
                folder.display()
            ));
        }
        Ok(study)
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

/// Writes the study's page beside its figures.
fn write_page(folder: &Path, name: &str, html: &str) -> Result<(), String> {
    let file = folder.join(format!("{name}.html"));
    output::write_file(&file, html.as_bytes())?;
    talk(&format!("wrote {}", file.display()));
    Ok(())
}

impl Flown {
    /// The plan, and the arguments that describe the study.
    fn plan(&self, study: &str, trials: u32, own: &[(&str, String)]) -> Result<(Plan, Vec<String>), String> {
        let arms: Vec<Arm> = self.arms.iter().map(|name| Arm::parse(name)).collect::<Result<_, _>>()?;
        let vehicle = self.common.begin(study, trials, [])?;
        let mut plan = Plan::of_all_arms(vehicle, trials, self.common.seed);
        if !arms.is_empty() {
            plan.arms = arms;
        } else if plan.arms.len() < Arm::ALONE.len() {
            let missing: Vec<&str> =
                Arm::ALONE.iter().filter(|arm| !plan.arms.contains(arm)).map(|arm| arm.name()).collect();
            talk(&format!(
                "{} does not have what they need: {} left out",
                plan.vehicle.name,
                missing.join(", ")
            ));
        }
        let arms: Vec<&str> = plan.arms.iter().map(|arm| arm.name()).collect();
        let mut described = vec![("trials", trials.to_string()), ("arms", arms.join(","))];
        described.extend(own.iter().cloned());
        Ok((plan, self.common.command(study, &described)))
    }
}

impl Study {
    pub(crate) fn run(&self) -> Result<(), String> {
        match self {
            Self::Faults(options) => options.run(),
            Self::Filters(options) => options.run(),
            Self::Forest(options) => options.run(),
            Self::Merge(options) => options.run(),
            Self::Planning(options) => options.run(),
            Self::Steering(options) => options.run(),
            Self::Table2(options) => options.run(),
            Self::Table3(options) => options.run(),
            Self::Thrust(options) => options.run(),
        }
    }

    /// What every experiment is told; a merge is none.
    fn common_mut(&mut self) -> Option<&mut Common> {
        match self {
            Self::Faults(options) => Some(&mut options.common),
            Self::Filters(options) => Some(&mut options.common),
            Self::Forest(options) => Some(&mut options.flown.common),
            Self::Planning(options) => Some(&mut options.common),
            Self::Steering(options) => Some(&mut options.flown.common),
            Self::Table2(options) => Some(&mut options.common),
            Self::Table3(options) => Some(&mut options.flown.common),
            Self::Thrust(options) => Some(&mut options.flown.common),
            Self::Merge(_) => None,
        }
    }
}
