//! The better wing controller: attitude, thrust and wings chosen together, ten times a second.
//!
//! The paper's WIIC holds an angle at its limit and leaves height to itself; its PC saturates each
//! angle and the thrust on their own. Here one weighted least-squares problem decides
//! (docs/equations.md E.5):
//!
//! ```text
//! min over roll, pitch, U, w of  | W (g e3 - U n/m + w f(n)/m - a_cmd) |^2      n = R e3, W = diag(1, 1, W_z)
//! |roll|, |pitch| <= tilt_max        U_min <= U <= U_max        w = 0 or 1
//! ```
//!
//! For an attitude and a wing, U is a formula; the attitude is found by a pattern search of seven
//! rounds that starts from PC's request, so that work is bounded. What else is different from the
//! paper's laws:
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
//! - velocity and acceleration of the reference are fed forward by the position loop
//!   ([`PositionGains`]).
//!
//! With [`Feels::Everything`] it is incremental inversion (INDI, outer loop: Smeur, de Croon and Chu,
//! Control Engineering Practice 73, 2018): all that the accelerometer feels beside thrust is taken
//! as what acts a moment later, whatever makes it. It is a rival, and has no wings.
//!
//! Wings open where they make the residual smaller by [`Plus::open_above_m_s2`], and fold where
//! they no longer make it smaller. Without wings it is the same controller: the fair rival.

use super::position::{ForceResidual, PositionGains};
use super::twcc::OuterAirframe;
use super::wiic::Envelope;
use super::{AttitudeThrust, Reference};
use crate::aero::flat_plate;
use crate::frames::{In, Ned};
use crate::math::{GRAVITY_M_S2, cos, limit, lower, sqrt, upper};
use crate::vehicle::{ParameterError, positive};
use nalgebra::Vector3;

/// Rounds of the search; its step halves in each.
const ROUNDS: u32 = 7;
/// With which a climb is turned, and a sink at most, m/s^2.
const TURN_M_S2: f32 = 5.0;
/// With which a sink is turned at least, m/s^2: no thrust to spare is no reason to divide by it.
const TURN_MIN_M_S2: f32 = 2.0;
/// Share of the weight by which lift at the tilt limit must be above it to hold height and the way.
const HELD_SHARE: f32 = 0.08;
/// From which on there is plenty.
const PLENTY_SHARE: f32 = 0.2;
/// First step of the search, rad.
const STEP_RAD: f32 = 0.2;

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
}

/// The vehicle in its air, in the heading frame: forward, right, down.
#[derive(Debug, Clone, Copy)]
pub(super) struct Believed<'a> {
    /// What flies.
    pub(super) airframe: &'a OuterAirframe,
    /// Over ground, m/s.
    pub(super) velocity: Vector3<f32>,
    /// What nobody commanded: along body z, and what of it has its direction in this frame.
    pub(super) residual: Residual,
}

/// [`ForceResidual`] as the law believes it, N.
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
}

/// An attitude with what it leaves of the demand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Choice {
    /// Attitude and thrust.
    pub(super) command: AttitudeThrust,
    /// Square of the weighted residual, (m/s^2)^2.
    pub(super) cost: f32,
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
    pub(super) fn approach_m_s2(&self, believed: &Believed<'_>, reference: &Reference) -> f32 {
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
    pub(super) fn believes(
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
    pub(super) fn thrust_share(&self, airframe: &OuterAirframe) -> f32 {
        let plenty = (lift_to_spare(airframe) - HELD_SHARE) / (PLENTY_SHARE - HELD_SHARE);
        self.thrust_share * (1.0 - limit(plenty, 0.0, 1.0))
    }

    /// `W_z^2` for a height error and its rate: it grows with the error that is foreseen at the
    /// turn of a climb or sink.
    ///
    /// * `down_m`, `down_m_s` - position and velocity less those of the reference
    pub(super) fn weight(&self, believed: &Believed<'_>, down_m: f32, down_m_s: f32) -> f32 {
        // Gravity ends a climb; a sink is ended by what thrust there is above the weight.
        let spare = believed.thrust_max_n() / believed.airframe.mass_kg - GRAVITY_M_S2 as f32;
        let turn = if down_m_s > 0.0 { limit(spare, TURN_MIN_M_S2, TURN_M_S2) } else { TURN_M_S2 };
        let foreseen_m = down_m + down_m_s * down_m_s.abs() / (2.0 * turn);
        let band_m =
            if foreseen_m > 0.0 { self.sink_band(believed.airframe) } else { self.height_band_m };
        let share = foreseen_m / band_m;
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
fn normal(roll_rad: f32, pitch_rad: f32) -> Vector3<f32> {
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
    fn thrust_max_n(&self) -> f32 {
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
        let max = self.believed.airframe.envelope.tilt_max_rad;
        let guess = self.believed.airframe.envelope.limit(guess);
        let mut best = self.at(guess.roll_rad, guess.pitch_rad, wings);
        let mut step = STEP_RAD;
        for _ in 0..ROUNDS {
            for (roll, pitch) in [(step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step)] {
                let AttitudeThrust { roll_rad, pitch_rad, .. } = best.command;
                let next = self.at(
                    limit(roll_rad + roll, -max, max),
                    limit(pitch_rad + pitch, -max, max),
                    wings,
                );
                if next.cost < best.cost {
                    best = next;
                }
            }
            step *= 0.5;
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::super::position::fixtures::{at, gains, still};
    use super::super::position::{AngleLaw, ForceResidual, MeasuredMotion};
    use super::super::twcc::fixtures::{airframe, parameters};
    use super::super::twcc::{Reason, TwccParameters, TwccState, TwccTerms, WingPolicy};
    use super::*;
    use crate::frames::{Body, Rotation};
    use proptest::prelude::*;

    fn plus() -> Plus {
        let position = PositionGains {
            velocity_feed_forward: 1.0,
            acceleration_feed_forward: 1.0,
            acceleration_max_horizontal_m_s2: 30.0,
            acceleration_max_vertical_m_s2: 6.0,
            ..gains()
        };
        Plus {
            position,
            delay_s: 0.1,
            vertical_weight: 0.5,
            height_band_m: 1.5,
            sink_band_m: 0.5,
            thrust_share: 0.5,
            approach_share: 0.5,
            open_above_m_s2: 0.3,
            wing_download_n: 0.0,
            feels: Feels::BodyZ,
        }
    }

    fn calm(airframe: &OuterAirframe) -> Believed<'_> {
        Believed { airframe, velocity: Vector3::zeros(), residual: Residual::default() }
    }

    fn demand(airframe: &OuterAirframe, acceleration: [f32; 3], velocity: [f32; 3]) -> Demand<'_> {
        let believed = Believed { velocity: velocity.into(), ..calm(airframe) };
        Demand { believed, acceleration: acceleration.into(), weight: 0.25 }
    }

    /// Braking from 7 m/s, level, the goal here.
    fn tick(p: &TwccParameters, state: &mut TwccState, thrust_max_n: f32) -> TwccTerms {
        tick_with(p, state, thrust_max_n, ForceResidual::default())
    }

    fn tick_with(
        p: &TwccParameters,
        state: &mut TwccState,
        thrust_max_n: f32,
        residual: ForceResidual,
    ) -> TwccTerms {
        let velocity = In::new(Vector3::new(7.0, 0.0, 0.0));
        let motion = MeasuredMotion { velocity, residual, ..still() };
        let mut airframe = airframe();
        airframe.envelope.thrust_max_n = thrust_max_n;
        p.update(
            state,
            &airframe,
            &motion,
            &Rotation::<Ned, Body, f32>::identity(),
            None,
            &at(0.0, 0.0, 0.0),
            0.1,
        )
    }

    proptest! {
        /// What can be had is had, with wings too.
        #[test]
        fn inside_the_limits_nothing_is_left(
            forward in -4.0..4.0f32, right in -4.0..4.0f32, down in -4.0..4.0f32, wings in any::<bool>(), speed in 0.0..8.0f32,
        ) {
            let airframe = airframe();
            let demand = demand(&airframe, [forward, right, down], [speed, 0.0, 0.0]);
            // As the position loop does, which knows no wings.
            let pitch_rad = libm::atan2f(-forward, 9.8 - down);
            let roll_rad = libm::atan2f(right * libm::cosf(pitch_rad), 9.8 - down);
            let guess = AttitudeThrust { roll_rad, pitch_rad, thrust_n: 5.0 };
            let best = demand.best(&guess, f32::from(wings));
            prop_assume!(best.command.roll_rad.abs() < 0.5 && best.command.pitch_rad.abs() < 0.5);
            prop_assume!(best.command.thrust_n > 0.6 && best.command.thrust_n < 9.9);
            prop_assert!(best.cost < 0.02, "{best:?}");
            let got = demand.believed.acceleration(&best.command, f32::from(wings));
            prop_assert!((got - demand.acceleration).norm() < 0.3, "{got} for {}", demand.acceleration);
        }

        /// No grid of a degree over the box and no thrust finds anything better than a hundredth.
        #[test]
        fn outside_them_the_search_finds_what_a_grid_finds(
            forward in -20.0..20.0f32, right in -10.0..10.0f32, down in -6.0..6.0f32, speed in 0.0..9.0f32, climb in -4.0..4.0f32,
            wings in any::<bool>(), thrust_max_n in 6.0..12.0f32,
        ) {
            let mut airframe = airframe();
            airframe.envelope.thrust_max_n = thrust_max_n;
            let demand = demand(&airframe, [forward, right, down], [speed, 0.0, climb]);
            let wings = f32::from(wings);
            let guess = AttitudeThrust { roll_rad: 0.1 * right, pitch_rad: -0.1 * forward, thrust_n: 5.0 };
            let best = demand.best(&guess, wings);
            let degrees = || (-30i8..=30).map(|k| f32::from(k).to_radians());
            let grid = degrees()
                .flat_map(|roll| degrees().map(move |pitch| (roll, pitch)))
                .map(|(roll, pitch)| demand.at(roll, pitch, wings).cost)
                .fold(f32::INFINITY, f32::min);
            prop_assert!(best.cost <= grid * 1.01 + 0.02, "{best:?}, grid {grid}");
        }
    }

    /// Level at the start of a turn the flat plate says that wings do not help; at the commanded
    /// attitude it says that they do.
    #[test]
    fn wings_open_before_the_nose_is_up() {
        let p = TwccParameters { plus: Some(plus()), ..parameters() };
        let ours = tick(&p, &mut TwccState::default(), 6.45);
        assert_eq!((ours.wing_command, ours.reason), (1.0, Reason::WingsComeCloser));
        assert!(ours.command.pitch_rad > 0.4, "{:?}", ours.command);
        assert!(ours.wing.helpful_n > 0.3 * 0.548 && ours.wing.flag, "{:?}", ours.wing);
        let theirs = tick(&parameters(), &mut TwccState::default(), 6.45);
        assert_eq!(theirs.wing_command, 0.0);
        let folded = TwccParameters { policy: WingPolicy::Folded, ..p };
        assert_eq!(tick(&folded, &mut TwccState::default(), 6.45).wing_command, 0.0);
    }

    /// The same turn, after wings that were open were felt to be pushed down, or where the file says
    /// beforehand that they are.
    #[test]
    fn wings_that_harm_stay_folded() {
        let opened = |residual_n: f32, download_n: f32| {
            let plus = Plus { wing_download_n: download_n, ..plus() };
            let residual = ForceResidual { wings_n: residual_n, ..ForceResidual::default() };
            let p = TwccParameters { plus: Some(plus), ..parameters() };
            tick_with(&p, &mut TwccState::default(), 6.45, residual).wing_command
        };
        assert_eq!(opened(0.0, 0.0), 1.0);
        assert_eq!(opened(2.5, 0.0), 0.0);
        assert_eq!(opened(0.0, 2.5), 0.0);
        assert_eq!(opened(-2.5, 2.5), 1.0, "felt to be no push after all");
    }

    /// Thrust that is short is asked for on top.
    #[test]
    fn what_is_felt_is_made_up_for() {
        let p = TwccParameters { plus: Some(plus()), policy: WingPolicy::Folded, ..parameters() };
        let hover = |residual| {
            let airframe = airframe();
            let motion = MeasuredMotion { residual, ..still() };
            let attitude = Rotation::<Ned, Body, f32>::identity();
            let (state, goal) = (&mut TwccState::default(), at(0.0, 0.0, 0.0));
            p.update(state, &airframe, &motion, &attitude, None, &goal, 0.1).command
        };
        let none = hover(ForceResidual::default());
        let short = hover(ForceResidual { short_n: 0.8, ..ForceResidual::default() });
        assert!((short.thrust_n - none.thrust_n - 0.8).abs() < 0.01, "{short:?} {none:?}");
    }

    /// Incremental inversion: on the spot, thrust, weight and whatever is felt add up to nothing; what
    /// has its direction in the body moves nothing of it.
    #[test]
    fn whatever_is_felt_is_cancelled() {
        let position = PositionGains { integral_per_s2: Vector3::zeros(), ..plus().position };
        let incremental = Plus { position, feels: Feels::Everything, ..plus() };
        let p =
            TwccParameters { plus: Some(incremental), policy: WingPolicy::Folded, ..parameters() };
        let airframe = airframe();
        let weight = Vector3::new(0.0, 0.0, airframe.mass_kg * GRAVITY_M_S2 as f32);
        for beside in [[0.0; 3], [1.0, -0.5, 0.3], [-1.5, 0.7, -0.8]] {
            let residual = ForceResidual {
                short_n: 1.0,
                wings_n: 1.0,
                beside: In::new(Vector3::from(beside)),
            };
            let mut state = TwccState::default();
            let mut command = AttitudeThrust::default();
            // Attitude follows at once, so that thrust is chosen for where it is.
            for _ in 0..5 {
                let AttitudeThrust { roll_rad, pitch_rad, .. } = command;
                let motion = MeasuredMotion { roll_rad, pitch_rad, residual, ..still() };
                let attitude = Rotation::<Ned, Body, f32>::from_euler(roll_rad, pitch_rad, 0.0);
                state.last = None;
                let goal = at(0.0, 0.0, 0.0);
                command =
                    p.update(&mut state, &airframe, &motion, &attitude, None, &goal, 0.1).command;
            }
            let n = normal(command.roll_rad, command.pitch_rad);
            let sum = weight + Vector3::from(beside) - n * command.thrust_n;
            assert!(sum.norm() < 0.05, "{beside:?}: {sum} of {command:?}");
        }
    }

    /// With plenty of thrust none is spent on the way that the vehicle still leans; where it is scarce
    /// a turn begins with all of it.
    #[test]
    fn thrust_waits_for_the_attitude_where_there_is_plenty() {
        let weight_n = airframe().mass_kg * GRAVITY_M_S2 as f32;
        let share = |ratio: f32| {
            let mut airframe = airframe();
            airframe.envelope.thrust_max_n = ratio * weight_n;
            plus().thrust_share(&airframe)
        };
        assert_eq!((share(1.1), share(1.24), share(1.4), share(3.0)), (0.5, 0.5, 0.0, 0.0));
        assert!(share(1.3) > 0.2 && share(1.3) < 0.4, "{}", share(1.3));
        let p = TwccParameters { plus: Some(plus()), policy: WingPolicy::Folded, ..parameters() };
        let leaning = MeasuredMotion {
            velocity: In::new(Vector3::new(7.0, 0.0, 0.0)),
            pitch_rad: -0.3,
            ..still()
        };
        let thrust = |ratio: f32| {
            let mut airframe = airframe();
            airframe.envelope.thrust_max_n = ratio * weight_n;
            let attitude = Rotation::<Ned, Body, f32>::from_euler(0.0, -0.3, 0.0);
            let (state, goal) = (&mut TwccState::default(), at(0.0, 0.0, 0.0));
            p.update(state, &airframe, &leaning, &attitude, None, &goal, 0.1).command.thrust_n
        };
        assert!(thrust(1.2) > 1.19 * weight_n && thrust(2.0) < weight_n);
    }

    /// What is foreseen 4 m above the reference weighs so much that hardly any thrust is left.
    #[test]
    fn a_climb_ends_in_the_band() {
        let plus = plus();
        let airframe = airframe();
        let weight = |down_m, down_m_s| plus.weight(&calm(&airframe), down_m, down_m_s);
        assert_eq!(weight(0.0, 0.0), 0.25);
        assert_eq!(weight(-1.5, 0.0), 1.0, "twice the weight at the band's edge");
        assert_eq!(weight(0.5, 0.0), 1.0, "a sink counts sooner");
        let rising = weight(-1.0, -5.0);
        assert!(rising > weight(-1.0, 0.0) && weight(-1.0, 3.0) < rising);
        let brake =
            |weight| Demand { weight, ..demand(&airframe, [-20.0, 0.0, 5.0], [7.0, 0.0, -5.0]) };
        let thrust = |weight| {
            brake(weight)
                .best(&AttitudeThrust { pitch_rad: 0.5, ..Default::default() }, 0.0)
                .command
                .thrust_n
        };
        assert!(thrust(rising) < 0.6 * thrust(0.25), "{} {}", thrust(rising), thrust(0.25));
    }

    #[test]
    fn a_bad_parameter_is_named() {
        let error = |plus: Plus| plus.check().unwrap_err().to_string();
        assert!(
            error(Plus { delay_s: f32::NAN, ..plus() }).starts_with("control.plus.delay_s = NaN")
        );
        assert!(
            error(Plus { thrust_share: 1.5, ..plus() })
                .starts_with("control.plus.thrust_share = 1.5")
        );
        let exact = PositionGains { angle_law: AngleLaw::Exact, integral_max_m: -1.0, ..gains() };
        assert!(
            error(Plus { position: exact, ..plus() })
                .starts_with("control.position.integral_max_m = -1")
        );
        plus().check().unwrap();
    }
}
