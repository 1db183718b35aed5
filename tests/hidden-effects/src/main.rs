//! `hidden-effects make`: cases and their answers in a folder. `hidden-effects bench`: the
//! program's score on them.
#![allow(clippy::print_stderr, clippy::print_stdout, reason = "this is where the program speaks")]

use hidden_effects::bench::{self, Plan};
use hidden_effects::case::{Case, Set};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

const USAGE: &str = "\
hidden-effects make  --set NAME --n N --seed S --out DIR
hidden-effects bench --squirrel PROGRAM --seed S (--full | --cases N [--set NAME [--effect NAME]]) [--json FILE] [--keep DIR] [--check]
                     [--effect NAME]: the first N cases of the set that hide it
                     [--check]: ask `gap check` beforehand, too, and count what it foresees against what is named
                     [--score-again]: what --keep has from an earlier run, without asking again";

/// Where a search for cases that hide an effect ends.
const LAST: usize = 10_000;

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
    match arguments.split_first() {
        Some((command, rest)) if command == "make" => {
            make(&Options::new(rest, &["set", "n", "seed", "out"])?)
        }
        Some((command, rest)) if command == "bench" => score(&Options::new(
            rest,
            &[
                "squirrel",
                "seed",
                "full",
                "cases",
                "set",
                "effect",
                "json",
                "keep",
                "check",
                "score-again",
            ],
        )?),
        Some((command, _)) => Err(format!("no command '{command}'\n{USAGE}")),
        None => Err(format!("which command?\n{USAGE}")),
    }
}

fn make(options: &Options) -> Result<(), String> {
    let (set, seed) = (set(options.need("set")?)?, options.number("seed")?);
    for index in 0..options.number("n")? {
        Case::draw_and_make(set, index as usize, seed, Path::new(options.need("out")?))
            .map_err(|error| error.to_string())?;
    }
    Ok(())
}

fn score(options: &Options) -> Result<(), String> {
    let seed = options.number("seed")?;
    let cases = match (options.get("full"), options.get("set")) {
        (Some(_), _) => bench::full(),
        (None, None) => bench::spread(options.number("cases")? as usize),
        (None, Some(name)) => {
            let set = set(name)?;
            let hides = |index: &usize| match options.get("effect") {
                None => true,
                Some(name) => {
                    let effects = Case::draw(set, *index, seed).answer.effects;
                    effects.iter().any(|effect| effect.name == name)
                }
            };
            let most = options.number("cases")? as usize;
            (0..LAST).filter(hides).take(most).map(|index| (set, index)).collect()
        }
    };
    let keep = options.get("keep").map(PathBuf::from);
    let temporary = std::env::temp_dir().join(format!("hidden-effects-{}", std::process::id()));
    let plan = Plan {
        squirrel: PathBuf::from(options.need("squirrel")?),
        cases,
        seed,
        keep: keep.is_some(),
        check: options.get("check").is_some(),
        folder: keep.unwrap_or_else(|| temporary.clone()),
    };
    let run = if options.get("score-again").is_some() { bench::score_again } else { bench::run };
    let outcomes = run(&plan).map_err(|error| error.to_string());
    if temporary.exists() {
        std::fs::remove_dir_all(&temporary)
            .map_err(|error| format!("{}: {error}", temporary.display()))?;
    }
    let summary = bench::summarise(seed, outcomes?);
    print!("{}", summary.table());
    if let Some(json) = options.get("json") {
        hidden_effects::case::write_json(Path::new(json), &summary)
            .map_err(|error| error.to_string())?;
    }
    Ok(())
}

/// `--key value` pairs.
struct Options(BTreeMap<String, String>);

impl Options {
    fn new(arguments: &[String], known: &[&str]) -> Result<Self, String> {
        let mut options = BTreeMap::new();
        let mut left = arguments.iter();
        while let Some(argument) = left.next() {
            let key = argument.strip_prefix("--").filter(|key| known.contains(key));
            let key = key.ok_or_else(|| format!("no option '{argument}'\n{USAGE}"))?;
            let value = if ["full", "check", "score-again"].contains(&key) {
                Some("")
            } else {
                left.next().map(String::as_str)
            };
            let value = value.ok_or_else(|| format!("--{key}: needs a value\n{USAGE}"))?;
            options.insert(key.to_owned(), value.to_owned());
        }
        Ok(Self(options))
    }
    fn get(&self, key: &str) -> Option<&str> {
        self.0.get(key).map(String::as_str)
    }
    fn need(&self, key: &str) -> Result<&str, String> {
        self.get(key).ok_or_else(|| format!("--{key}: missing\n{USAGE}"))
    }
    fn number(&self, key: &str) -> Result<u64, String> {
        let text = self.need(key)?;
        text.parse().map_err(|_| format!("--{key} {text}: must be a whole number"))
    }
}

fn set(name: &str) -> Result<Set, String> {
    let known = || Set::ALL.map(|(set, _)| set.name()).join(", ");
    Set::from_name(name).ok_or_else(|| format!("--set {name}: no such set; known are {}", known()))
}
