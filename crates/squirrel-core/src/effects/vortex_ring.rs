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

use super::{Acts, Declared, Effect, EffectParameter, Forms, Shown, Words, is};
use crate::aero::{Airflow, induced};
use crate::lane::Lane;
use crate::math::Real;
use crate::numbers;
use crate::vehicle::Vehicle;

const EARLY: usize = 1;

/// Part of the thrust that is lost at worst.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct VortexRing<T>(pub(super) [T; 2]);

impl<T: Real> Effect<T> for VortexRing<T> {
    const NAME: &'static str = "vortex_ring";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("gain", 0.05, 0.3).declared(Declared::VortexRing),
        EffectParameter::form(&["classic", "early"]),
    ];
    const WORDS: Words = Words {
        what: "sinking into the own wake",
        more: "Rotors lift less when they sink into their own wake",
        less: "Rotors lift more when they sink into their own wake",
        fly: "straight descents of 4 to 10 m/s, a second each, wings folded, high above the ground",
    };
    const SHOWN: Shown = Shown::NOTHING;
    const IS_OF_A_STATE: bool = true;

    fn is_declared(vehicle: &Vehicle<T>) -> bool {
        vehicle.parameters().propulsion.air.vortex_ring_fraction != T::zero()
    }
}

numbers! {
    /// Where and how much.
    Numbers {
        /// Part of the thrust that is lost at worst.
        gain,
        /// The same of a ring that comes early.
        early,
        /// `1 / v_h`, s/m.
        per_hover
    }
}

impl<T: Real> VortexRing<T> {
    pub(super) fn prepare(&self, vehicle: &Vehicle<T>) -> Numbers<T> {
        let [extra, form] = self.0;
        let own = vehicle.parameters().propulsion.air.vortex_ring_fraction;
        let [gain, early] = if is(form, EARLY) { [own, extra] } else { [own + extra, T::zero()] };
        Numbers { gain, early, per_hover: T::one() / induced::in_hover(vehicle) }
    }
}

/// 1 at `middle`, 0 beyond `width` of it.
#[inline(always)]
fn bump<L: Lane>(x: L, [middle, width]: [f64; 2]) -> L {
    let off = (x - L::of(middle)) * L::of(1.0 / width);
    let inside = (L::of(1.0) - off * off).upper(L::of(0.0));
    inside * inside
}

impl<L: Lane> Acts<L> for Numbers<L> {
    #[inline(always)]
    fn thrust_factor(&self, flow: &Airflow<L>, _height_m: L, forms: Forms) -> L {
        let ([u, v, w], one) = (flow.velocity, L::of(1.0));
        let sinking = w * self.per_hover;
        let mut lost = self.gain * bump(sinking, [1.25, 0.6]);
        if forms.has(EARLY) {
            lost = lost + self.early * bump(sinking, [1.0, 0.7]);
        }
        let across = (u * u + v * v) * self.per_hover * self.per_hover;
        one - lost * (one - across).upper(L::of(0.0))
    }
}
