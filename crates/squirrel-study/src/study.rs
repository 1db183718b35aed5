//! What a study is to the command line: a study's file says it in one [`Study`], and
//! `squirrel study` makes of it options and help, a progress bar, the files of `--out`, and the way
//! back from the parts of `--shard`.

use crate::campaign::Plan;
use crate::journal::Keep;
use crate::sheet::Sheet;
use serde::Serialize;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::FlightError;

/// One experiment.
#[derive(Debug)]
pub struct Study {
    /// Its word on the command line, and the name of its files.
    pub name: &'static str,
    /// One line of help.
    pub about: &'static str,
    /// How many trials if nobody says, and what one is.
    pub trials: (u32, &'static str),
    /// Who flies.
    pub arms: Arms,
    /// Whether `--conditions` says on what day its flights are flown.
    pub days: bool,
    /// What else can be asked for.
    pub options: &'static [Choice],
    /// What the progress bar counts.
    pub unit: &'static str,
    /// Names of the files beside `csv`, `json`, `html` and trials, for so many trials.
    pub others: fn(u32) -> Vec<String>,
    /// Flies the study; `None` where only a part is flown here.
    pub fly: Fly,
}

/// How a study is flown: by its plan and the values of [`Study::options`], in their order.
pub type Fly = fn(&Plan, &[f64], &Keep<'_>) -> Result<Option<Found>, FlightError>;

/// Who flies.
#[derive(Debug)]
pub enum Arms {
    /// These, if any.
    Fixed(&'static [Arm]),
    /// Those of `--arms`; these if it is left out, as far as the vehicle can fly them.
    Asked(&'static [Arm]),
}

/// An option of one study.
#[derive(Debug)]
pub struct Choice {
    /// Without dashes.
    pub name: &'static str,
    /// One line of help.
    pub help: &'static str,
    /// Its value if it is left out.
    pub default: f64,
    /// Whether it is a number of things.
    pub whole: bool,
}

/// What a study found: for people, for machines, and to look at.
#[derive(Default)]
#[allow(missing_debug_implementations, reason = "work has none")]
pub struct Found {
    /// For people, from top to bottom.
    pub shown: Vec<Shown>,
    /// The figures.
    pub csv: String,
    /// The study as JSON.
    pub json: String,
    /// The page.
    pub page: Option<String>,
    /// Names and texts of the other files, those of [`Study::others`].
    pub others: Vec<(String, String)>,
    /// What is timed for people.
    pub timed: Option<Timed>,
}

/// A part of what people see.
#[derive(Debug)]
pub enum Shown {
    /// A line.
    Line(String),
    /// A table: its heading, then its rows.
    Table(Vec<Vec<String>>),
}

/// Work whose duration is a question of its own. A library has no clock, so that the command line
/// does it and measures.
#[allow(missing_debug_implementations, reason = "work has none")]
pub struct Timed {
    /// What is timed, in words.
    pub words: &'static str,
    /// Names of the columns that say where a row belongs.
    pub columns: Vec<&'static str>,
    /// These columns, and the work of a row, piece by piece.
    pub rows: Vec<(Vec<String>, Vec<Work>)>,
}

/// A piece of work.
pub type Work = Box<dyn Fn()>;

impl Study {
    /// A study whose trials are flights, without arms and options of its own; a study that is more
    /// says so field by field.
    pub const fn new(
        name: &'static str,
        about: &'static str,
        trials: (u32, &'static str),
        fly: Fly,
    ) -> Self {
        Self {
            name,
            about,
            trials,
            arms: Arms::Fixed(&[]),
            days: false,
            options: &[],
            unit: "flights",
            others: |_| Vec::new(),
            fly,
        }
    }
}

impl Found {
    /// A study's result; what is shown and kept of it follows.
    ///
    /// # Errors
    /// It cannot be written as JSON.
    pub fn of(study: &impl Serialize) -> Result<Self, FlightError> {
        let json =
            serde_json::to_string_pretty(study).map_err(|e| FlightError(e.to_string()))? + "\n";
        Ok(Self { json, ..Self::default() })
    }

    /// Adds a line.
    pub fn say(&mut self, line: impl Into<String>) {
        self.shown.push(Shown::Line(line.into()));
    }

    /// Adds the words of a study after an empty line.
    pub fn words(&mut self, words: Vec<String>) {
        self.say("");
        self.shown.extend(words.into_iter().map(Shown::Line));
    }

    /// Adds the table of a sheet; its CSV.
    pub fn sheet(&mut self, sheet: Sheet) -> String {
        let Sheet { rows, csv } = sheet;
        self.shown.push(Shown::Table(rows));
        csv
    }
}
