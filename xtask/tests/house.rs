//! The house stands as `docs/ARCHITECTURE.md` says: what the page names exists, the crates are all
//! on it, and dependencies point downwards only.
#![allow(clippy::unwrap_used, reason = "tests")]

mod repository;

use repository::{files, root};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// Which of our crates a crate may depend on, top down.
const ARROWS: [(&str, &[&str]); 14] = [
    (
        "squirrel-examples",
        &[
            "squirrel-study",
            "squirrel-gap",
            "squirrel-plan",
            "squirrel-sim",
            "squirrel-report",
            "squirrel-log",
            "squirrel-core",
        ],
    ),
    ("hidden-effects", &["squirrel-core", "squirrel-sim", "squirrel-log"]),
    (
        "squirrel-py",
        &[
            "squirrel-batch",
            "squirrel-cli",
            "squirrel-study",
            "squirrel-gap",
            "squirrel-nn",
            "squirrel-plan",
            "squirrel-sim",
            "squirrel-report",
            "squirrel-log",
            "squirrel-core",
        ],
    ),
    (
        "squirrel-cli",
        &[
            "squirrel-study",
            "squirrel-gap",
            "squirrel-nn",
            "squirrel-plan",
            "squirrel-sim",
            "squirrel-report",
            "squirrel-log",
            "squirrel-core",
        ],
    ),
    (
        "squirrel-study",
        &[
            "squirrel-gap",
            "squirrel-nn",
            "squirrel-plan",
            "squirrel-sim",
            "squirrel-report",
            "squirrel-log",
            "squirrel-core",
        ],
    ),
    ("squirrel-gap", &["squirrel-sim", "squirrel-report", "squirrel-log", "squirrel-core"]),
    ("squirrel-nn", &["squirrel-sim", "squirrel-log", "squirrel-core"]),
    ("squirrel-plan", &["squirrel-sim", "squirrel-report", "squirrel-log", "squirrel-core"]),
    ("squirrel-batch", &["squirrel-sim", "squirrel-core"]),
    ("squirrel-sim", &["squirrel-log", "squirrel-core", "squirrel-vehicles"]),
    ("squirrel-report", &["squirrel-log"]),
    ("squirrel-log", &["squirrel-core", "squirrel-vehicles"]),
    ("squirrel-core", &[]),
    ("squirrel-vehicles", &[]),
];

/// Foreign crates that only some of ours may depend on; tests and benches may use any.
const KEPT_IN: [(&str, &[&str]); 8] = [
    ("rapier3d-f64", &["squirrel-sim"]),
    ("mcap", &["squirrel-log"]),
    ("parquet", &["squirrel-log"]),
    ("glam", &[]),
    ("glamx", &[]),
    ("clap", &["squirrel-cli"]),
    ("clarabel", &["squirrel-plan"]),
    ("pyo3", &["squirrel-py"]),
];

fn page() -> String {
    fs::read_to_string(root().join("docs/ARCHITECTURE.md")).unwrap()
}

fn folders(path: &Path) -> BTreeSet<String> {
    let entries = fs::read_dir(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let folders = entries.map(Result::unwrap).filter(|entry| entry.path().is_dir());
    folders.map(|entry| entry.file_name().into_string().unwrap()).collect()
}

/// What stands in backticks and is a path, with the folder that the heading above it names.
fn named_paths(page: &str) -> Vec<(String, String)> {
    let mut base = String::new();
    let mut paths = Vec::new();
    for line in page.lines() {
        let quoted =
            line.split('`').skip(1).step_by(2).filter(|text| is_path(text)).map(str::to_owned);
        if line.starts_with('#') {
            base = quoted.last().unwrap_or_default();
            paths.push((String::new(), base.clone()));
        } else {
            paths.extend(quoted.map(|path| (base.clone(), path)));
        }
    }
    paths
}

/// A path has a slash or the ending of a file of ours; commands and code have spaces, brackets or
/// colons.
fn is_path(text: &str) -> bool {
    let ending = [".rs", ".toml", ".md", ".css", ".js"].iter().any(|ending| text.ends_with(ending));
    (ending || text.contains('/')) && !text.contains([' ', '<', '(', '[', ':', '*'])
}

/// Normal and build dependencies of a manifest, for any platform, by the names of their packages.
fn dependencies(manifest: &str) -> BTreeSet<String> {
    let manifest: toml::Table = manifest.parse().unwrap();
    let platforms = manifest.get("target").and_then(toml::Value::as_table);
    let platforms =
        platforms.into_iter().flat_map(|t| t.values()).filter_map(toml::Value::as_table);
    let mut names = BTreeSet::new();
    for table in std::iter::once(&manifest).chain(platforms) {
        for kind in ["dependencies", "build-dependencies"] {
            for (key, value) in
                table.get(kind).and_then(toml::Value::as_table).into_iter().flatten()
            {
                names.insert(
                    value.get("package").and_then(toml::Value::as_str).unwrap_or(key).to_owned(),
                );
            }
        }
    }
    names
}

/// What is wrong with the dependencies of one of our crates.
fn upward_arrows(package: &str, manifest: &str) -> Vec<String> {
    let Some((_, allowed)) = ARROWS.iter().find(|(name, _)| *name == package) else {
        return vec![format!("{package} has no place among the arrows")];
    };
    let wrong = |name: &String| {
        let ours = name.starts_with("squirrel-") && !allowed.contains(&name.as_str());
        let foreign = KEPT_IN.iter().any(|(kept, homes)| kept == name && !homes.contains(&package));
        ours || foreign
    };
    dependencies(manifest)
        .into_iter()
        .filter(wrong)
        .map(|name| format!("{package} -> {name}"))
        .collect()
}

#[test]
fn every_path_on_the_page_exists() {
    let root = root();
    let paths = named_paths(&page());
    assert!(paths.len() > 20, "only {} paths found", paths.len());
    let gone: Vec<_> =
        paths.iter().filter(|(base, path)| !root.join(base).join(path).exists()).collect();
    assert!(gone.is_empty(), "named in docs/ARCHITECTURE.md, not in the repository: {gone:?}");
}

#[test]
fn every_crate_and_every_room_of_core_and_sim_is_on_the_page() {
    let root = root();
    let named: BTreeSet<String> = named_paths(&page())
        .iter()
        .map(|(base, path)| Path::new(base).join(path).display().to_string())
        .collect();
    let mut rooms: BTreeSet<String> =
        folders(&root.join("crates")).iter().map(|name| format!("crates/{name}")).collect();
    for package in [
        "crates/squirrel-core",
        "crates/squirrel-log",
        "crates/squirrel-report",
        "crates/squirrel-sim",
        "crates/squirrel-batch",
    ] {
        rooms.extend(
            folders(&root.join(package).join("src"))
                .iter()
                .map(|room| format!("{package}/src/{room}/")),
        );
    }
    let missing: Vec<_> = rooms.difference(&named).collect();
    assert!(missing.is_empty(), "not in docs/ARCHITECTURE.md: {missing:?}");
}

#[test]
fn dependencies_point_downwards() {
    let crates = root().join("crates");
    let others = [
        ("tests/hidden-effects", "hidden-effects"),
        ("examples", "squirrel-examples"),
        ("vehicles", "squirrel-vehicles"),
    ];
    let packages = folders(&crates).into_iter().map(|name| (crates.join(&name), name));
    let wrong: Vec<String> = packages
        .chain(others.map(|(path, name)| (root().join(path), name.to_owned())))
        .flat_map(|(path, name)| {
            upward_arrows(&name, &fs::read_to_string(path.join("Cargo.toml")).unwrap())
        })
        .collect();
    assert!(wrong.is_empty(), "{wrong:?}");
    let own = dependencies(include_str!("../Cargo.toml"));
    assert!(own.is_empty(), "xtask must start on a fresh machine without a download: {own:?}");
}

#[test]
fn rapier_stays_in_its_room() {
    let root = root();
    let world = root.join("crates/squirrel-sim/src/world");
    let mut speakers = 0;
    for file in files(&root.join("crates"), &["rs"]) {
        let text = fs::read_to_string(&file).unwrap();
        assert!(!text.contains("glam::"), "{}: glam; nalgebra is our mathematics", file.display());
        if text.contains("rapier3d_f64") {
            assert!(file.starts_with(&world), "{}: rapier outside of sim/world", file.display());
            let converts = text.contains("rapier3d_f64::math");
            assert!(
                !converts || file.ends_with("convert.rs"),
                "{}: rapier's vectors outside of convert.rs",
                file.display()
            );
            speakers += usize::from(converts);
        }
    }
    assert_eq!(speakers, 1, "files that translate between nalgebra and rapier");
}

#[test]
fn wrong_arrows_are_seen() {
    let upwards = "[dependencies]\nsquirrel-gap.workspace = true\nnalgebra = \"0.35\"";
    assert_eq!(upward_arrows("squirrel-sim", upwards), ["squirrel-sim -> squirrel-gap"]);
    let renamed =
        "[target.'cfg(unix)'.dependencies]\nfast = { package = \"glam\", version = \"0.33\" }";
    assert_eq!(upward_arrows("squirrel-sim", renamed), ["squirrel-sim -> glam"]);
    let oracle = "[dependencies]\nclap = \"4\"\n[dev-dependencies]\nclarabel = \"0.11\"";
    assert_eq!(upward_arrows("squirrel-core", oracle), ["squirrel-core -> clap"]);
    assert_eq!(upward_arrows("squirrel-new", ""), ["squirrel-new has no place among the arrows"]);
}

#[test]
fn paths_are_told_from_code() {
    let page = "# `crates/a`\n`src/x/`, `cargo run --release`, `Vec::new()`, `[effects.<name>]`, `World`\n## b\n`lib.rs`";
    let found = named_paths(page);
    let expected = [("", "crates/a"), ("crates/a", "src/x/"), ("", ""), ("", "lib.rs")];
    assert_eq!(found, expected.map(|(base, path)| (base.to_owned(), path.to_owned())));
}

#[test]
fn the_port_that_is_shown_is_the_port_that_is_compiled() {
    let read = |path: &str| fs::read_to_string(root().join(path)).unwrap();
    let (guide, source) = (read("docs/embedding.md"), read("firmware/m7/src/bin/port.rs"));
    let shown =
        guide.split("```rust\n").nth(1).and_then(|rest| rest.split("\n```").next()).unwrap();
    assert!(
        source.contains(shown),
        "docs/embedding.md shows another port than firmware/m7/src/bin/port.rs"
    );
    assert!(shown.lines().count() <= 32, "{} lines", shown.lines().count());
}

/// Unit tests of a library that is compiled without them would never run, and nobody would know.
#[test]
fn a_library_without_unit_tests_has_none() {
    let crates = root().join("crates");
    let without: Vec<_> = folders(&crates)
        .into_iter()
        .filter(|name| {
            let manifest = fs::read_to_string(crates.join(name).join("Cargo.toml")).unwrap();
            let library = manifest.split("[lib]").nth(1).and_then(|rest| rest.split("\n[").next());
            library.is_some_and(|library| library.contains("\ntest = false"))
        })
        .collect();
    assert_eq!(without, ["squirrel-batch", "squirrel-py", "squirrel-study"]);
    for name in without {
        for file in files(&crates.join(name).join("src"), &["rs"]) {
            let text = fs::read_to_string(&file).unwrap();
            assert!(!text.contains("#[test]"), "{}: never runs", file.display());
        }
    }
}
