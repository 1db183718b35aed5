//! Axes: what a chart measures along an edge, and over which range.

use super::scale::{Scale, drawable};

/// How an axis finds its range.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Range {
    /// The data, widened to the next ticks.
    #[default]
    Data,
    /// The data and these two numbers, widened to the next ticks.
    Including(f64, f64),
    /// From the first to the second number; charts that share them have linked axes.
    Exact(f64, f64),
}

/// The label, unit and range of an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// What is drawn, without the unit.
    pub label: String,
    /// The unit of the data; empty for a plain number.
    pub unit: String,
    /// How the range is found.
    pub range: Range,
}

impl Axis {
    /// An axis whose range is that of the data.
    pub fn new(label: &str, unit: &str) -> Self {
        Self { label: label.to_owned(), unit: unit.to_owned(), range: Range::Data }
    }

    /// The same axis with another range.
    #[must_use]
    pub fn with_range(mut self, range: Range) -> Self {
        self.range = range;
        self
    }

    /// Label and unit as drawn: `tilt [deg]`.
    pub(super) fn title(&self) -> String {
        if self.unit.is_empty() {
            self.label.clone()
        } else {
            format!("{} [{}]", self.label, self.unit)
        }
    }

    /// The scale for this data.
    pub(super) fn scale(&self, data: impl Iterator<Item = f64>, intervals: usize) -> Scale {
        let bounds =
            |given: &[f64]| extent(data.chain(given.iter().copied())).unwrap_or((0.0, 1.0));
        match self.range {
            Range::Exact(lo, hi) => Scale::exact(lo, hi, intervals),
            Range::Data => {
                let (lo, hi) = bounds(&[]);
                Scale::nice(lo, hi, intervals)
            }
            Range::Including(a, b) => {
                let (lo, hi) = bounds(&[a, b]);
                Scale::nice(lo, hi, intervals)
            }
        }
    }
}

/// Smallest and largest drawable number; `None` without one.
pub(crate) fn extent(data: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    data.filter(|v| drawable(*v)).fold(None, |range, v| match range {
        None => Some((v, v)),
        Some((lo, hi)) => Some((v.min(lo), v.max(hi))),
    })
}
