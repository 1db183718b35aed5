//! When a clock of commands may have jumped: where what the model misses wants another delay before than after.
//!
//! ```text
//! c: change of the residual for a delay       gain(t) = (c'r)^2 / c'c before t + the same after t - that of both together
//! ```
//! A jump is found from nearby alone, so that a hypothesis must start near the right time, as a slung load at its length.

use super::whiten::Whitener;
use crate::GapError;
use crate::predictor::Predictor;

/// Delay for which the residual changes, s: a small step.
const DELAY_S: f64 = 0.02;
/// Time between hypotheses, s, and what is left out at both ends.
const BIN_S: f64 = 0.2;
const EDGE_S: f64 = 2.0;

/// The time since the beginning of a flight, s, at which a step explains most; `None` where flights are too short, or rotors
/// turn as they were measured.
///
/// * `rows` - residual of the vehicle as it is
///
/// # Errors
/// What the predictor says.
pub(crate) fn clock_step_s(predictor: &Predictor, rows: &[f64]) -> Result<Option<f64>, GapError> {
    if predictor.has_rotor_speeds() {
        return Ok(None);
    }
    let mut late = predictor.nominal();
    if let Some(found) = late.effects.insert("actuation_latency") {
        found.values[0] += DELAY_S;
    }
    let change: Vec<f64> =
        predictor.residual(&late)?.iter().zip(rows).map(|(after, now)| now - after).collect();
    let whitener = Whitener::white(&predictor.segments, rows);
    let [change, rows] = [&change, rows].map(|x| whitener.apply(&predictor.segments, x));
    // By time: squares of the change, and its products with the residual.
    let mut bins: Vec<[f64; 2]> = Vec::new();
    let began_s = |flight| predictor.tracks.iter().find(|t| t.flight == flight).map_or(0.0, |t| t.began_s);
    let began_s: Vec<f64> = (0..predictor.names.len()).map(began_s).collect();
    for (row, (flight, time_s, _)) in whitener.places(&predictor.segments).into_iter().enumerate() {
        let bin = ((time_s - began_s[flight]) / BIN_S).max(0.0) as usize;
        if bin >= bins.len() {
            bins.resize(bin + 1, [0.0; 2]);
        }
        bins[bin][0] += change[row] * change[row];
        bins[bin][1] += change[row] * rows[row];
    }
    let total = bins.iter().fold([0.0; 2], |sum, bin| [sum[0] + bin[0], sum[1] + bin[1]]);
    let worth = |[square, product]: [f64; 2]| if square > 0.0 { product * product / square } else { 0.0 };
    let edge = (EDGE_S / BIN_S) as usize;
    let (mut before, mut best) = ([0.0; 2], None);
    for (i, bin) in bins.iter().enumerate().take(bins.len().saturating_sub(edge)) {
        let gain = worth(before) + worth([total[0] - before[0], total[1] - before[1]]);
        if i >= edge && best.is_none_or(|(most, _)| gain > most) {
            best = Some((gain, i as f64 * BIN_S));
        }
        before = [before[0] + bin[0], before[1] + bin[1]];
    }
    Ok(best.map(|(_, time_s)| time_s))
}
