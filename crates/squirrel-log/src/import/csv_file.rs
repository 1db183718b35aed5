//! CSV files: a header and one row a line.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use csv::{ByteRecord, Reader, ReaderBuilder, Terminator, Trim};

use super::error::ImportError;
use super::meter::{Meter, Metered};
use super::table::{Table, TableFile, parsed, places};

/// A CSV file whose header is read and whose rows are not.
pub(super) struct CsvFile<'a> {
    /// Path as given, for error messages.
    name: String,
    header: Vec<String>,
    reader: Reader<Input<'a>>,
}

type Input<'a> = io::Chain<Metered<'a, File>, &'static [u8]>;

impl<'a> CsvFile<'a> {
    /// Opens a file and reads its header.
    ///
    /// # Errors
    /// [`ImportError::Read`], [`ImportError::Empty`].
    pub(super) fn open(path: &Path, meter: &'a Meter<'a>) -> Result<Self, ImportError> {
        let name = path.display().to_string();
        let read_error = |source| ImportError::Read { file: path.display().to_string(), source };
        let file = Metered::new(File::open(path).map_err(read_error)?, meter);
        // A newline at the very end, whether or not the file has one: the line of a row is then
        // always the reader's line less one. Empty lines are skipped, a carriage return is trimmed
        // as white space.
        let mut reader = ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .terminator(Terminator::Any(b'\n'))
            .trim(Trim::All)
            .buffer_capacity(1 << 16)
            .from_reader(file.chain(&b"\n"[..]));
        let mut record = ByteRecord::new();
        while next_record(&mut reader, &mut record).map_err(read_error)? {
            if !is_blank(&record) {
                let header =
                    record.iter().map(|cell| String::from_utf8_lossy(cell).into_owned()).collect();
                return Ok(Self { name, header, reader });
            }
        }
        Err(ImportError::Empty { file: name })
    }
}

impl TableFile for CsvFile<'_> {
    fn columns(&self) -> &[String] {
        &self.header
    }

    fn read(mut self: Box<Self>, wanted: &[&str]) -> Result<Table, ImportError> {
        let places = places(&self.name, &self.header, wanted)?;
        let mut values = vec![Vec::new(); wanted.len()];
        let mut rows = Vec::new();
        let mut record = ByteRecord::new();
        while next_record(&mut self.reader, &mut record)
            .map_err(|source| ImportError::Read { file: self.name.clone(), source })?
        {
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
            for (&place, values) in places.iter().zip(&mut values) {
                let cell = &record[place];
                values.push(parsed(cell).map_err(|problem| ImportError::Cell {
                    file: self.name.clone(),
                    column: self.header[place].clone(),
                    row,
                    value: String::from_utf8_lossy(cell).chars().take(40).collect(),
                    problem,
                })?);
            }
            rows.push(row);
        }
        if rows.is_empty() {
            return Err(ImportError::HeaderOnly { file: self.name });
        }
        Ok(Table::new(self.name, wanted, values, rows))
    }
}

fn next_record(reader: &mut Reader<Input>, record: &mut ByteRecord) -> io::Result<bool> {
    reader.read_byte_record(record).map_err(io::Error::from)
}

fn is_blank(record: &ByteRecord) -> bool {
    record.iter().all(<[u8]>::is_empty) && record.len() <= 1
}
