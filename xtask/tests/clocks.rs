//! No test asks a clock: on a busy machine it would fail without anything being wrong. Tests count
//! work, benches measure time.
#![allow(clippy::unwrap_used, reason = "tests")]

mod repository;

use repository::{files, root};
use std::fs;
use std::path::Path;

/// Where sources are.
const FOLDERS: [&str; 5] = ["crates", "tests", "examples", "xtask", "firmware"];
/// What asks a clock, in Rust and in Python.
const CLOCKS: [&str; 7] = [
    "Instant::now",
    "SystemTime::now",
    ".elapsed()",
    "perf_counter",
    "process_time",
    "monotonic(",
    "time.time(",
];

/// The first line that is a test's: of a file in a folder `tests` of a package the first, of
/// another the one that begins its module of tests.
fn first_line_of_tests(path: &Path, text: &str) -> Option<usize> {
    let inside = path
        .components()
        .skip(1)
        .any(|part| ["tests", "tests.rs"].iter().any(|name| part.as_os_str() == *name));
    if inside { Some(0) } else { text.lines().position(|line| line.trim() == "#[cfg(test)]") }
}

/// File, line and text of each clock that a test of this file asks.
fn clocks(path: &Path, text: &str) -> Vec<String> {
    let Some(first) = first_line_of_tests(path, text) else { return Vec::new() };
    let lines = text.lines().enumerate().skip(first);
    let asks = lines.filter(|(_, line)| CLOCKS.iter().any(|clock| line.contains(clock)));
    asks.map(|(i, line)| format!("{}:{}: {}", path.display(), i + 1, line.trim())).collect()
}

#[test]
fn no_test_asks_a_clock() {
    let root = root();
    let files: Vec<_> =
        FOLDERS.iter().flat_map(|folder| files(&root.join(folder), &["rs", "py"])).collect();
    let own = root.join("xtask/tests/clocks.rs");
    let (mut asked, mut tests) = (Vec::new(), 0);
    for file in files.iter().filter(|file| **file != own) {
        let (path, text) = (file.strip_prefix(root).unwrap(), fs::read_to_string(file).unwrap());
        tests += usize::from(first_line_of_tests(path, &text).is_some());
        asked.extend(clocks(path, &text));
    }
    assert!(tests > 100, "only {tests} files with tests found");
    assert!(asked.is_empty(), "count work instead, and time it in a bench:\n{}", asked.join("\n"));
}

#[test]
fn clocks_of_tests_are_told_from_those_of_the_product() {
    let text = "fn work() { Instant::now(); }\n#[cfg(test)]\nmod tests {\n    fn f() { begin.elapsed(); }\n}\n";
    let of = |path: &str| clocks(Path::new(path), text).len();
    assert_eq!(of("tests/hidden-effects/src/ask.rs"), 1);
    assert_eq!(of("crates/a/tests/b.rs"), 2);
    assert_eq!(of("crates/a/src/b/tests.rs"), 2);
    let found = clocks(Path::new("crates/a/tests/c.py"), "\n    start = time.process_time()\n");
    assert_eq!(found, ["crates/a/tests/c.py:2: start = time.process_time()"]);
}
