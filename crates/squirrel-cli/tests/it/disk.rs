//! A disk that takes no more, or does not say that it has what it was given: one line, the old
//! files whole or the new ones, and nothing half-written beside them.
#![cfg(target_os = "linux")]

use crate::support::writers::{Writer, are_whole, files, put};
use std::ffi::OsString;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// Blocks of 512 bytes that a file may have: none, less than any result, between two of them, and
/// less than the largest.
const BLOCKS: [u32; 4] = [0, 3, 40, 600];

/// A library that stands before the system's and whose disk fails.
const NO_SYNC: &str =
    "#include <errno.h>\nint fsync(int file) { (void)file; errno = EIO; return -1; }\n";

fn names(folder: &Path) -> Vec<OsString> {
    let mut names: Vec<_> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    names.sort();
    names
}

/// What a command says where something is wrong with the disk, and whether it went through.
fn is_one_line(writer: &Writer, output: &Output) -> bool {
    if output.status.success() {
        return true;
    }
    let said = String::from_utf8_lossy(&output.stderr);
    let errors: Vec<&str> = said.lines().filter(|line| line.starts_with("error: ")).collect();
    assert_eq!(output.status.code(), Some(1), "{:?}: {said}", writer.new);
    assert!(errors.len() == 1 && said.trim_end().ends_with(errors[0]), "{:?}: {said}", writer.new);
    false
}

/// Runs a command on disks that fail over the files of another run of it.
///
/// * `fails` - starts it there
fn is_left_whole(writer: &Writer, fails: &[&dyn Fn() -> Command]) -> Vec<bool> {
    let out = writer.folder.0.join("out");
    let (new, old) = (writer.alone(&writer.new), writer.alone(&writer.old));
    let one = |start: &&dyn Fn() -> Command| {
        fs::remove_dir_all(&out).unwrap();
        put(&out, &old, writer.grows);
        let output = start().args(&writer.new).current_dir(&writer.folder.0).output().unwrap();
        are_whole(&out, &[&old, &new], writer.grows, &format!("{:?}", writer.new));
        let left: Vec<OsString> = names(&out)
            .into_iter()
            .filter(|name| name.to_string_lossy().starts_with(".squirrel"))
            .collect();
        assert!(left.is_empty(), "{:?} left {left:?}", writer.new);
        is_one_line(writer, &output)
    };
    let went: Vec<bool> = fails.iter().map(one).collect();
    // Where the disk is as it was, the same command goes through.
    writer.folder.succeeds(&writer.new);
    assert_eq!(files(&out), new, "{:?}", writer.new);
    went
}

fn writers(name: &str) -> Vec<Writer> {
    [Writer::fly, Writer::study, Writer::import, Writer::train, Writer::gap]
        .into_iter()
        .enumerate()
        .map(|(k, writer)| writer(&format!("{name}-{k}")))
        .collect()
}

#[test]
fn a_disk_that_is_full_costs_no_file() {
    let small = |blocks: u32| {
        let mut command = Command::new("sh");
        // A write beyond is an error and not a signal.
        command.arg("-c").arg(format!("trap '' 25 && ulimit -f {blocks} && exec \"$0\" \"$@\""));
        command.arg(env!("CARGO_BIN_EXE_squirrel"));
        command
    };
    for writer in writers("disk-full") {
        let starts = BLOCKS.map(|blocks| move || small(blocks));
        let starts: Vec<&dyn Fn() -> Command> =
            starts.iter().map(|start| start as &dyn Fn() -> Command).collect();
        let went = is_left_whole(&writer, &starts);
        assert!(!went[0] && !went[1], "{:?} fits into nothing", writer.new);
    }
}

#[test]
fn a_disk_that_does_not_confirm_costs_no_file() {
    for writer in writers("disk-sync") {
        let (source, library) = (writer.folder.0.join("sync.c"), writer.folder.0.join("sync.so"));
        fs::write(&source, NO_SYNC).unwrap();
        // Whoever builds the program has a C compiler.
        let made = Command::new("cc")
            .args(["-shared", "-fPIC", "-o"])
            .args([&library, &source])
            .status()
            .unwrap();
        assert!(made.success());
        let start = || {
            let mut command = Command::new(env!("CARGO_BIN_EXE_squirrel"));
            command.env("LD_PRELOAD", &library);
            command
        };
        let went = is_left_whole(&writer, &[&start]);
        assert!(!went[0], "{:?}: nobody asked whether it is on the disk", writer.new);
    }
}
