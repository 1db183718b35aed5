//! Barometer.
//!
//! The air around the body is not at the pressure of the air at rest: where it flows past the
//! opening it sucks or presses. The height read is off by
//! `dh = (c + c_w d) . (v_x^2, v_y^2, v_z^2) / 2g`: `v` the velocity through the air in body axes,
//! `c` the coefficients forward, side and up, `c_w` what wings that are fully spread add to each,
//! `d` the mean deployment (docs/equations.md, C.3). A positive coefficient is suction and reads
//! too high. The squares are those of PX4's EKF2_PCOEF_*, of the other sign, with the same
//! coefficient both ways along an axis; coefficients of different sign make the error change its
//! own with attitude.
//!
//! The opening follows the pressure with a first-order lag, exact where the height is linear
//! between calls. Weather and temperature make the reading walk (variance `K^2 t`). Then constant
//! error, white noise and the steps of the converter.

use super::Truth;
use super::line::{Line, Stopwatch, Stream, fork, noise, quantised};
use super::parameters::BaroSensor;
use rand_pcg::Pcg64Mcg;
use squirrel_core::math::GRAVITY_M_S2;

/// The barometer in one flight.
#[derive(Debug, Clone)]
pub(super) struct Barometer {
    line: Line<f32>,
    /// Height of the air in the opening and of that outside at the last call, m.
    heights: Option<[f64; 2]>,
    lag_watch: Stopwatch,
    drift_rng: Pcg64Mcg,
    drift_m: f64,
    drift_watch: Stopwatch,
}

impl Barometer {
    pub(super) fn new(p: &BaroSensor, seed: u64) -> Self {
        Self {
            line: Line::new(p.timing, seed, Stream::Baro),
            heights: None,
            lag_watch: Stopwatch::default(),
            drift_rng: Stream::BaroDrift.start(&p.timing, seed),
            drift_m: 0.0,
            drift_watch: Stopwatch::default(),
        }
    }

    pub(super) fn poll(&mut self, p: &BaroSensor, time_us: u64, truth: &Truth) -> Option<f32> {
        let outside = -truth.position.vector.z + pressure_error_m(p, truth);
        let inside = self.lagged(p.lag_s, time_us, outside);
        let Self { line, drift_rng, drift_m, drift_watch, .. } = self;
        line.poll(time_us, |rng| {
            if p.drift_m_root_s > 0.0 {
                let root_s = drift_watch.lap_s(time_us).sqrt();
                *drift_m += noise(drift_rng, p.drift_m_root_s * root_s).x;
            }
            let read = inside + (p.bias_m + *drift_m) + noise(rng, p.noise_m).x;
            Some(quantised(read, p.resolution_m) as f32)
        })
    }

    /// Solution of `lag y' = x - y` over the time since the last call, in which x was linear.
    fn lagged(&mut self, lag_s: f64, time_us: u64, outside: f64) -> f64 {
        if !(lag_s > 0.0) {
            return outside;
        }
        let elapsed_s = self.lag_watch.lap_s(time_us);
        let [inside, before] = self.heights.unwrap_or([outside; 2]);
        // With no time gone there is no slope; nothing has changed then.
        let behind = if elapsed_s > 0.0 { lag_s * (outside - before) / elapsed_s } else { 0.0 };
        let kept = (-elapsed_s / lag_s).exp();
        let inside = (outside - behind) + (inside - before + behind) * kept;
        self.heights = Some([inside, outside]);
        inside
    }

    pub(super) fn fork(&mut self) {
        fork(&mut self.line.rng);
        fork(&mut self.drift_rng);
    }
}

fn pressure_error_m(p: &BaroSensor, truth: &Truth) -> f64 {
    let wing = p.pressure_coefficient_wing * 0.5 * (truth.deployment[0] + truth.deployment[1]);
    let squares = truth.through_air.vector.map(|v| v * v);
    let pressed: f64 =
        p.pressure_coefficient.iter().zip(&squares).map(|(c, square)| (c + wing) * square).sum();
    pressed / (2.0 * GRAVITY_M_S2)
}
