//! When a clock of commands may have jumped: where what the model misses wants another delay before
//! than after.
//!
//! ```text
//! c: change of the residual for a delay       gain(t) = (c'r)^2 / c'c before t + the same after t - that of both together
//! ```
//! About the best of them, the time is that at which the residual with the delay becomes the
//! smaller one. A jump is found from nearby alone, so that a hypothesis must start near the right
//! time, as a slung load at its length.

use super::whiten::Whitener;
use crate::GapError;
use crate::predictor::Predictor;
use squirrel_core::effects::{ActuationLatency, Effect};

/// Delay for which the residual changes, s: a small step.
const DELAY_S: f64 = 0.02;
/// Time between hypotheses, s, and what is left out at both ends.
const BIN_S: f64 = 0.2;
const EDGE_S: f64 = 2.0;
/// The same about the best, s, and how far.
const FINE_S: f64 = 0.02;
const NEAR_S: f64 = 1.0;

/// The time since the beginning of a flight, s, at which a step explains most; `None` where flights
/// are too short, or rotors turn as they were measured.
///
/// * `rows` - residual of the vehicle as it is
///
/// # Errors
/// What the predictor says.
pub(crate) fn clock_step_s(predictor: &Predictor, rows: &[f64]) -> Result<Option<f64>, GapError> {
    if predictor.has_rotor_speeds() {
        return Ok(None);
    }
    let whitener = Whitener::white(&predictor.segments, rows);
    let places = whitener.places(&predictor.segments);
    let white = |rows: &[f64]| whitener.apply(&predictor.segments, rows);
    let late = |delay_s: f64| -> Result<Vec<f64>, GapError> {
        let mut late = predictor.nominal();
        if let Some(found) = late.effects.insert(ActuationLatency::<f64>::NAME) {
            found.values[0] += delay_s;
        }
        Ok(white(&predictor.residual(&late)?))
    };
    let (now, after) = (white(rows), late(DELAY_S)?);
    // By time since the beginning of each flight.
    let began_s: Vec<f64> = (0..predictor.names.len())
        .map(|flight| {
            predictor.tracks.iter().find(|t| t.flight == flight).map_or(0.0, |t| t.began_s)
        })
        .collect();
    let binned = |bin_s: f64, of: &dyn Fn(usize) -> [f64; 2]| -> Vec<[f64; 2]> {
        let mut bins: Vec<[f64; 2]> = Vec::new();
        for (row, (flight, time_s, _)) in places.iter().enumerate() {
            let bin = ((time_s - began_s[*flight]) / bin_s).max(0.0) as usize;
            bins.resize(bins.len().max(bin + 1), [0.0; 2]);
            bins[bin] = add(bins[bin], of(row));
        }
        bins
    };
    // Squares of the change, and its products with the residual.
    let bins = binned(BIN_S, &|row| {
        let change = now[row] - after[row];
        [change * change, change * now[row]]
    });
    let total = bins.iter().fold([0.0; 2], |sum, bin| add(sum, *bin));
    let worth =
        |[square, product]: [f64; 2]| if square > 0.0 { product * product / square } else { 0.0 };
    let edge = (EDGE_S / BIN_S) as usize;
    let (mut before, mut best): (_, Option<(f64, f64, f64)>) = ([0.0; 2], None);
    for (i, bin) in bins.iter().enumerate().take(bins.len().saturating_sub(edge)) {
        let behind = [total[0] - before[0], total[1] - before[1]];
        let gain = worth(before) + worth(behind);
        if i >= edge && best.is_none_or(|(most, ..)| gain > most) {
            best = Some((gain, i as f64 * BIN_S, behind[1] / behind[0].max(f64::MIN_POSITIVE)));
        }
        before = add(before, *bin);
    }
    let Some((_, about_s, delays)) = best else { return Ok(None) };
    // With the delay from then on known, it is a choice between two residuals, row by row.
    let after = late(delays * DELAY_S)?;
    let bins = binned(FINE_S, &|row| [now[row] * now[row], after[row] * after[row]]);
    let (mut sum, mut least) = (0.0, (f64::INFINITY, about_s));
    for (i, [now, after]) in bins.iter().enumerate() {
        let at_s = i as f64 * FINE_S;
        if (at_s - about_s).abs() <= NEAR_S && sum < least.0 {
            least = (sum, at_s);
        }
        sum += now - after;
    }
    Ok(Some(least.1))
}

fn add(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] + b[0], a[1] + b[1]]
}
