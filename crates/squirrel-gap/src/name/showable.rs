//! From which size on some flights show each effect, before anybody looks for one.
//!
//! `x` is the whitened column of a number, so that an effect of some size changes the rows by
//! `size x`, and `b = X'x`. Where hypothesis `i`, that it is there, holds, its evidence is above that
//! of another hypothesis `j`, that nothing is or another effect, by
//!
//! ```text
//! L(size) = q size^2 + c + noise      q = beta/2 b'(m_i - m_j),  m = E[theta | b],  c = -1/2 ln(det A_i / det A_j)
//! sd(L)   = beta size sqrt((m_i - m_j)' C (m_i - m_j))      C = G + G T^2 G,  T: tolerances
//! ```
//! in the terms of [`super::evidence`]: noise is white there, and everything that floats is off by
//! its tolerance. An effect is named if `L` is what a name needs over nothing and over each other
//! name, and if its estimate is beyond its tolerance ([`super::search`]). From one size on all of
//! that holds in nearly all flights like these, below another in hardly any.

use super::evidence::{BETA, Posterior};
use super::gusts::{GUST_M_S, GUST_SHARE};
use super::off::TOLERANCES_MIN;
use super::parameters::Candidate;
use super::search::Search;
use crate::GapError;
use crate::leftover::{SLOW_RATIO, noise, slow_parts};
use crate::predictor::{Predictor, TURBULENCE_M_S};
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// What a name must be worth over another one that would be wrong, nats.
const OVER_RIVALS_NATS: f64 = 3.0;
/// Standard deviations by which chance helps or hinders in one of forty flights.
const CHANCE: f64 = 2.0;
/// By how much gusts of one flight may be weaker or stronger than on average.
const GUST_CHANCE: (f64, f64) = (0.7, 1.4);

/// From which size on flights show one number of an effect.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Showable {
    /// Index of the candidate, and of the number in the catalogue.
    pub(crate) candidate: usize,
    pub(crate) parameter: usize,
    /// From here on it is named, and below here it is not; infinite where no size is.
    pub(crate) from: f64,
    pub(crate) never_below: f64,
    /// Effects that explain its largest plausible size as well.
    pub(crate) rivals: Vec<&'static str>,
}

/// What one hypothesis is worth over another for a size of 1.
struct Lead {
    /// Evidence that grows with the squared size, evidence without any, and standard deviation, nats.
    square: f64,
    without: f64,
    deviation: f64,
}

impl Lead {
    /// The size at which the lead is `nats` if chance takes so many standard deviations away.
    fn size(&self, nats: f64, chance: f64) -> f64 {
        if self.square <= 0.0 {
            return f64::INFINITY;
        }
        let slope = chance * self.deviation;
        let missing = (nats - self.without).max(0.0);
        (slope + (slope * slope + 4.0 * self.square * missing).sqrt()) / (2.0 * self.square)
    }
}

impl Search<'_> {
    /// Sizes of all numbers of the catalogue that act by themselves.
    ///
    /// # Errors
    /// What the predictor says.
    pub(crate) fn showable(&self) -> Result<Vec<Showable>, GapError> {
        let (_, set) = self.about_nothing()?;
        let gram = &set.gram.g;
        let covariance = covariance(gram, &set.prior);
        let candidates = &self.catalogue.candidates;
        let hypotheses: Vec<Option<Posterior>> = candidates
            .iter()
            .map(|candidate| set.gram.posterior(&self.widened(&set, candidate), BETA))
            .collect();
        let mut all = Vec::new();
        for (index, (candidate, own)) in candidates.iter().zip(&hypotheses).enumerate() {
            let Some(own) = own else { continue };
            let nats = self.needed(&self.catalogue.absent(self.predictor, index));
            for p in &candidate.parameters {
                let parameter = &self.catalogue.parameters[*p];
                let column = gram.column(*p).into_owned();
                let mean = own.mean_of(&column);
                let lead = |other: &Posterior| {
                    let differs = &mean - other.mean_of(&column);
                    Lead {
                        square: 0.5 * BETA * column.dot(&differs),
                        without: own.log_volume() - other.log_volume(),
                        deviation: BETA * differs.dot(&(&covariance * &differs)).max(0.0).sqrt(),
                    }
                };
                let over_nothing = lead(&set.posterior);
                let mut weights = DVector::zeros(column.len());
                weights[*p] = 1.0;
                let weights = own.mean_of(&weights);
                let deviation = weights.dot(&(&covariance * &weights)).max(0.0).sqrt();
                let beyond = |chance: f64| {
                    let least =
                        TOLERANCES_MIN * self.catalogue.least(parameter) + chance * deviation;
                    if mean[*p] > 0.0 { least / mean[*p] } else { f64::INFINITY }
                };
                let mut found = Showable {
                    candidate: index,
                    parameter: *p,
                    from: over_nothing.size(nats, CHANCE).max(beyond(CHANCE)),
                    never_below: over_nothing.size(nats, -CHANCE).max(beyond(-CHANCE)),
                    rivals: Vec::new(),
                };
                let shows = found.from <= parameter.largest;
                let is_other = |(rival, _): &(&Candidate, _)| rival.effect != candidate.effect;
                for (rival, other) in candidates.iter().zip(&hypotheses).filter(is_other) {
                    let Some(other) = other else { continue };
                    let over = lead(other);
                    let from = over.size(OVER_RIVALS_NATS, CHANCE);
                    if shows && from > parameter.largest && !found.rivals.contains(&rival.effect) {
                        found.rivals.push(rival.effect);
                    }
                    found.from = found.from.max(from);
                    found.never_below = found.never_below.max(over.size(0.0, -CHANCE));
                }
                all.push(found);
            }
        }
        Ok(all)
    }
}

/// Covariance of the inner products with the columns: white noise, and everything off by its
/// tolerance.
fn covariance(gram: &DMatrix<f64>, tolerance: &[f64]) -> DMatrix<f64> {
    let scaled = DMatrix::from_fn(gram.nrows(), gram.ncols(), |i, j| gram[(i, j)] * tolerance[j]);
    gram + &scaled * scaled.transpose()
}

/// The deviation of gusts, m/s, from which on they are named, and below which they are not.
///
/// # Errors
/// What the predictor says.
pub(crate) fn gust_sizes(predictor: &Predictor) -> Result<(f64, f64), GapError> {
    // The floor is noise and wind, squared; two floors tell them apart.
    let [calm, windy] = slow_in(predictor, [TURBULENCE_M_S, TURBULENCE_M_S + 1.0], 0..2)?;
    let span = (TURBULENCE_M_S + 1.0).powi(2) - TURBULENCE_M_S.powi(2);
    let (mut from, mut never_below) = (0.0_f64, f64::INFINITY);
    for (calm, windy) in calm.iter().zip(&windy) {
        let of_wind = (windy * windy - calm * calm) / span;
        let stands_out = |ratio: f64| {
            let sigma = (ratio * ratio - 1.0) * calm * calm / of_wind + TURBULENCE_M_S.powi(2);
            if of_wind > 0.0 { sigma.sqrt() } else { f64::INFINITY }
        };
        from = from.max(stands_out(GUST_SHARE));
        never_below = never_below.min(stands_out(SLOW_RATIO));
    }
    if calm.is_empty() {
        return Ok((f64::INFINITY, f64::INFINITY));
    }
    let (least, _) = GUST_M_S;
    Ok(((GUST_CHANCE.1 * from).max(least), (GUST_CHANCE.0 * never_below).max(least)))
}

/// Speed through the air of flights that do not say it, m/s.
const UNKNOWN_SPEED_M_S: f64 = 2.0;

/// Whether the air may push flights up and down by more than noise at a speed that they do not say:
/// no name accounts for that.
///
/// # Errors
/// What the predictor says.
pub(crate) fn air_hides_names(predictor: &Predictor) -> Result<bool, GapError> {
    if predictor.has_motion() {
        return Ok(false);
    }
    let [calm, moving] = slow_in(predictor, [TURBULENCE_M_S, UNKNOWN_SPEED_M_S], 2..3)?;
    Ok(calm.iter().zip(&moving).any(|(calm, moving)| *moving > SLOW_RATIO * calm))
}

/// The slow part that noise and winds of two deviations, m/s, leave in some channels, by channel and
/// piece.
fn slow_in(
    predictor: &Predictor,
    winds_m_s: [f64; 2],
    channels: Range<usize>,
) -> Result<[Vec<f64>; 2], GapError> {
    let columns = predictor.wind_columns(&predictor.nominal())?;
    Ok(winds_m_s
        .map(|sigma| slow_parts(predictor, &noise(predictor, &columns, sigma), channels.clone())))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Noise alone: the size at which the lead is there goes as one over the root of what was flown,
    /// and chance moves it by as many standard deviations of the estimate.
    #[test]
    fn sizes_fall_with_the_root_of_what_was_flown() {
        let lead = |flown: f64| Lead {
            square: 0.5 * BETA * flown,
            without: 0.0,
            deviation: BETA * flown.sqrt(),
        };
        let [one, four] = [1.0, 4.0].map(|flown| lead(flown).size(6.0, CHANCE));
        assert!((one / four - 2.0).abs() < 1e-12);
        let middle = lead(1.0).size(6.0, 0.0);
        assert!((middle - (12.0 / BETA).sqrt()).abs() < 1e-12);
        assert!((one - middle - CHANCE).abs() < 0.35, "{one} {middle}");
        assert!(lead(0.0).size(6.0, CHANCE).is_infinite());
    }

    #[test]
    fn tolerances_make_the_noise_larger_where_their_columns_are() {
        let gram = DMatrix::from_row_slice(2, 2, &[4.0, 1.0, 1.0, 2.0]);
        let covariance = covariance(&gram, &[0.5, 0.0]);
        assert_eq!(covariance, &gram + DMatrix::from_row_slice(2, 2, &[4.0, 1.0, 1.0, 0.25]));
    }
}
