//! The flight code on a Cortex-M7: built, played against the host bit for bit, measured, compared with recorded figures.
//!
//! 1. Every arm flies the avoidance manoeuvre here, and a policy commands one; QEMU plays the recorded frames and must say the
//!    same hashes. So it must for a hundred pieces of flight in which a sensor fails.
//! 2. A flight with the flight code in QEMU must leave the same log, byte for byte, as one without.
//! 3. Negative controls: another mass by one bit must change the hashes, a step that may panic must not link.
//! 4. The workspace is linted; the image for the real part is built and sized, and what of it needs no hardware is tested.
//! 5. Instructions of a step, size of the image that holds nothing but the step, its worst-case stack, against
//!    `firmware/figures.txt`; `--write` takes the new ones.

mod board;
mod elf;
mod policy;
mod stack;

use crate::run::{call, cargo, installed_on_ci, root, succeeds, target_directory};
use crate::thumb;
use elf::Elf;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

const QEMU: &str = "qemu-system-arm";
const ARMS: [&str; 7] =
    ["pc", "pc_wings_open", "wiic_no_wings", "phantom", "twcc_flat", "twcc_parnn", "twcc_oracle"];
/// Which of them has the most to do.
const LEARNED: usize = 5;
const FAULTS: &str = "100";
const FIGURES: &str = "firmware/figures.txt";
/// A figure that grows by more than this is an error: compilers differ a little, careless code more.
const GROWTH_ALLOWED: f64 = 0.05;
/// Clock of the real part, and rates of the loops, Hz.
const CLOCK_HZ: f64 = 480e6;
const RATES_HZ: [f64; 2] = [300.0, 10.0];

/// `cargo xtask firmware`.
pub(crate) fn chore(arguments: &[String]) -> Result<(), String> {
    match arguments {
        [] => check().map(|_| ()),
        [write] if write == "--write" => {
            let figures = measure()?;
            let path = root()?.join(FIGURES);
            let partial = path.with_extension("partial");
            std::fs::write(&partial, recorded(&figures))
                .and_then(|()| std::fs::rename(&partial, &path))
                .map_err(|error| format!("{}: {error}", path.display()))?;
            eprintln!("wrote {FIGURES}");
            Ok(())
        }
        _ => Err(format!("arguments = {}: must be none or --write", arguments.join(" "))),
    }
}

/// [`check`] as a step of `cargo xtask test`: without an emulator it is left out and says so, but never on CI.
///
/// # Errors
/// As [`check`].
pub(crate) fn step() -> Result<String, String> {
    match emulator() {
        Err(_) if std::env::var_os("CI").is_none() => {
            let note = format!("skipped: no {QEMU} (apt install {QEMU})");
            eprintln!("{note}");
            Ok(note)
        }
        _ => check(),
    }
}

/// Builds, plays, measures and compares.
///
/// # Errors
/// What differs, is missing or grew.
pub(crate) fn check() -> Result<String, String> {
    let figures = measure()?;
    let path = root()?.join(FIGURES);
    let text = std::fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    let (table, grown) = compare(&figures, &parse(&text)?);
    eprint!("{table}");
    if grown.is_empty() {
        Ok(String::new())
    } else {
        Err(format!(
            "{FIGURES}: {} grew; `cargo xtask firmware --write` takes the new figures",
            grown.join(", ")
        ))
    }
}

/// A figure by its name with unit.
type Figures = BTreeMap<&'static str, u64>;

fn measure() -> Result<Figures, String> {
    emulator()?;
    let folder = target_directory()?.join("firmware");
    std::fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    call(cargo()?.args(["build", "--release", "--locked", "-p", "squirrel-cli"]))?;
    let squirrel = Squirrel { program: target_directory()?.join("release/squirrel"), folder };

    board::check()?;
    squirrel.record()?;
    // Both negative controls first: the real images take their places.
    build(&["--package=squirrel-m7", "--bin", "play", "--features", "changed-constant"])?;
    let changed = squirrel.play("flights")?;
    if changed.lines.iter().any(|line| line.contains(" same ")) || changed.well {
        return Err("another mass by one bit: the emulated outputs did not change".to_owned());
    }
    eprintln!("negative control: another mass by one bit changes the hash of every flight");
    let wrong = thumb::build(&["--package=squirrel-m7", "--bin", "step", "--features", "may-panic"], true)?;
    if wrong.status.success() || !String::from_utf8_lossy(&wrong.stderr).contains("a_panic_can_be_reached") {
        return Err("a step that may panic: linked, or failed for another reason".to_owned());
    }
    eprintln!("negative control: a step that may panic does not link");

    let images = build(&["--package=squirrel-m7"])?;
    eprintln!("no panic can be reached from the step: its image links");
    let mut flights = squirrel.play("flights")?;
    // The mass is nothing to a flight that is commanded, so that it is no part of the negative control.
    let commanded = squirrel.play("commanded")?;
    flights.lines.extend(commanded.lines.into_iter().skip(1));
    let faults = squirrel.play("faults")?;
    if !(flights.well && commanded.well && faults.well) {
        let lines = flights.lines.iter().chain(&faults.lines);
        let differs: Vec<&str> = lines.filter(|l| !l.contains(" same ")).map(String::as_str).collect();
        return Err(format!("outputs on the M7 are not the host's: {}", differs.join("; ")));
    }
    let flown = flights.lines.len() - 1;
    eprintln!("{flown} flights and {FAULTS} faults: every output of the M7 is the host's");
    squirrel.hardware_in_the_loop(&images)?;
    eprintln!("fly --hil qemu: the same log, byte for byte");

    let mut figures = flights.figures()?;
    let path = images.join("step");
    let bytes = std::fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    let elf = Elf::parse(&bytes).map_err(|error| format!("{}: {error}", path.display()))?;
    figures.insert("step image: text, B", elf.size(".text").into());
    figures.insert("step image: constants, B", elf.size(".rodata").into());
    let (bytes, chain) = stack::worst_case(&elf, "squirrel_step")?;
    eprintln!("deepest chain of calls: {}", chain.join(" > "));
    figures.insert("step: stack, worst case, B", bytes.into());
    board::size(&mut figures)?;
    Ok(figures)
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
    if done.status.success() { thumb::images() } else { Err("the firmware does not build".to_owned()) }
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
        if done.status.success() { Ok(()) } else { Err(format!("{}: {}", arguments.join(" "), said.trim())) }
    }

    /// Flies all arms, and one by commands of a policy; vectors of the flights, and of faults in one of them.
    fn record(&self) -> Result<(), String> {
        let logs = ARMS.map(|arm| format!("{arm}.mcap"));
        for (arm, log) in ARMS.iter().zip(&logs) {
            self.run(&["fly", "--arm", arm, "--scenario", "avoid", "--out", log])?;
        }
        let path = self.folder.join("policy.safetensors");
        std::fs::write(&path, policy::file()).map_err(|error| format!("{}: {error}", path.display()))?;
        let commanded = "policy.mcap";
        self.run(&["fly", "--policy", "policy.safetensors", "--scenario", "track", "--out", commanded])?;
        let mut export = vec!["export-vectors", "--out", "flights"];
        export.extend(logs.iter().map(String::as_str));
        self.run(&export)?;
        self.run(&["export-vectors", "--out", "commanded", commanded])?;
        self.run(&["export-vectors", "--out", "faults", "--faults", FAULTS, &logs[LEARNED]])
    }

    fn play(&self, vectors: &str) -> Result<Played, String> {
        let mut command = Command::new(QEMU);
        command.args(["-machine", "mps2-an500", "-cpu", "cortex-m7", "-nographic", "-monitor", "none"]);
        command.args(["-serial", "none", "-icount", "shift=6", "-semihosting-config"]);
        command.arg(format!("enable=on,target=native,arg=play,arg={vectors}/vectors.bin"));
        let done =
            command.arg("-kernel").arg(thumb::images()?.join("play")).current_dir(&self.folder).output();
        let done = done.map_err(|error| format!("{QEMU}: {error}"))?;
        let text = String::from_utf8_lossy(&done.stdout);
        let lines: Vec<String> = text.lines().map(str::to_owned).collect();
        if lines.len() < 2 {
            return Err(format!("{QEMU}: {vectors}: said `{}`", text.trim()));
        }
        Ok(Played { lines, well: done.status.success() })
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

/// What the image `play` said: a line of memory, then a line a sequence.
struct Played {
    lines: Vec<String>,
    well: bool,
}

impl Played {
    /// Means and worst cases over all sequences.
    fn figures(&self) -> Result<Figures, String> {
        let wrong = || format!("{QEMU}: said {:?}", self.lines);
        let number =
            |words: &[&str], i: usize| words.get(i).and_then(|word| word.parse().ok()).ok_or_else(wrong);
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
            keep_largest("inner step, mean of the worst arm, instructions", number(&words, 6)?);
            keep_largest("inner step, worst, instructions", number(&words, 7)?);
            // Sequences are in the order of `ARMS`, the policy's behind them.
            if i == LEARNED {
                keep_largest("inner and outer step with paRNN, mean, instructions", number(&words, 10)?);
                keep_largest("inner and outer step with paRNN, worst, instructions", number(&words, 11)?);
            }
        }
        Ok(figures)
    }
}

/// Name, recorded and measured figure a line, and what grew.
fn compare(measured: &Figures, recorded: &BTreeMap<String, u64>) -> (String, Vec<&'static str>) {
    let mut text = format!("{:<54} {:>9} {:>9}\n", "figure", "recorded", "now");
    let mut grown = Vec::new();
    for (name, now) in measured {
        let before = recorded.get(*name);
        let shown = before.map_or("-".to_owned(), u64::to_string);
        let _ = writeln!(text, "{name:<54} {shown:>9} {now:>9}");
        if before.is_none_or(|before| *now as f64 > *before as f64 * (1.0 + GROWTH_ALLOWED)) {
            grown.push(*name);
        }
    }
    let of = |name: &str| measured.get(name).map_or(0.0, |n| *n as f64);
    let load = RATES_HZ[0] * of("inner step, worst, instructions")
        + RATES_HZ[1] * of("inner and outer step with paRNN, worst, instructions");
    let percent = 100.0 * load / CLOCK_HZ;
    let _ = writeln!(
        text,
        "{:<54} {:>9} {percent:>8.2}%",
        "load at 480 MHz, one instruction a cycle (a proxy)", ""
    );
    (text, grown)
}

fn recorded(figures: &Figures) -> String {
    let mut text = String::from(
        "# Figures of the flight code on a Cortex-M7; `cargo xtask firmware --write` makes this file.\n",
    );
    for (name, value) in figures {
        let _ = writeln!(text, "{name}: {value}");
    }
    text
}

fn parse(text: &str) -> Result<BTreeMap<String, u64>, String> {
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    lines
        .map(|line| {
            let entry = line.rsplit_once(": ").and_then(|(name, n)| Some((name.to_owned(), n.parse().ok()?)));
            entry.ok_or_else(|| format!("{FIGURES}: `{line}`: must be a name, a colon and a number"))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_grows_is_named_and_the_rest_is_shown() {
        let now = Figures::from([("state, B", 110), ("step: stack, worst case, B", 100)]);
        let before =
            parse(&recorded(&Figures::from([("state, B", 100), ("step: stack, worst case, B", 99)])));
        let (table, grown) = compare(&now, &before.unwrap());
        assert_eq!(grown, ["state, B"]);
        assert!(table.lines().nth(1).unwrap().ends_with("100       110"), "{table}");
        let (_, new) = compare(&now, &BTreeMap::new());
        assert_eq!(new.len(), 2, "a figure that is not recorded is not passed over");
        assert!(parse("state").is_err());
    }

    #[test]
    fn lines_of_the_image_become_figures() {
        let line = |inner: u32| format!("sequence 9 ab same inner 8 10 {inner} outer 1 20 30");
        let mut lines = vec!["memory stack 5 state 6".to_owned()];
        lines.extend((0..7).map(line));
        let figures = Played { lines, well: true }.figures().unwrap();
        assert_eq!(figures["state, B"], 6);
        assert_eq!(figures["inner step, worst, instructions"], 6);
        assert_eq!(figures["inner and outer step with paRNN, worst, instructions"], 30);
        let broken = Played { lines: vec!["memory".to_owned(), "x".to_owned()], well: true };
        assert!(broken.figures().is_err());
    }
}
