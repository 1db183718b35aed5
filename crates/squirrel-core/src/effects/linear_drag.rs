//! Rotor (induced, H-force) drag: `F_xy -= D (u, v)`, proportional to airspeed in the rotor plane.
//!
//! Form `anisotropic`: `F -= (D (1 + e) u, D (1 - e) v, D_z w)`, for rotors or an airframe longer
//! than wide (Svacha et al. 2017 identify such a drag matrix).
//!
//! Form `at_rotors`: each rotor's part acts at its hub and grows with its speed, `(D, D, D_z)` with
//! all at hover; see [`at_rotors`](super::at_rotors).

use super::{
    Acts, Declared, Effect, EffectParameter, Forms, Scale, Shown, Situation, Slopes, Words, absent,
    is,
};
use crate::aero::BodyWrench;
use crate::lane::Lane;
use crate::math::Real;
use crate::numbers;
use crate::vehicle::Vehicle;

const ANISOTROPIC: usize = 1;

/// Drag in the rotor plane on top of the vehicle's own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearDrag<T>(pub(super) [T; 4]);

impl<T: Real> Effect<T> for LinearDrag<T> {
    const NAME: &'static str = "linear_drag";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("extra_drag_n_s_per_m", 0.04, 0.25)
            .growing_with(Scale::Mass)
            .declared(Declared::LinearDrag(0)),
        EffectParameter::signed("anisotropy", 0.1, 0.5).only_in(&["anisotropic"]),
        EffectParameter::signed("extra_drag_z_n_s_per_m", 0.04, 0.25)
            .growing_with(Scale::Mass)
            .declared(Declared::LinearDrag(2))
            .only_in(&["anisotropic", "at_rotors"]),
        EffectParameter::form(&["isotropic", "anisotropic", "at_rotors"]),
    ];
    const WORDS: Words = Words {
        what: "drag that grows with speed",
        more: "More drag, growing with speed",
        less: "Less drag than the file has",
        fly: "dashes at several speeds from 2 to 9 m/s, both ways",
    };
    const SHOWN: Shown = Shown::LASTING.and(Shown::HORIZONTAL);
    const AT_ROTORS: Option<usize> = Some(2);

    fn at_rotors(&self, _vehicle: &Vehicle<T>) -> Slopes<T> {
        let [drag, _, drag_z, _] = self.0;
        Slopes { drag: [drag, drag, drag_z], ..Slopes::none() }
    }
}

numbers! {
    /// Drag over speed, N s/m.
    Numbers {
        /// Along each axis.
        slope [3]
    }
}

impl<T: Real> LinearDrag<T> {
    pub(super) fn prepare(&self, _vehicle: &Vehicle<T>) -> Numbers<T> {
        let [drag, anisotropy, drag_z, form] = self.0;
        Numbers {
            slope: if is(form, ANISOTROPIC) {
                [drag * (T::one() + anisotropy), drag * (T::one() - anisotropy), drag_z]
            } else {
                [drag, drag, T::zero()]
            },
        }
    }
}

impl<L: Lane> Acts<L> for Numbers<L> {
    #[inline(always)]
    fn wrench(&self, at: &Situation<'_, L>, _: Forms) -> BodyWrench<L> {
        let ([x, y, z], [u, v, w]) = (self.slope, at.flow.velocity);
        BodyWrench::from_force([
            absent::<L>() - x * u,
            absent::<L>() - y * v,
            absent::<L>() - z * w,
        ])
    }
}
