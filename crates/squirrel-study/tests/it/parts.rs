//! Studies that were stopped, flown on other numbers of threads, or in parts that were merged,
//! leave the same bytes.

use squirrel_core::stack::wire;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::FlightError;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_study::campaign::Plan;
use squirrel_study::journal::{self, Journal, Keep, Part};
use squirrel_study::merge::merge;
use squirrel_study::study::{Arms, Study};
use squirrel_study::{STUDIES, forest, table3, thrust};
use std::fs;
use std::path::{Path, PathBuf};

fn plan(trials: u32) -> Plan {
    Plan::calm(VehicleFile::squirrel(), vec![Arm::Pc, Arm::TwccPlus], trials, 5)
}

/// Studies with so many cells that one trial of each is plenty.
const WIDE: [&str; 3] = ["rivals", "steering", "wind"];

/// A study's result as JSON, where it has one: with as little to do as there can be.
fn fly(study: &Study, keep: &Keep<'_>) -> Result<Option<String>, FlightError> {
    let mut plan = plan(if WIDE.contains(&study.name) { 1 } else { 2 });
    if let Arms::Fixed(arms) = study.arms {
        plan.arms = arms.to_vec();
    }
    let options: Vec<f64> =
        study.options.iter().map(|o| if o.whole { 1.0 } else { o.default }).collect();
    Ok((study.fly)(&plan, &options, keep)?.map(|found| found.json))
}

/// A folder that is gone afterwards.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let folder =
            std::env::temp_dir().join(format!("squirrel-parts-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }

    fn below(&self, name: &str) -> PathBuf {
        let folder = self.0.join(name);
        fs::create_dir_all(&folder).unwrap();
        folder
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Names and bytes of all journals in a folder.
fn journals(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut all: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap())
        .map(|entry| (entry.file_name().into_string().unwrap(), fs::read(entry.path()).unwrap()))
        .collect();
    all.sort();
    all
}

#[test]
fn stopped_threaded_and_merged_studies_leave_the_same_bytes() {
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let command = ["a".to_owned(), "study".to_owned()];
    for known in STUDIES {
        let (name, study) = (known.name, |keep: &Keep<'_>| fly(known, keep));
        let folder = Folder::new(name);
        let keep = |folder, part| Keep {
            folder: Some(folder),
            part,
            command: &command,
            ..Keep::default()
        };
        let whole = folder.below("whole");
        let result = pool(2).install(|| study(&keep(&whole, Part::All))).unwrap();
        assert!(result.is_some(), "{name}");
        if !WIDE.contains(&name) {
            assert_eq!(study(&Keep::default()).unwrap(), result, "{name}: kept nowhere");
        }

        // Stopped in the middle of a line, and gone on with one thread.
        let stopped = folder.below("stopped");
        for (file, bytes) in journals(&whole) {
            fs::write(stopped.join(file), &bytes[..bytes.len() / 10 * 8]).unwrap();
        }
        assert_eq!(
            pool(1).install(|| study(&keep(&stopped, Part::All))).unwrap(),
            result,
            "{name}: stopped"
        );
        assert_eq!(journals(&stopped), journals(&whole), "{name}: stopped");

        let parts: Vec<PathBuf> = (1..=4).map(|k| folder.below(&format!("part{k}"))).collect();
        for (k, part) in parts.iter().enumerate() {
            let shard = format!("{}/4", k + 1).parse().unwrap();
            assert_eq!(
                study(&keep(part, Part::Shard(shard))).unwrap(),
                None,
                "{name}: a part has no result"
            );
        }
        let merged = folder.below("merged");
        assert_eq!(merge(&parts, &merged).unwrap(), command);
        assert_eq!(study(&keep(&merged, Part::Merged)).unwrap(), result, "{name}: merged");
        assert_eq!(journals(&merged), journals(&whole), "{name}: merged");

        // Without one of them the missing trial is named.
        let three = folder.below("three");
        merge(&parts[1..], &three).unwrap();
        let error = study(&keep(&three, Part::Merged)).unwrap_err().to_string();
        assert!(
            error.contains("flight = 0: missing, in none of the merged folders"),
            "{name}: {error}"
        );
    }
}

/// More trials than before: the parts say so, and the whole has them all. Other weights: another
/// plan. What cannot be flown leaves nothing.
#[test]
fn a_study_that_changes_does_not_go_on_as_it_was() {
    let folder = Folder::new("changed");
    let parts: Vec<PathBuf> = (1..=2).map(|k| folder.below(&format!("part{k}"))).collect();
    for trials in [1, 2] {
        let command = ["thrust".to_owned(), format!("--trials={trials}")];
        for (k, part) in parts.iter().enumerate() {
            let part = Keep {
                folder: Some(part),
                part: Part::Shard(format!("{}/2", k + 1).parse().unwrap()),
                command: &command,
                ..Keep::default()
            };
            thrust::run(&plan(trials), &part).unwrap();
        }
    }
    let merged = folder.below("merged");
    assert_eq!(merge(&parts, &merged).unwrap(), ["thrust", "--trials=2"]);
    let whole = Keep { folder: Some(&merged), part: Part::Merged, ..Keep::default() };
    assert_eq!(thrust::run(&plan(2), &whole).unwrap().unwrap().trials, 2);

    let kept = Keep { folder: Some(&merged), ..Keep::default() };
    let other =
        VehicleFile::parse(&plan(1).vehicle.text.replace("parnn_weights", "# parnn_weights"), "v")
            .unwrap();
    let mut changed = plan(2);
    changed.vehicle.weights = other.weights;
    let error = thrust::run(&changed, &kept).unwrap_err().to_string();
    assert!(error.contains("is of another plan"), "{error}");

    // Another commit of the program, of the same version.
    let flown = folder.below("flown");
    let by = |commit| Keep { folder: Some(&flown), commit: Some(commit), ..Keep::default() };
    thrust::run(&plan(1), &by("1f0a")).unwrap();
    thrust::run(&plan(1), &by("1f0a")).unwrap();
    let error = thrust::run(&plan(1), &by("2f0a")).unwrap_err().to_string();
    assert!(error.contains("is of another plan") && error.contains("commit 1f0a"), "{error}");

    let empty = folder.below("empty");
    let nothing = Keep { folder: Some(&empty), ..Keep::default() };
    assert!(forest::run(&plan(1), 0.5, &nothing).is_err());
    let mut bare = plan(1);
    bare.vehicle.control = None;
    assert!(table3::run(&bare, &nothing).is_err());
    assert!(
        thrust::run(&plan(100_001), &nothing)
            .unwrap_err()
            .to_string()
            .starts_with("trials = 100001")
    );
    assert!(journals(&empty).is_empty(), "what cannot be flown is not begun");
}

#[test]
fn a_damaged_line_is_named() {
    let folder = Folder::new("damaged");
    let keep = Keep { folder: Some(&folder.0), ..Keep::default() };
    table3::run(&plan(1), &keep).unwrap();
    let file = folder.0.join("table3.trials.jsonl");
    let text = fs::read_to_string(&file).unwrap();
    let damage = |from: &str, to: &str| {
        fs::write(&file, text.replacen(from, to, 1)).unwrap();
        table3::run(&plan(1), &keep).unwrap_err().to_string()
    };
    // Every single digit counts.
    let changed = "table3.trials.jsonl: line 2: has changed since it was written";
    for (from, to) in [("\"rmse_m\":", "\"rmse_m\":1"), ("\"trial\":0", "\"trial\":7")] {
        let error = damage(from, to);
        assert!(error.contains(changed), "{error}");
    }
    let error = damage("\"format\":2", "\"format\":1");
    assert!(error.contains("is of format 1, this version writes and reads 2"), "{error}");
    // Lines with a right hash that hold something else.
    let replaced = |from: &str, to: &str| {
        let lines = text.lines().enumerate().map(|(i, line)| {
            if i == 0 { line.to_owned() } else { hashed(&line.replacen(from, to, 1)) }
        });
        let lines: Vec<String> = lines.collect();
        fs::write(&file, lines.join("\n") + "\n").unwrap();
        table3::run(&plan(1), &keep).unwrap_err().to_string()
    };
    let error = replaced("\"rmse_m\":", "\"rmse_m\":NaN,\"x\":");
    assert!(error.contains("table3.trials.jsonl: line 2, from its begin:"), "{error}");
    let error = replaced("\"rmse_m\":", "\"rsme_m\":");
    assert!(error.contains("{\"trial\":0...: missing field `rmse_m`"), "{error}");
}

/// A line of a journal with the hash of what it says now.
fn hashed(line: &str) -> String {
    let open = line.split_once(",\"hash\":").unwrap().0;
    let hash = wire::hash(wire::HASH_START, open.as_bytes());
    format!("{open},\"hash\":\"{hash:016x}\"}}")
}

/// Two at a time would each delete what the other has flown.
#[test]
fn one_program_at_a_time_has_a_study_of_a_folder() {
    let folder = Folder::new("locked");
    let keep = Keep { folder: Some(&folder.0), ..Keep::default() };
    let first = Journal::open(&keep, "table3", "a plan").unwrap();
    let refused = |name| Journal::open(&keep, name, "a plan").unwrap_err().to_string();
    for name in ["table3", "thrust"] {
        let error = refused(name);
        assert!(error.contains("another squirrel is writing into this folder"), "{error}");
    }
    drop(first);
    drop(Journal::open(&keep, "table3", "a plan").unwrap());
    let lock = journal::locked(&folder.0).unwrap();
    assert!(refused("table3").contains("another squirrel"));
    // Who has locked it writes.
    drop(Journal::open(&Keep { lock: Some(&lock), ..keep }, "table3", "a plan").unwrap());
}

#[test]
fn what_cannot_be_merged_is_named() {
    let folder = Folder::new("wrong");
    let (one, other, into) = (folder.below("one"), folder.below("other"), folder.below("into"));
    let command = ["thrust".to_owned()];
    let fly = |folder: &Path, trials| {
        let keep =
            Keep { folder: Some(folder), part: Part::All, command: &command, ..Keep::default() };
        thrust::run(&Plan { seed: u64::from(trials), ..plan(trials) }, &keep).unwrap();
    };
    let error = |folders: &[PathBuf]| merge(folders, &into).unwrap_err().to_string();
    assert!(error(std::slice::from_ref(&one)).contains("one: holds no part of a study"));
    fly(&one, 1);
    fly(&other, 2);
    let both = [one.clone(), other.clone()];
    assert!(error(&both).contains("is of another plan"), "{}", error(&both));
    assert!(journals(&into).is_empty(), "nothing is half merged");
    let file = "thrust.trials.jsonl";
    let text = fs::read_to_string(one.join(file)).unwrap();
    let (head, lines) = text.split_once('\n').unwrap();
    let line = hashed(&lines.lines().next().unwrap().replacen("\"rmse_m\":", "\"rmse_m\":1", 1));
    fs::write(other.join(file), format!("{head}\n{line}\n")).unwrap();
    assert!(
        error(&both).contains("flight = 0: has another result in another folder"),
        "{}",
        error(&both)
    );
    fs::write(other.join(file), "").unwrap();
    assert!(error(&both).contains("thrust.trials.jsonl: holds nothing"));
    for bad in ["0/4", "5/4", "4", "a/b", "1/0"] {
        assert!(bad.parse::<squirrel_study::journal::Shard>().is_err(), "{bad}");
    }
    let keep = Keep { part: Part::Shard("1/2".parse().unwrap()), ..Keep::default() };
    assert!(
        thrust::run(&plan(1), &keep).unwrap_err().to_string().starts_with("shard: needs a folder")
    );
}

/// No byte of a journal can be changed without being noticed, and none ends the program: what is
/// not refused leaves the bytes that it would have left.
#[test]
fn no_changed_byte_of_a_journal_is_taken_for_a_result() {
    let folder = Folder::new("attack");
    let keep = Keep { folder: Some(&folder.0), ..Keep::default() };
    let open = || Journal::open(&keep, "few", "a plan");
    let run = |journal: &Journal<'_>| journal.run(8, |trial| Ok([f64::from(trial) / 7.0, -1.5]));
    let whole = run(&open().unwrap()).unwrap();
    let file = folder.0.join("few.trials.jsonl");
    let good = fs::read(&file).unwrap();
    let mut refused = 0;
    for at in 0..good.len() {
        for flip in [0x01, 0x10, 0x80] {
            let mut bytes = good.clone();
            bytes[at] ^= flip;
            fs::write(&file, &bytes).unwrap();
            match open().and_then(|journal| run(&journal)) {
                Ok(flown) => assert_eq!(flown, whole, "byte {at}"),
                Err(error) => {
                    refused += 1;
                    assert!(!error.to_string().contains('\n'), "{error}");
                }
            }
        }
        fs::write(&file, &good[..at]).unwrap();
        assert_eq!(run(&open().unwrap()).unwrap(), whole, "cut at {at}");
        assert_eq!(fs::read(&file).unwrap(), good, "cut at {at}");
    }
    assert!(refused > good.len(), "{refused}");
}
