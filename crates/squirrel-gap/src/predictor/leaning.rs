//! How an attitude estimate leans into an acceleration that lasts: a filter that takes the
//! accelerometer for the vertical.
//!
//! ```text
//! e(s) = (k1 / (1 + s T1) + k2 / (1 + s T2)) (z x a)      T1 = 1 s, T2 = 3 s
//! ```
//! One filter has one time constant, which no log states. Two gains at two of them come near all
//! between, and are linear in what is asked for.

use nalgebra::{UnitQuaternion, Vector3};

/// Times over which a filter of attitude trusts its gyroscope, s: a short and a long one.
const LEVELLING_S: [f64; 2] = [1.0, 3.0];

/// How an attitude estimate leans into an acceleration: in proportion, behind two lags.
pub(super) struct Leaning {
    gains: [f64; 2],
    keep: [f64; 2],
    accelerations: [Vector3<f64>; 2],
}

impl Leaning {
    /// * `gains` - behind the short and the long lag, rad per m/s^2
    pub(super) fn new(gains: [f64; 2], period_s: f64) -> Self {
        Self {
            gains,
            keep: LEVELLING_S.map(|lag_s| (-period_s / lag_s).exp()),
            accelerations: [Vector3::zeros(); 2],
        }
    }

    /// The attitude without its lean: one sample on.
    pub(super) fn upright(
        &mut self,
        attitude: UnitQuaternion<f64>,
        force: &Vector3<f64>,
    ) -> UnitQuaternion<f64> {
        if self.gains == [0.0; 2] {
            return attitude;
        }
        let now = attitude * force;
        let mut lean = Vector3::zeros();
        for ((a, keep), gain) in self.accelerations.iter_mut().zip(self.keep).zip(self.gains) {
            *a += (Vector3::new(now.x, now.y, 0.0) - *a) * (1.0 - keep);
            lean += Vector3::new(-a.y, a.x, 0.0) * gain;
        }
        UnitQuaternion::from_scaled_axis(lean) * attitude
    }
}
