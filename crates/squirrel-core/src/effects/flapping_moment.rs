//! Blade flapping: `M_x -= k v`, `M_y += k u`: the rotor disc tilts back in forward flight.
//!
//! Form `saturating`: the velocity is divided by `1 + V_h / scale`, `V_h` the airspeed in the rotor
//! plane. Form `at_rotors`: each rotor's part grows with its speed and with the velocity of its hub
//! through the air, `k` with all at hover; see [`at_rotors`](super::at_rotors).

use super::{
    Acts, Declared, Effect, EffectParameter, Forms, Mimic, Scale, Shown, Situation, Slopes, Words,
    absent, is,
};
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
        EffectParameter::signed("gain_n_m_s_per_m", 1e-3, 6e-3)
            .growing_with(Scale::MassTimesArm)
            .declared(Declared::FlappingMoment),
        EffectParameter::size("speed_scale_m_s", 3.0, 20.0).only_in(&["saturating"]),
        EffectParameter::form(&["linear", "saturating", "at_rotors"]),
    ];
    const WORDS: Words = Words {
        what: "blade flapping",
        more: "Forward flight pitches the nose up more",
        less: "Forward flight pitches the nose up less",
        fly: "dashes at several speeds from 2 to 9 m/s, both ways",
    };
    const SHOWN: Shown = Shown::MOMENTS.and(Shown::LASTING);
    const IS_OF_MOMENTS: bool = true;
    const MIMIC: Mimic = Mimic::DragElsewhere;
    const AT_ROTORS: Option<usize> = Some(2);

    fn at_rotors(&self, _vehicle: &Vehicle<T>) -> Slopes<T> {
        Slopes { flapping: self.0[0], ..Slopes::none() }
    }

    fn is_declared(vehicle: &Vehicle<T>) -> bool {
        vehicle.parameters().propulsion.air.flapping_moment_n_m_s_per_m != T::zero()
    }
}

numbers! {
    /// Moment over speed.
    Numbers {
        /// N m s/m.
        gain,
        /// What saturates of it, likewise.
        saturating,
        /// Over the speed at which it saturates, s/m; 0 for a gain that stays.
        per_scale
    }
}

impl<T: Real> FlappingMoment<T> {
    pub(super) fn prepare(&self, vehicle: &Vehicle<T>) -> Numbers<T> {
        let [extra, scale, form] = self.0;
        let (gain, none) =
            (vehicle.parameters().propulsion.air.flapping_moment_n_m_s_per_m, T::zero());
        if !is(form, SATURATING) {
            return Numbers { gain: gain + extra, saturating: none, per_scale: none };
        }
        // A scale of 0 saturates at once.
        if scale > none {
            Numbers { gain, saturating: extra, per_scale: T::one() / scale }
        } else {
            Numbers { gain, saturating: none, per_scale: none }
        }
    }
}

impl<L: Lane> Acts<L> for Numbers<L> {
    #[inline(always)]
    fn wrench(&self, at: &Situation<'_, L>, forms: Forms) -> BodyWrench<L> {
        let [u, v, _] = at.flow.velocity;
        let mut slope = self.gain;
        if forms.has(SATURATING) {
            slope =
                slope + self.saturating / (L::of(1.0) + (u * u + v * v).root() * self.per_scale);
        }
        BodyWrench::from_moment([absent::<L>() - v * slope, u * slope, absent()])
    }
}
