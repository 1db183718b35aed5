//! Vortex ring: a rotor that sinks into its own wake lifts less, `T <- T (1 - k s f)`.
//!
//! ```text
//! x = w / v_h          descent through the air over the induced speed in hover
//! s = (1 - ((x - 1.25) / 0.6)^2)^2 within 0.65 < x < 1.85, else 0
//! f = 1 - V_a^2 / v_h^2, not below 0: flight across the rotors carries the ring away
//! ```
//! Propellers of 4 to 6 inch lose most at 1.2 to 1.3 `v_h` (Veismann, Dougherty and Gharib, Flow
//! 2023); computed flow of a quadrotor loses 11 to 20 % of its mean thrust, from 0.65 `v_h` on. The
//! thrust's unrest, as large as the loss, is not in here. Form `early`: the deepest loss at `x = 1`,
//! within 0.3 to 1.7, the bounds of helicopters (Leishman, Principles of Helicopter Aerodynamics, ch.
//! 2).

use super::{Acts, Effect, EffectParameter, Forms, Shown, Words, is};
use crate::aero::Airflow;
use crate::lane::Lane;
use crate::math::{Real, real};
use crate::numbers;
use crate::vehicle::Vehicle;

const EARLY: usize = 1;

/// Part of the thrust that is lost at worst.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct VortexRing<T>(pub(super) [T; 2]);

impl<T: Real> Effect<T> for VortexRing<T> {
    const NAME: &'static str = "vortex_ring";
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::signed("gain", 0.05, 0.3), EffectParameter::form(&["classic", "early"])];
    const WORDS: Words = Words {
        what: "sinking into the own wake",
        more: "Rotors lift less when they sink into their own wake",
        less: "Rotors lift more when they sink into their own wake",
        fly: "straight descents of 4 to 10 m/s, a second each, wings folded, high above the ground",
    };
    const SHOWN: Shown = Shown::NOTHING;
}

numbers! {
    /// Where and how much.
    Numbers {
        /// Part of the thrust that is lost at worst.
        gain,
        /// `1 / v_h`, s/m.
        per_hover,
        /// `x` of the worst.
        middle,
        /// `1 /` half the width in `x`.
        per_width
    }
}

impl<T: Real> VortexRing<T> {
    pub(super) fn prepare(&self, vehicle: &Vehicle<T>) -> Numbers<T> {
        let [gain, form] = self.0;
        let [middle, width] = if is(form, EARLY) { [1.0, 0.7] } else { [1.25, 0.6] };
        Numbers {
            gain,
            per_hover: T::one() / vehicle.hover_induced_speed_m_s(),
            middle: real(middle),
            per_width: real(1.0 / width),
        }
    }
}

impl<L: Lane> Acts<L> for Numbers<L> {
    #[inline(always)]
    fn thrust_factor(&self, flow: &Airflow<L>, _height_m: L, _: Forms) -> L {
        let ([u, v, w], one, none) = (flow.velocity, L::of(1.0), L::of(0.0));
        let off = (w * self.per_hover - self.middle) * self.per_width;
        let bump = (one - off * off).upper(none);
        let across = (u * u + v * v) * self.per_hover * self.per_hover;
        one - self.gain * bump * bump * (one - across).upper(none)
    }
}
