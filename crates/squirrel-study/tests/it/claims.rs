//! docs/claims.md says what the studies say: every figure in it has the place that it is from
//! behind it, as `<!--study path format-->`.
//!
//! A path leads through the study's JSON: names, places in lists, and `list[key=value,...]` for the
//! first entry that has these. The format is `%1` for percent with one digit or `.2` for a number
//! with two. The studies are those of `recorded`.

use crate::recorded::{self, as_number, find, number};
use serde_json::Value;
use squirrel_core::stack::wire::{HASH_START, hash};
use squirrel_sim::arm::Arm;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_study::campaign::Plan;
use squirrel_study::forest;
use squirrel_study::journal::Keep;
use squirrel_study::paper;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

const IDS: [&str; 21] = [
    "C1", "C2", "C3", "C4", "N5", "N6", "N7", "N8", "C9", "C10", "C11", "C12", "C13", "C14", "X1",
    "X2", "X3", "X4", "X5", "X6", "X7",
];

/// Of a size: the last bits of elementary functions depend on the processor.
const ALIKE: f64 = 1e-6;

fn figure(value: &Value, path: &str, format: &str) -> String {
    let x = as_number(value, path);
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
fn page(text: &str, figure: impl Fn(&str) -> String) -> (String, usize) {
    let (mut now, mut rest, mut figures) = (String::new(), text, 0);
    while let Some(at) = rest.find("<!--") {
        let (before, marked) = (&rest[..at], &rest[at + 4..]);
        let (place, after) = marked.split_once("-->").unwrap();
        let kept = before.trim_end_matches(|c: char| c.is_ascii_digit() || "+-.".contains(c));
        assert!(kept.len() < before.len(), "`{place}`: no figure before it");
        now += &[kept, &figure(place), "<!--", place, "-->"].concat();
        (rest, figures) = (after, figures + 1);
    }
    (now + rest, figures)
}

#[test]
fn every_figure_is_the_studies_own() {
    let file = repository().join("docs/claims.md");
    let sample = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/claims.txt");
    let text = fs::read_to_string(&file).unwrap();
    let writes = std::env::var_os("SQUIRREL_CLAIMS_WRITE").is_some();
    if writes {
        recorded::write();
    }
    let facts = serde_json::to_value(paper::facts(&VehicleFile::squirrel())).unwrap();
    let (now, figures) = page(&text, |place| {
        let words: Vec<&str> = place.split(' ').collect();
        let [of, path, format] = words[..] else {
            panic!("`{place}`: must be a study, a path and a format")
        };
        let found = if of == "paper" { find(&facts, path) } else { recorded::at(of, path) };
        figure(found, path, format)
    });
    assert!(figures > 80, "{figures}");
    let flown = recorded::sampled();
    // Who changes the record by hand changes this.
    let record = format!("record {:016x}", hash(HASH_START, &fs::read(recorded::file()).unwrap()));
    if writes {
        let lines: Vec<String> =
            flown.iter().map(|(trial, size)| format!("{trial} {size}\n")).collect();
        fs::write(&sample, lines.concat() + &record + "\n").unwrap();
        fs::write(&file, now).unwrap();
        return;
    }
    for (line, (said, now)) in text.lines().zip(now.lines()).enumerate() {
        assert_eq!(said, now, "docs/claims.md, line {}", line + 1);
    }
    let kept = fs::read_to_string(&sample).unwrap();
    let anew = "SQUIRREL_CLAIMS_WRITE=1 flies the studies and writes docs/claims.md anew";
    assert_eq!(kept.lines().count(), flown.len() + 1, "{anew}");
    assert_eq!(kept.lines().last(), Some(record.as_str()), "{anew}");
    for (kept, (trial, size)) in kept.lines().zip(&flown) {
        let (of, before) = kept.rsplit_once(' ').unwrap();
        let before: f64 = before.parse().unwrap();
        let alike = of == trial && (size - before).abs() <= ALIKE * before;
        assert!(alike, "{kept}, now {trial} {size}: another program flies; {anew}");
    }
    assert!(flown.len() > 140, "{}", flown.len());
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

/// At T/W 2, of the record.
#[test]
fn the_better_controller_comes_through_the_forest() {
    let papers = ["pc", "pc_wings_open", "wiic_no_wings", "twcc_flat", "twcc_parnn", "twcc_oracle"];
    let row = |arm: &str, what: &str| number("forest", &format!("rows[arm={arm}]/{what}"));
    // With the limit of speed that ours has.
    let limited = |arm: &str, what: &str| number("forest", &format!("limited[arm={arm}]/{what}"));
    let share = "in_band/share/value";
    let best = papers.iter().map(|arm| row(arm, share)).fold(0.0, f64::max);
    let [ours, low] = [share, "in_band/share/low"].map(|what| row("twcc_plus", what));
    assert!(ours >= 1.5 * best && low > best, "{ours} from {low}, the paper's best {best}");

    // With the limit they come further; ours is still ahead.
    let best = papers.iter().map(|arm| limited(arm, share)).fold(0.0, f64::max);
    assert!(low > best, "{low}, with the limit {best}");
    assert!(limited("twcc_parnn", share) > 2.0 * row("twcc_parnn", share));
    let entry = |list: &str| recorded::at("forest", &format!("{list}[arm=twcc_plus]"));
    for figure in ["through", "in_band", "path_m", "height_lost_m", "wings_open_s"] {
        let [free, held] = ["rows", "limited"].map(|list| &entry(list)[figure]);
        assert_eq!(free, held, "{figure}: it has the limit in any case");
    }

    // The law without wings comes through the plane, at heights where no forest is.
    let climbing = "wiic_no_wings";
    assert!(row(climbing, "through/share/low") > row("pc", "through/share/high"));
    assert!(row(climbing, "height_gained_m") > 20.0);
    assert!(row(climbing, share) < 0.1);
    // Outflying what they see they owe little to wings; within the limit, most.
    for arm in ["twcc_flat", "twcc_parnn"] {
        let (free, held) = (row(arm, "over_phantom/high"), limited(arm, "over_phantom/low"));
        assert!(free < 0.2 && held > 0.4, "{arm}: up to {free}, with the limit from {held}");
    }
}

/// At T/W 1.3, of the record: a turn into the trunk has to end in front of it, and does so with wings.
#[test]
fn wings_decide_where_thrust_is_scarce_and_turns_lead_into_trunks() {
    let of = |list: &str, arm: &str, what: &str| {
        number("forest_scarce", &format!("{list}[arm={arm}]/{what}"))
    };
    let share = "in_band/share";
    let [drawn, away] = ["limited", "away"];
    assert!(of(drawn, "twcc_plus", &format!("{share}/value")) >= 0.7);
    assert!(of(drawn, "twcc_plus", "over_pc_plus/low") > 0.5, "wings");
    for arm in ["twcc_plus", "pc_plus"] {
        assert!(of(away, arm, &format!("{share}/low")) > 0.9, "{arm}: nothing to stop for");
    }
    assert!(of(away, "pc", &format!("{share}/high")) < 0.2);
}

/// Counts and ways of a few flights.
#[test]
fn a_forest_has_a_row_an_arm() {
    let arms = vec![Arm::TwccFlat, Arm::TwccPlus];
    let plan = Plan::calm(VehicleFile::squirrel(), arms, 8, 11);
    let study = &forest::run(&plan, 2.0, &Keep::default()).unwrap().unwrap();
    // `phantom` flies beside them.
    assert_eq!(study.rows.len(), 3);
    assert!(forest::words(study)[0].starts_with("twcc_flat"));
    for row in study.rows.iter().chain(&study.limited).chain(&study.away) {
        assert!(row.in_band.count <= row.through.count && row.ends.len() == 8);
        assert!(row.path_m <= 400.1 && row.displacement_m <= row.path_m, "{row:?}");
    }
    let ends = |rows: &[forest::Row]| {
        rows.iter().find(|row| row.arm == "twcc_plus").map(|row| row.ends.clone())
    };
    assert_eq!(ends(&study.rows), ends(&study.limited), "it has the limit in any case");
    assert_ne!(ends(&study.limited), ends(&study.away), "other sides");
}
