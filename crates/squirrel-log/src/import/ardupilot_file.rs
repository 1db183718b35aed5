//! Dataflash logs of ArduPilot (`.bin`): the messages of one name as rows.
//!
//! The format is that of ArduPilot's `AP_Logger`: every message begins with the bytes 0xA3 0x95
//! and its type. `FMT` messages (type 128) describe all others: length, name, one letter a field,
//! names of the fields. `FMTU` says which unit a field is in and which of them counts instances.
//!
//! Logging drops messages and a card may lose bytes, so what does not read as a message is skipped
//! up to the next that does, as ArduPilot's own tools do; the table says how many bytes that were.

use std::collections::BTreeMap;

use super::error::ImportError;
use super::meter::Meter;
use super::names::nearest;
use super::number::{Column, Kind};
use super::rows::Records;
use super::table::{Table, TableFile};

const HEAD: [u8; 2] = [0xA3, 0x95];
/// Type of the message that describes messages.
const FMT: u8 = 0x80;
/// Head and type of a message.
const HEAD_BYTES: usize = 3;
const FMT_BYTES: usize = 89;
/// Messages that say when they were written are longer; shorter ones are not kept, for their
/// places would need more memory than they do.
const KEPT_BYTES_MIN: usize = 11;

/// Whether a file begins as a dataflash log.
pub(super) fn is_bin(start: &[u8]) -> bool {
    start.starts_with(&[HEAD[0], HEAD[1], FMT])
}

/// One kind of message.
#[derive(Debug, Default)]
pub(super) struct Message {
    pub(super) name: String,
    /// Bytes of a message, head included.
    size: usize,
    pub(super) columns: Vec<Column>,
    /// Of each field its column; a text is none.
    fields: Vec<Option<usize>>,
    /// Name, place and length of the fields that are text.
    texts: Vec<(String, usize, usize)>,
    /// The column that counts instances.
    instance: Option<usize>,
    /// Where its messages start.
    starts: Vec<usize>,
}

/// A log whose messages are found and not decoded.
#[derive(Debug, Default)]
pub(super) struct BinLog {
    pub(super) messages: Vec<Message>,
    /// Bytes between messages that are none.
    pub(super) bytes_lost: usize,
    /// Bytes behind the last whole message.
    pub(super) bytes_cut: usize,
}

impl BinLog {
    /// Finds all messages of a file.
    ///
    /// # Errors
    /// The file does not begin as such a log.
    pub(super) fn scan(bytes: &[u8]) -> Result<Self, String> {
        if !is_bin(bytes) {
            return Err("the first 3 bytes are not those of an ArduPilot log".to_owned());
        }
        let mut log = Self::default();
        // Which kind a type stands for; a later FMT may give it another.
        let mut kinds: [Option<usize>; 256] = [None; 256];
        let (mut at, mut whole) = (0, 0);
        while let Some(&[first, second, kind]) = bytes.get(at..).and_then(<[u8]>::first_chunk) {
            let known = if kind == FMT {
                Some(FMT_BYTES)
            } else {
                kinds[usize::from(kind)].map(|index| log.messages[index].size)
            };
            let end = known.map(|size| at + size).filter(|&end| end <= bytes.len());
            let Some(end) = end.filter(|_| [first, second] == HEAD) else {
                at = next_head(bytes, at + 1);
                continue;
            };
            log.bytes_lost += at - whole;
            if kind == FMT {
                log.define(&bytes[at..end], &mut kinds);
            } else if let Some(index) = kinds[usize::from(kind)] {
                let message = &mut log.messages[index];
                if message.size >= KEPT_BYTES_MIN {
                    message.starts.push(at);
                }
            }
            (at, whole) = (end, end);
        }
        log.bytes_cut = bytes.len() - whole;
        log.find_instances(bytes, &kinds);
        Ok(log)
    }

    /// Takes a `FMT` message; one that contradicts itself is as if it were not there.
    fn define(&mut self, fmt: &[u8], kinds: &mut [Option<usize>; 256]) {
        let body = &fmt[HEAD_BYTES..];
        let (kind, size) = (usize::from(body[0]), usize::from(body[1]));
        let [name, letters, labels] = [text(&body[2..6]), text(&body[6..22]), text(&body[22..])];
        let Some(mut new) = message(&name, size, &letters, &labels) else { return };
        let old = kinds[kind].map(|index| &self.messages[index]);
        let same = |old: &Message| {
            (&old.name, old.size, &old.columns) == (&new.name, new.size, &new.columns)
        };
        if old.is_some_and(same) {
            return;
        }
        let named = |name: &str| new.columns.iter().position(|column| column.name == name);
        new.instance = named("I").or_else(|| named("Instance"));
        kinds[kind] = Some(self.messages.len());
        self.messages.push(new);
    }

    /// `FMTU` marks the field that counts instances with a `#`.
    fn find_instances(&mut self, bytes: &[u8], kinds: &[Option<usize>; 256]) {
        let mut found = Vec::new();
        for units in self.messages.iter().filter(|message| message.name == "FMTU") {
            let Some(of) = units.columns.iter().find(|column| column.name == "FmtType") else {
                continue;
            };
            for &start in &units.starts {
                let record = &bytes[start..start + units.size];
                let Some(ids) = units.text(record, "UnitIds") else { continue };
                let index = kinds[of.number(record) as usize % kinds.len()];
                found.extend(index.zip(ids.find('#')));
            }
        }
        for (index, field) in found {
            let message = &mut self.messages[index];
            message.instance = message.fields.get(field).copied().flatten();
        }
    }

    /// Messages that are kept.
    pub(super) fn message_count(&self) -> usize {
        self.messages.iter().map(|message| message.starts.len()).sum()
    }

    /// The kind of messages of a name that has most of them.
    pub(super) fn message(&self, name: &str) -> Option<&Message> {
        let named = self.messages.iter().filter(|m| m.name == name && !m.starts.is_empty());
        named.max_by_key(|message| message.starts.len())
    }

    /// The parameters: what `PARM` messages said last.
    pub(super) fn parameters(&self, bytes: &[u8]) -> BTreeMap<String, f64> {
        let mut all = BTreeMap::new();
        for parm in self.messages.iter().filter(|message| message.name == "PARM") {
            let Some(value) = parm.columns.iter().find(|column| column.name == "Value") else {
                continue;
            };
            for &start in &parm.starts {
                let record = &bytes[start..start + parm.size];
                let number = value.number(record);
                if let Some(name) = parm.text(record, "Name").filter(|_| number.is_finite()) {
                    all.insert(name, number);
                }
            }
        }
        all
    }
}

impl Message {
    /// The messages of an instance, or all of a kind that has none.
    pub(super) fn records<'a>(&'a self, bytes: &'a [u8], instance: u8) -> Records<'a> {
        let counter = self.instance.and_then(|index| self.columns.get(index));
        let all = self.starts.iter().map(|&start| &bytes[start..start + self.size]);
        let own = |record: &&[u8]| {
            counter.is_none_or(|column| column.number(record) == f64::from(instance))
        };
        Records { columns: &self.columns, records: all.filter(own).collect() }
    }

    /// Whether its messages say which instance they are of.
    pub(super) fn has_instances(&self) -> bool {
        self.instance.is_some()
    }

    fn text(&self, record: &[u8], name: &str) -> Option<String> {
        let (_, place, length) = self.texts.iter().find(|(text, ..)| text == name)?;
        Some(text(record.get(*place..place + length)?))
    }
}

/// The kind of messages that a `FMT` describes; `None` if it contradicts itself.
fn message(name: &str, size: usize, letters: &str, labels: &str) -> Option<Message> {
    let mut message = Message { name: name.to_owned(), size, ..Message::default() };
    let mut labels = labels.split(',').filter(|label| !label.is_empty());
    let mut offset = HEAD_BYTES;
    for letter in letters.chars() {
        let label = labels.next()?.to_owned();
        let bytes = match field(letter)? {
            Field::Number(kind, scale) => {
                message.fields.push(Some(message.columns.len()));
                message.columns.push(Column { name: label, offset, kind, scale });
                kind.size()
            }
            Field::Text(length) => {
                message.fields.push(None);
                message.texts.push((label, offset, length));
                length
            }
        };
        offset += bytes;
    }
    (offset == size && labels.next().is_none() && !name.is_empty()).then_some(message)
}

enum Field {
    /// A number, and from what is stored to its unit.
    Number(Kind, f64),
    /// So many bytes that are no number: text, or 32 numbers of 16 bits.
    Text(usize),
}

fn field(letter: char) -> Option<Field> {
    Some(match letter {
        'b' => Field::Number(Kind::I8, 1.0),
        'B' | 'M' => Field::Number(Kind::U8, 1.0),
        'h' => Field::Number(Kind::I16, 1.0),
        'H' => Field::Number(Kind::U16, 1.0),
        'i' => Field::Number(Kind::I32, 1.0),
        'I' => Field::Number(Kind::U32, 1.0),
        'q' => Field::Number(Kind::I64, 1.0),
        'Q' => Field::Number(Kind::U64, 1.0),
        'g' => Field::Number(Kind::F16, 1.0),
        'f' => Field::Number(Kind::F32, 1.0),
        'd' => Field::Number(Kind::F64, 1.0),
        'c' => Field::Number(Kind::I16, 0.01),
        'C' => Field::Number(Kind::U16, 0.01),
        'e' => Field::Number(Kind::I32, 0.01),
        'E' => Field::Number(Kind::U32, 0.01),
        'L' => Field::Number(Kind::I32, 1e-7),
        'n' => Field::Text(4),
        'N' => Field::Text(16),
        'Z' | 'a' => Field::Text(64),
        _ => return None,
    })
}

/// A text up to its zero.
fn text(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|&byte| byte == 0).unwrap_or(bytes.len());
    bytes[..end]
        .iter()
        .map(|&byte| if byte.is_ascii_graphic() { byte as char } else { '?' })
        .collect()
}

/// Where the next message may start.
fn next_head(bytes: &[u8], from: usize) -> usize {
    let rest = bytes.get(from..).unwrap_or_default();
    rest.windows(2).position(|pair| pair == HEAD).map_or(bytes.len(), |at| from + at)
}

/// One kind of messages of a file, not decoded yet.
pub(super) struct BinFile<'a> {
    /// Path as given, and topic, for error messages.
    name: String,
    bytes: Vec<u8>,
    message: Message,
    names: Vec<String>,
    instance: u8,
    bytes_cut: usize,
    meter: &'a Meter<'a>,
}

impl<'a> BinFile<'a> {
    /// Finds the messages of a name.
    ///
    /// # Errors
    /// [`ImportError::Damaged`], [`ImportError::MissingTopic`].
    pub(super) fn open(
        file: &str,
        bytes: Vec<u8>,
        (topic, instance): (&str, u8),
        meter: &'a Meter<'a>,
    ) -> Result<Self, ImportError> {
        let mut log = BinLog::scan(&bytes)
            .map_err(|problem| ImportError::Damaged { file: file.to_owned(), problem })?;
        let found = log.message(topic).filter(|m| !m.records(&bytes, instance).records.is_empty());
        let label =
            if instance == 0 { topic.to_owned() } else { format!("{topic} instance {instance}") };
        if found.is_none() {
            let written = log.messages.iter().filter(|message| !message.starts.is_empty());
            return Err(ImportError::MissingTopic {
                file: file.to_owned(),
                topic: label,
                nearest: nearest(topic, written.map(|message| message.name.as_str())),
            });
        }
        log.messages.retain(|message| message.name == topic);
        log.messages.sort_by_key(|message| message.starts.len());
        let message = log.messages.pop().unwrap_or_default();
        let names = message.columns.iter().map(|column| column.name.clone()).collect();
        let name = format!("{file}, topic `{label}`");
        let bytes_cut = log.bytes_cut + log.bytes_lost;
        Ok(Self { name, bytes, message, names, instance, bytes_cut, meter })
    }
}

impl TableFile for BinFile<'_> {
    fn columns(&self) -> &[String] {
        &self.names
    }

    fn read(self: Box<Self>, wanted: &[&str]) -> Result<Table, ImportError> {
        let rows = self.message.records(&self.bytes, self.instance);
        let records = rows.records.iter().copied();
        let mut table =
            Table::of_records(self.name, &self.message.columns, &self.names, wanted, records)?;
        self.meter.add(self.bytes.len());
        table.bytes_cut = self.bytes_cut as u64;
        Ok(table)
    }
}
