//! Gyroscopic and reaction torque of spinning rotors: `M -= I_r (H (w x e3) + H' e3)`, `H = -sum(s_i Omega_i)`.
//!
//! `s_i` is the rotor's `yaw_sign`, the sign of its reaction torque about +z, so it spins the other way: `I_r H e3` is the
//! angular momentum of all rotors in the body frame, and its rate there is taken from the airframe.

use super::{Effect, EffectParameter, Scale, Situation};
use crate::frames::{Body, In, Wrench};
use crate::math::Real;
use nalgebra::Vector3;

/// Inertia of one rotor with its motor's bell about the spin axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RotorGyroTorque<T>(pub(super) [T; 1]);

impl<T: Real> Effect<T> for RotorGyroTorque<T> {
    const NAME: &'static str = "rotor_gyro_torque";
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::size("rotor_inertia_kg_m2", 4e-6, 2e-5).growing_with(Scale::Inertia)];

    #[inline(always)]
    fn feels_rotor_spin(&self) -> bool {
        true
    }
    #[inline(always)]
    fn wrench(&self, situation: &Situation<'_, T>) -> Wrench<Body, T> {
        let [inertia] = self.0;
        let w = situation.air.omega.vector;
        let (spin, rate) = (situation.rotor_spin_rad_s, situation.rotor_spin_rate_rad_s2);
        let moment = Vector3::new(w.y * spin, -w.x * spin, rate) * -inertia;
        Wrench { force: In::zero(), moment: In::new(moment) }
    }
}
