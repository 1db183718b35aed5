//! What sensor noise and turbulence leave of a residual, by simulation through the predictor's own
//! filters.
//!
//! Noise is what this log shows: the deviation of the third difference of a raw channel, which
//! motion hardly enters. It is drawn anew, filtered and decimated as the measurement was;
//! turbulence of the tolerance of the wind acts through the predictor's own model.

use crate::predictor::{DYNAMIC, Predictor};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;

/// Correlation time of turbulence, s.
pub(crate) const TURBULENCE_S: f64 = 1.5;
/// What the smoothed GNSS velocity is off by, and for how long, m/s and s.
const VELOCITY_ERROR_M_S: f64 = 0.03;
const VELOCITY_ERROR_S: f64 = 0.5;

/// Draws of the residual that noise alone would leave; only the rows of the dynamics are filled.
pub(crate) fn draws(
    predictor: &Predictor,
    wind_columns: &[Vec<f64>; 3],
    turbulence_m_s: f64,
    count: usize,
) -> Vec<Vec<f64>> {
    (0..count)
        .map(|draw| {
            let mut rng = Pcg64Mcg::seed_from_u64(draw as u64 + 1);
            let mut rows = vec![0.0; predictor.rows()];
            for (piece, track) in predictor.tracks.iter().enumerate() {
                let white = track.drawn_noise(&mut rng);
                let mut winds =
                    [Drift::new(TURBULENCE_S, &mut rng), Drift::new(VELOCITY_ERROR_S, &mut rng)];
                let step_s = track.every as f64 * track.period_s;
                let air: Vec<[f64; 3]> = (0..white.len())
                    .map(|_| {
                        for wind in &mut winds {
                            wind.advance(step_s, &mut rng);
                        }
                        [0, 1, 2].map(|axis| {
                            winds[0].value[axis] * turbulence_m_s
                                + winds[1].value[axis] * VELOCITY_ERROR_M_S
                        })
                    })
                    .collect();
                for segment in
                    predictor.segments.iter().filter(|s| s.piece == piece && s.channel < DYNAMIC)
                {
                    for (i, (row, noise)) in
                        segment.rows.clone().zip(segment.rows_of(&white)).enumerate()
                    {
                        let air = air[i * segment.mean_of];
                        rows[row] = noise
                            + wind_columns[0][row] * air[0]
                            + wind_columns[1][row] * air[1]
                            + wind_columns[2][row] * air[2];
                    }
                }
            }
            rows
        })
        .collect()
}

/// A Gauss-Markov process of unit variance on three axes.
struct Drift {
    value: [f64; 3],
    time_constant_s: f64,
}

impl Drift {
    fn new(time_constant_s: f64, rng: &mut Pcg64Mcg) -> Self {
        Self { value: [0; 3].map(|_| StandardNormal.sample(rng)), time_constant_s }
    }
    fn advance(&mut self, dt_s: f64, rng: &mut Pcg64Mcg) {
        let keep = (-dt_s / self.time_constant_s).exp();
        for value in &mut self.value {
            let noise: f64 = StandardNormal.sample(rng);
            *value = *value * keep + noise * (1.0 - keep * keep).sqrt();
        }
    }
}
