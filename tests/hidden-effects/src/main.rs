//! `hidden-effects make`: cases and their answers in a folder.
#![allow(clippy::print_stderr, reason = "this is where the program speaks")]

use hidden_effects::case::{Case, Set};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::ExitCode;

const USAGE: &str = "hidden-effects make --set NAME --n N --seed S --out DIR";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("hidden-effects: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &[String]) -> Result<(), String> {
    let Some((command, rest)) = arguments.split_first() else { return Err(USAGE.to_owned()) };
    if command != "make" {
        return Err(format!("no command '{command}'; {USAGE}"));
    }
    let options = options(rest)?;
    let get = |key: &str| options.get(key).ok_or_else(|| format!("--{key}: missing; {USAGE}"));
    let number = |key: &str| {
        let text = get(key)?;
        text.parse::<u64>().map_err(|_| format!("--{key} {text}: must be a number"))
    };
    let set = get("set")?;
    let set = Set::from_name(set).ok_or_else(|| format!("--set {set}: no such set"))?;
    for index in 0..number("n")? {
        let case = Case::draw(set, index as usize, number("seed")?);
        case.make(Path::new(get("out")?)).map_err(|error| error.to_string())?;
    }
    Ok(())
}

fn options(arguments: &[String]) -> Result<BTreeMap<String, String>, String> {
    let mut options = BTreeMap::new();
    for pair in arguments.chunks(2) {
        match pair {
            [key, value] if key.starts_with("--") => options.insert(key[2..].to_owned(), value.clone()),
            _ => return Err(format!("'{}' needs a value; {USAGE}", pair[0])),
        };
    }
    Ok(options)
}
