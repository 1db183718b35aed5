//! Blade flapping: `M_x -= k v`, `M_y += k u`: the rotor disc tilts back in forward flight.
//!
//! Form `saturating`: the velocity is divided by `1 + V_h / scale`, `V_h` the airspeed in the rotor
//! plane. Form `at_rotors`: each rotor's part grows with its speed and with the velocity of its hub
//! through the air, `k` with all at hover; see [`at_rotors`].

use super::{
    Acts, Declared, Effect, EffectParameter, Forms, Scale, Shown, Situation, Words, absent,
    at_rotors, is,
};
use crate::aero::BodyWrench;
use crate::lane::Lane;
use crate::math::Real;
use crate::numbers;
use crate::vehicle::{MAX_ROTORS, Vehicle};

const SATURATING: usize = 1;
const AT_ROTORS: usize = 2;

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
        per_scale,
        /// Of each rotor over its speed, N m s^2/(m rad).
        per_rotor,
        /// Where the hubs are, m.
        hub_m [MAX_ROTORS] [3]
    }
}

impl<T: Real> FlappingMoment<T> {
    pub(super) fn prepare(&self, vehicle: &Vehicle<T>) -> Numbers<T> {
        let [extra, scale, form] = self.0;
        let mut out = Numbers::all(T::zero());
        out.gain = vehicle.parameters().propulsion.air.flapping_moment_n_m_s_per_m;
        if is(form, SATURATING) {
            // A scale of 0 saturates at once.
            if scale > T::zero() {
                (out.saturating, out.per_scale) = (extra, T::one() / scale);
            }
        } else if is(form, AT_ROTORS) {
            out.per_rotor = extra * at_rotors::per_hover(vehicle);
            out.hub_m = at_rotors::hubs(vehicle);
        } else {
            out.gain += extra;
        }
        out
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
        let out = BodyWrench::from_moment([absent::<L>() - v * slope, u * slope, absent()]);
        if forms.has(AT_ROTORS) {
            return out.plus(&at_rotors::wrench(at, &self.hub_m, |speed, [u, v, _]| {
                let slope = self.per_rotor * speed;
                BodyWrench::from_moment([absent::<L>() - v * slope, u * slope, absent()])
            }));
        }
        out
    }
}
