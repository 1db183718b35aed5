//! ULog files of PX4: the messages of one topic as rows.
//!
//! The format is that of docs.px4.io, "ULog File Format", version 1 with appended data: a header,
//! then records of size, type and payload. A log that ends inside a record, as one does after a
//! loss of power, is read up to there, and the table says how many bytes are left out; any other
//! damage is an error.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use super::error::ImportError;
use super::meter::Meter;
use super::names::nearest;
use super::table::{Table, TableFile};
use super::ulog_format::Layout;

const MAGIC: [u8; 7] = *b"ULog\x01\x12\x35";
/// Magic bytes, version, start time.
const HEADER_BYTES: usize = 16;
/// Size and type of a record.
const RECORD_HEAD_BYTES: usize = 3;
/// The only incompatible flag that there is: data were appended after a crash.
const FLAG_APPENDED: u8 = 1;

/// One topic of a ULog file, its messages not decoded yet.
pub(super) struct UlogFile<'a> {
    /// Path as given, and topic, for error messages.
    name: String,
    bytes: Vec<u8>,
    layout: Layout,
    columns: Vec<String>,
    /// Where the messages are in the file.
    messages: Vec<Range<usize>>,
    bytes_cut: usize,
    meter: &'a Meter<'a>,
}

impl<'a> UlogFile<'a> {
    /// Finds the messages of a topic.
    ///
    /// * `instance` - PX4's multi id: 0 for the first sensor of a kind
    ///
    /// # Errors
    /// [`ImportError::Damaged`], [`ImportError::MissingTopic`].
    pub(super) fn open(
        file: &str,
        bytes: Vec<u8>,
        topic: &str,
        instance: u8,
        meter: &'a Meter<'a>,
    ) -> Result<Self, ImportError> {
        let damaged = |problem: String| ImportError::Damaged { file: file.to_owned(), problem };
        let wanted = label(topic, instance);
        let mut log = Records::default();
        log.scan(&bytes, &wanted).map_err(damaged)?;
        if log.messages.is_empty() {
            if log.bytes_cut > 0 {
                let end = bytes.len() - log.bytes_cut;
                let problem = format!(
                    "ends inside the record at byte {end}, before any message of `{wanted}`"
                );
                return Err(damaged(problem));
            }
            let nearest = nearest(&wanted, log.topics.iter().map(String::as_str));
            return Err(ImportError::MissingTopic {
                file: file.to_owned(),
                topic: wanted,
                nearest,
            });
        }
        let layout = Layout::new(topic, &log.definitions).map_err(damaged)?;
        let length = layout.size_logged..=layout.size;
        if let Some(message) = log.messages.iter().find(|message| !length.contains(&message.len()))
        {
            return Err(damaged(format!(
                "the message of `{wanted}` at byte {} has {} bytes, its format {}",
                message.start,
                message.len(),
                layout.size
            )));
        }
        let name = format!("{file}, topic `{wanted}`");
        let columns = layout.columns.iter().map(|column| column.name.clone()).collect();
        let Records { messages, bytes_cut, .. } = log;
        Ok(Self { name, bytes, layout, columns, messages, bytes_cut, meter })
    }
}

impl TableFile for UlogFile<'_> {
    fn columns(&self) -> &[String] {
        &self.columns
    }

    fn read(self: Box<Self>, wanted: &[&str]) -> Result<Table, ImportError> {
        let records = self.messages.iter().map(|message| &self.bytes[message.clone()]);
        let mut table =
            Table::of_records(self.name, &self.layout.columns, &self.columns, wanted, &records)?;
        self.meter.add(self.bytes.len());
        table.bytes_cut = self.bytes_cut as u64;
        Ok(table)
    }
}

/// A topic as messages name it: `sensor_gyro`, and `sensor_gyro instance 1` for the second of a
/// kind.
fn label(topic: &str, instance: u8) -> String {
    if instance == 0 { topic.to_owned() } else { format!("{topic} instance {instance}") }
}

/// What a scan of the file gathers.
#[derive(Default)]
struct Records {
    /// Field lists by format name.
    definitions: BTreeMap<String, String>,
    /// Topic and instance by message id.
    subscriptions: BTreeMap<u16, String>,
    /// All topics with messages.
    topics: BTreeSet<String>,
    /// Payloads of the wanted topic, without message id.
    messages: Vec<Range<usize>>,
    /// Where appended data start.
    appended: Vec<usize>,
    bytes_total: usize,
    bytes_cut: usize,
}

impl Records {
    fn scan(&mut self, bytes: &[u8], wanted: &str) -> Result<(), String> {
        if !bytes.starts_with(&MAGIC) && !MAGIC.starts_with(bytes) {
            return Err("the first 7 bytes are not those of a ULog file".to_owned());
        }
        if bytes.len() < HEADER_BYTES {
            return Err(format!("ends inside the header, after {} bytes", bytes.len()));
        }
        self.bytes_total = bytes.len();
        let mut start = HEADER_BYTES;
        loop {
            // Appended data start where they say, and what stands before them may end inside a
            // record.
            let section_end =
                self.appended.iter().copied().find(|&at| at > start).unwrap_or(bytes.len());
            let rest = &bytes[start..section_end];
            match record(rest) {
                Some((kind, payload)) => {
                    let at = start + RECORD_HEAD_BYTES;
                    self.record(kind, payload, at, wanted)
                        .map_err(|problem| format!("the record at byte {start} {problem}"))?;
                    start = at + payload.len();
                }
                None if section_end < bytes.len() => start = section_end,
                None => {
                    self.bytes_cut = rest.len();
                    return Ok(());
                }
            }
        }
    }

    fn record(&mut self, kind: u8, payload: &[u8], at: usize, wanted: &str) -> Result<(), String> {
        let text =
            |bytes| str::from_utf8(bytes).map_err(|_| "has a name that is no text".to_owned());
        match kind {
            b'B' => {
                let flags = payload.get(8..16).ok_or("is too short for flags")?;
                if flags[0] & !FLAG_APPENDED != 0 || flags[1..].iter().any(|&flag| flag != 0) {
                    return Err(format!("has flags of a later format: {flags:02x?}"));
                }
                if flags[0] == FLAG_APPENDED {
                    self.appended(&payload[16..])?;
                }
            }
            b'F' => {
                let (name, fields) =
                    text(payload)?.split_once(':').ok_or("is no format: no `:`")?;
                self.definitions.insert(name.to_owned(), fields.to_owned());
            }
            b'A' => {
                let (&[instance, low, high], name) =
                    payload.split_first_chunk().ok_or("is too short for a topic")?;
                self.subscriptions
                    .insert(u16::from_le_bytes([low, high]), label(text(name)?, instance));
            }
            b'D' => {
                let (&id, data) =
                    payload.split_first_chunk().ok_or("is too short for a message")?;
                let id = u16::from_le_bytes(id);
                let topic = self
                    .subscriptions
                    .get(&id)
                    .ok_or_else(|| format!("is a message of unknown id {id}"))?;
                if topic == wanted {
                    self.messages.push(at + payload.len() - data.len()..at + payload.len());
                }
                if !self.topics.contains(topic) {
                    self.topics.insert(topic.clone());
                }
            }
            // Parameters, texts, drop-outs and the like are no numbers over time; later types are
            // to be skipped.
            _ => {}
        }
        Ok(())
    }

    /// Takes up to three offsets of appended data; 0 is none.
    fn appended(&mut self, offsets: &[u8]) -> Result<(), String> {
        for offset in offsets.chunks_exact(8).take(3).filter_map(|offset| offset.first_chunk()) {
            let at = u64::from_le_bytes(*offset);
            if at > self.bytes_total as u64 {
                return Err(format!(
                    "says that data are appended at byte {at} of {}",
                    self.bytes_total
                ));
            }
            if at > 0 {
                self.appended.push(at as usize);
            }
        }
        self.appended.sort_unstable();
        Ok(())
    }
}

/// Type and payload of the first record; `None` if it is not whole, or was never written.
fn record(bytes: &[u8]) -> Option<(u8, &[u8])> {
    let &[low, high, kind] = bytes.first_chunk()?;
    let size = usize::from(u16::from_le_bytes([low, high]));
    let payload = bytes.get(RECORD_HEAD_BYTES..RECORD_HEAD_BYTES + size)?;
    (kind != 0).then_some((kind, payload))
}
