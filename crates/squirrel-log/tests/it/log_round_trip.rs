//! A flight log comes back from its file with the same bits, and the file is what MCAP tools
//! expect.

use std::fs;
use std::path::PathBuf;

use mcap::records::op;
use proptest::collection::vec;
use proptest::prelude::*;
use prost::Message as _;
use squirrel_log::{Channel, FlightLog, LogError, Source};

fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name)
}

/// Equal down to the bits, which `==` on floats is not (NaN, -0.0).
fn assert_same_bits(a: &FlightLog, b: &FlightLog) {
    let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
    assert_eq!(a.metadata, b.metadata);
    assert_eq!(a.sources.keys().collect::<Vec<_>>(), b.sources.keys().collect::<Vec<_>>());
    for ((name, a), b) in a.sources.iter().zip(b.sources.values()) {
        assert_eq!(bits(&a.time_s), bits(&b.time_s), "{name}");
        assert_eq!(a.channels.keys().collect::<Vec<_>>(), b.channels.keys().collect::<Vec<_>>());
        for ((channel, a), b) in a.channels.iter().zip(b.channels.values()) {
            assert_eq!(a.width, b.width, "{name}.{channel}");
            assert_eq!(bits(&a.values), bits(&b.values), "{name}.{channel}");
        }
    }
}

fn source() -> impl Strategy<Value = Source> {
    let any_bits = any::<u64>().prop_map(f64::from_bits);
    let value = prop_oneof![4 => any_bits, 1 => Just(0.0), 1 => Just(-0.0), 1 => Just(f64::NAN)];
    let channels = prop::collection::btree_map("[a-z_][a-z0-9_]{0,9}", 1_usize..6, 0..4);
    (vec(1e-6..0.7_f64, 1..12), channels).prop_flat_map(move |(steps_s, widths)| {
        let samples = steps_s.len();
        let columns: Vec<_> =
            widths.values().map(|width| vec(value.clone(), samples * width)).collect();
        columns.prop_map(move |columns| {
            let until = |i| steps_s[..i].iter().sum::<f64>();
            let time_s = (0..samples).map(until).collect();
            let channels = widths.iter().zip(columns);
            let channels = channels
                .map(|((name, &width), values)| (name.clone(), Channel { width, values }))
                .collect();
            Source { time_s, channels }
        })
    })
}

fn flight() -> impl Strategy<Value = FlightLog> {
    let metadata = prop::collection::btree_map("[a-z]{1,8}", ".{0,40}", 0..4);
    let sources = prop::collection::btree_map("[a-z_]{1,8}(\\.[a-z]{1,5})?", source(), 0..4);
    (metadata, sources).prop_map(|(metadata, sources)| FlightLog { metadata, sources })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn every_bit_comes_back(log in flight()) {
        let file = path("round_trip.mcap");
        log.write(&file).unwrap();
        assert_same_bits(&log, &FlightLog::read(&file).unwrap());
        let (recovered, recovery) = FlightLog::recover(&file).unwrap();
        assert_same_bits(&log, &recovered);
        prop_assert_eq!(recovery.bytes_whole, fs::metadata(&file).unwrap().len());
        prop_assert_eq!(recovery.bytes_total, recovery.bytes_whole);
    }
}

#[test]
fn sources_that_nobody_asked_for_are_left_out_and_the_others_come_back() {
    let (file, mut log) = (path("some_sources.mcap"), small_flight());
    log.write(&file).unwrap();
    let kept = log.sources.keys().next().unwrap().clone();
    log.sources.retain(|name, _| *name == kept);
    assert_same_bits(&log, &FlightLog::read_where(&file, |name| name == kept).unwrap());
}

/// Two sources of different rate, 2.5 s.
fn small_flight() -> FlightLog {
    let mut log = FlightLog::default();
    log.metadata.insert("seed".to_owned(), "7".to_owned());
    for i in 0..250 {
        let time_s = f64::from(i) / 100.0;
        let omega = [time_s.sin(), time_s.cos(), 0.0];
        log.source_mut("imu")
            .push(time_s, &[("omega_body_rad_s", &omega), ("temperature_k", &[293.0])]);
        if i % 10 == 0 {
            log.source_mut("control.outer").push(time_s, &[("thrust_n", &[5.4 + time_s])]);
        }
    }
    log
}

#[test]
fn equal_logs_give_equal_bytes_and_leave_no_other_file() {
    let folder = path("equal_bytes");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir(&folder).unwrap();
    let log = small_flight();
    for name in ["a.mcap", "b.mcap"] {
        log.clone().write(&folder.join(name)).unwrap();
    }
    assert_eq!(fs::read(folder.join("a.mcap")).unwrap(), fs::read(folder.join("b.mcap")).unwrap());
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 2);
}

#[test]
fn messages_stand_in_order_of_time_then_of_source_name() {
    let file = path("order.mcap");
    small_flight().write(&file).unwrap();
    let bytes = fs::read(&file).unwrap();
    let messages: Vec<_> = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap).collect();
    assert_eq!(messages.len(), 275);
    assert_eq!(messages[0].channel.topic, "control.outer");
    assert_eq!(messages[1].channel.topic, "imu");
    assert!(
        messages
            .iter()
            .is_sorted_by_key(|message| (message.log_time, message.channel.topic.clone()))
    );
    assert_eq!(messages[274].log_time, 2_490_000_000);
    assert_eq!(messages[274].sequence, 249);
}

#[test]
fn no_chunk_spans_more_than_a_second_and_metadata_comes_first() {
    let file = path("chunks.mcap");
    small_flight().write(&file).unwrap();
    let bytes = fs::read(&file).unwrap();
    let records = mcap::read::LinearReader::new(&bytes).unwrap().map(Result::unwrap);
    let mut kinds = Vec::new();
    for record in records {
        if let mcap::records::Record::Chunk { header, .. } = &record {
            assert!(header.message_end_time - header.message_start_time < 1_000_000_000);
            assert_eq!(header.compression, "zstd");
        }
        kinds.push(record.opcode());
    }
    assert_eq!(kinds[..3], [op::HEADER, op::METADATA, op::CHUNK]);
    kinds.retain(|&kind| kind == op::CHUNK);
    assert_eq!(kinds.len(), 3);
}

/// What mcap's own writer makes of the messages of a file, chunk by chunk.
fn by_mcap(bytes: &[u8]) -> mcap::Summary {
    let summary = mcap::Summary::read(bytes).unwrap().unwrap();
    let mut again = std::io::Cursor::new(Vec::new());
    let mut writer = mcap::WriteOptions::new().library("squirrel 2").create(&mut again).unwrap();
    let metadata = mcap::read::metadata(bytes, &summary.metadata_indexes[0]).unwrap();
    writer.write_metadata(&metadata).unwrap();
    for id in 1..=summary.channels.len() as u16 {
        let channel = &summary.channels[&id];
        let schema = channel.schema.as_ref().unwrap();
        let schema = writer.add_schema(&schema.name, &schema.encoding, &schema.data).unwrap();
        let (topic, encoding) = (&channel.topic, &channel.message_encoding);
        assert_eq!(writer.add_channel(schema, topic, encoding, &channel.metadata).unwrap(), id);
    }
    for chunk in &summary.chunk_indexes {
        for message in summary.stream_chunk(bytes, chunk).unwrap().map(Result::unwrap) {
            let header = mcap::records::MessageHeader {
                channel_id: message.channel.id,
                sequence: message.sequence,
                log_time: message.log_time,
                publish_time: message.publish_time,
            };
            writer.write_to_known_channel(&header, &message.data).unwrap();
        }
        writer.flush().unwrap();
    }
    writer.finish().unwrap()
}

#[test]
fn a_file_is_what_mcap_s_own_writer_makes_of_it() {
    let file = path("container.mcap");
    let mut log = small_flight();
    // A second of more than a chunk has.
    for i in 0..300 {
        log.source_mut("wide").push(0.9 + f64::from(i) / 300.0, &[("x", &[1.0; 1000])]);
    }
    log.metadata.insert("obstacles_json".to_owned(), "[[10.0, 0.5, 0.2]]".to_owned());
    log.write(&file).unwrap();
    let bytes = fs::read(&file).unwrap();
    let (ours, theirs) = (mcap::Summary::read(&bytes).unwrap().unwrap(), by_mcap(&bytes));
    assert_eq!(ours.stats, theirs.stats);
    assert_eq!((&ours.schemas, &ours.channels), (&theirs.schemas, &theirs.channels));
    assert_eq!(ours.metadata_indexes, theirs.metadata_indexes);
    assert!(ours.chunk_indexes.len() > 3 && ours.chunk_indexes.len() == theirs.chunk_indexes.len());
    let mut messages = 0;
    for (own, their) in ours.chunk_indexes.iter().zip(&theirs.chunk_indexes) {
        let times = |index: &mcap::records::ChunkIndex| {
            (index.message_start_time, index.message_end_time, index.uncompressed_size)
        };
        assert_eq!(times(own), times(their));
        // Each entry of an index leads to its message.
        let indexes = ours.read_message_indexes(&bytes, own).unwrap();
        messages += indexes.values().map(Vec::len).sum::<usize>();
        assert!(indexes.iter().all(|(channel, entries)| {
            entries.iter().all(|entry| {
                let message = ours.seek_message(&bytes, own, entry).unwrap();
                (&message.channel, message.log_time) == (channel, entry.log_time)
            })
        }));
    }
    assert_eq!(messages, 250 + 25 + 300 + 1);
}

#[test]
fn the_schema_in_the_file_names_the_channels() {
    let file = path("schema.mcap");
    small_flight().write(&file).unwrap();
    let bytes = fs::read(&file).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let schema = summary.schemas.values().find(|schema| schema.name == "squirrel.Imu").unwrap();
    assert!(summary.schemas.values().any(|schema| schema.name == "squirrel.ControlOuter"));
    let set = prost_types::FileDescriptorSet::decode(&*schema.data).unwrap();
    let fields: Vec<_> = set.file[0].message_type[0]
        .field
        .iter()
        .map(|field| (field.name(), field.number()))
        .collect();
    assert_eq!(
        fields,
        [("time_s", 1), ("omega_body_rad_s", 2), ("temperature_k", 3), ("crc32", 1000)]
    );
}

#[test]
fn a_source_without_samples_is_a_source_that_the_log_lacks() {
    let file = path("no_samples.mcap");
    let mut log = small_flight();
    log.source_mut("gnss")
        .channels
        .insert("position_ned_m".to_owned(), Channel { width: 3, values: vec![] });
    log.write(&file).unwrap();
    assert_same_bits(&small_flight(), &FlightLog::read(&file).unwrap());
}

/// What `write` says about a small flight after a change.
fn refusal(name: &str, change: impl FnOnce(&mut FlightLog)) -> String {
    let file = path(name);
    let _ = fs::remove_file(&file);
    let mut log = small_flight();
    change(&mut log);
    let error: LogError = log.write(&file).unwrap_err();
    assert!(!file.exists());
    let text = error.to_string();
    text.strip_prefix(&format!("{}: ", file.display()))
        .expect("starts with the file name")
        .to_owned()
}

#[test]
fn a_log_that_breaks_a_rule_is_refused_with_its_place() {
    let time = |index: usize, time_s: f64| {
        refusal("time.mcap", |log| log.source_mut("imu").time_s[index] = time_s)
    };
    assert_eq!(time(3, f64::NAN), "imu: time_s[3] = NaN: not finite");
    assert_eq!(time(249, f64::INFINITY), "imu: time_s[249] = inf: not finite");
    assert_eq!(time(0, -0.5), "imu: time_s[0] = -0.5: before 0 s");
    assert_eq!(time(3, 0.02), "imu: time_s[3] = 0.02: not after the sample before it (0.02)");
    assert_eq!(
        time(249, 2e10),
        "imu: time_s[249] = 20000000000: after 1.8e10 s, the last that a file holds"
    );

    let omega = |log: &mut FlightLog, width, values| {
        let channel = Channel { width, values: vec![0.0; values] };
        log.source_mut("imu").channels.insert("omega_body_rad_s".to_owned(), channel);
    };
    let short = refusal("length.mcap", |log| omega(log, 3, 749));
    assert_eq!(short, "imu.omega_body_rad_s: 749 values for 250 samples of width 3");
    let flat = refusal("length.mcap", |log| omega(log, 0, 0));
    assert_eq!(flat, "imu.omega_body_rad_s: 0 values for 250 samples of width 0");

    let name = |source: &str, channel: &str| {
        refusal("name.mcap", |log| log.source_mut(source).push(0.0, &[(channel, &[1.0])]))
    };
    assert!(name("gps 2", "x").starts_with("`gps 2` cannot be the name of a source"));
    assert!(name("gps.", "x").starts_with("`gps.` cannot be the name of a source"));
    assert!(name("", "x").starts_with("`` cannot be the name of a source"));
    assert!(name("gps", "1st").starts_with("`gps.1st` cannot be the name of a channel"));
    assert!(name("gps", "time_s").contains("the file has a field of that name"));
    assert!(name("gps", "crc32").contains("the file has a field of that name"));

    let wide = refusal("wide.mcap", |log| {
        let names: Vec<_> = (0..999).map(|i| format!("c{i}")).collect();
        let rows: Vec<_> = names.iter().map(|name| (name.as_str(), &[0.0][..])).collect();
        log.source_mut("rotor").push(0.0, &rows);
    });
    assert_eq!(wide, "rotor: 999 channels, a source holds at most 998");
}

#[test]
fn a_folder_that_does_not_exist_is_named() {
    let file = path("no_such_folder").join("flight.mcap");
    let text = small_flight().write(&file).unwrap_err().to_string();
    assert!(text.starts_with(&format!("{}: ", file.display())), "{text}");
}

#[test]
#[should_panic(expected = "`omega` has 2 numbers, in the first sample 3")]
fn a_row_of_another_width_is_a_mistake_in_the_program() {
    let mut source = Source::default();
    source.push(0.0, &[("omega", &[1.0, 2.0, 3.0])]);
    source.push(0.1, &[("omega", &[1.0, 2.0])]);
}
