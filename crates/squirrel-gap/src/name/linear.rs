//! The predictor linearised about a set of effects: one column a parameter, by difference of two predictions.

use super::evidence::Gram;
use super::parameters::{Candidate, Catalogue};
use super::whiten::Whitener;
use crate::GapError;
use crate::predictor::{Hypothesis, Predictor};
use nalgebra::DVector;
use std::collections::BTreeMap;

/// Tolerance of the tilt of an attitude estimate, rad.
const TILT_RAD: f64 = 0.006;
/// Tolerance of the barometer's zero, m.
const HEIGHT_M: f64 = 0.2;

/// An effect with its numbers.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Member {
    /// Index of its candidate.
    pub(crate) candidate: usize,
    /// All parameters in the order of the effect.
    pub(crate) values: Vec<f64>,
}

/// A flight's predictions as a linear model about some effects.
pub(crate) struct Linear {
    pub(crate) whitener: Whitener,
    /// Columns as they are, in the units of the rows.
    pub(crate) raw: Vec<Vec<f64>>,
    /// Whitened columns: the catalogue's parameters, then what the sensors of each flight may do.
    pub(crate) columns: Vec<Vec<f64>>,
    /// Tolerances of the columns, one standard deviation.
    pub(crate) tolerance: Vec<f64>,
    /// Inner products of the columns.
    pub(crate) gram: Gram,
}

/// The hypothesis that a set of effects acts, on top of the vehicle file.
pub(crate) fn hypothesis(predictor: &Predictor, catalogue: &Catalogue, members: &[Member]) -> Hypothesis {
    let mut all = predictor.nominal();
    for member in members {
        set(&mut all, &catalogue.candidates[member.candidate], &member.values);
    }
    all
}

fn set(hypothesis: &mut Hypothesis, candidate: &Candidate, values: &[f64]) {
    if let Some(found) = hypothesis.effects.insert(candidate.effect) {
        found.values.copy_from_slice(values);
    }
}

impl Catalogue {
    /// A candidate as the vehicle file has it: zero, or the file's own numbers where it makes the same choices.
    pub(crate) fn absent(&self, predictor: &Predictor, candidate: usize) -> Member {
        let own = &self.candidates[candidate];
        let mut effects = predictor.vehicle.effects;
        let present = effects.has(own.effect);
        let mut values = effects.insert(own.effect).map_or_else(Vec::new, |found| found.values.to_vec());
        let same = own.fixed.iter().all(|(slot, value)| values[*slot] == *value);
        if !(present && same) {
            values.fill(0.0);
        }
        for (slot, value) in own.fixed.iter().chain(&own.shape) {
            values[*slot] = *value;
        }
        Member { candidate, values }
    }
}

impl Linear {
    /// Predicts every parameter once about `members`, fits the whitening to what the fullest model leaves, and whitens.
    ///
    /// # Errors
    /// What the predictor says.
    pub(crate) fn about(
        predictor: &Predictor,
        catalogue: &Catalogue,
        members: &[Member],
    ) -> Result<Self, GapError> {
        let about = hypothesis(predictor, catalogue, members);
        let residual = predictor.residual(&about)?;
        let mut columns = Vec::new();
        let mut tolerance = Vec::new();
        // A second choice of an effect that acts already (another weak rotor) cannot act beside it; it is differenced
        // against the set without that effect.
        let mut without: BTreeMap<&str, (Hypothesis, Vec<f64>)> = BTreeMap::new();
        for (index, parameter) in catalogue.parameters.iter().enumerate() {
            let candidate = &catalogue.candidates[parameter.candidate];
            let acting = members.iter().find(|m| catalogue.candidates[m.candidate].effect == candidate.effect);
            let mut start = match acting {
                Some(member) if member.candidate == parameter.candidate => member.clone(),
                _ => catalogue.absent(predictor, parameter.candidate),
            };
            let (mut changed, before) = match acting {
                Some(member) if member.candidate != parameter.candidate => {
                    if !without.contains_key(candidate.effect) {
                        let rest: Vec<Member> = members.iter().filter(|m| *m != member).cloned().collect();
                        let rest = hypothesis(predictor, catalogue, &rest);
                        let rows = predictor.residual(&rest)?;
                        without.insert(candidate.effect, (rest, rows));
                    }
                    let (rest, rows) = &without[candidate.effect];
                    (rest.clone(), rows)
                }
                _ => (about.clone(), &residual),
            };
            // From zero, a secant to a typical size: some effects have no slope at zero. From a size, a small step.
            let value = start.values[parameter.slot];
            let step = if value == 0.0 {
                (parameter.smallest * parameter.largest).sqrt()
            } else {
                0.1 * parameter.smallest
            };
            start.values[parameter.slot] += step;
            set(&mut changed, candidate, &start.values);
            let after = predictor.residual(&changed)?;
            columns.push(before.iter().zip(&after).map(|(b, a)| (b - a) / step).collect::<Vec<f64>>());
            tolerance.push(catalogue.parameters[index].tolerance);
        }
        for flight in 0..predictor.names.len() {
            let mut error = |sd: f64, change: fn(&mut crate::predictor::SensorErrors, f64)| {
                let mut changed = about.clone();
                change(&mut changed.errors[flight], sd);
                let mut after = residual.clone();
                predictor.residual_of(&changed, Some(flight), &mut after)?;
                columns.push(residual.iter().zip(&after).map(|(b, a)| (b - a) / sd).collect());
                tolerance.push(sd);
                Ok::<(), GapError>(())
            };
            error(TILT_RAD, |e, x| e.tilt_rad[0] += x)?;
            error(TILT_RAD, |e, x| e.tilt_rad[1] += x)?;
            error(HEIGHT_M, |e, x| e.height_m += x)?;
        }
        let widest: Vec<f64> = catalogue
            .parameters
            .iter()
            .map(|p| p.slab)
            .chain(tolerance[catalogue.parameters.len()..].iter().copied())
            .collect();
        let whitener = whitener(predictor, &columns, &widest, &residual);
        let raw = columns;
        let columns: Vec<Vec<f64>> =
            raw.iter().map(|c| whitener.apply(&predictor.segments, c)).collect();
        let gram = Gram::new(&columns, &whitener.apply(&predictor.segments, &residual));
        Ok(Self { whitener, raw, columns, tolerance, gram })
    }
}

/// The whitening of what the fullest model leaves: each pass fits every column, then the autoregression to the rest.
fn whitener(predictor: &Predictor, columns: &[Vec<f64>], widest: &[f64], residual: &[f64]) -> Whitener {
    let mut whitener = Whitener::fit(&predictor.segments, residual);
    for _ in 0..2 {
        let white: Vec<Vec<f64>> = columns.iter().map(|c| whitener.apply(&predictor.segments, c)).collect();
        let gram = Gram::new(&white, &whitener.apply(&predictor.segments, residual));
        let Some(posterior) = gram.posterior(widest, 1.0) else { break };
        let left = subtract(residual, columns, &posterior.mean);
        whitener = Whitener::fit(&predictor.segments, &left);
    }
    whitener
}

/// `y - X theta`.
pub(crate) fn subtract(y: &[f64], columns: &[Vec<f64>], theta: &DVector<f64>) -> Vec<f64> {
    let mut left = y.to_vec();
    for (column, x) in columns.iter().zip(theta.iter()) {
        for (value, c) in left.iter_mut().zip(column) {
            *value -= c * x;
        }
    }
    left
}
