//! A chore of ours in a process of its own, beside the steps: what it says is kept until it is
//! waited for.

use crate::run::timed;
use std::io::{PipeReader, Read as _, Write as _};
use std::process::{Child, Command, Stdio};
use std::thread::JoinHandle;
use std::time::Duration;

/// A chore that runs.
pub(crate) struct Beside {
    words: String,
    child: Child,
    /// What it said, and how long it took.
    said: Option<JoinHandle<(Vec<u8>, Duration)>>,
}

impl Beside {
    /// Starts it.
    ///
    /// # Errors
    /// It did not start.
    pub(crate) fn begin(chore: &[&str]) -> Result<Self, String> {
        let program = std::env::current_exe().map_err(|error| format!("xtask: {error}"))?;
        Self::start(Command::new(program).args(chore), chore.join(" "))
    }

    fn start(command: &mut Command, words: String) -> Result<Self, String> {
        let at = |error: std::io::Error| format!("{words}: {error}");
        let (reader, writer) = std::io::pipe().map_err(at)?;
        command.stdin(Stdio::null()).stdout(writer.try_clone().map_err(at)?).stderr(writer);
        let child = command.spawn().map_err(at)?;
        // The command keeps its ends of the pipe open, which would never end then.
        command.stdout(Stdio::null()).stderr(Stdio::null());
        let said = Some(std::thread::spawn(move || timed(|| all_of(reader))));
        Ok(Self { words, child, said })
    }

    /// Waits for it and prints what it said; its note, and its own time.
    ///
    /// # Errors
    /// It failed.
    pub(crate) fn end(mut self) -> (Result<String, String>, Duration) {
        let said = self.said.take().and_then(|said| said.join().ok());
        let (said, time) = said.unwrap_or_default();
        let _ = std::io::stderr().write_all(&said);
        let result = match self.child.wait() {
            Ok(status) if status.success() => Ok(note(&String::from_utf8_lossy(&said))),
            Ok(status) => Err(format!("{}: {status}", self.words)),
            Err(error) => Err(format!("{}: {error}", self.words)),
        };
        (result, time)
    }
}

impl Drop for Beside {
    /// Where another step failed, nobody waits for it.
    fn drop(&mut self) {
        // Of a process that has ended there is nothing to kill.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn all_of(mut from: PipeReader) -> Vec<u8> {
    let mut bytes = Vec::new();
    let _ = from.read_to_end(&mut bytes);
    bytes
}

/// What the table should say of it: the last line where that says that it was left out.
fn note(said: &str) -> String {
    said.lines().last().filter(|line| line.starts_with("skipped")).unwrap_or_default().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cargo(words: &[&str]) -> Result<Beside, String> {
        Beside::start(Command::new("cargo").args(words), words.join(" "))
    }

    #[test]
    fn it_ends_as_its_process_did() {
        assert_eq!(cargo(&["--version"]).unwrap().end().0, Ok(String::new()));
        let error = cargo(&["--no-such-flag"]).unwrap().end().0.unwrap_err();
        assert!(error.starts_with("--no-such-flag: exit"), "{error}");
        let none = Beside::start(&mut Command::new("no-such-program-of-squirrel"), "x".to_owned());
        assert!(none.is_err_and(|error| error.starts_with("x: ")));
    }

    #[test]
    fn what_was_left_out_is_a_note() {
        assert_eq!(note("building\nskipped: no emulator\n"), "skipped: no emulator");
        assert_eq!(note("skipped one\nof two\n"), "");
        assert_eq!(note(""), "");
    }
}
