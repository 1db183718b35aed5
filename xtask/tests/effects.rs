//! What is known of an effect stands in its own file: the gap workflow asks for it and names no
//! effect.
#![allow(clippy::unwrap_used, reason = "tests")]

mod repository;

use repository::{product, products, root};
use std::fs;

/// The name that an effect's file gives it.
fn name(text: &str) -> Option<&str> {
    text.split_once("const NAME: &'static str = \"")?.1.split('"').next()
}

#[test]
fn the_gap_workflow_names_no_effect() {
    let mut names = Vec::new();
    for file in products(&root().join("crates/squirrel-core/src/effects")) {
        names.extend(name(&fs::read_to_string(file).unwrap()).map(|name| format!("\"{name}\"")));
    }
    assert!(names.len() > 30, "{names:?}");
    let mut named = Vec::new();
    for file in products(&root().join("crates/squirrel-gap/src")) {
        let text = fs::read_to_string(&file).unwrap();
        let lines =
            product(&text).into_iter().filter(|line| names.iter().any(|name| line.contains(name)));
        named.extend(lines.map(|line| format!("{}: {line}", file.display())));
    }
    assert!(named.is_empty(), "{named:#?}");
}

#[test]
fn a_name_is_found() {
    assert_eq!(name("    const NAME: &'static str = \"gust\";\n"), Some("gust"));
    assert_eq!(name("const NAMES: [&str; 0] = [];"), None);
}
