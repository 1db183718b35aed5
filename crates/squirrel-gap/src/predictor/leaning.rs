//! How an attitude estimate leans into an acceleration that lasts: a filter that takes the
//! accelerometer for the vertical.

use nalgebra::{UnitQuaternion, Vector3};

/// Time over which a filter of attitude trusts its gyroscope, s.
const LEVELLING_S: f64 = 1.5;

/// How an attitude estimate leans into an acceleration: in proportion, behind a lag.
pub(super) struct Leaning {
    gain: f64,
    keep: f64,
    acceleration: Vector3<f64>,
}

impl Leaning {
    pub(super) fn new(gain: f64, period_s: f64) -> Self {
        Self { gain, keep: (-period_s / LEVELLING_S).exp(), acceleration: Vector3::zeros() }
    }

    /// The attitude without its lean: one sample on.
    pub(super) fn upright(
        &mut self,
        attitude: UnitQuaternion<f64>,
        force: &Vector3<f64>,
    ) -> UnitQuaternion<f64> {
        if self.gain == 0.0 {
            return attitude;
        }
        let now = attitude * force;
        self.acceleration +=
            (Vector3::new(now.x, now.y, 0.0) - self.acceleration) * (1.0 - self.keep);
        let a = self.acceleration;
        UnitQuaternion::from_scaled_axis(Vector3::new(-a.y, a.x, 0.0) * self.gain) * attitude
    }
}
