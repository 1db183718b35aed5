//! Studies that can be stopped: each trial's result is a line of a file, and who starts again flies only what is missing.
//!
//! The file is `NAME.trials.jsonl` in the study's folder. Its first line says what was planned; a study with another plan refuses to go on
//! from it. A line that was cut off by the stop counts as not flown. Results are handed back in the order of the trials, so that a study
//! that was stopped ten times gives the same bytes as one that never was, on any number of threads.

use rayon::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;
use squirrel_core::stack::wire::{HASH_START, hash};
use squirrel_sim::flight::FlightError;
use squirrel_sim::vehicle_file::VehicleFile;
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// What a study's trials depend on beside their number, in one line: for [`Journal::open`].
pub fn identity(name: &str, vehicle: &VehicleFile, seed: u64) -> String {
    let hash = hash(HASH_START, vehicle.text.as_bytes());
    let (of, estimator, version) = (&vehicle.name, vehicle.estimator.name(), env!("CARGO_PKG_VERSION"));
    format!("{name} of {of} ({hash:016x}) on {estimator}, seed {seed}, version {version}")
}

/// A study's trials on disk, or nowhere.
#[derive(Debug)]
pub struct Journal {
    file: Option<(PathBuf, Mutex<File>)>,
    done: BTreeMap<u32, String>,
}

#[derive(Serialize, serde::Deserialize)]
struct Head {
    plan: String,
}

#[derive(Serialize, serde::Deserialize)]
struct Line<T> {
    trial: u32,
    result: T,
}

impl Journal {
    /// The trials of a study in a folder, which must exist; without one nobody keeps them.
    ///
    /// * `plan` - what a result depends on beside the program itself, in one line
    ///
    /// # Errors
    /// The file cannot be read or written, or is of another plan.
    pub fn open(folder: Option<&Path>, name: &str, plan: &str) -> Result<Self, FlightError> {
        let Some(folder) = folder else { return Ok(Self { file: None, done: BTreeMap::new() }) };
        let path = folder.join(format!("{name}.trials.jsonl"));
        let at = |e: &dyn std::fmt::Display| FlightError(format!("{}: {e}", path.display()));
        let before = match std::fs::read_to_string(&path) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => String::new(),
            Err(e) => return Err(at(&e)),
        };
        // What follows the last line feed was cut off.
        let whole = before.rfind('\n').map_or("", |end| &before[..=end]);
        let mut lines = whole.lines();
        let mut done = BTreeMap::new();
        if let Some(first) = lines.next() {
            let head: Head = serde_json::from_str(first).map_err(|e| at(&e))?;
            if head.plan != plan {
                let problem = format!("is of another plan ({}); give another --out, or delete it", head.plan);
                return Err(at(&problem));
            }
            for line in lines {
                let Line::<serde_json::Value> { trial, .. } =
                    serde_json::from_str(line).map_err(|e| at(&e))?;
                done.insert(trial, line.to_owned());
            }
        }
        let mut file = OpenOptions::new().create(true).append(true).open(&path).map_err(|e| at(&e))?;
        if whole.len() < before.len() {
            file.set_len(whole.len() as u64).map_err(|e| at(&e))?;
        }
        if whole.is_empty() {
            let head = serde_json::to_string(&Head { plan: plan.to_owned() }).map_err(|e| at(&e))?;
            writeln!(file, "{head}").map_err(|e| at(&e))?;
        }
        Ok(Self { file: Some((path, Mutex::new(file))), done })
    }

    /// The results of all trials, from 0; those that are missing are flown on all cores.
    ///
    /// * `progress` - called once for each trial, also for those that were there
    ///
    /// # Errors
    /// A trial that fails, a result that cannot be read, or one that cannot be written.
    pub fn run<T: Serialize + DeserializeOwned + Send>(
        &self,
        trials: u32,
        fly: impl Fn(u32) -> Result<T, FlightError> + Sync,
        progress: impl Fn() + Sync,
    ) -> Result<Vec<T>, FlightError> {
        let one = |trial: u32| {
            let result = if let Some(line) = self.done.get(&trial) {
                self.read(line)?
            } else {
                let result = fly(trial)?;
                self.keep(trial, &result)?
            };
            progress();
            Ok(result)
        };
        (0..trials).into_par_iter().map(one).collect()
    }

    fn read<T: DeserializeOwned>(&self, line: &str) -> Result<T, FlightError> {
        let line: Line<T> = serde_json::from_str(line).map_err(|e| self.at(&e))?;
        Ok(line.result)
    }

    /// Writes a result down; what is handed on is what was written, so that it does not matter who asks.
    fn keep<T: Serialize + DeserializeOwned>(&self, trial: u32, result: &T) -> Result<T, FlightError> {
        let line = serde_json::to_string(&Line { trial, result }).map_err(|e| self.at(&e))?;
        // A number that is none cannot be read again, and must not be kept.
        let kept = self.read(&line)?;
        if let Some((_, file)) = &self.file {
            let mut file = file.lock().map_err(|e| self.at(&e))?;
            // One write a line, so that a stop cuts at most the last.
            file.write_all(format!("{line}\n").as_bytes()).map_err(|e| self.at(&e))?;
        }
        Ok(kept)
    }

    fn at(&self, problem: &dyn std::fmt::Display) -> FlightError {
        match &self.file {
            Some((path, _)) => FlightError(format!("{}: {problem}", path.display())),
            None => FlightError(problem.to_string()),
        }
    }
}
