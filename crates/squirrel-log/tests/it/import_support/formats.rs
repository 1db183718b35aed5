//! Small files of each format that import reads, written for the tests.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::sync::Arc;

use mcap::WriteOptions;
use mcap::records::MessageHeader;
use parquet::basic::{Compression, Encoding};
use parquet::column::writer::ColumnWriter;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;

/// The cells of a Parquet column; `None` is null and needs an optional column.
pub(crate) enum Cells {
    Doubles(Vec<Option<f64>>),
    Floats(Vec<Option<f32>>),
    Longs(Vec<Option<i64>>),
    Ints(Vec<Option<i32>>),
    Bools(Vec<Option<bool>>),
    Texts(Vec<Option<String>>),
}

/// A Parquet file: `schema` is the inside of a `message`, one line a column; rows go into groups of
/// `group_rows`.
pub(crate) fn parquet_bytes(
    schema: &str,
    columns: &[Cells],
    group_rows: usize,
    compression: Compression,
) -> Vec<u8> {
    let properties = WriterProperties::builder().set_compression(compression).build();
    parquet_written(schema, columns, group_rows, properties)
}

/// The same unpacked, each number split into its bytes.
pub(crate) fn parquet_split(schema: &str, columns: &[Cells], group_rows: usize) -> Vec<u8> {
    let properties = WriterProperties::builder()
        .set_dictionary_enabled(false)
        .set_encoding(Encoding::BYTE_STREAM_SPLIT);
    parquet_written(schema, columns, group_rows, properties.build())
}

fn parquet_written(
    schema: &str,
    columns: &[Cells],
    group_rows: usize,
    properties: WriterProperties,
) -> Vec<u8> {
    let schema = Arc::new(parse_message_type(&format!("message flight {{ {schema} }}")).unwrap());
    let mut writer = SerializedFileWriter::new(Vec::new(), schema, Arc::new(properties)).unwrap();
    for start in (0..columns[0].len()).step_by(group_rows) {
        let mut group = writer.next_row_group().unwrap();
        for cells in columns {
            let mut column = group.next_column().unwrap().unwrap();
            let rows = start..(start + group_rows).min(cells.len());
            match (column.untyped(), cells) {
                (ColumnWriter::DoubleColumnWriter(w), Cells::Doubles(x)) => write(w, &x[rows]),
                (ColumnWriter::FloatColumnWriter(w), Cells::Floats(x)) => write(w, &x[rows]),
                (ColumnWriter::Int64ColumnWriter(w), Cells::Longs(x)) => write(w, &x[rows]),
                (ColumnWriter::Int32ColumnWriter(w), Cells::Ints(x)) => write(w, &x[rows]),
                (ColumnWriter::BoolColumnWriter(w), Cells::Bools(x)) => write(w, &x[rows]),
                (ColumnWriter::ByteArrayColumnWriter(w), Cells::Texts(x)) => {
                    let texts: Vec<_> =
                        x[rows].iter().map(|t| t.as_deref().map(Into::into)).collect();
                    write(w, &texts);
                }
                _ => panic!("schema and cells differ"),
            }
            column.close().unwrap();
        }
        group.close().unwrap();
    }
    writer.into_inner().unwrap()
}

fn write<T: parquet::data_type::DataType>(
    writer: &mut parquet::column::writer::ColumnWriterImpl<'_, T>,
    cells: &[Option<T::T>],
) {
    let levels: Vec<i16> = cells.iter().map(|cell| i16::from(cell.is_some())).collect();
    let values: Vec<T::T> = cells.iter().flatten().cloned().collect();
    let levels = writer.get_descriptor().max_def_level().is_positive().then_some(levels.as_slice());
    writer.write_batch(&values, levels, None).unwrap();
}

impl Cells {
    fn len(&self) -> usize {
        match self {
            Cells::Doubles(x) => x.len(),
            Cells::Floats(x) => x.len(),
            Cells::Longs(x) => x.len(),
            Cells::Ints(x) => x.len(),
            Cells::Bools(x) => x.len(),
            Cells::Texts(x) => x.len(),
        }
    }
}

/// A ULog file, record by record.
pub(crate) struct Ulog(pub(crate) Vec<u8>);

impl Ulog {
    pub(crate) fn new() -> Self {
        let mut bytes = b"ULog\x01\x12\x35\x01".to_vec();
        bytes.extend(1000_u64.to_le_bytes());
        Self(bytes)
    }

    pub(crate) fn record(mut self, kind: u8, payload: &[u8]) -> Self {
        self.0.extend(u16::try_from(payload.len()).unwrap().to_le_bytes());
        self.0.push(kind);
        self.0.extend(payload);
        self
    }

    /// Flags: nothing special, or data appended at a byte.
    pub(crate) fn flags(self, appended_at: Option<u64>) -> Self {
        let mut payload = [0; 40];
        if let Some(at) = appended_at {
            payload[8] = 1;
            payload[16..24].copy_from_slice(&at.to_le_bytes());
        }
        self.record(b'B', &payload)
    }

    pub(crate) fn format(self, definition: &str) -> Self {
        self.record(b'F', definition.as_bytes())
    }

    pub(crate) fn subscribe(self, id: u16, topic: &str, instance: u8) -> Self {
        let [low, high] = id.to_le_bytes();
        self.record(b'A', &[&[instance, low, high], topic.as_bytes()].concat())
    }

    pub(crate) fn data(self, id: u16, fields: &[u8]) -> Self {
        self.record(b'D', &[&id.to_le_bytes(), fields].concat())
    }
}

/// One message for [`mcap_bytes`]: topic, encoding, log time in ns, text.
pub(crate) type McapMessage<'a> = (&'a str, &'a str, u64, String);

/// An MCAP file; messages go into chunks of about `chunk_bytes`.
pub(crate) fn mcap_bytes(messages: &[McapMessage<'_>], chunk_bytes: u64) -> Vec<u8> {
    mcap_by(WriteOptions::new().chunk_size(Some(chunk_bytes)).compression(None), messages)
}

pub(crate) fn mcap_by(options: WriteOptions, messages: &[McapMessage<'_>]) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    let mut writer = options.create(&mut file).unwrap();
    for (sequence, (topic, encoding, log_time, text)) in (0..).zip(messages) {
        let channel_id = writer.add_channel(0, topic, encoding, &BTreeMap::new()).unwrap();
        let header = MessageHeader {
            channel_id,
            sequence,
            log_time: *log_time,
            publish_time: log_time + 500,
        };
        writer.write_to_known_channel(&header, text.as_bytes()).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    file.into_inner()
}

/// A micro-SD log of a Crazyflie, without its CRC.
pub(crate) struct Usd {
    version: u16,
    bytes: Vec<u8>,
}

impl Usd {
    /// * `events` - id, name and variables, such as `motor.m1(I)`, of each event type
    pub(crate) fn new(version: u16, events: &[(u16, &str, &[&str])]) -> Self {
        let count = |count: usize| u16::try_from(count).unwrap().to_le_bytes();
        let mut bytes = vec![0xBC];
        bytes.extend(version.to_le_bytes());
        bytes.extend(count(events.len()));
        for (id, name, variables) in events {
            bytes.extend(id.to_le_bytes());
            bytes.extend(name.as_bytes());
            bytes.push(0);
            bytes.extend(count(variables.len()));
            for variable in *variables {
                bytes.extend(variable.as_bytes());
                bytes.push(0);
            }
        }
        Self { version, bytes }
    }

    /// * `time` - ms in version 1, us in version 2
    pub(crate) fn record(mut self, id: u16, time: u64, variables: &[u8]) -> Self {
        self.bytes.extend(id.to_le_bytes());
        let time = time.to_le_bytes();
        self.bytes.extend(if self.version == 1 { &time[..4] } else { &time });
        self.bytes.extend(variables);
        self
    }

    /// With the CRC at the end.
    pub(crate) fn finish(mut self) -> Vec<u8> {
        let crc = crc32fast::hash(&self.bytes);
        self.bytes.extend(crc.to_le_bytes());
        self.bytes
    }
}
