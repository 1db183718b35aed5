//! Steady horizontal wind: the air-relative velocity becomes `v - (w_N, w_E, 0)`.

use super::{Effect, EffectParameter};
use crate::frames::{In, Ned};
use crate::math::Real;
use nalgebra::Vector3;

/// Wind velocity: where the air moves to, not where it comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConstantWind<T>(pub(super) [T; 2]);

impl<T: Real> Effect<T> for ConstantWind<T> {
    const NAME: &'static str = "constant_wind";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("wind_north_m_s", 1.5, 6.0),
        EffectParameter::signed("wind_east_m_s", 1.5, 6.0),
    ];

    #[inline(always)]
    fn wind(&self) -> In<Ned, T> {
        In::new(Vector3::new(self.0[0], self.0[1], T::zero()))
    }
}
