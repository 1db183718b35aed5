//! The flight code on a Cortex-M7: built, played against the host bit for bit, measured, compared
//! with recorded figures.
//!
//! 1. Every arm flies the avoidance manoeuvre here, and a policy commands one; QEMU plays the
//!    recorded frames and must say the same hashes. So it must for a hundred pieces of flight in
//!    which a sensor fails.
//! 2. A flight with the flight code in QEMU must leave the same log, byte for byte, as one without.
//! 3. Negative controls: another mass by one bit must change the hashes, a step that may panic must
//!    not link.
//! 4. The workspace is linted; the image for the real part is built and sized, and what of it needs
//!    no hardware is tested.
//! 5. Instructions of control and of the estimator, size of the images that hold nothing but one of
//!    them or the whole step, worst-case stack, against `firmware/figures.txt` and the budget;
//!    `--write` takes the new ones, and writes the setup that the board's tests read.

mod board;
mod elf;
mod figures;
mod policy;
mod stack;

use crate::run::{installed_on_ci, programs, root, succeeds, target_directory};
use crate::thumb;
use elf::Elf;
use figures::{FIGURES, Figures, check_budget, compare, parse, recorded};
use std::path::{Path, PathBuf};
use std::process::Command;

const QEMU: &str = "qemu-system-arm";
const ARMS: [&str; 9] = [
    "pc",
    "pc_wings_open",
    "wiic_no_wings",
    "phantom",
    "twcc_flat",
    "twcc_parnn",
    "twcc_oracle",
    "twcc_plus",
    "pc_plus",
];
/// Which of them has the most to do.
const LEARNED: usize = 5;
const SETUP: &str = "firmware/h747/testdata/setup.bin";
const FAULTS: &str = "100";

/// `cargo xtask firmware`.
pub(crate) fn chore(arguments: &[String]) -> Result<(), String> {
    match arguments {
        [] => check(),
        [write] if write == "--write" => {
            host()?.write_setup()?;
            let figures = measure()?;
            check_budget(&figures)?;
            let path = root()?.join(FIGURES);
            let partial = path.with_extension("partial");
            std::fs::write(&partial, recorded(&figures))
                .and_then(|()| std::fs::rename(&partial, &path))
                .map_err(|error| format!("{}: {error}", path.display()))?;
            eprintln!("wrote {FIGURES}");
            Ok(())
        }
        // As `cargo xtask test` has it: left out without an emulator, but never on CI.
        [where_possible] if where_possible == "--if-emulator" => match emulator() {
            Err(_) if std::env::var_os("CI").is_none() => {
                eprintln!("skipped: no {QEMU} (apt install {QEMU})");
                Ok(())
            }
            _ => check(),
        },
        _ => Err(format!(
            "arguments = {}: must be none, --write or --if-emulator",
            arguments.join(" ")
        )),
    }
}

/// Builds, plays, measures and compares.
///
/// # Errors
/// What differs, is missing or grew.
fn check() -> Result<(), String> {
    let figures = measure()?;
    let path = root()?.join(FIGURES);
    let text =
        std::fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    let (table, grown) = compare(&figures, &parse(&text)?);
    eprint!("{table}");
    check_budget(&figures)?;
    if grown.is_empty() {
        Ok(())
    } else {
        Err(format!(
            "{FIGURES}: {} grew; `cargo xtask firmware --write` takes the new figures",
            grown.join(", ")
        ))
    }
}

/// Builds the host's program.
fn host() -> Result<Squirrel, String> {
    let folder = target_directory()?.join("firmware");
    std::fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    Ok(Squirrel { program: programs(&["squirrel"])?.join("squirrel"), folder })
}

fn measure() -> Result<Figures, String> {
    emulator()?;
    let squirrel = host()?;
    board::check()?;
    squirrel.record()?;
    // Both negative controls first: the real images take their places.
    build(&["--package=squirrel-m7", "--bin", "play", "--features", "changed-constant"])?;
    let changed = squirrel.play("flights")?;
    if changed.lines.iter().any(|line| line.contains(" same ")) || changed.well {
        return Err("another mass by one bit: the emulated outputs did not change".to_owned());
    }
    eprintln!("negative control: another mass by one bit changes the hash of every flight");
    let wrong =
        thumb::build(&["--package=squirrel-m7", "--bin", "step", "--features", "may-panic"], true)?;
    if wrong.status.success()
        || !String::from_utf8_lossy(&wrong.stderr).contains("a_panic_can_be_reached")
    {
        return Err("a step that may panic: linked, or failed for another reason".to_owned());
    }
    eprintln!("negative control: a step that may panic does not link");

    let images = build(&["--package=squirrel-m7"])?;
    eprintln!("no panic can be reached from control nor the whole step: their images link");
    let mut flights = squirrel.play("flights")?;
    // The mass is nothing to a flight that is commanded, so that it is no part of the negative
    // control.
    let commanded = squirrel.play("commanded")?;
    flights.lines.extend(commanded.lines.into_iter().skip(1));
    let faults = squirrel.play("faults")?;
    if !(flights.well && commanded.well && faults.well) {
        let lines = flights.lines.iter().chain(&faults.lines);
        let differs: Vec<&str> =
            lines.filter(|l| !l.contains(" same ")).map(String::as_str).collect();
        return Err(format!("outputs on the M7 are not the host's: {}", differs.join("; ")));
    }
    let flown = flights.lines.len() - 1;
    eprintln!("{flown} flights and {FAULTS} faults: every output of the M7 is the host's");
    squirrel.hardware_in_the_loop(&images)?;
    eprintln!("fly --hil qemu: the same log, byte for byte");

    let mut figures = flights.figures()?;
    for (image, function, names) in [
        ("control", "squirrel_control", figures::OF_CONTROL),
        ("step", "squirrel_step", figures::OF_STEP),
    ] {
        let path = images.join(image);
        let bytes = std::fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        let elf = Elf::parse(&bytes).map_err(|error| format!("{}: {error}", path.display()))?;
        let (stack_bytes, chain) = stack::worst_case(&elf, function)?;
        eprintln!("{image}: deepest chain of calls: {}", chain.join(" > "));
        let values = [elf.size(".text"), elf.size(".rodata"), stack_bytes];
        figures.extend(names.into_iter().zip(values.map(u64::from)));
    }
    board::size(&mut figures)?;
    Ok(figures)
}

/// What is missing here that the step leaves out or, on CI, cannot do without.
///
/// # Errors
/// No emulator, before anything is built.
pub(crate) fn missing() -> Result<Option<String>, String> {
    match emulator() {
        Ok(()) => Ok(None),
        Err(_) if std::env::var_os("CI").is_none() => {
            Ok(Some(format!("no {QEMU}, so that the firmware is left out (apt install {QEMU})")))
        }
        Err(error) => Err(error),
    }
}

/// Looks for the emulator. Where nobody can be asked, on CI as root, it is installed.
fn emulator() -> Result<(), String> {
    let there = || succeeds(Command::new(QEMU).arg("--version"));
    if there() || (installed_on_ci(&[QEMU]) && there()) {
        return Ok(());
    }
    Err(format!("no {QEMU}; install it by\n    apt install {QEMU}"))
}

/// Builds the images; their folder.
fn build(arguments: &[&str]) -> Result<PathBuf, String> {
    let done = thumb::build(arguments, false)?;
    if done.status.success() {
        thumb::images()
    } else {
        Err("the firmware does not build".to_owned())
    }
}

/// Runs an image that says at least two lines.
fn emulate(image: &str, argument: Option<&str>, folder: &Path) -> Result<Played, String> {
    let mut command = Command::new(QEMU);
    command.args(["-machine", "mps2-an500", "-cpu", "cortex-m7", "-nographic", "-monitor", "none"]);
    command.args(["-serial", "none", "-icount", "shift=6", "-semihosting-config"]);
    let argument = argument.map_or(String::new(), |argument| format!(",arg={argument}"));
    command.arg(format!("enable=on,target=native,arg={image}{argument}"));
    let done =
        command.arg("-kernel").arg(thumb::images()?.join(image)).current_dir(folder).output();
    let done = done.map_err(|error| format!("{QEMU}: {error}"))?;
    let text = String::from_utf8_lossy(&done.stdout);
    let lines: Vec<String> = text.lines().map(str::to_owned).collect();
    if lines.len() < 2 {
        return Err(format!("{QEMU}: {image}{argument}: said `{}`", text.trim()));
    }
    Ok(Played { lines, well: done.status.success() })
}

/// The host's program and a folder for what it makes.
struct Squirrel {
    program: PathBuf,
    folder: PathBuf,
}

impl Squirrel {
    fn run(&self, arguments: &[&str]) -> Result<(), String> {
        let mut command = Command::new(&self.program);
        let done = command.args(arguments).current_dir(&self.folder).output();
        let done = done.map_err(|error| format!("{}: {error}", self.program.display()))?;
        let said = String::from_utf8_lossy(&done.stderr);
        if done.status.success() {
            Ok(())
        } else {
            Err(format!("{}: {}", arguments.join(" "), said.trim()))
        }
    }

    /// Flies all arms, and one by commands of a policy; vectors of the flights, and of faults in
    /// one of them.
    fn record(&self) -> Result<(), String> {
        let logs = ARMS.map(|arm| format!("{arm}.mcap"));
        for (arm, log) in ARMS.iter().zip(&logs) {
            self.run(&["fly", "--arm", arm, "--scenario", "avoid", "--out", log])?;
        }
        let path = self.folder.join("policy.safetensors");
        std::fs::write(&path, policy::file())
            .map_err(|error| format!("{}: {error}", path.display()))?;
        let commanded = "policy.mcap";
        self.run(&[
            "fly",
            "--policy",
            "policy.safetensors",
            "--scenario",
            "track",
            "--out",
            commanded,
        ])?;
        let mut export = vec!["export-vectors", "--out", "flights"];
        export.extend(logs.iter().map(String::as_str));
        self.run(&export)?;
        self.run(&["export-vectors", "--out", "commanded", commanded])?;
        self.run(&["export-vectors", "--out", "faults", "--faults", FAULTS, &logs[LEARNED]])
    }

    /// The setup that the tests of the real part's image read: of a hover, in the version of today.
    fn write_setup(&self) -> Result<(), String> {
        self.run(&["fly", "--scenario", "hover", "--out", "hover.mcap"])?;
        self.run(&["export-vectors", "--out", "hover", "hover.mcap"])?;
        let path = root()?.join(SETUP);
        std::fs::copy(self.folder.join("hover/setup-0.bin"), &path)
            .map_err(|error| format!("{}: {error}", path.display()))?;
        eprintln!("wrote {SETUP}");
        Ok(())
    }

    fn play(&self, vectors: &str) -> Result<Played, String> {
        emulate("play", Some(&format!("{vectors}/vectors.bin")), &self.folder)
    }

    fn hardware_in_the_loop(&self, images: &Path) -> Result<(), String> {
        let image = images.join("link");
        let image = image.to_str().ok_or("a path that is no text")?;
        self.run(&[
            "fly",
            "--arm",
            ARMS[LEARNED],
            "--hil",
            "qemu",
            "--hil-image",
            image,
            "--out",
            "hil.mcap",
        ])?;
        let read = |name: &str| {
            let path = self.folder.join(name);
            std::fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))
        };
        if read("hil.mcap")? == read(&format!("{}.mcap", ARMS[LEARNED]))? {
            Ok(())
        } else {
            Err("fly --hil qemu: another log than without".to_owned())
        }
    }
}

/// What an image said: `play` a line of memory, then a line a sequence.
struct Played {
    lines: Vec<String>,
    well: bool,
}

impl Played {
    /// Means and worst cases over all sequences.
    fn figures(&self) -> Result<Figures, String> {
        let wrong = || format!("{QEMU}: said {:?}", self.lines);
        let number = |words: &[&str], i: usize| {
            words.get(i).and_then(|word| word.parse().ok()).ok_or_else(wrong)
        };
        let memory: Vec<&str> = self.lines[0].split(' ').collect();
        let mut figures = Figures::new();
        figures.insert("constants of a flight, B", number(&memory, 2)?);
        figures.insert("state, B", number(&memory, 4)?);
        let mut keep_largest = |name, value: u64| {
            let known = figures.entry(name).or_insert(value);
            *known = value.max(*known);
        };
        for (i, line) in self.lines[1..].iter().enumerate() {
            let words: Vec<&str> = line.split(' ').collect();
            for (name, at) in figures::OF_ANY_FLIGHT {
                keep_largest(name, number(&words, at)?);
            }
            // Sequences are in the order of `ARMS`, the policy's behind them.
            if i == LEARNED {
                for (name, at) in figures::OF_THE_LEARNED_ARM {
                    keep_largest(name, number(&words, at)?);
                }
            }
        }
        Ok(figures)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_the_image_become_figures() {
        let line = |inner: u32| {
            format!(
                "sequence 9 ab same inner 8 10 {inner} outer 1 20 30 inertial 7 40 50 aided 2 60 70 whole 9 80 90"
            )
        };
        let mut lines = vec!["memory stack 5 state 6".to_owned()];
        lines.extend((0..7).map(line));
        let figures = Played { lines, well: true }.figures().unwrap();
        assert_eq!(figures["state, B"], 6);
        assert_eq!(figures["inner step, worst, instructions"], 6);
        assert_eq!(figures["inner and outer step with paRNN, worst, instructions"], 30);
        assert_eq!(figures["estimator, inertial units alone, worst, instructions"], 50);
        assert_eq!(figures["estimator, fix, barometer or compass too, mean, instructions"], 60);
        assert_eq!(figures["whole step, worst, instructions"], 90);
        let broken = Played { lines: vec!["memory".to_owned(), "x".to_owned()], well: true };
        assert!(broken.figures().is_err());
    }
}
