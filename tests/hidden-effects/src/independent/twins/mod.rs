//! Effects whose equation stands in a file of its own, with what the bench draws of them.
//!
//! Written from publications, as all of this generator, and not from the core's files: what is
//! wrong there must not be wrong here, too.

pub(crate) mod angular_damping;
pub(crate) mod flapping_moment;
pub(crate) mod rotor_wash;
pub(crate) mod vortex_ring;
pub(crate) mod wing_moment;
pub(crate) mod wing_tangential;

use crate::airframe::MAX_ROTORS;
use crate::catalogue::HiddenEffect;
use nalgebra::{Vector2, Vector3};
use std::f64::consts::PI;

/// What the equations look at; what another one needs is added here and in `physics.rs`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sight {
    /// Velocity through the air, body axes, m/s.
    pub(crate) air_body: Vector3<f64>,
    /// Rates, body axes, rad/s.
    pub(crate) omega: Vector3<f64>,
    /// Every rotor.
    pub(crate) rotors: Rotors,
    /// Force, N, and moment, N m, of the thrust of all rotors.
    pub(crate) thrust_wrench: [Vector3<f64>; 2],
    /// Weight, N.
    pub(crate) weight_n: f64,
    /// Radius of every propeller, m.
    pub(crate) propeller_radius_m: f64,
    /// The wings.
    pub(crate) wings: Wings,
}

impl Sight {
    /// Area of a propeller's disc, m^2.
    pub(crate) fn disc_m2(&self) -> f64 {
        PI * self.propeller_radius_m.powi(2)
    }
    /// Sine of the wings' angle of attack; 0 in still air.
    pub(crate) fn sin_alpha(&self) -> f64 {
        let speed = self.air_body.norm();
        if speed > 0.0 { self.air_body.z / speed } else { 0.0 }
    }
}

/// A rotor that pushes air.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Jet {
    /// Hub, body axes, m.
    pub(crate) position: Vector3<f64>,
    /// Its thrust now, N.
    pub(crate) thrust_n: f64,
}

/// The rotors of a vehicle.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Rotors {
    jets: [Jet; MAX_ROTORS],
    count: usize,
}

impl Rotors {
    pub(crate) fn all(&self) -> &[Jet] {
        &self.jets[..self.count]
    }
    pub(crate) fn push(&mut self, jet: Jet) {
        self.jets[self.count] = jet;
        self.count += 1;
    }
}

/// A pair of flat wings.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wings {
    /// Of one side, m^2.
    pub(crate) area_m2: f64,
    /// Normal force over the sine of the angle of attack.
    pub(crate) slope: f64,
    /// From the centre line to the middle of a side, m.
    pub(crate) lateral_arm_m: f64,
    /// How far ahead that is, m.
    pub(crate) longitudinal_arm_m: f64,
    /// How far below, m.
    pub(crate) vertical_arm_m: f64,
    /// Length along the flight, m.
    pub(crate) chord_m: f64,
    /// Left and right, 0 to 1.
    pub(crate) deployment: Vector2<f64>,
    /// Force of both along `z` as it is now, N.
    pub(crate) force_z_n: f64,
}

/// Force, N, and moment, N m, body axes, of an effect.
pub(crate) type Equation = fn(&HiddenEffect, &Sight) -> [Vector3<f64>; 2];
