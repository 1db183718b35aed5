//! One flight written as CSV, Parquet, ULog, MCAP and a Crazyflie's micro-SD log: it must come out
//! the same, and damage must come out as an error.

use std::fmt::Write;

use super::import_support::formats::{Cells, Ulog, Usd, mcap_bytes, parquet_bytes, parquet_split};
use super::import_support::{Flight, OMEGA, one_source};
use parquet::basic::Compression;

const ROWS: i32 = 24;
const FORMATS: [&str; 4] = ["f.parquet", "f.ulg", "f.mcap", "log00"];

/// Time in us and three rates that are exact in `f32`; row 7 has a missing number.
fn row(row: i32) -> (i64, [f32; 3]) {
    let x = row as f32;
    let y = if row == 7 { f32::NAN } else { x / 8.0 - 1.0 };
    (i64::from(row) * 3333 + 5_000_000, [x * 0.25, y, -x])
}

fn csv() -> String {
    let mut csv = "t,x,y,z\n".to_owned();
    for (t, [x, y, z]) in (0..ROWS).map(row) {
        writeln!(csv, "{t},{x},{y},{z}").unwrap();
    }
    csv
}

fn parquet(compression: Compression) -> Vec<u8> {
    parquet_by(|schema, columns| parquet_bytes(schema, columns, 9, compression))
}

fn parquet_by(bytes: impl Fn(&str, &[Cells]) -> Vec<u8>) -> Vec<u8> {
    let axis =
        |i: usize| (0..ROWS).map(|r| Some(row(r).1[i]).filter(|x| !x.is_nan())).collect::<Vec<_>>();
    let doubles = axis(2).iter().map(|z| z.map(f64::from)).collect();
    bytes(
        "required int64 t; required float x; optional float y; optional double z;",
        &[
            Cells::Longs((0..ROWS).map(|r| Some(row(r).0)).collect()),
            Cells::Floats(axis(0)),
            Cells::Floats(axis(1)),
            Cells::Doubles(doubles),
        ],
    )
}

fn ulog() -> Vec<u8> {
    let mut log = Ulog::new()
        .flags(None)
        .format("sensor_gyro:uint64_t timestamp;float x;float y;float z;uint8_t[4] _padding0;")
        .format("battery:uint64_t timestamp;float voltage_v;")
        .record(b'I', b"\x0fchar[3] sys_nameabc")
        .subscribe(3, "sensor_gyro", 0)
        .subscribe(4, "battery", 0);
    for (t, rates) in (0..ROWS).map(row) {
        let numbers = rates.map(f32::to_le_bytes).concat();
        log = log.data(3, &[&t.to_le_bytes()[..], &numbers].concat());
        log = log.data(4, &[&t.to_le_bytes()[..], &7.5_f32.to_le_bytes()].concat());
    }
    log.0
}

fn mcap() -> Vec<u8> {
    let message = |(t, [x, y, z]): (i64, [f32; 3])| {
        let y = if y.is_nan() { "null".to_owned() } else { y.to_string() };
        let text = format!(r#"{{"stamp":{t},"gyro":{{"x":{x},"yz":[{y},{z}]}},"frame":"imu"}}"#);
        ("/imu", "json", t.cast_unsigned() * 1000, text)
    };
    mcap_bytes(&(0..ROWS).map(row).map(message).collect::<Vec<_>>(), 1000)
}

fn usd() -> Vec<u8> {
    let mut log = Usd::new(
        2,
        &[(0xffff, "gyro", &["x(f)", "y(f)", "z(f)"]), (0, "battery", &["pm.vbatMV(H)"])],
    );
    for (t, rates) in (0..ROWS).map(row) {
        log = log.record(0xffff, t.cast_unsigned(), &rates.map(f32::to_le_bytes).concat());
        log = log.record(0, t.cast_unsigned(), &3700_u16.to_le_bytes());
    }
    log.finish()
}

/// A map of the flight in a file of some format.
fn map(file: &str) -> String {
    let (topic, time, columns) = match file {
        "f.ulg" => ("topic = \"sensor_gyro\"", "timestamp", ["x", "y", "z"]),
        "log00" => ("topic = \"gyro\"", "timestamp", ["x", "y", "z"]),
        "f.mcap" => ("topic = \"/imu\"", "stamp", ["gyro.x", "gyro.yz[0]", "gyro.yz[1]"]),
        _ => ("", "t", ["x", "y", "z"]),
    };
    format!(
        "[[source]]\n{topic}\ntime = {{ column = \"{time}\", unit = \"us\" }}\n[source.channels]\n\
         \"imu.omega_body_rad_s\" = {{ columns = {columns:?}, body = \"flu\", scale = 0.5 }}\n"
    )
}

fn flight() -> Flight {
    let flight = Flight::new("formats", &[("f.csv", &csv())]);
    flight.write("f.parquet", &parquet(Compression::UNCOMPRESSED));
    flight.write("f.ulg", &ulog());
    flight.write("f.mcap", &mcap());
    flight.write("log00", &usd());
    flight
}

#[test]
fn every_format_gives_the_flight_of_the_csv() {
    let flight = flight();
    let (expected, counted) = flight.import(&map("f.csv"), &["f.csv"]).unwrap();
    assert_eq!(counted.channels[0].samples_missing, 1);
    for file in FORMATS {
        let (log, report) = flight.import(&map(file), &[file]).unwrap();
        // As text, so that a missing number equals a missing number.
        assert_eq!(format!("{:?}", log.sources), format!("{:?}", expected.sources), "{file}");
        assert_eq!(log.metadata["time_zero_s"], expected.metadata["time_zero_s"], "{file}");
        assert_eq!(report.files[0].rows, counted.files[0].rows, "{file}");
        assert_eq!(report.channels[0].samples_missing, 1, "{file}");
    }
    let split = parquet_by(|schema, columns| parquet_split(schema, columns, 9));
    let packed = [Compression::SNAPPY, Compression::ZSTD(parquet::basic::ZstdLevel::default())];
    for (i, bytes) in packed.map(parquet).into_iter().chain([split]).enumerate() {
        flight.write("f.parquet", &bytes);
        let (log, _) = flight.import(&map("f.parquet"), &["f.parquet"]).unwrap();
        assert_eq!(format!("{:?}", log.sources), format!("{:?}", expected.sources), "{i}");
    }
}

#[test]
fn a_prefix_of_a_file_is_an_error_or_a_shorter_flight() {
    let flight = flight();
    for file in FORMATS {
        let (whole, _) = flight.import(&map(file), &[file]).unwrap();
        let whole = format!("{:?}", whole.channel("imu.omega_body_rad_s").unwrap().0);
        let bytes = std::fs::read(flight.folder().join(file)).unwrap();
        let (mut errors, mut shorter) = (0, 0);
        for length in 0..bytes.len() {
            flight.write(file, &bytes[..length]);
            match flight.import(&map(file), &[file]) {
                Err(error) => {
                    let message = flight.message(&error);
                    assert!(
                        message.starts_with(file) && !message.contains('\n'),
                        "{length}: {message}"
                    );
                    errors += 1;
                }
                Ok((log, report)) => {
                    let times = format!("{:?}", log.channel("imu.omega_body_rad_s").unwrap().0);
                    assert!(
                        whole.starts_with(times.trim_end_matches(']')),
                        "{file}, {length}: {times}"
                    );
                    let said = report.to_string().contains("ends inside a record");
                    assert_eq!(said, report.files[0].bytes_cut > 0, "{report}");
                    shorter += 1;
                }
            }
        }
        assert!(errors > 0, "{file}");
        // Only a ULog is read up to where it was cut: the others have their index or a checksum at
        // the end.
        assert_eq!(shorter > 0, file == "f.ulg", "{file}: {shorter}");
    }
}

#[test]
fn a_changed_byte_is_never_a_panic() {
    let flight = flight();
    for file in FORMATS {
        let bytes = std::fs::read(flight.folder().join(file)).unwrap();
        let mut refused = 0;
        for place in 0..bytes.len() {
            let mut changed = bytes.clone();
            changed[place] ^= [0x01, 0x80, 0xff][place % 3];
            flight.write(file, &changed);
            if let Err(error) = flight.import(&map(file), &[file]) {
                let message = error.to_string();
                assert!(message.contains(file) && !message.contains('\n'), "{place}: {message}");
                refused += 1;
            }
        }
        assert!(refused > 50, "{file}: {refused}");
    }
}

#[test]
fn a_bad_file_is_one_line_that_says_what_is_wrong() {
    let flight = flight();
    for (file, bytes, message) in [
        ("f.parquet", &b""[..], "f.parquet: empty file"),
        ("f.ulg", b"", "f.ulg: empty file"),
        ("f.mcap", b"", "f.mcap: empty file"),
        ("log00", b"", "log00: empty file"),
        ("f.parquet", b"t,x,y,z\n0,1,2,3\n", "f.parquet: "),
        ("f.ulg", b"t,x,y,z\n0,1,2,3\n", "f.ulg: the first 7 bytes are not those of a ULog file"),
        (
            "f.mcap",
            b"t,x,y,z\n0,1,2,3\n",
            "f.mcap: the first 8 bytes are not those of an MCAP file",
        ),
        ("f.ulg", b"ULog\x01", "f.ulg: ends inside the header, after 5 bytes"),
    ] {
        flight.write(file, bytes);
        let error = flight.import(&map(file), &[file]).unwrap_err();
        assert!(flight.message(&error).starts_with(message), "{error}");
    }
    flight.write("f.xlsx", b"PK");
    flight.write("f", b"t");
    for file in ["f.xlsx", "f"] {
        assert_eq!(
            flight.message(&flight.import(&one_source(OMEGA), &[file]).unwrap_err()),
            format!(
                "{file}: import reads ULog (PX4), dataflash logs (ArduPilot), blackbox logs (Betaflight, INAV), \
                 Crazyflie micro-SD logs, MCAP (ROS 2, JSON, protobuf), Parquet and MATLAB's .mat up to v7, by their first bytes, and .csv, by the file's extension"
            )
        );
    }
}

/// Numbers that are all the same take no room in a file, and eight bytes each in memory.
#[test]
fn a_small_table_that_unpacks_into_a_large_one_is_refused() {
    const MEGABYTES: usize = 256;
    let rows = MEGABYTES * 1_000_000 / 8 / 4 + 1;
    let table = parquet_bytes(
        "required int64 t; required boolean x; required boolean y; required boolean z;",
        &[
            Cells::Longs(vec![Some(0); rows]),
            Cells::Bools(vec![Some(true); rows]),
            Cells::Bools(vec![Some(true); rows]),
            Cells::Bools(vec![Some(true); rows]),
        ],
        rows,
        Compression::SNAPPY,
    );
    assert!(table.len() < MEGABYTES * 1_000_000 / 100, "{} bytes", table.len());
    let flight = flight();
    flight.write("f.parquet", &table);
    let error = flight.import(&map("f.parquet"), &["f.parquet"]).unwrap_err();
    let said = flight.message(&error);
    let begin = format!("f.parquet: its content is larger than {MEGABYTES} MB");
    assert!(said.starts_with(&begin) && !said.contains('\n'), "{said}");
}

#[test]
fn a_map_that_asks_for_what_is_not_there_is_refused() {
    let flight = flight();
    let gone = |file: &str, from: &str, to: &str| {
        let map = map(file);
        assert!(map.contains(from));
        flight.message(&flight.import(&map.replace(from, to), &[file]).unwrap_err())
    };
    assert_eq!(gone("f.parquet", "\"x\"", "\"v\""), "f.parquet: no column `v`; nearest: t, x, y");
    assert_eq!(
        gone("f.ulg", "\"x\"", "\"xx\""),
        "f.ulg, topic `sensor_gyro`: no column `xx`; nearest: x, y, z"
    );
    assert_eq!(
        gone("f.mcap", "gyro.x", "gyro.w"),
        "f.mcap, topic `/imu`: no column `gyro.w`; nearest: gyro.x, gyro.yz[0], gyro.yz[1]"
    );
    assert_eq!(
        gone("f.ulg", "sensor_gyro", "sensor_baro"),
        "f.ulg: no message of topic `sensor_baro`; nearest: sensor_gyro, battery"
    );
    assert_eq!(gone("f.mcap", "/imu", "/gps"), "f.mcap: no message of topic `/gps`; nearest: /imu");
    assert_eq!(
        gone("log00", "gyro", "gyr"),
        "log00: no message of topic `gyr`; nearest: gyro, battery"
    );
    assert_eq!(
        gone("log00", "\"x\"", "\"t\""),
        "log00, topic `gyro`: no column `t`; nearest: x, y, z"
    );
    assert_eq!(
        gone("f.ulg", "topic = \"sensor_gyro\"", ""),
        "map.toml: source 1, topic: missing: say which topic of `f.ulg`"
    );
    assert_eq!(
        gone("f.parquet", "time =", "topic = \"a\"\ntime ="),
        "map.toml: source 1, topic: means nothing for `f.parquet`: leave it out"
    );
    assert_eq!(
        gone("f.mcap", "time =", "instance = 0\ntime ="),
        "map.toml: source 1, instance: means nothing for `f.mcap`: leave it out"
    );
}
