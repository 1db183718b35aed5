//! At which lengths a slung load is worth looking for: where the horizontal force residual has
//! lines.
//!
//! `f = sqrt(g / l) / 2 pi`. Over a flight of 40 s two frequencies 0.03 Hz apart have nothing in
//! common, so that a hypothesis must start near the right one.

use crate::predictor::{DYNAMIC, Predictor};
use nalgebra::Vector3;
use squirrel_core::math::GRAVITY_M_S2;
use std::f64::consts::TAU;

/// Frequencies of loads on lines of 1.1 to 0.22 m, Hz.
const BAND_HZ: (f64, f64) = (0.475, 1.06);
const STEP_HZ: f64 = 0.005;
/// Lines closer than this are one, Hz.
const APART_HZ: f64 = 0.03;
/// Lines to look at.
const LINES: usize = 3;

/// Lengths, m, of loads that swing at the strongest lines of the horizontal force, the strongest
/// first; of a vehicle file that has a load, its length alone.
///
/// * `rows` - residual of the vehicle as it is
pub(crate) fn payload_lengths_m(predictor: &Predictor, rows: &[f64]) -> Vec<f64> {
    if let Some(stated) = predictor.vehicle.effects.pendulum() {
        return vec![stated.length_m];
    }
    let count = ((BAND_HZ.1 - BAND_HZ.0) / STEP_HZ) as usize;
    let frequency_hz = |i: usize| BAND_HZ.0 + i as f64 * STEP_HZ;
    let mut power = vec![0.0; count];
    for (piece, track) in predictor.tracks.iter().enumerate() {
        let segments: Vec<_> = predictor
            .segments
            .iter()
            .filter(|s| s.piece == piece && s.channel < DYNAMIC.min(3))
            .collect();
        let [x, y, z] = segments[..] else { continue };
        // A load swings along directions of the world, whatever the vehicle's heading.
        let ned: Vec<Vector3<f64>> = (0..x.rows.len())
            .map(|i| {
                let body = &predictor.plain()[piece].body[track.edge() + i * track.every];
                let at = |s: &crate::predictor::Segment| rows[s.rows.start + i];
                body.ned_from_body().quaternion * Vector3::new(at(x), at(y), at(z))
            })
            .collect();
        for axis in 0..2 {
            for (i, power) in power.iter_mut().enumerate() {
                let w = TAU * frequency_hz(i) * x.step_s;
                let (mut a, mut b) = (0.0, 0.0);
                for value in &ned {
                    (a, b) = (value[axis] + 2.0 * w.cos() * a - b, a);
                }
                *power += a * a + b * b - 2.0 * w.cos() * a * b;
            }
        }
    }
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|a, b| power[*b].total_cmp(&power[*a]));
    let mut chosen: Vec<f64> = Vec::new();
    for i in order {
        if chosen.len() < LINES && chosen.iter().all(|f| (f - frequency_hz(i)).abs() >= APART_HZ) {
            chosen.push(frequency_hz(i));
        }
    }
    chosen.iter().map(|f| GRAVITY_M_S2 / (TAU * f).powi(2)).collect()
}
