//! Damaged, cut, re-written and foreign files: each is found, named in one line, and as much as is
//! whole is recovered.

use std::collections::BTreeMap;
use std::fs;
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use mcap::records::{MessageHeader, Metadata};
use prost::Message as _;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet};
use squirrel_log::{FlightLog, LogError};

fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name)
}

/// A flight of `seconds` with an IMU at 50 Hz, a battery at 5 Hz and the true pose.
fn flight(seconds: u32) -> FlightLog {
    let mut log = FlightLog::default();
    log.metadata.insert("vehicle_toml".to_owned(), "name = \"squirrel\"\n".to_owned());
    for i in 0..=50 * seconds {
        let time_s = f64::from(i) / 50.0;
        let (sin, cos) = time_s.sin_cos();
        log.source_mut("imu").push(
            time_s,
            &[("omega_body_rad_s", &[sin, cos, 0.0]), ("temperature_k", &[293.0 + sin])],
        );
        if i % 10 == 0 {
            log.source_mut("battery").push(time_s, &[("voltage_v", &[16.0 - time_s])]);
            let attitude: &[f64] = &[cos, 0.0, 0.0, sin];
            log.source_mut("truth").push(
                time_s,
                &[("position_ned_m", &[time_s, 0.0, -1.0]), ("q_ned_from_body_wxyz", attitude)],
            );
        }
    }
    log
}

/// The line without the file name that it starts with.
fn line(file: &Path, error: &LogError) -> String {
    let text = error.to_string();
    assert!(!text.contains('\n'), "{text}");
    text.strip_prefix(&format!("{}: ", file.display()))
        .expect("starts with the file name")
        .to_owned()
}

fn read_error(file: &Path) -> String {
    line(file, &FlightLog::read(file).unwrap_err())
}

#[test]
fn every_flipped_byte_is_found() {
    let file = path("flip.mcap");
    flight(2).write(&file).unwrap();
    let bytes = fs::read(&file).unwrap();
    let mut disk = fs::OpenOptions::new().write(true).open(&file).unwrap();
    let mut put = |at: usize, byte: u8| {
        disk.seek(SeekFrom::Start(at as u64)).unwrap();
        disk.write_all(&[byte]).unwrap();
    };
    for (at, &byte) in bytes.iter().enumerate() {
        for flip in [0x01, 0x80, 0xff] {
            put(at, byte ^ flip);
            let error = read_error(&file);
            assert!(error.starts_with("corrupt: "), "byte {at} of {}: {error}", bytes.len());
        }
        put(at, byte);
    }
    assert_eq!(FlightLog::read(&file).unwrap(), flight(2));
}

#[test]
fn bytes_after_the_end_are_found() {
    let file = path("appended.mcap");
    flight(1).write(&file).unwrap();
    let mut bytes = fs::read(&file).unwrap();
    bytes.extend_from_slice(b"more");
    fs::write(&file, &bytes).unwrap();
    assert_eq!(
        read_error(&file),
        "corrupt: 12 bytes after the footer are not those that end an MCAP file"
    );
}

#[test]
fn of_a_truncated_file_every_whole_second_is_recovered() {
    let (whole, file) = (flight(10), path("cut.mcap"));
    whole.write(&file).unwrap();
    let bytes = fs::read(&file).unwrap();
    let mut last_s = 0.0;
    for part in 1..50 {
        let length = bytes.len() * part / 50;
        fs::write(&file, &bytes[..length]).unwrap();
        let error = FlightLog::read(&file).unwrap_err();
        let (log, recovery) = FlightLog::recover(&file).unwrap();

        assert_eq!(log.metadata, whole.metadata);
        for (name, source) in &log.sources {
            let (samples, all) = (source.time_s.len(), &whole.sources[name]);
            assert_eq!(source.time_s, all.time_s[..samples]);
            for (name, channel) in &source.channels {
                assert_eq!(channel.values, all.channels[name].values[..samples * channel.width]);
            }
        }
        let messages: usize = log.sources.values().map(|source| source.time_s.len()).sum();
        let end_s = log.sources.get("imu").map_or(0.0, |imu| imu.time_s[imu.time_s.len() - 1]);
        assert_eq!(recovery.messages, messages as u64);
        assert_eq!(recovery.end_time_s, end_s);
        assert_eq!(recovery.bytes_total, length as u64);
        assert!(recovery.bytes_whole <= recovery.bytes_total && recovery.metadata_checked);
        assert_eq!(
            line(&file, &error),
            format!(
                "truncated at byte {length}: {end_s:.3} s of flight ({messages} messages) are whole; \
                 recover them with `squirrel import --recover`"
            )
        );
        assert!(
            end_s >= last_s && end_s - last_s < 1.5,
            "one more second a chunk: {last_s} then {end_s}"
        );
        last_s = end_s;
    }
    assert_eq!(last_s, 10.0, "the cut before the end is in the summary");
}

#[test]
fn every_shorter_file_is_truncated() {
    let file = path("shorter.mcap");
    flight(1).write(&file).unwrap();
    let bytes = fs::read(&file).unwrap();
    for length in 1..bytes.len() {
        fs::write(&file, &bytes[..length]).unwrap();
        let error = FlightLog::read(&file).unwrap_err();
        let whole = FlightLog::recover(&file).is_ok();
        assert_eq!(whole, matches!(error, LogError::Truncated { .. }), "{error}");
        assert!(error.to_string().contains(&format!("truncated at byte {length}: ")), "{error}");
    }
    fs::write(&file, &bytes[..40]).unwrap();
    assert_eq!(read_error(&file), "truncated at byte 40: nothing of the flight is whole");
}

#[test]
fn the_unwritten_end_of_a_reserved_file_is_truncated() {
    let file = path("zeros.mcap");
    flight(3).write(&file).unwrap();
    let mut bytes = fs::read(&file).unwrap();
    let half = bytes.len() / 2;
    bytes[half..].fill(0);
    fs::write(&file, &bytes).unwrap();
    assert!(read_error(&file).starts_with("truncated at byte "));
    let (log, recovery) = FlightLog::recover(&file).unwrap();
    assert!(recovery.bytes_whole <= half as u64 && !log.sources.is_empty());
}

#[test]
fn recover_does_not_vouch_for_a_changed_file() {
    let file = path("changed.mcap");
    flight(3).write(&file).unwrap();
    let mut bytes = fs::read(&file).unwrap();
    bytes[60] ^= 1;
    fs::write(&file, &bytes).unwrap();
    assert!(
        line(&file, &FlightLog::recover(&file).unwrap_err())
            .starts_with("corrupt: the data section")
    );
}

/// Of what is recovered from a cut file every bit is that which was written: what is damaged is
/// found, or is behind what is whole.
#[test]
fn no_flipped_byte_of_a_cut_file_is_recovered() {
    let (whole, file) = (flight(3), path("cut_flip.mcap"));
    whole.write(&file).unwrap();
    let mut bytes = fs::read(&file).unwrap();
    bytes.truncate(bytes.len() / 2);
    let (mut found, mut recovered) = (0, 0);
    for at in 0..bytes.len() {
        for flip in [0x01, 0x80] {
            bytes[at] ^= flip;
            fs::write(&file, &bytes).unwrap();
            bytes[at] ^= flip;
            let Ok((log, _)) = FlightLog::recover(&file) else {
                found += 1;
                continue;
            };
            recovered += 1;
            assert_eq!(log.metadata, whole.metadata, "byte {at}");
            for (name, source) in &log.sources {
                let (samples, all) = (source.time_s.len(), &whole.sources[name]);
                assert_eq!(source.time_s, all.time_s[..samples], "byte {at}");
                for (name, channel) in &source.channels {
                    let written = &all.channels[name].values[..samples * channel.width];
                    assert_eq!(channel.values, written, "byte {at}");
                }
            }
        }
    }
    assert!(found > 0 && recovered > 0, "{found} found, {recovered} recovered");
}

/// A first row of many numbers stands for as many in every sample before it: 30 kB of messages
/// that lack it, and 40 kB of one that has it, are gigabytes.
#[test]
fn what_a_small_file_claims_is_no_reason_to_ask_for_memory() {
    const SAMPLES: usize = 20_000;
    let file = path("bomb.mcap");
    let mut log = FlightLog::default();
    for i in 0..SAMPLES {
        log.source_mut("imu").push(i as f64, &[("omega_body_rad_s", &[0.0, 0.0])]);
    }
    log.write(&file).unwrap();
    let wide: Vec<u8> = vec![0; 8 * SAMPLES];
    rewrite(&file, |_, time_s, message| {
        // The list is field 2: key, length 16, two numbers.
        let at = message.windows(2).position(|bytes| bytes == [2 << 3 | 2, 16]).unwrap();
        message.drain(at..at + 18);
        if time_s as usize == SAMPLES - 1 {
            let mut row = vec![2 << 3 | 2];
            prost::encoding::encode_varint(wide.len() as u64, &mut row);
            row.extend_from_slice(&wide);
            let crc = crc32fast::hash(&[&time_s.to_le_bytes()[..], &wide].concat());
            let place = message.len() - 4;
            message[place..].copy_from_slice(&crc.to_le_bytes());
            message.splice(at..at, row);
        }
    });
    assert!(fs::metadata(&file).unwrap().len() < 1_000_000);
    let error = read_error(&file);
    assert!(error.starts_with("its content is larger than 256 MB"), "{error}");
    assert!(error.ends_with("SQUIRREL_UNPACKED_MB=N allows N MB"), "{error}");
}

/// Writes a file anew as another tool would, with fresh checksums, its messages changed.
fn rewrite(file: &Path, change: impl Fn(&str, f64, &mut Vec<u8>)) {
    let bytes = fs::read(file).unwrap();
    let metadata = FlightLog::read(file).unwrap().metadata;
    let mut writer = mcap::Writer::new(fs::File::create(file).unwrap()).unwrap();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let mut message = message.unwrap();
        let time_s = message.log_time as f64 * 1e-9;
        change(&message.channel.topic, time_s, message.data.to_mut());
        writer.write(&message).unwrap();
    }
    writer.write_metadata(&Metadata { name: "squirrel".to_owned(), metadata }).unwrap();
    writer.finish().unwrap();
}

/// Place of a number in a message.
fn find(message: &[u8], value: f64) -> usize {
    message
        .windows(8)
        .position(|bytes| bytes == value.to_le_bytes())
        .expect("the message has the value")
}

#[test]
fn a_file_written_anew_by_another_tool_is_read() {
    let file = path("rewritten.mcap");
    flight(2).write(&file).unwrap();
    rewrite(&file, |_, _, _| {});
    assert_eq!(FlightLog::read(&file).unwrap(), flight(2));
    // No checksum of ours is over these metadata, and nothing vouches for them.
    assert!(!FlightLog::recover(&file).unwrap().1.metadata_checked);
}

#[test]
fn a_changed_value_is_named() {
    let file = path("value.mcap");
    flight(4).write(&file).unwrap();
    rewrite(&file, |topic, time_s, message| {
        if topic == "imu" && (time_s - 3.22).abs() < 1e-6 {
            let at = find(message, 3.22_f64.cos());
            message[at] ^= 1;
        }
    });
    assert_eq!(
        read_error(&file),
        "imu.omega_body_rad_s at 3.220000 s: value does not match its CRC32"
    );
}

#[test]
fn a_changed_time_is_named() {
    let file = path("changed_time.mcap");
    flight(4).write(&file).unwrap();
    rewrite(&file, |topic, time_s, message| {
        if topic == "battery" && (time_s - 3.2).abs() < 1e-6 {
            let at = find(message, 3.2);
            message[at..at + 8].copy_from_slice(&3.201_f64.to_le_bytes());
        }
    });
    assert_eq!(
        read_error(&file),
        "battery.voltage_v at 3.201000 s: value does not match its CRC32"
    );
}

#[test]
fn a_channel_that_a_message_lacks_is_nan_and_shifts_nothing() {
    let file = path("lacks.mcap");
    let mut expected = flight(1);
    expected.write(&file).unwrap();
    // The list is field 2: key, length 24, three numbers. The first message lacks it, so its width
    // is not known yet.
    let lacks = |time_s: f64| time_s < 1e-6 || (time_s - 0.5).abs() < 1e-6;
    rewrite(&file, |topic, time_s, message| {
        if topic == "imu" && lacks(time_s) {
            let at = message.windows(2).position(|bytes| bytes == [2 << 3 | 2, 24]).unwrap();
            message.drain(at..at + 26);
        }
    });
    let log = FlightLog::read(&file).unwrap();
    let omega = |log: &FlightLog, i| log.channel("imu.omega_body_rad_s").unwrap().1.row(i).to_vec();
    for i in 0..=50 {
        if lacks(f64::from(i) / 50.0) {
            assert!(omega(&log, i as usize).iter().all(|value| value.is_nan()));
        } else {
            assert_eq!(omega(&log, i as usize), omega(&expected, i as usize));
        }
    }
    let temperature = expected.source_mut("imu").channels.remove("temperature_k");
    assert_eq!(log.channel("imu.temperature_k").map(|(_, channel)| channel), temperature.as_ref());
}

#[test]
fn a_row_of_another_width_is_named() {
    let file = path("row_width.mcap");
    flight(1).write(&file).unwrap();
    rewrite(&file, |topic, time_s, message| {
        if topic == "imu" && (time_s - 0.5).abs() < 1e-6 {
            let at = message.windows(2).position(|bytes| bytes == [2 << 3 | 2, 24]).unwrap();
            let two: Vec<u8> =
                [1.0_f64, 2.0].iter().flat_map(|value| value.to_le_bytes()).collect();
            let mut crc = crc32fast::Hasher::new();
            crc.update(&0.5_f64.to_le_bytes());
            crc.update(&two);
            message.splice(at + 1..at + 26, [&[16], &*two].concat());
            let at = message.len() - 8;
            message[at..at + 4].copy_from_slice(&crc.finalize().to_le_bytes());
        }
    });
    assert_eq!(
        read_error(&file),
        "imu.omega_body_rad_s at 0.500000 s: 2 numbers, before it 3 a sample"
    );
}

#[test]
fn numbers_and_names_of_fields_are_those_of_the_schema_in_the_file() {
    let field = |name: &str, number, kind: Type| FieldDescriptorProto {
        name: Some(name.to_owned()),
        number: Some(number),
        r#type: Some(kind.into()),
        label: Some(if kind == Type::Fixed32 { Label::Repeated } else { Label::Optional }.into()),
        ..FieldDescriptorProto::default()
    };
    let message = DescriptorProto {
        name: Some("Later".to_owned()),
        field: vec![
            field("crc32", 20, Type::Fixed32),
            field("a_rad", 9, Type::Double),
            field("time_s", 7, Type::Double),
            field("b_m", 3, Type::Double),
            field("note", 2, Type::String),
        ],
        ..DescriptorProto::default()
    };
    let set = FileDescriptorSet {
        file: vec![FileDescriptorProto {
            package: Some("squirrel".to_owned()),
            message_type: vec![message],
            ..FileDescriptorProto::default()
        }],
    };
    let crc = |value: f64| crc32fast::hash(&[0.5_f64.to_le_bytes(), value.to_le_bytes()].concat());
    let mut message = Vec::new();
    prost::encoding::fixed32::encode_repeated(20, &[crc(-2.0), crc(0.25)], &mut message);
    prost::encoding::double::encode(9, &0.25, &mut message);
    prost::encoding::string::encode(2, &"unknown to this reader".to_owned(), &mut message);
    prost::encoding::double::encode(7, &0.5, &mut message);
    prost::encoding::double::encode(3, &-2.0, &mut message);

    let file = path("later.mcap");
    let mut writer = mcap::Writer::new(fs::File::create(&file).unwrap()).unwrap();
    let schema = writer.add_schema("squirrel.Later", "protobuf", &set.encode_to_vec()).unwrap();
    let channel_id = writer.add_channel(schema, "later", "protobuf", &BTreeMap::new()).unwrap();
    let header = MessageHeader { channel_id, sequence: 0, log_time: 500_000_000, publish_time: 0 };
    writer.write_to_known_channel(&header, &message).unwrap();
    writer
        .write_metadata(&Metadata { name: "squirrel".to_owned(), metadata: BTreeMap::new() })
        .unwrap();
    writer.finish().unwrap();

    let mut expected = FlightLog::default();
    expected.source_mut("later").push(0.5, &[("a_rad", &[0.25]), ("b_m", &[-2.0])]);
    assert_eq!(FlightLog::read(&file).unwrap(), expected);
}

#[test]
fn a_message_without_its_checksums_is_found() {
    let file = path("no_crc.mcap");
    flight(1).write(&file).unwrap();
    // The last field of the message: key of two bytes, length, two checksums.
    rewrite(&file, |topic, _, message| {
        message.truncate(message.len() - if topic == "imu" { 11 } else { 0 });
    });
    assert_eq!(read_error(&file), "corrupt: imu at 0.000000 s: 0 CRC32s for 2 channels");
}

#[test]
fn chunks_that_squirrel_cannot_unpack_are_not_called_corrupt() {
    let file = path("packed.mcap");
    flight(3).write(&file).unwrap();
    let mut bytes = fs::read(&file).unwrap();
    bytes.truncate(bytes.len() / 2);
    let at = bytes.windows(4).position(|word| word == b"zstd").unwrap();
    bytes[at..at + 4].copy_from_slice(b"lzma");
    fs::write(&file, &bytes).unwrap();
    assert_eq!(
        read_error(&file),
        "not a flight log of squirrel: its chunks are packed with lzma, not zstd; \
         `squirrel import` reads other logs"
    );
}

#[test]
fn files_that_are_no_flight_log_get_one_clear_line() {
    let missing = path("missing.mcap");
    assert!(read_error(&missing).contains("No such file"));

    let file = path("empty.mcap");
    fs::write(&file, b"").unwrap();
    assert_eq!(read_error(&file), "the file is empty");

    let file = path("text.mcap");
    fs::write(&file, b"t,gx,gy,gz\n0.0,1,2,3\n").unwrap();
    assert_eq!(read_error(&file), "not an MCAP file; `squirrel import` reads other logs");

    let file = path("json.mcap");
    let mut writer = mcap::Writer::new(fs::File::create(&file).unwrap()).unwrap();
    let schema = writer.add_schema("Odometry", "jsonschema", b"{}").unwrap();
    let channel_id = writer.add_channel(schema, "/odom", "json", &BTreeMap::new()).unwrap();
    let header = MessageHeader { channel_id, sequence: 0, log_time: 0, publish_time: 0 };
    writer.write_to_known_channel(&header, b"{}").unwrap();
    writer.finish().unwrap();
    assert_eq!(
        read_error(&file),
        "not a flight log of squirrel: topic `/odom` has json messages of schema `Odometry`; \
         `squirrel import` reads other logs"
    );

    let file = path("no_metadata.mcap");
    mcap::Writer::new(fs::File::create(&file).unwrap()).unwrap().finish().unwrap();
    assert_eq!(
        read_error(&file),
        "not a flight log of squirrel: no metadata record `squirrel`; `squirrel import` reads other logs"
    );
}
