//! Steady horizontal wind: the air-relative velocity becomes `v - (w_N, w_E, 0)`.

use super::{Effect, EffectParameter};
use crate::frames::{In, Ned};
use crate::math::Real;
use nalgebra::Vector3;

/// Wind velocity: where the air moves to, not where it comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConstantWind<T>([T; 2]);

impl<T: Real> Effect<T> for ConstantWind<T> {
    const NAME: &'static str = "constant_wind";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter { key: "wind_north_m_s", smallest: 1.5, largest: 6.0, signed: true },
        EffectParameter { key: "wind_east_m_s", smallest: 1.5, largest: 6.0, signed: true },
    ];
    fn absent() -> Self {
        Self([T::zero(); 2])
    }
    fn values(&mut self) -> &mut [T] {
        &mut self.0
    }
    #[inline(always)]
    fn wind(&self) -> In<Ned, T> {
        In::new(Vector3::new(self.0[0], self.0[1], T::zero()))
    }
}
