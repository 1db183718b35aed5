//! docs/claims.md says what the studies say: every figure in it has the place that it is from
//! behind it, as `<!--study path format-->`.
//!
//! A path leads through the study's JSON: names, places in lists, and `list[key=value,...]` for the
//! first entry that has these. The format is `%1` for percent with one digit or `.2` for a number
//! with two.
//!
//! All the flights take minutes, so `SQUIRREL_CLAIMS_WRITE=1` flies them and writes the figures
//! anew, with the sums of all numbers in some results of each study. The test flies these and
//! compares: a program that has the same sums is the one that the figures are of.

use serde::Serialize;
use serde_json::Value;
use squirrel_core::stack::wire::{HASH_START, hash};
use squirrel_nn::train::EPOCHS;
use squirrel_sim::arm::Arm;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_study::campaign::Plan;
use squirrel_study::forest;
use squirrel_study::journal::{Keep, Part};
use squirrel_study::{paper, steering, table2, table3, thrust};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::{fs, process};

const IDS: [&str; 21] = [
    "C1", "C2", "C3", "C4", "N5", "N6", "N7", "N8", "C9", "C10", "C11", "C12", "C13", "C14", "X1",
    "X2", "X3", "X4", "X5", "X6", "X7",
];

/// Nothing was chosen on it: numbers of controllers were on seeds 1 to 10.
const SEED: u64 = 11;

fn plan(trials: u32) -> Plan {
    Plan::calm(VehicleFile::squirrel(), Arm::ALONE.to_vec(), trials, SEED)
}

/// Of so many trials of a study one is flown again: about twenty flights, and one training.
const SAMPLED: [(&str, &str); 5] = [
    ("forest", "1/113"),
    ("thrust", "1/113"),
    ("table3", "1/31"),
    ("steering", "1/313"),
    ("table2", "1/5"),
];

/// A study with its trials in a folder, or only kept there: then it has no result.
fn study(name: &str, keep: &Keep<'_>) -> Option<Value> {
    fn json<T: Serialize>(found: Option<T>) -> Option<Value> {
        found.map(|found| serde_json::to_value(found).unwrap())
    }
    match name {
        "forest" => json(forest::run(&plan(105), 2.0, keep).unwrap()),
        "thrust" => json(thrust::run(&plan(12), keep).unwrap()),
        "table3" => json(table3::run(&plan(12), keep).unwrap()),
        "steering" => json(steering::run(&plan(6), keep).unwrap()),
        _ => json(table2::run(&plan(5), EPOCHS, keep).unwrap()),
    }
}

/// Of the size of a sum: the last bits of elementary functions depend on the processor.
const ALIKE: f64 = 1e-6;

/// Sum of the sizes of all numbers in a result; what is true counts as 1.
fn size(result: &Value) -> f64 {
    match result {
        Value::Number(number) => number.as_f64().unwrap().abs(),
        Value::Bool(is) => f64::from(*is),
        Value::Array(all) => all.iter().map(size).sum(),
        Value::Object(all) => all.values().map(size).sum(),
        Value::Null | Value::String(_) => 0.0,
    }
}

/// The sampled trials, a line each: study, trial, size of the result.
fn flown() -> Vec<(String, f64)> {
    let mut lines = Vec::new();
    for (name, part) in SAMPLED {
        let folder = std::env::temp_dir().join(format!("squirrel-claims-{name}-{}", process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        let part = Part::Shard(part.parse().unwrap());
        assert_eq!(study(name, &Keep { folder: Some(&folder), part, ..Keep::default() }), None);
        let journal = fs::read_to_string(folder.join(format!("{name}.trials.jsonl"))).unwrap();
        let mut trials: Vec<(u64, f64)> = journal
            .lines()
            .skip(1)
            .map(|line| {
                let line: Value = serde_json::from_str(line).unwrap();
                (line["trial"].as_u64().unwrap(), size(&line["result"]))
            })
            .collect();
        trials.sort_by_key(|(trial, _)| *trial);
        lines.extend(trials.into_iter().map(|(trial, size)| (format!("{name} {trial}"), size)));
        fs::remove_dir_all(&folder).unwrap();
    }
    lines
}

/// What is at a path.
fn find<'a>(mut at: &'a Value, path: &str) -> &'a Value {
    for step in path.split('/') {
        let (name, keys) = step.split_once('[').unwrap_or((step, "]"));
        at = name.parse::<usize>().map_or_else(|_| &at[name], |place| &at[place]);
        let keys: Vec<(&str, &str)> =
            keys[..keys.len() - 1].split(',').filter_map(|key| key.split_once('=')).collect();
        let has = |entry: &Value, (key, wanted): &(&str, &str)| match &entry[*key] {
            Value::String(text) => text == wanted,
            number => number.as_f64() == wanted.parse().ok(),
        };
        if !keys.is_empty() {
            let entries = at.as_array().unwrap_or_else(|| panic!("{path}: {name} is no list"));
            at = entries
                .iter()
                .find(|entry| keys.iter().all(|key| has(entry, key)))
                .unwrap_or_else(|| panic!("{path}: {step} is not there"));
        }
    }
    at
}

fn figure(value: &Value, path: &str, format: &str) -> String {
    let x = value.as_f64().unwrap_or_else(|| panic!("{path}: {value} is no number"));
    let digits: usize = format[1..].parse().unwrap();
    let x = if format.starts_with('%') { 100.0 * x } else { x };
    // What rounds to zero has no sign.
    let text = format!("{x:.digits$}");
    if text.trim_start_matches(['-', '0', '.']).is_empty() {
        text.trim_start_matches('-').to_owned()
    } else {
        text
    }
}

fn repository() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A page, each figure put in by its place; and how many.
fn page(text: &str, mut figure: impl FnMut(&str, &str) -> String) -> (String, usize) {
    let (mut now, mut rest, mut figures) = (String::new(), text, 0);
    while let Some(at) = rest.find("<!--") {
        let (before, marked) = (&rest[..at], &rest[at + 4..]);
        let (place, after) = marked.split_once("-->").unwrap();
        let kept = before.trim_end_matches(|c: char| c.is_ascii_digit() || "+-.".contains(c));
        assert!(kept.len() < before.len(), "`{place}`: no figure before it");
        now += &[kept, &figure(place, &before[kept.len()..]), "<!--", place, "-->"].concat();
        (rest, figures) = (after, figures + 1);
    }
    (now + rest, figures)
}

/// Every place on the page with its figure, as one hash.
fn figures_hash(text: &str) -> String {
    let mut all = Vec::new();
    page(text, |place, figure| {
        all.push(format!("{place} = {figure}\n"));
        figure.to_owned()
    });
    format!("figures {:016x}", hash(HASH_START, all.concat().as_bytes()))
}

#[test]
fn every_figure_is_the_studies_own() {
    let file = repository().join("docs/claims.md");
    let sample = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/claims.txt");
    let text = fs::read_to_string(&file).unwrap();
    let writes = std::env::var_os("SQUIRREL_CLAIMS_WRITE").is_some();
    let facts = serde_json::to_value(paper::facts(&VehicleFile::squirrel())).unwrap();
    let mut studies = BTreeMap::from([("paper", facts)]);
    for (name, _) in SAMPLED.iter().filter(|_| writes) {
        studies.insert(name, study(name, &Keep::default()).unwrap());
    }
    let (now, figures) = page(&text, |place, said| {
        let words: Vec<&str> = place.split(' ').collect();
        let [of, path, format] = words[..] else {
            panic!("`{place}`: must be a study, a path and a format")
        };
        assert!(of == "paper" || SAMPLED.iter().any(|(name, _)| *name == of), "{place}");
        studies.get(of).map_or(said.to_owned(), |found| figure(find(found, path), path, format))
    });
    assert!(figures > 80, "{figures}");
    let flown = flown();
    if writes {
        let lines: Vec<String> =
            flown.iter().map(|(trial, size)| format!("{trial} {size}\n")).collect();
        fs::write(&sample, lines.concat() + &figures_hash(&now) + "\n").unwrap();
        fs::write(&file, now).unwrap();
        return;
    }
    for (line, (said, now)) in text.lines().zip(now.lines()).enumerate() {
        assert_eq!(said, now, "docs/claims.md, line {}", line + 1);
    }
    let kept = fs::read_to_string(&sample).unwrap();
    let anew = "SQUIRREL_CLAIMS_WRITE=1 writes docs/claims.md anew";
    assert_eq!(kept.lines().count(), flown.len() + 1, "{anew}");
    assert_eq!(kept.lines().last(), Some(figures_hash(&now).as_str()), "{anew}");
    for (kept, (trial, size)) in kept.lines().zip(&flown) {
        let (of, before) = kept.rsplit_once(' ').unwrap();
        let before: f64 = before.parse().unwrap();
        let alike = of == trial && (size - before).abs() <= ALIKE * before;
        assert!(alike, "{kept}, now {trial} {size}: another program flies; {anew}");
    }
    assert!(flown.len() > 80, "{}", flown.len());
}

/// Every claim has its row, and every test that a row names is one.
#[test]
fn every_claim_has_a_row_and_a_test() {
    let text = fs::read_to_string(repository().join("docs/claims.md")).unwrap();
    let rows: BTreeMap<&str, &str> = text
        .lines()
        .filter_map(|line| Some((line.strip_prefix("| ")?.split(" |").next()?, line)))
        .collect();
    let mut sources = String::new();
    let mut folders = vec![repository().join("crates")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                sources += &fs::read_to_string(path).unwrap();
            }
        }
    }
    for id in IDS {
        let row = rows.get(id).unwrap_or_else(|| panic!("docs/claims.md: no row {id}"));
        let cells: Vec<&str> = row.trim_matches('|').split(" | ").collect();
        assert_eq!(cells.len(), 5, "{id}: {row}");
        let tests: Vec<&str> = cells[4].split('`').skip(1).step_by(2).collect();
        assert!(!tests.is_empty(), "{id} names no test");
        for test in tests {
            assert!(sources.contains(&format!("fn {test}(")), "{id}: no test is called {test}");
        }
    }
}

/// At T/W 2, without the arms that are in no sentence here.
#[test]
fn the_better_controller_comes_through_the_forest() {
    let papers = ["pc", "pc_wings_open", "wiic_no_wings", "twcc_flat", "twcc_parnn", "twcc_oracle"];
    let arms = papers.iter().chain(&["twcc_plus"]).map(|name| Arm::parse(name).unwrap()).collect();
    let trials = 105;
    let plan = Plan { arms, ..plan(trials) };
    let study = &forest::run(&plan, 2.0, &Keep::default()).unwrap().unwrap();
    let row = |arm: &str| study.rows.iter().find(|row| row.arm == arm).unwrap();
    // `phantom` flies beside them.
    assert_eq!(study.rows.len(), papers.len() + 2);
    let best = papers.iter().map(|arm| row(arm).in_band.share.value).fold(0.0, f64::max);
    let ours = row("twcc_plus").in_band.share;
    assert!(ours.value >= 1.5 * best && ours.low > best, "{ours:?}, the paper's best {best}");

    // With ours' limit of speed they come further; ours is still ahead.
    let limited = |arm: &str| study.limited.iter().find(|row| row.arm == arm).unwrap();
    let best = papers.iter().map(|arm| limited(arm).in_band.share.value).fold(0.0, f64::max);
    assert!(ours.low > best, "{ours:?}, with the limit {best}");
    assert!(limited("twcc_parnn").in_band.count > 2 * row("twcc_parnn").in_band.count);
    assert_eq!(limited("twcc_plus").ends, row("twcc_plus").ends, "it has the limit in any case");

    // The law without wings comes through the plane, at heights where no forest is.
    let climbing = row("wiic_no_wings");
    assert!(
        climbing.through.share.low > row("pc").through.share.high
            && climbing.height_gained_m > 20.0
    );
    assert!(climbing.in_band.share.value < 0.1);
    // Outflying what they see they owe little to wings; within the limit, most.
    for arm in ["twcc_flat", "twcc_parnn"] {
        let [free, held] = [row(arm), limited(arm)].map(|row| row.over_phantom.unwrap());
        assert!(free.high < 0.2 && held.low > 0.4, "{arm}: {free:?}, with the limit {held:?}");
    }
    assert!(forest::words(study)[0].starts_with("twcc_flat"));
    for row in &study.rows {
        assert!(row.in_band.count <= row.through.count && row.ends.len() == trials as usize);
        assert!(row.path_m <= 400.1 && row.displacement_m <= row.path_m, "{row:?}");
    }
}
