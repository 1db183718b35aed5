//! Practice cases through the whole workflow, by hand: whether the verdict on each is that of the
//! answers beside them.
//!
//!     cargo run --release -p squirrel-gap --example practice -- DIR
//!
//! DIR holds `answers.json` and `cases/ID/{train/flight00,train/flight01,holdout/flight00}/` in the
//! files of `vehicles/maps/practice.toml`. The tests ask the same of cases that they fly
//! themselves, `tests/it/foreign.rs`.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "this is where it speaks")]

use serde_json::Value as Json;
use squirrel_gap::{Kind, NamedEffect, Value, Verdict, diagnose};
use squirrel_log::FlightLog;
use squirrel_log::import::{ImportMap, import};
use squirrel_sim::vehicle_file::VehicleFile;
use std::collections::BTreeSet;
use std::error::Error;
use std::path::Path;
use std::process::ExitCode;

/// Largest error of a parameter.
const ERROR_MAX: f64 = 0.1;

fn main() -> ExitCode {
    let Some(folder) = std::env::args().nth(1) else {
        eprintln!("practice: DIR: missing");
        return ExitCode::from(2);
    };
    match run(Path::new(&folder)) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(wrong) => {
            eprintln!("practice: {wrong} wrong");
            ExitCode::FAILURE
        }
        Err(error) => {
            eprintln!("practice: {error}");
            ExitCode::FAILURE
        }
    }
}

/// How many verdicts are wrong.
fn run(folder: &Path) -> Result<usize, Box<dyn Error>> {
    let answers: Json =
        serde_json::from_str(&std::fs::read_to_string(folder.join("answers.json"))?)?;
    let answers = answers.as_object().ok_or("answers.json: not an object")?;
    let mut wrong = 0;
    for (case, answer) in answers {
        let verdict = verdict(&folder.join("cases").join(case))?;
        let complaint = complaint(answer, &verdict);
        wrong += usize::from(complaint.is_some());
        println!("{case}: {}", complaint.unwrap_or_else(|| "right".to_owned()));
        println!("  {answer}\n  {:?}: {}", verdict.verdict, verdict.words);
    }
    println!("{} of {} right", answers.len() - wrong, answers.len());
    Ok(wrong)
}

fn verdict(case: &Path) -> Result<Verdict, Box<dyn Error>> {
    let vehicles = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../vehicles");
    let map = ImportMap::load(&vehicles.join("maps/practice.toml"))?;
    let read = |part: &str| -> Result<(String, FlightLog), Box<dyn Error>> {
        Ok((part.to_owned(), import(&map, &[case.join(part)])?.0))
    };
    let flights = [read("train/flight00")?, read("train/flight01")?];
    let vehicle = VehicleFile::load(&vehicles.join("practice.toml"))?;
    Ok(diagnose(&vehicle, &flights, &[read("holdout/flight00")?], &|_| {})?.verdict)
}

/// What is wrong with a verdict; `None` if nothing is.
fn complaint(answer: &Json, verdict: &Verdict) -> Option<String> {
    let hidden = answer["effects"].as_object();
    // A note says that the effect is there in another form than the standard one.
    let other_form =
        hidden.is_some_and(|all| all.values().any(|effect| effect.get("note").is_some()));
    let right = match answer["verdict"].as_str() {
        Some("none") => &[Kind::None][..],
        Some("outside_catalogue") => &[Kind::OutsideCatalogue],
        _ if other_form => &[Kind::Named, Kind::NamedFormDiffers],
        // Nobody sees the ground from far above it.
        _ if answer["excitation"] == "calm" => &[Kind::Named, Kind::NotIdentifiable],
        _ => &[Kind::Named],
    };
    if !right.contains(&verdict.verdict) {
        return Some(format!("the verdict must be one of {right:?}"));
    }
    if !matches!(verdict.verdict, Kind::Named | Kind::NamedFormDiffers) {
        return None;
    }
    let names: BTreeSet<&str> = verdict.effects.iter().map(|effect| effect.name).collect();
    let expected: BTreeSet<&str> = hidden?.keys().map(String::as_str).collect();
    if names != expected {
        return Some(format!("names {names:?}, hidden are {expected:?}"));
    }
    if other_form {
        return None;
    }
    verdict.effects.iter().find_map(|effect| wrong_parameter(&hidden?[effect.name], effect))
}

fn wrong_parameter(hidden: &Json, found: &NamedEffect) -> Option<String> {
    hidden.as_object()?.iter().find_map(|(key, truth)| {
        let truth = truth.as_f64()?;
        let Some(Value::Number { value, .. }) = found.parameters.get(key.as_str()) else {
            return Some(format!("{}.{key}: missing", found.name));
        };
        let off = (value / truth - 1.0).abs();
        (off > ERROR_MAX).then(|| format!("{}.{key}: {value}, hidden is {truth}", found.name))
    })
}
