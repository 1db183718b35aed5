//! One process of the program about one case.

use super::verdict::Verdict;
use crate::case::FLIGHTS;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// What came back.
#[derive(Debug)]
pub(super) struct Asked {
    pub(super) verdict: Result<Verdict, String>,
    /// Wall time of the process, s.
    pub(super) seconds: f64,
}

/// A process that takes longer is stopped and has failed.
const PATIENCE: Duration = Duration::from_secs(600);
const POLL: Duration = Duration::from_millis(5);

/// * `case` - folder with vehicle file and flights
/// * `results` - folder for what the program writes
#[allow(clippy::disallowed_methods, reason = "how long the program takes is a result")]
pub(super) fn ask(squirrel: &Path, case: &Path, results: &Path) -> Asked {
    let json = results.join("verdict.json");
    let start = Instant::now();
    let verdict = make_folder(results)
        .and_then(|()| process(squirrel, case, results))
        .and_then(|child| wait(child, start))
        .and_then(|()| read(&json));
    Asked { verdict, seconds: start.elapsed().as_secs_f64() }
}

fn make_folder(results: &Path) -> Result<(), String> {
    std::fs::create_dir_all(results).map_err(|error| format!("{}: {error}", results.display()))
}

fn process(squirrel: &Path, case: &Path, results: &Path) -> Result<Child, String> {
    let mut command = Command::new(squirrel);
    command.args(["gap", "run", "--vehicle"]).arg(case.join("vehicle.toml"));
    command.arg("--flights").args(FLIGHTS[..2].iter().map(|flight| case.join(flight)));
    command.arg("--held-out").arg(case.join(FLIGHTS[2]));
    command.arg("--out").arg(results);
    let log = results.join("stderr.txt");
    let log = std::fs::File::create(&log).map_err(|error| format!("{}: {error}", log.display()))?;
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(log);
    command.spawn().map_err(|error| format!("{}: {error}", squirrel.display()))
}

#[allow(clippy::disallowed_methods, reason = "a program that hangs must be seen")]
fn wait(mut child: Child, start: Instant) -> Result<(), String> {
    loop {
        match child.try_wait().map_err(|error| error.to_string())? {
            Some(status) if status.success() => return Ok(()),
            Some(status) => return Err(status.to_string()),
            None if start.elapsed() > PATIENCE => {
                child.kill().and_then(|()| child.wait()).map_err(|error| error.to_string())?;
                return Err(format!("stopped after {} s", PATIENCE.as_secs()));
            }
            None => std::thread::sleep(POLL),
        }
    }
}

/// The verdict in a file.
pub(super) fn read(json: &Path) -> Result<Verdict, String> {
    let text = std::fs::read_to_string(json).map_err(|error| format!("verdict: {error}"))?;
    serde_json::from_str(&text).map_err(|error| format!("verdict: {error}"))
}
