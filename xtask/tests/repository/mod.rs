//! The files of the repository, for tests of the whole of it.
#![allow(dead_code, reason = "not every test needs every function")]

use std::fs;
use std::path::{Path, PathBuf};

/// Where the repository is.
pub(crate) fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

/// Files below a folder with one of these endings, but for what was built.
pub(crate) fn files(folder: &Path, endings: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for path in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        if path.is_dir() && !path.ends_with("target") {
            found.extend(files(&path, endings));
        } else if path
            .extension()
            .is_some_and(|ending| endings.iter().any(|known| ending == *known))
        {
            found.push(path);
        }
    }
    found
}

/// The folders of our crates.
pub(crate) fn crates() -> Vec<PathBuf> {
    fs::read_dir(root().join("crates")).unwrap().map(|entry| entry.unwrap().path()).collect()
}

/// Rust sources below a folder that are no tests.
pub(crate) fn products(folder: &Path) -> Vec<PathBuf> {
    let is_test = |path: &Path| path.iter().any(|part| part == "tests" || part == "tests.rs");
    let mut found = files(folder, &["rs"]);
    found.retain(|path| !is_test(path.strip_prefix(folder).unwrap()));
    found
}

/// A source without its tests and comments, line by line.
pub(crate) fn product(text: &str) -> Vec<&str> {
    let (code, _) = text.split_once("#[cfg(test)]\nmod ").unwrap_or((text, ""));
    code.lines().map(|line| line.split("//").next().unwrap()).collect()
}
