//! Axial inflow: `T <- T (1 + k w)`, `w` the airspeed along body z: air from below lifts, climbing
//! costs thrust.
//!
//! Form `quadratic`: `T (1 + k w + k_2 w |w|)`. Form `at_rotors`: the air at each hub takes of that
//! rotor's thrust, in proportion to its speed, `k` of the weight with all at hover; see
//! [`at_rotors`].

use super::{
    Acts, Declared, Effect, EffectParameter, Forms, Shown, Situation, Words, absent, at_rotors, is,
};
use crate::aero::{Airflow, BodyWrench};
use crate::lane::Lane;
use crate::lane::functions::size;
use crate::math::Real;
use crate::numbers;
use crate::vehicle::{MAX_ROTORS, Vehicle};

const QUADRATIC: usize = 1;
const AT_ROTORS: usize = 2;

/// Gain of thrust with speed along the rotor axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AxialInflow<T>(pub(super) [T; 3]);

impl<T: Real> Effect<T> for AxialInflow<T> {
    const NAME: &'static str = "axial_inflow";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("gain_s_per_m", 0.012, 0.06).declared(Declared::AxialInflow),
        EffectParameter::signed("quadratic_s2_per_m2", 4e-3, 0.03).only_in(&["quadratic"]),
        EffectParameter::form(&["linear", "quadratic", "at_rotors"]),
    ];
    const WORDS: Words = Words {
        what: "inflow in climbs",
        more: "Climbing costs more thrust",
        less: "Climbing costs less thrust",
        fly: "climbs and descents of 3 m/s with heave doublets, wings folded",
    };
    const SHOWN: Shown = Shown::HORIZONTAL;

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
        quadratic,
        /// Of each rotor over its speed, along each axis, N s^2/(m rad).
        per_rotor [3],
        /// Where the hubs are, m.
        hub_m [MAX_ROTORS] [3]
    }
}

impl<T: Real> AxialInflow<T> {
    pub(super) fn prepare(&self, vehicle: &Vehicle<T>) -> Numbers<T> {
        let ([extra, quadratic, form], none) = (self.0, T::zero());
        let own = vehicle.parameters().propulsion.air.axial_inflow_s_per_m;
        let mut out = Numbers::all(none);
        if is(form, AT_ROTORS) {
            let each = extra * vehicle.weight_n() * at_rotors::per_hover(vehicle);
            (out.per_rotor, out.hub_m) = ([none, none, each], at_rotors::hubs(vehicle));
            out.gain = own;
            return out;
        }
        out.gain = own + extra;
        if is(form, QUADRATIC) {
            out.quadratic = quadratic;
        }
        out
    }
}

impl<L: Lane> Acts<L> for Numbers<L> {
    #[inline(always)]
    fn thrust_factor(&self, flow: &Airflow<L>, _height_m: L, _: Forms) -> L {
        let w = flow.velocity[2];
        L::of(1.0) + self.gain * w + self.quadratic * w * size(w)
    }
    #[inline(always)]
    fn wrench(&self, at: &Situation<'_, L>, forms: Forms) -> BodyWrench<L> {
        if forms.has(AT_ROTORS) {
            return at_rotors::drag(at, &self.hub_m, &self.per_rotor);
        }
        BodyWrench::from_force([absent(); 3])
    }
}
