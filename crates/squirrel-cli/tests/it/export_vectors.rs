//! `squirrel export-vectors`: the same bytes again, and only from logs that fly again bit for bit;
//! `fly --hil` without its image. With it: `cargo xtask firmware`.

use super::support::{Folder, json};
use squirrel_core::stack::StackState;
use squirrel_core::stack::wire::{HASH_START, Header, Reader, Record, Wire, hash, written};
use std::fs;

const FLY: [&str; 7] = ["fly", "--arm", "twcc_parnn", "--scenario", "hover", "--out", "f.mcap"];

#[test]
fn the_file_plays_as_a_target_would_play_it() {
    let folder = Folder::new("export-vectors");
    folder.succeeds(&FLY);
    for out in ["a", "b/c"] {
        folder.succeeds(&["export-vectors", "f.mcap", "f.mcap", "--out", out, "--json", "v.json"]);
    }
    let bytes = fs::read(folder.0.join("a/vectors.bin")).unwrap();
    assert_eq!(bytes, fs::read(folder.0.join("b/c/vectors.bin")).unwrap());
    let setup = fs::read(folder.0.join("a/setup-1.bin")).unwrap();
    assert_eq!(setup, fs::read(folder.0.join("a/setup-0.bin")).unwrap());
    let alone = Header::take(&mut Reader::new(&setup)).unwrap();
    assert_eq!(alone, Header { sequences: 1, frames: 0 });
    assert!(
        bytes[Header::LENGTH..].starts_with(&setup[Header::LENGTH..]),
        "the setup is the first record"
    );
    let said = json(&folder, "v.json");
    let mut reader = Reader::new(&bytes);
    let header = Header::take(&mut reader).unwrap();
    assert_eq!(header.sequences, 2);
    let (mut flight, mut frames, mut outputs) = (None, 0, 0);
    while !reader.is_empty() {
        u16::take(&mut reader).unwrap();
        match Record::take(&mut reader).unwrap() {
            Record::Setup(stack) => {
                flight = Some((stack, StackState::default()));
                outputs = HASH_START;
            }
            Record::Frame(frame, expected) => {
                let (stack, state) = flight.as_mut().unwrap();
                outputs =
                    written(&stack.step(state, &frame), |bytes| hash(outputs, bytes)).unwrap();
                assert_eq!(outputs, expected, "step {frames}");
                frames += 1;
            }
        }
    }
    assert_eq!(frames, header.frames);
    assert_eq!(said[1]["hash"].as_str().unwrap(), format!("{outputs:016x}"));
}

#[test]
fn what_cannot_be_exported_is_named() {
    let folder = Folder::new("export-vectors-errors");
    folder.succeeds(&FLY);
    folder.write("broken.mcap", "no log");
    folder.fails(&["export-vectors", "broken.mcap", "--out", "v"], &["broken.mcap"]);
    folder.fails(&["export-vectors", "f.mcap", "--out", "broken.mcap"], &["broken.mcap"]);
    folder.fails(&["export-vectors", ".", "--out", "v"], &["broken.mcap"]);
}

#[test]
fn an_emulator_without_its_image_is_named_before_anything_is_written() {
    let folder = Folder::new("hil-errors");
    folder.fails(
        &["fly", "--hil", "qemu", "--hil-image", "none.elf", "--out", "f.mcap"],
        &["none.elf: no such image", "cargo xtask firmware"],
    );
}
