//! What acts at the rotors' hubs, where the air comes by in another way than at the centre of mass:
//! the forms `at_rotors` of effects.
//!
//! Blade elements of fixed pitch have a force in the rotor plane, a loss of thrust to inflow and a
//! flapping moment that go with the rotor's speed and the velocity of its hub through the air,
//! `F_i = -S w_i (v + omega x r_i)`, and a lift that goes with the square of that velocity (Martin
//! and Salaun, ICRA 2010; Bangura and Mahony, 2017). So they damp turning, too. With all rotors at
//! the speed of hover and nothing turning they add up to the forms at the centre of mass.
//!
//! All effects together are one sum over the rotors, [`Numbers`].

use super::Situation;
use crate::aero::BodyWrench;
use crate::lane::Lane;
use crate::lane::vector::{cross, plus};
use crate::math::{Real, real, sqrt};
use crate::numbers;
use crate::vehicle::{MAX_ROTORS, Vehicle};

/// What effects have of it, all rotors together: at the speed of hover, and for lift at any.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slopes<T> {
    /// Force over velocity along each axis, N s/m.
    pub drag: [T; 3],
    /// Moment over velocity, N m s/m.
    pub flapping: T,
    /// Lift over velocity squared, N s^2/m^2.
    pub lift: T,
}

impl<T: Real> Slopes<T> {
    /// Nothing.
    pub fn none() -> Self {
        Self { drag: [T::zero(); 3], flapping: T::zero(), lift: T::zero() }
    }
    /// Both.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            drag: core::array::from_fn(|k| self.drag[k] + other.drag[k]),
            flapping: self.flapping + other.flapping,
            lift: self.lift + other.lift,
        }
    }
}

numbers! {
    /// The same of each rotor.
    Numbers {
        /// Over speed and velocity, along each axis, N s^2/(m rad).
        drag [3],
        /// Likewise, N m s^2/(m rad).
        flapping,
        /// Over velocity squared, N s^2/m^2; zero for what is no rotor, as its hub: lanes may have
        /// more places than a vehicle has rotors.
        lift [MAX_ROTORS],
        /// Hubs, from the centre of mass, m; zero for what is no rotor.
        hub_m [MAX_ROTORS] [3]
    }
}

impl<T: Real> Numbers<T> {
    pub(super) fn new(slopes: &Slopes<T>, vehicle: &Vehicle<T>) -> Self {
        let rotors = vehicle.rotors();
        let count = real::<T>(rotors.len().max(1) as f64);
        let per_square = &vehicle.rotor_wrench_per_speed_squared().thrust;
        let thrust = per_square.iter().fold(T::zero(), |sum, one| sum + *one);
        // 1 over the sum of the rotors' speeds in hover.
        let per_hover = sqrt(thrust / vehicle.weight_n()) / count;
        let mut hub_m = [[T::zero(); 3]; MAX_ROTORS];
        let mut lift = [T::zero(); MAX_ROTORS];
        for ((hub, lift), rotor) in hub_m.iter_mut().zip(&mut lift).zip(rotors) {
            *hub = rotor.position.vector.into();
            *lift = slopes.lift / count;
        }
        Self {
            drag: slopes.drag.map(|slope| slope * per_hover),
            flapping: slopes.flapping * per_hover,
            lift,
            hub_m,
        }
    }
}

impl<L: Lane> Numbers<L> {
    #[inline(always)]
    pub(super) fn wrench(&self, at: &Situation<'_, L>) -> BodyWrench<L> {
        let (mut out, none) = (BodyWrench::zero(), L::of(0.0));
        for ((hub, &lift), &speed) in self.hub_m.iter().zip(&self.lift).zip(at.rotor_speed) {
            let [u, v, w] = plus(&at.flow.velocity, &cross(&at.flow.omega, hub));
            let ([x, y, z], flapping) = (self.drag, self.flapping * speed);
            let lift = lift * (u * u + v * v);
            let force = [none - x * speed * u, none - y * speed * v, none - z * speed * w - lift];
            let [roll, pitch, yaw] = cross(hub, &force);
            let moment = [roll - v * flapping, pitch + u * flapping, yaw];
            out = out.plus(&BodyWrench { force, moment });
        }
        out
    }
}
