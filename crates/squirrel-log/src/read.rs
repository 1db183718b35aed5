//! Reads a flight from an MCAP file: nothing that has changed since it was written gets through
//! unnoticed.

use std::collections::BTreeMap;
use std::path::Path;

use mcap::records::Record;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{MAGIC, McapError};

use super::envelope::{self, Damage, Frame};
use super::message::SourceReader;
use super::{
    FlightLog, LIBRARY, LogError, METADATA_CRC, METADATA_NAME, check, foxglove, metadata_crc32,
    schema,
};
use crate::files::{self, Budget, TooLarge};

/// Largest record or unpacked chunk, far above the 1 MiB that is written: a wrong length in a
/// damaged file does not eat the memory.
pub(super) const RECORD_MAX_BYTES: usize = 256 << 20;

/// What [`FlightLog::recover`] found.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Recovery {
    /// Length of the file, bytes.
    pub bytes_total: u64,
    /// Bytes from the start of the file up to the last whole record.
    pub bytes_whole: u64,
    /// Samples of all sources.
    pub messages: u64,
    /// Time of the last sample, s; 0 if there is none.
    pub end_time_s: f64,
    /// Whether the metadata have a checksum and match it; files of before version 2 have none.
    pub metadata_checked: bool,
}

impl FlightLog {
    /// Reads a flight log; the bits of every value are those that were written.
    ///
    /// A channel that a message lacks is NaN in that sample. Topics with Foxglove's own schemas are
    /// skipped.
    ///
    /// # Errors
    /// [`LogError`]: the file cannot be read, is empty, is no MCAP file, is no log of squirrel, is
    /// truncated, or any of its bytes or values does not match its checksum.
    pub fn read(path: &Path) -> Result<Self, LogError> {
        Self::read_where(path, |_| true)
    }

    /// As [`FlightLog::read`], of some sources alone: a log holds several times what most of its
    /// readers look at.
    ///
    /// * `wanted` - whether a source is asked for, by its name; what is in the others stays packed
    ///   and unchecked, but for the checksums of the file
    ///
    /// # Errors
    /// As [`FlightLog::read`], with the sources that are read.
    pub fn read_where(path: &Path, wanted: impl Fn(&str) -> bool) -> Result<Self, LogError> {
        let (log, _, cut) = load(path, &wanted)?;
        if !cut {
            return Ok(log);
        }
        // What is said of a cut file is said of all of it.
        let (log, recovery) = Self::recover(path)?;
        let start_s = log.sources.values().map(|source| source.time_s[0]).reduce(f64::min);
        Err(LogError::Truncated {
            file: path.display().to_string(),
            bytes_total: recovery.bytes_total,
            duration_s: start_s.map_or(0.0, |start_s| recovery.end_time_s - start_s),
            messages: recovery.messages,
        })
    }

    /// Reads what is whole of a truncated flight log: every source up to the last whole chunk,
    /// which ends at most one second before the cut, and the metadata. A file that is whole is read
    /// as [`FlightLog::read`] does.
    ///
    /// # Errors
    /// [`LogError`] as [`FlightLog::read`], but for the missing end; [`LogError::NothingWhole`] if
    /// the cut is before the end of the metadata.
    pub fn recover(path: &Path) -> Result<(Self, Recovery), LogError> {
        let (log, recovery, _) = load(path, &|_| true)?;
        Ok((log, recovery))
    }
}

/// The file's name and bytes, if they look like an MCAP file.
fn open(path: &Path) -> Result<(String, Vec<u8>), LogError> {
    let file = path.display().to_string();
    let bytes = match files::read(path) {
        Ok(bytes) => bytes,
        Err(error) => return Err(LogError::Io { file, error }),
    };
    if bytes.is_empty() {
        return Err(LogError::Empty { file });
    }
    if bytes.starts_with(MAGIC) || MAGIC.starts_with(&bytes) {
        Ok((file, bytes))
    } else if bytes.ends_with(MAGIC) {
        Err(LogError::Corrupt {
            file,
            what: "the first 8 bytes are not those of an MCAP file".to_owned(),
        })
    } else {
        Err(LogError::NotMcap { file })
    }
}

/// Reads a file that is whole, or else what is whole of a file that was cut; the flag says that it
/// was.
fn load(
    path: &Path,
    wanted: &dyn Fn(&str) -> bool,
) -> Result<(FlightLog, Recovery, bool), LogError> {
    let (file, bytes) = open(path)?;
    let cut = match envelope::check(&mut &*bytes, bytes.len() as u64) {
        Ok(()) => false,
        Err(Damage::Cut) => true,
        Err(Damage::Corrupt(what)) => return Err(LogError::Corrupt { file, what }),
        Err(Damage::Io(error)) => return Err(LogError::Io { file, error }),
    };
    let mut reader = Reader::new(&file, wanted, Budget::of(bytes.len() as u64));
    let mut whole = MAGIC.len().min(bytes.len());
    for frame in envelope::frames(&bytes) {
        match reader.frame(frame) {
            Ok(()) => whole = frame.end(),
            Err(LogError::Corrupt { .. }) if cut => break,
            Err(error) => return Err(error),
        }
    }
    let bytes_total = bytes.len() as u64;
    if cut && reader.metadata.is_none() {
        return Err(LogError::NothingWhole { file, bytes_total });
    }
    let metadata_checked = reader.has_metadata_crc();
    let log = reader.finish()?;
    let ends = log.sources.values().filter_map(|source| source.time_s.last().copied());
    let recovery = Recovery {
        bytes_total,
        bytes_whole: if cut { whole as u64 } else { bytes_total },
        messages: log.sources.values().map(|source| source.time_s.len() as u64).sum(),
        end_time_s: ends.reduce(f64::max).unwrap_or(0.0),
        metadata_checked,
    };
    Ok((log, recovery, cut))
}

/// Gathers a flight from the records of a file.
pub(super) struct Reader<'a> {
    file: String,
    wanted: &'a dyn Fn(&str) -> bool,
    budget: Budget,
    /// Of the metadata; logs of before have none.
    has_checksum: bool,
    metadata: Option<BTreeMap<String, String>>,
    schemas: BTreeMap<u16, Schema>,
    topics: BTreeMap<u16, Topic>,
}

struct Schema {
    name: String,
    encoding: String,
    set: Vec<u8>,
}

enum Topic {
    /// Not asked for, or for a viewer, which says nothing that the sources do not say.
    Skipped,
    Source(SourceReader),
}

impl<'a> Reader<'a> {
    /// Records that it looks at. The others are chunks, indexes for random access, or nothing that
    /// squirrel writes.
    pub(super) const READS: [u8; 5] = [
        mcap::records::op::CHANNEL,
        mcap::records::op::HEADER,
        mcap::records::op::MESSAGE,
        mcap::records::op::METADATA,
        mcap::records::op::SCHEMA,
    ];

    pub(super) fn new(file: &str, wanted: &'a dyn Fn(&str) -> bool, budget: Budget) -> Self {
        let (file, schemas, topics) = (file.to_owned(), BTreeMap::new(), BTreeMap::new());
        Self { file, wanted, budget, has_checksum: false, metadata: None, schemas, topics }
    }

    fn too_large(&self, error: TooLarge) -> LogError {
        LogError::TooLarge { file: self.file.clone(), error }
    }

    fn corrupt(&self, what: impl std::fmt::Display) -> LogError {
        LogError::Corrupt { file: self.file.clone(), what: what.to_string() }
    }

    fn foreign(&self, why: String) -> LogError {
        LogError::Foreign { file: self.file.clone(), why }
    }

    /// One record of the file.
    pub(super) fn frame(&mut self, frame: Frame) -> Result<(), LogError> {
        self.check_lengths(frame.opcode, frame.body())?;
        if frame.opcode != mcap::records::op::CHUNK {
            return self.record(frame.opcode, frame.body());
        }
        // MCAP's own reader unpacks the chunk; it gives nothing out before the chunk's CRC is
        // right.
        let unpacked = envelope::unpacked_bytes(frame.body()).ok_or_else(|| {
            let at = frame.start;
            self.corrupt(format!(
                "the chunk at byte {at} says that it unpacks to more than it holds"
            ))
        })?;
        // No record is longer than what it is in.
        let most = unpacked.max(frame.bytes.len() as u64) as usize;
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(RECORD_MAX_BYTES.min(most));
        let mut reader = LinearReader::new_with_options(options);
        let mut rest = frame.bytes;
        while let Some(event) = reader.next_event() {
            let event = event.map_err(|error| match error {
                McapError::UnsupportedCompression(name) => {
                    self.foreign(format!("its chunks are packed with {name}, not zstd"))
                }
                error => self.corrupt(format!("chunk at byte {}: {error}", frame.start)),
            });
            match event? {
                LinearReadEvent::ReadRequest(need) => envelope::feed(&mut reader, &mut rest, need),
                LinearReadEvent::Record { data, opcode } => self.record(opcode, data)?,
            }
        }
        Ok(())
    }

    fn check_lengths(&self, opcode: u8, body: &[u8]) -> Result<(), LogError> {
        if envelope::lengths_fit(opcode, body) {
            return Ok(());
        }
        Err(self.corrupt("a length in a record is larger than the record"))
    }

    /// One record of the file or of a chunk in it.
    fn record(&mut self, opcode: u8, body: &[u8]) -> Result<(), LogError> {
        if !Self::READS.contains(&opcode) {
            return Ok(());
        }
        self.check_lengths(opcode, body)?;
        if opcode != mcap::records::op::MESSAGE {
            self.budget.take(body.len() as u64).map_err(|error| self.too_large(error))?;
        }
        match mcap::parse_record(opcode, body).map_err(|error| self.corrupt(error))? {
            Record::Header(header) => self.has_checksum = header.library == LIBRARY,
            Record::Metadata(record) if record.name == METADATA_NAME => {
                self.metadata.get_or_insert_default().extend(record.metadata);
            }
            Record::Schema { header, data } => {
                let schema =
                    Schema { name: header.name, encoding: header.encoding, set: data.into_owned() };
                self.schemas.insert(header.id, schema);
            }
            Record::Channel(channel) if !self.topics.contains_key(&channel.id) => {
                let topic = self.topic(&channel)?;
                self.topics.insert(channel.id, topic);
            }
            Record::Message { header, data } => match self.topics.get_mut(&header.channel_id) {
                Some(Topic::Source(source)) => source.push(&self.file, &data, &mut self.budget)?,
                Some(Topic::Skipped) => {}
                None => {
                    return Err(
                        self.corrupt(format!("message of unknown channel {}", header.channel_id))
                    );
                }
            },
            _ => {}
        }
        Ok(())
    }

    fn topic(&self, channel: &mcap::records::Channel) -> Result<Topic, LogError> {
        let topic = &channel.topic;
        let schema = self.schemas.get(&channel.schema_id);
        let (name, encoding) = schema.map_or(("", ""), |schema| (&schema.name, &schema.encoding));
        if [foxglove::TRANSFORM_SCHEMA, foxglove::SCENE_SCHEMA].contains(&name) {
            return Ok(Topic::Skipped);
        }
        if channel.message_encoding != "protobuf"
            || encoding != "protobuf"
            || !schema::is_source(name)
        {
            let encoding = &channel.message_encoding;
            return Err(
                self.foreign(format!("topic `{topic}` has {encoding} messages of schema `{name}`"))
            );
        }
        if self
            .topics
            .values()
            .any(|other| matches!(other, Topic::Source(source) if source.name() == topic))
        {
            return Err(self.foreign(format!("topic `{topic}` has two channels")));
        }
        if !(self.wanted)(topic) {
            return Ok(Topic::Skipped);
        }
        let set = schema.map_or(&[][..], |schema| &schema.set);
        SourceReader::new(topic, name, set).map(Topic::Source).map_err(|what| self.corrupt(what))
    }

    fn has_metadata_crc(&self) -> bool {
        self.metadata.as_ref().is_some_and(|metadata| metadata.contains_key(METADATA_CRC))
    }

    /// The metadata so far, if there are any.
    ///
    /// # Errors
    /// [`LogError::Corrupt`]: they are not those that were written.
    pub(super) fn metadata(&self) -> Result<Option<BTreeMap<String, String>>, LogError> {
        let Some(mut metadata) = self.metadata.clone() else { return Ok(None) };
        let written = metadata.remove(METADATA_CRC);
        if written.map_or(self.has_checksum, |written| written != metadata_crc32(&metadata)) {
            return Err(self.corrupt("the metadata does not match its CRC32"));
        }
        Ok(Some(metadata))
    }

    /// Takes out the samples that are gathered; a source without one is left out.
    pub(super) fn take(&mut self) -> FlightLog {
        let sources = self.topics.values_mut().filter_map(|topic| match topic {
            Topic::Source(source) if !source.is_empty() => Some(source.take()),
            _ => None,
        });
        FlightLog { metadata: BTreeMap::new(), sources: sources.collect() }
    }

    fn finish(mut self) -> Result<FlightLog, LogError> {
        let metadata = self.metadata()?;
        let metadata = metadata
            .ok_or_else(|| self.foreign(format!("no metadata record `{METADATA_NAME}`")))?;
        let log = FlightLog { metadata, ..self.take() };
        check::check(&self.file, &log)?;
        Ok(log)
    }
}
