//! Whether rotors push as they were commanded to: what the inertial unit feels against what the
//! mixer promised.
//!
//! ```text
//! thrust:  m f_z + T            torque:  J w' + w x J w - tau
//! ```
//! Where attitude is known, thrust that is short is told from drag (`force_residual`).
//! `T` and `tau` follow the mixer's answer with the rotors' time constant. Both differences are
//! means over [`MEAN_S`], for a weak rotor, a sagging battery or a stuck wing stays, and noise and
//! gusts do not. While wings are spread on purpose they push too, and nothing is learnt.

use super::force_residual::{Felt, Step};
use super::navigator::Health;
use super::wind::{Look, Wind};
use crate::control::mixer::ThrustTorque;
use crate::control::position::ForceResidual;
use crate::frame::Imu;
use crate::frames::{Body, In, Ned, Rotation};
use crate::math::{all_finite, lower};
use crate::vehicle::Vehicle;
use nalgebra::Vector3;

/// Time constant of the means, s.
pub const MEAN_S: f32 = 0.3;
/// Share of the weight that may be missing.
const SHORT_SHARE: f32 = 0.15;
/// Torque that may be too much, in weights at a rotor's arm.
const OFF_SHARE: f32 = 0.04;
/// Cosine of the tilt beyond which control was lost: 60 deg.
const UPSET_COSINE: f32 = 0.5;
/// After wings folded, s; longer than [`Felt`] waits.
const FOLDED_S: f32 = 0.7;

/// What is remembered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Monitor {
    pub(crate) commanded: ThrustTorque,
    pub(crate) omega: Option<Vector3<f32>>,
    pub(crate) missing_n: f32,
    pub(crate) torque_n_m: Vector3<f32>,
    pub(crate) spread_ago_s: f32,
    pub(crate) felt: Felt,
    pub(crate) wind: Wind,
    /// Since the last inertial measurement.
    pub(crate) waited_s: f32,
}

impl Default for Monitor {
    fn default() -> Self {
        Self {
            commanded: ThrustTorque { thrust_n: 0.0, torque_n_m: Vector3::zeros() },
            omega: None,
            missing_n: 0.0,
            torque_n_m: Vector3::zeros(),
            spread_ago_s: FOLDED_S,
            felt: Felt::default(),
            wind: Wind::default(),
            waited_s: 0.0,
        }
    }
}

/// What a step is looked at by.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seen<'a> {
    /// What the mixer promised; `None` where the rotors stand.
    pub achieved: Option<&'a ThrustTorque>,
    pub imu: Option<&'a Imu>,
    /// As believed.
    pub attitude: Option<&'a Rotation<Ned, Body, f32>>,
    /// Over ground, as believed, m/s.
    pub velocity: Option<In<Ned, f32>>,
    /// What is known of the rotors' push on spread wings, N.
    pub download_n: f32,
    /// Largest of the wings' commands, 0..1.
    pub wings: f32,
    /// Since the last step, s.
    pub dt_s: f32,
}

impl Monitor {
    /// Looks at a step; whether it looked at the wind, too.
    pub(crate) fn look(&mut self, vehicle: &Vehicle<f32>, seen: &Seen<'_>) -> bool {
        let Seen { achieved, imu, wings, dt_s, .. } = *seen;
        let Some(achieved) = achieved else {
            *self = Self::default();
            return false;
        };
        let dt_s = self.waited_s + dt_s;
        let Some(imu) = imu else {
            self.waited_s = lower(dt_s, MEAN_S);
            return false;
        };
        self.waited_s = 0.0;
        let p = vehicle.parameters();
        let omega = imu.omega.vector;
        let before = self.omega.replace(omega);
        self.spread_ago_s =
            if wings > 0.0 { 0.0 } else { lower(self.spread_ago_s + dt_s, FOLDED_S) };
        let (Some(before), true) = (before, dt_s > 0.0) else {
            self.commanded = *achieved;
            return false;
        };
        let follow = dt_s / (dt_s + p.propulsion.time_constant_up_s);
        self.commanded.thrust_n += (achieved.thrust_n - self.commanded.thrust_n) * follow;
        self.commanded.torque_n_m += (achieved.torque_n_m - self.commanded.torque_n_m) * follow;
        let learn = dt_s / (dt_s + MEAN_S);
        let is_folded = self.spread_ago_s >= FOLDED_S;
        let mut felt = imu.specific_force.vector * p.mass_kg;
        felt.z += self.commanded.thrust_n;
        let (mut short_n, mut is_wind_new) = (felt.z, false);
        if let (Some(ned_from_body), Some(velocity)) = (seen.attitude, seen.velocity) {
            short_n = self.felt.look(&Step {
                force: In::new(felt),
                ned_from_body,
                velocity: velocity - self.wind.velocity,
                wing_area_m2: vehicle.plate_area_m2(),
                download_n: seen.download_n,
                weight_n: vehicle.weight_n(),
                wings,
                spread_ago_s: self.spread_ago_s,
                dt_s,
            });
            let ForceResidual { beside, short_n, .. } = self.felt.residual();
            let look = Look { ned_from_body, velocity, beside, short_n, is_folded, dt_s };
            is_wind_new = self.wind.look(vehicle, &look);
        }
        let spin = p.inertia_kg_m2 * omega;
        let turned = p.inertia_kg_m2 * (omega - before) / dt_s + omega.cross(&spin)
            - self.commanded.torque_n_m;
        let (short_n, turned) = if is_folded { (short_n, turned) } else { (0.0, Vector3::zeros()) };
        self.missing_n += (short_n - self.missing_n) * learn;
        self.torque_n_m += (turned - self.torque_n_m) * learn;
        if !(self.missing_n.is_finite() && all_finite(&self.torque_n_m)) {
            *self = Self::default();
        }
        is_wind_new
    }

    /// Wind as estimated.
    pub fn wind(&self) -> Wind {
        self.wind
    }

    /// Force that nobody commanded.
    pub(crate) fn residual(&self) -> ForceResidual {
        self.felt.residual()
    }

    /// Health, with what was found.
    ///
    /// * `attitude` - as believed
    pub(crate) fn judge(
        &self,
        vehicle: &Vehicle<f32>,
        attitude: Option<&Rotation<Ned, Body, f32>>,
        health: Health,
    ) -> Health {
        let weight_n = vehicle.weight_n();
        let arm_m = vehicle.rotors().first().map_or(0.0, |rotor| rotor.position.vector.xy().norm());
        let torque_max_n_m = OFF_SHARE * weight_n * arm_m;
        health
            .with(
                Health::UPSET,
                attitude.is_some_and(|a| super::down(&a.quaternion).z < UPSET_COSINE),
            )
            .with(Health::THRUST_SHORT, self.missing_n > SHORT_SHARE * weight_n)
            .with(
                Health::TORQUE_OFF,
                self.torque_n_m.norm_squared() > torque_max_n_m * torque_max_n_m,
            )
    }
}
