//! `cargo xtask docs`: the guide is built without a warning, its links lead somewhere, its commands
//! and lines of code run, and its page of commands is that of the program.
//!
//! Pages run what they show, each in a folder of its own (`play`); the site is made by mkdocs
//! (`site`), which is the one part that needs packages, once.

mod blocks;
mod play;
mod site;

use crate::run::{programs, root, target_directory};
use crate::wheel;
use std::path::PathBuf;
use std::process::Command;

/// What `squirrel help --markdown` prints, as a page.
const COMMANDS: &str = "docs/guide/commands.md";

/// `cargo xtask docs`: all of it, or one part.
pub(crate) fn chore(arguments: &[String]) -> Result<(), String> {
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match arguments[..] {
        [] => {
            programs(&["squirrel"])?;
            wheel::installed()?;
            step().map(|note| eprintln!("{note}"))?;
            site::build().map(|note| eprintln!("{note}"))
        }
        ["--write"] => {
            programs(&["squirrel"])?;
            let page = root()?.join(COMMANDS);
            std::fs::write(&page, commands()?)
                .map_err(|error| format!("{}: {error}", page.display()))
        }
        ["--site"] => site::build().map(|note| eprintln!("{note}")),
        // By what is built, for whoever writes a page.
        ["--page", page] => play::pages(&program()?, Some(page)).map(|note| eprintln!("{note}")),
        ["--pages"] => step().map(|note| eprintln!("{note}")),
        _ => Err("docs takes nothing, --write, --site, --pages, or --page PAGE".to_owned()),
    }
}

/// The step of `cargo xtask test`, with the program and the wheel that it has built: the page of
/// commands, and what all pages show.
pub(crate) fn step() -> Result<String, String> {
    let kept = std::fs::read_to_string(root()?.join(COMMANDS)).unwrap_or_default();
    if kept != commands()? {
        return Err(format!("{COMMANDS} is of another version: cargo xtask docs --write"));
    }
    play::pages(&program()?, None)
}

fn program() -> Result<PathBuf, String> {
    let name = PathBuf::from("squirrel").with_extension(std::env::consts::EXE_EXTENSION);
    Ok(target_directory()?.join("release").join(name))
}

/// The page of commands as the program has it.
fn commands() -> Result<String, String> {
    let output = Command::new(program()?)
        .args(["help", "--markdown"])
        .output()
        .map_err(|error| format!("squirrel help --markdown: {error}"))?;
    if !output.status.success() {
        return Err(format!("squirrel help --markdown: {}", output.status));
    }
    String::from_utf8(output.stdout).map_err(|error| format!("squirrel help --markdown: {error}"))
}
