//! MAT-files as scipy reads them, HDF5 as h5py does, protobuf as Foxglove's reader does, and what is wrong with others.

use super::import_support::Flight;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn map(topic: &str, time: &str, columns: &[&str]) -> String {
    format!(
        "[[source]]\n{topic}\ntime = {{ column = \"{time}\", unit = \"s\" }}\n\
         channels = {{ \"truth.a\" = {{ columns = {columns:?} }} }}\n"
    )
}

/// Column, then row from 0: the last three cells of each line.
fn numbers(csv: &str) -> BTreeMap<String, BTreeMap<usize, f64>> {
    let mut numbers: BTreeMap<String, BTreeMap<usize, f64>> = BTreeMap::new();
    for line in std::fs::read_to_string(data(csv)).unwrap().lines() {
        let mut cells = line.rsplitn(3, ',');
        let value = cells.next().unwrap().parse().unwrap();
        let row: usize = cells.next().unwrap().parse().unwrap();
        let column = cells.next().unwrap().rsplit(',').next().unwrap().to_owned();
        numbers.entry(column).or_default().insert(row - 1, value);
    }
    numbers
}

fn compare(flight: &Flight, map: &str, file: &str, columns: &[&str], csv: &str) -> usize {
    let expected = numbers(csv);
    let (log, _) = flight.import(map, &[file]).unwrap();
    let (time_s, channel) = log.channel("truth.a").unwrap();
    for row in 0..time_s.len() {
        for (got, column) in channel.row(row).iter().zip(columns) {
            let expected = expected[*column].get(&row).copied().unwrap_or(f64::NAN);
            let same = *got == expected || got.is_nan() && expected.is_nan();
            assert!(same, "{file} {column} row {row}: {got} is not {expected}");
        }
    }
    time_s.len() * columns.len()
}

/// A file is refused with one line that begins with the problem.
fn refuses(flight: &Flight, map: &str, file: &str, problem: &str) {
    let message = flight.message(&flight.import(map, &[file]).unwrap_err());
    assert!(message.starts_with(problem) && message.lines().count() == 1, "{message}");
}

#[test]
fn every_number_of_a_mat_file_is_what_scipy_reads() {
    for (name, read) in
        [("plain", "plain"), ("packed", "packed"), ("big_endian", "big_endian"), ("v73", "plain")]
    {
        let (file, csv) = (format!("{name}.mat"), format!("mat/{read}.csv"));
        let flight = Flight::new("mat", &[]);
        flight.write(&file, &std::fs::read(data(&format!("mat/{file}"))).unwrap());
        let all = numbers(&csv);
        let mut compared = 0;
        for (time, samples) in [("t", 7), ("slow.t", 3)] {
            let columns: Vec<&str> = all
                .iter()
                .filter(|(_, rows)| rows.len() == samples)
                .map(|(column, _)| column.as_str())
                .collect();
            compared += compare(&flight, &map("", time, &columns), &file, &columns, &csv);
        }
        // All but three scalars, which are no series.
        assert_eq!(compared, all.values().map(BTreeMap::len).sum::<usize>() - 3);
    }
}

#[test]
fn every_number_of_an_hdf5_file_is_what_h5py_reads() {
    for name in ["flight", "latest"] {
        let (file, csv) = (format!("{name}.h5"), format!("hdf5/{name}.csv"));
        let flight = Flight::new("hdf5", &[]);
        flight.write(&file, &std::fs::read(data(&format!("hdf5/{file}"))).unwrap());
        let all = numbers(&csv);
        let columns: Vec<&str> = all.keys().map(String::as_str).collect();
        assert_eq!(compare(&flight, &map("", "t", &columns), &file, &columns, &csv), 17 * 40);
    }
}

#[test]
fn what_an_hdf5_file_does_not_give_is_one_line() {
    let flight = Flight::new("hdf5", &[]);
    let whole = std::fs::read(data("hdf5/flight.h5")).unwrap();
    flight.write("f.h5", &whole);
    for (time, column, problem) in [
        ("t", "names", "f.h5: no column `names`; nearest: "),
        ("t", "imu.elsewhere", "f.h5: no column `imu.elsewhere`; nearest: "),
        (
            "t",
            "lzf",
            "f.h5: `lzf`: packed by what is not read (filter id 32000); `h5repack -f GZIP=4 FILE OTHER` packs it by gzip",
        ),
        ("t", "endless", "f.h5: `endless` has 1000000000 samples, its time `t` has 40"),
        ("endless", "endless", "f.h5: its content is larger than 256 MB"),
    ] {
        refuses(&flight, &map("", time, &[column]), "f.h5", problem);
    }
    flight.write("f.h5", &whole[..whole.len() / 2]);
    let error = flight.import(&map("", "t", &["imu.gyro[0]"]), &["f.h5"]).unwrap_err();
    let message = flight.message(&error);
    assert!(message.starts_with("f.h5: ") && message.contains("byte"), "{message}");
}

#[test]
fn a_mat_file_that_says_something_else_is_one_line() {
    let flight = Flight::new("mat", &[]);
    let plain = std::fs::read(data("mat/plain.mat")).unwrap();
    flight.write("f.mat", &plain);
    for (time, column, problem) in [
        ("t", "slow.x[0]", "f.mat: `slow.x[0]` has 3 samples, its time `t` has 7"),
        ("t", "gyro", "f.mat: no column `gyro`; nearest: "),
        ("t", "note", "f.mat: no column `note`; nearest: "),
        ("t", "wave", "f.mat: no column `wave`; nearest: "),
        ("t", "solid[0]", "f.mat: no column `solid[0]`; nearest: "),
        (
            "log.battery.missing",
            "gyro[0]",
            "f.mat, column `log.battery.missing`, row 2: `` is no time",
        ),
        (
            "gyro[1]",
            "gyro[0]",
            "f.mat, column `gyro[1]`, row 2: time repeats: -0.2 after -0.2 in row 1",
        ),
    ] {
        refuses(&flight, &map("", time, &[column]), "f.mat", problem);
    }
    let mut later = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".to_vec();
    later.resize(512, 0);
    for (bytes, problem) in [
        (later, "f.mat: invalid HDF5 magic bytes"),
        // Each of two references to itself is followed to two again.
        (std::fs::read(data("mat/round.mat")).unwrap(), "f.mat: more than 50000 datasets"),
        (plain[..100].to_vec(), "f.mat: ends inside the header, after 100 bytes"),
        (vec![0; 200], "f.mat: no MAT-file of level 5; in MATLAB, `save -v7` writes one"),
        (
            [&plain[..128], &14_u32.to_le_bytes(), &[0xff; 4]].concat(),
            "f.mat: ends inside the element at byte 128: 0 of 4294967295 bytes",
        ),
    ] {
        flight.write("f.mat", &bytes);
        refuses(&flight, &map("", "t", &["gyro[0]"]), "f.mat", problem);
    }
}

/// 40 kB of packed zeros are 40 MB, and as a column of numbers 320 MB.
#[test]
fn a_small_file_that_unpacks_into_a_large_one_is_refused() {
    const SAMPLES: u32 = 40_000_000;
    let flight = Flight::new("mat-bomb", &[]);
    let plain = std::fs::read(data("mat/plain.mat")).unwrap();
    // An array of int8: flags, sizes, name, numbers.
    let parts = [[6, 8, 8, 0], [5, 8, SAMPLES, 1], [1, 1, u32::from(b't'), 0]];
    let mut matrix =
        parts.as_flattened().iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<_>>();
    matrix.extend([1, SAMPLES].map(u32::to_le_bytes).concat());
    matrix.resize(matrix.len() + SAMPLES as usize, 0);
    let variable =
        [&[14, matrix.len() as u32].map(u32::to_le_bytes).concat()[..], &matrix].concat();
    let packed = miniz_oxide::deflate::compress_to_vec_zlib(&variable, 1);
    let head = [15, packed.len() as u32].map(u32::to_le_bytes).concat();
    flight.write("f.mat", &[&plain[..128], &head, &packed].concat());
    let error = flight.import(&map("", "t", &["t"]), &["f.mat"]).unwrap_err();
    let said = flight.message(&error);
    assert!(said.starts_with("f.mat: its content is larger than 256 MB"), "{said}");
}

/// Cuts and flipped bytes all over small files: an error of one line or a flight.
#[test]
fn no_cut_and_no_flip_of_a_file_of_arrays_ends_the_program() {
    let flight = Flight::new("mat", &[]);
    for (file, step) in
        [("mat/plain.mat", 5), ("mat/packed.mat", 5), ("mat/v73.mat", 37), ("hdf5/latest.h5", 37)]
    {
        let whole = std::fs::read(data(file)).unwrap();
        let mut told = 0;
        for at in (0..whole.len()).step_by(step) {
            let mut flipped = whole.clone();
            flipped[at] ^= 0xff;
            for bytes in [whole[..at].to_vec(), flipped] {
                flight.write("f.mat", &bytes);
                if let Err(error) = flight.import(&map("", "t", &["gyro[0]"]), &["f.mat"]) {
                    assert_eq!(flight.message(&error).lines().count(), 1);
                    told += 1;
                }
            }
        }
        assert!(told > whole.len() / step / 2, "{file}: {told}");
    }
}

#[test]
fn every_number_of_a_protobuf_message_is_what_foxglove_reads() {
    let flight = Flight::new("protobuf", &[]);
    let whole = std::fs::read(data("protobuf/flight.mcap")).unwrap();
    flight.write("f.mcap", &whole);
    let all = numbers("protobuf/flight.csv");
    let columns: Vec<&str> = all.keys().map(String::as_str).collect();
    let topic = "topic = \"/flight\"";
    let by_log = map(topic, "log_time", &columns);
    assert_eq!(
        compare(&flight, &by_log, "f.mcap", &columns, "protobuf/flight.csv"),
        4 * columns.len()
    );
    // The stamp is one time, in ns.
    let by_stamp = map(topic, "stamp", &["maybe"]).replace("\"s\"", "\"ns\"");
    let (log, _) = flight.import(&by_stamp, &["f.mcap"]).unwrap();
    assert_eq!(log.metadata["time_zero_s"], "1700000000.000001");

    for (at, byte) in (0..whole.len()).step_by(5).map(|at| (at, whole[at] ^ 0xff)) {
        let mut flipped = whole.clone();
        flipped[at] = byte;
        flight.write("f.mcap", &flipped);
        if let Err(error) = flight.import(&by_log, &["f.mcap"]) {
            assert_eq!(flight.message(&error).lines().count(), 1);
        }
    }
}
