//! Thrust that is not along body z: `F_xy -= T (e_x, e_y)`.

use super::{Acts, Effect, EffectParameter, Forms, Shown, Situation, Tolerance, Words, absent};
use crate::aero::BodyWrench;
use crate::lane::Lane;
use crate::math::Real;
use crate::numbers;
use crate::vehicle::Vehicle;

/// Tilt of the thrust.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ThrustMisalignment<T>(pub(super) [T; 2]);

impl<T: Real> Effect<T> for ThrustMisalignment<T> {
    const NAME: &'static str = "thrust_misalignment";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("tilt_x_rad", 0.017, 0.07).within(Tolerance::RotorAxes),
        EffectParameter::signed("tilt_y_rad", 0.017, 0.07).within(Tolerance::RotorAxes),
    ];
    const WORDS: Words = Words {
        what: "tilted thrust",
        more: "Thrust is tilted",
        less: "Thrust is tilted",
        fly: "hover through a full turn of yaw and at two or more headings, then dash at two headings",
    };
    const SHOWN: Shown = Shown::LASTING.and(Shown::HORIZONTAL);
}

numbers! {
    /// Tilt of the thrust.
    Numbers {
        /// Towards -x and -y, rad.
        tilt [2]
    }
}

impl<T: Real> ThrustMisalignment<T> {
    pub(super) fn prepare(&self, _vehicle: &Vehicle<T>) -> Numbers<T> {
        Numbers { tilt: self.0 }
    }
}

impl<L: Lane> Acts<L> for Numbers<L> {
    #[inline(always)]
    fn wrench(&self, at: &Situation<'_, L>, _: Forms) -> BodyWrench<L> {
        let [x, y] = self.tilt;
        BodyWrench::from_force([
            absent::<L>() - at.thrust_n * x,
            absent::<L>() - at.thrust_n * y,
            absent(),
        ])
    }
}
