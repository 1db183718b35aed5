//! Steps: commands or functions run one after another, some chores beside them, with a table of
//! seconds at the end.

use crate::beside::Beside;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

/// One step of a chore.
pub(crate) struct Step {
    /// What the header, the table and a failure call it.
    pub(crate) name: &'static str,
    pub(crate) action: Action,
}

pub(crate) enum Action {
    /// Arguments of cargo.
    Cargo(&'static [&'static str]),
    /// The same with one environment variable.
    CargoWith((&'static str, &'static str), &'static [&'static str]),
    /// A function of ours; its note stands in the table.
    Function(fn() -> Result<String, String>),
    /// A chore that begins when the step `after` has ended, and is waited for here: it fills the
    /// processor where the steps between do not. It must share no folder with them.
    Beside { after: &'static str, chore: &'static [&'static str] },
}

/// Installs Debian's packages where nobody can be asked, on CI as root; whether it did.
pub(crate) fn installed_on_ci(packages: &[&str]) -> bool {
    let apt = |arguments: &[&str]| succeeds(Command::new("apt-get").arg("--quiet").args(arguments));
    std::env::var_os("CI").is_some()
        && output(Command::new("id").arg("-u")).as_deref() == Some("0")
        && apt(&["update"])
        && apt(&[&["install", "--yes", "--no-install-recommends"], packages].concat())
}

/// Runs the steps until the first that fails.
///
/// # Errors
/// The name of the failed step and its error.
pub(crate) fn run(steps: &[Step]) -> Result<(), String> {
    let mut rows = Vec::new();
    let mut beside = Vec::new();
    let mut failure = None;
    for step in steps {
        eprintln!("\n==> {}", step.name);
        let (result, time) = match begun(&mut beside, step.name) {
            Some(chore) => chore.end(),
            None => timed(|| act(&step.action)),
        };
        rows.push((step.name, time, result.clone()));
        if let Err(error) = result.and_then(|_| begin_after(step.name, steps, &mut beside)) {
            failure = Some(format!("step '{}' failed: {error}", step.name));
            break;
        }
    }
    eprint!("\n{}", table(&rows));
    failure.map_or(Ok(()), Err)
}

/// Starts the chores that begin when a step has ended.
fn begin_after(
    ended: &str,
    steps: &[Step],
    beside: &mut Vec<(&'static str, Beside)>,
) -> Result<(), String> {
    for step in steps {
        if let Action::Beside { after, chore } = step.action
            && after == ended
        {
            beside.push((step.name, Beside::begin(chore)?));
        }
    }
    Ok(())
}

/// The chore of a step that has begun.
fn begun(beside: &mut Vec<(&'static str, Beside)>, name: &str) -> Option<Beside> {
    let place = beside.iter().position(|(own, _)| *own == name)?;
    Some(beside.swap_remove(place).1)
}

#[allow(clippy::disallowed_methods, reason = "the wall clock is what the table shows")]
pub(crate) fn timed<T>(work: impl FnOnce() -> T) -> (T, Duration) {
    let start = Instant::now();
    let result = work();
    (result, start.elapsed())
}

fn act(action: &Action) -> Result<String, String> {
    match action {
        Action::Cargo(arguments) => call(cargo()?.args(*arguments)).map(|()| String::new()),
        Action::CargoWith((key, value), arguments) => {
            call(cargo()?.env(key, value).args(*arguments)).map(|()| String::new())
        }
        Action::Function(function) => function(),
        Action::Beside { chore, .. } => Beside::begin(chore)?.end().0,
    }
}

fn table(rows: &[(&str, Duration, Result<String, String>)]) -> String {
    use std::fmt::Write as _;
    let mut text = format!("{:<10} {:>8}\n", "step", "seconds");
    for (name, time, result) in rows {
        let verdict = match result {
            Ok(note) if note.is_empty() => "ok".to_owned(),
            Ok(note) => format!("ok, {note}"),
            Err(_) => "FAILED".to_owned(),
        };
        let _ = writeln!(text, "{name:<10} {:>8.1}  {verdict}", time.as_secs_f64());
    }
    text
}

/// The repository, which cargo tells a program that it runs.
///
/// # Errors
/// Where the program was not started by cargo.
pub(crate) fn root() -> Result<PathBuf, String> {
    let package = std::env::var_os("CARGO_MANIFEST_DIR").ok_or("start it as `cargo xtask`")?;
    PathBuf::from(package)
        .parent()
        .map(PathBuf::from)
        .ok_or_else(|| "xtask has no parent directory".to_owned())
}

/// Where cargo puts what it builds, and we what we make.
///
/// # Errors
/// As [`root`].
pub(crate) fn target_directory() -> Result<PathBuf, String> {
    // `join` with an absolute path gives that path.
    Ok(root()?.join(std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into())))
}

/// Cargo at the root of the repository, with the Python of the tests in `SQUIRREL_PYTHON`.
///
/// # Errors
/// As [`root`].
pub(crate) fn cargo() -> Result<Command, String> {
    let mut command = Command::new("cargo");
    command.current_dir(root()?).env("SQUIRREL_PYTHON", crate::python::interpreter()?);
    Ok(command)
}

/// `PATH` with folders before those that it has.
///
/// # Errors
/// A folder whose name `PATH` cannot hold.
pub(crate) fn path_after(first: &[&Path]) -> Result<OsString, String> {
    let rest = std::env::var_os("PATH").unwrap_or_default();
    let first = first.iter().map(|folder| folder.to_path_buf());
    std::env::join_paths(first.chain(std::env::split_paths(&rest)))
        .map_err(|error| error.to_string())
}

/// Builds programs of the workspace, with the features that all its crates ask for, as tests are
/// built: of one crate alone, cargo would compile everything below it a second time. The folder
/// that they are in.
///
/// # Errors
/// As [`root`], or they do not build.
pub(crate) fn programs(names: &[&str]) -> Result<PathBuf, String> {
    let names = names.iter().flat_map(|name| ["--bin", name]);
    call(cargo()?.args(["build", "--release", "--locked", "--workspace"]).args(names))?;
    Ok(target_directory()?.join("release"))
}

/// Runs a command to its end; what it prints goes through.
///
/// # Errors
/// One line with the command, where it did not start or did not succeed.
pub(crate) fn call(command: &mut Command) -> Result<(), String> {
    let status = command.status().map_err(|error| format!("{}: {error}", line(command)))?;
    if status.success() { Ok(()) } else { Err(format!("{}: {status}", line(command))) }
}

/// What a command prints on stdout; nothing where it does not start or fails.
pub(crate) fn output(command: &mut Command) -> Option<String> {
    let output = command.output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

/// Whether a command starts and succeeds; what it prints is dropped.
pub(crate) fn succeeds(command: &mut Command) -> bool {
    output(command).is_some()
}

fn line(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    words.map(|word| word.to_string_lossy()).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Stdio;

    #[test]
    fn the_first_failure_stops_and_is_named() {
        let step = |name, function| Step { name, action: Action::Function(function) };
        let steps = [
            step("a", || Ok(String::new())),
            step("b", || Err("no fuel".to_owned())),
            step("c", || panic!("a step after a failed one")),
        ];
        assert_eq!(run(&steps).unwrap_err(), "step 'b' failed: no fuel");
        assert_eq!(run(&steps[..1]), Ok(()));
    }

    #[test]
    fn the_table_has_seconds_and_verdicts() {
        let second = Duration::from_millis(1240);
        let rows = [
            ("clippy", second, Ok(String::new())),
            ("thumb", second, Ok("plain".into())),
            ("demo", second, Err("x".into())),
        ];
        assert_eq!(
            table(&rows),
            "step        seconds\nclippy          1.2  ok\nthumb           1.2  ok, plain\ndemo            1.2  FAILED\n"
        );
    }

    #[test]
    fn a_command_that_fails_is_quoted() {
        let error =
            call(Command::new("cargo").arg("--no-such-flag").stderr(Stdio::null())).unwrap_err();
        assert!(error.starts_with("cargo --no-such-flag: "), "{error}");
        let error = call(&mut Command::new("no-such-program-of-squirrel")).unwrap_err();
        assert!(error.starts_with("no-such-program-of-squirrel: "), "{error}");
    }
}
