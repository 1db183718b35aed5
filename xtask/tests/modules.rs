//! Modules of a crate know only what lies below them: no two need each other, by whatever way
//! round.
#![allow(clippy::unwrap_used, reason = "tests")]

mod repository;

use repository::{crates, product, products};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// For each module of a crate, the modules that it names.
type Arrows = BTreeMap<String, BTreeSet<String>>;

/// First names of all paths that begin at the crate, without comments and tests.
fn named(text: &str) -> BTreeSet<String> {
    let code = product(text).concat();
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
    let (found, mut arrows) = (products(source), Arrows::new());
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

/// Modules that need themselves by way of others: what is left when those that need nothing left
/// are taken away, and those that nothing left needs.
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
    for package in crates() {
        let name = package.file_name().unwrap().display();
        let cycles = cycles(arrows(&package.join("src")));
        assert!(cycles.is_empty(), "{name}: {cycles:#?}");
    }
}

#[test]
fn a_cycle_is_seen() {
    let needs =
        |name: &str, of: &[&str]| (name.to_owned(), of.iter().map(ToString::to_string).collect());
    let tree = Arrows::from([needs("a", &["b", "c"]), needs("b", &["c"]), needs("c", &[])]);
    assert!(cycles(tree).is_empty());
    let round = Arrows::from([
        needs("a", &["b"]),
        needs("b", &["c"]),
        needs("c", &["b"]),
        needs("d", &["a"]),
    ]);
    assert_eq!(cycles(round).into_keys().collect::<Vec<_>>(), ["b", "c"]);
    assert_eq!(
        named("use crate::{a::X, b};\n// crate::c\nlet y = crate::d::z();"),
        ["a", "b", "d"].map(str::to_owned).into()
    );
}
