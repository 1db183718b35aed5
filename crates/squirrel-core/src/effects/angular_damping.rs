//! Angular damping: `M -= k (p, q, r / 2)`.
//!
//! Form `quadratic`: `M -= k (|p| p, |q| q, |r| r / 2)`.

use super::{Effect, EffectParameter, Scale, Situation, is};
use crate::frames::{Body, In, Wrench};
use crate::math::{Real, real};
use nalgebra::Vector3;

const QUADRATIC: usize = 1;

/// Moment per angular rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AngularDamping<T>(pub(super) [T; 3]);

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

    #[inline(always)]
    fn wrench(&self, situation: &Situation<'_, T>) -> Wrench<Body, T> {
        let [linear, quadratic, form] = self.0;
        let w = situation.air.omega.vector;
        let damped = if is(form, QUADRATIC) { w.component_mul(&w.abs()) * quadratic } else { w * linear };
        let moment = -Vector3::new(damped.x, damped.y, damped.z * real(0.5));
        Wrench { force: In::zero(), moment: In::new(moment) }
    }
}
