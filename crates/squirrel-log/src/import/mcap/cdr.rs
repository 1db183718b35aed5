//! ROS 2 messages in CDR (XCDR1, as ROS's middlewares write it): the schema's text decides what
//! stands where.
//!
//! A column is a path into the message: `angular_velocity.x`, `control[0]`,
//! `esc_telemetry[1].rpm`. A time has its own path as a column beside its two numbers:
//! `header.stamp`, ns. An element that a message's sequence lacks is NaN. Text is no column.

use std::rc::Rc;

use super::cdr_walk::{Pick, steps, walk};
use super::ros_schema::{Struct, Type};
use super::{Topic, cell, own_times};
use crate::import::error::ImportError;
use crate::import::meter::Meter;
use crate::import::table::{Table, TableFile, places};

/// Elements of an array or a sequence that are columns: images and point clouds are none.
const ELEMENTS_MAX: usize = 1024;
/// Columns of a topic; arrays of arrays would be without bound.
const COLUMNS_MAX: usize = 50_000;
/// One topic of an MCAP file in CDR.
pub(super) struct CdrFile<'a> {
    /// Path as given, and topic, for error messages.
    name: String,
    topic: Rc<Topic>,
    message: Struct,
    columns: Vec<String>,
    /// Bytes of the file a message.
    share: usize,
    meter: &'a Meter<'a>,
}

impl<'a> CdrFile<'a> {
    /// Reads the schema, and how long sequences get.
    ///
    /// * `share` - bytes of the file a message and pass
    ///
    /// # Errors
    /// [`ImportError::Damaged`]: a schema that is no `ros2msg`, messages that contradict it.
    pub(super) fn open(
        name: String,
        topic: Rc<Topic>,
        share: usize,
        meter: &'a Meter<'a>,
    ) -> Result<Self, ImportError> {
        let damaged = |problem| ImportError::Damaged { file: name.clone(), problem };
        if topic.schema_encoding != "ros2msg" {
            return Err(damaged(format!(
                "cdr messages with a schema in `{}`; import reads `ros2msg`",
                topic.schema_encoding
            )));
        }
        let schema = |problem| damaged(format!("schema `{}`: {problem}", topic.schema));
        let text = str::from_utf8(&topic.schema_data).map_err(|_| schema("is no text".into()))?;
        let (message, sequences) = Struct::parse(&topic.schema, text).map_err(schema)?;
        let mut lengths = vec![0; sequences];
        if sequences > 0 {
            let steps = steps(&message, &Pick::default());
            for index in 0..topic.len() {
                walk(topic.message(index), &steps, &mut [], &mut lengths)
                    .map_err(|problem| damaged(format!("message {} {problem}", index + 1)))?;
                meter.add(share);
            }
        }
        let mut columns = Vec::new();
        list(&message, &lengths, "", &mut columns);
        let clocks: Vec<_> =
            own_times(|clock| columns.iter().any(|column| column == clock)).collect();
        columns.extend(clocks.into_iter().map(str::to_owned));
        Ok(Self { name, topic, message, columns, share, meter })
    }
}

impl TableFile for CdrFile<'_> {
    fn columns(&self) -> &[String] {
        &self.columns
    }

    fn read(self: Box<Self>, wanted: &[&str]) -> Result<Table, ImportError> {
        places(&self.name, &self.columns, wanted)?;
        let mut picks = Pick::default();
        let mut values: Vec<Vec<f64>> = Vec::with_capacity(wanted.len());
        for (slot, column) in wanted.iter().enumerate() {
            // A field of that name hides MCAP's own time.
            let field = self.message.fields.iter().any(|(field, _)| field == column);
            values.push(if let Some(clock) = self.topic.clock(column).filter(|_| !field) {
                clock.iter().map(|&ns| ns as f64).collect()
            } else {
                picks.add(column, slot);
                Vec::with_capacity(self.topic.len())
            });
        }
        let steps = steps(&self.message, &picks);
        let clocks: Vec<bool> = values.iter().map(|values| !values.is_empty()).collect();
        let mut row = vec![f64::NAN; wanted.len()];
        for index in 0..self.topic.len() {
            row.fill(f64::NAN);
            walk(self.topic.message(index), &steps, &mut row, &mut []).map_err(|problem| {
                ImportError::Damaged {
                    file: self.name.clone(),
                    problem: format!("message {} {problem}", index + 1),
                }
            })?;
            for (slot, &number) in row.iter().enumerate().filter(|(slot, _)| !clocks[*slot]) {
                values[slot].push(cell(&self.name, wanted[slot], index, number)?);
            }
            self.meter.add(self.share);
        }
        let rows = (1..=self.topic.len() as u64).collect();
        Ok(Table::new(self.name, wanted, values, rows))
    }
}

/// Appends the columns of a message whose sequences get as long as `lengths` says.
fn list(message: &Struct, lengths: &[usize], prefix: &str, columns: &mut Vec<String>) {
    for (name, kind) in &message.fields {
        let dot = if prefix.is_empty() { "" } else { "." };
        list_field(kind, lengths, format!("{prefix}{dot}{name}"), columns);
    }
}

fn list_field(kind: &Type, lengths: &[usize], path: String, columns: &mut Vec<String>) {
    let (element, count) = match kind {
        Type::Text(_) => return,
        Type::Number(_) => return columns.push(path),
        Type::Struct(inner) => {
            list(inner, lengths, &path, columns);
            if inner.is_time {
                columns.push(path);
            }
            return;
        }
        Type::Array(element, count) => (element, *count),
        Type::Sequence { element, id, .. } => (element, lengths[*id]),
    };
    for i in 0..count.min(ELEMENTS_MAX) {
        if columns.len() < COLUMNS_MAX {
            list_field(element, lengths, format!("{path}[{i}]"), columns);
        }
    }
}
