//! The better wing controller: attitude, thrust and wings chosen together, ten times a second.
//!
//! The paper's WIIC holds an angle at its limit and leaves height to itself; its PC saturates each
//! angle and the thrust on their own. Here one weighted least-squares problem decides
//! (docs/equations.md E.5):
//!
//! ```text
//! min over roll, pitch, U, w of  | W (g e3 - U n/m + w f(n)/m - a_cmd) |^2      n = R e3, W = diag(1, 1, W_z)
//! n_z >= cos tilt        U_min <= U <= U_max        w = 0 or 1
//! ```
//!
//! For an attitude and a wing, U is a formula; the attitude is found by a pattern search of seven
//! rounds that starts from PC's request, so that work is bounded. What else is different from the
//! paper's laws:
//! - thrust leans in a cone ([`TiltLimit`]), to every side as far as in the corners of the paper's
//!   box, and no farther than thrust holds height;
//! - `f` is the flat plate at the *commanded* attitude: the present one is level when a turn
//!   begins, and says that wings do not help;
//! - motion and reference are those of [`Plus::delay_s`] ahead, when what is commanded now acts:
//!   attitude bandwidth is compensated, and a servo has travelled by the time that the attitude it
//!   was opened for is there;
//! - thrust is for the attitude on the way there, not for its end, so that it does not lift before
//!   it brakes, and for the present one where there is plenty of it;
//! - height is part of the residual with the weight `W_z`, so that it is held unless the horizontal
//!   gains more; a sink weighs the more the less thrust there is to end it;
//! - what the inertial unit feels along body z beside all this is added
//!   ([`super::position::ForceResidual`]): thrust that is short, and what spread wings did beside
//!   the plate, so that wings which harm fold again, and stay folded for a while;
//! - the way to the reference is flown no faster than rotors alone can brake it beside what the
//!   reference itself asks for;
//! - a mission's descent is flown no faster than rotors can end it where it ends (`sink`);
//! - velocity and acceleration of the reference are fed forward by the position loop
//!   ([`PositionGains`]).
//!
//! With [`Feels::Everything`] it is incremental inversion (INDI, outer loop: Smeur, de Croon and Chu,
//! Control Engineering Practice 73, 2018): all that the accelerometer feels beside thrust is taken
//! as what acts a moment later, whatever makes it. It is a rival, and has no wings.
//!
//! Wings open where they make the residual smaller by [`Plus::open_above_m_s2`], and fold where
//! they no longer make it smaller. Without wings it is the same controller: the fair rival.

mod choice;
mod lean;
mod sink;
#[cfg(test)]
mod tests;
mod tick;

use super::Reference;
use super::position::{ForceResidual, PositionGains};
use super::twcc::OuterAirframe;
use super::wiic::Envelope;
use crate::math::{GRAVITY_M_S2, cos, limit, lower, sqrt, upper};
use crate::vehicle::{ParameterError, positive};
use choice::{Believed, Residual};
pub use lean::TiltLimit;
use nalgebra::Vector3;

/// With which a climb is turned, and a sink at most, m/s^2.
const TURN_M_S2: f32 = 5.0;
/// With which a sink is turned at least, m/s^2: no thrust to spare is no reason to divide by it.
const TURN_MIN_M_S2: f32 = 2.0;
/// Share of the weight by which lift at the tilt limit must be above it to hold height and the way.
const HELD_SHARE: f32 = 0.04;
/// Up to which thrust is scarce in a turn.
const SCARCE_SHARE: f32 = 0.08;
/// From which on there is plenty.
const PLENTY_SHARE: f32 = 0.2;
/// Bands of height that count, at most: beyond, the vehicle is level already, and a sink that wings
/// or a gust made in an instant would stop it from braking at all.
const BANDS_MAX: f32 = 3.5;
/// Share of the weight from which on a push down on spread wings, felt and not known, is harm: they
/// stay open only for what they would be opened for.
const HARM_SHARE: f32 = 0.1;

/// What of the force that nobody commanded the law believes to act on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Feels {
    /// That along body z: thrust that is short, and what spread wings do.
    BodyZ,
    /// All of it, wings folded.
    Everything,
}

/// Parameters of the law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plus {
    /// The position loop, with the reference's motion fed forward.
    pub position: PositionGains,
    /// From a command to the attitude that it asks for, s.
    pub delay_s: f32,
    /// `W_z`: what a vertical acceleration counts that differs from the command, over a horizontal
    /// one.
    pub vertical_weight: f32,
    /// Height that may be gained before it counts: where that much is foreseen, `W_z` is twice as
    /// large, m. A climb brakes, and ends by itself.
    pub height_band_m: f32,
    /// Height that may be lost before it counts, likewise, m, where thrust holds height at the tilt
    /// limit with something to spare. Where it does not, holding it would give up the way: there it
    /// is `height_band_m`.
    pub sink_band_m: f32,
    /// Share of the way from the present to the commanded attitude for which thrust is chosen, where
    /// it is scarce; with plenty of it, it is chosen for the present attitude.
    pub thrust_share: f32,
    /// Share of the acceleration that rotors have to spare in level flight with which an approach
    /// to the reference is braked.
    pub approach_share: f32,
    /// Wings open where they bring the acceleration closer to the command by this much, m/s^2.
    pub open_above_m_s2: f32,
    /// Push of the rotors on both wings spread, in hover, N down, as far as it is known
    /// beforehand; what is felt in flight comes on top.
    pub wing_download_n: f32,
    /// What is felt in flight.
    pub feels: Feels,
    /// How far thrust may lean.
    pub tilt_limit: TiltLimit,
}

impl Plus {
    /// # Errors
    /// The first number out of range, by its name in `[control.plus]`.
    pub fn check(&self) -> Result<(), ParameterError> {
        self.position.check()?;
        for (field, x) in [
            ("control.plus.delay_s", self.delay_s),
            ("control.plus.thrust_share", self.thrust_share),
        ] {
            if !(0.0..=1.0).contains(&x) {
                return Err(ParameterError::of(field, x, "must be 0 to 1"));
            }
        }
        for (field, x) in [
            ("control.plus.vertical_weight", self.vertical_weight),
            ("control.plus.height_band_m", self.height_band_m),
            ("control.plus.sink_band_m", self.sink_band_m),
        ] {
            if !(0.01..=100.0).contains(&x) {
                return Err(ParameterError::of(field, x, "must be 0.01 to 100"));
            }
        }
        if !self.wing_download_n.is_finite() {
            let reason = "must be finite";
            let field = "control.plus.wing_download_n";
            return Err(ParameterError::of(field, self.wing_download_n, reason));
        }
        positive("control.plus.approach_share", self.approach_share)?;
        positive("control.plus.open_above_m_s2", self.open_above_m_s2)
    }

    /// With what the way to the reference can be braked without wings while height is held and the
    /// reference's own acceleration is flown, m/s^2.
    fn approach_m_s2(&self, believed: &Believed<'_>, reference: &Reference) -> f32 {
        let OuterAirframe { mass_kg, envelope: Envelope { tilt_max_rad, .. }, .. } =
            *believed.airframe;
        let (weight_n, most_n) = (mass_kg * GRAVITY_M_S2 as f32, believed.thrust_max_n());
        let spare = sqrt(upper(most_n * most_n - weight_n * weight_n, 0.0)) / mass_kg;
        let level = lower(spare, GRAVITY_M_S2 as f32 * libm::tanf(tilt_max_rad));
        self.approach_share * upper(level - reference.acceleration.vector.xy().norm(), 0.1 * level)
    }

    /// Of what is felt, that which is believed.
    ///
    /// * `heading` - turns a NED vector into the heading frame
    fn believes(
        &self,
        felt: &ForceResidual,
        heading: impl Fn(&Vector3<f32>) -> Vector3<f32>,
    ) -> Residual {
        match self.feels {
            Feels::BodyZ => Residual {
                short_n: felt.short_n,
                wings_n: self.wing_download_n + felt.wings_n,
                beside: Vector3::zeros(),
            },
            Feels::Everything => {
                Residual { beside: heading(&felt.beside.vector), ..Residual::default() }
            }
        }
    }

    fn sink_band(&self, airframe: &OuterAirframe) -> f32 {
        let held = limit(lift_to_spare(airframe) / HELD_SHARE, 0.0, 1.0);
        self.height_band_m + (self.sink_band_m - self.height_band_m) * held
    }

    /// Share of the way to the commanded attitude for which thrust is chosen.
    ///
    /// Where thrust is scarce a turn begins with all of it, before the attitude is there: lift that
    /// is lost later. Where there is plenty that only climbs, and pushes on along the old way.
    fn thrust_share(&self, airframe: &OuterAirframe) -> f32 {
        let plenty = (lift_to_spare(airframe) - SCARCE_SHARE) / (PLENTY_SHARE - SCARCE_SHARE);
        self.thrust_share * (1.0 - limit(plenty, 0.0, 1.0))
    }

    /// `W_z^2` for a height error and its rate: it grows with the error that is foreseen at the
    /// turn of a climb or sink.
    ///
    /// * `down_m`, `down_m_s` - position and velocity less those of the reference
    fn weight(&self, believed: &Believed<'_>, down_m: f32, down_m_s: f32) -> f32 {
        // Gravity ends a climb; a sink is ended by what thrust there is above the weight.
        let spare = believed.thrust_max_n() / believed.airframe.mass_kg - GRAVITY_M_S2 as f32;
        let turn = if down_m_s > 0.0 { limit(spare, TURN_MIN_M_S2, TURN_M_S2) } else { TURN_M_S2 };
        let foreseen_m = down_m + down_m_s * down_m_s.abs() / (2.0 * turn);
        let band_m =
            if foreseen_m > 0.0 { self.sink_band(believed.airframe) } else { self.height_band_m };
        let share = lower(foreseen_m.abs() / band_m, BANDS_MAX);
        let weight = self.vertical_weight * (1.0 + share * share);
        weight * weight
    }
}

/// Lift at the tilt limit over the weight, less 1: by what the file says, not by what is felt, for a
/// preference that changed with the flow would chase the flight.
fn lift_to_spare(airframe: &OuterAirframe) -> f32 {
    let OuterAirframe { mass_kg, envelope, .. } = *airframe;
    let lift_n = envelope.thrust_max_n * cos(envelope.tilt_max_rad);
    lift_n / (mass_kg * GRAVITY_M_S2 as f32) - 1.0
}
