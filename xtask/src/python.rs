//! Python for tests: virtual environments of their own in the target directory, packages pinned.

use crate::run::{call, installed_on_ci, output, target_directory};
use std::path::{Path, PathBuf};
use std::process::Command;

/// What the Rust tests import.
const PACKAGES: &str = "numpy==2.4.6";

/// Oldest Python, as the README says.
const OLDEST: (u32, u32) = (3, 11);

/// Newest first would pick a pre-release; what the user calls `python3` is what he expects.
const CANDIDATES: [&str; 6] =
    ["python3", "python3.14", "python3.13", "python3.12", "python3.11", "python"];

/// The interpreter of the Rust tests' environment, whether it exists yet or not.
///
/// # Errors
/// As [`target_directory`].
pub(crate) fn interpreter() -> Result<PathBuf, String> {
    Ok(program(&target_directory()?.join("venv"), "python"))
}

/// A program of a virtual environment.
pub(crate) fn program(venv: &Path, name: &str) -> PathBuf {
    venv.join(if cfg!(windows) { format!("Scripts/{name}.exe") } else { format!("bin/{name}") })
}

/// The environment of the Rust tests.
///
/// # Errors
/// As [`environment`].
pub(crate) fn prepare() -> Result<String, String> {
    environment(&target_directory()?.join("venv"), PACKAGES)
}

/// Makes a virtual environment unless it is there with these packages, and says what it did.
///
/// # Errors
/// No Python that is new enough, or venv or pip failed.
pub(crate) fn environment(venv: &Path, packages: &str) -> Result<String, String> {
    let python = program(venv, "python");
    // Written last: an environment that was broken off half-way has none.
    let stamp = venv.join("squirrel-packages.txt");
    let made = std::fs::read_to_string(&stamp).is_ok_and(|text| text == packages);
    if made && output(Command::new(&python).arg("--version")).is_some() {
        return Ok(String::new());
    }
    let base = base()?;
    call(Command::new(base).args(["-m", "venv", "--clear"]).arg(venv))
        .map_err(|error| format!("{error} (on Debian: apt install python3-venv)"))?;
    call(
        Command::new(&python)
            .args(["-m", "pip", "install", "--quiet", "--only-binary=:all:"])
            .args(packages.split(' ')),
    )?;
    std::fs::write(&stamp, packages).map_err(|error| format!("{}: {error}", stamp.display()))?;
    Ok(format!("made with {base}"))
}

/// Whether environments can be made, or are there, before anything is built. Where nobody can be
/// asked, on CI as root, Python is installed.
///
/// # Errors
/// As [`environment`], of what needs no network.
pub(crate) fn reachable() -> Result<(), String> {
    if output(Command::new(interpreter()?).arg("--version")).is_some() {
        return Ok(());
    }
    let lacking = || -> Result<(), String> {
        let base = base()?;
        let can = output(Command::new(base).args(["-c", "import venv, ensurepip"])).is_some();
        let lack = format!("{base} cannot make environments (on Debian: apt install python3-venv)");
        if can { Ok(()) } else { Err(lack) }
    };
    lacking().or_else(|lack| {
        if installed_on_ci(&["python3", "python3-venv"]) { lacking() } else { Err(lack) }
    })
}

/// The machine's Python.
fn base() -> Result<&'static str, String> {
    CANDIDATES
        .into_iter()
        .find(|name| version(name).is_some_and(|version| version >= OLDEST))
        .ok_or_else(|| format!("no Python {}.{} or newer in PATH", OLDEST.0, OLDEST.1))
}

fn version(python: &str) -> Option<(u32, u32)> {
    parse_version(&output(Command::new(python).arg("--version"))?)
}

/// `Python 3.11.7` to (3, 11).
fn parse_version(text: &str) -> Option<(u32, u32)> {
    let mut numbers = text.strip_prefix("Python ")?.split('.');
    Some((numbers.next()?.parse().ok()?, numbers.next()?.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use super::parse_version;

    #[test]
    fn versions_compare_as_numbers() {
        assert_eq!(parse_version("Python 3.11.7"), Some((3, 11)));
        assert!(parse_version("Python 3.9.2") < parse_version("Python 3.11.0rc1"));
        assert_eq!(parse_version("Python was not found; run without arguments"), None);
    }
}
