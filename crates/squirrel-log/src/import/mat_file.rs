//! MATLAB's MAT-files: the samples of arrays as rows.
//!
//! A column is a variable or a field of a structure: `log.battery.voltage`. Of an array of two
//! sizes the longer one is time, and `log.gyro[0]` is its first column, or its first row; sizes of
//! 1 do not count. All columns that a source reads have as many samples as its time.

use super::error::ImportError;
use super::mat_format::{Array, Arrays};
use super::meter::Meter;
use super::table::{Table, TableFile, checked, places};
use crate::files::Budget;

/// Columns or rows of an array that are columns here.
const WIDTH_MAX: usize = 1024;

/// A MAT-file.
pub(super) struct MatFile<'a> {
    /// Path as given, for error messages.
    name: String,
    arrays: Arrays,
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

impl<'a> MatFile<'a> {
    /// Finds the arrays of a file.
    ///
    /// # Errors
    /// [`ImportError::Damaged`].
    pub(super) fn open(
        file: &str,
        bytes: Vec<u8>,
        meter: &'a Meter<'a>,
    ) -> Result<Self, ImportError> {
        let size = bytes.len();
        let mut budget = Budget::of(size as u64);
        let arrays = Arrays::read(bytes, &mut budget)
            .map_err(|problem| ImportError::Damaged { file: file.to_owned(), problem })?;
        let (mut columns, mut series) = (Vec::new(), Vec::new());
        for (index, array) in arrays.all.iter().enumerate() {
            list(index, array, &mut columns, &mut series);
        }
        Ok(Self { name: file.to_owned(), arrays, columns, series, bytes: size, budget, meter })
    }
}

impl TableFile for MatFile<'_> {
    fn columns(&self) -> &[String] {
        &self.columns
    }

    fn read(mut self: Box<Self>, wanted: &[&str]) -> Result<Table, ImportError> {
        let places = places(&self.name, &self.columns, wanted)?;
        let count = places.first().map_or(0, |place| self.series[*place].count);
        let mut values = Vec::with_capacity(wanted.len());
        for (place, column) in places.into_iter().zip(wanted) {
            let series = &self.series[place];
            if series.count != count {
                return Err(ImportError::Damaged {
                    file: self.name,
                    problem: format!(
                        "`{column}` has {} samples, its time `{}` has {count}",
                        series.count, wanted[0]
                    ),
                });
            }
            // One byte of the file may be a number of eight.
            self.budget
                .take_numbers(count)
                .map_err(|source| ImportError::TooLarge { file: self.name.clone(), source })?;
            let array = &self.arrays.all[series.array];
            let numbers = (0..count).map(|row| {
                let number = self.arrays.number(array, series.first + row * series.step);
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
