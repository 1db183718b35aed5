//! Scale of the accelerometer: along each axis of the body it reads `f_measured = (1 + s) f`,
//! before its bias.

use super::{Declared, Effect, EffectParameter, Fitted, Shown, Words};
use crate::frames::{Body, In};
use crate::math::Real;
use nalgebra::Vector3;

/// Scale errors along the body axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AccelScale<T>(pub(super) [T; 3]);

impl<T: Real> Effect<T> for AccelScale<T> {
    const NAME: &'static str = "accel_scale";
    const IS_OF_SENSORS: bool = true;
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("scale_x_fraction", 0.01, 0.06).declared(Declared::AccelScale),
        EffectParameter::signed("scale_y_fraction", 0.01, 0.06).declared(Declared::AccelScale),
        EffectParameter::signed("scale_z_fraction", 0.01, 0.06).declared(Declared::AccelScale),
    ];
    const WORDS: Words = Words {
        what: "accelerometer scale",
        more: "The accelerometer reads too much",
        less: "The accelerometer reads too little",
        fly: "climbs with thrust steps, level and banked, with the velocity logged",
    };
    const SHOWN: Shown = Shown::ACCELEROMETER.and(Shown::HORIZONTAL);
    const FITTED: Fitted = Fitted::Never;

    #[inline(always)]
    fn accel_scale(&self) -> In<Body, T> {
        In::new(Vector3::from(self.0))
    }
}
