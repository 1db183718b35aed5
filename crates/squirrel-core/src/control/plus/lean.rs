//! How far thrust may lean: a cone, or the paper's box of two angles.
//!
//! A limit of |roll| and |pitch| each lets a vehicle lean by 30 deg ahead and by 41 deg between the
//! axes, so that how well it brakes depends on where its nose points. The cone has the lean of the
//! box's corner to all sides, as far as thrust holds most of the weight there, and at least that of
//! one angle (docs/equations.md E.5):
//!
//! ```text
//! n_z >= clamp(0.97 m g / U_max, cos^2 tilt_max, cos tilt_max)      n = R e3
//! ```

use super::super::twcc::OuterAirframe;
use super::choice::normal;
use crate::math::{GRAVITY_M_S2, cos, limit, sqrt, upper};

/// Share of the weight that thrust holds at the cone's limit: spread wings carry some of it in a
/// turn, and what is lacking of a turn lasts longer.
const CARRIED_SHARE: f32 = 0.97;
/// Angles beyond are taken smaller, both by the same share: a request of the small-angle law knows
/// no right angle, behind which a vehicle leans to the other side.
const STEEP_RAD: f32 = 1.5;

/// How the law may lean.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TiltLimit {
    /// Roll and pitch have a limit each: the paper's.
    Box,
    /// The angle between thrust and the vertical has one.
    Cone,
}

/// Attitudes that are allowed.
#[derive(Debug, Clone, Copy)]
pub(super) enum Lean {
    /// Limit of |roll| and |pitch|, rad.
    Box(f32),
    /// Least `n_z`.
    Cone(f32),
}

impl Lean {
    pub(super) fn of(tilt: TiltLimit, airframe: &OuterAirframe) -> Self {
        let OuterAirframe { mass_kg, envelope, .. } = *airframe;
        match tilt {
            TiltLimit::Box => Self::Box(envelope.tilt_max_rad),
            TiltLimit::Cone => {
                let one_angle = cos(envelope.tilt_max_rad);
                let held = CARRIED_SHARE * mass_kg * GRAVITY_M_S2 as f32 / envelope.thrust_max_n;
                Self::Cone(limit(held, one_angle * one_angle, one_angle))
            }
        }
    }

    /// The nearest roll and pitch that are allowed: of the cone, leaning to the same side.
    pub(super) fn within(self, roll_rad: f32, pitch_rad: f32) -> (f32, f32) {
        match self {
            Self::Box(max) => (limit(roll_rad, -max, max), limit(pitch_rad, -max, max)),
            Self::Cone(least) => {
                let steepest = upper(roll_rad.abs(), pitch_rad.abs());
                let share = STEEP_RAD / upper(steepest, STEEP_RAD);
                let (roll_rad, pitch_rad) = (roll_rad * share, pitch_rad * share);
                let n = normal(roll_rad, pitch_rad);
                if n.z >= least {
                    return (roll_rad, pitch_rad);
                }
                let level = upper(n.x * n.x + n.y * n.y, f32::MIN_POSITIVE);
                let share = sqrt((1.0 - least * least) / level);
                (-libm::asinf(n.y * share), libm::atan2f(n.x * share, least))
            }
        }
    }
}
