//! What lasts of forces and moments: means over seconds instead of all that passes the filter.
//!
//! A log without a gyroscope has quick motion from estimates, which a model of the vehicle has
//! little to do with. What is commanded all the time still balances: weight, which rotor gives
//! less, where the centre of mass is.

use super::{DYNAMIC, Predictor, Segment};
use nalgebra::Vector6;
use squirrel_core::math::GRAVITY_M_S2;

/// Part of what was measured that no model is trusted with.
const DOUBT: f64 = 0.01;
/// The same of hover, in what lasts.
const TRIM_DOUBT: f64 = 0.004;
/// Time over which forces and moments are averaged, s.
const TRIM_S: f64 = 2.0;

impl Segment {
    /// Whether it holds what lasts alone, and no more than a few numbers of it.
    pub(crate) fn is_trim(&self) -> bool {
        self.mean_of > 1
    }

    /// A channel of the dynamics at the rows of the segment.
    pub(crate) fn rows_of(&self, samples: &[Vector6<f64>]) -> impl Iterator<Item = f64> {
        let all = samples.chunks_exact(self.mean_of);
        all.map(|own| own.iter().map(|sample| sample[self.channel]).sum::<f64>() / own.len() as f64)
    }
}

impl Predictor<'_> {
    /// Keeps what lasts of forces and moments: their means over [`TRIM_S`]. Where a model knows
    /// little of what is quick, a moment that is commanded all the time still says which rotor
    /// gives less, or that the centre of mass is beside its place.
    pub(crate) fn keep_trim(&mut self) {
        self.segments.retain(|s| s.channel < DYNAMIC);
        for segment in &mut self.segments {
            let mean_of = (TRIM_S / segment.step_s).round().max(2.0) as usize;
            segment.rows.end = segment.rows.start + segment.rows.len() / mean_of;
            segment.t0_s += 0.5 * (mean_of - 1) as f64 * segment.step_s;
            segment.step_s *= mean_of as f64;
            segment.mean_of = mean_of;
        }
        self.segments.retain(|s| !s.rows.is_empty());
        self.notes.push(format!(
            "forces, moments: what lasts of them is looked at, means over {TRIM_S} s; quick ones are those of estimates"
        ));
    }

    /// What no model of this vehicle is trusted with, row by row: a part of what was measured about
    /// its mean, and of what lasts, of the forces and moments of hover.
    pub(crate) fn doubt(&self) -> Vec<f64> {
        let mut rows: Vec<f64> = self.measured().iter().map(|x| x * DOUBT).collect();
        let p = self.vehicle.vehicle.parameters();
        let arm = self.arm_m();
        let torque = p.propulsion.torque_coefficient_n_m_s2 / p.propulsion.thrust_coefficient_n_s2;
        let weight_n = p.mass_kg * GRAVITY_M_S2;
        for segment in self.segments.iter().filter(|s| s.is_trim()) {
            let hover = match segment.channel {
                0..=2 => GRAVITY_M_S2,
                axis @ (3 | 4) => weight_n * arm / p.inertia_kg_m2[(axis - 3, axis - 3)],
                _ => weight_n * torque / p.inertia_kg_m2[(2, 2)],
            };
            rows[segment.rows.clone()].fill(TRIM_DOUBT * hover);
        }
        rows
    }

    /// Distance of the farthest rotor from the middle, m.
    pub(crate) fn arm_m(&self) -> f64 {
        let rotors = self.vehicle.vehicle.rotors().iter();
        rotors.map(|rotor| rotor.position.vector.xy().norm()).fold(0.0, f64::max)
    }

    /// Keeps of the moments what another set of flights does.
    pub(crate) fn keep_moments_of(&mut self, other: &Predictor<'_>) {
        match (other.has_channel(3), other.has_all_of(3)) {
            (_, true) => {}
            (true, false) => self.keep_trim(),
            (false, _) => self.leave_out_moments(),
        }
    }
}
