//! The repository's chores: `cargo xtask CHORE`.
//!
//! No dependency, so that the first command on a fresh machine starts within seconds. Talk goes to
//! stderr.

mod beside;
mod chores;
mod docs;
mod effect;
mod firmware;
mod fresh;
mod growth;
mod notices;
mod package;
mod png;
mod python;
mod run;
mod slow;
mod targets;
mod thumb;
mod view;
mod weights;
mod wheel;
mod zig;

use std::process::ExitCode;

/// A chore: name, arguments, what it does, how.
type Chore = (&'static str, &'static str, &'static str, fn(&[String]) -> Result<(), String>);

const CHORES: [Chore; 21] = [
    (
        "test",
        "[--quick]",
        "everything that a change must pass; sets up what it needs; --quick: minutes, without what is slow",
        chores::test,
    ),
    (
        "lint",
        "",
        "format, clippy, the simulator without rapier and documentation only",
        chores::lint,
    ),
    (
        "bench",
        "[ARGUMENT...]",
        "all criterion benches; arguments go to criterion (--quick)",
        chores::bench,
    ),
    (
        "gap-bench",
        "--cases N|--full --seed S [--json FILE]",
        "score the gap workflow on hidden effects; --set NAME for one set, --keep DIR for the cases",
        chores::gap_bench,
    ),
    (
        "attack",
        "[COUNT [SEED]]",
        "so many mutated files of each kind (2500), logs under limits of memory and time, against their readers",
        chores::attack,
    ),
    (
        "kill",
        "[COUNT [SEED]]",
        "kill fly, study, train, gap run and import at so many moments each (200): old files or new ones, whole",
        chores::kill,
    ),
    (
        "growth",
        "[MINUTES]",
        "time and memory of gap run, fly, replay and import by flights and minutes (120); fails where memory grows",
        growth::chore,
    ),
    (
        "batch-gate",
        "",
        "what wide registers are worth to batches; fails below 5 (AVX2) or 7 times (AVX-512)",
        chores::batch_gate,
    ),
    ("thumb", "", "check that the flight code compiles for a Cortex-M7 without std", thumb::chore),
    (
        "firmware",
        "[--write|--if-emulator]",
        "the flight code on an emulated Cortex-M7: same bits, size, instructions; --write takes new figures",
        firmware::chore,
    ),
    (
        "weights",
        "[--write]",
        "fly and train the shipped paRNN again, compare its bytes; --write takes the new ones",
        weights::chore,
    ),
    (
        "wheel",
        "[--environment|ARGUMENT...]",
        "build the Python package, install it, run its tests; arguments go to pytest",
        wheel::chore,
    ),
    (
        "package",
        "[crates|sdist|wheels|installs|sdist-builds]...",
        "what is published: crates, wheels for old glibc on two machines, the sdist; made, checked, installed",
        package::chore,
    ),
    (
        "notices",
        "[--write]",
        "licences of what is compiled into the Python package; --write takes the list of now",
        notices::chore,
    ),
    (
        "targets",
        "[TARGET...]",
        "check the workspace for macOS, Windows and aarch64 Linux",
        targets::chore,
    ),
    (
        "docs",
        "[--site|--pages|--page PAGE|--write]",
        "build the guide, check its links, run what its pages show (--pages, with what is built); --write takes the page of commands",
        docs::chore,
    ),
    (
        "report-png",
        "[--write|HTML [PNG [WIDTHxHEIGHT]]]",
        "draw a report with a headless Chromium; without a file, the gap report of a hidden effect; --write takes the README's picture",
        png::chore,
    ),
    (
        "view-png",
        "[--write]",
        "two flights as a 3-D scene in a headless Chromium, held against their figures; --write takes the guide's picture",
        view::chore,
    ),
    (
        "effect",
        "",
        "one more effect, as docs/adding-an-effect.md adds it, in a copy: it flies and is named",
        effect::chore,
    ),
    (
        "pictures",
        "",
        "draw the pictures of README and guide again, into docs/pictures",
        chores::pictures,
    ),
    (
        "clean-fresh",
        "",
        "clone HEAD into a temporary directory, run the README's two commands there",
        fresh::chore,
    ),
];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some((name, rest)) = arguments.split_first() else {
        eprint!("{}", usage());
        return ExitCode::SUCCESS;
    };
    let Some((_, _, _, chore)) = CHORES.iter().find(|chore| chore.0 == name) else {
        eprint!("xtask: no chore '{name}'\n{}", usage());
        return ExitCode::from(2);
    };
    match chore(rest) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("xtask {name}: {error}");
            ExitCode::FAILURE
        }
    }
}

fn usage() -> String {
    use std::fmt::Write as _;
    let mut text = String::from("cargo xtask CHORE\n");
    for (name, arguments, about, _) in CHORES {
        let _ = writeln!(text, "  {:<39} {about}", format!("{name} {arguments}"));
    }
    text
}
