//! A column of a linear model of which most rows are zero: what is of one flight is nothing in all
//! others.
//!
//! Kept are the rows from the first that is not zero to the last, so that the memory of all flights'
//! own columns goes with their time, and not with that times their number.

use std::borrow::Cow;
use std::ops::Range;
use std::rc::Rc;

/// One number a row, most of them zero.
#[derive(Debug, Clone, Default)]
pub(crate) struct Column {
    rows: usize,
    first: usize,
    /// Shared by all models that have it.
    kept: Rc<Vec<f64>>,
}

impl Column {
    /// Of all its rows; without rows it is one of zeros.
    pub(crate) fn of(all: Vec<f64>) -> Self {
        let rows = all.len();
        let first = all.iter().position(|x| *x != 0.0).unwrap_or(rows);
        let end = all.iter().rposition(|x| *x != 0.0).map_or(first, |last| last + 1);
        let kept = if (first, end) == (0, rows) { all } else { all[first..end].to_vec() };
        Self { rows, first, kept: Rc::new(kept) }
    }

    pub(crate) fn rows(&self) -> usize {
        self.rows
    }

    /// From the first row that is not zero to the last.
    pub(crate) fn span(&self) -> Range<usize> {
        self.first..self.first + self.kept.len()
    }

    /// The rows that are kept, with their numbers.
    pub(crate) fn kept(&self) -> impl Iterator<Item = (usize, f64)> {
        (self.first..).zip(self.kept.iter().copied())
    }

    /// Some of its rows.
    pub(crate) fn piece(&self, rows: Range<usize>) -> Cow<'_, [f64]> {
        let span = self.span();
        if span.start <= rows.start && rows.end <= span.end {
            return Cow::Borrowed(&self.kept[rows.start - span.start..rows.end - span.start]);
        }
        let mut out = vec![0.0; rows.len()];
        let own = rows.start.max(span.start)..rows.end.min(span.end);
        if own.start < own.end {
            let kept = &self.kept[own.start - span.start..own.end - span.start];
            out[own.start - rows.start..own.end - rows.start].copy_from_slice(kept);
        }
        Cow::Owned(out)
    }

    /// Adds a multiple of it to rows.
    pub(crate) fn add_scaled_to(&self, rows: &mut [f64], x: f64) {
        let own = rows.get_mut(self.span()).unwrap_or_default();
        for (row, c) in own.iter_mut().zip(&*self.kept) {
            *row += c * x;
        }
    }

    /// Takes a multiple of it from rows.
    pub(crate) fn take_scaled_from(&self, rows: &mut [f64], x: f64) {
        let own = rows.get_mut(self.span()).unwrap_or_default();
        for (row, c) in own.iter_mut().zip(&*self.kept) {
            *row -= c * x;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_zero_at_the_ends_is_not_kept_and_every_piece_is_as_it_was() {
        let of = |own: Range<usize>| -> Vec<f64> {
            (0..12).map(|i| if own.contains(&i) { i as f64 + 1.0 } else { 0.0 }).collect()
        };
        for own in [0..12, 0..5, 4..9, 8..12, 6..6] {
            let all = of(own.clone());
            let column = Column::of(all.clone());
            assert_eq!((column.rows(), column.kept.len()), (12, own.len()));
            for start in 0..12 {
                for end in start..=12 {
                    assert_eq!(
                        *column.piece(start..end),
                        all[start..end],
                        "{own:?}: {start}..{end}"
                    );
                }
            }
            let mut rows = vec![1.0; 12];
            column.add_scaled_to(&mut rows, 2.0);
            assert!(rows.iter().zip(&all).all(|(row, x)| *row == 1.0 + 2.0 * x));
            column.take_scaled_from(&mut rows, 2.0);
            assert_eq!(rows, [1.0; 12]);
            assert!(column.kept().all(|(row, x)| all[row] == x));
        }
        assert_eq!(Column::of(Vec::new()).rows(), 0);
    }
}
