//! Angular damping: `M -= k (p, q, r / 2)`.
//!
//! Form `quadratic`: `M -= k (|p| p, |q| q, |r| r / 2)`.

use super::{Acts, Effect, EffectParameter, Forms, Scale, Shown, Situation, Words, absent, is};
use crate::aero::BodyWrench;
use crate::lane::Lane;
use crate::lane::functions::size;
use crate::math::Real;
use crate::numbers;
use crate::vehicle::Vehicle;

const QUADRATIC: usize = 1;

/// Moment per angular rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AngularDamping<T>(pub(super) [T; 3]);

impl<T: Real> Effect<T> for AngularDamping<T> {
    const NAME: &'static str = "angular_damping";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::size("damping_n_m_s_per_rad", 4e-3, 0.03)
            .growing_with(Scale::Inertia)
            .only_in(&["linear"]),
        EffectParameter::size("damping_n_m_s2_per_rad2", 2e-3, 0.03)
            .growing_with(Scale::Inertia)
            .only_in(&["quadratic"]),
        EffectParameter::form(&["linear", "quadratic"]),
    ];
    const WORDS: Words = Words {
        what: "damping of rotation",
        more: "Air damps rotation more",
        less: "Air damps rotation less",
        fly: "a multisine from 0.3 to 6 Hz in roll and pitch",
    };
    // Drag and inflow of the rotors damp turning as well, and only a velocity tells them from it.
    const SHOWN: Shown = Shown::MOMENTS.and(Shown::HORIZONTAL);
    const IS_OF_MOMENTS: bool = true;
}

numbers! {
    /// Moment over angular rate and over its square; about z half of it.
    Numbers {
        /// N m s/rad.
        linear,
        /// N m s^2/rad^2.
        quadratic
    }
}

impl<T: Real> AngularDamping<T> {
    pub(super) fn prepare(&self, _vehicle: &Vehicle<T>) -> Numbers<T> {
        let [linear, quadratic, form] = self.0;
        if is(form, QUADRATIC) {
            Numbers { linear: T::zero(), quadratic }
        } else {
            Numbers { linear, quadratic: T::zero() }
        }
    }
}

impl<L: Lane> Acts<L> for Numbers<L> {
    #[inline(always)]
    fn wrench(&self, at: &Situation<'_, L>, _: Forms) -> BodyWrench<L> {
        let mut moment = at.flow.omega;
        for rate in &mut moment {
            *rate = absent::<L>() - (*rate * self.linear + *rate * size(*rate) * self.quadratic);
        }
        moment[2] = moment[2] * L::of(0.5);
        BodyWrench::from_moment(moment)
    }
}
