//! The commands that write results, each in a folder of its own with two runs that differ in every
//! file, and what may stand there when something went wrong.

use super::{Folder, MAP, SQUIRREL};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// A command that writes into `out`.
pub(crate) struct Writer {
    pub(crate) folder: Folder,
    /// The arguments of what is run.
    pub(crate) new: Vec<&'static str>,
    /// Those of what was run before.
    pub(crate) old: Vec<&'static str>,
    /// Whether a file may be a part of the new one: a journal of what was flown.
    pub(crate) grows: fn(&str) -> bool,
}

fn never(_: &str) -> bool {
    false
}

impl Writer {
    fn of(folder: Folder, words: impl Fn(usize) -> Vec<&'static str>) -> Self {
        Self { folder, new: words(0), old: words(1), grows: never }
    }

    /// What a run leaves in an empty `out`.
    pub(crate) fn alone(&self, words: &[&str]) -> Files {
        let out = self.folder.0.join("out");
        let _ = fs::remove_dir_all(&out);
        fs::create_dir_all(&out).unwrap();
        self.folder.succeeds(words);
        files(&out)
    }

    pub(crate) fn fly(name: &str) -> Self {
        Self::of(Folder::new(name), |run| {
            let seed = ["1", "2"][run];
            ["fly", "--scenario", "track", "--seed", seed, "--out", "out/f.mcap", "--report"]
                .into_iter()
                .chain(["out/r.html", "--json", "out/f.json"])
                .collect()
        })
    }

    pub(crate) fn study(name: &str) -> Self {
        let study = |run: usize| {
            let seed = ["1", "2"][run];
            ["study", "faults", "--trials", "20", "--seed", seed, "--out", "out"].to_vec()
        };
        Self { grows: |name| name.ends_with(".trials.jsonl"), ..Self::of(Folder::new(name), study) }
    }

    pub(crate) fn import(name: &str) -> Self {
        let folder = Folder::new(name);
        folder.write("map.toml", MAP);
        for (name, first) in [("a.csv", 0), ("b.csv", 1)] {
            let rows = (0..20_000).map(|i| format!("{},{},2,3\n", f64::from(i) * 0.01, i + first));
            folder.write(name, &format!("t,gx,gy,gz\n{}", rows.collect::<String>()));
        }
        Self::of(folder, |run| {
            let file = ["a.csv", "b.csv"][run];
            let out = ["--out", "out/o.mcap", "--json", "out/o.json"];
            ["import", "--map", "map.toml", file].into_iter().chain(out).collect()
        })
    }

    pub(crate) fn train(name: &str) -> Self {
        let folder = Folder::new(name);
        folder.succeeds(&["fly", "--scenario", "excite_rich", "--arm", "pc", "--out", "f.mcap"]);
        Self::of(folder, |run| {
            let seed = ["1", "2"][run];
            ["train", "vanilla", "--flights", "f.mcap", "--epochs", "40", "--seed", seed, "--out"]
                .into_iter()
                .chain(["out/w.safetensors", "--report", "out/r.html"])
                .collect()
        })
    }

    pub(crate) fn gap(name: &str) -> Self {
        let folder = Folder::new(name);
        folder.write("v.toml", &SQUIRREL.replacen("parnn_weights", "# parnn_weights", 1));
        for (name, seed) in [("a.mcap", "1"), ("b.mcap", "2")] {
            folder.succeeds(&["fly", "--scenario", "track", "--seed", seed, "--out", name]);
        }
        Self::of(folder, |run| {
            let file = ["a.mcap", "b.mcap"][run];
            ["gap", "run", "--vehicle", "v.toml", "--flights", file, "--out", "out"].to_vec()
        })
    }
}

/// Files by name.
pub(crate) type Files = BTreeMap<String, Vec<u8>>;

/// Names and bytes of the files below a folder, but for what a kill leaves under names of nobody.
pub(crate) fn files(folder: &Path) -> Files {
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

/// Puts files into a folder, but for those that grow.
pub(crate) fn put(folder: &Path, all: &Files, grows: fn(&str) -> bool) {
    for (name, bytes) in all {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        if !grows(name) {
            fs::write(path, bytes).unwrap();
        }
    }
}

/// Every file of a folder is that of one of the runs whole, or a part of the last one's where it
/// grows; of those that were there before, the first run's, none is lost.
pub(crate) fn are_whole(folder: &Path, runs: &[&Files], grows: fn(&str) -> bool, after: &str) {
    let now = files(folder);
    for (name, bytes) in &now {
        let new = runs.last().and_then(|run| run.get(name));
        let is_part = grows(name) && new.is_some_and(|new| is_part_of(new, bytes));
        let is_whole = runs.iter().any(|run| run.get(name) == Some(bytes));
        assert!(is_whole || is_part, "{after}: {name} is neither");
    }
    let lost = runs[0].keys().find(|name| !grows(name) && !now.contains_key(*name));
    assert_eq!(lost, None, "{after}");
}

/// Whether a journal holds lines of another, in whatever order trials ended, and at most a part of
/// one at its end.
fn is_part_of(whole: &[u8], journal: &[u8]) -> bool {
    let lines: Vec<&[u8]> = whole.split(|byte| *byte == b'\n').collect();
    let mut own: Vec<&[u8]> = journal.split(|byte| *byte == b'\n').collect();
    let last = own.pop().unwrap_or_default();
    own.iter().all(|line| lines.contains(line)) && lines.iter().any(|line| line.starts_with(last))
}
