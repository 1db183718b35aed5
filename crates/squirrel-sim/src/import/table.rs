//! One CSV file in memory: the columns that a map asks for, as numbers, with the line each row came from.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use csv::{ByteRecord, Reader, ReaderBuilder, Terminator, Trim};

use super::error::ImportError;
use super::names::nearest;

/// A CSV file whose header is read and whose rows are not.
pub(super) struct CsvFile {
    /// Path as given, for error messages.
    name: String,
    header: Vec<String>,
    reader: Reader<Box<dyn Read>>,
}

/// Columns of a CSV file. An empty cell is NaN; nothing is infinite.
#[derive(Debug)]
pub(super) struct Table {
    /// Path as given, for error messages.
    pub(super) name: String,
    columns: Vec<(String, Vec<f64>)>,
    /// Line number of each row, from 1, the header included.
    pub(super) lines: Vec<u64>,
}

impl CsvFile {
    /// Opens a file and reads its header.
    ///
    /// # Errors
    /// [`ImportError::Read`], [`ImportError::Empty`].
    pub(super) fn open(path: &Path) -> Result<Self, ImportError> {
        let name = path.display().to_string();
        let read_error = |source| ImportError::Read { file: path.display().to_string(), source };
        let file = File::open(path).map_err(read_error)?;
        // A newline at the very end, whether or not the file has one: the line of a row is then always the reader's
        // line less one. Empty lines are skipped, a carriage return is trimmed as white space.
        let input: Box<dyn Read> = Box::new(file.chain(&b"\n"[..]));
        let mut reader = ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .terminator(Terminator::Any(b'\n'))
            .trim(Trim::All)
            .buffer_capacity(1 << 16)
            .from_reader(input);
        let mut record = ByteRecord::new();
        while next_record(&mut reader, &mut record).map_err(read_error)? {
            if !is_blank(&record) {
                let header = record.iter().map(|cell| String::from_utf8_lossy(cell).into_owned()).collect();
                return Ok(Self { name, header, reader });
            }
        }
        Err(ImportError::Empty { file: name })
    }

    /// Names in the header.
    pub(super) fn header(&self) -> &[String] {
        &self.header
    }

    /// Reads some columns to the end of the file. A column may be asked for more than once.
    ///
    /// # Errors
    /// A missing or repeated column, a row of the wrong length, a cell that is no number or infinite, no rows.
    pub(super) fn read(mut self, wanted: &[&str]) -> Result<Table, ImportError> {
        let mut columns: Vec<(String, Vec<f64>)> = Vec::new();
        let mut places = Vec::new();
        for &column in wanted {
            if columns.iter().all(|(name, _)| name != column) {
                places.push(self.place(column)?);
                columns.push((column.to_owned(), Vec::new()));
            }
        }
        let mut lines = Vec::new();
        let mut record = ByteRecord::new();
        loop {
            let more = next_record(&mut self.reader, &mut record)
                .map_err(|source| ImportError::Read { file: self.name.clone(), source })?;
            if !more {
                break;
            }
            let row = self.reader.position().line() - 1;
            if record.len() != self.header.len() {
                if is_blank(&record) {
                    continue;
                }
                return Err(ImportError::RowLength {
                    file: self.name,
                    row,
                    cells: record.len(),
                    expected: self.header.len(),
                });
            }
            for (&place, (column, values)) in places.iter().zip(&mut columns) {
                let cell = &record[place];
                values.push(number(cell).map_err(|problem| ImportError::Cell {
                    file: self.name.clone(),
                    column: column.clone(),
                    row,
                    value: String::from_utf8_lossy(cell).chars().take(40).collect(),
                    problem,
                })?);
            }
            lines.push(row);
        }
        if lines.is_empty() {
            return Err(ImportError::HeaderOnly { file: self.name });
        }
        Ok(Table { name: self.name, columns, lines })
    }

    fn place(&self, column: &str) -> Result<usize, ImportError> {
        let mut found = self.header.iter().enumerate().filter(|(_, name)| *name == column);
        match (found.next(), found.count()) {
            (Some((place, _)), 0) => Ok(place),
            (Some(_), others) => Err(ImportError::RepeatedColumn {
                file: self.name.clone(),
                column: column.to_owned(),
                count: others + 1,
            }),
            (None, _) => Err(ImportError::MissingColumn {
                file: self.name.clone(),
                column: column.to_owned(),
                nearest: nearest(column, self.header.iter().map(String::as_str)),
            }),
        }
    }
}

impl Table {
    /// Rows.
    pub(super) fn len(&self) -> usize {
        self.lines.len()
    }

    /// The numbers of a column that was asked for in [`CsvFile::read`]; empty if it was not.
    pub(super) fn column(&self, name: &str) -> &[f64] {
        self.columns.iter().find(|(column, _)| column == name).map_or(&[], |(_, values)| values)
    }

    /// Whether the table has all of these columns.
    pub(super) fn has_all(&self, names: &[&str]) -> bool {
        names.iter().all(|name| self.columns.iter().any(|(column, _)| column == name))
    }

    #[cfg(test)]
    pub(super) fn from_columns(columns: &[(&str, &[f64])]) -> Self {
        let columns: Vec<_> = columns.iter().map(|(name, x)| ((*name).to_owned(), x.to_vec())).collect();
        let lines = (2..).take(columns[0].1.len()).collect();
        Self { name: "test.csv".to_owned(), columns, lines }
    }
}

fn next_record(reader: &mut Reader<Box<dyn Read>>, record: &mut ByteRecord) -> io::Result<bool> {
    reader.read_byte_record(record).map_err(io::Error::from)
}

fn is_blank(record: &ByteRecord) -> bool {
    record.iter().all(<[u8]>::is_empty) && record.len() <= 1
}

fn number(cell: &[u8]) -> Result<f64, &'static str> {
    if cell.is_empty() {
        return Ok(f64::NAN);
    }
    let number = std::str::from_utf8(cell).ok().and_then(|text| text.parse::<f64>().ok());
    match number {
        None => Err("is no number"),
        Some(x) if x.is_infinite() => Err("is infinite"),
        Some(x) if x.is_nan() => Ok(f64::NAN), // one bit pattern, whatever sign was written
        Some(x) => Ok(x),
    }
}
