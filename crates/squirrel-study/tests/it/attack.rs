//! Journals of studies under mutation: none ends the program, none that was changed is gone on
//! from, and what is refused is so in one line.
//!
//! `cargo xtask attack COUNT SEED` runs more of it.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use squirrel_core::stack::wire::{HASH_START, hash};
use squirrel_sim::flight::FlightError;
use squirrel_study::journal::{Journal, Keep};
use squirrel_study::merge::merge;
use std::fs;
use std::path::{Path, PathBuf};

/// Journals in a test, for seconds; the chore takes more.
const COUNT_IN_TESTS: u64 = 300;
const TRIALS: u32 = 6;
/// What parts of lines become.
const ENDS: [&str; 8] =
    ["-1", "4294967296", "1e999", "null", "\"\"", "{\"a\":", "\u{0}", "[[[[[[[["];

type Outcome = (f64, Vec<Option<f64>>);

fn fly(trial: u32) -> Outcome {
    (1.0 / f64::from(trial + 1), vec![Some(f64::from(trial)), None])
}

/// The results of a study whose trials are kept in a folder.
fn study(folder: &Path) -> Result<Option<Vec<Outcome>>, FlightError> {
    let command = ["a".to_owned(), "study".to_owned()];
    let keep = Keep { folder: Some(folder), command: &command, ..Keep::default() };
    Journal::open(&keep, "s", "a plan of six")?.run(TRIALS, |trial| Ok(fly(trial)))
}

fn changed(good: &[u8], rng: &mut Pcg64Mcg) -> Vec<u8> {
    let mut bytes = good.to_vec();
    for _ in 0..rng.random_range(1..3) {
        let at = rng.random_range(0..bytes.len().max(1)).min(bytes.len());
        let end = (at + rng.random_range(1..40)).min(bytes.len());
        match rng.random_range(0..7) {
            0 if at < end => bytes[at] ^= 1 << rng.random_range(0..8),
            1 => bytes.truncate(at),
            2 => drop(bytes.drain(at..end)),
            3 => {
                let part = bytes[at..end].to_vec();
                bytes.splice(at..at, part);
            }
            4 => drop(bytes.splice(at..end, ENDS[rng.random_range(0..ENDS.len())].bytes())),
            _ => {
                // One who means harm writes the hash anew.
                let text = String::from_utf8_lossy(&bytes).into_owned();
                let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
                if lines.is_empty() {
                    continue;
                }
                let number = rng.random_range(0..lines.len());
                lines[number] = forged(&lines[number], rng);
                bytes = (lines.join("\n") + "\n").into_bytes();
            }
        }
    }
    bytes
}

/// A line with something else in it, and a hash that fits.
fn forged(line: &str, rng: &mut Pcg64Mcg) -> String {
    let Some((open, _)) = line.rsplit_once(",\"hash\":\"") else { return line.to_owned() };
    let mut open = open.to_owned();
    let at = rng.random_range(0..open.len().max(1)).min(open.len());
    if open.is_char_boundary(at) {
        open.insert_str(at, ENDS[rng.random_range(0..ENDS.len())]);
    }
    let sum = hash(HASH_START, open.as_bytes());
    format!("{open},\"hash\":\"{sum:016x}\"}}")
}

#[test]
fn no_mutated_journal_ends_a_study() {
    let number = |name: &str, default: u64| {
        std::env::var(name).map_or(default, |text| text.parse().unwrap())
    };
    let count = number("SQUIRREL_ATTACK_COUNT", COUNT_IN_TESTS);
    let mut rng = Pcg64Mcg::seed_from_u64(number("SQUIRREL_ATTACK_SEED", 1));
    let below = |name: &str| {
        let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("attack-journal").join(name);
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        folder
    };
    let [one, other, merged] = ["one", "other", "merged"].map(below);
    let journal = one.join("s.trials.jsonl");
    let wanted = study(&one).unwrap();
    let good = fs::read(&journal).unwrap();
    fs::copy(&journal, other.join("s.trials.jsonl")).unwrap();
    let known: Vec<&[u8]> = good.split(|byte| *byte == b'\n').collect();
    let (mut taken, mut refused) = (0, 0);
    for k in 0..count {
        let bytes = changed(&good, &mut rng);
        // What follows the last line feed was cut off, and is flown again.
        let end = bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |at| at + 1);
        let is_forged =
            !bytes[..end].split(|byte| *byte == b'\n').all(|line| known.contains(&line));
        fs::write(&journal, &bytes).unwrap();
        let found = if k % 2 == 0 {
            study(&one).map(|found| {
                if !is_forged {
                    assert_eq!(found, wanted);
                }
            })
        } else {
            let _ = fs::remove_file(merged.join("s.trials.jsonl"));
            merge(&[other.clone(), one.clone()], &merged).map(drop)
        };
        match found {
            Ok(()) => taken += 1,
            Err(error) => {
                refused += 1;
                let error = error.to_string();
                assert!(!error.contains('\n') && !error.is_empty(), "{error}");
            }
        }
    }
    assert!(taken > 0 && refused > count / 4, "{taken} taken, {refused} refused of {count}");
}
