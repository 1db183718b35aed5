//! Puts the parts of a study together that were flown in different folders, on different machines.

use crate::journal::{Head, Lines, read, write};
use squirrel_sim::flight::FlightError;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The end of every journal's name.
const SUFFIX: &str = ".trials.jsonl";

/// Writes the trials of all folders into another, which must exist and which the caller has locked
/// ([`locked`](crate::journal::locked)); the arguments that describe the
/// study.
///
/// # Errors
/// A folder without trials or that cannot be read, folders of different studies, a trial that has
/// two results.
pub fn merge(folders: &[PathBuf], into: &Path) -> Result<Vec<String>, FlightError> {
    let mut all: BTreeMap<String, (Head, Lines)> = BTreeMap::new();
    let mut command: Option<Vec<String>> = None;
    for folder in folders {
        let names = journals(folder)?;
        if names.is_empty() {
            return Err(FlightError(format!(
                "{}: holds no part of a study (*{SUFFIX})",
                folder.display()
            )));
        }
        for name in names {
            let path = folder.join(&name);
            let at = |problem: String| FlightError(format!("{}: {problem}", path.display()));
            let (head, lines, _) = read(&path)?;
            let Some(head) = head else { return Err(at("holds nothing".to_owned())) };
            let (first, merged) = all.entry(name).or_insert_with(|| (head.clone(), Lines::new()));
            if *first != head {
                return Err(at(format!("is {} the first", differs(&head, first))));
            }
            let command = command.get_or_insert_with(|| head.command.clone());
            if *command != head.command {
                return Err(at(format!(
                    "is of another study ({}) than the first ({})",
                    head.command.join(" "),
                    command.join(" ")
                )));
            }
            for (trial, line) in lines {
                if merged.get(&trial).is_some_and(|other| *other != line) {
                    return Err(at(format!(
                        "flight = {trial}: has another result in another folder"
                    )));
                }
                merged.insert(trial, line);
            }
        }
    }
    for (name, (head, lines)) in &all {
        let path = into.join(name);
        let (there, mut all, _) = read(&path)?;
        if let Some(there) = there
            && there != *head
        {
            let problem = format!(
                "is {} the merged parts; give another --out, or delete it",
                differs(&there, head)
            );
            return Err(FlightError(format!("{}: {problem}", path.display())));
        }
        // What an earlier merge brought stays.
        all.extend(lines.clone());
        write(&path, head, &all)?;
    }
    command.filter(|command| !command.is_empty()).ok_or_else(|| {
        FlightError("merge: the folders do not say which study they hold a part of".to_owned())
    })
}

/// What a journal is of that another one is not of, up to the words that say which.
fn differs(own: &Head, other: &Head) -> String {
    if own.plan != other.plan {
        return format!("of another plan ({}) than that ({}) of", own.plan, other.plan);
    }
    let only = |a: &Head, b: &Head| {
        let words: Vec<&str> =
            a.command.iter().filter(|word| !b.command.contains(word)).map(String::as_str).collect();
        if words.is_empty() { "nothing more".to_owned() } else { words.join(" ") }
    };
    format!("flown with {} instead of {} of", only(own, other), only(other, own))
}

/// The names of a folder's journals.
///
/// # Errors
/// The folder cannot be read.
pub fn journals(folder: &Path) -> Result<Vec<String>, FlightError> {
    let at = |e: std::io::Error| FlightError(format!("{}: {e}", folder.display()));
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(at)? {
        let name = entry.map_err(at)?.file_name().to_string_lossy().into_owned();
        if name.ends_with(SUFFIX) {
            names.push(name);
        }
    }
    names.sort_unstable();
    Ok(names)
}
