//! What people see of long work: on a terminal a bar that says how far it is, in a pipe nothing.
#![cfg(unix)]

use super::support::Folder;
use std::path::PathBuf;
use std::process::Command;

/// A terminal of Python's standard library: a crate that opens one asks features of `libc` that the
/// program does not have, and cargo would compile all of it twice.
const TERMINAL: &str = r#"
import fcntl, os, struct, subprocess, sys, termios
user, program = os.openpty()
fcntl.ioctl(program, termios.TIOCSWINSZ, struct.pack("HHHH", 30, 100, 0, 0))
child = subprocess.Popen(sys.argv[1:], stdout=subprocess.DEVNULL, stderr=program)
os.close(program)
try:
    while piece := os.read(user, 4096):
        sys.stdout.buffer.write(piece)
except OSError:
    pass  # how Linux says that the program has closed its end
sys.exit(child.wait())
"#;

/// What a command writes to stderr where that is a terminal.
fn shown(folder: &Folder, arguments: &[&str]) -> String {
    let python = std::env::var_os("SQUIRREL_PYTHON").map_or("python3".into(), PathBuf::from);
    let done = Command::new(python)
        .args(["-c", TERMINAL, env!("CARGO_BIN_EXE_squirrel")])
        .args(arguments)
        .current_dir(&folder.0)
        .env("TERM", "xterm")
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&done.stdout).into_owned();
    let problem = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success(), "{arguments:?}: {text} {problem}");
    text
}

#[test]
fn long_work_shows_how_far_it_is() {
    let folder = Folder::new("terminal");
    folder.succeeds(&["fly", "--scenario", "excite_rich", "--arm", "pc", "--out", "f.mcap"]);
    let commands: [(&[&str], &str); 4] = [
        (
            &["train", "vanilla", "--flights", "f.mcap", "--epochs", "40", "--out", "w"],
            "/40 epochs",
        ),
        (&["study", "faults", "--trials", "20"], " flights"),
        (&["fly", "--scenario", "excite_rich"], " x 0.1 s"),
        (&["gap", "name", "--vehicle", "squirrel", "--flights", "f.mcap"], "naming"),
    ];
    for (arguments, words) in commands {
        let seen = shown(&folder, arguments);
        assert!(seen.contains(words), "{arguments:?}: {seen:?}");
        let piped = String::from_utf8(folder.run(arguments).stderr).unwrap();
        assert!(!piped.contains(words) && !piped.contains('\r'), "{arguments:?}: {piped:?}");
    }
}
