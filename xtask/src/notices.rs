//! `cargo xtask notices`: whose code is inside the Python package, under which licences, with their
//! texts. The list is made of what cargo compiles into it on any of the platforms, and of the files
//! that those packages bring along; it lies in the repository, so that every wheel and the sources
//! have it.

use crate::run::{cargo, output, root};
use crate::targets::TARGETS;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

/// Where the list lies.
const LIST: &str = "crates/squirrel-py/THIRD-PARTY.txt";
/// The platform that CI runs on; [`TARGETS`] has the others.
const HERE: &str = "x86_64-unknown-linux-gnu";
/// Files of licences begin so, in capitals.
const BEGINNINGS: [&str; 6] = ["LICENSE", "LICENCE", "COPYING", "NOTICE", "UNLICENSE", "COPYRIGHT"];

/// A package of somebody else.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Package {
    name: String,
    version: String,
    licence: String,
    address: String,
}

/// `cargo xtask notices`.
///
/// # Errors
/// An argument but `--write`, cargo does not answer, or the list is not that of `Cargo.lock`.
pub(crate) fn chore(arguments: &[String]) -> Result<(), String> {
    match arguments {
        [] => step().map(|note| eprintln!("{note}")),
        [word] if word == "--write" => {
            let text = list()?;
            fs::write(root()?.join(LIST), text).map_err(|error| format!("{LIST}: {error}"))
        }
        _ => Err(format!("arguments = {}: must be none or --write", arguments.join(" "))),
    }
}

/// The step of `cargo xtask test`.
///
/// # Errors
/// As [`chore`].
pub(crate) fn step() -> Result<String, String> {
    let kept = fs::read_to_string(root()?.join(LIST)).map_err(|e| format!("{LIST}: {e}"))?;
    if kept != list()? {
        return Err(format!("{LIST}: not of Cargo.lock as it is; cargo xtask notices --write"));
    }
    Ok(format!("{} packages", kept.lines().filter(|line| line.starts_with("* ")).count()))
}

/// The whole list.
fn list() -> Result<String, String> {
    let folders = folders()?;
    let own = |name: &str| {
        fs::read_to_string(root()?.join(name)).map_err(|error| format!("{name}: {error}"))
    };
    let (apache, mit) = (own("LICENSE-APACHE")?, own("LICENSE-MIT")?);
    let mut packages = packages()?;
    packages.insert(Package {
        name: "the Rust standard library".to_owned(),
        version: String::new(),
        licence: "MIT OR Apache-2.0".to_owned(),
        address: "https://github.com/rust-lang/rust".to_owned(),
    });
    let mut text = String::from(
        "What is compiled into the Python package squirrel-flight beside its own code: packages of\n\
         others, their licences, and after the list the texts. Made by `cargo xtask notices --write`.\n\n",
    );
    // By their words, so that how lines are broken makes no second text of one.
    let mut texts: BTreeMap<String, (String, Vec<String>)> = BTreeMap::new();
    for package in packages {
        let Package { name, version, licence, address } = &package;
        let called = format!("{name} {version}").trim().to_owned();
        let _ = writeln!(text, "* {called}: {licence}; {address}");
        let mut brought = match folders.get(&format!("{name}-{version}")) {
            Some(folder) => chosen(licence, texts_in(folder)?),
            None => Vec::new(),
        };
        if brought.is_empty() {
            brought.push(stand_in(&package, &apache, &mit));
        }
        for text in brought {
            let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
            texts.entry(words).or_insert((text, Vec::new())).1.push(called.clone());
        }
    }
    let mut texts: Vec<(String, Vec<String>)> = texts.into_values().collect();
    texts.sort_by_key(|(_, of)| (std::cmp::Reverse(of.len()), of[0].clone()));
    for (licence, of) in texts {
        let _ = write!(text, "\n{}\n{}:\n\n{licence}\n", "-".repeat(80), of.join(", "));
    }
    Ok(text)
}

/// What cargo compiles in on one of the platforms, without macros, which run at build time.
fn packages() -> Result<BTreeSet<Package>, String> {
    let mut tree = cargo()?;
    tree.args(["tree", "--locked", "-p", "squirrel-py", "--edges", "normal,no-proc-macro"]);
    tree.args(["--prefix", "none", "--format", "{p}\t{l}\t{r}", "--target", HERE]);
    tree.args(TARGETS.iter().flat_map(|(target, _)| ["--target", target]));
    let text = output(&mut tree).ok_or("cargo tree -p squirrel-py: failed")?;
    Ok(text.lines().filter_map(package).collect())
}

/// A package of a line; none of our own, which has a path.
fn package(line: &str) -> Option<Package> {
    let line = line.trim_end_matches(" (*)");
    let mut columns = line.split('\t');
    let (name, version) = columns.next()?.split_once(" v")?;
    let (licence, address) = (columns.next()?, columns.next()?);
    let (name, licence) = (name.to_owned(), licence.to_owned());
    let address = address.to_owned();
    (!version.contains(' ')).then(|| Package {
        name,
        version: version.to_owned(),
        licence,
        address,
    })
}

/// The folder of each package that cargo has fetched, by name and version. Of cargo's JSON only the
/// paths of manifests are read: this program has no dependencies.
fn folders() -> Result<BTreeMap<String, PathBuf>, String> {
    let mut metadata = cargo()?;
    let text = output(metadata.args(["metadata", "--format-version=1", "--locked"]))
        .ok_or("cargo metadata: failed")?;
    let paths =
        text.split("\"manifest_path\":\"").skip(1).filter_map(|rest| rest.split('"').next());
    let folders = paths.filter_map(|path| {
        let folder = Path::new(&path.replace("\\\\", "\\")).parent()?.to_owned();
        Some((folder.file_name()?.to_string_lossy().into_owned(), folder))
    });
    Ok(folders.collect())
}

/// Licences in a folder and in those in it, where C sources have theirs: name of the file and text.
fn texts_in(folder: &Path) -> Result<Vec<(String, String)>, String> {
    let at = |error: std::io::Error| format!("{}: {error}", folder.display());
    let entries = |folder: &Path| -> Result<Vec<PathBuf>, String> {
        let entries = fs::read_dir(folder).map_err(at)?;
        entries.map(|entry| entry.map(|entry| entry.path()).map_err(at)).collect()
    };
    let mut files = Vec::new();
    for path in entries(folder)? {
        if path.is_dir() { files.extend(entries(&path)?) } else { files.push(path) }
    }
    files.sort();
    let mut texts = Vec::new();
    for path in files {
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_uppercase();
        let is_source = [".RS", ".PY", ".TOML"].iter().any(|end| name.ends_with(end));
        if path.is_file() && !is_source && BEGINNINGS.iter().any(|begin| name.starts_with(begin)) {
            let bytes = fs::read(&path).map_err(at)?;
            texts.push((name, tidy(&String::from_utf8_lossy(&bytes))));
        }
    }
    Ok(texts)
}

/// A text without blanks at the end of lines, and without empty lines around it.
fn tidy(text: &str) -> String {
    let lines: Vec<&str> = text.lines().map(str::trim_end).collect();
    lines.join("\n").trim_matches('\n').to_owned()
}

/// Of the texts those that we take: where the choice is ours MIT's, with notices. The GPL, which
/// zstd offers beside BSD, is never taken.
fn chosen(licence: &str, texts: Vec<(String, String)>) -> Vec<String> {
    let has = |name: &str, what: &str| name.contains(what);
    let is_choice = licence.contains("OR") || licence.contains('/');
    let mit = is_choice && texts.iter().any(|(name, _)| has(name, "MIT"));
    let others = ["APACHE", "UNLICENSE", "ZLIB", "BOOST", "BSL", "BSD", "0BSD"];
    texts
        .into_iter()
        .filter(|(name, _)| !(mit && others.iter().any(|other| has(name, other))))
        .map(|(_, text)| text)
        .filter(|text| !text.contains("GNU GENERAL PUBLIC LICENSE") && !text.contains("GPLv2"))
        .collect()
}

/// The text of a licence that a package names without bringing it along.
fn stand_in(package: &Package, apache: &str, mit: &str) -> String {
    if package.licence.contains("Apache-2.0") {
        return tidy(apache);
    }
    let holder = format!("Copyright (c) the authors of {}", package.name);
    let line =
        |line: &str| if line.starts_with("Copyright") { holder.clone() } else { line.to_owned() };
    tidy(&mit.lines().map(line).collect::<Vec<_>>().join("\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(names: &[&str]) -> Vec<(String, String)> {
        names.iter().map(|name| ((*name).to_owned(), format!("text of {name}"))).collect()
    }

    #[test]
    fn lines_of_cargo_are_packages_of_others() {
        let of = |line| package(line).map(|p| (p.name, p.version, p.licence));
        let expected = ("serde".to_owned(), "1.0.2".to_owned(), "MIT OR Apache-2.0".to_owned());
        assert_eq!(of("serde v1.0.2\tMIT OR Apache-2.0\thttps://a (*)"), Some(expected));
        assert_eq!(of("squirrel-log v0.1.0 (/here)\tMIT\thttps://b"), None);
    }

    #[test]
    fn of_a_choice_mit_is_taken_with_notices() {
        let all = ["LICENSE-APACHE", "LICENSE-MIT", "NOTICE"];
        assert_eq!(
            chosen("MIT OR Apache-2.0", texts(&all)),
            ["text of LICENSE-MIT", "text of NOTICE"]
        );
        let both = chosen("MIT AND BSD-3-Clause", texts(&["LICENSE-BSD", "LICENSE-MIT"]));
        assert_eq!(both.len(), 2, "{both:?}");
        let gpl = vec![("COPYING".to_owned(), "GNU GENERAL PUBLIC LICENSE".to_owned())];
        assert!(chosen("BSD-3-Clause", gpl).is_empty());
    }

    #[test]
    fn what_brings_no_text_gets_that_of_its_licence() {
        let package = |licence: &str| Package {
            name: "binrw".to_owned(),
            version: "1.0.0".to_owned(),
            licence: licence.to_owned(),
            address: String::new(),
        };
        let mit = "MIT\n\nCopyright (c) us\n\nPermission";
        let text = stand_in(&package("MIT"), "Apache", mit);
        assert_eq!(text, "MIT\n\nCopyright (c) the authors of binrw\n\nPermission");
        assert_eq!(stand_in(&package("MIT OR Apache-2.0"), "Apache", mit), "Apache");
    }
}
