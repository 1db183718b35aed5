//! docs/claims.md says what the studies say: every figure in it has the place that it is from
//! behind it, as `<!--study path format-->`.
//!
//! A path leads through the study's JSON: names, places in lists, and `list[key=value,...]` for the
//! first entry that has these. The format is `%1` for percent with one digit or `.2` for a number
//! with two. `SQUIRREL_CLAIMS_WRITE=1` writes the figures anew.

use serde_json::Value;
use squirrel_nn::train::EPOCHS;
use squirrel_sim::arm::Arm;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_study::campaign::Plan;
use squirrel_study::forest::{self, Forest};
use squirrel_study::journal::Keep;
use squirrel_study::{paper, steering, table2, table3, thrust};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::LazyLock;

const IDS: [&str; 21] = [
    "C1", "C2", "C3", "C4", "N5", "N6", "N7", "N8", "C9", "C10", "C11", "C12", "C13", "C14", "X1",
    "X2", "X3", "X4", "X5", "X6", "X7",
];

/// Nothing was chosen on it: numbers of controllers were on seeds 1 to 10.
const SEED: u64 = 11;

fn plan(trials: u32) -> Plan {
    Plan::calm(VehicleFile::squirrel(), Arm::ALONE.to_vec(), trials, SEED)
}

/// A hundred and five trials of every arm, for both tests.
static FOREST: LazyLock<Forest> =
    LazyLock::new(|| forest::run(&plan(105), 2.0, &Keep::default()).unwrap().unwrap());

fn studies() -> BTreeMap<&'static str, Value> {
    let keep = Keep::default();
    let vehicle = VehicleFile::squirrel();
    let json = |study: &dyn Fn() -> serde_json::Result<Value>| study().unwrap();
    BTreeMap::from([
        ("paper", json(&|| serde_json::to_value(paper::facts(&vehicle)))),
        ("forest", json(&|| serde_json::to_value(&*FOREST))),
        ("thrust", json(&|| serde_json::to_value(thrust::run(&plan(12), &keep).unwrap()))),
        ("table3", json(&|| serde_json::to_value(table3::run(&plan(12), &keep).unwrap()))),
        ("steering", json(&|| serde_json::to_value(steering::run(&plan(6), &keep).unwrap()))),
        ("table2", json(&|| serde_json::to_value(table2::run(&plan(5), EPOCHS, &keep).unwrap()))),
    ])
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

#[test]
fn every_figure_is_the_studies_own() {
    let file = repository().join("docs/claims.md");
    let text = std::fs::read_to_string(&file).unwrap();
    let studies = studies();
    let mut now = String::new();
    let mut rest = text.as_str();
    let mut figures = 0;
    while let Some(at) = rest.find("<!--") {
        let (before, marked) = (&rest[..at], &rest[at + 4..]);
        let (place, after) = marked.split_once("-->").unwrap();
        let words: Vec<&str> = place.split(' ').collect();
        let [study, path, format] = words[..] else {
            panic!("`{place}`: must be a study, a path and a format")
        };
        let kept = before.trim_end_matches(|c: char| c.is_ascii_digit() || "+-.".contains(c));
        assert!(kept.len() < before.len(), "`{place}`: no figure before it");
        let value =
            find(studies.get(study).unwrap_or_else(|| panic!("`{place}`: no such study")), path);
        now += kept;
        now += &figure(value, path, format);
        now += &["<!--", place, "-->"].concat();
        (rest, figures) = (after, figures + 1);
    }
    now += rest;
    if std::env::var_os("SQUIRREL_CLAIMS_WRITE").is_some() {
        std::fs::write(&file, now).unwrap();
        return;
    }
    for (line, (said, now)) in text.lines().zip(now.lines()).enumerate() {
        assert_eq!(said, now, "docs/claims.md, line {}", line + 1);
    }
    assert!(figures > 80, "{figures}");
}

/// Every claim has its row, and every test that a row names is one.
#[test]
fn every_claim_has_a_row_and_a_test() {
    let text = std::fs::read_to_string(repository().join("docs/claims.md")).unwrap();
    let rows: BTreeMap<&str, &str> = text
        .lines()
        .filter_map(|line| Some((line.strip_prefix("| ")?.split(" |").next()?, line)))
        .collect();
    let mut sources = String::new();
    let mut folders = vec![repository().join("crates")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                sources += &std::fs::read_to_string(path).unwrap();
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

/// At T/W 2.
#[test]
fn the_better_controller_comes_through_the_forest() {
    let study = &*FOREST;
    let row = |arm: &str| study.rows.iter().find(|row| row.arm == arm).unwrap();
    assert_eq!(study.rows.len(), Arm::ALONE.len());
    let papers = ["pc", "pc_wings_open", "wiic_no_wings", "twcc_flat", "twcc_parnn", "twcc_oracle"];
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
        assert!(row.in_band.count <= row.through.count && row.ends.len() == 105);
        assert!(row.path_m <= 400.1 && row.displacement_m <= row.path_m, "{row:?}");
    }
}
