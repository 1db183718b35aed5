//! Modules of a crate know only what lies below them: no two need each other, by whatever way round.
#![allow(clippy::unwrap_used, reason = "tests")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// For each module of a crate, the modules that it names.
type Arrows = BTreeMap<String, BTreeSet<String>>;

fn crates() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().join("crates")
}

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for path in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        if path.is_dir() && !path.ends_with("tests") {
            files(&path, found);
        } else if path.extension().is_some_and(|ending| ending == "rs") && !path.ends_with("tests.rs") {
            found.push(path);
        }
    }
}

/// First names of all paths that begin at the crate, without comments and tests.
fn named(text: &str) -> BTreeSet<String> {
    let product = text.split("#[cfg(test)]\nmod ").next().unwrap();
    let code: String = product.lines().filter(|line| !line.trim_start().starts_with("//")).collect();
    let mut names = BTreeSet::new();
    for rest in code.split("crate::").skip(1) {
        let word = |text: &str| -> String {
            text.trim_start().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
        };
        match rest.strip_prefix('{') {
            None => drop(names.insert(word(rest))),
            Some(list) => names.extend(list.split('}').next().unwrap().split(',').map(word)),
        }
    }
    names
}

fn arrows(source: &Path) -> Arrows {
    let (mut found, mut arrows) = (Vec::new(), Arrows::new());
    files(source, &mut found);
    let module = |path: &Path| {
        let first = path.strip_prefix(source).unwrap().iter().next().unwrap().to_str().unwrap();
        first.trim_end_matches(".rs").to_owned()
    };
    let all: BTreeSet<String> = found.iter().map(|path| module(path)).collect();
    for path in &found {
        let own = module(path);
        let names = named(&fs::read_to_string(path).unwrap());
        let others = names.intersection(&all).filter(|name| **name != own).cloned();
        arrows.entry(own.clone()).or_default().extend(others);
    }
    // The root of a crate names all of them.
    arrows.remove("lib");
    arrows.remove("main");
    arrows
}

/// Modules that need themselves by way of others: what is left when those that need nothing left are taken away, and those that
/// nothing left needs.
fn cycles(mut arrows: Arrows) -> Arrows {
    loop {
        let before = arrows.len();
        let there: BTreeSet<String> = arrows.keys().cloned().collect();
        arrows.retain(|_, needs| needs.iter().any(|name| there.contains(name)));
        let needed: BTreeSet<String> = arrows.values().flatten().cloned().collect();
        arrows.retain(|name, _| needed.contains(name));
        if arrows.len() == before {
            let there: BTreeSet<String> = arrows.keys().cloned().collect();
            for needs in arrows.values_mut() {
                needs.retain(|name| there.contains(name));
            }
            return arrows;
        }
    }
}

#[test]
fn no_module_needs_itself_by_way_of_another() {
    for entry in fs::read_dir(crates()).unwrap().map(|entry| entry.unwrap()) {
        let name = entry.file_name().into_string().unwrap();
        let cycles = cycles(arrows(&entry.path().join("src")));
        assert!(cycles.is_empty(), "{name}: {cycles:#?}");
    }
}

#[test]
fn a_cycle_is_seen() {
    let needs = |name: &str, of: &[&str]| (name.to_owned(), of.iter().map(ToString::to_string).collect());
    let tree = Arrows::from([needs("a", &["b", "c"]), needs("b", &["c"]), needs("c", &[])]);
    assert!(cycles(tree).is_empty());
    let round =
        Arrows::from([needs("a", &["b"]), needs("b", &["c"]), needs("c", &["b"]), needs("d", &["a"])]);
    assert_eq!(cycles(round).into_keys().collect::<Vec<_>>(), ["b", "c"]);
    assert_eq!(
        named("use crate::{a::X, b};\n// crate::c\nlet y = crate::d::z();"),
        ["a", "b", "d"].map(str::to_owned).into()
    );
}
