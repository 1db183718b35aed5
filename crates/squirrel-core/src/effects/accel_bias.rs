//! Bias of the accelerometer: `f_measured = f + b`.
//!
//! Form `drifting`: `b + drift t`, `t` the time since the flight began.

use super::{Declared, Effect, EffectParameter, Fitted, Shown, Words, is};
use crate::frames::{Body, In};
use crate::math::Real;
use nalgebra::Vector3;

const DRIFTING: usize = 1;

/// Bias along the body axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AccelBias<T>(pub(super) [T; 7]);

impl<T: Real> Effect<T> for AccelBias<T> {
    const NAME: &'static str = "accel_bias";
    const IS_OF_SENSORS: bool = true;
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("bias_x_m_s2", 0.15, 0.6).declared(Declared::AccelBias),
        EffectParameter::signed("bias_y_m_s2", 0.15, 0.6).declared(Declared::AccelBias),
        EffectParameter::signed("bias_z_m_s2", 0.15, 0.6).declared(Declared::AccelBias),
        EffectParameter::signed("drift_x_m_s3", 3e-3, 0.03).only_in(&["drifting"]),
        EffectParameter::signed("drift_y_m_s3", 3e-3, 0.03).only_in(&["drifting"]),
        EffectParameter::signed("drift_z_m_s3", 3e-3, 0.03).only_in(&["drifting"]),
        EffectParameter::form(&["constant", "drifting"]),
    ];
    const WORDS: Words = Words {
        what: "accelerometer bias",
        more: "The accelerometer reads off",
        less: "The accelerometer reads off",
        fly: "hover through a full turn of yaw and at two or more headings, then dash at two headings",
    };
    const SHOWN: Shown = Shown::ACCELEROMETER.and(Shown::HORIZONTAL);
    const FITTED: Fitted = Fitted::ExceptToBaselines;

    #[inline(always)]
    fn specific_force_bias(&self, time_s: T) -> In<Body, T> {
        let [x, y, z, drift_x, drift_y, drift_z, form] = self.0;
        let bias = Vector3::new(x, y, z);
        let drift = Vector3::new(drift_x, drift_y, drift_z);
        In::new(if is(form, DRIFTING) { bias + drift * time_s } else { bias })
    }
}
