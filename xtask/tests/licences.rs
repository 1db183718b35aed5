//! What cargo-deny would say about licences, for machines that do not have it: every package in the
//! lock file must be usable under the licences that `deny.toml` allows. The firmware is a workspace
//! of its own, with a lock file of its own.
#![allow(clippy::unwrap_used, reason = "tests")]

use std::path::Path;
use std::process::Command;

/// Whether an SPDX expression can be satisfied by allowed licences. `/`, the old spelling, is an
/// OR; None: not SPDX.
fn is_allowed(expression: &str, allowed: &dyn Fn(&str) -> bool) -> Option<bool> {
    let spaced = expression.replace('/', " OR ").replace('(', " ( ").replace(')', " ) ");
    let mut words = spaced.split_whitespace().collect::<Vec<_>>().into_iter().peekable();
    let result = either(&mut words, allowed)?;
    words.next().is_none().then_some(result)
}

type Words<'a> = std::iter::Peekable<std::vec::IntoIter<&'a str>>;

/// AND binds tighter than OR. Both sides are always read.
fn either(words: &mut Words<'_>, allowed: &dyn Fn(&str) -> bool) -> Option<bool> {
    let mut result = both(words, allowed)?;
    while words.next_if_eq(&"OR").is_some() {
        result |= both(words, allowed)?;
    }
    Some(result)
}

fn both(words: &mut Words<'_>, allowed: &dyn Fn(&str) -> bool) -> Option<bool> {
    let mut result = single(words, allowed)?;
    while words.next_if_eq(&"AND").is_some() {
        result &= single(words, allowed)?;
    }
    Some(result)
}

fn single(words: &mut Words<'_>, allowed: &dyn Fn(&str) -> bool) -> Option<bool> {
    match words.next()? {
        "(" => {
            let result = either(words, allowed)?;
            (words.next() == Some(")")).then_some(result)
        }
        ")" | "AND" | "OR" | "WITH" => None,
        licence => match words.next_if_eq(&"WITH") {
            // An exception only adds rights.
            Some(_) => words.next().map(|_| allowed(licence)),
            None => Some(allowed(licence)),
        },
    }
}

#[test]
fn every_package_has_an_allowed_licence() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let deny: toml::Table =
        std::fs::read_to_string(root.join("deny.toml")).unwrap().parse().unwrap();
    let allow: Vec<&str> =
        deny["licenses"]["allow"].as_array().unwrap().iter().map(|l| l.as_str().unwrap()).collect();

    for workspace in [root.to_owned(), root.join("firmware")] {
        let metadata = Command::new(env!("CARGO"))
            .args(["metadata", "--format-version=1", "--locked"])
            .current_dir(&workspace)
            .output()
            .unwrap();
        assert!(metadata.status.success(), "{}", String::from_utf8_lossy(&metadata.stderr));
        let metadata: serde_json::Value = serde_json::from_slice(&metadata.stdout).unwrap();
        let packages = metadata["packages"].as_array().unwrap();
        assert!(packages.len() > 50, "only {} packages in {}", packages.len(), workspace.display());
        for package in packages {
            let (name, licence) = (&package["name"], package["license"].as_str().unwrap_or("none"));
            assert_eq!(
                is_allowed(licence, &|one| allow.contains(&one)),
                Some(true),
                "{name}: licence {licence}"
            );
        }
    }
}

#[test]
fn expressions_are_understood() {
    let good = |licence: &str| ["MIT", "Apache-2.0", "Unicode-3.0"].contains(&licence);
    for (expression, expected) in [
        ("MIT", Some(true)),
        ("GPL-3.0-only", Some(false)),
        ("MIT OR GPL-3.0-only", Some(true)),
        ("GPL-3.0-only/MIT", Some(true)),
        ("MIT AND GPL-3.0-only", Some(false)),
        ("(MIT OR Apache-2.0) AND Unicode-3.0", Some(true)),
        ("GPL-3.0-only AND MIT OR Apache-2.0", Some(true)),
        ("GPL-3.0-only AND (MIT OR Apache-2.0)", Some(false)),
        ("Apache-2.0 WITH LLVM-exception", Some(true)),
        ("MIT OR", None),
        ("(MIT", None),
        ("MIT Apache-2.0", None),
        ("", None),
    ] {
        assert_eq!(is_allowed(expression, &good), expected, "{expression}");
    }
}
