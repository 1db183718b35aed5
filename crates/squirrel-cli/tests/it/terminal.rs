//! What people see of long work: on a terminal a bar that says how far it is, in a pipe nothing.
#![cfg(unix)]

use super::support::Folder;
use nix::pty::{Winsize, openpty};
use std::fs::File;
use std::io::Read;
use std::process::{Command, Stdio};

/// A terminal: the end that a user looks at, and the one that a program writes to.
fn terminal() -> (File, File) {
    let size = Winsize { ws_row: 30, ws_col: 100, ws_xpixel: 0, ws_ypixel: 0 };
    let ends = openpty(Some(&size), None).unwrap();
    // Copies, which other children do not inherit, unlike what the system gives.
    let [user, program] = [ends.master, ends.slave].map(|end| end.try_clone().unwrap());
    (File::from(user), File::from(program))
}

/// What a command writes to stderr where that is a terminal.
fn shown(folder: &Folder, arguments: &[&str]) -> String {
    let (mut user, program) = terminal();
    let mut child = Command::new(env!("CARGO_BIN_EXE_squirrel"))
        .args(arguments)
        .current_dir(&folder.0)
        .env("TERM", "xterm")
        .stdout(Stdio::null())
        .stderr(program)
        .spawn()
        .unwrap();
    // Until the program has closed its end, which reads as an error on Linux.
    let (mut text, mut piece) = (Vec::new(), [0; 4096]);
    while let Ok(length @ 1..) = user.read(&mut piece) {
        text.extend_from_slice(&piece[..length]);
    }
    let text = String::from_utf8_lossy(&text).into_owned();
    assert!(child.wait().unwrap().success(), "{arguments:?}: {text}");
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
