//! Parquet files: flat numeric columns, nullable or not; a null is NaN.
//!
//! A column inside structs has its path as its name, `gyro.x`. Times are the integers that the file
//! stores: the map says their unit.

use std::fs::File;
use std::path::Path;

use parquet::basic::ConvertedType;
use parquet::column::reader::{ColumnReader, ColumnReaderImpl, get_column_reader};
use parquet::data_type::DataType;
use parquet::errors::ParquetError;
use parquet::file::metadata::ColumnChunkMetaData;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::schema::types::ColumnDescriptor;

use super::error::ImportError;
use super::meter::Meter;
use super::parquet_pages::Pages;
use super::table::{Table, TableFile, checked, places};
use crate::files::{self, Budget};

/// Rows decoded at once.
const BATCH_ROWS: usize = 8192;

/// A Parquet file whose footer is read.
pub(super) struct ParquetFile<'a> {
    /// Path as given, for error messages.
    name: String,
    columns: Vec<String>,
    reader: SerializedFileReader<File>,
    /// Length of the file.
    bytes: u64,
    meter: &'a Meter<'a>,
}

impl<'a> ParquetFile<'a> {
    /// Opens a file and reads its footer.
    ///
    /// # Errors
    /// [`ImportError::Read`], [`ImportError::Empty`], [`ImportError::Damaged`].
    pub(super) fn open(path: &Path, meter: &'a Meter<'a>) -> Result<Self, ImportError> {
        let name = path.display().to_string();
        let read_error = |source| ImportError::Read { file: path.display().to_string(), source };
        let file = files::open(path).map_err(read_error)?;
        let bytes = file.metadata().map_err(read_error)?.len();
        if bytes == 0 {
            return Err(ImportError::Empty { file: name });
        }
        let reader = SerializedFileReader::new(file).map_err(|error| damaged(&name, &error))?;
        let schema = reader.metadata().file_metadata().schema_descr();
        let columns = schema.columns().iter().map(|column| column.path().string()).collect();
        Ok(Self { name, columns, reader, bytes, meter })
    }

    /// All numbers of one column.
    fn column(&self, place: usize, budget: &mut Budget) -> Result<Vec<f64>, ImportError> {
        let descriptor = self.reader.metadata().file_metadata().schema_descr().column(place);
        let mut values = Vec::new();
        for group in 0..self.reader.num_row_groups() {
            let before = values.len();
            let group =
                self.reader.get_row_group(group).map_err(|error| damaged(&self.name, &error))?;
            self.check_place(group.metadata().column(place))?;
            // As many as the file says: what has others is damaged.
            let claimed = usize::try_from(group.metadata().num_rows()).unwrap_or(usize::MAX);
            budget
                .take_numbers(claimed)
                .map_err(|source| ImportError::TooLarge { file: self.name.clone(), source })?;
            values.try_reserve_exact(claimed).map_err(|error| ImportError::Damaged {
                file: self.name.clone(),
                problem: error.to_string(),
            })?;
            let pages =
                group.get_column_page_reader(place).map_err(|error| damaged(&self.name, &error))?;
            let pages = Box::new(Pages::new(pages, &descriptor));
            match numbers(get_column_reader(descriptor.clone(), pages), &descriptor, &mut values) {
                Ok(true) => {}
                Ok(false) => {
                    return Err(ImportError::ColumnType {
                        file: self.name.clone(),
                        column: self.columns[place].clone(),
                        kind: kind(&descriptor),
                    });
                }
                Err(error) => return Err(damaged(&self.name, &error)),
            }
            let rows = group.metadata().num_rows();
            if i64::try_from(values.len() - before) != Ok(rows) {
                let found = values.len() - before;
                let column = &self.columns[place];
                let problem =
                    format!("column `{column}` has {found} values where the file has {rows} rows");
                return Err(ImportError::Damaged { file: self.name.clone(), problem });
            }
            self.meter.add(
                usize::try_from(group.metadata().column(place).compressed_size()).unwrap_or(0),
            );
        }
        for (row, value) in values.iter_mut().enumerate() {
            *value = checked(*value).map_err(|problem| ImportError::Cell {
                file: self.name.clone(),
                column: self.columns[place].clone(),
                row: row as u64 + 1,
                value: value.to_string(),
                problem,
            })?;
        }
        Ok(values)
    }

    /// A column chunk must lie inside the file: the reader takes that for granted.
    fn check_place(&self, chunk: &ColumnChunkMetaData) -> Result<(), ImportError> {
        let start = chunk.dictionary_page_offset().unwrap_or(chunk.data_page_offset());
        let size = chunk.compressed_size();
        let ends = start.checked_add(size).and_then(|end| u64::try_from(end).ok());
        if start >= 0 && size >= 0 && ends.is_some_and(|end| end <= self.bytes) {
            return Ok(());
        }
        let column = chunk.column_path();
        let problem =
            format!("column `{column}` claims {size} bytes at byte {start} of {}", self.bytes);
        Err(ImportError::Damaged { file: self.name.clone(), problem })
    }
}

impl TableFile for ParquetFile<'_> {
    fn columns(&self) -> &[String] {
        &self.columns
    }

    fn read(self: Box<Self>, wanted: &[&str]) -> Result<Table, ImportError> {
        let places = places(&self.name, &self.columns, wanted)?;
        let mut budget = Budget::of(self.bytes);
        let values: Vec<Vec<f64>> = places
            .into_iter()
            .map(|place| self.column(place, &mut budget))
            .collect::<Result<_, _>>()?;
        let rows: Vec<u64> = (1..).take(values.first().map_or(0, Vec::len)).collect();
        if rows.is_empty() {
            return Err(ImportError::HeaderOnly { file: self.name });
        }
        Ok(Table::new(self.name, wanted, values, rows))
    }
}

fn damaged(file: &str, error: &ParquetError) -> ImportError {
    ImportError::Damaged { file: file.to_owned(), problem: error.to_string() }
}

/// What a column that cannot be read holds.
fn kind(descriptor: &ColumnDescriptor) -> String {
    match descriptor.converted_type() {
        _ if descriptor.max_rep_level() > 0 => "lists".to_owned(),
        ConvertedType::DECIMAL => "decimals".to_owned(),
        ConvertedType::NONE => descriptor.physical_type().to_string(),
        converted => converted.to_string(),
    }
}

/// Appends the numbers of a column; `false` if it holds none, or not one a row.
fn numbers(
    reader: ColumnReader,
    descriptor: &ColumnDescriptor,
    values: &mut Vec<f64>,
) -> Result<bool, ParquetError> {
    let converted = descriptor.converted_type();
    if descriptor.max_rep_level() > 0 || converted == ConvertedType::DECIMAL {
        return Ok(false);
    }
    let level = descriptor.max_def_level();
    match reader {
        ColumnReader::BoolColumnReader(r) => append(r, level, |&x| f64::from(u8::from(x)), values)?,
        ColumnReader::Int32ColumnReader(r) if converted == ConvertedType::UINT_32 => {
            append(r, level, |x| f64::from(x.cast_unsigned()), values)?;
        }
        ColumnReader::Int32ColumnReader(r) => append(r, level, |&x| f64::from(x), values)?,
        ColumnReader::Int64ColumnReader(r) if converted == ConvertedType::UINT_64 => {
            append(r, level, |x| x.cast_unsigned() as f64, values)?;
        }
        ColumnReader::Int64ColumnReader(r) => append(r, level, |&x| x as f64, values)?,
        ColumnReader::FloatColumnReader(r) => append(r, level, |&x| f64::from(x), values)?,
        ColumnReader::DoubleColumnReader(r) => append(r, level, |&x| x, values)?,
        ColumnReader::Int96ColumnReader(_)
        | ColumnReader::ByteArrayColumnReader(_)
        | ColumnReader::FixedLenByteArrayColumnReader(_) => return Ok(false),
    }
    Ok(true)
}

/// Appends one number a row; `level` is the definition level of a value that is there.
fn append<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    level: i16,
    to_f64: impl Fn(&T::T) -> f64,
    values: &mut Vec<f64>,
) -> Result<(), ParquetError> {
    let (mut present, mut levels) = (Vec::new(), Vec::new());
    loop {
        present.clear();
        levels.clear();
        let (rows, ..) = reader.read_records(BATCH_ROWS, Some(&mut levels), None, &mut present)?;
        if rows == 0 {
            return Ok(());
        }
        let mut present = present.iter();
        if level == 0 {
            values.extend(present.map(&to_f64));
        } else {
            let next = |at: &i16| if *at == level { present.next() } else { None };
            values.extend(levels.iter().map(next).map(|x| x.map_or(f64::NAN, &to_f64)));
        }
    }
}
