//! Axial inflow: `T <- T (1 + k w)`, `w` the airspeed along body z: air from below lifts, climbing
//! costs thrust.
//!
//! Form `quadratic`: `T (1 + k w + k_2 w |w|)`. Form `at_rotors`: the air at each hub takes of that
//! rotor's thrust, in proportion to its speed, `k` of the weight with all at hover; see
//! [`at_rotors`](super::at_rotors).

use super::{Acts, Declared, Effect, EffectParameter, Forms, Scale, Shown, Slopes, Words, is};
use crate::aero::Airflow;
use crate::lane::Lane;
use crate::lane::functions::size;
use crate::math::Real;
use crate::numbers;
use crate::vehicle::Vehicle;

const QUADRATIC: usize = 1;

/// Gain of thrust with speed along the rotor axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AxialInflow<T>(pub(super) [T; 3]);

impl<T: Real> Effect<T> for AxialInflow<T> {
    const NAME: &'static str = "axial_inflow";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("gain_s_per_m", 0.012, 0.06)
            .growing_with(Scale::PerTipSpeed)
            .declared(Declared::AxialInflow),
        EffectParameter::signed("quadratic_s2_per_m2", 4e-3, 0.03)
            .growing_with(Scale::PerTipSpeedSquared)
            .only_in(&["quadratic"]),
        EffectParameter::form(&["linear", "quadratic", "at_rotors"]),
    ];
    const WORDS: Words = Words {
        what: "inflow in climbs",
        more: "Climbing costs more thrust",
        less: "Climbing costs less thrust",
        fly: "climbs and descents of 3 m/s with heave doublets, wings folded",
    };
    const SHOWN: Shown = Shown::HORIZONTAL;
    const AT_ROTORS: Option<usize> = Some(2);

    fn at_rotors(&self, vehicle: &Vehicle<T>) -> Slopes<T> {
        let none = T::zero();
        Slopes { drag: [none, none, self.0[0] * vehicle.weight_n()], ..Slopes::none() }
    }

    fn is_declared(vehicle: &Vehicle<T>) -> bool {
        vehicle.parameters().propulsion.air.axial_inflow_s_per_m != T::zero()
    }
}

numbers! {
    /// Gain of thrust.
    Numbers {
        /// Over speed, s/m.
        gain,
        /// Over its square, s^2/m^2.
        quadratic
    }
}

impl<T: Real> AxialInflow<T> {
    pub(super) fn prepare(&self, vehicle: &Vehicle<T>) -> Numbers<T> {
        let [extra, quadratic, form] = self.0;
        let gain = vehicle.parameters().propulsion.air.axial_inflow_s_per_m + extra;
        Numbers { gain, quadratic: if is(form, QUADRATIC) { quadratic } else { T::zero() } }
    }
}

impl<L: Lane> Acts<L> for Numbers<L> {
    #[inline(always)]
    fn thrust_factor(&self, flow: &Airflow<L>, _height_m: L, _: Forms) -> L {
        let w = flow.velocity[2];
        L::of(1.0) + self.gain * w + self.quadratic * w * size(w)
    }
}
