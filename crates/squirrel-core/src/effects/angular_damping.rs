//! Angular damping: `M -= k (p, q, r / 2)`.

use super::{Effect, EffectParameter, Situation};
use crate::frames::{Body, In, Wrench};
use crate::math::{Real, real};
use nalgebra::Vector3;

/// Moment per angular rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AngularDamping<T>(pub(super) [T; 1]);

impl<T: Real> Effect<T> for AngularDamping<T> {
    const NAME: &'static str = "angular_damping";
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::size("damping_n_m_s_per_rad", 4e-3, 0.03)];

    #[inline(always)]
    fn wrench(&self, situation: &Situation<'_, T>) -> Wrench<Body, T> {
        let w = situation.air.omega.vector;
        let moment = Vector3::new(w.x, w.y, w.z * real(0.5)) * -self.0[0];
        Wrench { force: In::zero(), moment: In::new(moment) }
    }
}
