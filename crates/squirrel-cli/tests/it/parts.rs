//! Studies that were flown in parts, or stopped by themselves, have the bytes of those in one go.

use crate::support::{Folder, SQUIRREL};
use std::fs;

const FILES: [&str; 4] = ["forest.csv", "forest.json", "forest.html", "forest.trials.jsonl"];
const STUDY: [&str; 5] = ["study", "forest", "--arms", "twcc_plus", "--out"];

fn same(folder: &Folder, one: &str, other: &str) {
    for name in FILES {
        let read = |of: &str| fs::read(folder.0.join(of).join(name)).unwrap();
        assert!(read(one) == read(other), "{name} of {one} and {other}");
    }
}

/// `examples/slurm/study.sh` as SLURM would start it.
#[cfg(unix)]
#[test]
fn an_array_of_slurm_jobs_is_the_whole_study() {
    let folder = Folder::new("parts-slurm");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/slurm/study.sh");
    let job = |number: u32, from: &str| {
        std::process::Command::new("sh")
            .args([script, "out", "forest", "--trials", "3", "--arms", "twcc_plus"])
            .current_dir(&folder.0)
            .env("SQUIRREL", env!("CARGO_BIN_EXE_squirrel"))
            .env("SLURM_ARRAY_TASK_ID", number.to_string())
            .envs([("SLURM_ARRAY_TASK_MIN", from), ("SLURM_ARRAY_TASK_MAX", "2")])
            .env("SLURM_ARRAY_TASK_COUNT", "2")
            .output()
            .unwrap()
    };
    let refused = job(0, "0");
    assert_eq!(refused.status.code(), Some(2));
    assert_eq!(String::from_utf8_lossy(&refused.stderr), "--array=0-2: must be 1-N\n");
    // The second one first, and one of them twice: it was sent again.
    for number in [2, 1, 2] {
        let done = job(number, "1");
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    }
    folder.succeeds(&["study", "merge", "out/part-1", "out/part-2", "--out", "merged"]);
    folder.succeeds(&[&STUDY[..], &["whole", "--trials", "3"]].concat());
    same(&folder, "merged", "whole");
}

#[test]
fn a_study_that_stops_itself_is_one_of_that_many_trials() {
    let folder = Folder::new("parts-until");
    let until =
        |out, most, percent| [&STUDY[..], &[out, "--trials", most, "--until", percent]].concat();
    // Of 16 trials shares are known to 22 points, differences to some more: 60 at once, 1 never.
    folder.succeeds(&until("wide", "40", "60%"));
    folder.succeeds(&[&STUDY[..], &["sixteen", "--trials", "16"]].concat());
    same(&folder, "wide", "sixteen");
    // Goes on from there, to the most that it may.
    folder.succeeds(&until("wide", "18", "1%"));
    folder.succeeds(&[&STUDY[..], &["sixteen", "--trials", "18"]].concat());
    same(&folder, "wide", "sixteen");
}

#[test]
fn a_stop_rule_that_cannot_be_is_one_line() {
    let folder = Folder::new("parts-rule");
    let words = [&STUDY[..], &["d", "--until", "5%"]].concat();
    folder.fails(&[&words[..], &["--shard", "1/2"]].concat(), &["--until: a part of a study"]);
    folder.fails(&["study", "forest", "--until", "5%"], &["--until: needs a folder", "--out"]);
    let wrong = folder.run(&["study", "forest", "--until", "5"]);
    assert_eq!(wrong.status.code(), Some(2));
    assert!(folder.succeeds(&["study", "forest", "--help"]).contains("with the sign, as 5%"));
}

#[test]
fn what_parts_differ_in_is_said() {
    let folder = Folder::new("parts-differ");
    for (out, shard, trials) in [("a", "1/2", "2"), ("b", "2/2", "2"), ("c", "2/2", "3")] {
        folder.succeeds(&[&STUDY[..], &[out, "--trials", trials, "--shard", shard]].concat());
    }
    folder.fails(
        &["study", "merge", "a", "c", "--out", "new"],
        &["c/forest.trials.jsonl: is flown with --trials=3 instead of --trials=2 of the first"],
    );
    folder.write("v.toml", &SQUIRREL.replacen("0.548", "0.549", 1));
    let merge = ["study", "merge", "a", "b", "--out", "new"];
    let output = folder.run(&[&merge[..], &["--vehicle", "v.toml"]].concat());
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(stderr.contains("--vehicle must be what they were flown with"), "{stderr}");
    assert!(!stderr.contains("new"), "what is not there is not to blame: {stderr}");
}
