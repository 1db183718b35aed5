//! The protobuf schema of a source: made on writing, followed on reading.
//!
//! The schema stands in the file, so a log can be read by programs that know nothing of squirrel,
//! and by versions of squirrel that know other channels. It is proto2, whose fields know whether
//! they are set: in proto3 a program that re-writes a log would drop every 0.0, and a motor at rest
//! would look like a sample that was not given.

use prost::Message as _;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{
    DescriptorProto, FieldDescriptorProto, FieldOptions, FileDescriptorProto, FileDescriptorSet,
};

use super::Source;

/// Field of the sample's time.
pub(super) const TIME: (&str, i32) = ("time_s", 1);
/// Field of the CRC32s, one a channel.
pub(super) const CRC: (&str, i32) = ("crc32", 1000);
/// Channels have the field numbers between the two.
pub(super) const CHANNELS_MAX: usize = (CRC.1 - TIME.1 - 1) as usize;

const PACKAGE: &str = "squirrel";

/// Schema name of a source: `squirrel.ControlInner` for `control.inner`.
pub(super) fn message_name(source_name: &str) -> String {
    format!("{PACKAGE}.{}", camel_case(source_name))
}

/// Whether a schema name is that of a source.
pub(super) fn is_source(message_name: &str) -> bool {
    message_name.split_once('.').is_some_and(|(package, _)| package == PACKAGE)
}

/// Serialised `FileDescriptorSet` of one source.
pub(super) fn encode(source_name: &str, source: &Source) -> Vec<u8> {
    let mut fields = vec![field(TIME, Type::Double, false)];
    for ((name, channel), number) in source.channels.iter().zip(TIME.1 + 1..) {
        fields.push(field((name, number), Type::Double, channel.width > 1));
    }
    fields.push(field(CRC, Type::Fixed32, true));
    let file = FileDescriptorProto {
        name: Some(format!("{PACKAGE}/{}.proto", source_name.replace('.', "_"))),
        package: Some(PACKAGE.to_owned()),
        message_type: vec![DescriptorProto {
            name: Some(camel_case(source_name)),
            field: fields,
            ..DescriptorProto::default()
        }],
        ..FileDescriptorProto::default()
    };
    FileDescriptorSet { file: vec![file] }.encode_to_vec()
}

/// The fields of message `full_name` in a serialised `FileDescriptorSet`, in order of their
/// numbers.
///
/// # Errors
/// One line that says what is wrong with the schema.
pub(super) fn decode(full_name: &str, set: &[u8]) -> Result<Vec<FieldDescriptorProto>, String> {
    let set =
        FileDescriptorSet::decode(set).map_err(|error| format!("schema `{full_name}`: {error}"))?;
    let mut fields = set
        .file
        .into_iter()
        .flat_map(|file| {
            let prefix = file.package.map_or_else(String::new, |package| package + ".");
            file.message_type
                .into_iter()
                .map(move |message| (prefix.clone() + message.name(), message))
        })
        .find_map(|(name, message)| (name == full_name).then_some(message.field))
        .ok_or_else(|| format!("schema `{full_name}` does not describe its message"))?;
    fields.sort_by_key(FieldDescriptorProto::number);
    Ok(fields)
}

fn field((name, number): (&str, i32), kind: Type, repeated: bool) -> FieldDescriptorProto {
    FieldDescriptorProto {
        name: Some(name.to_owned()),
        number: Some(number),
        label: Some(if repeated { Label::Repeated } else { Label::Optional }.into()),
        r#type: Some(kind.into()),
        options: repeated.then(|| FieldOptions { packed: Some(true), ..FieldOptions::default() }),
        ..FieldDescriptorProto::default()
    }
}

fn camel_case(source_name: &str) -> String {
    let mut name = String::with_capacity(source_name.len());
    for part in source_name.split(['.', '_']) {
        let mut letters = part.chars();
        name.extend(letters.next().map(|first| first.to_ascii_uppercase()));
        name.push_str(letters.as_str());
    }
    name
}
