//! What the noise of the sensors of a flight leaves in the rows of its dynamics, drawn anew.

use super::Track;
use crate::flight::filter::{DERIVATIVE_REACH, derivative};
use nalgebra::{Vector3, Vector6};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

/// Deviation of the air's own motion that is no wind worth a name, m/s.
pub(crate) const TURBULENCE_M_S: f64 = 0.12;

impl Track {
    /// Noise behind the filters, a row each: white in accelerometer and gyroscope, or in what
    /// stands in for them.
    pub(crate) fn drawn_noise(&self, rng: &mut impl Rng) -> Vec<Vector6<f64>> {
        let [accelerometer, gyroscope] = self.imu_noise;
        let mut draw = |sd: Vector3<f64>| -> Vec<Vector3<f64>> {
            let mut one = || -> f64 { StandardNormal.sample(rng) };
            (0..self.time_s.len())
                .map(|_| Vector3::new(sd.x * one(), sd.y * one(), sd.z * one()))
                .collect()
        };
        let (force, rate) = (draw(accelerometer), draw(gyroscope));
        let raw: Vec<Vector6<f64>> = (DERIVATIVE_REACH..force.len() - DERIVATIVE_REACH)
            .map(|k| {
                let a = derivative(|k| rate[k], k, self.period_s);
                Vector6::new(force[k].x, force[k].y, force[k].z, a.x, a.y, a.z)
            })
            .collect();
        let mut rows = self.filter.apply(&raw, self.filter.reach(), self.every);
        let step_s = self.every as f64 * self.period_s;
        let no_lean = Vector3::zeros();
        for (from, lean, first) in
            [(&self.derived.force, self.derived.lean, 0), (&self.derived.rates, no_lean, 3)]
        {
            let Some(from) = from else { continue };
            let noise = from.noise(self.cutoff_hz, lean, step_s, rows.len(), rng);
            for (row, noise) in rows.iter_mut().zip(noise) {
                row.fixed_rows_mut::<3>(first).copy_from(&noise);
            }
        }
        rows
    }
}
