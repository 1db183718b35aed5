//! Whitening: an autoregression of order 8 per channel, fitted to what the fullest model leaves.
//!
//! Residuals of flights are coloured by filters, turbulence and attitude errors. Seen through the
//! same autoregression, the measurement and every column are as if the noise were white with
//! variance 1, and sums of squares count evidence. Means over seconds are taken as white.

use super::column::Column;
use crate::predictor::{CHANNELS, Segment};
use nalgebra::{DMatrix, DVector};
use std::borrow::Cow;
use std::ops::Range;

/// Order of the autoregression.
const ORDER: usize = 8;
/// Rows of a block that is looked at as a whole, and how many robust deviations of all blocks its
/// mean may be off: a burst that no column explains is no noise.
const BLOCK: usize = 8;
const BURST: f64 = 4.0;

/// The filters of all channels.
#[derive(Debug, Clone)]
pub(crate) struct Whitener {
    /// By channel.
    filters: Vec<Option<Filter>>,
}

/// Coefficients on the last samples, latest first, and the deviation of what they leave.
#[derive(Debug, Clone)]
struct Filter {
    coefficients: Vec<f64>,
    deviation: f64,
}

impl Filter {
    fn white(deviation: f64) -> Self {
        Self { coefficients: Vec::new(), deviation }
    }

    /// First rows of a segment that are lost; `None` where all are.
    fn order_in(&self, segment: &Segment) -> Option<usize> {
        let order = self.coefficients.len();
        (segment.rows.len() > 3 * order).then_some(order)
    }
}

impl Whitener {
    /// Fits each channel over all its segments.
    ///
    /// * `noise` - what the fullest model leaves
    /// * `doubt` - what no model can be trusted with: its power is added to that of the noise
    pub(crate) fn fit(segments: &[Segment], noise: &[f64], doubt: &[f64]) -> Self {
        let filters: Vec<Option<Filter>> = (0..CHANNELS.len())
            .map(|channel| {
                let all = segments.iter().filter(|s| s.channel == channel);
                let is_trim = all.clone().any(Segment::is_trim);
                let own: Vec<&Segment> =
                    all.filter(|s| is_trim || s.rows.len() > 3 * ORDER).collect();
                let of = |rows: &'_ [f64]| {
                    own.iter().map(|s| rows[s.rows.clone()].to_vec()).collect::<Vec<_>>()
                };
                if is_trim {
                    white(&[of(noise), of(doubt)].concat(), own.iter().map(|s| s.rows.len()).sum())
                } else {
                    autoregression(&calm(&of(noise)), &of(doubt))
                }
            })
            .collect();
        Self { filters }
    }

    /// Fits the first channels anew, to draws of the noise.
    pub(crate) fn refit(&mut self, segments: &[Segment], draws: &[Vec<f64>], channels: usize) {
        for (channel, filter) in self.filters.iter_mut().enumerate().take(channels) {
            let own = segments.iter().filter(|s| s.channel == channel && s.rows.len() > 3 * ORDER);
            let series: Vec<Vec<f64>> =
                own.flat_map(|s| draws.iter().map(|draw| draw[s.rows.clone()].to_vec())).collect();
            if filter.as_ref().is_some_and(|filter| !filter.coefficients.is_empty()) {
                *filter = autoregression(&series, &[]);
            }
        }
    }

    /// Leaves channels out of all that follows.
    pub(crate) fn leave_out(&mut self, channels: &[usize]) {
        for channel in channels {
            self.filters[*channel] = None;
        }
    }

    /// White noise of the size of what changes from one row to the next.
    pub(crate) fn white(segments: &[Segment], rows: &[f64]) -> Self {
        let mut changes = vec![0.0; rows.len()];
        for segment in segments {
            for row in segment.rows.clone().skip(1) {
                changes[row] = (rows[row] - rows[row - 1]) * std::f64::consts::FRAC_1_SQRT_2;
            }
        }
        let mut out = Self::fit(segments, &changes, &vec![0.0; rows.len()]);
        for (channel, filter) in out.filters.iter_mut().enumerate() {
            let own = segments
                .iter()
                .filter(|s| s.channel == channel)
                .flat_map(|s| changes[s.rows.clone()].iter());
            let (sum, n) = own.fold((0.0, 0.0), |(sum, n), x| (sum + x * x, n + 1.0));
            if let Some(filter) = filter {
                *filter = Filter::white(f64::sqrt(sum / n));
            }
        }
        out
    }

    /// As [`Self::apply`], of a column.
    pub(crate) fn apply_to(&self, segments: &[Segment], column: &Column) -> Column {
        if column.rows() == 0 {
            return Column::default();
        }
        Column::of(self.filtered(segments, |rows| column.piece(rows)))
    }

    /// Rows through the filters; each segment loses its first samples. No rows stay none.
    pub(crate) fn apply(&self, segments: &[Segment], column: &[f64]) -> Vec<f64> {
        if column.is_empty() {
            return Vec::new();
        }
        self.filtered(segments, |rows| Cow::Borrowed(&column[rows]))
    }

    /// * `piece` - the rows of a segment
    fn filtered<'c>(
        &self,
        segments: &[Segment],
        piece: impl Fn(Range<usize>) -> Cow<'c, [f64]>,
    ) -> Vec<f64> {
        let mut out = vec![0.0; self.rows(segments)];
        let mut rest = out.as_mut_slice();
        for segment in segments {
            let Some(filter) = &self.filters[segment.channel] else { continue };
            let Some(order) = filter.order_in(segment) else { continue };
            let x = &*piece(segment.rows.clone());
            let own = rest.split_off_mut(..x.len() - order).unwrap_or_default();
            // Most of a column of one flight; zeros that nothing writes cost no memory.
            if x.iter().all(|x| *x == 0.0) {
                continue;
            }
            let scale = 1.0 / filter.deviation;
            let Some(coefficients) = filter.coefficients.first_chunk::<ORDER>() else {
                for (own, x) in own.iter_mut().zip(x) {
                    *own = x * scale;
                }
                continue;
            };
            // By the age of samples, each a slice, so that rows are computed side by side.
            let n = own.len();
            let aged: [&[f64]; ORDER] = std::array::from_fn(|i| &x[ORDER - 1 - i..][..n]);
            let now = &x[order..][..n];
            for (row, own) in (0..n).zip(own) {
                let predicted: f64 = coefficients.iter().zip(aged).map(|(a, x)| a * x[row]).sum();
                *own = (now[row] - predicted) * scale;
            }
        }
        out
    }

    /// Of each whitened row: its flight and time, s, and channel.
    pub(crate) fn places(&self, segments: &[Segment]) -> Vec<(usize, f64, usize)> {
        let mut out = Vec::with_capacity(self.rows(segments));
        for segment in segments {
            let filter = self.filters[segment.channel].as_ref();
            if let Some(order) = filter.and_then(|filter| filter.order_in(segment)) {
                out.extend((order..segment.rows.len()).map(|i| {
                    (segment.flight, segment.t0_s + i as f64 * segment.step_s, segment.channel)
                }));
            }
        }
        out
    }

    /// Number of rows that come out of the filters.
    fn rows(&self, segments: &[Segment]) -> usize {
        let of = |s: &Segment| {
            let order = self.filters[s.channel].as_ref().and_then(|filter| filter.order_in(s));
            order.map_or(0, |order| s.rows.len() - order)
        };
        segments.iter().map(of).sum()
    }
}

/// White noise of the power of some series for a number of rows; `None` where there is nothing.
fn white(series: &[Vec<f64>], rows: usize) -> Option<Filter> {
    let power: f64 = series.iter().flatten().map(|x| x * x).sum();
    (power > 0.0).then(|| Filter::white((power / rows as f64).sqrt()))
}

/// The stretches of series without bursts.
fn calm(series: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let mean = |block: &[f64]| (block.iter().sum::<f64>() / block.len() as f64).abs();
    let mut means: Vec<f64> = series.iter().flat_map(|x| x.chunks(BLOCK).map(mean)).collect();
    if means.is_empty() {
        return Vec::new();
    }
    let middle = means.len() / 2;
    // The median of the magnitude of a normal deviate is 0.6745.
    let limit = BURST * *means.select_nth_unstable_by(middle, f64::total_cmp).1 / 0.6745;
    let mut out = Vec::new();
    for x in series {
        let mut run = Vec::new();
        for block in x.chunks(BLOCK) {
            if mean(block) <= limit {
                run.extend_from_slice(block);
            } else if !run.is_empty() {
                out.push(std::mem::take(&mut run));
            }
        }
        out.push(run);
    }
    out
}

/// Least squares over several series, with the power of others added; `None` where there is nothing
/// to fit.
fn autoregression(series: &[Vec<f64>], doubt: &[Vec<f64>]) -> Option<Filter> {
    let mut gram = DMatrix::zeros(ORDER, ORDER);
    let mut right = DVector::zeros(ORDER);
    let (mut total, mut n) = (0.0_f64, 0.0_f64);
    for (x, counts) in series.iter().map(|x| (x, 1.0)).chain(doubt.iter().map(|x| (x, 0.0))) {
        for w in x.windows(ORDER + 1) {
            for i in 0..ORDER {
                let a = w[ORDER - 1 - i];
                right[i] += a * w[ORDER];
                for j in 0..=i {
                    gram[(i, j)] += a * w[ORDER - 1 - j];
                }
            }
            total += w[ORDER] * w[ORDER];
            n += counts;
        }
    }
    if n < 4.0 * ORDER as f64 || total <= 0.0 {
        return None;
    }
    for i in 0..ORDER {
        // A millionth of the power keeps a series that is a pure line from a singular fit.
        gram[(i, i)] += 1e-6 * total;
        for j in 0..i {
            gram[(j, i)] = gram[(i, j)];
        }
    }
    let a = gram.clone().cholesky()?.solve(&right);
    let left: f64 = total - 2.0 * a.dot(&right) + a.dot(&(gram * &a));
    let left = left.max(1e-12 * total);
    Some(Filter { coefficients: a.as_slice().to_vec(), deviation: (left / n).sqrt() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use hidden_effects::draw::Draw;

    /// A segment of one channel with `n` rows.
    fn segment(n: usize) -> Segment {
        Segment {
            flight: 0,
            channel: 2,
            rows: 0..n,
            piece: 0,
            t0_s: 0.0,
            step_s: 1.0 / 30.0,
            mean_of: 1,
        }
    }
    /// Noise of unit size without memory, the same on every run.
    fn noise(n: usize) -> Vec<f64> {
        let mut draw = Draw::new(1);
        (0..n).map(|_| draw.normal(1.0)).collect()
    }
    fn mean_square(x: &[f64]) -> f64 {
        x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64
    }

    #[test]
    fn coloured_noise_comes_out_white() {
        let mut x = noise(4000);
        for i in 1..x.len() {
            x[i] += 0.9 * x[i - 1];
        }
        let segments = [segment(x.len())];
        let white = Whitener::fit(&segments, &x, &vec![0.0; x.len()]).apply(&segments, &x);
        assert!((mean_square(&white) - 1.0).abs() < 0.01);
        let neighbours = white.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / white.len() as f64;
        assert!(neighbours.abs() < 0.03, "{neighbours}");
    }

    /// A force of a few seconds that no column explains must not count as noise: it is what is to
    /// be found.
    #[test]
    fn a_burst_does_not_make_the_noise_larger() {
        let quiet = noise(2400);
        let mut loud = quiet.clone();
        for value in &mut loud[900..1050] {
            *value += 20.0;
        }
        let segments = [segment(quiet.len())];
        let seen = |x: &[f64]| {
            let whitener = Whitener::fit(&segments, x, &vec![0.0; x.len()]);
            mean_square(&whitener.apply(&segments, &quiet))
        };
        assert!((seen(&loud) / seen(&quiet) - 1.0).abs() < 0.05);
    }

    #[test]
    fn no_rows_stay_none() {
        let x = noise(300);
        let segments = [segment(x.len())];
        assert!(Whitener::fit(&segments, &x, &x).apply(&segments, &[]).is_empty());
    }
}
