//! Files are opened, written and locked in one place, `crates/squirrel-log/src/files/`: what it
//! promises (limits, whole files, modes, links) holds for whatever the program does.
#![allow(clippy::unwrap_used, reason = "tests")]

mod repository;

use repository::{crates, product, products, root};
use std::fs;

/// What opens, makes or replaces a file past that place.
const PAST_IT: [&str; 10] = [
    "File::create",
    "File::open",
    "File::options",
    "fs::OpenOptions",
    "OpenOptions::new",
    "fs::write",
    "fs::read(",
    "fs::read_to_string",
    "fs::rename",
    "fs::copy",
];

/// Sources that are compiled into tests alone.
const OF_TESTS: [&str; 1] = ["crates/squirrel-sim/src/plant/membrane/measured.rs"];

/// Whether a line names something, and not the end of a longer name.
fn names(line: &str, call: &str) -> bool {
    let is_of_a_name = |c: char| c.is_alphanumeric() || c == '_';
    line.match_indices(call).any(|(at, _)| !line[..at].ends_with(is_of_a_name))
}

/// Lines of a source that go past it.
fn past_it(text: &str) -> Vec<String> {
    let lines = product(text).into_iter().enumerate();
    let goes = |line: &str| PAST_IT.iter().any(|call| names(line, call));
    let found = lines.filter(|(_, line)| goes(line));
    found.map(|(i, line)| format!("{}: {}", i + 1, line.trim())).collect()
}

#[test]
fn no_product_opens_or_writes_a_file_past_the_one_place() {
    let place = root().join("crates/squirrel-log/src/files");
    let (mut found, mut inside) = (Vec::new(), 0);
    for source in crates().iter().flat_map(|package| products(&package.join("src"))) {
        let path = source.strip_prefix(root()).unwrap();
        if OF_TESTS.iter().any(|known| path.ends_with(known)) {
            continue;
        }
        let lines = past_it(&fs::read_to_string(&source).unwrap());
        if source.starts_with(&place) {
            inside += lines.len();
        } else {
            found.extend(lines.iter().map(|line| format!("{}:{line}", path.display())));
        }
    }
    assert!(inside > 3, "only {inside} calls in the one place");
    assert!(found.is_empty(), "ask squirrel_log::files instead:\n{}", found.join("\n"));
}

#[test]
fn a_call_past_it_is_seen_and_a_tests_own_is_none() {
    let text = "fn a() { std::fs::write(p, b); CsvFile::open(p); } // fs::rename\n#[cfg(test)]\nmod tests { fn b() { fs::read(p); } }";
    assert_eq!(past_it(text), ["1: fn a() { std::fs::write(p, b); CsvFile::open(p); }"]);
}
