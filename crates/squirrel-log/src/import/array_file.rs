//! Files of named arrays (MATLAB's MAT-files, HDF5): the samples of arrays as rows.
//!
//! A column is a variable or a field of a structure: `log.battery.voltage`. Of an array of two
//! sizes the longer one is time, and `log.gyro[0]` is its first column, or its first row; sizes of
//! 1 do not count. All columns that a source reads have as many samples as its time.

use super::error::ImportError;
use super::meter::Meter;
use super::number::Kind;
use super::table::{Table, TableFile, checked, places};
use crate::files::Budget;

/// Columns or rows of an array that are columns here.
const WIDTH_MAX: usize = 1024;
/// Arrays of a file; each element of a list of structures has its own.
pub(super) const ARRAYS_MAX: usize = 50_000;
/// Deeper nesting than any log has; bounds the recursion.
pub(super) const DEPTH_MAX: usize = 32;

/// An array of numbers.
#[derive(Debug)]
pub(super) struct Array {
    /// Variable, fields and elements: `log.imu[0].gyro`.
    pub(super) path: String,
    /// Sizes other than 1; numbers stand column by column.
    pub(super) sizes: Vec<usize>,
    pub(super) numbers: Numbers,
}

/// How the numbers of an array are stored.
#[derive(Debug, Clone, Copy)]
pub(super) struct Numbers {
    pub(super) kind: Kind,
    pub(super) big_endian: bool,
    /// Of the first one among the array's bytes.
    pub(super) offset: usize,
    /// From one to the next, bytes.
    pub(super) stride: usize,
}

impl Numbers {
    /// Numbers that stand one behind the other.
    pub(super) fn dense(kind: Kind, big_endian: bool) -> Self {
        Self { kind, big_endian, offset: 0, stride: kind.size() }
    }

    /// A number, by its place; NaN if the bytes end before it.
    fn at(self, place: usize, bytes: &[u8]) -> f64 {
        let size = self.kind.size();
        let start = self.offset + place * self.stride;
        let stored = bytes.get(start..start + size).unwrap_or_default();
        if !self.big_endian {
            return self.kind.number(stored);
        }
        let mut swapped = [0; 8];
        for (to, from) in swapped.iter_mut().zip(stored.iter().rev()) {
            *to = *from;
        }
        self.kind.number(&swapped[..stored.len()])
    }
}

/// The arrays of a file.
pub(super) trait Arrays {
    /// All of them.
    fn all(&self) -> &[Array];

    /// The bytes of one.
    ///
    /// # Errors
    /// Says what is wrong with them; they are larger than what is left of the `budget`.
    fn bytes(&mut self, index: usize, budget: &mut Budget) -> Result<&[u8], String>;
}

/// A file of arrays.
pub(super) struct ArrayFile<'a, A> {
    /// Path as given, for error messages.
    name: String,
    arrays: A,
    columns: Vec<String>,
    series: Vec<Series>,
    bytes: usize,
    budget: Budget,
    meter: &'a Meter<'a>,
}

/// Where the samples of a column are.
struct Series {
    array: usize,
    first: usize,
    step: usize,
    count: usize,
}

impl<'a, A: Arrays> ArrayFile<'a, A> {
    /// Finds the arrays of a file.
    ///
    /// * `find` - what is in its bytes, or what is wrong with them
    ///
    /// # Errors
    /// [`ImportError::Damaged`].
    pub(super) fn open(
        file: &str,
        bytes: Vec<u8>,
        find: impl FnOnce(Vec<u8>, &mut Budget) -> Result<A, String>,
        meter: &'a Meter<'a>,
    ) -> Result<Self, ImportError> {
        let size = bytes.len();
        let mut budget = Budget::of(size as u64);
        let arrays = find(bytes, &mut budget)
            .map_err(|problem| ImportError::Damaged { file: file.to_owned(), problem })?;
        let (mut columns, mut series) = (Vec::new(), Vec::new());
        for (index, array) in arrays.all().iter().enumerate() {
            list(index, array, &mut columns, &mut series);
        }
        Ok(Self { name: file.to_owned(), arrays, columns, series, bytes: size, budget, meter })
    }
}

impl<A: Arrays> TableFile for ArrayFile<'_, A> {
    fn columns(&self) -> &[String] {
        &self.columns
    }

    fn read(mut self: Box<Self>, wanted: &[&str]) -> Result<Table, ImportError> {
        let places = places(&self.name, &self.columns, wanted)?;
        let count = places.first().map_or(0, |place| self.series[*place].count);
        let mut values = Vec::with_capacity(wanted.len());
        for (place, column) in places.into_iter().zip(wanted) {
            let series = &self.series[place];
            let damaged = |problem| ImportError::Damaged { file: self.name.clone(), problem };
            if series.count != count {
                return Err(damaged(format!(
                    "`{column}` has {} samples, its time `{}` has {count}",
                    series.count, wanted[0]
                )));
            }
            // One byte of the file may be a number of eight.
            self.budget
                .take_numbers(count)
                .map_err(|source| ImportError::TooLarge { file: self.name.clone(), source })?;
            let stored = self.arrays.all()[series.array].numbers;
            let bytes = self
                .arrays
                .bytes(series.array, &mut self.budget)
                .map_err(|problem| damaged(format!("`{column}`: {problem}")))?;
            let numbers = (0..count).map(|row| {
                let number = stored.at(series.first + row * series.step, bytes);
                checked(number).map_err(|problem| ImportError::Cell {
                    file: self.name.clone(),
                    column: (*column).to_owned(),
                    row: row as u64 + 1,
                    value: number.to_string(),
                    problem,
                })
            });
            values.push(numbers.collect::<Result<Vec<f64>, _>>()?);
        }
        if count == 0 {
            return Err(ImportError::HeaderOnly { file: self.name });
        }
        self.meter.add(self.bytes);
        let rows = (1..=count as u64).collect();
        Ok(Table::new(self.name, wanted, values, rows))
    }
}

/// Appends the columns of an array.
fn list(index: usize, array: &Array, columns: &mut Vec<String>, series: &mut Vec<Series>) {
    match array.sizes[..] {
        [] => {
            columns.push(array.path.clone());
            series.push(Series { array: index, first: 0, step: 1, count: 1 });
        }
        [count] => {
            columns.push(array.path.clone());
            series.push(Series { array: index, first: 0, step: 1, count });
        }
        // Numbers stand column by column.
        [rows, width] if rows >= width => {
            for i in 0..width.min(WIDTH_MAX) {
                columns.push(format!("{}[{i}]", array.path));
                series.push(Series { array: index, first: i * rows, step: 1, count: rows });
            }
        }
        [width, count] => {
            for i in 0..width.min(WIDTH_MAX) {
                columns.push(format!("{}[{i}]", array.path));
                series.push(Series { array: index, first: i, step: width, count });
            }
        }
        _ => {}
    }
}
