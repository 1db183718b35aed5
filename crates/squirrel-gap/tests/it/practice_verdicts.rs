//! The practice cases through the whole workflow: the verdict on each is that of the answers beside them.
//!
//! The cases are flights of another simulator and stay outside of the repository; without them the test says so and passes.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::support::{imported, shared, vehicle};
use serde_json::Value as Json;
use squirrel_gap::{Kind, NamedEffect, Value, Verdict, diagnose};
use std::collections::BTreeSet;
use std::path::Path;

/// Largest error of a parameter.
const ERROR_MAX: f64 = 0.1;

fn verdict(case: &Path) -> Verdict {
    let read = |part: &str| (part.to_owned(), imported("practice.toml", &case.join(part)));
    let flights = [read("train/flight00"), read("train/flight01")];
    diagnose(&vehicle("practice.toml"), &flights, &[read("holdout/flight00")], &|_| {}).unwrap().verdict
}

/// What is wrong with a verdict; `None` if nothing is.
fn complaint(answer: &Json, verdict: &Verdict) -> Option<String> {
    let hidden = answer["effects"].as_object();
    // A note says that the effect is there in another form than the standard one.
    let other_form = hidden.is_some_and(|all| all.values().any(|effect| effect.get("note").is_some()));
    let right = match answer["verdict"].as_str().unwrap() {
        "none" => &[Kind::None][..],
        "outside_catalogue" => &[Kind::OutsideCatalogue],
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
    let expected: BTreeSet<&str> = hidden.unwrap().keys().map(String::as_str).collect();
    if names != expected {
        return Some(format!("names {names:?}, hidden are {expected:?}"));
    }
    if other_form {
        return None;
    }
    verdict.effects.iter().find_map(|effect| wrong_parameter(&hidden.unwrap()[effect.name], effect))
}

fn wrong_parameter(hidden: &Json, found: &NamedEffect) -> Option<String> {
    hidden.as_object().unwrap().iter().find_map(|(key, truth)| {
        let truth = truth.as_f64().unwrap();
        let Some(Value::Number { value, .. }) = found.parameters.get(key.as_str()) else {
            return Some(format!("{}.{key}: missing", found.name));
        };
        let off = (value / truth - 1.0).abs();
        (off > ERROR_MAX).then(|| format!("{}.{key}: {value}, hidden is {truth}", found.name))
    })
}

#[test]
fn every_practice_case_gets_its_verdict() {
    let Some(folder) = shared("gap-practice") else { return };
    let text = std::fs::read_to_string(folder.join("answers.json")).unwrap();
    let answers: Json = serde_json::from_str(&text).unwrap();
    let mut wrong = Vec::new();
    for (case, answer) in answers.as_object().unwrap() {
        let verdict = verdict(&folder.join("cases").join(case));
        println!("{case} {answer}\n  {:?}: {}", verdict.verdict, verdict.words);
        if let Some(complaint) = complaint(answer, &verdict) {
            wrong.push(format!("{case}: {:?}: {complaint}", verdict.verdict));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert_eq!(answers.as_object().unwrap().len(), 9);
}
