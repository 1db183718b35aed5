//! Centre of mass off the geometric centre: `M -= r x F`, with all forces of rotors, drag and wings, and `r = (x, y, 0)`, in
//! the form `spatial` `(x, y, z)`.
//!
//! The accelerometer stays at the geometric centre, at `-r` from the centre of mass, and feels the rotation there.

use super::{Effect, EffectParameter, Scale, Situation, is};
use crate::frames::{Body, In, Wrench};
use crate::math::Real;
use nalgebra::Vector3;

const SPATIAL: usize = 1;

/// Where the centre of mass lies, from the point that the vehicle file's positions refer to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CgOffset<T>(pub(super) [T; 4]);

impl<T: Real> Effect<T> for CgOffset<T> {
    const NAME: &'static str = "cg_offset";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("cg_x_m", 0.003, 0.012).growing_with(Scale::Arm),
        EffectParameter::signed("cg_y_m", 0.003, 0.012).growing_with(Scale::Arm),
        EffectParameter::signed("cg_z_m", 0.003, 0.012).growing_with(Scale::Arm).only_in(&["spatial"]),
        EffectParameter::form(&["planar", "spatial"]),
    ];

    #[inline(always)]
    fn accelerometer_position(&self) -> In<Body, T> {
        In::new(-self.offset())
    }
    #[inline(always)]
    fn wrench(&self, situation: &Situation<'_, T>) -> Wrench<Body, T> {
        let moment = -self.offset().cross(&situation.force.vector);
        Wrench { force: In::zero(), moment: In::new(moment) }
    }
}

impl<T: Real> CgOffset<T> {
    #[inline(always)]
    fn offset(&self) -> Vector3<T> {
        let [x, y, z, form] = self.0;
        Vector3::new(x, y, if is(form, SPATIAL) { z } else { T::zero() })
    }
}
