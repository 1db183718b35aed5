//! Axial inflow: `T <- T (1 + k w)`, `w` the airspeed along body z: air from below lifts, climbing costs thrust.
//!
//! Form `quadratic`: `T (1 + k w + k_2 w |w|)`.

use super::{Effect, EffectParameter, is};
use crate::aero::Air;
use crate::math::Real;

const QUADRATIC: usize = 1;

/// Gain of thrust with speed along the rotor axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxialInflow<T>(pub(super) [T; 3]);

impl<T: Real> Effect<T> for AxialInflow<T> {
    const NAME: &'static str = "axial_inflow";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("gain_s_per_m", 0.012, 0.06),
        EffectParameter::signed("quadratic_s2_per_m2", 4e-3, 0.03).only_in(&["quadratic"]),
        EffectParameter::form(&["linear", "quadratic"]),
    ];

    #[inline(always)]
    fn thrust_factor(&self, air: &Air<T>, _height_m: T) -> T {
        let [gain, quadratic, form] = self.0;
        let w = air.velocity.vector.z;
        let factor = T::one() + gain * w;
        if is(form, QUADRATIC) { factor + quadratic * w * w.abs() } else { factor }
    }
}
