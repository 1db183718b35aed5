//! What a number changes in the rows, by difference of two predictions.

use super::{Hypothesis, Predictor};
use crate::GapError;

impl Predictor<'_> {
    /// What a step of a hypothesis takes from the rows of a residual, over the step; zero in the
    /// rows of other flights than the one that it belongs to.
    ///
    /// # Errors
    /// As [`Self::residual`].
    pub(crate) fn slope(
        &self,
        residual: &[f64],
        moved: &Hypothesis,
        step: f64,
        flight: Option<usize>,
    ) -> Result<Vec<f64>, GapError> {
        let own =
            || self.segments.iter().filter(|s| flight.is_none_or(|flight| flight == s.flight));
        // Zeros that nothing writes cost no memory: with many flights, most of such a column.
        let mut rows = vec![0.0; residual.len()];
        for segment in own() {
            rows[segment.rows.clone()].copy_from_slice(&residual[segment.rows.clone()]);
        }
        self.residual_of(moved, flight, &mut rows)?;
        for segment in own() {
            let before = &residual[segment.rows.clone()];
            for (row, before) in rows[segment.rows.clone()].iter_mut().zip(before) {
                *row = (before - *row) / step;
            }
        }
        Ok(rows)
    }
}
