//! Ground effect (Cheeseman and Bennett 1955, with an effective radius):
//! `T <- T / (1 - R^2 / (16 h^2))`.
//!
//! `h` is the height above the origin's level, not below `R / 2`. Form `exponential`:
//! `T <- T (1 + g exp(-h / R))`, as fitted to multirotors, with `h` not below 0.

use super::{
    Acts, Effect, EffectParameter, Fitted, Forms, Response, Scale, Shown, Tolerance, Words, is,
};
use crate::aero::Airflow;
use crate::lane::Lane;
use crate::lane::functions::exp;
use crate::math::{Real, real};
use crate::numbers;
use crate::vehicle::Vehicle;

const CHEESEMAN_BENNETT: usize = 0;
const EXPONENTIAL: usize = 1;

/// Effective radius of the rotors together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct GroundEffect<T>(pub(super) [T; 3]);

impl<T: Real> Effect<T> for GroundEffect<T> {
    const NAME: &'static str = "ground_effect";
    const FORMS_APART: bool = true;
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::size("effective_radius_m", 0.25, 0.55)
            .growing_with(Scale::Arm)
            .within(Tolerance::Nothing)
            .capped(),
        EffectParameter::size("gain", 0.1, 0.5).only_in(&["exponential"]),
        EffectParameter::form(&["cheeseman_bennett", "exponential"]),
    ];
    const WORDS: Words = Words {
        what: "lift near the ground",
        more: "More lift near the ground",
        less: "Less lift near the ground",
        fly: "a ladder of hovers from 0.2 to 1.5 m above the ground, with a range finder if there is one",
    };
    const SHOWN: Shown = Shown::HEIGHT;
    const RESPONSE: Response = Response::StartsFlat;
    const FITTED: Fitted = Fitted::Never;
    const FEELS_HEIGHT: bool = true;
}

numbers! {
    /// Of either form; those of the other make no difference.
    Numbers {
        /// `R`, m.
        radius_m,
        /// Lowest height that counts, m.
        floor_m,
        /// Of the exponential.
        gain,
        /// `1 / R` of the exponential, 1/m.
        per_radius
    }
}

impl<T: Real> GroundEffect<T> {
    pub(super) fn prepare(&self, _vehicle: &Vehicle<T>) -> Numbers<T> {
        let [radius_m, gain, form] = self.0;
        let none = Numbers { floor_m: T::one(), ..Numbers::all(T::zero()) };
        if !(radius_m > T::zero()) {
            return none;
        }
        if is(form, EXPONENTIAL) {
            return Numbers { gain, per_radius: T::one() / radius_m, ..none };
        }
        Numbers { radius_m, floor_m: radius_m * real(0.5), ..none }
    }
}

impl<L: Lane> Acts<L> for Numbers<L> {
    #[inline(always)]
    fn thrust_factor(&self, _flow: &Airflow<L>, height_m: L, forms: Forms) -> L {
        let one = L::of(1.0);
        let mut factor = one;
        if forms.has(CHEESEMAN_BENNETT) {
            let ratio = self.radius_m / height_m.upper(self.floor_m);
            factor = one / (one - ratio * ratio * L::of(1.0 / 16.0));
        }
        if forms.has(EXPONENTIAL) {
            let radii = height_m.upper(L::of(0.0)) * self.per_radius;
            factor = factor * (one + self.gain * exp(L::of(0.0) - radii));
        }
        factor
    }
}
