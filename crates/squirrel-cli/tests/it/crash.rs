//! Killed at whatever moment: under every name stands the old file whole or the new one whole, and
//! the same command then goes through.
//!
//! `cargo xtask kill COUNT SEED` kills more often.
#![cfg(unix)]

use crate::support::writers::{Writer, are_whole, files, put};
use std::fs;
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

/// Kills a command again and again, each time over the files of another run of it.
fn is_killed(writer: &Writer) {
    let Writer { folder, new: arguments, old: before, grows } = writer;
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
        put(&out, &old, *grows);
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
        are_whole(&out, &[&old, &new], *grows, &format!("{arguments:?}, kill {k}"));
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

#[test]
fn a_flight_that_was_killed_leaves_whole_files() {
    is_killed(&Writer::fly("crash-fly"));
}

#[test]
fn a_study_that_was_killed_goes_on() {
    is_killed(&Writer::study("crash-study"));
}

#[test]
fn an_import_that_was_killed_leaves_whole_files() {
    is_killed(&Writer::import("crash-import"));
}

#[test]
fn a_training_that_was_killed_leaves_whole_files() {
    is_killed(&Writer::train("crash-train"));
}

#[test]
fn a_gap_run_that_was_killed_leaves_whole_files() {
    is_killed(&Writer::gap("crash-gap"));
}
