//! ULog files of PX4: the messages of one topic as rows.
//!
//! The format is that of docs.px4.io, "ULog File Format", version 1 with appended data: a header,
//! then records of size, type and payload. A log that ends inside a record, as one does after a
//! loss of power, is read up to there, and the table says how many bytes are left out; any other
//! damage is an error.

use std::collections::BTreeMap;
use std::ops::Range;

use super::error::ImportError;
use super::meter::Meter;
use super::names::nearest;
use super::number::Kind;
use super::table::{Table, TableFile};
use super::ulog_format::Layout;

const MAGIC: [u8; 7] = *b"ULog\x01\x12\x35";
/// Magic bytes, version, start time.
const HEADER_BYTES: usize = 16;
/// Size and type of a record.
const RECORD_HEAD_BYTES: usize = 3;
/// The only incompatible flag that there is: data were appended after a crash.
const FLAG_APPENDED: u8 = 1;

/// Whether a file begins as a ULog.
pub(super) fn is_ulog(start: &[u8]) -> bool {
    start.starts_with(&MAGIC)
}

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
        let mut log = UlogLog::scan(&bytes, Some(&wanted)).map_err(damaged)?;
        let messages = log.take_messages(&wanted);
        if messages.is_empty() {
            if log.bytes_cut > 0 {
                let end = bytes.len() - log.bytes_cut;
                let problem = format!(
                    "ends inside the record at byte {end}, before any message of `{wanted}`"
                );
                return Err(damaged(problem));
            }
            let nearest = nearest(&wanted, log.written());
            return Err(ImportError::MissingTopic {
                file: file.to_owned(),
                topic: wanted,
                nearest,
            });
        }
        let layout = Layout::new(topic, &log.definitions).map_err(damaged)?;
        let length = layout.size_logged..=layout.size;
        if let Some(message) = messages.iter().find(|message| !length.contains(&message.len())) {
            return Err(damaged(format!(
                "the message of `{wanted}` at byte {} has {} bytes, its format {}",
                message.start,
                message.len(),
                layout.size
            )));
        }
        let name = format!("{file}, topic `{wanted}`");
        let columns = layout.columns.iter().map(|column| column.name.clone()).collect();
        let bytes_cut = log.bytes_cut;
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
            Table::of_records(self.name, &self.layout.columns, &self.columns, wanted, records)?;
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
#[derive(Debug, Default)]
pub(super) struct UlogLog {
    /// Field lists by format name.
    definitions: BTreeMap<String, String>,
    /// Topics in the order of their subscription, and by their label.
    topics: Vec<Topic>,
    by_label: BTreeMap<String, usize>,
    /// Topic by message id.
    subscriptions: BTreeMap<u16, usize>,
    /// What the log says of parameters, at its begin and in flight; the last holds.
    pub(super) parameters: BTreeMap<String, f64>,
    /// Times at which the logger could not write, and how long in all, ms.
    pub(super) dropouts: (usize, u64),
    /// Where appended data start.
    appended: Vec<usize>,
    bytes_total: usize,
    /// Bytes at the end that are no whole record.
    pub(super) bytes_cut: usize,
}

/// One publisher of a topic.
#[derive(Debug)]
struct Topic {
    kept: bool,
    written: bool,
    /// Payloads without message id.
    messages: Vec<Range<usize>>,
}

impl UlogLog {
    /// Finds the messages of a file.
    ///
    /// * `wanted` - the topic whose messages are kept; `None` keeps all
    ///
    /// # Errors
    /// Says which record contradicts the format.
    pub(super) fn scan(bytes: &[u8], wanted: Option<&str>) -> Result<Self, String> {
        if !is_ulog(bytes) && !MAGIC.starts_with(bytes) {
            return Err("the first 7 bytes are not those of a ULog file".to_owned());
        }
        if bytes.len() < HEADER_BYTES {
            return Err(format!("ends inside the header, after {} bytes", bytes.len()));
        }
        let mut log = Self { bytes_total: bytes.len(), ..Self::default() };
        let mut start = HEADER_BYTES;
        loop {
            // Appended data start where they say, and what stands before them may end inside a
            // record.
            let section_end =
                log.appended.iter().copied().find(|&at| at > start).unwrap_or(bytes.len());
            let rest = &bytes[start..section_end];
            match record(rest) {
                Some((kind, payload)) => {
                    let at = start + RECORD_HEAD_BYTES;
                    log.record(kind, payload, at, wanted)
                        .map_err(|problem| format!("the record at byte {start} {problem}"))?;
                    start = at + payload.len();
                }
                None if section_end < bytes.len() => start = section_end,
                None => {
                    log.bytes_cut = rest.len();
                    return Ok(log);
                }
            }
        }
    }

    fn record(
        &mut self,
        kind: u8,
        payload: &[u8],
        at: usize,
        wanted: Option<&str>,
    ) -> Result<(), String> {
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
                let label = label(text(name)?, instance);
                let known = self.by_label.get(&label).copied();
                let topic = known.unwrap_or(self.topics.len());
                if known.is_none() {
                    let kept = wanted.is_none_or(|wanted| wanted == label);
                    self.topics.push(Topic { kept, written: false, messages: Vec::new() });
                    self.by_label.insert(label, topic);
                }
                self.subscriptions.insert(u16::from_le_bytes([low, high]), topic);
            }
            b'D' => {
                let (&id, data) =
                    payload.split_first_chunk().ok_or("is too short for a message")?;
                let id = u16::from_le_bytes(id);
                let &topic = self
                    .subscriptions
                    .get(&id)
                    .ok_or_else(|| format!("is a message of unknown id {id}"))?;
                let topic = &mut self.topics[topic];
                topic.written = true;
                if topic.kept {
                    topic.messages.push(at + payload.len() - data.len()..at + payload.len());
                }
            }
            b'P' => self.parameters.extend(parameter(payload)),
            b'O' => {
                let milliseconds = payload.first_chunk().map_or(0, |&ms| u16::from_le_bytes(ms));
                self.dropouts.0 += 1;
                self.dropouts.1 += u64::from(milliseconds);
            }
            // Texts and the like are no numbers over time; later types are to be skipped.
            _ => {}
        }
        Ok(())
    }

    /// Topics that have messages.
    fn written(&self) -> impl Iterator<Item = &str> {
        let written = self.by_label.iter().filter(|(_, index)| self.topics[**index].written);
        written.map(|(label, _)| label.as_str())
    }

    /// Messages that are kept.
    pub(super) fn message_count(&self) -> usize {
        self.topics.iter().map(|topic| topic.messages.len()).sum()
    }

    fn take_messages(&mut self, label: &str) -> Vec<Range<usize>> {
        let index = self.by_label.get(label);
        index.map(|&i| std::mem::take(&mut self.topics[i].messages)).unwrap_or_default()
    }

    /// The messages of a topic and the layout of its columns; `None` if it has none, or none that
    /// its format fits.
    pub(super) fn messages(&self, topic: &str, instance: u8) -> Option<(Layout, &[Range<usize>])> {
        let &index = self.by_label.get(&label(topic, instance))?;
        let messages = self.topics[index].messages.as_slice();
        let layout = Layout::new(topic, &self.definitions).ok()?;
        let fits = |message: &Range<usize>| message.len() >= layout.size_logged;
        (!messages.is_empty() && messages.iter().all(fits)).then_some((layout, messages))
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

/// Name and value of a parameter: the length of a text `type name`, the text, the value.
fn parameter(payload: &[u8]) -> Option<(String, f64)> {
    let (&length, rest) = payload.split_first()?;
    let (key, value) = rest.split_at_checked(usize::from(length))?;
    let (kind, name) = str::from_utf8(key).ok()?.split_once(' ')?;
    let value = match kind {
        "int32_t" => Kind::I32.number(value),
        "float" => Kind::F32.number(value),
        _ => return None,
    };
    value.is_finite().then(|| (name.to_owned(), value))
}

/// Type and payload of the first record; `None` if it is not whole, or was never written.
fn record(bytes: &[u8]) -> Option<(u8, &[u8])> {
    let &[low, high, kind] = bytes.first_chunk()?;
    let size = usize::from(u16::from_le_bytes([low, high]));
    let payload = bytes.get(RECORD_HEAD_BYTES..RECORD_HEAD_BYTES + size)?;
    (kind != 0).then_some((kind, payload))
}
