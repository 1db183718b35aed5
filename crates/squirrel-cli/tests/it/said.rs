//! What the program says to whoever asked it: all of it went out or it failed, and names from
//! files do nothing to a terminal.
#![cfg(unix)]

use crate::support::{Folder, SQUIRREL};
use squirrel_log::files::Lock;
use std::fs::OpenOptions;
use std::process::{Command, Output, Stdio};

/// On a disk that is full.
fn on_a_full_disk(folder: &Folder, arguments: &[&str]) -> Output {
    let full = OpenOptions::new().write(true).open("/dev/full").unwrap();
    Command::new(env!("CARGO_BIN_EXE_squirrel"))
        .args(arguments)
        .current_dir(&folder.0)
        .stdout(full)
        .output()
        .unwrap()
}

#[test]
fn what_was_not_printed_was_not_done() {
    let folder = Folder::new("full");
    for arguments in
        [&["fly", "--scenario", "hover"][..], &["--help"], &["fly", "--help"], &["--version"]]
    {
        let output = on_a_full_disk(&folder, arguments);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {stderr}");
        assert!(stderr.starts_with("error: stdout: No space left on device"), "{stderr}");
    }
    // Whoever closes a pipe has seen enough.
    let mut closed = Command::new(env!("CARGO_BIN_EXE_squirrel"))
        .args(["fly", "--scenario", "hover"])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    drop(closed.stdout.take());
    assert!(closed.wait().unwrap().success());
}

#[test]
fn a_name_from_outside_is_spelt_out_and_no_screenful() {
    let folder = Folder::new("names");
    folder.fails(
        &["fly", "--scenario", "a\u{1b}[31m\u{202e}\nb.toml"],
        &["error: a\\u{1b}[31m\\u{202e} b.toml: No such file"],
    );
    let long = "x".repeat(1 << 20);
    folder.write("key.toml", &format!("{SQUIRREL}\n[\"{long}\"]\n"));
    folder.write("line.toml", &format!("{SQUIRREL}\n{long} = [\n"));
    folder.write("escape.toml", &SQUIRREL.replacen("[limits]", "[\"li\\u001b[2Jmits\"]", 1));
    for file in ["key.toml", "line.toml", "escape.toml"] {
        let output = folder.run(&["vehicle", "check", file]);
        assert_eq!(output.status.code(), Some(1), "{file}");
        assert!(output.stderr.len() < 2000, "{file}: {} bytes", output.stderr.len());
        assert!(output.stderr.starts_with(format!("error: {file}").as_bytes()));
        assert!(!output.stderr.contains(&0x1b), "{file}");
    }
}

#[test]
fn limits_are_said_and_can_be_raised() {
    let folder = Folder::new("limits");
    folder.succeeds(&["fly", "--scenario", "hover", "--out", "f.mcap"]);
    let replay = |megabytes: &str| {
        Command::new(env!("CARGO_BIN_EXE_squirrel"))
            .args(["replay", "f.mcap"])
            .env("SQUIRREL_UNPACKED_MB", megabytes)
            .current_dir(&folder.0)
            .output()
            .unwrap()
    };
    let refused = replay("1");
    let stderr = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(1), "{stderr}");
    assert!(stderr.contains("f.mcap: is larger than 1 MB, the most that is read"), "{stderr}");
    assert!(stderr.contains("SQUIRREL_UNPACKED_MB=N allows N MB"), "{stderr}");
    assert!(replay("100").status.success());

    let text = format!("a = [{}]", "0,".repeat(5_000_000));
    folder.write("large.toml", &text);
    for arguments in [
        &["vehicle", "check", "large.toml"][..],
        &["fly", "--scenario", "large.toml"],
        &["import", "--map", "large.toml", "f.mcap", "--out", "o.mcap"],
    ] {
        folder.fails(arguments, &["large.toml: is larger than 8 MB, the most that is read"]);
    }
    let faults = ["export-vectors", "f.mcap", "--faults", "10001", "--out", "d"];
    assert_eq!(folder.run(&faults).status.code(), Some(2));
}

#[test]
fn one_study_at_a_time_has_a_folder() {
    let folder = Folder::new("two-studies");
    std::fs::create_dir(folder.0.join("d")).unwrap();
    let study = ["study", "faults", "--trials", "1", "--out", "d"];
    let other = Lock::folder(&folder.0.join("d")).unwrap();
    let said =
        "d: another squirrel is writing into this folder; wait for it, or give another --out";
    folder.fails(&study, &[said]);
    drop(other);
    folder.succeeds(&study);
    assert!(!folder.0.join("d/.squirrel.lock").exists());
}
