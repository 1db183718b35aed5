//! Centre of mass off the geometric centre: `M -= r x F`, with all forces of rotors, drag and
//! wings, and `r = (x, y, 0)`, in the form `spatial` `(x, y, z)`.
//!
//! The accelerometer stays at the geometric centre, at `-r` from the centre of mass, and feels the
//! rotation there.

use super::{
    Acts, Declared, Effect, EffectParameter, Forms, Scale, Shown, Situation, Words, absent, is,
};
use crate::aero::BodyWrench;
use crate::frames::{Body, In};
use crate::lane::Lane;
use crate::lane::vector::{cross, minus};
use crate::math::Real;
use crate::numbers;
use crate::vehicle::Vehicle;
use nalgebra::Vector3;

const SPATIAL: usize = 1;

/// Where the centre of mass lies, from the point that the vehicle file's positions refer to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CgOffset<T>(pub(super) [T; 4]);

impl<T: Real> Effect<T> for CgOffset<T> {
    const NAME: &'static str = "cg_offset";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("cg_x_m", 0.003, 0.012)
            .growing_with(Scale::Arm)
            .declared(Declared::RotorPlaces),
        EffectParameter::signed("cg_y_m", 0.003, 0.012)
            .growing_with(Scale::Arm)
            .declared(Declared::RotorPlaces),
        EffectParameter::signed("cg_z_m", 0.003, 0.012)
            .growing_with(Scale::Arm)
            .declared(Declared::RotorPlaces)
            .only_in(&["spatial"]),
        EffectParameter::form(&["planar", "spatial"]),
    ];
    const WORDS: Words = Words {
        what: "centre of mass",
        more: "The centre of mass is elsewhere",
        less: "The centre of mass is elsewhere",
        fly: "roll and pitch doublets, yaw steps and thrust steps in hover; and weigh the vehicle",
    };
    const SHOWN: Shown = Shown::MOMENTS.and(Shown::LASTING);
    const IS_OF_MOMENTS: bool = true;

    #[inline(always)]
    fn accelerometer_position(&self) -> In<Body, T> {
        In::new(-self.offset())
    }
}

impl<T: Real> CgOffset<T> {
    #[inline(always)]
    fn offset(&self) -> Vector3<T> {
        let [x, y, z, form] = self.0;
        Vector3::new(x, y, if is(form, SPATIAL) { z } else { T::zero() })
    }

    pub(super) fn prepare(&self, _vehicle: &Vehicle<T>) -> Numbers<T> {
        Numbers { offset_m: self.offset().into() }
    }
}

numbers! {
    /// Where the centre of mass lies.
    Numbers {
        /// From the point that the vehicle file's positions refer to, m.
        offset_m [3]
    }
}

impl<L: Lane> Acts<L> for Numbers<L> {
    #[inline(always)]
    fn wrench(&self, at: &Situation<'_, L>, _: Forms) -> BodyWrench<L> {
        BodyWrench::from_moment(minus(&[absent(); 3], &cross(&self.offset_m, &at.force)))
    }
}
