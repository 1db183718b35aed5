//! The lists of steps.
//!
//! Everything is built in the release profile: `clippy` and `doc` share the metadata of the
//! dependencies and, with `test`, the build scripts and procedural macros; `test`, `bench` and the
//! demo share the libraries.

use crate::run::{Action, Step, call, cargo, programs, root, run, succeeds, target_directory};
use crate::slow::SLOW;
use crate::{docs, firmware, notices, package, python, thumb, weights, wheel};
use std::path::{Path, PathBuf};
use std::process::Command;

const LINT: [Step; 5] = [
    Step { name: "tools", action: Action::Function(tools) },
    Step { name: "format", action: Action::Cargo(&["fmt", "--all", "--check"]) },
    Step {
        name: "clippy",
        action: Action::Cargo(&[
            "clippy",
            "--release",
            "--workspace",
            "--all-targets",
            "--locked",
            "--",
            "-D",
            "warnings",
        ]),
    },
    // Workspace features always have rapier; this is the simulator as who flies free builds it.
    Step {
        name: "no-rapier",
        action: Action::Cargo(&["check", "--release", "--locked", "--lib", "-p", "squirrel-sim"]),
    },
    Step {
        name: "doc",
        action: Action::CargoWith(
            ("RUSTDOCFLAGS", "-D warnings"),
            &["doc", "--release", "--workspace", "--no-deps", "--locked"],
        ),
    },
];

/// Said before the first step takes its minutes.
const NEEDS: Step = Step { name: "needs", action: Action::Function(needs) };

const QUICK_NEEDS: Step = Step {
    name: "needs",
    action: Action::Function(|| python::reachable().map(|()| String::new())),
};

const TEST: [Step; 13] = [
    Step { name: "python", action: Action::Function(python::prepare) },
    // Examples as tests alone: clippy has looked at the programs that they are, too.
    Step {
        name: "test",
        action: Action::Cargo(&["test", "--release", "--workspace", "--locked", "--tests"]),
    },
    Step {
        name: "doc-test",
        action: Action::Cargo(&["test", "--release", "--workspace", "--locked", "--doc"]),
    },
    Step { name: "thumb", action: Action::Function(thumb::check) },
    Step { name: "deny", action: Action::Function(deny) },
    Step { name: "notices", action: Action::Function(notices::step) },
    Step { name: "demo", action: Action::Function(demo) },
    Step { name: "weights", action: Action::Function(weights::check) },
    Step { name: "crates", action: Action::Function(|| package::crates().map(|()| String::new())) },
    Step {
        name: "packages",
        action: Action::Beside { after: "python", chore: &["wheel", "--environment"] },
    },
    Step { name: "wheel", action: Action::Function(wheel::step) },
    // With the program and the package as they are built now.
    Step { name: "docs", action: Action::Function(docs::step) },
    // Its target folder is its own, and the program is there.
    Step {
        name: "firmware",
        action: Action::Beside { after: "test", chore: &["firmware", "--if-emulator"] },
    },
];

/// What `--quick` does after format and clippy: no documentation and its examples, no target but
/// this machine's, no wheel.
const QUICK: [Step; 2] = [
    Step { name: "python", action: Action::Function(python::prepare) },
    Step { name: "test", action: Action::Function(quick_tests) },
];

/// `cargo xtask lint`.
pub(crate) fn lint(_: &[String]) -> Result<(), String> {
    run(&LINT)
}

/// `cargo xtask test`.
pub(crate) fn test(arguments: &[String]) -> Result<(), String> {
    let quick = match arguments {
        [] => false,
        [word] if word == "--quick" => true,
        _ => return Err(format!("arguments = {}: must be none or --quick", arguments.join(" "))),
    };
    let steps: Vec<Step> = if quick {
        let [tools, format, clippy, ..] = LINT;
        [QUICK_NEEDS, tools, format, clippy].into_iter().chain(QUICK).collect()
    } else {
        [NEEDS].into_iter().chain(LINT).chain(TEST).collect()
    };
    run(&steps)
}

/// Benches that take the compiler far longer than `--quick` takes to run them.
const LONG_TO_COMPILE: [&str; 1] = ["jacobian"];

/// `cargo xtask bench`: whole workspace, so that features and thus the built libraries are those of
/// `test`; benches by name, because the test harness of the libraries does not know criterion's
/// arguments. `--quick` leaves out what takes far longer to compile than to run.
pub(crate) fn bench(arguments: &[String]) -> Result<(), String> {
    let is_quick = arguments.iter().any(|argument| argument == "--quick");
    let mut command = cargo()?;
    command.args(["bench", "--workspace", "--locked"]);
    for name in bench_names(&root()?)? {
        if !(is_quick && LONG_TO_COMPILE.contains(&name.as_str())) {
            command.args(["--bench", &name]);
        }
    }
    call(command.arg("--").args(arguments))
}

/// `cargo xtask batch-gate`: of the whole workspace, as [`bench()`].
pub(crate) fn batch_gate(_: &[String]) -> Result<(), String> {
    let example = "batch_gate";
    call(cargo()?.args(["build", "--release", "--locked", "--workspace", "--example", example]))?;
    call(&mut Command::new(target_directory()?.join("release").join("examples").join(example)))
}

/// `cargo xtask pictures`: what the README shows, as the program flies it now.
pub(crate) fn pictures(_: &[String]) -> Result<(), String> {
    let example = [
        "run",
        "--release",
        "--locked",
        "-p",
        "squirrel-sim",
        "--example",
        "pictures",
        "--",
        "docs/pictures",
    ];
    call(cargo()?.args(example))
}

/// `cargo xtask gap-bench`: the blind bench of the gap workflow on the program as it is built now.
pub(crate) fn gap_bench(arguments: &[String]) -> Result<(), String> {
    let built = blind_bench()?;
    let mut command = Command::new(built.join("hidden-effects"));
    call(command.args(["bench", "--squirrel"]).arg(built.join("squirrel")).args(arguments))
}

/// `cargo xtask attack`: tests of what reads logs, vehicles, scenarios, weights, plans, wire records,
/// checkpoints and journals, on more files than in `cargo xtask test`.
pub(crate) fn attack(arguments: &[String]) -> Result<(), String> {
    let [count, seed] = count_and_seed(arguments, ["2500", "1"])?;
    for package in ["squirrel-log", "squirrel-sim", "squirrel-nn", "squirrel-study"] {
        call(
            cargo()?
                .args(["test", "--release", "--locked", "-p", package])
                .args(["--test", "it", "attack", "--", "--nocapture"])
                .env("SQUIRREL_ATTACK_COUNT", &count)
                .env("SQUIRREL_ATTACK_SEED", &seed),
        )?;
    }
    Ok(())
}

/// `cargo xtask kill`: tests of what a killed command leaves, at more moments than in `cargo xtask
/// test`.
pub(crate) fn kill(arguments: &[String]) -> Result<(), String> {
    let [count, seed] = count_and_seed(arguments, ["200", "1"])?;
    call(
        cargo()?
            .args(["test", "--release", "--locked", "-p", "squirrel-cli"])
            .args(["--test", "it", "crash::", "--", "--nocapture"])
            .env("SQUIRREL_KILL_COUNT", &count)
            .env("SQUIRREL_KILL_SEED", &seed),
    )
}

/// The arguments of a chore that does something random so many times.
fn count_and_seed(arguments: &[String], defaults: [&str; 2]) -> Result<[String; 2], String> {
    let all =
        [0, 1].map(|i| arguments.get(i).map_or_else(|| defaults[i].to_owned(), String::clone));
    for (name, text) in [("COUNT", &all[0]), ("SEED", &all[1])] {
        text.parse::<u64>().map_err(|_| format!("{name}: `{text}` is no whole number"))?;
    }
    Ok(all)
}

/// Builds the program and its blind bench; the folder that they are in.
pub(crate) fn blind_bench() -> Result<PathBuf, String> {
    programs(&["squirrel", "hidden-effects"])
}

/// The files in the crates' `benches` folders, without extension, in order.
fn bench_names(root: &Path) -> Result<Vec<String>, String> {
    let list = |path: &Path| {
        std::fs::read_dir(path).map_err(|error| format!("{}: {error}", path.display()))
    };
    let mut names = Vec::new();
    for package in list(&root.join("crates"))? {
        let folder = package.map_err(|error| error.to_string())?.path().join("benches");
        if !folder.is_dir() {
            continue;
        }
        for file in list(&folder)? {
            let path = file.map_err(|error| error.to_string())?.path();
            if let (Some("rs"), Some(stem)) =
                (path.extension().and_then(|e| e.to_str()), path.file_stem())
            {
                names.push(stem.to_string_lossy().into_owned());
            }
        }
    }
    names.sort();
    Ok(names)
}

/// What `cargo run` flies, by the program that `test` has built: `cargo run` alone would build it
/// again with the features of fewer crates.
fn demo() -> Result<String, String> {
    let folder = target_directory()?;
    let program =
        folder.join("release").join("squirrel").with_extension(std::env::consts::EXE_EXTENSION);
    call(Command::new(program).args(["demo", "--out"]).arg(folder.join("demo")))
        .map(|()| String::new())
}

/// What the machine lacks: an error where a step would fail for it, a line where one is left out.
fn needs() -> Result<String, String> {
    let mut lacks = Vec::new();
    for lack in [python::reachable(), thumb::reachable()] {
        lacks.extend(lack.err());
    }
    match firmware::missing() {
        Ok(Some(note)) => eprintln!("{note}"),
        Ok(None) => {}
        Err(lack) => lacks.push(lack),
    }
    // One line, however many words a lack has.
    let line = lacks.join("; ").split_whitespace().collect::<Vec<_>>().join(" ");
    if line.is_empty() { Ok(String::new()) } else { Err(line) }
}

/// The tests that take no time, of the libraries and programs that the whole test has.
fn quick_tests() -> Result<String, String> {
    let skipped = SLOW.iter().flat_map(|name| ["--skip", name]);
    let tests = ["test", "--release", "--workspace", "--locked", "--tests", "--"];
    call(cargo()?.args(tests).args(skipped)).map(|()| String::new())
}

/// rustfmt and clippy, which rustup's minimal profile leaves out.
fn tools() -> Result<String, String> {
    let missing: Vec<&str> = [("rustfmt", "fmt"), ("clippy", "clippy")]
        .into_iter()
        .filter(|(_, subcommand)| !succeeds(Command::new("cargo").args([subcommand, "--version"])))
        .map(|(component, _)| component)
        .collect();
    if missing.is_empty() {
        return Ok(String::new());
    }
    call(Command::new("rustup").args(["component", "add"]).args(&missing))?;
    Ok(format!("added {}", missing.join(" ")))
}

/// cargo-deny where it is installed. Building it takes minutes and its advisories come over the
/// network, so a fresh machine does without: `xtask/tests` checks licences and dependencies there.
fn deny() -> Result<String, String> {
    if !succeeds(Command::new("cargo").args(["deny", "--version"])) {
        return Ok(said("skipped: no cargo-deny (cargo install --locked cargo-deny@0.20.2)"));
    }
    call(cargo()?.args(["deny", "--locked", "check", "bans", "licenses", "sources"]))?;
    if !succeeds(Command::new("cargo").args(["deny", "fetch", "db"])) {
        return Ok(said("advisories skipped: their database cannot be fetched"));
    }
    call(cargo()?.args(["deny", "--locked", "check", "--disable-fetch", "advisories"]))
        .map(|()| String::new())
}

/// A note that also stands where it happened.
fn said(note: &str) -> String {
    eprintln!("{note}");
    note.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn step_names_are_unique_and_fit_the_table() {
        let mut names: Vec<&str> =
            LINT.iter().chain(&TEST).chain([&NEEDS]).map(|step| step.name).collect();
        assert!(names.iter().all(|name| name.len() <= 10), "{names:?}");
        names.sort_unstable();
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]), "{names:?}");
    }

    #[test]
    fn what_runs_beside_begins_after_an_earlier_step() {
        for (place, step) in TEST.iter().enumerate() {
            if let Action::Beside { after, .. } = step.action {
                assert!(TEST[..place].iter().any(|earlier| earlier.name == after), "{after}");
            }
        }
    }

    #[test]
    fn benches_are_found_by_their_files() {
        let names = bench_names(Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()).unwrap();
        assert!(names.contains(&"membrane".to_owned()), "{names:?}");
        assert!(names.is_sorted());
        assert!(LONG_TO_COMPILE.iter().all(|name| names.contains(&(*name).to_owned())));
    }
}
