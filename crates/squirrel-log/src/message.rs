//! One sample of one source as a protobuf message, and back.
//!
//! Every channel carries a CRC32 over its time and its numbers, so that a value which some tool
//! changed is found and named even where the tool wrote fresh checksums around it.

use prost::DecodeError;
use prost::encoding::{
    DecodeContext, WireType, decode_key, double, encode_key, encode_varint, fixed32, skip_field,
};
use prost_types::FieldDescriptorProto;
use prost_types::field_descriptor_proto::{Label, Type};

use super::{Channel, LogError, Source, schema};
use crate::files::Budget;

/// Appends sample `index` of a source as a message of the schema that [`schema::encode`] makes.
pub(super) fn encode(source: &Source, index: usize, to: &mut Vec<u8>) {
    let time_s = source.time_s[index];
    double::encode(schema::TIME.1 as u32, &time_s, to);
    for (channel, number) in source.channels.values().zip(schema::TIME.1 as u32 + 1..) {
        match channel.row(index) {
            [value] => double::encode(number, value, to),
            row => double::encode_packed(number, row, to),
        }
    }
    if !source.channels.is_empty() {
        encode_key(schema::CRC.1 as u32, WireType::LengthDelimited, to);
        encode_varint(4 * source.channels.len() as u64, to);
        let of_time = time_crc32(time_s);
        for channel in source.channels.values() {
            to.extend_from_slice(&row_crc32(&of_time, channel.row(index)).to_le_bytes());
        }
    }
}

/// What a CRC32 over a time and numbers begins with.
fn time_crc32(time_s: f64) -> crc32fast::Hasher {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&time_s.to_le_bytes());
    hasher
}

fn row_crc32(of_time: &crc32fast::Hasher, row: &[f64]) -> u32 {
    let mut hasher = of_time.clone();
    for value in row {
        hasher.update(&value.to_le_bytes());
    }
    hasher.finalize()
}

/// Reads the messages of one source, as the schema in the file says, and gathers them.
pub(super) struct SourceReader {
    name: String,
    time_number: u32,
    crc_number: u32,
    columns: Vec<Column>,
    time_s: Vec<f64>,
}

/// A channel on its way in.
struct Column {
    name: String,
    number: u32,
    /// Known from the schema (one number) or from the first message that has the channel.
    width: Option<usize>,
    values: Vec<f64>,
    /// The row of the message at hand; empty if the message lacks the channel.
    row: Vec<f64>,
}

impl SourceReader {
    /// # Errors
    /// One line that says what the schema lacks.
    pub(super) fn new(name: &str, message_name: &str, set: &[u8]) -> Result<Self, String> {
        let fields = schema::decode(message_name, set)?;
        let number = |wanted: &str, kind: Type| {
            let field =
                fields.iter().find(|field| field.name() == wanted && field.r#type() == kind);
            let field =
                field.ok_or_else(|| format!("schema `{message_name}` has no field `{wanted}`"))?;
            Ok::<_, String>(field.number() as u32)
        };
        let is_channel = |field: &&FieldDescriptorProto| {
            field.r#type() == Type::Double && field.name() != schema::TIME.0
        };
        Ok(Self {
            name: name.to_owned(),
            time_number: number(schema::TIME.0, Type::Double)?,
            crc_number: number(schema::CRC.0, Type::Fixed32)?,
            columns: fields.iter().filter(is_channel).map(Column::new).collect(),
            time_s: Vec::new(),
        })
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn is_empty(&self) -> bool {
        self.time_s.is_empty()
    }

    /// Appends one message.
    ///
    /// # Errors
    /// [`LogError::Corrupt`], [`LogError::ValueCrc`], [`LogError::RowWidth`],
    /// [`LogError::TooLarge`].
    pub(super) fn push(
        &mut self,
        file: &str,
        message: &[u8],
        budget: &mut Budget,
    ) -> Result<(), LogError> {
        let corrupt = |what: String| LogError::Corrupt { file: file.to_owned(), what };
        let index = self.time_s.len();
        let (time_s, crc32) = self
            .parse(message)
            .map_err(|error| corrupt(format!("{}: message {index}: {error}", self.name)))?;
        let time_s = time_s
            .ok_or_else(|| corrupt(format!("{}: message {index} has no time_s", self.name)))?;
        if crc32.len() != self.columns.len() {
            let (found, need) = (crc32.len(), self.columns.len());
            let name = &self.name;
            return Err(corrupt(format!(
                "{name} at {time_s:.6} s: {found} CRC32s for {need} channels"
            )));
        }
        let asked = self.columns.iter().map(|column| column.grows_by(index)).sum::<usize>() + 1;
        budget
            .take_numbers(asked)
            .map_err(|error| LogError::TooLarge { file: file.to_owned(), error })?;
        let of_time = time_crc32(time_s);
        let full_name = |column: &Column| format!("{}.{}", self.name, column.name);
        for (column, crc32) in self.columns.iter_mut().zip(crc32) {
            if !column.row.is_empty() && row_crc32(&of_time, &column.row) != crc32 {
                return Err(LogError::ValueCrc {
                    file: file.to_owned(),
                    channel: full_name(column),
                    time_s,
                });
            }
            column.push(index).map_err(|width| LogError::RowWidth {
                file: file.to_owned(),
                channel: full_name(column),
                time_s,
                width,
                found: column.row.len(),
            })?;
        }
        self.time_s.push(time_s);
        Ok(())
    }

    /// Fills the rows of the columns; time and CRC32s are returned.
    fn parse(&mut self, mut message: &[u8]) -> Result<(Option<f64>, Vec<u32>), DecodeError> {
        let (mut time_s, mut crc32) = (None, Vec::with_capacity(self.columns.len()));
        for column in &mut self.columns {
            column.row.clear();
        }
        while !message.is_empty() {
            let (number, wire_type) = decode_key(&mut message)?;
            let context = DecodeContext::default();
            if number == self.time_number {
                let mut value = 0.0;
                double::merge(wire_type, &mut value, &mut message, context)?;
                time_s = Some(value);
            } else if number == self.crc_number {
                fixed32::merge_repeated(wire_type, &mut crc32, &mut message, context)?;
            } else if let Some(column) =
                self.columns.iter_mut().find(|column| column.number == number)
            {
                double::merge_repeated(wire_type, &mut column.row, &mut message, context)?;
            } else {
                skip_field(wire_type, number, &mut message, context)?;
            }
        }
        Ok((time_s, crc32))
    }

    /// Takes out name and samples; a list channel that no message had is left out, for nobody knows
    /// its width.
    pub(super) fn take(&mut self) -> (String, Source) {
        let channel = |column: &mut Column| {
            let values = std::mem::take(&mut column.values);
            Some((column.name.clone(), Channel { width: column.width?, values }))
        };
        let channels = self.columns.iter_mut().filter_map(channel).collect();
        (self.name.clone(), Source { time_s: std::mem::take(&mut self.time_s), channels })
    }
}

impl Column {
    fn new(field: &FieldDescriptorProto) -> Self {
        Self {
            name: field.name().to_owned(),
            number: field.number() as u32,
            width: (field.label() != Label::Repeated).then_some(1),
            values: Vec::new(),
            row: Vec::new(),
        }
    }

    /// How many numbers the row at hand adds as sample `index`: a first one brings those that all
    /// samples before it lacked.
    fn grows_by(&self, index: usize) -> usize {
        match (self.row.len(), self.width) {
            (0, width) => width.unwrap_or(0),
            (own, Some(_)) => own,
            (own, None) => own.saturating_mul(index + 1),
        }
    }

    /// Appends the row at hand as sample `index`; a missing row becomes NaN, so that no later row
    /// shifts.
    ///
    /// # Errors
    /// The width so far, if the row has another one.
    fn push(&mut self, index: usize) -> Result<(), usize> {
        if self.row.is_empty() {
            self.values.extend(std::iter::repeat_n(f64::NAN, self.width.unwrap_or(0)));
            return Ok(());
        }
        let width = *self.width.get_or_insert_with(|| {
            self.values.resize(index * self.row.len(), f64::NAN);
            self.row.len()
        });
        if self.row.len() != width {
            return Err(width);
        }
        self.values.extend_from_slice(&self.row);
        Ok(())
    }
}
