//! MCAP files: the messages of one topic as rows, whether they are JSON, ROS 2's CDR or protobuf.
//!
//! A file is read once however many topics a map takes from it. The columns `log_time` and
//! `publish_time` are MCAP's own times, ns; a field of that name hides them.

mod cdr;
mod cdr_walk;
mod json;
mod known;
mod known_channels;
mod protobuf;
mod ros_schema;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use mcap::records::{Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{MAGIC, McapError};

use super::error::ImportError;
use super::format;
use super::map::ImportMap;
use super::meter::Meter;
use super::names::nearest;
use super::table::{TableFile, checked};
use crate::envelope::{self, lengths_fit, unpacked_bytes};
use crate::files::{self, Budget, TooLarge};
use cdr::CdrFile;
use json::JsonFile;
use protobuf::ProtobufFile;

pub(super) use known::map_of_bag;

/// MCAP's own times of a message as columns.
pub(super) const LOG_TIME: &str = "log_time";
const PUBLISH_TIME: &str = "publish_time";
/// Largest record or unpacked chunk: a wrong length in a damaged file does not eat the memory.
const RECORD_MAX_BYTES: usize = 256 << 20;

/// The MCAP files of one import, each read once.
#[derive(Debug, Default)]
pub(super) struct Logs {
    read: BTreeMap<PathBuf, Rc<Log>>,
}

/// The messages of some topics of a file.
#[derive(Debug)]
pub(super) struct Log {
    /// Path as given, for error messages.
    file: String,
    bytes: usize,
    pub(super) topics: BTreeMap<String, Rc<Topic>>,
    /// Topics with messages that were not asked for.
    others: BTreeSet<String>,
}

/// The messages of one topic in the order of the file.
#[derive(Debug, Default)]
pub(super) struct Topic {
    encoding: String,
    /// Name, encoding and text of the schema; empty where the file has none.
    pub(super) schema: String,
    schema_encoding: String,
    schema_data: Vec<u8>,
    pub(super) log_time_ns: Vec<u64>,
    publish_time_ns: Vec<u64>,
    /// Where each message ends in `data`.
    ends: Vec<usize>,
    data: Vec<u8>,
}

impl Topic {
    /// Messages.
    pub(super) fn len(&self) -> usize {
        self.ends.len()
    }

    /// The frame of the first message, for messages that begin with a `std_msgs/Header`; empty if
    /// that cannot be read.
    fn frame_id(&self) -> String {
        let stamp_and_length = 4 + 8;
        let read = || {
            let bytes = (self.len() > 0).then(|| self.message(0))?;
            let &length = bytes.get(stamp_and_length..)?.first_chunk()?;
            let big_endian = bytes[1] & 1 == 0;
            let length =
                if big_endian { u32::from_be_bytes(length) } else { u32::from_le_bytes(length) };
            let text = bytes.get(stamp_and_length + 4..)?.get(..length as usize)?;
            Some(String::from_utf8_lossy(text).trim_end_matches('\0').to_owned())
        };
        read().unwrap_or_default()
    }

    /// The bytes of a message.
    fn message(&self, index: usize) -> &[u8] {
        let start = if index == 0 { 0 } else { self.ends[index - 1] };
        &self.data[start..self.ends[index]]
    }

    /// MCAP's own times as a column.
    fn clock(&self, column: &str) -> Option<&[u64]> {
        match column {
            LOG_TIME => Some(&self.log_time_ns),
            PUBLISH_TIME => Some(&self.publish_time_ns),
            _ => None,
        }
    }
}

/// MCAP's own times, but for those that a field hides.
fn own_times(is_field: impl Fn(&str) -> bool) -> impl Iterator<Item = &'static str> {
    [LOG_TIME, PUBLISH_TIME].into_iter().filter(move |clock| !is_field(clock))
}

/// A number of a message as a cell of a table.
///
/// # Errors
/// [`ImportError::Cell`]: a number that no log has.
fn cell(file: &str, column: &str, index: usize, number: f64) -> Result<f64, ImportError> {
    checked(number).map_err(|problem| ImportError::Cell {
        file: file.to_owned(),
        column: column.to_owned(),
        row: index as u64 + 1,
        value: number.to_string(),
        problem,
    })
}

impl Logs {
    /// Takes a file that has been read with all topics that a map will ask for.
    fn keep(&mut self, path: &Path, log: &Rc<Log>) {
        self.read.insert(path.to_owned(), Rc::clone(log));
    }

    /// The topic that a source of the map reads.
    ///
    /// # Errors
    /// [`ImportError::Read`], [`ImportError::Damaged`], also for messages that contradict their
    /// schema, [`ImportError::MissingTopic`].
    pub(super) fn open<'a>(
        &mut self,
        map: &ImportMap,
        path: &Path,
        topic: &str,
        meter: &'a Meter<'a>,
    ) -> Result<Box<dyn TableFile + 'a>, ImportError> {
        let log = if let Some(log) = self.read.get(path) {
            Rc::clone(log)
        } else {
            // Every topic of the map: which of them another file has is not known here.
            let wanted: BTreeSet<&str> =
                map.sources.iter().filter_map(|source| source.topic.as_deref()).collect();
            let log = Rc::new(Log::read(path, &|topic, _| wanted.contains(topic))?);
            self.read.insert(path.to_owned(), Rc::clone(&log));
            log
        };
        log.table(topic, meter)
    }
}

impl Log {
    /// Reads a file.
    ///
    /// * `wanted` - whether a topic, with the name of its schema, is kept
    ///
    /// # Errors
    /// [`ImportError::Read`], [`ImportError::Empty`], [`ImportError::Damaged`].
    pub(super) fn read(
        path: &Path,
        wanted: &dyn Fn(&str, &str) -> bool,
    ) -> Result<Self, ImportError> {
        let file = path.display().to_string();
        let bytes =
            files::read(path).map_err(|source| ImportError::Read { file: file.clone(), source })?;
        if bytes.is_empty() {
            return Err(ImportError::Empty { file });
        }
        let damaged = |problem: String| ImportError::Damaged { file: file.clone(), problem };
        if !bytes.starts_with(MAGIC) && !MAGIC.starts_with(&bytes) {
            // What it is instead, or that nothing reads it.
            format::check_known(path)?;
            return Err(damaged("the first 8 bytes are not those of an MCAP file".to_owned()));
        }
        let mut reading = Reading {
            wanted,
            budget: Budget::of(bytes.len() as u64),
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            topics: Vec::new(),
            others: BTreeSet::new(),
        };
        reading.file(&bytes).map_err(|problem| match problem {
            Problem::Damaged(problem) => damaged(problem),
            Problem::TooLarge(source) => ImportError::TooLarge { file: file.clone(), source },
        })?;
        let Reading { topics, others, .. } = reading;
        let topics = topics
            .into_iter()
            .filter(|(_, topic)| topic.len() > 0)
            .map(|(name, topic)| (name, Rc::new(topic)));
        Ok(Self { file: file.clone(), bytes: bytes.len(), topics: topics.collect(), others })
    }

    /// One topic as a table.
    ///
    /// # Errors
    /// As [`Logs::open`].
    pub(super) fn table<'a>(
        &self,
        name: &str,
        meter: &'a Meter<'a>,
    ) -> Result<Box<dyn TableFile + 'a>, ImportError> {
        let Some(topic) = self.topics.get(name) else {
            let all = self.others.iter().chain(self.topics.keys()).map(String::as_str);
            return Err(ImportError::MissingTopic {
                file: self.file.clone(),
                topic: name.to_owned(),
                nearest: nearest(name, all),
            });
        };
        let label = format!("{}, topic `{name}`", self.file);
        let share = self.bytes / (2 * topic.len());
        let topic = Rc::clone(topic);
        Ok(match topic.encoding.as_str() {
            "json" => Box::new(JsonFile::open(label, topic, share, meter)?),
            "cdr" => Box::new(CdrFile::open(label, topic, share, meter)?),
            "protobuf" => Box::new(ProtobufFile::open(label, topic, share, meter)?),
            encoding => {
                return Err(ImportError::Damaged {
                    file: self.file.clone(),
                    problem: format!(
                        "topic `{name}` has {encoding} messages, import reads json, cdr and protobuf"
                    ),
                });
            }
        })
    }
}

/// What a pass over the file gathers.
struct Reading<'w> {
    wanted: &'w dyn Fn(&str, &str) -> bool,
    budget: Budget,
    schemas: BTreeMap<u16, Schema>,
    /// Place of each channel's topic in `topics`; `None` for one that nobody wants.
    channels: BTreeMap<u16, Option<usize>>,
    topics: Vec<(String, Topic)>,
    others: BTreeSet<String>,
}

struct Schema {
    name: String,
    encoding: String,
    data: Vec<u8>,
}

/// Why a pass ends early.
enum Problem {
    Damaged(String),
    TooLarge(TooLarge),
}

impl From<String> for Problem {
    fn from(problem: String) -> Self {
        Self::Damaged(problem)
    }
}

/// What a message takes beside its bytes: its times and its end, and the numbers of a few columns.
const MESSAGE_BYTES: u64 = 64;

impl Reading<'_> {
    fn file(&mut self, bytes: &[u8]) -> Result<(), Problem> {
        let broken = |error: McapError| match error {
            McapError::UnsupportedCompression(name) => format!(
                "its chunks are packed with {name}, import reads zstd and unpacked ones; \
                 `mcap compress --compression zstd` repacks them"
            ),
            error => format!("damaged or cut off: {error}"),
        };
        let too_long = || "damaged: a length in a record is larger than the record".to_owned();
        // The reader takes chunks apart itself; what it hands out is looked at below.
        let mut most = bytes.len() as u64;
        for chunk in envelope::frames(bytes).filter(|frame| frame.opcode == op::CHUNK) {
            if !lengths_fit(op::CHUNK, chunk.body()) {
                return Err(too_long().into());
            }
            let unpacked = unpacked_bytes(chunk.body()).ok_or_else(|| {
                "damaged: a chunk says that it unpacks to more than it holds".to_owned()
            })?;
            most = most.max(unpacked);
        }
        // No record is longer than what it is in.
        let options = LinearReaderOptions::default()
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(RECORD_MAX_BYTES.min(most as usize));
        let mut reader = LinearReader::new_with_options(options);
        let mut rest = bytes;
        while let Some(event) = reader.next_event() {
            match event.map_err(broken)? {
                LinearReadEvent::ReadRequest(need) => envelope::feed(&mut reader, &mut rest, need),
                LinearReadEvent::Record { data, opcode } => {
                    if [op::SCHEMA, op::CHANNEL, op::MESSAGE].contains(&opcode) {
                        if !lengths_fit(opcode, data) {
                            return Err(too_long().into());
                        }
                        let bytes = data.len() as u64 + MESSAGE_BYTES;
                        self.budget.take(bytes).map_err(Problem::TooLarge)?;
                        self.record(mcap::parse_record(opcode, data).map_err(broken)?)?;
                    }
                }
            }
        }
        Ok(())
    }

    fn record(&mut self, record: Record<'_>) -> Result<(), String> {
        match record {
            Record::Schema { header, data } => {
                let (name, encoding, data) = (header.name, header.encoding, data.into_owned());
                self.schemas.insert(header.id, Schema { name, encoding, data });
            }
            Record::Channel(channel) if !self.channels.contains_key(&channel.id) => {
                let place = self.channel(&channel)?;
                self.channels.insert(channel.id, place);
            }
            Record::Message { header, data } => {
                let place = self.channels.get(&header.channel_id);
                let place = place
                    .ok_or_else(|| format!("a message of unknown channel {}", header.channel_id))?;
                if let Some(place) = *place {
                    let topic = &mut self.topics[place].1;
                    topic.log_time_ns.push(header.log_time);
                    topic.publish_time_ns.push(header.publish_time);
                    topic.data.extend_from_slice(&data);
                    topic.ends.push(topic.data.len());
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Where the messages of a channel go. Publishers of one topic share it.
    fn channel(&mut self, channel: &mcap::records::Channel) -> Result<Option<usize>, String> {
        let name = &channel.topic;
        let none = Schema { name: String::new(), encoding: String::new(), data: Vec::new() };
        let schema = match self.schemas.get(&channel.schema_id) {
            Some(schema) => schema,
            None if channel.schema_id == 0 => &none,
            None => {
                return Err(format!("topic `{name}` has the unknown schema {}", channel.schema_id));
            }
        };
        if !(self.wanted)(name, &schema.name) {
            self.others.insert(name.clone());
            return Ok(None);
        }
        let encoding = &channel.message_encoding;
        if let Some(place) = self.topics.iter().position(|(other, _)| other == name) {
            let topic = &self.topics[place].1;
            if (&topic.encoding, &topic.schema) != (encoding, &schema.name)
                || topic.schema_data != schema.data
            {
                return Err(format!(
                    "topic `{name}` has two kinds of messages: {} `{}` and {encoding} `{}`",
                    topic.encoding, topic.schema, schema.name
                ));
            }
            return Ok(Some(place));
        }
        let topic = Topic {
            encoding: encoding.clone(),
            schema: schema.name.clone(),
            schema_encoding: schema.encoding.clone(),
            schema_data: schema.data.clone(),
            ..Topic::default()
        };
        self.topics.push((name.clone(), topic));
        Ok(Some(self.topics.len() - 1))
    }
}
