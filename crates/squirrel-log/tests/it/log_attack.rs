//! What a mutated flight log is read as: whole, what is whole of it, and in pieces, which agree.
//!
//! A byte that changed in a log does not get past the checksums around it. So that readers behind
//! them see something, one kind of log has none: its records are changed and packed again, without a
//! checksum but for those in the messages.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use mcap::MAGIC;
use mcap::records::op;
use mcap::sans_io::{LinearReadEvent, LinearReader};
use squirrel_log::{FlightLog, LogError, LogReader};

use crate::import_attack::is_placed;

/// Opcode and length of a record.
const HEAD: usize = 9;
/// A chunk ends behind so many bytes: a log of 40 kB has several.
const CHUNK_BYTES: usize = 8_000;

/// Reads a log in all ways that there are. Read in pieces it is what it is whole, or is refused as
/// it is whole.
pub(crate) fn read(path: &Path) {
    let whole = FlightLog::read(path);
    is_placed(FlightLog::recover(path), path);
    match (in_pieces(path), whole) {
        (Ok(Some(pieces)), Ok(whole)) => assert_eq!(bits(&pieces), bits(&whole)),
        // One that was changed behind its samples: known when they were given out.
        (Err(LogError::Corrupt { what, .. }), Ok(_)) if what.starts_with("metadata behind") => {}
        (Ok(None), _) | (Err(_), Err(_)) => {}
        (pieces, whole) => panic!("in pieces {pieces:?}, whole {whole:?}"),
    }
}

fn in_pieces(path: &Path) -> Result<Option<FlightLog>, LogError> {
    let Some(mut reader) = LogReader::open(path)? else { return Ok(None) };
    let mut log = FlightLog { metadata: reader.metadata().clone(), ..FlightLog::default() };
    while let Some(piece) = reader.next_piece()? {
        log.append(piece);
    }
    Ok(Some(log))
}

/// Metadata, and by source and channel widths and bits: NaN is NaN.
type Bits<'a> = (&'a BTreeMap<String, String>, Vec<(&'a str, &'a str, usize, Vec<u64>)>);

fn bits(log: &FlightLog) -> Bits<'_> {
    let mut all = Vec::new();
    let of = |values: &[f64]| values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    for (name, source) in &log.sources {
        all.push((&**name, "time_s", 1, of(&source.time_s)));
        for (channel, c) in &source.channels {
            all.push((name, channel, c.width, of(&c.values)));
        }
    }
    (&log.metadata, all)
}

/// The records that say something, out of their chunks.
pub(crate) fn records(file: &[u8]) -> Vec<u8> {
    let (mut reader, mut rest, mut out) = (LinearReader::new(), file, Vec::new());
    while let Some(event) = reader.next_event() {
        match event.unwrap() {
            LinearReadEvent::ReadRequest(need) => {
                let (now, later) = rest.split_at(need.min(rest.len()));
                reader.insert(now.len()).copy_from_slice(now);
                reader.notify_read(now.len());
                rest = later;
            }
            LinearReadEvent::Record { data, opcode } => {
                let says = [op::HEADER, op::METADATA, op::SCHEMA, op::CHANNEL, op::MESSAGE];
                if says.contains(&opcode) {
                    record(opcode, data, &mut out);
                }
            }
        }
    }
    out
}

fn record(opcode: u8, body: &[u8], out: &mut Vec<u8>) {
    out.push(opcode);
    out.extend((body.len() as u64).to_le_bytes());
    out.extend(body);
}

/// A file of records, in chunks, without a checksum. What is no record ends its last chunk.
pub(crate) fn file(records: &[u8]) -> Vec<u8> {
    let (mut out, mut chunk, mut rest) = (MAGIC.to_vec(), Vec::new(), records);
    while !rest.is_empty() {
        let length = rest.get(1..HEAD).map_or(u64::MAX, |b| {
            u64::from_le_bytes(b.try_into().unwrap()).saturating_add(HEAD as u64)
        });
        let length = usize::try_from(length).unwrap_or(usize::MAX).min(rest.len());
        let (one, later) = rest.split_at(length);
        if [op::HEADER, op::METADATA].contains(&one[0]) {
            close(&mut chunk, &mut out);
            out.extend(one);
        } else {
            chunk.extend(one);
        }
        if chunk.len() > CHUNK_BYTES {
            close(&mut chunk, &mut out);
        }
        rest = later;
    }
    close(&mut chunk, &mut out);
    record(op::DATA_END, &[0; 4], &mut out);
    record(op::FOOTER, &[0; 20], &mut out);
    out.extend(MAGIC);
    out
}

/// Two times, the size, no checksum, no packing, the records behind their length.
fn close(chunk: &mut Vec<u8>, out: &mut Vec<u8>) {
    if chunk.is_empty() {
        return;
    }
    let length = (chunk.len() as u64).to_le_bytes();
    let body = [&[0; 16][..], &length, &[0; 8], &length, chunk].concat();
    record(op::CHUNK, &body, out);
    chunk.clear();
}

#[test]
fn a_log_without_checksums_is_read_in_pieces() {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("loose.mcap");
    let mut log = FlightLog::default();
    for k in 0..500 {
        log.source_mut("imu").push(0.01 * f64::from(k), &[("x", &[1.0, 2.0, f64::from(k)])]);
    }
    log.write(&path).unwrap();
    let loose = file(&records(&fs::read(&path).unwrap()));
    fs::write(&path, &loose).unwrap();
    let mut reader = LogReader::open(&path).unwrap().unwrap();
    let pieces = std::iter::from_fn(|| reader.next_piece().unwrap()).count();
    assert!(pieces > 2 && FlightLog::read(&path).unwrap() == log, "{pieces}");
}
