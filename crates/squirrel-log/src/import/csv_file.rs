//! CSV files: a header and one row a line.
//!
//! A cell may be a list of numbers, `[1.0, 2.0]` or `(1 2)`: its elements are the columns `u[0]`,
//! `u[1]` of a column `u`, as many as the first row has.

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
    /// Cells of a row.
    cells: usize,
    /// The header, and the elements of lists.
    columns: Vec<String>,
    /// Cell and element of each column behind the header.
    elements: Vec<(usize, usize)>,
    /// The first row and its number; there may be none.
    first: Option<(ByteRecord, u64)>,
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
        let file = Metered::new(crate::files::open(path).map_err(read_error)?, meter);
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
        let mut next_row = || {
            while next_record(&mut reader, &mut record).map_err(read_error)? {
                if !is_blank(&record) {
                    let row = reader.position().line() - 1;
                    return Ok(Some((record.clone(), row)));
                }
            }
            Ok(None)
        };
        let Some((header, _)) = next_row()? else { return Err(ImportError::Empty { file: name }) };
        let mut columns: Vec<String> =
            header.iter().map(|cell| String::from_utf8_lossy(cell).into_owned()).collect();
        let (first, mut elements) = (next_row()?, Vec::new());
        let first_cells = first.iter().flat_map(|(cells, _)| cells.iter());
        for (place, cell) in first_cells.enumerate().take(header.len()) {
            for i in 0..list(cell).map_or(0, Iterator::count) {
                columns.push(format!("{}[{i}]", columns[place]));
                elements.push((place, i));
            }
        }
        Ok(Self { name, cells: header.len(), columns, elements, first, reader })
    }
}

impl TableFile for CsvFile<'_> {
    fn columns(&self) -> &[String] {
        &self.columns
    }

    fn read(mut self: Box<Self>, wanted: &[&str]) -> Result<Table, ImportError> {
        let places = places(&self.name, &self.columns, wanted)?;
        let mut values = vec![Vec::new(); wanted.len()];
        let mut rows = Vec::new();
        let mut next = self.first.take();
        let mut record = ByteRecord::new();
        loop {
            let row = match next.take() {
                Some((first, row)) => {
                    record = first;
                    row
                }
                None if next_record(&mut self.reader, &mut record)
                    .map_err(|source| ImportError::Read { file: self.name.clone(), source })? =>
                {
                    self.reader.position().line() - 1
                }
                None => break,
            };
            if record.len() != self.cells {
                if is_blank(&record) {
                    continue;
                }
                return Err(ImportError::RowLength {
                    file: self.name,
                    row,
                    cells: record.len(),
                    expected: self.cells,
                });
            }
            for (&place, values) in places.iter().zip(&mut values) {
                let element = place.checked_sub(self.cells).map(|i| self.elements[i]);
                let cell = &record[element.map_or(place, |(cell, _)| cell)];
                let number = match element {
                    None => parsed(cell),
                    Some((_, element)) => element_of(cell, element),
                };
                values.push(number.map_err(|problem| ImportError::Cell {
                    file: self.name.clone(),
                    column: self.columns[place].clone(),
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

/// The elements of a list in a cell; `None` if there is no list.
fn list(cell: &[u8]) -> Option<impl Iterator<Item = &[u8]>> {
    let ([b'[', inside @ .., b']'] | [b'(', inside @ .., b')']) = cell else { return None };
    let between = |byte: &u8| *byte == b',' || *byte == b';' || byte.is_ascii_whitespace();
    Some(inside.split(between).filter(|element| !element.is_empty()))
}

/// A number of a list; NaN if the list is shorter or the cell empty.
fn element_of(cell: &[u8], element: usize) -> Result<f64, &'static str> {
    if cell.is_empty() {
        return Ok(f64::NAN);
    }
    match list(cell).ok_or("is no list of numbers")?.nth(element) {
        None | Some(b"null" | b"None") => Ok(f64::NAN),
        Some(number) => parsed(number).map_err(|_| "is no list of numbers"),
    }
}

fn is_blank(record: &ByteRecord) -> bool {
    record.iter().all(<[u8]>::is_empty) && record.len() <= 1
}
