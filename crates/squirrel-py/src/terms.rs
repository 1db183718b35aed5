//! What controllers return: arrays by name, a row for each vehicle.

use crate::log::table;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::BTreeMap;

/// Rows of numbers by name; those of one number a row become one-dimensional.
#[derive(Debug, Default)]
pub(crate) struct Terms(BTreeMap<&'static str, (usize, Vec<f32>)>);

impl Terms {
    /// Appends the next vehicle's row.
    pub(crate) fn push(&mut self, name: &'static str, row: &[f32]) {
        let (_, numbers) = self.0.entry(name).or_insert_with(|| (row.len(), Vec::new()));
        numbers.extend_from_slice(row);
    }

    /// As Python's dictionary of arrays.
    pub(crate) fn arrays(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let arrays = PyDict::new(py);
        for (name, (width, numbers)) in self.0 {
            if width == 1 {
                arrays.set_item(name, PyArray1::from_vec(py, numbers))?;
            } else {
                arrays.set_item(name, table(py, numbers, width)?)?;
            }
        }
        Ok(arrays)
    }
}
