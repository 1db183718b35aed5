//! Blade flapping: `M_x -= k v`, `M_y += k u`: the rotor disc tilts back in forward flight.
//!
//! Form `saturating`: the velocity is divided by `1 + V_h / scale`, `V_h` the airspeed in the rotor
//! plane.

use super::{Acts, Effect, EffectParameter, Forms, Scale, Shown, Situation, Words, absent, is};
use crate::aero::BodyWrench;
use crate::lane::Lane;
use crate::math::Real;
use crate::numbers;
use crate::vehicle::Vehicle;

const SATURATING: usize = 1;

/// Moment per speed across the rotors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FlappingMoment<T>(pub(super) [T; 3]);

impl<T: Real> Effect<T> for FlappingMoment<T> {
    const NAME: &'static str = "flapping_moment";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("gain_n_m_s_per_m", 1e-3, 6e-3).growing_with(Scale::MassTimesArm),
        EffectParameter::size("speed_scale_m_s", 3.0, 20.0).only_in(&["saturating"]),
        EffectParameter::form(&["linear", "saturating"]),
    ];
    const WORDS: Words = Words {
        what: "blade flapping",
        more: "Forward flight pitches the nose up more",
        less: "Forward flight pitches the nose up less",
        fly: "dashes at several speeds from 2 to 9 m/s, both ways",
    };
    const SHOWN: Shown = Shown::MOMENTS.and(Shown::LASTING);
    const IS_OF_MOMENTS: bool = true;
}

numbers! {
    /// Moment over speed.
    Numbers {
        /// N m s/m.
        gain,
        /// Over the speed at which it saturates, s/m; 0 for a gain that stays.
        per_scale
    }
}

impl<T: Real> FlappingMoment<T> {
    pub(super) fn prepare(&self, _vehicle: &Vehicle<T>) -> Numbers<T> {
        let [gain, scale, form] = self.0;
        if !is(form, SATURATING) {
            return Numbers { gain, per_scale: T::zero() };
        }
        // A scale of 0 saturates at once.
        if scale > T::zero() {
            Numbers { gain, per_scale: T::one() / scale }
        } else {
            Numbers::all(T::zero())
        }
    }
}

impl<L: Lane> Acts<L> for Numbers<L> {
    #[inline(always)]
    fn wrench(&self, at: &Situation<'_, L>, forms: Forms) -> BodyWrench<L> {
        let [u, v, _] = at.flow.velocity;
        let mut slope = self.gain;
        if forms.has(SATURATING) {
            slope = slope / (L::of(1.0) + (u * u + v * v).root() * self.per_scale);
        }
        BodyWrench::from_moment([absent::<L>() - v * slope, u * slope, absent()])
    }
}
