//! What moves, as one vector space, and Heun's rule over it.

use crate::airframe::MAX_ROTORS;
use nalgebra::{Matrix3, Quaternion, SVector, UnitQuaternion, Vector2, Vector3, Vector4};

/// Rigid body, rotors, wings, payload, and the memory of what no catalogue has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct State {
    pub(super) position: Vector3<f64>,
    pub(super) velocity: Vector3<f64>,
    /// `ned_from_body`.
    pub(super) attitude: Quaternion<f64>,
    pub(super) omega: Vector3<f64>,
    pub(super) rotors: SVector<f64, MAX_ROTORS>,
    pub(super) deployment: Vector2<f64>,
    /// Payload: north, east of its rest, and their rates.
    pub(super) swing: Vector4<f64>,
    pub(super) memory: Vector4<f64>,
}

impl State {
    pub(super) fn plus(&self, h: f64, rate: &Self) -> Self {
        Self {
            position: self.position + h * rate.position,
            velocity: self.velocity + h * rate.velocity,
            attitude: self.attitude + rate.attitude * h,
            omega: self.omega + h * rate.omega,
            rotors: self.rotors + h * rate.rotors,
            deployment: self.deployment + h * rate.deployment,
            swing: self.swing + h * rate.swing,
            memory: self.memory + h * rate.memory,
        }
    }

    /// One step of Heun's rule: the mean of the rates here and at the end of an Euler step.
    pub(super) fn heun(&self, h: f64, rate: impl Fn(&Self, f64) -> Self) -> Self {
        let first = rate(self, 0.0);
        let second = rate(&self.plus(h, &first), h);
        let mut next = self.plus(0.5 * h, &first).plus(0.5 * h, &second);
        next.attitude = UnitQuaternion::new_normalize(next.attitude).into_inner();
        next
    }

    /// Rotation from body to NED.
    pub(super) fn ned_from_body(&self) -> Matrix3<f64> {
        UnitQuaternion::new_normalize(self.attitude).to_rotation_matrix().into_inner()
    }

    /// Rate of the attitude under the angular rate.
    pub(super) fn attitude_rate(&self) -> Quaternion<f64> {
        self.attitude * Quaternion::from_imag(self.omega) * 0.5
    }
}
