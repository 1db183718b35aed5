//! MCAP's JSON messages.
//!
//! A column is a path into the message: `gyro.x`, `u[0]`. A field that a message lacks, or null, is
//! NaN; true is 1. Text that reads as a number is one, since JSON writes 64-bit integers and NaN as
//! text.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use std::rc::Rc;

use serde_json::Value;

use super::{Topic, own_times};
use crate::import::error::ImportError;
use crate::import::meter::Meter;
use crate::import::table::{Table, TableFile, checked, parsed, places};

/// One topic of an MCAP file in JSON.
pub(super) struct JsonFile<'a> {
    /// Path as given, and topic, for error messages.
    name: String,
    columns: Vec<String>,
    topic: Rc<Topic>,
    /// Which of MCAP's own times no field hides.
    clocks: Vec<&'static str>,
    /// Bytes of the file a message and pass.
    share: usize,
    meter: &'a Meter<'a>,
}

impl<'a> JsonFile<'a> {
    /// Finds the paths in the messages of a topic.
    ///
    /// * `share` - bytes of the file a message and pass
    ///
    /// # Errors
    /// [`ImportError::Damaged`] for messages that are no JSON.
    pub(super) fn open(
        name: String,
        topic: Rc<Topic>,
        share: usize,
        meter: &'a Meter<'a>,
    ) -> Result<Self, ImportError> {
        let mut paths = BTreeSet::new();
        for index in 0..topic.len() {
            for_each_leaf(&name, index, topic.message(index), &mut |path, _| {
                if !paths.contains(path) {
                    paths.insert(path.to_owned());
                }
                Ok(())
            })?;
            meter.add(share);
        }
        let clocks: Vec<_> = own_times(|clock| paths.contains(clock)).collect();
        let columns =
            paths.into_iter().chain(clocks.iter().map(|&clock| clock.to_owned())).collect();
        Ok(Self { name, columns, topic, clocks, share, meter })
    }
}

impl TableFile for JsonFile<'_> {
    fn columns(&self) -> &[String] {
        &self.columns
    }

    fn read(self: Box<Self>, wanted: &[&str]) -> Result<Table, ImportError> {
        places(&self.name, &self.columns, wanted)?;
        let places: BTreeMap<&str, usize> = wanted.iter().copied().zip(0..).collect();
        let mut values = vec![Vec::with_capacity(self.topic.len()); wanted.len()];
        for index in 0..self.topic.len() {
            for (values, &column) in values.iter_mut().zip(wanted) {
                let clock = self.topic.clock(column).filter(|_| self.clocks.contains(&column));
                values.push(clock.map_or(f64::NAN, |clock| clock[index] as f64));
            }
            for_each_leaf(&self.name, index, self.topic.message(index), &mut |path, value| {
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
        let rows = (1..=self.topic.len() as u64).collect();
        Ok(Table::new(self.name, wanted, values, rows))
    }
}

/// Largest message: read, it takes up to 70 times as much memory.
const MESSAGE_MAX_BYTES: usize = 4 << 20;

/// Takes a path in a message and the value there.
type Visit<'a> = dyn FnMut(&str, &Value) -> Result<(), ImportError> + 'a;

/// Visits every value of a message that is neither object nor list.
fn for_each_leaf(
    name: &str,
    index: usize,
    message: &[u8],
    visit: &mut Visit<'_>,
) -> Result<(), ImportError> {
    if message.len() > MESSAGE_MAX_BYTES {
        return Err(ImportError::Damaged {
            file: name.to_owned(),
            problem: format!(
                "message {} has {} bytes, the most of one in JSON is {MESSAGE_MAX_BYTES}",
                index + 1,
                message.len()
            ),
        });
    }
    let value = serde_json::from_slice(message).map_err(|error| ImportError::Damaged {
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
