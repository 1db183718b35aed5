//! How well hypotheses foretell the next reading of the gyroscope.
//!
//! ```text
//! w^(k+1) = w^(k) + T w'(plant) + l e(k)     e(k) = w_gyro(k) - w^(k)     l = 1 - exp(-2 pi f T), the best of some f
//! ```
//! A controller that feeds its gyroscope back has the gyroscope's noise in its commands. Behind a
//! filter that looks ahead, as the zero-phase low-pass of all other residuals does, that noise and
//! what the model makes of the commands go together with no rotor between them, and a delay that is
//! not there fits it. A reading foretold from what was before it cannot be fitted so: its noise is
//! new (the direct method of identification in closed loop: Ljung, System Identification, 13.4).

use super::{DragCentre, Hypothesis, LED_STEP_S, Predictor};
use crate::GapError;
use std::f64::consts::TAU;

/// Bandwidths of the observer, Hz: how far the model is trusted.
const BANDWIDTHS_HZ: [f64; 5] = [0.25, 0.5, 1.0, 2.0, 4.0];

/// Squares of what the gyroscope reads beyond what was foretold, by axis.
pub(crate) struct Innovations {
    squares: [f64; 3],
    readings: f64,
}

impl Innovations {
    /// Evidence for another hypothesis, nats: below 0 where its innovations are larger.
    pub(crate) fn behind(&self, other: &Self) -> f64 {
        let ratios = self.squares.iter().zip(other.squares).filter(|(own, _)| **own > 0.0);
        0.5 * self.readings * ratios.map(|(own, other)| (own / other).ln()).sum::<f64>()
    }
}

impl Predictor<'_> {
    /// The innovations of the gyroscope under a hypothesis; `None` where a flight has none.
    ///
    /// # Errors
    /// As [`Self::residual`].
    pub(crate) fn innovations(
        &self,
        hypothesis: &Hypothesis,
    ) -> Result<Option<Innovations>, GapError> {
        if !self.has_gyroscope() {
            return Ok(None);
        }
        let mut squares = [[0.0; 3]; BANDWIDTHS_HZ.len()];
        let mut readings = 0.0;
        let plant = self.plant_at(hypothesis, LED_STEP_S)?;
        let drag = DragCentre::of(self, hypothesis, LED_STEP_S)?;
        // Every reading, whatever a hypothesis asks for: else the two would be of other readings.
        let paths = self.paths.of(&plant, &self.tracks, &self.commands, |_| 1);
        for (piece, track) in self.tracks.iter().enumerate() {
            let plant = self.plant_in(hypothesis, track.flight, LED_STEP_S)?;
            let motion = self.motion(piece, hypothesis);
            let model = self.predicted(&plant, drag.as_ref(), piece, &motion, &paths);
            let gyro = &track.omega()[paths.piece(piece, track).first..];
            let dt_s = track.period_s;
            for (squares, bandwidth_hz) in squares.iter_mut().zip(BANDWIDTHS_HZ) {
                let gain = 1.0 - (-TAU * bandwidth_hz * dt_s).exp();
                let mut rate = gyro[0];
                for (i, pair) in model.windows(2).enumerate() {
                    let turn = (pair[0] + pair[1]).fixed_rows::<3>(3) * (0.5 * dt_s);
                    rate += turn;
                    let innovation = gyro[i + 1] - rate;
                    rate += innovation * gain;
                    for axis in 0..3 {
                        squares[axis] += innovation[axis] * innovation[axis];
                    }
                }
            }
            readings += model.len().saturating_sub(1) as f64;
        }
        let least = |axis: usize| squares.iter().map(|s| s[axis]).fold(f64::INFINITY, f64::min);
        Ok(Some(Innovations { squares: [0, 1, 2].map(least), readings }))
    }
}
