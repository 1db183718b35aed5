//! Killed at whatever moment: under every name stands the old file whole or the new one whole, and
//! the same command then goes through.
//!
//! `cargo xtask kill COUNT SEED` kills more often.
#![cfg(unix)]

use crate::support::{Folder, MAP, SQUIRREL};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

/// Kills of each command in a test; the chore takes more.
const KILLS_IN_TESTS: u64 = 12;
/// Of so many kills the last one is followed by the whole run.
const RESUMED_EVERY: u64 = 6;
/// The first moment of a kill, and the last one in doublings of it: from nothing to long after the
/// end, however busy the machine is.
const MOMENT: (Duration, f64) = (Duration::from_micros(300), 13.0);

/// A number that the chore sets.
fn asked(name: &str, default: u64) -> u64 {
    std::env::var(name).map_or(default, |text| text.parse().unwrap())
}

/// When the kth kill comes: moments are spread evenly over all orders of magnitude, however many
/// there are, and no two are the same.
fn moment(seed: u64, k: u64) -> Duration {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let (first, doublings) = MOMENT;
    let place = (GOLDEN * (1000.0 * seed as f64 + k as f64)).fract();
    first.mul_f64((doublings * place).exp2())
}

/// Names and bytes of the files below a folder, but for what a kill leaves under names of nobody.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut all = BTreeMap::new();
    let Ok(entries) = fs::read_dir(folder) else { return all };
    for entry in entries.map(Result::unwrap) {
        let name = entry.file_name().into_string().unwrap();
        if entry.path().is_dir() {
            let below = files(&entry.path());
            all.extend(below.into_iter().map(|(file, bytes)| (format!("{name}/{file}"), bytes)));
        } else if !name.starts_with(".squirrel") {
            all.insert(name, fs::read(entry.path()).unwrap());
        }
    }
    all
}

/// Whether a journal holds lines of another, in whatever order trials ended, and at most a part of
/// one at its end.
fn is_part_of(whole: &[u8], journal: &[u8]) -> bool {
    let lines: Vec<&[u8]> = whole.split(|byte| *byte == b'\n').collect();
    let mut own: Vec<&[u8]> = journal.split(|byte| *byte == b'\n').collect();
    let last = own.pop().unwrap_or_default();
    own.iter().all(|line| lines.contains(line)) && lines.iter().any(|line| line.starts_with(last))
}

/// Kills a command again and again, each time over the files of another run of it.
///
/// * `before` - makes the old files, of which each differs from the new one
/// * `grows` - whether a file may be a part of the new one: a journal of what was flown
fn is_killed(folder: &Folder, arguments: &[&str], before: &[&str], grows: fn(&str) -> bool) {
    let out = folder.0.join("out");
    let run = |words: &[&str]| {
        fs::create_dir_all(&out).unwrap();
        folder.succeeds(words);
        files(&out)
    };
    let new = run(arguments);
    fs::remove_dir_all(&out).unwrap();
    let old = run(before);
    let (kills, seed) =
        (asked("SQUIRREL_KILL_COUNT", KILLS_IN_TESTS), asked("SQUIRREL_KILL_SEED", 1));
    let mut killed = 0;
    for k in 0..kills {
        fs::remove_dir_all(&out).unwrap();
        for (name, bytes) in &old {
            let path = out.join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            if !grows(name) {
                fs::write(path, bytes).unwrap();
            }
        }
        let mut child = Command::new(env!("CARGO_BIN_EXE_squirrel"))
            .args(arguments)
            .current_dir(&folder.0)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(moment(seed, k));
        killed += u64::from(child.try_wait().unwrap().is_none());
        child.kill().unwrap();
        child.wait().unwrap();
        for (name, bytes) in files(&out) {
            let is_part = grows(&name) && new.get(&name).is_some_and(|new| is_part_of(new, &bytes));
            let is_whole = [&old, &new].iter().any(|all| all.get(&name) == Some(&bytes));
            assert!(is_whole || is_part, "{arguments:?}, kill {k}: {name} is neither");
        }
        if k % RESUMED_EVERY == RESUMED_EVERY - 1 || k + 1 == kills {
            assert_eq!(
                run(arguments),
                new,
                "{arguments:?}, kill {k}: does not go through after it"
            );
        }
    }
    #[allow(clippy::print_stdout, reason = "what the chore is run for")]
    {
        println!("{}: {killed} of {kills} kills while it ran", arguments[0]);
    }
    assert!(killed > 0, "{arguments:?}: always over before it could be killed");
}

fn never(_: &str) -> bool {
    false
}

#[test]
fn a_flight_that_was_killed_leaves_whole_files() {
    let folder = Folder::new("crash-fly");
    let fly = |seed| {
        ["fly", "--scenario", "track", "--seed", seed, "--out", "out/f.mcap", "--report"]
            .into_iter()
            .chain(["out/r.html", "--json", "out/f.json"])
            .collect::<Vec<_>>()
    };
    is_killed(&folder, &fly("1"), &fly("2"), never);
}

#[test]
fn a_study_that_was_killed_goes_on() {
    let folder = Folder::new("crash-study");
    let study =
        |seed| ["study", "faults", "--trials", "20", "--seed", seed, "--out", "out"].to_vec();
    is_killed(&folder, &study("1"), &study("2"), |name| name.ends_with(".trials.jsonl"));
}

#[test]
fn an_import_that_was_killed_leaves_whole_files() {
    let folder = Folder::new("crash-import");
    folder.write("map.toml", MAP);
    for (name, first) in [("a.csv", 0), ("b.csv", 1)] {
        let rows = (0..20_000).map(|i| format!("{},{},2,3\n", f64::from(i) * 0.01, i + first));
        folder.write(name, &format!("t,gx,gy,gz\n{}", rows.collect::<String>()));
    }
    let import =
        |file| ["import", "--map", "map.toml", file, "--out", "out/o.mcap", "--json", "out/o.json"];
    is_killed(&folder, &import("a.csv"), &import("b.csv"), never);
}

#[test]
fn a_training_that_was_killed_leaves_whole_files() {
    let folder = Folder::new("crash-train");
    folder.succeeds(&["fly", "--scenario", "excite_rich", "--arm", "pc", "--out", "f.mcap"]);
    let train = |seed| {
        ["train", "vanilla", "--flights", "f.mcap", "--epochs", "40", "--seed", seed, "--out"]
            .into_iter()
            .chain(["out/w.safetensors", "--report", "out/r.html"])
            .collect::<Vec<_>>()
    };
    is_killed(&folder, &train("1"), &train("2"), never);
}

#[test]
fn a_gap_run_that_was_killed_leaves_whole_files() {
    let folder = Folder::new("crash-gap");
    folder.write("v.toml", &SQUIRREL.replacen("parnn_weights", "# parnn_weights", 1));
    for (name, seed) in [("a.mcap", "1"), ("b.mcap", "2")] {
        folder.succeeds(&["fly", "--scenario", "track", "--seed", seed, "--out", name]);
    }
    let gap = |file| ["gap", "run", "--vehicle", "v.toml", "--flights", file, "--out", "out"];
    is_killed(&folder, &gap("a.mcap"), &gap("b.mcap"), never);
}
