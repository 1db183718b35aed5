//! Steady horizontal wind: the air-relative velocity becomes `v - (w_N, w_E, 0)`.
//!
//! Form `log_profile`: the wind is that at 10 m, times `ln(h / z0) / ln(10 / z0)` at the height `h` (logarithmic law of the
//! surface layer, Stull 1988), with `h` not below `2 z0`. Roughness acts up to 4 m, beyond which the law means nothing.

use super::{Effect, EffectParameter, is};
use crate::frames::{In, Ned};
use crate::math::{Real, lower, real, upper};
use nalgebra::Vector3;

const LOG_PROFILE: usize = 1;

/// Wind velocity: where the air moves to, not where it comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConstantWind<T>(pub(super) [T; 4]);

impl<T: Real> Effect<T> for ConstantWind<T> {
    const NAME: &'static str = "constant_wind";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("wind_north_m_s", 1.5, 6.0),
        EffectParameter::signed("wind_east_m_s", 1.5, 6.0),
        EffectParameter::size("roughness_m", 0.01, 0.5).only_in(&["log_profile"]),
        EffectParameter::form(&["constant", "log_profile"]),
    ];

    #[inline(always)]
    fn wind(&self, height_m: T) -> In<Ned, T> {
        let [north, east, roughness_m, form] = self.0;
        let mut factor = T::one();
        if is(form, LOG_PROFILE) && roughness_m > T::zero() {
            let z0 = lower(roughness_m, real(4.0));
            let height = upper(height_m, z0 * real(2.0));
            factor = (height / z0).ln() / (real::<T>(10.0) / z0).ln();
        }
        In::new(Vector3::new(north, east, T::zero()) * factor)
    }
}
