//! Thrust-wing coordination control (TWCC): PC, WOEG and WIIC put together, 10 Hz.
//!
//! Paper, section III.B. PC always runs. While its request stays inside the angle limit it flies,
//! wings folded. Where the request leaves the limit and WOEG's flag is up, WIIC flies with wings
//! spread. Differs from the paper:
//! - the request must come back below 0.9 of the limit before WIIC lets go, and a decision about
//!   the wings is kept for a dwell time, so that they do not chatter at 10 Hz (the paper switches
//!   at once); while only the dwell time holds, PC flies;
//! - the trigger may include thrust (docs/equations.md T22, [`Trigger::AngleOrThrust`]): on thrust
//!   alone PC's angles stay, thrust is at its limit and the wings open where they help;
//! - PC's integral is frozen while WIIC flies or anything is clamped;
//! - every decision has a [`Reason`].

use super::plus::Plus;
use super::position::{MeasuredMotion, PositionGains, PositionState, PositionTerms, heading_frame};
use super::wiic::{self, Envelope, ThrustLaw};
use super::wing_force::{ForceModel, ParnnTerms};
use super::woeg::{WingEvents, WingFlag};
use super::{AttitudeThrust, Reference};
use crate::aero::angle_of_attack;
use crate::frames::{Body, In, Ned, Rotation};
use crate::math::lower;
use crate::rnn::parnn::History;
use crate::vehicle::{ParameterError, Vehicle};
use nalgebra::Vector3;

/// Share of the angle limit below which WIIC lets go.
const RELEASE: f32 = 0.9;

/// What the wings may do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WingPolicy {
    /// Never open: the conventional controller.
    Folded,
    /// Always open, the controller does not know.
    Open,
    /// As TWCC decides.
    Coordinated,
    /// TWCC's thrust law with a force of zero and the flag up: what the law does without wings.
    CoordinatedWithoutWings,
}

/// What takes the lead from PC.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trigger {
    /// An angle beyond its limit.
    Angle,
    /// An angle or the thrust beyond its limit.
    AngleOrThrust,
}

/// Who flies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Mode {
    /// PC.
    #[default]
    Primary = 0,
    /// Wings open: WIIC, or the answer of [`plus`](mod@super::plus) with wings. Files and logs call
    /// it `wiic`.
    WingsOpen = 1,
    /// PC's angles at full thrust.
    FullThrust = 2,
}

/// Why this mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Reason {
    /// PC's request is inside the limits.
    #[default]
    InsideLimits = 0,
    /// PC's request is beyond a limit, but the wings would not help.
    WingsWouldNotHelp = 1,
    /// The roll request is beyond its limit and the wings help.
    RollLimit = 2,
    /// The pitch request is beyond its limit and the wings help.
    PitchLimit = 3,
    /// The thrust request is beyond its limit and the wings help.
    ThrustLimit = 4,
    /// The last decision about the wings is younger than the dwell time; PC flies.
    Dwell = 5,
    /// The policy does not coordinate.
    PolicyFixed = 6,
    /// Of [`super::plus`]: spread wings come closer to the acceleration command.
    WingsComeCloser = 7,
}

/// Parameters of the outer loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwccParameters {
    /// The primary controller.
    pub position: PositionGains,
    /// When wings help.
    pub wing_events: WingEvents,
    /// The thrust law of WIIC.
    pub thrust_law: ThrustLaw,
    /// What takes the lead from PC.
    pub trigger: Trigger,
    /// Where the force estimate comes from.
    pub force_model: ForceModel,
    /// What the wings may do.
    pub policy: WingPolicy,
    /// A change of mode is kept for this long, s.
    pub dwell_s: f32,
    /// Smallest collective thrust, N.
    pub thrust_min_n: f32,
    /// Where given, [`super::plus`] flies instead of PC and WIIC.
    pub plus: Option<Plus>,
}

/// What the outer loop remembers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TwccState {
    /// The primary controller's memory.
    pub position: PositionState,
    /// The paper's Flag.
    pub flag: bool,
    /// Who flew at the last tick.
    pub mode: Mode,
    /// Time since the last change of mode, s; `None` before the first, which waits for nothing.
    pub mode_age_s: Option<f32>,
    /// The last command was clamped.
    pub clamped: bool,
    /// The last command, where [`super::plus`] flies.
    pub last: Option<AttitudeThrust>,
    /// What the network of [`ForceModel::Parnn`] saw; empty for the other models.
    pub history: History,
}

/// Every term of one outer tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwccTerms {
    /// The primary controller's terms.
    pub position: PositionTerms,
    /// Wing force estimate as if spread, N.
    pub wing_force: In<Ned, f32>,
    /// What is behind it where the model is [`ForceModel::Parnn`].
    pub parnn: Option<ParnnTerms>,
    /// Angle of attack from the ground velocity, rad.
    pub angle_of_attack_rad: f32,
    /// Flag and the force behind it.
    pub wing: WingFlag,
    /// Who flies.
    pub mode: Mode,
    /// Why.
    pub reason: Reason,
    /// What the inner loop shall do.
    pub command: AttitudeThrust,
    /// Wing command, 0 folded to 1 spread.
    pub wing_command: f32,
    /// The command differs from PC's request or the acceleration was limited.
    pub clamped: bool,
}

/// What the outer loop knows of the vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OuterAirframe {
    /// Mass, kg.
    pub mass_kg: f32,
    /// Area of both wings, m^2; 0 for none.
    pub wing_area_m2: f32,
    /// Limits of angle and thrust.
    pub envelope: Envelope,
    /// What all rotors give at full speed and the reference voltage, N.
    pub rotors_n: f32,
}

impl OuterAirframe {
    /// Of a vehicle.
    ///
    /// * `tilt_max_rad` - what the outer loop may ask for of the vehicle's limit
    pub fn new(vehicle: &Vehicle<f32>, thrust_min_n: f32, tilt_max_rad: f32) -> Self {
        let p = vehicle.parameters();
        Self {
            mass_kg: p.mass_kg,
            wing_area_m2: vehicle.plate_area_m2(),
            envelope: Envelope { tilt_max_rad, thrust_min_n, thrust_max_n: p.limits.thrust_max_n },
            rotors_n: vehicle.rotor_thrust_top_n() * vehicle.rotors().len() as f32,
        }
    }

    /// Where the battery leaves a share of the rotors' thrust.
    pub(crate) fn supplied(mut self, share: f32) -> Self {
        let e = &mut self.envelope;
        e.thrust_max_n = lower(e.thrust_max_n, self.rotors_n * share);
        self
    }
}

impl TwccParameters {
    /// # Errors
    /// The first number out of range, by its name in `[control]`.
    pub fn check(&self, thrust_max_n: f32) -> Result<(), ParameterError> {
        self.position.check()?;
        let e = &self.wing_events;
        if !(e.close_below_n.is_finite()
            && e.open_above_n.is_finite()
            && e.close_below_n <= e.open_above_n)
        {
            let reason = "must be finite and <= control.wing.open_above_n";
            return Err(ParameterError::of("control.wing.close_below_n", e.close_below_n, reason));
        }
        if !(0.0..=10.0).contains(&self.dwell_s) {
            return Err(ParameterError::of(
                "control.wing.dwell_s",
                self.dwell_s,
                "must be 0 to 10",
            ));
        }
        if !(self.thrust_min_n > 0.0 && self.thrust_min_n < thrust_max_n) {
            let reason = "must be > 0 and below limits.thrust_max_n";
            return Err(ParameterError::of("control.thrust_min_n", self.thrust_min_n, reason));
        }
        if let ForceModel::Parnn(parnn) = &self.force_model {
            parnn.check()?;
        }
        self.plus.as_ref().map_or(Ok(()), Plus::check)
    }

    /// One tick.
    ///
    /// * `ned_from_body` - attitude estimate
    /// * `given_force` - wing force as if spread, N, for [`ForceModel::Given`]
    /// * `dt_s` - time since the last tick
    #[allow(
        clippy::too_many_arguments,
        reason = "each is one physical quantity; a struct would be used once"
    )]
    pub fn update(
        &self,
        state: &mut TwccState,
        airframe: &OuterAirframe,
        motion: &MeasuredMotion,
        ned_from_body: &Rotation<Ned, Body, f32>,
        given_force: Option<In<Ned, f32>>,
        reference: &Reference,
        dt_s: f32,
    ) -> TwccTerms {
        if let Some(plus) = &self.plus {
            return self.update_plus(plus, state, airframe, motion, ned_from_body, reference, dt_s);
        }
        let hold = state.clamped || state.mode == Mode::WingsOpen;
        let position = self.position.update(
            &mut state.position,
            airframe.mass_kg,
            motion,
            reference,
            hold,
            dt_s,
        );
        let normal = *ned_from_body * In::new(Vector3::z());
        let velocity_body = ned_from_body.inverse() * motion.velocity;
        let (wing_force, parnn) = if self.policy == WingPolicy::CoordinatedWithoutWings {
            (In::zero(), None)
        } else {
            let area_m2 = airframe.wing_area_m2;
            let history = &mut state.history;
            self.force_model.estimate(
                history,
                ned_from_body,
                velocity_body,
                given_force,
                area_m2,
                dt_s,
            )
        };
        let mut wing =
            self.wing_events.evaluate(wing_force, normal, position.acceleration, state.flag);
        wing.flag |= self.policy == WingPolicy::CoordinatedWithoutWings;
        state.flag = wing.flag;

        let (mode, reason) =
            self.decide(state, &airframe.envelope, &position.request, wing.flag, dt_s);
        let request = &position.request;
        let envelope = &airframe.envelope;
        let primary = envelope.limit(request);
        // WIIC's law belongs to a request beyond the limits. While only the dwell time keeps the
        // wings open, PC flies; and on thrust alone PC's thrust is at its limit already.
        let command = if mode == Mode::WingsOpen && reason != Reason::Dwell {
            wiic::command(
                self.thrust_law,
                airframe.mass_kg,
                heading_frame(&position.acceleration.vector, motion.heading_rad),
                heading_frame(&wing_force.vector, motion.heading_rad),
                request,
                envelope,
            )
        } else {
            primary
        };
        let wing_command = match self.policy {
            WingPolicy::Folded | WingPolicy::CoordinatedWithoutWings => 0.0,
            WingPolicy::Open => 1.0,
            WingPolicy::Coordinated => f32::from(mode != Mode::Primary),
        };
        let clamped = command != *request || position.acceleration != position.acceleration_demand;
        state.clamped = clamped;
        TwccTerms {
            position,
            wing_force,
            parnn,
            angle_of_attack_rad: angle_of_attack(velocity_body),
            wing,
            mode,
            reason,
            command,
            wing_command,
            clamped,
        }
    }

    fn decide(
        &self,
        state: &mut TwccState,
        envelope: &Envelope,
        request: &AttitudeThrust,
        flag: bool,
        dt_s: f32,
    ) -> (Mode, Reason) {
        if matches!(self.policy, WingPolicy::Folded | WingPolicy::Open) {
            return (Mode::Primary, Reason::PolicyFixed);
        }
        let held = if state.mode == Mode::WingsOpen { RELEASE } else { 1.0 };
        let pitch_beyond = request.pitch_rad.abs() > held * envelope.tilt_max_rad;
        let roll_beyond = request.roll_rad.abs() > held * envelope.tilt_max_rad;
        let held_thrust = if state.mode == Mode::FullThrust { RELEASE } else { 1.0 };
        let thrust_beyond = self.trigger == Trigger::AngleOrThrust
            && request.thrust_n > held_thrust * envelope.thrust_max_n;
        let (wanted, reason) = match (pitch_beyond || roll_beyond, thrust_beyond, flag) {
            (false, false, _) => (Mode::Primary, Reason::InsideLimits),
            (_, _, false) => (Mode::Primary, Reason::WingsWouldNotHelp),
            (true, ..) if request.pitch_rad.abs() >= request.roll_rad.abs() => {
                (Mode::WingsOpen, Reason::PitchLimit)
            }
            (true, ..) => (Mode::WingsOpen, Reason::RollLimit),
            (false, true, true) => (Mode::FullThrust, Reason::ThrustLimit),
        };
        state.mode_age_s = state.mode_age_s.map(|age| age + dt_s);
        if wanted == state.mode {
            return (wanted, reason);
        }
        if state.mode_age_s.is_some_and(|age| age < self.dwell_s) {
            return (state.mode, Reason::Dwell);
        }
        state.mode = wanted;
        state.mode_age_s = Some(0.0);
        (wanted, reason)
    }
}

#[cfg(test)]
pub(crate) mod fixtures {
    use super::super::position::fixtures::gains;
    use super::super::woeg::WingTest;
    use super::*;

    pub(crate) fn parameters() -> TwccParameters {
        TwccParameters {
            position: gains(),
            wing_events: WingEvents {
                test: WingTest::Normal,
                open_above_n: 0.1,
                close_below_n: 0.05,
            },
            thrust_law: ThrustLaw::Exact,
            trigger: Trigger::Angle,
            force_model: ForceModel::FlatPlate,
            policy: WingPolicy::Coordinated,
            dwell_s: 0.3,
            thrust_min_n: 0.5,
            plus: None,
        }
    }
    pub(crate) fn airframe() -> OuterAirframe {
        let envelope = Envelope {
            tilt_max_rad: core::f32::consts::FRAC_PI_6,
            thrust_min_n: 0.5,
            thrust_max_n: 10.0,
        };
        OuterAirframe { mass_kg: 0.548, wing_area_m2: 0.04, envelope, rotors_n: 21.6 }
    }
}

#[cfg(test)]
mod tests {
    use super::super::position::fixtures::{at, still};
    use super::fixtures::*;
    use super::*;

    /// Fast northward flight with the goal behind: PC wants to brake harder than 30 deg of pitch.
    fn braking(pitch_rad: f32) -> (MeasuredMotion, Rotation<Ned, Body, f32>) {
        let motion =
            MeasuredMotion { velocity: In::new(Vector3::new(7.0, 0.0, 0.0)), pitch_rad, ..still() };
        (motion, Rotation::from_euler(0.0, pitch_rad, 0.0))
    }

    fn tick(p: &TwccParameters, state: &mut TwccState, pitch_rad: f32, north_m: f32) -> TwccTerms {
        let (motion, attitude) = braking(pitch_rad);
        p.update(state, &airframe(), &motion, &attitude, None, &at(north_m, 0.0, 0.0), 0.1)
    }

    #[test]
    fn wings_open_when_the_nose_is_up_and_the_request_is_beyond_the_limit() {
        let mut state = TwccState::default();
        let level = tick(&parameters(), &mut state, 0.0, 0.0);
        assert_eq!((level.mode, level.reason), (Mode::Primary, Reason::WingsWouldNotHelp));
        let nose_up = tick(&parameters(), &mut state, 0.4, 0.0);
        assert_eq!((nose_up.mode, nose_up.reason), (Mode::WingsOpen, Reason::PitchLimit));
        assert_eq!(nose_up.wing_command, 1.0);
        assert_eq!(nose_up.command.pitch_rad, airframe().envelope.tilt_max_rad);
        assert!(nose_up.wing_force.vector.x < 0.0, "the wing brakes");
    }

    #[test]
    fn a_decision_is_kept_for_the_dwell_time() {
        let p = parameters();
        let mut state = TwccState::default();
        assert_eq!(tick(&p, &mut state, 0.4, 0.0).mode, Mode::WingsOpen);
        // The goal jumps ahead: PC's request is inside the limits, yet the wings stay for 0.3 s.
        let modes: Vec<_> = (0..4).map(|_| tick(&p, &mut state, 0.4, 4.4)).collect();
        assert_eq!(modes[0].reason, Reason::Dwell);
        assert_eq!(modes[0].wing_command, 1.0);
        assert_eq!(
            modes[0].command.pitch_rad, modes[0].position.request.pitch_rad,
            "PC flies, not WIIC's limit angle"
        );
        assert_eq!(modes[1].mode, Mode::WingsOpen);
        assert_eq!(modes[3].mode, Mode::Primary);
        // And once folded they stay folded for as long.
        let again = tick(&p, &mut state, 0.4, 0.0);
        assert_eq!((again.mode, again.reason), (Mode::Primary, Reason::Dwell));
    }

    #[test]
    fn the_integral_is_frozen_while_clamped() {
        let p = parameters();
        let mut state = TwccState::default();
        tick(&p, &mut state, 0.4, 0.0);
        let before = state.position.integral;
        for _ in 0..20 {
            tick(&p, &mut state, 0.4, 0.0);
        }
        assert_eq!(state.position.integral, before);
    }

    #[test]
    fn folded_wings_never_open_and_open_wings_never_fold() {
        for (policy, wing) in [(WingPolicy::Folded, 0.0), (WingPolicy::Open, 1.0)] {
            let p = TwccParameters { policy, ..parameters() };
            let terms = tick(&p, &mut TwccState::default(), 0.4, 0.0);
            assert_eq!((terms.wing_command, terms.mode), (wing, Mode::Primary));
        }
    }

    #[test]
    fn the_law_without_wings_flies_wiic_with_wings_folded() {
        let p = TwccParameters { policy: WingPolicy::CoordinatedWithoutWings, ..parameters() };
        let terms = tick(&p, &mut TwccState::default(), 0.0, 0.0);
        assert_eq!((terms.mode, terms.wing_command), (Mode::WingsOpen, 0.0));
        assert_eq!(terms.wing_force, In::zero());
    }

    /// T22: thrust beyond its limit, angles inside: full thrust, PC's angles, wings if they help.
    #[test]
    fn the_thrust_trigger_keeps_the_angles() {
        let sinking = MeasuredMotion { velocity: In::new(Vector3::new(0.0, 0.0, 4.0)), ..still() };
        let mut weak = airframe();
        weak.envelope.thrust_max_n = 6.0;
        let attitude = Rotation::identity();
        for (trigger, mode) in
            [(Trigger::Angle, Mode::Primary), (Trigger::AngleOrThrust, Mode::FullThrust)]
        {
            let p = TwccParameters { trigger, ..parameters() };
            let terms = p.update(
                &mut TwccState::default(),
                &weak,
                &sinking,
                &attitude,
                None,
                &at(0.5, 0.0, -3.0),
                0.1,
            );
            assert_eq!(terms.mode, mode);
            assert_eq!(terms.command.thrust_n, 6.0);
            assert_eq!(terms.command.pitch_rad, terms.position.request.pitch_rad);
            assert_eq!(terms.wing_command, f32::from(mode == Mode::FullThrust));
        }
    }
}
