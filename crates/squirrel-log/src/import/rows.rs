//! What the import without a map asks of a log: the numbers of a column by its name.

use std::borrow::Cow;

use super::number::Column;

/// Messages of one topic, or frames of a log.
pub(super) trait Rows {
    /// How many.
    fn len(&self) -> usize;

    /// The numbers of a column, one a row; `None` if there is no such column.
    fn column(&self, name: &str) -> Option<Cow<'_, [f64]>>;
}

/// Records of a binary log, not decoded yet.
pub(super) struct Records<'a> {
    pub(super) columns: &'a [Column],
    pub(super) records: Vec<&'a [u8]>,
}

impl Rows for Records<'_> {
    fn len(&self) -> usize {
        self.records.len()
    }

    fn column(&self, name: &str) -> Option<Cow<'_, [f64]>> {
        let column = self.columns.iter().find(|column| column.name == name)?;
        Some(self.records.iter().map(|record| column.number(record)).collect())
    }
}
