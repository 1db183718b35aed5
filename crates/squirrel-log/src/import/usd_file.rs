//! Micro-SD logs of a Crazyflie: the records of one event type as rows.
//!
//! `usd_format.rs` describes the format. The columns are the event's variables, and `timestamp`, in
//! us whichever version the file has. The last four bytes are the CRC-32 of all before them. A file
//! that contradicts it, or ends inside a record, is refused: the firmware writes the CRC when it is
//! told to stop and when it is turned off, so this is a bad copy, and which of its bytes are good
//! nobody knows.

use std::collections::BTreeSet;

use super::error::ImportError;
use super::meter::Meter;
use super::names::nearest;
use super::number::Column;
use super::table::{Table, TableFile};
use super::usd_format::Header;

/// Bytes of the CRC at the end.
const CRC_BYTES: usize = 4;

/// One event type of a micro-SD log, its records not decoded yet.
pub(super) struct UsdFile<'a> {
    /// Path as given, and topic, for error messages.
    name: String,
    bytes: Vec<u8>,
    columns: Vec<Column>,
    names: Vec<String>,
    /// Where the records of the event start.
    records: Vec<usize>,
    meter: &'a Meter<'a>,
}

impl<'a> UsdFile<'a> {
    /// Finds the records of an event.
    ///
    /// # Errors
    /// [`ImportError::Damaged`], [`ImportError::MissingTopic`].
    pub(super) fn open(
        file: &str,
        bytes: Vec<u8>,
        topic: &str,
        meter: &'a Meter<'a>,
    ) -> Result<Self, ImportError> {
        let damaged = |problem: String| ImportError::Damaged { file: file.to_owned(), problem };
        let header = Header::read(&bytes, topic).map_err(damaged)?;
        let mut topics = BTreeSet::new();
        let records = records(&bytes, &header, topic, &mut topics).map_err(damaged)?;
        check_crc(&bytes).map_err(damaged)?;
        if records.is_empty() {
            let nearest = nearest(topic, topics.into_iter());
            return Err(ImportError::MissingTopic {
                file: file.to_owned(),
                topic: topic.to_owned(),
                nearest,
            });
        }
        let columns = header.columns;
        let names = columns.iter().map(|column| column.name.clone()).collect();
        let name = format!("{file}, topic `{topic}`");
        Ok(Self { name, bytes, columns, names, records, meter })
    }
}

impl TableFile for UsdFile<'_> {
    fn columns(&self) -> &[String] {
        &self.names
    }

    fn read(self: Box<Self>, wanted: &[&str]) -> Result<Table, ImportError> {
        let records = self.records.iter().map(|&record| &self.bytes[record..]);
        let table = Table::of_records(self.name, &self.columns, &self.names, wanted, records)?;
        self.meter.add(self.bytes.len());
        Ok(table)
    }
}

/// Where the records of an event start; `topics` gets the names of all events that have records.
fn records<'h>(
    bytes: &[u8],
    header: &'h Header,
    topic: &str,
    topics: &mut BTreeSet<&'h str>,
) -> Result<Vec<usize>, String> {
    let end = bytes.len().saturating_sub(CRC_BYTES);
    if end < header.size {
        return Err(format!(
            "ends after {} bytes, before the CRC-32 behind the header",
            bytes.len()
        ));
    }
    let (mut at, mut records) = (header.size, Vec::new());
    while at < end {
        let cut = |name: &str, size| {
            format!("ends inside the record of {name} at byte {at}: {} of {size} bytes", end - at)
        };
        let &id = bytes[at..end].first_chunk().ok_or_else(|| cut("an event", 2))?;
        let id = u16::from_le_bytes(id);
        let event = header
            .events
            .get(&id)
            .ok_or_else(|| format!("the record at byte {at} is of the unknown event id {id}"))?;
        if event.size > end - at {
            return Err(cut(&format!("`{}`", event.name), event.size));
        }
        if event.name == topic {
            records.push(at);
        } else {
            topics.insert(event.name.as_str());
        }
        at += event.size;
    }
    Ok(records)
}

fn check_crc(bytes: &[u8]) -> Result<(), String> {
    let Some((before, &crc)) = bytes.split_last_chunk() else {
        return Err("ends before its CRC-32".to_owned());
    };
    let (stored, computed) = (u32::from_le_bytes(crc), crc32fast::hash(before));
    if stored == computed {
        return Ok(());
    }
    let at = before.len();
    Err(format!(
        "the CRC-32 at byte {at} is {stored:08x}, that of the bytes before it is {computed:08x}"
    ))
}
