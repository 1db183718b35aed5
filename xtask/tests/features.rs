//! What only tests need asks no feature of a package that programs have without it: else cargo
//! compiles that package, and all that stands on it, once for tests and once more for programs.
#![allow(clippy::unwrap_used, reason = "tests")]

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

/// Every package with its features, of dependencies of these kinds.
fn packages(kinds: &str) -> BTreeSet<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let done = Command::new(env!("CARGO"))
        .args(["tree", "--workspace", "--locked", "--offline", "--prefix", "none"])
        .args(["--edges", kinds, "--format", "{p} [{f}]"])
        .current_dir(root)
        .output()
        .unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let text = String::from_utf8(done.stdout).unwrap();
    text.lines().map(|line| line.trim_end_matches(" (*)").to_owned()).collect()
}

#[test]
fn tests_ask_no_feature_of_what_programs_are_made_of() {
    // Not those of build scripts: the same package may be there with other features.
    let (programs, tests) = (packages("normal"), packages("normal,dev"));
    let others: Vec<&String> = programs.difference(&tests).collect();
    assert!(programs.len() > 100, "{programs:?}");
    assert!(others.is_empty(), "with other features in tests: {others:?}");
}
