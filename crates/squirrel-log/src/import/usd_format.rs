//! The header of a Crazyflie's micro-SD log: which kinds of records there are, and which numbers
//! each holds.
//!
//! After the firmware's `usddeck.c` and Bitcraze's `cfusdlog.py`, all little endian: the byte 0xBC,
//! the version (u16, 1 or 2), the number of event types (u16); then of each its id (u16), its name,
//! the number of its variables (u16), and these as `name(type)`. Texts end with a zero; a type is a
//! letter of Python's `struct`. A record is the id of its event (u16), the time (version 1: u32,
//! ms; version 2: u64, us) and the variables without padding.

use std::collections::{BTreeMap, BTreeSet};

use super::number::{Column, Kind};

const MAGIC: u8 = 0xBC;
/// Name of the column with the time of a record.
const TIMESTAMP: &str = "timestamp";
/// Bytes of the id of an event.
const ID_BYTES: usize = 2;

/// Whether the first byte of a file is that of a micro-SD log.
pub(super) fn is_usd(first: u8) -> bool {
    first == MAGIC
}

/// What a header says.
#[derive(Debug)]
pub(super) struct Header {
    /// By id.
    pub(super) events: BTreeMap<u16, EventType>,
    /// Of the wanted event; the time is the first.
    pub(super) columns: Vec<Column>,
    /// Bytes of the header: where the records start.
    pub(super) size: usize,
}

/// A kind of record.
#[derive(Debug)]
pub(super) struct EventType {
    pub(super) name: String,
    /// Bytes of a record, id and time included.
    pub(super) size: usize,
}

impl Header {
    /// Reads the header of a file.
    ///
    /// * `wanted` - the event whose columns are kept: those of all would need many times the memory
    ///   of the file
    ///
    /// # Errors
    /// Says where it is cut off or contradicts the format.
    pub(super) fn read(bytes: &[u8], wanted: &str) -> Result<Self, String> {
        let mut text = Text { bytes, at: 0 };
        let [magic] = text.take()?;
        if !is_usd(magic) {
            return Err(format!(
                "byte 0 is {magic:#04x}, not {MAGIC:#04x} as in a Crazyflie's micro-SD log"
            ));
        }
        // Its type, and the microseconds of a step.
        let clock = match text.count()? {
            1 => (Kind::U32, 1000.0),
            2 => (Kind::U64, 1.0),
            version => return Err(format!("version {version} at byte 1, import reads 1 and 2")),
        };
        let count = text.count()?;
        let mut header = Self { events: BTreeMap::new(), columns: Vec::new(), size: 0 };
        let mut names = BTreeSet::new();
        for _ in 0..count {
            let at = text.at;
            let (id, name) = (text.count()?, text.name()?);
            let columns = if name == wanted { Some(&mut header.columns) } else { None };
            let size = event(&mut text, clock, columns)?;
            let new = names.insert(name);
            let old = header.events.insert(id, EventType { name: name.to_owned(), size });
            if !new || old.is_some() {
                return Err(format!(
                    "the event type at byte {at} repeats the name `{name}` or the id {id}"
                ));
            }
        }
        header.size = text.at;
        Ok(header)
    }
}

/// Reads the variables of an event, and adds the columns of its records; returns the bytes of a
/// record.
fn event(
    text: &mut Text,
    clock: (Kind, f64),
    mut columns: Option<&mut Vec<Column>>,
) -> Result<usize, String> {
    let count = text.count()?;
    let mut size = ID_BYTES;
    let mut add = |name: &str, (kind, scale): (Kind, f64)| {
        if let Some(columns) = &mut columns {
            columns.push(Column { name: name.to_owned(), offset: size, kind, scale });
        }
        size += kind.size();
    };
    add(TIMESTAMP, clock);
    for _ in 0..count {
        let at = text.at;
        let variable = text.name()?;
        let (name, letter) = variable
            .strip_suffix(')')
            .and_then(|variable| variable.rsplit_once('('))
            .ok_or_else(|| format!("the variable `{variable}` at byte {at} is not `name(type)`"))?;
        let kind = kind(letter).ok_or_else(|| {
            format!("the variable `{variable}` at byte {at} has the unknown type `{letter}`")
        })?;
        add(name, (kind, 1.0));
    }
    Ok(size)
}

/// The type that a letter stands for. The firmware writes b B h H i I e f; the others mean the same
/// to Bitcraze's reader.
fn kind(letter: &str) -> Option<Kind> {
    Some(match letter {
        "b" => Kind::I8,
        "B" => Kind::U8,
        "h" => Kind::I16,
        "H" => Kind::U16,
        "i" => Kind::I32,
        "I" => Kind::U32,
        "q" => Kind::I64,
        "Q" => Kind::U64,
        "e" => Kind::F16,
        "f" => Kind::F32,
        "d" => Kind::F64,
        _ => return None,
    })
}

/// A place in the header.
struct Text<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Text<'a> {
    fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.at..).unwrap_or_default()
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let taken = self.rest().first_chunk().ok_or_else(|| self.cut())?;
        self.at += N;
        Ok(*taken)
    }

    fn count(&mut self) -> Result<u16, String> {
        Ok(u16::from_le_bytes(self.take()?))
    }

    /// A text up to its zero, on one line: errors name it.
    fn name(&mut self) -> Result<&'a str, String> {
        let (at, rest) = (self.at, self.rest());
        let length = rest.iter().position(|&byte| byte == 0).ok_or_else(|| self.cut())?;
        self.at += length + 1;
        str::from_utf8(&rest[..length])
            .ok()
            .filter(|name| !name.contains(char::is_control))
            .ok_or_else(|| format!("the name at byte {at} is no text"))
    }

    fn cut(&self) -> String {
        format!("ends inside the header, after {} bytes", self.bytes.len())
    }
}
