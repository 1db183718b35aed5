//! MCAP's protobuf messages, by the descriptors that the file has of them.
//!
//! A column is a path into the message: `imu.gyro.x`, `motors[2].rpm`. A
//! `google.protobuf.Timestamp` has its own path as a column beside its two numbers, ns. A number
//! that a message leaves out is 0 where proto3 says so, and NaN elsewhere. Text and bytes are no
//! columns.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::rc::Rc;

use prost::Message as _;
use prost::encoding::{DecodeContext, WireType, decode_key, decode_varint, skip_field};
use prost_types::FileDescriptorSet;
use prost_types::field_descriptor_proto::{Label, Type};

use super::{Topic, cell, own_times};
use crate::import::error::ImportError;
use crate::import::meter::Meter;
use crate::import::table::{Table, TableFile, places};

/// Deeper nesting than any message has; bounds the recursion.
const DEPTH_MAX: usize = 32;
/// Elements of a list that are columns.
const ELEMENTS_MAX: u32 = 1024;
/// Columns of a topic.
const COLUMNS_MAX: usize = 50_000;

/// One topic of an MCAP file in protobuf.
pub(super) struct ProtobufFile<'a> {
    /// Path as given, and topic, for error messages.
    name: String,
    columns: Vec<String>,
    topic: Rc<Topic>,
    messages: Messages,
    /// Which of MCAP's own times no field hides.
    clocks: Vec<&'static str>,
    /// Bytes of the file a message and pass.
    share: usize,
    meter: &'a Meter<'a>,
}

impl<'a> ProtobufFile<'a> {
    /// Reads the descriptors, and which paths the messages have.
    ///
    /// * `share` - bytes of the file a message and pass
    ///
    /// # Errors
    /// [`ImportError::Damaged`]: descriptors or messages that are none.
    pub(super) fn open(
        name: String,
        topic: Rc<Topic>,
        share: usize,
        meter: &'a Meter<'a>,
    ) -> Result<Self, ImportError> {
        let damaged = |problem| ImportError::Damaged { file: name.clone(), problem };
        let messages = Messages::new(&topic.schema_data);
        let schema = |problem| damaged(format!("schema `{}`: {problem}", topic.schema));
        let messages = messages.map_err(schema)?;
        messages.get(&topic.schema).map_err(schema)?;
        let mut paths = BTreeSet::new();
        for index in 0..topic.len() {
            let mut visit = |path: &str, _| {
                if paths.len() < COLUMNS_MAX && !paths.contains(path) {
                    paths.insert(path.to_owned());
                }
            };
            messages
                .walk(&topic.schema, topic.message(index), &mut visit)
                .map_err(|problem| damaged(format!("message {} {problem}", index + 1)))?;
            meter.add(share);
        }
        let clocks: Vec<_> = own_times(|clock| paths.contains(clock)).collect();
        let columns =
            paths.into_iter().chain(clocks.iter().map(|&clock| clock.to_owned())).collect();
        Ok(Self { name, columns, topic, messages, clocks, share, meter })
    }
}

impl TableFile for ProtobufFile<'_> {
    fn columns(&self) -> &[String] {
        &self.columns
    }

    fn read(self: Box<Self>, wanted: &[&str]) -> Result<Table, ImportError> {
        places(&self.name, &self.columns, wanted)?;
        let places: BTreeMap<&str, usize> = wanted.iter().copied().zip(0..).collect();
        let mut values = vec![Vec::with_capacity(self.topic.len()); wanted.len()];
        let mut row = vec![f64::NAN; wanted.len()];
        for index in 0..self.topic.len() {
            for (number, &column) in row.iter_mut().zip(wanted) {
                let clock = self.topic.clock(column).filter(|_| self.clocks.contains(&column));
                *number = clock.map_or(f64::NAN, |clock| clock[index] as f64);
            }
            let mut visit = |path: &str, number| {
                if let Some(&place) = places.get(path) {
                    row[place] = number;
                }
            };
            self.messages.walk(&self.topic.schema, self.topic.message(index), &mut visit).map_err(
                |problem| ImportError::Damaged {
                    file: self.name.clone(),
                    problem: format!("message {} {problem}", index + 1),
                },
            )?;
            for ((values, &number), column) in values.iter_mut().zip(&row).zip(wanted) {
                values.push(cell(&self.name, column, index, number)?);
            }
            self.meter.add(self.share);
        }
        let rows = (1..=self.topic.len() as u64).collect();
        Ok(Table::new(self.name, wanted, values, rows))
    }
}

/// The types of messages that a file describes, by their full names.
struct Messages(BTreeMap<String, BTreeMap<u32, Field>>);

struct Field {
    name: String,
    kind: Type,
    /// Full name of the type of a message.
    message: String,
    repeated: bool,
    /// Whether a message without the field says 0.
    zero_if_absent: bool,
}

/// Takes a path in a message and the number there.
type Visit<'v> = dyn FnMut(&str, f64) + 'v;

impl Messages {
    fn new(descriptors: &[u8]) -> Result<Self, String> {
        let set = FileDescriptorSet::decode(descriptors)
            .map_err(|error| format!("is no set of descriptors: {error}"))?;
        let mut all = Self(BTreeMap::new());
        for file in set.file {
            let proto3 = file.syntax() == "proto3";
            for message in &file.message_type {
                all.add(file.package(), message, proto3, 0)?;
            }
        }
        Ok(all)
    }

    fn add(
        &mut self,
        scope: &str,
        message: &prost_types::DescriptorProto,
        proto3: bool,
        depth: usize,
    ) -> Result<(), String> {
        if depth == DEPTH_MAX {
            return Err(format!("`{scope}` is nested more than {DEPTH_MAX} deep"));
        }
        let dot = if scope.is_empty() { "" } else { "." };
        let name = format!("{scope}{dot}{}", message.name());
        let fields = message.field.iter().map(|field| {
            let repeated = field.label() == Label::Repeated;
            let own = Field {
                name: field.name().to_owned(),
                kind: field.r#type(),
                message: field.type_name().trim_start_matches('.').to_owned(),
                repeated,
                zero_if_absent: proto3
                    && !repeated
                    && field.oneof_index.is_none()
                    && !matches!(
                        field.r#type(),
                        Type::String | Type::Bytes | Type::Message | Type::Group
                    ),
            };
            (field.number() as u32, own)
        });
        self.0.insert(name.clone(), fields.collect());
        message.nested_type.iter().try_for_each(|inner| self.add(&name, inner, proto3, depth + 1))
    }

    fn get(&self, name: &str) -> Result<&BTreeMap<u32, Field>, String> {
        self.0.get(name).ok_or_else(|| format!("`{name}` is not described"))
    }

    /// Visits every number of a message.
    fn walk(&self, name: &str, bytes: &[u8], visit: &mut Visit<'_>) -> Result<(), String> {
        let mut walker = Walker { messages: self, path: String::new(), visit };
        walker.message(name, bytes, 0)
    }
}

struct Walker<'w> {
    messages: &'w Messages,
    path: String,
    visit: &'w mut Visit<'w>,
}

impl Walker<'_> {
    fn message(&mut self, name: &str, mut bytes: &[u8], depth: usize) -> Result<(), String> {
        if depth == DEPTH_MAX {
            return Err(format!("is nested more than {DEPTH_MAX} deep"));
        }
        let messages = self.messages;
        let fields = messages.get(name)?;
        let start = self.path.len();
        let mut counts: BTreeMap<u32, u32> = BTreeMap::new();
        let mut time_ns = 0_i64;
        let broken = |error: prost::DecodeError| format!("is no protobuf message: {error}");
        while !bytes.is_empty() {
            let (number, wire) = decode_key(&mut bytes).map_err(broken)?;
            let Some(field) = fields.get(&number) else {
                skip_field(wire, number, &mut bytes, DecodeContext::default()).map_err(broken)?;
                continue;
            };
            let mut value = match wire {
                WireType::Varint => Raw::Number(decode_varint(&mut bytes).map_err(broken)?),
                WireType::SixtyFourBit => Raw::Number(u64::from_le_bytes(take(&mut bytes)?)),
                WireType::ThirtyTwoBit => Raw::Number(u32::from_le_bytes(take(&mut bytes)?).into()),
                WireType::LengthDelimited => {
                    let length = decode_varint(&mut bytes).map_err(broken)?;
                    let inside =
                        usize::try_from(length).ok().and_then(|n| bytes.split_at_checked(n));
                    let (inside, rest) = inside.ok_or_else(|| {
                        format!(
                            "is no protobuf message: {length} bytes of `{}`, {} are left",
                            field.name,
                            bytes.len()
                        )
                    })?;
                    bytes = rest;
                    Raw::Bytes(inside)
                }
                WireType::StartGroup | WireType::EndGroup => {
                    skip_field(wire, number, &mut bytes, DecodeContext::default())
                        .map_err(broken)?;
                    continue;
                }
            };
            // A packed list is one field of many numbers.
            while let Some(one) = value.next(field)? {
                let count = counts.entry(number).or_default();
                *count += 1;
                if *count > ELEMENTS_MAX && field.repeated {
                    continue;
                }
                if start > 0 {
                    self.path.push('.');
                }
                self.path.push_str(&field.name);
                if field.repeated {
                    // Writing to a string cannot fail.
                    let _ = write!(self.path, "[{}]", *count - 1);
                }
                match one {
                    One::Number(x) => {
                        let unit_ns = if number == 1 { 1_000_000_000 } else { 1 };
                        time_ns = time_ns.saturating_add((x as i64).saturating_mul(unit_ns));
                        (self.visit)(&self.path, x);
                    }
                    One::Message(inside) => self.message(&field.message, inside, depth + 1)?,
                }
                self.path.truncate(start);
            }
        }
        if ["google.protobuf.Timestamp", "google.protobuf.Duration"].contains(&name) && start > 0 {
            (self.visit)(&self.path, time_ns as f64);
        }
        for (_, field) in fields
            .iter()
            .filter(|(number, field)| field.zero_if_absent && !counts.contains_key(number))
        {
            if start > 0 {
                self.path.push('.');
            }
            self.path.push_str(&field.name);
            (self.visit)(&self.path, 0.0);
            self.path.truncate(start);
        }
        Ok(())
    }
}

fn take<const N: usize>(bytes: &mut &[u8]) -> Result<[u8; N], String> {
    let (&first, rest) = bytes.split_first_chunk().ok_or_else(|| {
        format!("is no protobuf message: {N} bytes at its end, {} are left", bytes.len())
    })?;
    *bytes = rest;
    Ok(first)
}

/// A field as it is written.
enum Raw<'r> {
    Number(u64),
    Bytes(&'r [u8]),
    Done,
}

/// A number, or a message inside.
enum One<'r> {
    Number(f64),
    Message(&'r [u8]),
}

impl<'r> Raw<'r> {
    /// The next value of a field; text and bytes have none.
    fn next(&mut self, field: &Field) -> Result<Option<One<'r>>, String> {
        let wrong =
            || format!("has the field `{}` in another type than its schema says", field.name);
        match (std::mem::replace(self, Raw::Done), field.kind) {
            (Raw::Done, _) | (Raw::Bytes(_), Type::String | Type::Bytes | Type::Group) => Ok(None),
            (Raw::Bytes(inside), Type::Message) => Ok(Some(One::Message(inside))),
            (Raw::Bytes([]), _) if field.repeated => Ok(None),
            (Raw::Bytes(mut packed), kind) if field.repeated => {
                let raw = match kind {
                    Type::Double | Type::Fixed64 | Type::Sfixed64 => {
                        u64::from_le_bytes(take(&mut packed)?)
                    }
                    Type::Float | Type::Fixed32 | Type::Sfixed32 => {
                        u32::from_le_bytes(take(&mut packed)?).into()
                    }
                    _ => decode_varint(&mut packed)
                        .map_err(|error| format!("is no protobuf message: {error}"))?,
                };
                *self = Raw::Bytes(packed);
                number(kind, raw).map(|x| Some(One::Number(x))).ok_or_else(wrong)
            }
            (Raw::Bytes(_), _) => Err(wrong()),
            (Raw::Number(raw), kind) => {
                number(kind, raw).map(|x| Some(One::Number(x))).ok_or_else(wrong)
            }
        }
    }
}

/// A number of its bits or its varint; `None` for types that are none.
fn number(kind: Type, raw: u64) -> Option<f64> {
    let zigzag = (raw >> 1).cast_signed() ^ -(raw & 1).cast_signed();
    Some(match kind {
        Type::Double => f64::from_bits(raw),
        Type::Float => f64::from(f32::from_bits(raw as u32)),
        Type::Int32 | Type::Enum | Type::Sfixed32 => f64::from(raw as i32),
        Type::Int64 | Type::Sfixed64 => raw.cast_signed() as f64,
        Type::Uint32 | Type::Fixed32 => f64::from(raw as u32),
        Type::Uint64 | Type::Fixed64 => raw as f64,
        Type::Sint32 => f64::from(zigzag as i32),
        Type::Sint64 => zigzag as f64,
        Type::Bool => f64::from(u8::from(raw != 0)),
        Type::String | Type::Bytes | Type::Message | Type::Group => return None,
    })
}
