//! A log that is written and read in pieces is the log.

use std::fs;
use std::path::PathBuf;

use squirrel_log::{Channel, FlightLog, LogReader, LogWriter, Source};

fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Three minutes: one source throughout, one whose samples are stamped two seconds before they come
/// (see [`piece`]), one that begins after two minutes.
fn flight() -> FlightLog {
    let source = |from_s: f64, rate_hz: f64, width: usize| {
        let count = ((180.0 - from_s) * rate_hz) as usize;
        let time_s: Vec<f64> = (0..count).map(|k| from_s + k as f64 / rate_hz).collect();
        let values = (0..count * width).map(|k| (k as f64 * 0.37).sin()).collect();
        let channels = [("x".to_owned(), Channel { width, values })].into();
        Source { time_s, channels }
    };
    FlightLog {
        metadata: [("seed".to_owned(), "7".to_owned())].into(),
        sources: [
            ("imu".to_owned(), source(0.0, 100.0, 3)),
            ("gnss".to_owned(), source(0.5, 5.0, 2)),
            ("alarm".to_owned(), source(120.0, 1.0, 1)),
        ]
        .into(),
    }
}

/// What comes between two times of the flight.
fn piece(log: &FlightLog, from_s: f64, until_s: f64) -> FlightLog {
    let mut out = FlightLog::default();
    for (name, source) in &log.sources {
        let late_s = if name == "gnss" { 2.0 } else { 0.0 };
        let place = |t: f64| source.time_s.partition_point(|time_s| time_s + late_s < t);
        let (a, b) = (place(from_s), place(until_s));
        if a < b {
            let cut = |c: &Channel| Channel {
                width: c.width,
                values: c.values[a * c.width..b * c.width].to_vec(),
            };
            let channels = source.channels.iter().map(|(n, c)| (n.clone(), cut(c))).collect();
            let time_s = source.time_s[a..b].to_vec();
            out.sources.insert(name.clone(), Source { time_s, channels });
        }
    }
    out
}

#[test]
fn pieces_give_the_bytes_of_the_whole() {
    let folder = folder("pieces_written");
    let (log, whole, pieces) = (flight(), folder.join("whole.mcap"), folder.join("pieces.mcap"));
    log.write(&whole).unwrap();
    for step_s in [0.7, 13.0, 400.0] {
        let mut writer = LogWriter::at(&pieces, &log.metadata).unwrap();
        let mut now_s = 0.0;
        while now_s < 190.0 {
            writer.push(piece(&log, now_s, now_s + step_s), now_s + step_s).unwrap();
            now_s += step_s;
        }
        assert!(!pieces.exists(), "it has its name when it is whole");
        writer.finish().unwrap();
        assert!(fs::read(&pieces).unwrap() == fs::read(&whole).unwrap(), "{step_s}");
        fs::remove_file(&pieces).unwrap();
    }
}

#[test]
fn a_writer_that_is_dropped_leaves_nothing() {
    let folder = folder("pieces_dropped");
    let (log, path) = (flight(), folder.join("flight.mcap"));
    fs::write(&path, "what was there").unwrap();
    let mut writer = LogWriter::at(&path, &log.metadata).unwrap();
    writer.push(piece(&log, 0.0, 150.0), 150.0).unwrap();
    drop(writer);
    assert_eq!(fs::read(&path).unwrap(), b"what was there");
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
}

#[test]
fn time_that_runs_back_between_pieces_is_refused() {
    let folder = folder("pieces_back");
    let log = flight();
    let mut writer = LogWriter::at(&folder.join("flight.mcap"), &log.metadata).unwrap();
    writer.push(piece(&log, 0.0, 5.0), 5.0).unwrap();
    let error = writer.push(piece(&log, 3.0, 4.0), 6.0).unwrap_err().to_string();
    assert!(error.contains("flight.mcap") && error.contains("time_s"), "{error}");
}

#[test]
fn pieces_read_are_the_log() {
    let folder = folder("pieces_read");
    let (log, path) = (flight(), folder.join("flight.mcap"));
    log.write(&path).unwrap();
    let mut reader = LogReader::open(&path).unwrap().unwrap();
    let mut all = FlightLog { metadata: reader.metadata().clone(), ..FlightLog::default() };
    let mut pieces = 0;
    while let Some(piece) = reader.next_piece().unwrap() {
        all.append(piece);
        pieces += 1;
    }
    assert!(pieces > 1, "three minutes are more than a piece");
    assert!(all == FlightLog::read(&path).unwrap() && all == log);
    // A log that was cut is for who reads it whole.
    let bytes = fs::read(&path).unwrap();
    fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    assert!(LogReader::open(&path).unwrap().is_none());
}
