//! The rigid-body state with its rotor speeds.

use super::{VectorSpace, body};
use crate::frames::{Body, In, Ned, Rotation};
use crate::lane::vector;
use crate::math::Real;
use crate::vehicle::{MAX_ROTORS, PerRotor};
use nalgebra::{Quaternion, UnitQuaternion};

/// Position, velocity, attitude, angular rate and rotor speeds; as a rate, the derivative of each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State<T: Real> {
    /// Position of the centre of mass, m.
    pub position: In<Ned, T>,
    /// Velocity over ground, m/s.
    pub velocity: In<Ned, T>,
    /// Hamilton quaternion, body to NED; unit up to integration error, which [`Self::normalised`]
    /// removes.
    pub attitude: Quaternion<T>,
    /// Angular rate, rad/s.
    pub omega: In<Body, T>,
    /// Rotor speeds, rad/s; places without a rotor are 0.
    pub rotor_speed_rad_s: PerRotor<T>,
}

impl<T: Real> State<T> {
    /// At the origin, level, facing north, rotors stopped.
    pub fn at_rest() -> Self {
        Self {
            position: In::zero(),
            velocity: In::zero(),
            attitude: Quaternion::identity(),
            omega: In::zero(),
            rotor_speed_rad_s: [T::zero(); MAX_ROTORS],
        }
    }
    /// The rotation of the body frame; the quaternion is taken as unit.
    #[inline(always)]
    pub fn ned_from_body(&self) -> Rotation<Ned, Body, T> {
        Rotation::new(UnitQuaternion::new_unchecked(self.attitude))
    }
    /// The attitude as formulas on lanes take it.
    #[inline(always)]
    pub fn attitude_wxyz(&self) -> [T; 4] {
        let q = &self.attitude;
        [q.w, q.i, q.j, q.k]
    }
    /// The state with a unit quaternion.
    #[inline(always)]
    #[must_use]
    pub fn normalised(mut self) -> Self {
        let [w, i, j, k] = vector::unit(&self.attitude_wxyz());
        self.attitude = Quaternion::new(w, i, j, k);
        self
    }
    /// `q' = 1/2 q (0, omega)`.
    #[inline(always)]
    pub(super) fn attitude_rate(&self) -> Quaternion<T> {
        let [w, i, j, k] = body::attitude_rate(&self.attitude_wxyz(), &self.omega.vector.into());
        Quaternion::new(w, i, j, k)
    }
    /// True where every number is finite.
    pub fn is_finite(&self) -> bool {
        self.position.vector.iter().all(T::is_finite)
            && self.velocity.vector.iter().all(T::is_finite)
            && self.attitude.coords.iter().all(T::is_finite)
            && self.omega.vector.iter().all(T::is_finite)
            && self.rotor_speed_rad_s.iter().all(T::is_finite)
    }
}

impl<T: Real> VectorSpace<T> for State<T> {
    #[inline(always)]
    fn plus_scaled(&self, h: T, rate: &Self) -> Self {
        let mut rotor_speed_rad_s = self.rotor_speed_rad_s;
        for (speed, k) in rotor_speed_rad_s.iter_mut().zip(&rate.rotor_speed_rad_s) {
            *speed += h * *k;
        }
        Self {
            position: self.position + rate.position * h,
            velocity: self.velocity + rate.velocity * h,
            attitude: self.attitude + rate.attitude * h,
            omega: self.omega + rate.omega * h,
            rotor_speed_rad_s,
        }
    }
}
