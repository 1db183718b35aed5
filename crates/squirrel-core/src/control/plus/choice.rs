//! Which attitude, thrust and wings come closest to an acceleration (docs/equations.md E.5): a
//! formula for the thrust, a pattern search of bounded work for the attitude.

use super::super::AttitudeThrust;
use super::super::twcc::OuterAirframe;
use super::lean::Lean;
use crate::aero::flat_plate;
use crate::frames::{In, Ned};
use crate::math::{GRAVITY_M_S2, limit, sqrt};
use nalgebra::Vector3;

/// Rounds of the search; its step halves in each.
const ROUNDS: u32 = 7;
/// First step of the search, rad.
const STEP_RAD: f32 = 0.2;

/// The vehicle in its air, in the heading frame: forward, right, down.
#[derive(Debug, Clone, Copy)]
pub(super) struct Believed<'a> {
    /// What flies.
    pub(super) airframe: &'a OuterAirframe,
    /// Through the air, as far as the wind is known, m/s.
    pub(super) velocity: Vector3<f32>,
    /// What nobody commanded: along body z, and what of it has its direction in this frame.
    pub(super) residual: Residual,
}

/// [`super::super::position::ForceResidual`] as the law believes it, N.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Residual {
    /// Thrust that is short.
    pub(super) short_n: f32,
    /// What spread wings do beside the flat plate, along body z.
    pub(super) wings_n: f32,
    /// What acts besides, in the heading frame.
    pub(super) beside: Vector3<f32>,
}

/// What is asked for, in the heading frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Demand<'a> {
    /// What flies.
    pub(super) believed: Believed<'a>,
    /// Acceleration command: forward, right, down, m/s^2.
    pub(super) acceleration: Vector3<f32>,
    /// `W_z^2`.
    pub(super) weight: f32,
    /// How far thrust may lean.
    pub(super) lean: Lean,
}

/// An attitude with what it leaves of the demand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Choice {
    /// Attitude and thrust.
    pub(super) command: AttitudeThrust,
    /// Square of the weighted residual, (m/s^2)^2.
    pub(super) cost: f32,
}

/// How much closer wings bring the acceleration to the command, m/s^2.
///
/// * `folded`, `spread` - the best without and with them
pub(super) fn saved(folded: &Choice, spread: &Choice) -> f32 {
    sqrt(folded.cost) - sqrt(spread.cost)
}

/// An attitude on the way from one to another, with the latter's thrust.
pub(super) fn between(from: &AttitudeThrust, to: &AttitudeThrust, share: f32) -> AttitudeThrust {
    AttitudeThrust {
        roll_rad: from.roll_rad + (to.roll_rad - from.roll_rad) * share,
        pitch_rad: from.pitch_rad + (to.pitch_rad - from.pitch_rad) * share,
        thrust_n: to.thrust_n,
    }
}

/// Body z (down) of an attitude in the heading frame.
pub(super) fn normal(roll_rad: f32, pitch_rad: f32) -> Vector3<f32> {
    let ((sr, cr), (sp, cp)) = (libm::sincosf(roll_rad), libm::sincosf(pitch_rad));
    Vector3::new(sp * cr, -sr, cp * cr)
}

impl Believed<'_> {
    /// Acceleration at an attitude, m/s^2.
    ///
    /// * `wings` - 0 folded to 1 spread
    pub(super) fn acceleration(&self, command: &AttitudeThrust, wings: f32) -> Vector3<f32> {
        let n = normal(command.roll_rad, command.pitch_rad);
        self.free_of_thrust(&n, wings) - n * (command.thrust_n / self.airframe.mass_kg)
    }

    /// Force on spread wings at an attitude, N.
    pub(super) fn wing_force(&self, at: &AttitudeThrust) -> Vector3<f32> {
        self.wings(&normal(at.roll_rad, at.pitch_rad), 1.0)
    }

    /// Most thrust that comes, less what pushes down, N.
    pub(super) fn thrust_max_n(&self) -> f32 {
        let Residual { short_n, beside, .. } = self.residual;
        self.airframe.envelope.thrust_max_n - short_n - beside.z
    }

    fn wings(&self, n: &Vector3<f32>, wings: f32) -> Vector3<f32> {
        let area_m2 = wings * self.airframe.wing_area_m2;
        let plate = flat_plate::force::<Ned, f32>(In::new(self.velocity), In::new(*n), area_m2);
        plate.vector + n * (wings * self.residual.wings_n)
    }

    /// All but the thrust that is asked for, m/s^2.
    fn free_of_thrust(&self, n: &Vector3<f32>, wings: f32) -> Vector3<f32> {
        let felt = n * self.residual.short_n + self.residual.beside;
        let force = self.wings(n, wings) + felt;
        force / self.airframe.mass_kg + Vector3::new(0.0, 0.0, GRAVITY_M_S2 as f32)
    }
}

impl Demand<'_> {
    /// The best thrust at an attitude, and what is left.
    pub(super) fn at(&self, roll_rad: f32, pitch_rad: f32, wings: f32) -> Choice {
        let OuterAirframe { mass_kg, envelope, .. } = *self.believed.airframe;
        let n = normal(roll_rad, pitch_rad);
        let need = self.believed.free_of_thrust(&n, wings) - self.acceleration;
        let weighted = Vector3::new(n.x, n.y, self.weight * n.z);
        let thrust_n = limit(
            mass_kg * weighted.dot(&need) / weighted.dot(&n),
            envelope.thrust_min_n,
            envelope.thrust_max_n,
        );
        let left = need - n * (thrust_n / mass_kg);
        let cost = left.x * left.x + left.y * left.y + self.weight * left.z * left.z;
        Choice { command: AttitudeThrust { roll_rad, pitch_rad, thrust_n }, cost }
    }

    /// The best attitude near a first guess.
    #[inline(never)]
    pub(super) fn best(&self, guess: &AttitudeThrust, wings: f32) -> Choice {
        let (roll_rad, pitch_rad) = self.lean.within(guess.roll_rad, guess.pitch_rad);
        let mut best = self.at(roll_rad, pitch_rad, wings);
        let mut step = STEP_RAD;
        for _ in 0..ROUNDS {
            for (roll, pitch) in [(step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step)] {
                let AttitudeThrust { roll_rad, pitch_rad, .. } = best.command;
                let (roll_rad, pitch_rad) = self.lean.within(roll_rad + roll, pitch_rad + pitch);
                let next = self.at(roll_rad, pitch_rad, wings);
                if next.cost < best.cost {
                    best = next;
                }
            }
            step *= 0.5;
        }
        best
    }
}
