//! What studies that take minutes have found: `tests/data/studies.json`, without their single
//! flights.
//!
//! `SQUIRREL_CLAIMS_WRITE=1` flies them and writes it anew, with the size of each result of some
//! trials, and of the result of each study with a trial or two. A test flies these again and
//! compares: a program in which they have the same sizes flies and counts as the one that the record
//! is of.

use serde::Serialize;
use serde_json::Value;
use squirrel_nn::train::EPOCHS;
use squirrel_sim::arm::Arm;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_study::campaign::Plan;
use squirrel_study::journal::{Keep, Part};
use squirrel_study::{faults, forest, steering, table2, table3, thrust};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::{fs, process};

/// Nothing was chosen on it: numbers of controllers were on seeds 1 to 10.
const SEED: u64 = 11;

/// Studies, the names of their journals, and of so many trials of each one is flown again: about
/// thirty flights of each, and one training.
const RECORDED: [(&str, &str, &str); 8] = [
    ("faults", "faults", "1/31"),
    ("faults_together", "faults", "1/17"),
    ("forest", "forest", "1/113"),
    ("forest_scarce", "forest", "1/113"),
    ("thrust", "thrust", "1/113"),
    ("table3", "table3", "1/31"),
    ("steering", "steering", "1/313"),
    ("table2", "table2", "1/5"),
];

/// Lists of single flights or cells: much, and no test asks for them.
const LEFT_OUT: [&str; 3] = ["cells", "ends", "flights"];

/// How much of a study is flown.
#[derive(Clone, Copy)]
enum Of {
    /// What the record is of.
    All,
    /// A trial or two of some arms.
    Few,
}

impl Of {
    fn pick<T>(self, all: T, few: T) -> T {
        match self {
            Self::All => all,
            Self::Few => few,
        }
    }
}

/// A study with its trials in a folder, or only kept there: then it has no result.
fn fly(name: &str, of: Of, keep: &Keep<'_>) -> Option<Value> {
    fn json<T: Serialize>(found: Option<T>) -> Option<Value> {
        found.map(|found| serde_json::to_value(found).unwrap())
    }
    let plan = |arms: &[Arm], all, few| {
        Plan::calm(VehicleFile::squirrel(), arms.to_vec(), of.pick(all, few), SEED)
    };
    let few = [Arm::Pc, Arm::Phantom, Arm::TwccFlat, Arm::TwccPlus, Arm::PcPlus];
    let arms = of.pick(&Arm::ALONE[..], &few);
    let ours = &[Arm::TwccPlus];
    match name {
        "faults" => json(faults::run(&plan(ours, 1000, 20), 1, keep).unwrap()),
        "faults_together" => json(faults::run(&plan(ours, 500, 20), 2, keep).unwrap()),
        "forest" => json(forest::run(&plan(arms, 105, 2), 2.0, keep).unwrap()),
        "forest_scarce" => json(forest::run(&plan(&few, 105, 2), 1.3, keep).unwrap()),
        "thrust" => json(thrust::run(&plan(arms, 12, 2), keep).unwrap()),
        "table3" => json(table3::run(&plan(arms, 12, 2), keep).unwrap()),
        "steering" => {
            // Of 80 cells an arm.
            let arms = of.pick(arms, &[Arm::Pc, Arm::TwccParnn]);
            json(steering::run(&plan(arms, 6, 1), keep).unwrap())
        }
        _ => json(table2::run(&plan(arms, 5, 2), of.pick(EPOCHS, 2), keep).unwrap()),
    }
}

/// Flies all studies and writes what they have found, a line each.
pub(crate) fn write() {
    let line = |name: &str| {
        let found = short(fly(name, Of::All, &Keep::default()).unwrap());
        format!("\"{name}\": {}", serde_json::to_string(&found).unwrap())
    };
    let lines = RECORDED.map(|(name, ..)| line(name)).join(",\n");
    fs::write(file(), format!("{{\n{lines}\n}}\n")).unwrap();
}

/// Without single flights, and numbers with as many digits as anybody asks for.
fn short(value: Value) -> Value {
    let is_left_out = |key: &str, value: &Value| value.is_array() && LEFT_OUT.contains(&key);
    match value {
        Value::Array(all) => all.into_iter().map(short).collect(),
        Value::Object(all) => all
            .into_iter()
            .filter(|(key, value)| !is_left_out(key, value))
            .map(|(key, value)| (key, short(value)))
            .collect(),
        Value::Number(number) if number.is_f64() => {
            format!("{:.7e}", number.as_f64().unwrap()).parse::<f64>().unwrap().into()
        }
        other => other,
    }
}

pub(crate) fn file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/studies.json")
}

/// What is at a path of a recorded study.
pub(crate) fn at(study: &str, path: &str) -> &'static Value {
    static ALL: OnceLock<BTreeMap<String, Value>> = OnceLock::new();
    let all = ALL.get_or_init(|| serde_json::from_slice(&fs::read(file()).unwrap()).unwrap());
    find(all.get(study).unwrap_or_else(|| panic!("{study}: no study of the record")), path)
}

/// A number at a path of a recorded study.
pub(crate) fn number(study: &str, path: &str) -> f64 {
    as_number(at(study, path), path)
}

/// A number at a path of a value.
pub(crate) fn number_in(value: &Value, path: &str) -> f64 {
    as_number(find(value, path), path)
}

/// What was found at a path, as a number.
pub(crate) fn as_number(found: &Value, path: &str) -> f64 {
    found.as_f64().unwrap_or_else(|| panic!("{path}: {found} is no number"))
}

/// What is at a path.
pub(crate) fn find<'a>(mut at: &'a Value, path: &str) -> &'a Value {
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

/// The sampled trials and the small studies, flown: names and sizes of the results.
pub(crate) fn sampled() -> Vec<(String, f64)> {
    let mut lines = Vec::new();
    for (name, journal, part) in RECORDED {
        let folder = std::env::temp_dir().join(format!("squirrel-claims-{name}-{}", process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        let part = Part::Shard(part.parse().unwrap());
        assert_eq!(
            fly(name, Of::All, &Keep { folder: Some(&folder), part, ..Keep::default() }),
            None
        );
        let journal = fs::read_to_string(folder.join(format!("{journal}.trials.jsonl"))).unwrap();
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
        let few = fly(name, Of::Few, &Keep::default()).unwrap();
        lines.push((format!("{name} few"), size(&few)));
    }
    lines
}

/// Sum of the sizes of all numbers in a result; what is true counts as 1, and so does a text, of which
/// a last digit may differ.
fn size(result: &Value) -> f64 {
    match result {
        Value::Number(number) => number.as_f64().unwrap().abs(),
        Value::Bool(is) => f64::from(*is),
        Value::Array(all) => all.iter().map(size).sum(),
        Value::Object(all) => all.values().map(size).sum(),
        Value::String(_) => 1.0,
        Value::Null => 0.0,
    }
}
