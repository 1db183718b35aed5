//! Processes of the program about one case.

use super::checked::Check;
use super::verdict::Verdict;
use crate::case::{FLIGHTS, GOOD_FROM};
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
    let good: Vec<_> = FLIGHTS[GOOD_FROM..].iter().map(|flight| case.join(flight)).collect();
    if good.iter().all(|flight| flight.exists()) {
        command.arg("--baseline").args(good);
    }
    command.arg("--out").arg(results);
    let log = results.join("stderr.txt");
    let log = std::fs::File::create(&log).map_err(|error| format!("{}: {error}", log.display()))?;
    start_of(command, squirrel, log)
}

fn start_of(mut command: Command, squirrel: &Path, log: std::fs::File) -> Result<Child, String> {
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

/// What the program says beforehand of the flights that names come from: `gap check`.
#[allow(clippy::disallowed_methods, reason = "a program that hangs must be seen")]
pub(super) fn check(squirrel: &Path, case: &Path, results: &Path) -> Result<Check, String> {
    let json = results.join("check.json");
    let mut command = Command::new(squirrel);
    command.args(["gap", "check", "--vehicle"]).arg(case.join("vehicle.toml"));
    command.arg("--flights").args(FLIGHTS[..2].iter().map(|flight| case.join(flight)));
    command.arg("--json").arg(&json);
    let log = results.join("check-stderr.txt");
    let log = std::fs::File::create(&log).map_err(|error| format!("{}: {error}", log.display()))?;
    wait(start_of(command, squirrel, log)?, Instant::now())
        .map_err(|error| format!("check: {error}"))?;
    let text = std::fs::read_to_string(json).map_err(|error| format!("check: {error}"))?;
    serde_json::from_str(&text).map_err(|error| format!("check: {error}"))
}

/// The part of `find`'s answer that the bench looks at.
#[derive(serde::Deserialize)]
struct Finding {
    residual: Residual,
}

#[derive(serde::Deserialize)]
struct Residual {
    force_body_rms_n: [f64; 3],
    moment_body_rms_n_m: [f64; 3],
}

/// Mean squared residual of a flight against a vehicle file, by channel: `gap find`.
///
/// * `json` - where the program is to write it
#[allow(clippy::disallowed_methods, reason = "a program that hangs must be seen")]
fn residual(
    squirrel: &Path,
    vehicle: &Path,
    flight: &Path,
    json: &Path,
) -> Result<[f64; 6], String> {
    let mut command = Command::new(squirrel);
    command.args(["gap", "find", "--vehicle"]).arg(vehicle);
    command.arg("--flights").arg(flight).arg("--json").arg(json);
    let log = json.with_extension("txt");
    let log = std::fs::File::create(&log).map_err(|error| format!("{}: {error}", log.display()))?;
    wait(start_of(command, squirrel, log)?, Instant::now())
        .map_err(|error| format!("find: {error}"))?;
    let text = std::fs::read_to_string(json).map_err(|error| format!("find: {error}"))?;
    let found: Finding = serde_json::from_str(&text).map_err(|error| format!("find: {error}"))?;
    let (f, m) = (found.residual.force_body_rms_n, found.residual.moment_body_rms_n_m);
    Ok([f[0], f[1], f[2], m[0], m[1], m[2]].map(|x| x * x))
}

/// Which part of the held-out residual that can be removed a patched vehicle file removes.
///
/// ```text
/// J(file) = mean over channels of MS(file) / MS(truth)      MS: mean squared residual of the held-out flight
/// share = (J(given) - J(patched)) / (J(given) - 1)
/// ```
/// Truth is the given file with what is hidden in it, so that neither tolerances nor what is
/// unmodelled count. `None` where the truth removes next to nothing of this residual, as for what
/// acts late: `find` puts commands where the log has them.
pub(super) fn removable_removed(
    squirrel: &Path,
    case: &Path,
    truth: &Path,
    patched: &Path,
    results: &Path,
) -> Result<Option<f64>, String> {
    let flight = case.join(FLIGHTS[2]);
    let of = |vehicle: &Path, name: &str| residual(squirrel, vehicle, &flight, &results.join(name));
    let given = of(&case.join("vehicle.toml"), "find-given.json")?;
    let (patched, truth) = (of(patched, "find-patched.json")?, of(truth, "find-truth.json")?);
    Ok(share_removed(&given, &patched, &truth))
}

fn share_removed(given: &[f64; 6], patched: &[f64; 6], truth: &[f64; 6]) -> Option<f64> {
    let over =
        |own: &[f64; 6]| own.iter().zip(truth).map(|(own, truth)| own / truth).sum::<f64>() / 6.0;
    let removable = over(given) - 1.0;
    (removable > REMOVABLE_MIN).then(|| (over(given) - over(patched)) / removable)
}

/// Part of the true file's residual that counts as something to remove.
const REMOVABLE_MIN: f64 = 0.02;

/// The verdict in a file.
pub(super) fn read(json: &Path) -> Result<Verdict, String> {
    let text = std::fs::read_to_string(json).map_err(|error| format!("verdict: {error}"))?;
    serde_json::from_str(&text).map_err(|error| format!("verdict: {error}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_counted_between_the_given_and_the_true_file() {
        let (given, truth) = ([4.0, 1.0, 1.0, 1.0, 1.0, 1.0], [1.0; 6]);
        let half = [2.5, 1.0, 1.0, 1.0, 1.0, 1.0];
        assert_eq!(share_removed(&given, &half, &truth), Some(0.5));
        assert_eq!(share_removed(&given, &truth, &truth), Some(1.0));
        assert_eq!(share_removed(&given, &given, &truth), Some(0.0));
        assert_eq!(share_removed(&truth, &half, &truth), None, "there is nothing to remove");
    }
}
