//! Steady horizontal wind: the air-relative velocity becomes `v - (w_N, w_E, 0)`.
//!
//! Form `log_profile`: the wind is that at 10 m, times `ln(h / z0) / ln(10 / z0)` at the height `h`
//! (logarithmic law of the surface layer, Stull 1988), with `h` not below `2 z0`. Roughness acts up
//! to 4 m, beyond which the law means nothing.

use super::{Acts, Effect, EffectParameter, Fitted, Forms, Mimic, Shown, Tolerance, Words, is};
use crate::lane::Lane;
use crate::lane::functions::ln;
use crate::math::{Real, lower, real};
use crate::numbers;
use crate::vehicle::Vehicle;

const LOG_PROFILE: usize = 1;

/// Wind that a calm day may have, m/s.
const WIND_M_S: f64 = 0.12;

/// Wind velocity: where the air moves to, not where it comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConstantWind<T>(pub(super) [T; 4]);

impl<T: Real> Effect<T> for ConstantWind<T> {
    const NAME: &'static str = "constant_wind";
    const FORMS_APART: bool = true;
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("wind_north_m_s", 1.5, 6.0).within(Tolerance::Usual(WIND_M_S)),
        EffectParameter::signed("wind_east_m_s", 1.5, 6.0).within(Tolerance::Usual(WIND_M_S)),
        EffectParameter::size("roughness_m", 0.01, 0.5).only_in(&["log_profile"]),
        EffectParameter::form(&["constant", "log_profile"]),
    ];
    const WORDS: Words = Words {
        what: "steady wind",
        more: "A steady wind",
        less: "A steady wind",
        fly: "hover through a full turn of yaw and at two or more headings, then dash at two headings",
    };
    const SHOWN: Shown = Shown::LASTING.and(Shown::HORIZONTAL);
    const FITTED: Fitted = Fitted::Never;
    const MIMIC: Mimic = Mimic::Gusts;
}

numbers! {
    /// The wind, and its profile over the height.
    Numbers {
        /// North and east, m/s.
        wind [2],
        /// Factor of the wind: the first, and the second times `ln(max(h, floor) / z0)`.
        profile [2],
        /// `2 z0`, m.
        floor_m,
        /// `1 / z0`, 1/m.
        per_roughness
    }
}

impl<T: Real> ConstantWind<T> {
    pub(super) fn prepare(&self, _vehicle: &Vehicle<T>) -> Numbers<T> {
        let [north, east, roughness_m, form] = self.0;
        let (one, wind) = (T::one(), [north, east]);
        if is(form, LOG_PROFILE) && roughness_m > T::zero() {
            let z0 = lower(roughness_m, real(4.0));
            let profile = [T::zero(), one / (real::<T>(10.0) / z0).ln()];
            return Numbers { wind, profile, floor_m: z0 * real(2.0), per_roughness: one / z0 };
        }
        Numbers { wind, profile: [one, T::zero()], floor_m: one, per_roughness: one }
    }
}

impl<L: Lane> Acts<L> for Numbers<L> {
    const BLOWS: bool = true;

    #[inline(always)]
    fn wind(&self, height_m: L, forms: Forms) -> [L; 2] {
        let [mut factor, slope] = self.profile;
        if forms.has(LOG_PROFILE) {
            factor = factor + slope * ln(height_m.upper(self.floor_m) * self.per_roughness);
        }
        [self.wind[0] * factor, self.wind[1] * factor]
    }
}
