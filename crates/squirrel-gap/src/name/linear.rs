//! The predictor linearised about a set of effects: one column a parameter, by difference of two predictions.

use super::evidence::Gram;
use super::parameters::{Candidate, Catalogue, Parameter};
use super::whiten::Whitener;
use crate::GapError;
use crate::predictor::{Hypothesis, Predictor};
use nalgebra::{DMatrix, DVector};
use squirrel_core::effects::Effects;

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

/// Where the predictor is asked: effects that are named, and everything else inside its tolerance.
#[derive(Debug, Clone)]
pub(crate) struct Point {
    pub(crate) members: Vec<Member>,
    /// One number a column: the catalogue's parameters, then tilt (north, east) and height of each flight's sensors.
    pub(crate) base: Vec<f64>,
}

/// The predictor as a linear model about a point.
pub(crate) struct Linear {
    pub(crate) point: Point,
    pub(crate) whitener: Whitener,
    /// Columns as they are, in the units of the rows: as in [`Point::base`].
    pub(crate) raw: Vec<Vec<f64>>,
    /// The same, whitened.
    pub(crate) columns: Vec<Vec<f64>>,
    /// Tolerances of the columns, one standard deviation.
    pub(crate) tolerance: Vec<f64>,
    /// Inner products of the whitened columns.
    pub(crate) gram: DMatrix<f64>,
}

/// Part of what was measured that no model is trusted with.
const DOUBT: f64 = 0.01;

/// Numbers of a flight's sensors among the columns.
const SENSOR_COLUMNS: usize = 3;

/// The hypothesis of a point, on top of the vehicle file.
///
/// # Errors
/// A mass or inertia that no body has.
pub(crate) fn hypothesis(
    predictor: &Predictor,
    catalogue: &Catalogue,
    point: &Point,
) -> Result<Hypothesis, GapError> {
    let mut all = predictor.nominal();
    for member in &point.members {
        if let Some(found) = all.effects.insert(catalogue.candidates[member.candidate].effect) {
            found.values.copy_from_slice(&member.values);
        }
    }
    let mut sides = [0.0; 2];
    for (parameter, &x) in catalogue.parameters.iter().zip(&point.base) {
        if x == 0.0 {
            continue;
        }
        let candidate = &catalogue.candidates[parameter.candidate];
        if candidate.effect == "wing_asymmetry" {
            sides[candidate.fixed[0].1 as usize] = x;
            continue;
        }
        let mut alone = catalogue.absent(predictor, parameter.candidate);
        alone.values[parameter.slot] += x;
        // What changes the airframe's numbers does so in a row, so that two rotors can be weak; the rest adds up.
        let mut effects = Effects::none();
        if let Some(found) = effects.insert(candidate.effect) {
            found.values.copy_from_slice(&alone.values);
        }
        let altered =
            effects.alter(&all.vehicle).map_err(|problem| predictor.refused(problem.to_string()))?;
        if altered == all.vehicle {
            add(&mut all.effects, candidate, parameter.slot, x);
        } else {
            all.vehicle = altered;
        }
    }
    // A loss on both sides is a change of the gain and a loss on one side.
    if sides != [0.0; 2] {
        let of = |effect: &str| catalogue.candidates.iter().find(|c| c.effect == effect);
        let gain = match of("wing_asymmetry") {
            Some(left) if !all.effects.has("wing_asymmetry") => {
                add(&mut all.effects, left, 1, sides[0] - sides[1]);
                -sides[1]
            }
            _ => -0.5 * (sides[0] + sides[1]),
        };
        if let Some(membrane) = of("wing_membrane") {
            add(&mut all.effects, membrane, 0, gain);
        }
    }
    for (errors, x) in
        all.errors.iter_mut().zip(point.base[catalogue.parameters.len()..].chunks_exact(SENSOR_COLUMNS))
    {
        errors.tilt_rad = [x[0], x[1]];
        errors.height_m = x[2];
    }
    Ok(all)
}

fn add(effects: &mut Effects<f64>, candidate: &Candidate, slot: usize, x: f64) {
    let present = effects.has(candidate.effect);
    if let Some(found) = effects.insert(candidate.effect) {
        if !present {
            for (slot, value) in candidate.fixed.iter().chain(&candidate.shape) {
                found.values[*slot] = *value;
            }
        }
        found.values[slot] += x;
    }
}

impl Catalogue {
    /// Numbers beside the members in a [`Point`].
    pub(crate) fn columns(&self, predictor: &Predictor) -> usize {
        self.parameters.len() + SENSOR_COLUMNS * predictor.names.len()
    }

    /// Whether a parameter has no slope at zero, so that nothing linear holds near it.
    pub(crate) fn starts_flat(&self, parameter: &Parameter) -> bool {
        ["ground_effect", "payload_swing"].contains(&self.candidates[parameter.candidate].effect)
    }

    /// Whether the slope of a parameter is another one after a few tolerances: lags and delays.
    fn bends(&self, parameter: &Parameter) -> bool {
        ["motor_lag", "actuation_latency", "clock_skew", "gnss_latency", "wing_servo_lag"]
            .contains(&self.candidates[parameter.candidate].effect)
    }

    /// Which column the height of a flight is.
    pub(crate) fn height_column(&self, flight: usize) -> usize {
        self.parameters.len() + SENSOR_COLUMNS * flight + 2
    }

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
    /// Predicts every parameter once about a point, fits the whitening to what the fullest model leaves, and whitens.
    ///
    /// * `before` - the same predictor about another point; where neither has members, columns that hardly bend are its
    ///
    /// # Errors
    /// What the predictor says.
    pub(crate) fn about(
        predictor: &Predictor,
        catalogue: &Catalogue,
        point: &Point,
        before: Option<&Self>,
    ) -> Result<Self, GapError> {
        let before = before.filter(|b| b.point.members.is_empty() && point.members.is_empty());
        let residual = predictor.residual(&hypothesis(predictor, catalogue, point)?)?;
        let n = catalogue.columns(predictor);
        let first = point.base.iter().all(|x| *x == 0.0) && point.members.is_empty();
        let (mut raw, mut tolerance, mut widest) = (Vec::new(), Vec::new(), Vec::new());
        for column in 0..n {
            let mut moved = point.clone();
            let parameter = catalogue.parameters.get(column);
            let sensor = column.wrapping_sub(catalogue.parameters.len());
            let member = parameter.and_then(|p| {
                moved.members.iter_mut().find(|m| m.candidate == p.candidate).map(|m| &mut m.values[p.slot])
            });
            // From nothing, a secant to a typical size: it ranks large effects well, and some have no slope there. Once what
            // is large has a name, a step of the tolerance: what is left stays inside it.
            let step = match (parameter, member) {
                (Some(p), Some(value)) => {
                    *value += 0.1 * p.smallest;
                    0.1 * p.smallest
                }
                (Some(p), None) => {
                    let far = first || catalogue.starts_flat(p);
                    let step =
                        if far { (p.smallest * p.largest).sqrt() } else { p.tolerance.max(0.1 * p.smallest) };
                    moved.base[column] += step;
                    step
                }
                (None, _) => {
                    let sd = [TILT_RAD, TILT_RAD, HEIGHT_M][sensor % SENSOR_COLUMNS];
                    moved.base[column] += sd;
                    sd
                }
            };
            tolerance.push(parameter.map_or(step, |p| p.tolerance));
            // At first anything may be large; about a point that explains the flights, only what has a name.
            let named = parameter.is_some_and(|p| point.members.iter().any(|m| m.candidate == p.candidate));
            widest.push(match parameter {
                Some(p) if first || named => p.slab,
                Some(p) => 3.0 * p.tolerance,
                None => step,
            });
            if let Some(before) = before
                && parameter.is_none_or(|p| !catalogue.bends(p))
            {
                raw.push(before.raw[column].clone());
                continue;
            }
            let flight = parameter.is_none().then_some(sensor / SENSOR_COLUMNS);
            let mut after = residual.clone();
            predictor.residual_of(&hypothesis(predictor, catalogue, &moved)?, flight, &mut after)?;
            for (after, before) in after.iter_mut().zip(&residual) {
                *after = (before - *after) / step;
            }
            raw.push(after);
        }
        let whitener = whitener(predictor, &raw, &widest, &residual);
        let columns: Vec<Vec<f64>> = raw.iter().map(|c| whitener.apply(&predictor.segments, c)).collect();
        let gram = Gram::new(&columns, &vec![0.0; whitener.rows()]).g;
        Ok(Self { point: point.clone(), whitener, raw, columns, tolerance, gram })
    }
}

/// The whitening of what the fullest model leaves: each pass fits every column, then the autoregression to the rest.
fn whitener(predictor: &Predictor, columns: &[Vec<f64>], widest: &[f64], residual: &[f64]) -> Whitener {
    // A first whitening by what changes from row to row: one fitted to the whole residual would take whatever is slow in it
    // for noise and never give it back.
    let doubt: Vec<f64> = predictor.measured().iter().map(|x| x * DOUBT).collect();
    let mut whitener = Whitener::white(&predictor.segments, residual);
    for _ in 0..3 {
        let white: Vec<Vec<f64>> = columns.iter().map(|c| whitener.apply(&predictor.segments, c)).collect();
        let gram = Gram::new(&white, &whitener.apply(&predictor.segments, residual));
        let Some(posterior) = gram.posterior(widest, 1.0) else { break };
        let left = subtract(residual, columns, &posterior.mean);
        whitener = Whitener::fit(&predictor.segments, &left, &doubt);
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
