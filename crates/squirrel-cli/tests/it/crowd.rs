//! Two and ten programs that write the same results at once: each goes through or is told that
//! somebody else has the folder, and what is there then is of one of them, whole.

use crate::support::writers::{Writer, files};
use std::fs;
use std::process::{Child, Command, Stdio};

fn is_crowded(writer: &Writer) {
    let out = writer.folder.0.join("out");
    let both = [&writer.old, &writer.new].map(|words| writer.alone(words));
    for many in [2, 10] {
        fs::remove_dir_all(&out).unwrap();
        fs::create_dir_all(&out).unwrap();
        // Who finds the journal of another seed is refused, as it should be.
        let seeds = if both[1].keys().any(|name| (writer.grows)(name)) { 1 } else { 2 };
        let start = |k: usize| -> Child {
            Command::new(env!("CARGO_BIN_EXE_squirrel"))
                .args([&writer.new, &writer.old][k % seeds])
                .current_dir(&writer.folder.0)
                .stdout(Stdio::null())
                .stderr(Stdio::piped())
                .spawn()
                .unwrap()
        };
        let all: Vec<Child> = (0..many).map(start).collect();
        let mut went = 0;
        for child in all {
            let output = child.wait_with_output().unwrap();
            let said = String::from_utf8_lossy(&output.stderr);
            let is_told = said.contains("another squirrel is writing into this folder");
            assert!(output.status.success() || is_told, "{:?}, {many}: {said}", writer.new);
            went += u32::from(output.status.success());
        }
        assert!(went > 0, "{:?}, {many}: nobody went through", writer.new);
        let now = files(&out);
        for (name, bytes) in &now {
            let is_whole = both.iter().any(|one| one.get(name) == Some(bytes));
            assert!(is_whole, "{:?}, {many}: {name} is of nobody", writer.new);
        }
        assert!(now.keys().eq(both[1].keys()), "{:?}, {many}", writer.new);
        let hidden = fs::read_dir(&out).unwrap().map(|entry| entry.unwrap().file_name());
        assert_eq!(hidden.filter(|name| name.to_string_lossy().starts_with('.')).count(), 0);
    }
}

#[test]
fn many_flights_into_one_file() {
    is_crowded(&Writer::fly("crowd-fly"));
}

#[test]
fn many_studies_in_one_folder() {
    is_crowded(&Writer::study("crowd-study"));
}

#[test]
fn many_imports_into_one_file() {
    is_crowded(&Writer::import("crowd-import"));
}

#[test]
fn many_trainings_into_one_file() {
    is_crowded(&Writer::train("crowd-train"));
}

#[test]
fn many_gap_runs_in_one_folder() {
    is_crowded(&Writer::gap("crowd-gap"));
}
