//! Rotor (induced, H-force) drag: `F_xy -= D (u, v)`, proportional to airspeed in the rotor plane.
//!
//! Form `anisotropic`: `F -= (D (1 + e) u, D (1 - e) v, D_z w)`, for rotors or an airframe longer than wide (Svacha et al.
//! 2017 identify such a drag matrix).

use super::{Effect, EffectParameter, Scale, Situation, is};
use crate::frames::{Body, In, Wrench};
use crate::math::Real;
use nalgebra::Vector3;

const ANISOTROPIC: usize = 1;

/// Drag in the rotor plane on top of the vehicle's own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearDrag<T>(pub(super) [T; 4]);

impl<T: Real> Effect<T> for LinearDrag<T> {
    const NAME: &'static str = "linear_drag";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("extra_drag_n_s_per_m", 0.04, 0.25).growing_with(Scale::Mass),
        EffectParameter::signed("anisotropy", 0.1, 0.5).only_in(&["anisotropic"]),
        EffectParameter::signed("extra_drag_z_n_s_per_m", 0.04, 0.25)
            .growing_with(Scale::Mass)
            .only_in(&["anisotropic"]),
        EffectParameter::form(&["isotropic", "anisotropic"]),
    ];

    #[inline(always)]
    fn wrench(&self, situation: &Situation<'_, T>) -> Wrench<Body, T> {
        let [drag, anisotropy, drag_z, form] = self.0;
        let v = situation.air.velocity.vector;
        let slope = if is(form, ANISOTROPIC) {
            Vector3::new(drag * (T::one() + anisotropy), drag * (T::one() - anisotropy), drag_z)
        } else {
            Vector3::new(drag, drag, T::zero())
        };
        Wrench::from_force(In::new(-slope.component_mul(&v)))
    }
}
