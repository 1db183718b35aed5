//! Topics and types: what only ULog, MCAP or Parquet has.

use super::import_support::Flight;
use super::import_support::formats::{Cells, McapMessage, Ulog, mcap_bytes, parquet_bytes};
use parquet::basic::Compression;
use px4_ulog::full_parser::{MultiId, SomeVec, read_file};

/// A map from columns `columns` of a topic to `truth.a`.
fn map(topic: &str, time: &str, columns: &[&str]) -> String {
    let topic = if topic.is_empty() { String::new() } else { format!("topic = \"{topic}\"") };
    format!(
        "[[source]]\n{topic}\ntime = {{ column = \"{time}\", unit = \"us\" }}\n\
         channels = {{ \"truth.a\" = {{ columns = {columns:?} }} }}\n"
    )
}

fn values(flight: &Flight, map: &str, file: &str) -> Vec<f64> {
    flight.import(map, &[file]).unwrap().0.channel("truth.a").unwrap().1.values.clone()
}

fn error(flight: &Flight, map: &str, file: &str) -> String {
    flight.message(&flight.import(map, &[file]).unwrap_err())
}

/// Two instances of a topic with all types, arrays and a nested format.
fn typed_ulog() -> Ulog {
    let log = Ulog::new()
        .flags(None)
        .format("esc:int16_t rpm;uint8_t[2] _padding0;float volts;")
        .format("all:uint64_t timestamp;int8_t a;uint8_t b;int16_t c;uint16_t d;int32_t e;uint32_t f;int64_t g;double h;bool i;esc[2] esc;uint8_t[5] _padding0;")
        .subscribe(0, "all", 0)
        .subscribe(700, "all", 1);
    let fields = |time_us: u64, h: f64| {
        let mut bytes = time_us.to_le_bytes().to_vec();
        bytes.extend([0x80, 0xff]);
        bytes.extend((-300_i16).to_le_bytes());
        bytes.extend(60_000_u16.to_le_bytes());
        bytes.extend((-70_000_i32).to_le_bytes());
        bytes.extend(4_000_000_000_u32.to_le_bytes());
        bytes.extend((-5_000_000_000_i64).to_le_bytes());
        bytes.extend(h.to_le_bytes());
        bytes.push(1);
        for (rpm, volts) in [(-7_i16, 1.5_f32), (8, 2.5)] {
            bytes.extend(rpm.to_le_bytes());
            bytes.extend([0, 0]);
            bytes.extend(volts.to_le_bytes());
        }
        bytes
    };
    log.data(0, &fields(10, 0.1))
        .data(700, &fields(11, 0.2))
        .data(0, &fields(20, f64::NAN))
        .data(700, &fields(21, 0.4))
}

const ALL: [&str; 13] = [
    "a",
    "b",
    "c",
    "d",
    "e",
    "f",
    "g",
    "h",
    "i",
    "esc[0].rpm",
    "esc[0].volts",
    "esc[1].rpm",
    "esc[1].volts",
];

#[test]
fn ulog_types_arrays_and_nested_formats_are_read() {
    let flight = Flight::new("types", &[]);
    flight.write("f.ulg", &typed_ulog().0);
    let got = values(&flight, &map("all", "timestamp", &ALL), "f.ulg");
    let first = [-128.0, 255.0, -300.0, 6e4, -7e4, 4e9, -5e9, 0.1, 1.0, -7.0, 1.5, 8.0, 2.5];
    assert_eq!(got[..13], first);
    assert!(got[13 + 7].is_nan());

    let second = map("all", "timestamp", &["h"]).replace("time =", "instance = 1\ntime =");
    assert_eq!(values(&flight, &second, "f.ulg"), [0.2, 0.4]);
    let (_, report) = flight.import(&second, &["f.ulg"]).unwrap();
    assert!(report.to_string().starts_with("f.ulg, all instance 1: 2 rows, 0 dropped"), "{report}");
    let third = second.replace("instance = 1", "instance = 2");
    assert_eq!(
        error(&flight, &third, "f.ulg"),
        "f.ulg: no message of topic `all instance 2`; nearest: all instance 1, all"
    );
}

/// PX4's own reader must see the same numbers in the bytes of the tests.
#[test]
fn the_reader_of_px4_agrees() {
    let flight = Flight::new("px4", &[]);
    flight.write("f.ulg", &typed_ulog().0);
    let px4 = read_file(flight.folder().join("f.ulg").to_str().unwrap()).unwrap();
    for instance in [0, 1] {
        let fields = &px4.messages["all"][&MultiId::new(instance)];
        assert_eq!(fields.len(), ALL.len() + 1);
        for column in ALL {
            let map = map("all", "timestamp", &[column]);
            let map = map.replace("time =", &format!("instance = {instance}\ntime ="));
            let expected: Vec<f64> = match &fields[column] {
                SomeVec::Int8(x) => x.iter().map(|&x| x.into()).collect(),
                SomeVec::UInt8(x) => x.iter().map(|&x| x.into()).collect(),
                SomeVec::Int16(x) => x.iter().map(|&x| x.into()).collect(),
                SomeVec::UInt16(x) => x.iter().map(|&x| x.into()).collect(),
                SomeVec::Int32(x) => x.iter().map(|&x| x.into()).collect(),
                SomeVec::UInt32(x) => x.iter().map(|&x| x.into()).collect(),
                SomeVec::Int64(x) => x.iter().map(|&x| x as f64).collect(),
                SomeVec::UInt64(x) => x.iter().map(|&x| x as f64).collect(),
                SomeVec::Float(x) => x.iter().map(|&x| x.into()).collect(),
                SomeVec::Double(x) => x.clone(),
                SomeVec::Bool(x) => x.iter().map(|&x| f64::from(u8::from(x))).collect(),
                SomeVec::Char(_) => panic!("no text here"),
            };
            assert_eq!(
                format!("{:?}", values(&flight, &map, "f.ulg")),
                format!("{expected:?}"),
                "{column}"
            );
        }
    }
}

#[test]
fn ulog_records_that_contradict_the_format_are_refused() {
    let flight = Flight::new("ulog", &[]);
    let start = || Ulog::new().flags(None).format("a:uint64_t timestamp;float x;");
    let message = [0; 12];
    let cases = [
        (start().data(5, &message), "f.ulg: the record at byte 91 is a message of unknown id 5"),
        (
            start().subscribe(5, "b", 0).data(5, &message),
            "f.ulg: no message of topic `a`; nearest: b",
        ),
        (Ulog::new().subscribe(5, "a", 0).data(5, &message), "f.ulg: format `a` is not defined"),
        (start().record(b'A', b"\0\0"), "f.ulg: the record at byte 91 is too short for a topic"),
        (start().record(b'D', b"\0"), "f.ulg: the record at byte 91 is too short for a message"),
        (start().record(b'F', b"nothing"), "f.ulg: the record at byte 91 is no format: no `:`"),
        (start().record(b'F', b"\xff:"), "f.ulg: the record at byte 91 has a name that is no text"),
        (
            start().subscribe(5, "a", 0).data(5, &message[1..]),
            "f.ulg: the message of `a` at byte 103 has 11 bytes, its format 12",
        ),
        (
            Ulog::new().flags(Some(1 << 40)),
            "f.ulg: the record at byte 16 says that data are appended at byte 1099511627776 of 59",
        ),
        (
            Ulog::new().record(b'B', &[0xff; 40]),
            "f.ulg: the record at byte 16 has flags of a later format: [ff, ff, ff, ff, ff, ff, ff, ff]",
        ),
    ];
    for (log, problem) in cases {
        flight.write("f.ulg", &log.0);
        assert_eq!(error(&flight, &map("a", "timestamp", &["x"]), "f.ulg"), problem);
    }
}

#[test]
fn appended_ulog_data_follow_a_cut_record() {
    let message = |t: u64| [&t.to_le_bytes()[..], &(t as f32).to_le_bytes()].concat();
    let log = |appended_at| {
        Ulog::new()
            .flags(appended_at)
            .format("a:uint64_t timestamp;float x;")
            .subscribe(1, "a", 0)
            .data(1, &message(1))
    };
    let mut bytes = log(None).data(1, &message(2)).0;
    bytes.truncate(bytes.len() - 4);
    let mut appended = log(Some(bytes.len() as u64)).data(1, &message(2)).0;
    appended.truncate(bytes.len());
    let appended = Ulog(appended).data(1, &message(3)).data(1, &message(4)).0;

    let flight = Flight::new("appended", &[]);
    flight.write("f.ulg", &appended);
    assert_eq!(values(&flight, &map("a", "timestamp", &["x"]), "f.ulg"), [1.0, 3.0, 4.0]);
    flight.write("f.ulg", &bytes);
    let (_, report) = flight.import(&map("a", "timestamp", &["x"]), &["f.ulg"]).unwrap();
    assert_eq!(report.files[0].bytes_cut, 13);
    assert!(
        report
            .to_string()
            .contains("the file ends inside a record, its last 13 bytes are left out")
    );
    // What a card was filled with in advance and never written.
    flight.write("f.ulg", &[&log(None).0[..], &[0; 4096]].concat());
    let (_, report) = flight.import(&map("a", "timestamp", &["x"]), &["f.ulg"]).unwrap();
    assert_eq!((report.files[0].rows, report.files[0].bytes_cut), (1, 4096));
}

#[test]
fn mcap_time_is_a_field_or_that_of_the_log() {
    let text = |x: &str| format!(r#"{{"x":{x},"log_tim":1}}"#);
    let messages: Vec<McapMessage> = vec![
        ("a", "json", 1_000, text("1")),
        ("b", "json", 1_500, "{}".to_owned()),
        ("a", "json", 2_000, text("true")),
        ("a", "json", 4_000, text(r#""NaN""#)),
        ("a", "json", 6_000, "{}".to_owned()),
        ("a", "json", 7_000, text(r#""-12345678901""#)),
    ];
    let flight = Flight::new("mcap", &[]);
    flight.write("f.mcap", &mcap_bytes(&messages, 60));
    let by_log = map("a", "log_time", &["x"]).replace("\"us\"", "\"ns\"");
    let (log, _) = flight.import(&by_log, &["f.mcap"]).unwrap();
    let (time_s, x) = log.channel("truth.a").unwrap();
    assert_eq!(time_s.len(), 5);
    assert!((time_s[4] - 6e-6).abs() < 1e-15);
    assert_eq!(format!("{:?}", x.values), "[1.0, 1.0, NaN, NaN, -12345678901.0]");
    let (log, _) = flight.import(&by_log.replace("log_time", "publish_time"), &["f.mcap"]).unwrap();
    assert_eq!(log.metadata["time_zero_s"], "0.0000015");
    // A field hides MCAP's own time.
    let messages = [1, 2].map(|t| ("a", "json", 0, format!(r#"{{"log_time":{t},"x":0}}"#)));
    flight.write("f.mcap", &mcap_bytes(&messages, 60));
    let (log, _) = flight.import(&by_log, &["f.mcap"]).unwrap();
    assert_eq!(log.metadata["time_zero_s"], "0.000000001");
}

#[test]
fn mcap_messages_that_are_no_numbers_are_refused() {
    let flight = Flight::new("json", &[]);
    let good = r#"{"t":1,"x":1}"#;
    for (encoding, second, problem) in [
        (
            "json",
            r#"{"t":2,"x":"high"}"#,
            "f.mcap, topic `a`, column `x`, row 2: `\"high\"` is no number",
        ),
        (
            "json",
            r#"{"t":2,"x":"Infinity"}"#,
            "f.mcap, topic `a`, column `x`, row 2: `\"Infinity\"` is infinite",
        ),
        (
            "json",
            r#"{"t":1,"x":1}"#,
            "f.mcap, topic `a`, column `t`, row 2: time repeats: 1 after 1 in row 1",
        ),
        (
            "json",
            r#"{"t":0,"x":1}"#,
            "f.mcap, topic `a`, column `t`, row 2: time runs backwards: 0 after 1 in row 1",
        ),
        ("json", r#"{"x":1}"#, "f.mcap, topic `a`, column `t`, row 2: `` is no time"),
        (
            "json",
            r#"{"t":2"#,
            "f.mcap, topic `a`: message 2 is no JSON: EOF while parsing an object at line 1 column 6",
        ),
        (
            "json",
            r#"{"t":1e999}"#,
            "f.mcap, topic `a`: message 2 is no JSON: number out of range at line 1 column 10",
        ),
        ("cbor", good, "f.mcap: topic `a` has cbor messages, import reads json, cdr and protobuf"),
    ] {
        let messages = [("a", encoding, 1, good.to_owned()), ("a", encoding, 2, second.to_owned())];
        flight.write("f.mcap", &mcap_bytes(&messages, 1000));
        assert_eq!(error(&flight, &map("a", "t", &["x"]), "f.mcap"), problem);
    }
    // Deeper than any stack: the JSON reader stops.
    let deep = format!("{}{}", "[".repeat(100_000), "]".repeat(100_000));
    flight.write("f.mcap", &mcap_bytes(&[("a", "json", 1, deep)], 1000));
    assert!(error(&flight, &map("a", "t", &["x"]), "f.mcap").contains("recursion limit"));
}

#[test]
fn parquet_types_are_numbers_or_refused() {
    let flight = Flight::new("parquet", &[]);
    let schema =
        "required int64 t; optional int32 i; optional int32 u (UINT_32); required int64 big (UINT_64);
        optional boolean b; optional group gyro { optional double x; } optional binary s (UTF8);
        optional int32 d (DECIMAL(9, 2)); required double inf;";
    let columns = [
        Cells::Longs(vec![Some(1), Some(2), Some(3)]),
        Cells::Ints(vec![Some(-4), None, Some(5)]),
        Cells::Ints(vec![Some(-1), Some(1), None]),
        Cells::Longs(vec![Some(-1), Some(1), Some(2)]),
        Cells::Bools(vec![Some(true), Some(false), None]),
        Cells::Doubles(vec![None, None, None]),
        Cells::Texts(vec![Some("a".to_owned()), None, None]),
        Cells::Ints(vec![Some(1), None, None]),
        Cells::Doubles(vec![Some(0.0), Some(f64::NEG_INFINITY), Some(0.0)]),
    ];
    flight.write("f.parquet", &parquet_bytes(schema, &columns, 2, Compression::UNCOMPRESSED));
    let got = values(&flight, &map("", "t", &["i", "u", "big", "b", "gyro.x"]), "f.parquet");
    assert_eq!(
        format!("{got:?}"),
        "[-4.0, 4294967295.0, 1.8446744073709552e19, 1.0, NaN, NaN, 1.0, 1.0, 0.0, NaN, 5.0, NaN, 2.0, NaN, NaN]"
    );
    for (column, problem) in [
        ("s", "f.parquet: column `s` holds UTF8, not one number a row"),
        ("d", "f.parquet: column `d` holds decimals, not one number a row"),
        ("inf", "f.parquet, column `inf`, row 2: `-inf` is infinite"),
        ("gyro", "f.parquet: no column `gyro`; nearest: gyro.x"),
    ] {
        assert_eq!(error(&flight, &map("", "t", &[column]), "f.parquet"), problem);
    }
    let empty = parquet_bytes(
        "required int64 t; required double x;",
        &[Cells::Longs(vec![]), Cells::Doubles(vec![])],
        1,
        Compression::UNCOMPRESSED,
    );
    flight.write("f.parquet", &empty);
    assert_eq!(
        error(&flight, &map("", "t", &["x"]), "f.parquet"),
        "f.parquet: a header and no rows"
    );
}
