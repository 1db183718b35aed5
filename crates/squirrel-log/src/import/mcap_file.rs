//! MCAP files with JSON messages: the messages of one topic as rows.
//!
//! A column is a path into the message: `gyro.x`, `u[0]`. The columns `log_time` and `publish_time`
//! are MCAP's own times, ns; a field of that name hides them. A field that a message lacks, or
//! null, is NaN; true is 1. Text that reads as a number is one, since JSON writes 64-bit integers
//! and NaN as text.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use mcap::MAGIC;
use mcap::read::{Options, RawMessageStream};
use serde_json::Value;

use super::error::ImportError;
use super::meter::Meter;
use super::names::nearest;
use super::table::{Table, TableFile, checked, parsed, places};

const LOG_TIME: &str = "log_time";
const PUBLISH_TIME: &str = "publish_time";

/// One topic of an MCAP file.
pub(super) struct McapFile<'a> {
    /// Path as given, and topic, for error messages.
    name: String,
    columns: Vec<String>,
    /// Which of MCAP's own times no field hides.
    clocks: Vec<&'static str>,
    messages: Vec<Message>,
    /// Bytes of the file a message and pass.
    share: usize,
    meter: &'a Meter<'a>,
}

struct Message {
    log_time_ns: u64,
    publish_time_ns: u64,
    json: Vec<u8>,
}

impl<'a> McapFile<'a> {
    /// Finds the messages of a topic and the paths in them.
    ///
    /// # Errors
    /// [`ImportError::Damaged`] also for messages that are no JSON, [`ImportError::MissingTopic`].
    pub(super) fn open(
        file: &str,
        bytes: &[u8],
        topic: &str,
        meter: &'a Meter<'a>,
    ) -> Result<Self, ImportError> {
        let messages = messages(file, bytes, topic)?;
        let share = bytes.len() / (2 * messages.len());
        let name = format!("{file}, topic `{topic}`");
        let mut paths = BTreeSet::new();
        for (index, message) in messages.iter().enumerate() {
            for_each_leaf(&name, index, message, &mut |path, _| {
                if !paths.contains(path) {
                    paths.insert(path.to_owned());
                }
                Ok(())
            })?;
            meter.add(share);
        }
        let clocks: Vec<_> =
            [LOG_TIME, PUBLISH_TIME].into_iter().filter(|&clock| !paths.contains(clock)).collect();
        let columns =
            paths.into_iter().chain(clocks.iter().map(|&clock| clock.to_owned())).collect();
        Ok(Self { name, columns, clocks, messages, share, meter })
    }
}

impl TableFile for McapFile<'_> {
    fn columns(&self) -> &[String] {
        &self.columns
    }

    fn read(self: Box<Self>, wanted: &[&str]) -> Result<Table, ImportError> {
        places(&self.name, &self.columns, wanted)?;
        let places: BTreeMap<&str, usize> = wanted.iter().copied().zip(0..).collect();
        let mut values = vec![Vec::with_capacity(self.messages.len()); wanted.len()];
        for (index, message) in self.messages.iter().enumerate() {
            for (values, &column) in values.iter_mut().zip(wanted) {
                values.push(match column {
                    _ if !self.clocks.contains(&column) => f64::NAN,
                    LOG_TIME => message.log_time_ns as f64,
                    _ => message.publish_time_ns as f64,
                });
            }
            for_each_leaf(&self.name, index, message, &mut |path, value| {
                let Some(&place) = places.get(path) else { return Ok(()) };
                values[place][index] = number(value).map_err(|problem| ImportError::Cell {
                    file: self.name.clone(),
                    column: path.to_owned(),
                    row: index as u64 + 1,
                    value: value.to_string().chars().take(40).collect(),
                    problem,
                })?;
                Ok(())
            })?;
            self.meter.add(self.share);
        }
        let rows = (1..=self.messages.len() as u64).collect();
        Ok(Table::new(self.name, wanted, values, rows))
    }
}

/// The messages of a topic, at least one, in the order of the file.
fn messages(file: &str, bytes: &[u8], topic: &str) -> Result<Vec<Message>, ImportError> {
    let damaged = |problem: String| ImportError::Damaged { file: file.to_owned(), problem };
    if !bytes.starts_with(MAGIC) && !MAGIC.starts_with(bytes) {
        return Err(damaged("the first 8 bytes are not those of an MCAP file".to_owned()));
    }
    let broken = |error: mcap::McapError| damaged(format!("damaged or cut off: {error}"));
    let mut stream = RawMessageStream::new_with_options(bytes, Options::ValidateChunkCrcs.into())
        .map_err(broken)?;
    let (mut topics, mut messages) = (BTreeSet::new(), Vec::new());
    while let Some(message) = stream.next() {
        let message = message.map_err(broken)?;
        let id = message.header.channel_id;
        let channel = stream
            .get_channel(id)
            .ok_or_else(|| damaged(format!("a message of unknown channel {id}")))?;
        if channel.topic == topic {
            let encoding = &channel.message_encoding;
            if encoding != "json" {
                return Err(damaged(format!(
                    "topic `{topic}` has {encoding} messages, import reads json"
                )));
            }
            messages.push(Message {
                log_time_ns: message.header.log_time,
                publish_time_ns: message.header.publish_time,
                json: message.data.into_owned(),
            });
        } else if !topics.contains(&channel.topic) {
            topics.insert(channel.topic.clone());
        }
    }
    if messages.is_empty() {
        let nearest = nearest(topic, topics.iter().map(String::as_str));
        return Err(ImportError::MissingTopic {
            file: file.to_owned(),
            topic: topic.to_owned(),
            nearest,
        });
    }
    Ok(messages)
}

/// Takes a path in a message and the value there.
type Visit<'a> = dyn FnMut(&str, &Value) -> Result<(), ImportError> + 'a;

/// Visits every value of a message that is neither object nor list.
fn for_each_leaf(
    name: &str,
    index: usize,
    message: &Message,
    visit: &mut Visit<'_>,
) -> Result<(), ImportError> {
    let value = serde_json::from_slice(&message.json).map_err(|error| ImportError::Damaged {
        file: name.to_owned(),
        problem: format!("message {} is no JSON: {error}", index + 1),
    })?;
    walk(&value, &mut String::new(), visit)
}

fn walk(value: &Value, path: &mut String, visit: &mut Visit<'_>) -> Result<(), ImportError> {
    let length = path.len();
    match value {
        Value::Object(fields) => {
            for (key, inner) in fields {
                if length > 0 {
                    path.push('.');
                }
                path.push_str(key);
                walk(inner, path, visit)?;
                path.truncate(length);
            }
            Ok(())
        }
        Value::Array(items) => {
            for (i, inner) in items.iter().enumerate() {
                // Writing to a string cannot fail.
                let _ = write!(path, "[{i}]");
                walk(inner, path, visit)?;
                path.truncate(length);
            }
            Ok(())
        }
        leaf => visit(path, leaf),
    }
}

fn number(value: &Value) -> Result<f64, &'static str> {
    match value {
        Value::Null => Ok(f64::NAN),
        Value::Bool(is) => Ok(f64::from(u8::from(*is))),
        Value::Number(number) => number.as_f64().map_or(Err("is no number"), checked),
        Value::String(text) => parsed(text.as_bytes()),
        Value::Array(_) | Value::Object(_) => Err("is no number"),
    }
}
