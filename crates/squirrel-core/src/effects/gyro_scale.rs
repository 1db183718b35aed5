//! Scale of the gyroscope: along each axis of the body it reads `w_measured = (1 + s) w`.

use super::{Declared, Effect, EffectParameter, Fitted, Shown, Words};
use crate::frames::{Body, In};
use crate::math::Real;
use nalgebra::Vector3;

/// Scale errors along the body axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct GyroScale<T>(pub(super) [T; 3]);

impl<T: Real> Effect<T> for GyroScale<T> {
    const NAME: &'static str = "gyro_scale";
    const IS_OF_SENSORS: bool = true;
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("scale_x_fraction", 0.02, 0.1).declared(Declared::GyroScale),
        EffectParameter::signed("scale_y_fraction", 0.02, 0.1).declared(Declared::GyroScale),
        EffectParameter::signed("scale_z_fraction", 0.02, 0.1).declared(Declared::GyroScale),
    ];
    const WORDS: Words = Words {
        what: "gyroscope scale",
        more: "The gyroscope reads too much",
        less: "The gyroscope reads too little",
        fly: "doublets about one axis at a time and a few full turns of yaw, with the attitude logged",
    };
    const SHOWN: Shown = Shown::TURNS;
    const FITTED: Fitted = Fitted::Never;

    #[inline(always)]
    fn gyro_scale(&self) -> In<Body, T> {
        In::new(Vector3::from(self.0))
    }
}
