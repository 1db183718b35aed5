//! Studies that can be stopped, and split over machines: each trial's result is a line of a file,
//! and who starts again flies only what is missing.
//!
//! The file is `NAME.trials.jsonl` in the study's folder, which one program at a time has. Its first
//! line says what was planned, and in which format it is; a study with another plan refuses to go on
//! from it. A line that was cut off by the stop counts as not flown; one that has changed since is
//! told by its hash. Results are handed back in the order of the trials, and the lines of a study that is
//! done are put in that order, so that a study that was stopped ten times, or flown in parts
//! ([`Shard`]) that were merged ([`crate::merge`]), leaves the same bytes as one that never was, on
//! any number of threads.

use rayon::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;
use squirrel_core::stack::wire::{HASH_START, hash, written};
use squirrel_log::files::{self, Lock, write_whole};
use squirrel_sim::flight::FlightError;
use squirrel_sim::vehicle_file::VehicleFile;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Mutex;

/// Most trials of a study: what is more was not meant.
pub const TRIALS_MAX: u32 = 100_000;

/// # Errors
/// No trials, or more than anybody flies.
pub fn check_trials(trials: u32) -> Result<(), FlightError> {
    if (1..=TRIALS_MAX).contains(&trials) {
        return Ok(());
    }
    Err(FlightError(format!("trials = {trials}: must be 1 to {TRIALS_MAX}")))
}

/// What a study's trials depend on beside their number, in one line: for [`Journal::open`].
pub fn identity(name: &str, vehicle: &VehicleFile, seed: u64) -> String {
    // The file names its network; what that says is not in the text.
    let weights =
        vehicle.weights.as_ref().and_then(|weights| written(weights.parnn(), <[u8]>::to_vec));
    let hash = hash(hash(HASH_START, vehicle.text.as_bytes()), &weights.unwrap_or_default());
    let (of, estimator, version) =
        (&vehicle.name, vehicle.estimator.name(), env!("CARGO_PKG_VERSION"));
    format!("{name} of {of} ({hash:016x}) on {estimator}, seed {seed}, version {version}")
}

/// One part of a study: every `of`-th trial, from the `number`-th on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    number: u32,
    of: u32,
}

impl Shard {
    /// Whether a trial is in this part.
    fn has(self, trial: u32) -> bool {
        trial % self.of == self.number - 1
    }
}

impl FromStr for Shard {
    type Err = String;

    /// `K/N`, K from 1.
    fn from_str(text: &str) -> Result<Self, String> {
        let numbers =
            text.split_once('/').and_then(|(k, n)| Some((k.parse().ok()?, n.parse().ok()?)));
        match numbers {
            Some((number, of)) if number >= 1 && number <= of => Ok(Self { number, of }),
            _ => Err("must be K/N, with K from 1 to N".to_owned()),
        }
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

/// Which trials are flown here.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Part {
    /// All that are missing.
    #[default]
    All,
    /// Those of one part that are missing; the study has no result then.
    Shard(Shard),
    /// None: all have to be there.
    Merged,
}

/// Where trials are kept, and which are flown here.
#[derive(Debug, Clone, Copy, Default)]
pub struct Keep<'a> {
    /// Folder, which must exist; without one nobody keeps them.
    pub folder: Option<&'a Path>,
    /// Which are flown.
    pub part: Part,
    /// The arguments that describe the study, for who merges parts of it.
    pub command: &'a [String],
    /// The commit of the program, where it is known: what another one flew is not gone on from.
    pub commit: Option<&'a str>,
    /// Who is told how far it is.
    pub progress: Option<&'a dyn Progress>,
    /// The folder's lock, of who writes more into it than trials; otherwise it is locked while they
    /// are flown.
    pub lock: Option<&'a Lock>,
}

/// Who is told how far a study is.
pub trait Progress: Sync + std::fmt::Debug {
    /// So many steps more are to be done.
    fn ahead(&self, steps: u64);
    /// So many of them are done.
    fn done(&self, steps: u64);
}

impl Keep<'_> {
    /// Of so many trials those that are flown here.
    pub(crate) fn mine(&self, trials: u32) -> Vec<u32> {
        let is_mine = |trial: &u32| !matches!(self.part, Part::Shard(shard) if !shard.has(*trial));
        (0..trials).filter(is_mine).collect()
    }

    /// Tells of steps that are to be done.
    pub(crate) fn ahead(&self, steps: usize) {
        self.progress.inspect(|told| told.ahead(steps as u64));
    }

    /// Tells of steps that are done.
    pub(crate) fn done(&self, steps: u64) {
        self.progress.inspect(|told| told.done(steps));
    }
}

/// A study's trials on disk, or nowhere.
#[derive(Debug)]
pub struct Journal<'a> {
    keep: Keep<'a>,
    file: Option<(PathBuf, Mutex<File>)>,
    head: Head,
    done: Lines,
    _lock: Option<Lock>,
}

/// The first line.
#[derive(Debug, Clone, PartialEq, Serialize, serde::Deserialize)]
pub(crate) struct Head {
    /// Of the lines that follow.
    #[serde(default)]
    pub(crate) format: u32,
    /// What a result depends on beside the program itself.
    pub(crate) plan: String,
    /// [`Keep::command`].
    pub(crate) command: Vec<String>,
}

/// Format of the lines: each ends with its hash.
pub(crate) const FORMAT: u32 = 2;

/// What stands between a line and its hash, and behind it.
const HASH: (&str, &str) = (",\"hash\":\"", "\"}");

/// A line with its hash as the last field, of all that is before it.
fn hashed(line: &str) -> String {
    let open = line.strip_suffix('}').unwrap_or(line);
    format!("{open}{}{:016x}{}", HASH.0, hash(HASH_START, open.as_bytes()), HASH.1)
}

/// Whether a line is as it was written.
fn is_as_written(line: &str) -> bool {
    line.rsplit_once(HASH.0).is_some_and(|(open, _)| hashed(&format!("{open}}}")) == line)
}

#[derive(Serialize, serde::Deserialize)]
struct Line<T> {
    trial: u32,
    result: T,
}

/// Lines by their trials.
pub(crate) type Lines = BTreeMap<u32, String>;

/// A file's head and whole lines, and how long they are; nothing where there is no file or no head
/// yet.
pub(crate) fn read(path: &Path) -> Result<(Option<Head>, Lines, usize), FlightError> {
    let at = |e: &dyn std::fmt::Display| FlightError(format!("{}: {e}", path.display()));
    let bytes = match files::read(path) {
        Ok(bytes) => bytes,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Vec::new(),
        Err(e) => return Err(at(&e)),
    };
    let text = String::from_utf8(bytes).map_err(|e| at(&e.utf8_error()))?;
    // What follows the last line feed was cut off.
    let whole = text.rfind('\n').map_or("", |end| &text[..=end]);
    let mut lines = whole.lines();
    let head = lines.next().map(serde_json::from_str::<Head>).transpose().map_err(|e| at(&e))?;
    if let Some(Head { format, .. }) = head.as_ref().filter(|head| head.format != FORMAT) {
        let problem = format!(
            "is of format {format}, this version writes and reads {FORMAT}; give another --out, or \
             delete it"
        );
        return Err(at(&problem));
    }
    let mut done = Lines::new();
    for (number, line) in lines.enumerate() {
        let place = number + 2;
        if !is_as_written(line) {
            let problem = format!(
                "line {place}: has changed since it was written; without it, its trial is flown again"
            );
            return Err(at(&problem));
        }
        let Line::<serde_json::Value> { trial, .. } = serde_json::from_str(line)
            .map_err(|e| at(&format!("line {place}, from its begin: {e}")))?;
        done.insert(trial, line.to_owned());
    }
    Ok((head, done, whole.len()))
}

/// Writes head and lines in their order, whole or not at all.
pub(crate) fn write(path: &Path, head: &Head, lines: &Lines) -> Result<(), FlightError> {
    let at = |e: &dyn std::fmt::Display| FlightError(format!("{}: {e}", path.display()));
    let mut text = serde_json::to_string(head).map_err(|e| at(&e))? + "\n";
    for line in lines.values() {
        text += line;
        text.push('\n');
    }
    write_whole(path, text.as_bytes()).map_err(|e| at(&e))
}

/// Locks a study's folder.
///
/// # Errors
/// Another program is writing into it.
pub fn locked(folder: &Path) -> Result<Lock, FlightError> {
    Lock::folder(folder).map_err(|e| FlightError(format!("{}: {e}", folder.display())))
}

impl<'a> Journal<'a> {
    /// The trials of a study.
    ///
    /// * `plan` - what a result depends on beside the program itself, in one line
    ///
    /// # Errors
    /// The file cannot be read or written, has changed, or is of another plan; another program is
    /// writing into the folder; a part of a study that nobody
    /// keeps.
    pub fn open(keep: &Keep<'a>, name: &str, plan: &str) -> Result<Self, FlightError> {
        let of_commit = keep.commit.map_or_else(String::new, |commit| format!(", commit {commit}"));
        let plan = format!("{plan}{of_commit}");
        let head = Head { format: FORMAT, plan: plan.clone(), command: keep.command.to_vec() };
        let Some(folder) = keep.folder else {
            if keep.part == Part::All {
                return Ok(Self { keep: *keep, file: None, head, done: Lines::new(), _lock: None });
            }
            return Err(FlightError(
                "shard: needs a folder that keeps what was flown; give --out".to_owned(),
            ));
        };
        let lock = match keep.lock {
            Some(_) => None,
            None => Some(locked(folder)?),
        };
        let path = folder.join(format!("{name}.trials.jsonl"));
        let at = |e: &dyn std::fmt::Display| FlightError(format!("{}: {e}", path.display()));
        let (before, done, mut length) = read(&path)?;
        if let Some(before) = before {
            if before.plan != plan {
                if keep.part == Part::Merged {
                    // The folder is the merge's own; what differs is what it was asked for.
                    return Err(FlightError(format!(
                        "merge: the parts are of another plan ({}) than this one ({plan}); --vehicle must be what they were flown with",
                        before.plan
                    )));
                }
                let problem = format!(
                    "is of another plan ({}); give another --out, or delete it",
                    before.plan
                );
                return Err(at(&problem));
            }
            if before != head {
                // As many trials as are asked for now, for who merges.
                write(&path, &head, &done)?;
                length = read(&path)?.2;
            }
        }
        let mut file = files::append(&path, length as u64).map_err(|e| at(&e))?;
        if length == 0 {
            let line = serde_json::to_string(&head).map_err(|e| at(&e))?;
            writeln!(file, "{line}").map_err(|e| at(&e))?;
        }
        let file = Some((path, Mutex::new(file)));
        Ok(Self { keep: *keep, file, head, done, _lock: lock })
    }

    /// The results of all trials, from 0; those that are missing are flown on all cores. `None`
    /// where only a part of them is flown here.
    ///
    /// # Errors
    /// A trial that fails, a result that cannot be read, or one that cannot be written; after a
    /// merge, a trial that is missing.
    pub fn run<T: Serialize + DeserializeOwned + Send>(
        &self,
        trials: u32,
        fly: impl Fn(u32) -> Result<T, FlightError> + Sync,
    ) -> Result<Option<Vec<T>>, FlightError> {
        let one = |(trial, kept): (u32, Option<T>)| {
            let result = match kept {
                Some(result) => result,
                None => self.write_down(trial, &fly(trial)?)?,
            };
            self.keep.done(1);
            Ok(result)
        };
        let mine = self.keep.mine(trials);
        // Looked for in order, before the threads: the error names the first on any number of them.
        if self.keep.part == Part::Merged
            && let Some(trial) = mine.iter().find(|trial| !self.done.contains_key(trial))
        {
            let problem = format!("flight = {trial}: missing, in none of the merged folders");
            return Err(self.at(&problem));
        }
        // Likewise, and before anything is flown.
        let with_kept = |trial: u32| {
            let kept = self.done.get(&trial).map(|line| self.read(line)).transpose()?;
            Ok((trial, kept))
        };
        let mine = mine.into_iter().map(with_kept).collect::<Result<Vec<_>, FlightError>>()?;
        self.keep.ahead(mine.len());
        let all: Vec<T> = mine.into_par_iter().map(one).collect::<Result<_, _>>()?;
        if let Part::Shard(_) = self.keep.part {
            return Ok(None);
        }
        if let Some((path, _)) = &self.file {
            let (_, lines, _) = read(path)?;
            write(path, &self.head, &lines)?;
        }
        Ok(Some(all))
    }

    fn read<T: DeserializeOwned>(&self, line: &str) -> Result<T, FlightError> {
        let whole = |e: &serde_json::Error| {
            let place = line.split_once(",\"result\"").map_or(line, |(place, _)| place);
            self.at(&format!("{place}...: {e}"))
        };
        let line: Line<T> = serde_json::from_str(line).map_err(|e| whole(&e))?;
        Ok(line.result)
    }

    /// Writes a result down; what is handed on is what was written, so that it does not matter who
    /// asks.
    fn write_down<T: Serialize + DeserializeOwned>(
        &self,
        trial: u32,
        result: &T,
    ) -> Result<T, FlightError> {
        let line = serde_json::to_string(&Line { trial, result }).map_err(|e| self.at(&e))?;
        let line = hashed(&line);
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
