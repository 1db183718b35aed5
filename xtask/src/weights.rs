//! The shipped weights from nothing: random flights with spread wings, training, and the same bytes
//! as in `vehicles/`.
//!
//! It is what a user would do by hand, with the program as it is built now; CONTRIBUTING.md says
//! when the file changes.

use crate::run::{call, programs, root, target_directory};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// What is shipped, below the root.
const SHIPPED: &str = "vehicles/squirrel-parnn.safetensors";
/// Flights of 30 s, seeds from 1.
const FLIGHTS: u32 = 24;
/// The last of them, which stop the training.
const VALIDATION: &str = "wings-23,wings-24";

/// `cargo xtask weights`.
pub(crate) fn chore(arguments: &[String]) -> Result<(), String> {
    match arguments {
        [] => check().map(|_| ()),
        [write] if write == "--write" => {
            let (made, shipped) = (make()?, root()?.join(SHIPPED));
            replace(&made, &shipped)?;
            eprintln!("wrote {}", shipped.display());
            Ok(())
        }
        _ => Err(format!("arguments = {}: must be none or --write", arguments.join(" "))),
    }
}

/// Makes the weights and compares them with the shipped ones.
///
/// # Errors
/// A command failed, or the bytes differ.
pub(crate) fn check() -> Result<String, String> {
    let (made, shipped) = (make()?, root()?.join(SHIPPED));
    if read(&made)? != read(&shipped)? {
        return Err(format!(
            "{SHIPPED}: flights and training now give other bytes, {}; `cargo xtask weights --write` takes them",
            made.display()
        ));
    }
    eprintln!("{SHIPPED}: the same bytes");
    Ok(String::new())
}

/// Flies and trains in a folder of its own; the file that came of it.
fn make() -> Result<PathBuf, String> {
    let squirrel = programs(&["squirrel"])?.join("squirrel");
    let folder = target_directory()?.join("weights");
    let flights = folder.join("flights");
    let at = |error: std::io::Error| format!("{}: {error}", folder.display());
    if folder.exists() {
        std::fs::remove_dir_all(&folder).map_err(at)?;
    }
    std::fs::create_dir_all(&flights).map_err(at)?;
    for seed in 1..=FLIGHTS {
        let log = flights.join(format!("wings-{seed:02}.mcap"));
        let mut fly = Command::new(&squirrel);
        fly.args(["fly", "--arm", "pc_wings_open", "--scenario", "random_spread"]);
        fly.args([
            OsStr::new("--seed"),
            OsStr::new(&seed.to_string()),
            OsStr::new("--out"),
            log.as_os_str(),
        ]);
        // Two dozen tables of tracking errors are of no use here.
        call(fly.stdout(Stdio::null()).stderr(Stdio::null()))?;
    }
    let out = folder.join("squirrel-parnn.safetensors");
    let mut train = Command::new(&squirrel);
    train.args(["train", "parnn", "--seed", "1", "--validation", VALIDATION]);
    call(train.arg("--flights").arg(&flights).arg("--out").arg(&out))?;
    Ok(out)
}

fn read(path: &Path) -> Result<Vec<u8>, String> {
    std::fs::read(path).map_err(|error| format!("{}: {error}", path.display()))
}

/// Copies under a temporary name, then renames.
fn replace(from: &Path, to: &Path) -> Result<(), String> {
    let partial = to.with_extension("partial");
    std::fs::copy(from, &partial)
        .and_then(|_| std::fs::rename(&partial, to))
        .map_err(|error| format!("{}: {error}", to.display()))
}
