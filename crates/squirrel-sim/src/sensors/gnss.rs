//! Satellite receiver.
//!
//! Position is off by a constant, white noise and a slow wander per axis, a Gauss-Markov process
//! (`e' = -e / T + noise`, discretised exactly) that is stationary from the start: nobody took the
//! error at take-off off. A share of the fixes jumps by `outlier_m` to some side. Fixes are missing
//! for times that are exponentially distributed and begin at a constant rate. Sizes:
//! docs/equations.md, C.4.

use super::Truth;
use super::line::{Line, Stopwatch, Stream, fork, noise, uniform};
use super::parameters::GnssSensor;
use rand_distr::{Distribution, Exp1};
use rand_pcg::Pcg64Mcg;
use squirrel_core::frames::In;
use squirrel_core::nalgebra::Vector3;
use squirrel_core::stack::Gnss;
use std::f64::consts::TAU;

/// The receiver in one flight.
#[derive(Debug, Clone)]
pub(super) struct Receiver {
    line: Line<Gnss>,
    wander_rng: Pcg64Mcg,
    wander: Vector3<f64>,
    watch: Stopwatch,
    outlier_rng: Pcg64Mcg,
    dropout_rng: Pcg64Mcg,
    dropped: bool,
    /// When the next dropout begins, or this one ends, s.
    change_s: f64,
}

impl Receiver {
    pub(super) fn new(p: &GnssSensor, seed: u64) -> Self {
        let mut wander_rng = Stream::GnssWander.start(&p.timing, seed);
        let mut dropout_rng = Stream::GnssDropouts.start(&p.timing, seed);
        Self {
            line: Line::new(p.timing, seed, Stream::Gnss),
            wander: noise(&mut wander_rng, p.position_wander_m),
            wander_rng,
            watch: Stopwatch::default(),
            outlier_rng: Stream::GnssOutliers.start(&p.timing, seed),
            dropped: false,
            change_s: wait_s(&mut dropout_rng, 1.0 / p.dropouts_per_s),
            dropout_rng,
        }
    }

    pub(super) fn poll(&mut self, p: &GnssSensor, time_us: u64, truth: &Truth) -> Option<Gnss> {
        let Self { line, wander_rng, wander, watch, outlier_rng, dropout_rng, dropped, change_s } =
            self;
        line.poll(time_us, |rng| {
            if p.position_wander_m > 0.0 {
                let kept = (-watch.lap_s(time_us) / p.wander_time_s).exp();
                *wander = *wander * kept
                    + noise(wander_rng, p.position_wander_m * (1.0 - kept * kept).max(0.0).sqrt());
            }
            let mut shift = *wander;
            if p.outlier_share > 0.0 {
                let (sin, cos) = (uniform(outlier_rng) * TAU).sin_cos();
                if uniform(outlier_rng) < p.outlier_share {
                    shift += Vector3::new(cos, sin, 0.0) * p.outlier_m;
                }
            }
            // Drawn in a dropout too: the noise of the other fixes does not depend on it.
            let fix = Gnss {
                position: In::new(
                    (truth.position.vector
                        + shift
                        + Vector3::from(p.position_bias_m)
                        + noise(rng, p.position_noise_m))
                    .map(|x| x as f32),
                ),
                velocity: In::new(
                    (truth.velocity.vector
                        + Vector3::from(p.velocity_bias_m_s)
                        + noise(rng, p.velocity_noise_m_s))
                    .map(|x| x as f32),
                ),
            };
            while time_us as f64 * 1e-6 >= *change_s {
                *dropped = !*dropped;
                let mean_s = if *dropped { p.dropout_s } else { 1.0 / p.dropouts_per_s };
                *change_s += wait_s(dropout_rng, mean_s);
            }
            (!*dropped).then_some(fix)
        })
    }

    pub(super) fn fork(&mut self) {
        for rng in
            [&mut self.line.rng, &mut self.wander_rng, &mut self.outlier_rng, &mut self.dropout_rng]
        {
            fork(rng);
        }
    }
}

/// Until something that happens once in this time on average, s.
fn wait_s(rng: &mut Pcg64Mcg, mean_s: f64) -> f64 {
    let unit: f64 = Exp1.sample(rng);
    unit * mean_s
}
