//! ROS 2 bags: every number as independent readers see it, and what a damaged message is told.

use super::import_support::Flight;
use mcap::WriteOptions;
use mcap::records::MessageHeader;
use std::collections::{BTreeMap, BTreeSet};
use std::io::Cursor;
use std::path::Path;

/// A file that `tests/data/ros/make.py` made.
fn data(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/ros").join(name)
}

fn map(topic: &str, columns: &[&str]) -> String {
    format!(
        "[[source]]\ntopic = \"{topic}\"\ntime = {{ column = \"log_time\", unit = \"ns\" }}\n\
         channels = {{ \"truth.a\" = {{ columns = {columns:?} }} }}\n"
    )
}

/// The numbers of a CSV file beside a bag: topic, then path, then row.
type Numbers = BTreeMap<String, BTreeMap<String, BTreeMap<usize, f64>>>;

fn numbers(name: &str) -> Numbers {
    let mut numbers = Numbers::new();
    for line in std::fs::read_to_string(data(name)).unwrap().lines() {
        let cells: Vec<&str> = line.split(',').collect();
        let [topic, path, row, value] = cells[..] else { panic!("{line}") };
        let paths = numbers.entry(topic.to_owned()).or_default();
        let rows = paths.entry(path.to_owned()).or_default();
        rows.insert(row.parse().unwrap(), value.parse().unwrap());
    }
    numbers
}

/// All numbers of the bags, to the bit of their type: with those of CDR, f64 holds all but integers
/// beyond 2^53, and these are the f64 nearest to what the readers print.
#[test]
fn every_number_is_what_rosbags_and_mcap_ros2_support_read() {
    let mut compared = 0;
    for bag in ["ros", "mocap", "px4", "odd", "odd_big_endian"] {
        let flight = Flight::new(bag, &[]);
        flight.write("f.mcap", &std::fs::read(data(&format!("{bag}.mcap"))).unwrap());
        for (topic, paths) in numbers(&format!("{bag}.csv")) {
            let columns: Vec<&str> = paths.keys().map(String::as_str).collect();
            // A channel with no number at all is refused; some paths are NaN throughout.
            let (log, _) = flight.import(&map(&topic, &columns), &["f.mcap"]).unwrap();
            let (time_s, channel) = log.channel("truth.a").unwrap();
            for row in 0..time_s.len() {
                for (got, column) in channel.row(row).iter().zip(&columns) {
                    let expected = paths[*column].get(&(row + 1)).copied().unwrap_or(f64::NAN);
                    // The map's offset makes 0 of -0.
                    let expected = expected + 0.0;
                    let same =
                        got.to_bits() == expected.to_bits() || got.is_nan() && expected.is_nan();
                    assert!(same, "{bag} {topic} {column} row {row}: {got} is not {expected}");
                    compared += usize::from(!got.is_nan());
                }
            }
        }
    }
    assert!(compared > 1500, "{compared}");
}

#[test]
fn a_stamp_is_one_time_in_ns() {
    let flight = Flight::new("stamp", &[]);
    flight.write("f.mcap", &std::fs::read(data("ros.mcap")).unwrap());
    let map = map("/mavros/imu/data", &["angular_velocity.x"]);
    let (log, _) = flight.import(&map.replace("log_time", "header.stamp"), &["f.mcap"]).unwrap();
    assert_eq!(log.metadata["time_zero_s"], "1700000000.1234567");
    let (log, _) = flight.import(&map, &["f.mcap"]).unwrap();
    assert_eq!(log.metadata["time_zero_s"], "1700000000.1254568");
}

/// A bag with one topic `a` of type `p/msg/A`.
fn bag(encoding: &str, definition: &str, messages: &[&[u8]]) -> Vec<u8> {
    bag_of("p/msg/A", encoding, definition.as_bytes(), messages)
}

fn bag_of(name: &str, encoding: &str, definition: &[u8], messages: &[&[u8]]) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    let mut writer = WriteOptions::new().compression(None).create(&mut file).unwrap();
    let schema = writer.add_schema(name, encoding, definition).unwrap();
    let channel_id = writer.add_channel(schema, "a", "cdr", &BTreeMap::new()).unwrap();
    for (i, message) in (1..).zip(messages) {
        let header = MessageHeader {
            channel_id,
            sequence: i,
            log_time: 1000 * u64::from(i),
            publish_time: 0,
        };
        writer.write_to_known_channel(&header, message).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    file.into_inner()
}

/// A little-endian message of 32-bit words.
fn words(words: &[u32]) -> Vec<u8> {
    let body = words.iter().flat_map(|word| word.to_le_bytes());
    [0, 1, 0, 0].into_iter().chain(body).collect()
}

#[test]
fn messages_that_contradict_their_schema_are_refused_in_one_line() {
    let flight = Flight::new("hostile", &[]);
    let good = words(&[7]);
    let whole = |kind: u8| [&[0, kind, 0, 0], &[0; 4][..]].concat();
    let cases: [(&str, &[u8], &str); 15] = [
        ("uint32 x", &[0, 1], "f.mcap, topic `a`: message 2 has 2 bytes, too few for a CDR header"),
        (
            "uint32 x",
            &[0, 1, 0, 0, 5],
            "f.mcap, topic `a`: message 2 ends too early for its schema: 1 numbers of 4 bytes at byte 4, 1 bytes are left",
        ),
        (
            "uint32 x",
            &whole(2),
            "f.mcap, topic `a`: message 2 is in PL_CDR (a parameter list); import reads plain CDR",
        ),
        (
            "uint32 x",
            &whole(7),
            "f.mcap, topic `a`: message 2 is in CDR2 (XCDR2); import reads XCDR1, which ROS 2 records",
        ),
        (
            "uint32 x",
            &whole(11),
            "f.mcap, topic `a`: message 2 is in PL_CDR2 (XCDR2); import reads XCDR1, which ROS 2 records",
        ),
        (
            "uint32 x",
            &whole(0x80),
            "f.mcap, topic `a`: message 2 has the unknown CDR encapsulation 0x80",
        ),
        (
            "uint32 x",
            &words(&[1, 2, 3]),
            "f.mcap, topic `a`: message 2 has 16 bytes, 8 more than its schema says",
        ),
        (
            "uint32 x\nuint8[] y",
            &words(&[1, u32::MAX]),
            "f.mcap, topic `a`: message 2 ends too early for its schema: a list of 4294967295 at byte 12, 0 bytes are left",
        ),
        (
            "uint32 x\nB[] y\n===\nMSG: p/B\nfloat64[] z",
            &words(&[1, 1, u32::MAX]),
            "f.mcap, topic `a`: message 2 ends too early for its schema: a list of 4294967295 at byte 16, 0 bytes are left",
        ),
        (
            "uint32 x\nstring y",
            &words(&[1, u32::MAX]),
            "f.mcap, topic `a`: message 2 ends too early for its schema: a text of 4294967295 bytes at byte 12, 0 bytes are left",
        ),
        (
            "uint32 x\nuint8[<=3] y",
            &words(&[1, 4, 0]),
            "f.mcap, topic `a`: message 2 has a list of 4 where its schema allows 3",
        ),
        (
            "uint32 x\nstring<=2 y",
            &words(&[1, 4, 0]),
            "f.mcap, topic `a`: message 2 has a text of 4 bytes where its schema allows 2",
        ),
        (
            "uint32 x\nfloat64[4294967295] y",
            &words(&[1]),
            "f.mcap, topic `a`: message 2 ends too early for its schema: 4294967295 numbers of 8 bytes at byte 8, 0 bytes are left",
        ),
        (
            "float32 x",
            &words(&[0x7f80_0000]),
            "f.mcap, topic `a`, column `x`, row 2: `inf` is infinite",
        ),
        (
            "string x",
            &words(&[0]),
            "f.mcap, topic `a`: no column `x`; nearest: log_time, publish_time",
        ),
    ];
    for (definition, second, problem) in cases {
        // The first message is whole wherever the second is what is wrong.
        let first = match definition {
            "uint32 x" | "float32 x" => good.clone(),
            "uint32 x\nfloat64[4294967295] y" => Vec::new(),
            _ => words(&[7, 0]),
        };
        flight.write("f.mcap", &bag("ros2msg", definition, &[&first, second]));
        let error = flight.import(&map("a", &["x"]), &["f.mcap"]).unwrap_err();
        let problem = if first.is_empty() {
            "f.mcap, topic `a`: message 1 has 0 bytes, too few for a CDR header"
        } else {
            problem
        };
        assert_eq!(flight.message(&error), problem, "{definition}");
    }
}

#[test]
fn schemas_that_say_nothing_are_refused_in_one_line() {
    let flight = Flight::new("schema", &[]);
    let doubling: String = (0..30)
        .map(|i| format!("===\nMSG: p/B{i}\nB{0} a\nB{0} b\n", i + 1))
        .chain(["===\nMSG: p/B30\nuint8 x\n".to_owned()])
        .collect();
    for (encoding, definition, problem) in [
        (
            "ros2idl",
            "struct A {};",
            "f.mcap, topic `a`: cdr messages with a schema in `ros2idl`; import reads `ros2msg`",
        ),
        (
            "ros2msg",
            "uint32",
            "f.mcap, topic `a`: schema `p/msg/A`: the definition of `p/A` has the line `uint32`: not `type name`",
        ),
        (
            "ros2msg",
            "uint32 x-y",
            "f.mcap, topic `a`: schema `p/msg/A`: the definition of `p/A` has the line `uint32 x-y`: not `type name`",
        ),
        (
            "ros2msg",
            "B x",
            "f.mcap, topic `a`: schema `p/msg/A`: field `x` of `p/A`: `p/B` is not defined",
        ),
        (
            "ros2msg",
            "uint8[x] x",
            "f.mcap, topic `a`: schema `p/msg/A`: field `x` of `p/A`: `uint8[x]` has no size",
        ),
        (
            "ros2msg",
            "uint8[0] x",
            "f.mcap, topic `a`: schema `p/msg/A`: field `x` of `p/A`: `uint8[0]` has no elements",
        ),
        (
            "ros2msg",
            "wstring x",
            "f.mcap, topic `a`: schema `p/msg/A`: field `x` of `p/A`: wstring is written in two ways, and the file does not say which: record without this topic",
        ),
        ("ros2msg", &format!("B0 x\n{doubling}"), "more than 20000 fields"),
        ("ros2msg", "A x", "`p/A` is nested more than 32 deep"),
    ] {
        flight.write("f.mcap", &bag(encoding, definition, &[&words(&[1])]));
        let error = flight.import(&map("a", &["x"]), &["f.mcap"]).unwrap_err();
        let message = flight.message(&error);
        assert!(message.ends_with(problem) && message.lines().count() == 1, "{message}");
    }
}

#[test]
fn a_bag_cut_anywhere_is_one_line() {
    let flight = Flight::new("cut", &[]);
    let whole = std::fs::read(data("mocap.mcap")).unwrap();
    let mut lines = BTreeSet::new();
    for end in (1..whole.len()).step_by(97) {
        flight.write("f.mcap", &whole[..end]);
        let result = flight.import(&map("/vrpn/pose", &["pose.position.x"]), &["f.mcap"]);
        let message = flight.message(&result.unwrap_err());
        assert!(message.starts_with("f.mcap: ") && message.lines().count() == 1, "{message}");
        lines.insert(message);
    }
    assert!(lines.iter().any(|line| line.contains("damaged or cut off")), "{lines:?}");
}

/// Random bytes in messages and schemas, lengths among them: an error of one line, or numbers.
#[test]
fn no_mutation_of_a_message_or_its_schema_ends_the_program() {
    let flight = Flight::new("mutated", &[]);
    let bytes = std::fs::read(data("odd.mcap")).unwrap();
    let messages: Vec<mcap::Message> =
        mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap).collect();
    let schema = messages[0].channel.schema.clone().unwrap();
    let mut state = 1_u64;
    let mut random = |below: usize| {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    let (mut refused, mut read) = (0, 0);
    for round in 0..1500 {
        let mut definition = schema.data.to_vec();
        let mut data: Vec<Vec<u8>> = messages.iter().map(|message| message.data.to_vec()).collect();
        let target =
            if round % 4 == 0 { &mut definition } else { &mut data[random(messages.len())] };
        let at = random(target.len());
        match random(4) {
            0 => target.truncate(at),
            1 => target[at] = [0, 1, 0x7f, 0xff][random(4)],
            2 => target[at] ^= 1 << random(8),
            _ => {
                let end = (at + 4).min(target.len());
                target[at..end].fill(0xff);
            }
        }
        let data: Vec<&[u8]> = data.iter().map(Vec::as_slice).collect();
        flight.write("f.mcap", &bag_of(&schema.name, "ros2msg", &definition, &data));
        match flight.import(&map("a", &["u8", "up_to_five[1]", "pair[1].few[0]"]), &["f.mcap"]) {
            Ok(_) => read += 1,
            Err(error) => {
                assert_eq!(flight.message(&error).lines().count(), 1, "{error}");
                refused += 1;
            }
        }
    }
    assert!(refused > 300 && read > 300, "{refused} refused, {read} read");
}
