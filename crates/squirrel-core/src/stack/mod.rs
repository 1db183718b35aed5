//! The whole flight code as one function: `step(state, frame) -> output`.
//!
//! ```text
//! frame -> two units vote, the filter listens -> attitude, position, velocity
//!   10 Hz:  guidance -> TWCC (PC, WOEG, WIIC) -> roll, pitch, thrust, wings; or a command from outside
//!   300 Hz: command filter (+ excitation) -> integral backstepping -> mixer -> rotor commands
//! ```
//! [`Stack::control`] is the part below the first line, for who estimates by himself. When a sensor
//! is gone or hangs, [`failsafe`] levels or cuts. [`Stack`] is constant in flight; [`StackState`]
//! is everything that changes, one plain struct that can be frozen, logged and thawed. Time comes
//! in with the frame. A step never panics, allocates or loops without bound; a measurement that is
//! not finite is rejected and the last valid one kept.

pub mod failsafe;
mod merge;
pub mod wire;

pub use crate::frame::{Gnss, Imu, MAX_OBSTACLES, SensorFrame};

use crate::control::backstepping::{AttitudeGains, AttitudeState, AttitudeTerms, INNER_STEP_MAX_S};
use crate::control::command_filter::{self, EulerReference};
use crate::control::lead::Lead;
use crate::control::mixer::{Mixer, MixerTerms, ThrustTorque};
use crate::control::position::MeasuredMotion;
use crate::control::supply::{Supply, ThrustByVoltage};
use crate::control::twcc::{OuterAirframe, TwccParameters, TwccState, TwccTerms};
use crate::control::{AttitudeThrust, Reference};
use crate::estimate::monitor::{Monitor, Seen};
use crate::estimate::navigator::{
    Health, Navigated, Navigation, NavigationState, NavigationTerms, Start,
};
use crate::estimate::wind::Wind;
use crate::frames::{Body, In, Ned, Rotation};
use crate::guidance::excite::Excitation;
use crate::guidance::mission::{Mission, MissionState};
use crate::math::{limit, lower, upper, whole};
use crate::policy::PilotCommand;
use crate::vehicle::{MAX_ROTORS, ParameterError, PerRotor, Vehicle};
use failsafe::{
    Estimated, Failsafe, FailsafeMode, FailsafeReason, FailsafeState, LEVEL_THRUST_SHARE,
};
use nalgebra::Vector3;

/// Period of the outer loop, us.
pub const OUTER_PERIOD_US: u64 = 100_000;

/// Gains of the whole stack.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StackParameters {
    /// Inner loop.
    pub attitude: AttitudeGains,
    /// Outer loop.
    pub twcc: TwccParameters,
    /// Estimation.
    pub navigation: Navigation,
    /// How thrust follows the battery's voltage.
    pub thrust: ThrustByVoltage,
}

/// The flight code of one vehicle on one mission.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stack {
    vehicle: Vehicle<f32>,
    airframe: OuterAirframe,
    lead: Lead<f32>,
    mixer: Mixer,
    parameters: StackParameters,
    mission: Mission,
    /// Share of the mission's excitation that is flown.
    excited_share: f32,
    /// What that takes of the largest thrust, N.
    excited_n: f32,
}

/// Of the thrust above the weight, what an excitation may take: the rest holds height.
const EXCITED_SHARE: f32 = 0.5;
/// So far below its reference a vehicle has sunk, m, if it asks for so much of its thrust.
const SUNK_M: f32 = 1.5;
const ALL_SHARE: f32 = 0.98;

/// The latest valid measurements.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Known {
    /// Angular rate and specific force.
    pub imu: Option<Imu>,
    /// Attitude estimate.
    pub attitude: Option<Rotation<Ned, Body, f32>>,
    /// Position and velocity.
    pub gnss: Option<Gnss>,
    /// Altitude above the origin, m, up.
    pub altitude_m: Option<f32>,
    /// Wing force as if spread, N.
    pub wing_force: Option<In<Ned, f32>>,
    /// Command from outside, until it is lost.
    pub command: Option<PilotCommand>,
}

impl Known {
    /// Takes over what is valid in a frame.
    pub fn take_over(&mut self, frame: &SensorFrame) {
        frame.merge_into(self);
    }
}

/// Everything that changes in flight.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StackState {
    /// Estimation.
    pub navigation: NavigationState,
    /// Whether rotors push as they are commanded.
    pub monitor: Monitor,
    /// What the battery leaves of their thrust.
    pub supply: Supply,
    /// Latest valid measurements.
    pub known: Known,
    /// Time of the last frame, us; `None` before the first.
    pub time_us: Option<u64>,
    /// Begin of the outer period that was handled last, us.
    pub outer_begin_us: Option<u64>,
    /// Which sensors can be believed.
    pub failsafe: FailsafeState,
    /// Guidance.
    pub mission: MissionState,
    /// Outer loop.
    pub twcc: TwccState,
    /// Command filter.
    pub filter: EulerReference,
    /// Inner loop.
    pub attitude: AttitudeState,
    /// What the outer loop, or a command from outside, asked for last.
    pub command: AttitudeThrust,
    /// Wing command asked for last.
    pub wing_command: f32,
    /// The mixer could not meet the last demand.
    pub saturated: bool,
    /// Measurements rejected so far: not finite, or larger than any flight.
    pub rejected: u32,
}

/// Commands and every term behind them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StackOutput {
    /// One command a rotor, in the vehicle's unit.
    pub rotor_command: PerRotor<f32>,
    /// Left and right wing, 0 folded to 1 spread.
    pub wing_command: [f32; 2],
    /// What is followed.
    pub reference: Reference,
    /// Measurements rejected so far.
    pub rejected: u32,
    /// Whether the mission flies, or what instead, and why.
    pub failsafe: Failsafe,
    /// What is not as it should be, whether or not that matters yet.
    pub health: Health,
    /// What is believed, where the flight code estimates and has heard enough to.
    pub navigation: Option<NavigationTerms>,
    /// Wind, as far as drag shows it, where it was looked at in this step.
    pub wind: Option<Wind>,
    /// The outer loop, where it ran in this step; it does not while commands come from outside.
    pub outer: Option<TwccTerms>,
    /// The inner loop, once attitude and rate are known; rotors stand still before that and while
    /// the failsafe cuts. Until the first fix or command it asks for no thrust, and rotors only
    /// turn as far as levelling takes.
    pub inner: Option<InnerTerms>,
}

/// Every term of one inner step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InnerTerms {
    /// Filtered attitude command.
    pub filter: EulerReference,
    /// What the mission adds to it and to the thrust.
    pub excitation: Option<Excitation>,
    /// Attitude loop.
    pub attitude: AttitudeTerms,
    /// Demand on the mixer.
    pub demand: ThrustTorque,
    /// Mixer.
    pub mixer: MixerTerms,
}

impl Stack {
    /// # Errors
    /// The first number of vehicle, gains or mission that cannot be used, with its field.
    pub fn new(
        vehicle: Vehicle<f32>,
        parameters: StackParameters,
        mission: Mission,
    ) -> Result<Self, ParameterError> {
        let p = vehicle.parameters();
        parameters.attitude.check()?;
        parameters.twcc.check(p.limits.thrust_max_n)?;
        parameters.navigation.check()?;
        parameters.thrust.check()?;
        mission.check()?;
        let tilt_max_rad = p.limits.tilt_max_rad - mission.excitation_tilt_rad();
        if !(tilt_max_rad > 0.0) {
            let reason = "must be above what the mission's multisine adds";
            return Err(ParameterError::of("limits.tilt_max_rad", p.limits.tilt_max_rad, reason));
        }
        let airframe = OuterAirframe::new(&vehicle, parameters.twcc.thrust_min_n, tilt_max_rad);
        let lead = Lead::new(parameters.attitude.rotor_lead, &p.propulsion);
        let spare_n = upper(airframe.envelope.thrust_max_n - vehicle.weight_n(), 0.0);
        let taken_n = mission.excitation_thrust_n(&vehicle);
        let excited_n = lower(taken_n, EXCITED_SHARE * spare_n);
        let excited_share = if excited_n < taken_n { excited_n / taken_n } else { 1.0 };
        let mixer = Mixer::new(&vehicle)?;
        Ok(Self { vehicle, airframe, lead, mixer, parameters, mission, excited_share, excited_n })
    }

    /// The vehicle as the flight code believes it to be.
    pub fn vehicle(&self) -> &Vehicle<f32> {
        &self.vehicle
    }

    /// The vehicle and gains that it was made with.
    pub fn parameters(&self) -> &StackParameters {
        &self.parameters
    }

    /// The heading that roll and pitch commands are of at an instant, those from outside, too, rad.
    pub fn heading_rad(&self, time_us: u64, ned_from_body: &Rotation<Ned, Body, f32>) -> f32 {
        // Headings of missions do not depend on what was met.
        let commanded_rad = self.mission.reference(&MissionState::default(), time_us).yaw_rad;
        self.parameters.attitude.form.heading_rad(ned_from_body.heading(), commanded_rad)
    }

    /// The same vehicle, gains and mission, from where a flight begins.
    ///
    /// # Errors
    /// As [`Navigation::check`].
    pub fn starting(&self, start: Start) -> Result<Self, ParameterError> {
        let mut stack = *self;
        stack.parameters.navigation.start = start;
        stack.parameters.navigation.check()?;
        Ok(stack)
    }

    /// One inner step. Total: bounded work, no panic, outputs finite and within limits for any
    /// frame.
    ///
    /// It is [`Self::navigate`], [`Self::control`] on what that believes, and [`Self::watch`].
    pub fn step(&self, state: &mut StackState, frame: &SensorFrame) -> StackOutput {
        let navigated = self.navigate(state, frame);
        let mut output = self.control(state, &navigated.frame);
        self.watch(state, &navigated, &mut output);
        output
    }

    /// The first part of a step: what the sensors say, estimated, as a frame for [`Self::control`].
    // Apart, so that what it takes of the stack is free again when control runs.
    #[inline(never)]
    pub fn navigate(&self, state: &mut StackState, frame: &SensorFrame) -> Navigated {
        let elapsed_us = elapsed_us(state, frame).unwrap_or(0);
        let navigated = self.parameters.navigation.step(&mut state.navigation, frame, elapsed_us);
        state.rejected = state.rejected.saturating_add(navigated.rejected);
        navigated
    }

    /// The last part of a step: whether the rotors push as control told them, and what is to be
    /// logged of the estimate.
    pub fn watch(&self, state: &mut StackState, navigated: &Navigated, output: &mut StackOutput) {
        let seen = Seen {
            achieved: output.inner.as_ref().map(|inner| &inner.mixer.achieved),
            imu: navigated.frame.imu.as_ref(),
            attitude: state.known.attitude.as_ref(),
            velocity: state.known.gnss.map(|gnss| gnss.velocity),
            download_n: self.parameters.twcc.plus.as_ref().map_or(0.0, |plus| plus.wing_download_n),
            wings: state.wing_command,
            dt_s: lower(navigated.elapsed_us as f32 * 1e-6, INNER_STEP_MAX_S),
        };
        let is_wind_new = state.monitor.look(&self.vehicle, &seen);
        output.wind = is_wind_new.then(|| state.monitor.wind());
        output.health = state.monitor.judge(
            &self.vehicle,
            navigated.frame.attitude.as_ref(),
            state.navigation.health,
        );
        output.health = output.health.with(Health::SUNK, self.has_sunk(state, output));
        output.navigation = navigated.terms;
    }

    /// One inner step on the attitude, position and velocity that the frame brings; as total as
    /// [`Self::step`].
    pub fn control(&self, state: &mut StackState, frame: &SensorFrame) -> StackOutput {
        let elapsed_us = elapsed_us(state, frame);
        state.time_us = Some(frame.time_us);
        let merged = frame.merge_into(&mut state.known);
        if let Some(voltage_v) = merged.voltage_v {
            state.supply.hear(voltage_v, &self.parameters.thrust);
        }
        let supplied = state.supply.share();
        state.rejected = state.rejected.saturating_add(merged.rejected);
        let was = state.failsafe.active.mode;
        let estimate = Estimated {
            position_is_lost: state.navigation.health.has(Health::POSITION_LOST),
            imu_hangs: state.navigation.imu_hangs,
        };
        let failsafe = state.failsafe.update(elapsed_us, merged, &state.known, estimate);
        let is_well = failsafe.mode == FailsafeMode::Off;
        let alone = state.failsafe.command_is_lost() && state.known.command.take().is_some();
        if failsafe.mode != was || !is_well || alone {
            self.forget(state, was);
        } else if let Some(command) = &state.known.command {
            state.command = self.airframe.supplied(supplied).envelope.limit(&command.attitude);
            state.wing_command = limit(command.wing, 0.0, 1.0);
        }

        // In most steps the period is the last one still, and that is soon seen.
        let is_same_period = state.outer_begin_us.is_some_and(|begin_us| {
            (begin_us..begin_us.saturating_add(OUTER_PERIOD_US)).contains(&frame.time_us)
        });
        let outer = if is_same_period {
            None
        } else {
            let period = outer_period(frame.time_us);
            let periods = state
                .outer_begin_us
                .map_or(1, |begin_us| period.saturating_sub(outer_period(begin_us)));
            state.outer_begin_us = Some(period.wrapping_mul(OUTER_PERIOD_US));
            let dt_s = lower(periods as f32, 10.0) * OUTER_PERIOD_US as f32 * 1e-6;
            if is_well && state.known.command.is_none() {
                self.outer(state, frame, dt_s)
            } else {
                None
            }
        };
        let reference = self.mission.reference(&state.mission, frame.time_us);
        let dt_s = lower(elapsed_us.unwrap_or(0) as f32 * 1e-6, INNER_STEP_MAX_S);
        let inner = if failsafe.mode == FailsafeMode::Cut {
            None
        } else {
            self.inner(state, frame.time_us, reference.yaw_rad, dt_s)
        };
        let mut rotor_command = [0.0; MAX_ROTORS];
        let propulsion = &self.vehicle.parameters().propulsion;
        for (i, command) in rotor_command.iter_mut().take(self.vehicle.rotors().len()).enumerate() {
            let thrust = inner.as_ref().map_or(0.0, |terms| terms.mixer.rotor_thrust_n[i]);
            *command = propulsion.command_for_thrust(thrust / supplied);
        }
        StackOutput {
            rotor_command,
            wing_command: [state.wing_command; 2],
            reference,
            rejected: state.rejected,
            failsafe,
            health: state.navigation.health,
            navigation: None,
            wind: None,
            outer,
            inner,
        }
    }

    /// What flies while the failsafe acts or until the outer loop's next tick, and what control
    /// resumes from afterwards.
    // Apart, so that a step in which nothing is lost stays short.
    #[inline(never)]
    fn forget(&self, state: &mut StackState, was: FailsafeMode) {
        let share = state.navigation.descent_m_s.map_or(LEVEL_THRUST_SHARE, failsafe::descending);
        let thrust_n = share * self.vehicle.weight_n();
        state.command = AttitudeThrust { thrust_n, ..AttitudeThrust::default() };
        state.wing_command = 0.0;
        state.twcc = TwccState::default();
        if was == FailsafeMode::Cut {
            // It may have turned over meanwhile; the filter leads back from there.
            let (roll, pitch, yaw) = state.known.attitude.map_or((0.0, 0.0, 0.0), |a| a.euler());
            state.filter = EulerReference {
                angle: Vector3::new(roll, pitch, yaw),
                ..EulerReference::default()
            };
            state.attitude = AttitudeState::default();
        }
    }

    /// Where it is believed to be, by the barometer as long as that is heard.
    fn position(state: &StackState) -> Option<In<Ned, f32>> {
        let mut position = state.known.gnss?.position;
        if let Some(altitude) = state.known.altitude_m
            && state.failsafe.active.reason != FailsafeReason::AltitudeLost
        {
            position.vector.z = -altitude;
        }
        Some(position)
    }

    /// Far below the mission's reference, while its outer loop asks for all the thrust there is.
    fn has_sunk(&self, state: &StackState, output: &StackOutput) -> bool {
        let reference_m = output.reference.position.vector.z;
        output.failsafe.mode == FailsafeMode::Off
            && state.known.command.is_none()
            && Self::position(state).is_some_and(|p| p.vector.z - reference_m > SUNK_M)
            && state.command.thrust_n
                >= ALL_SHARE * self.airframe.supplied(state.supply.share()).envelope.thrust_max_n
    }

    fn outer(&self, state: &mut StackState, frame: &SensorFrame, dt_s: f32) -> Option<TwccTerms> {
        let (Some(gnss), Some(ned_from_body)) = (state.known.gnss, state.known.attitude) else {
            return None;
        };
        let position = Self::position(state)?;
        self.mission.sense(
            &mut state.mission,
            frame.time_us,
            position,
            gnss.velocity,
            frame.obstacles(),
        );
        let reference = self.mission.reference(&state.mission, frame.time_us);
        let heading_rad = self.heading_rad(frame.time_us, &ned_from_body);
        let residual = state.monitor.residual();
        let motion = MeasuredMotion {
            residual,
            wind: state.monitor.wind().velocity,
            ..MeasuredMotion::new(position, gnss.velocity, &ned_from_body, heading_rad)
        };
        let airframe = self.airframe.supplied(state.supply.share());
        let plus = self.parameters.twcc.plus.as_ref();
        let ending = plus.zip(self.mission.rest_down_m(frame.time_us)).and_then(|(plus, rest)| {
            plus.ending_sink(&airframe, &motion, &reference, rest, self.excited_n)
        });
        let mut terms = self.parameters.twcc.update(
            &mut state.twcc,
            &airframe,
            &motion,
            &ned_from_body,
            state.known.wing_force,
            ending.as_ref().unwrap_or(&reference),
            dt_s,
        );
        terms.clamped |= ending.is_some();
        state.command = terms.command;
        state.wing_command = self.mission.wing_command(frame.time_us).unwrap_or(terms.wing_command);
        Some(terms)
    }

    fn inner(
        &self,
        state: &mut StackState,
        time_us: u64,
        commanded_rad: f32,
        dt_s: f32,
    ) -> Option<InnerTerms> {
        let (Some(imu), Some(ned_from_body)) = (state.known.imu, state.known.attitude) else {
            return None;
        };
        let gains = &self.parameters.attitude;
        let yaw_rad = gains.form.yaw_target_rad(ned_from_body.heading(), commanded_rad);
        let target = Vector3::new(state.command.roll_rad, state.command.pitch_rad, yaw_rad);
        command_filter::step(
            &mut state.filter,
            &target,
            gains.filter_frequency_rad_s,
            gains.filter_damping,
            dt_s,
        );
        let excitation = self.mission.excitation(time_us).map(|e| e.scaled(self.excited_share));
        let (mut wanted, mut thrust_n) = (state.filter, state.command.thrust_n);
        if let Some(extra) = &excitation {
            wanted = wanted.plus(&extra.attitude);
            thrust_n *= 1.0 + extra.thrust_share;
        }
        let attitude = gains.update(
            &mut state.attitude,
            &self.vehicle.parameters().inertia_kg_m2,
            &ned_from_body,
            &imu.omega.vector,
            &wanted,
            state.saturated,
            dt_s,
        );
        let mut followed_n_m = state.attitude.followed_n_m.into();
        let torque_n_m =
            self.lead.step(&mut followed_n_m, &attitude.torque_n_m.into(), dt_s).into();
        state.attitude.followed_n_m = followed_n_m.into();
        let demand = ThrustTorque { thrust_n, torque_n_m };
        let most_n = self.vehicle.rotor_thrust_at_n(state.supply.share());
        let mixer = self.mixer.allocate_within(most_n, &demand);
        state.saturated = mixer.saturated;
        Some(InnerTerms { filter: state.filter, excitation, attitude, demand, mixer })
    }
}

/// Number of the outer period that a time is in; of times after 13 years the last. The quotient is
/// rounded by less than a hundred thousandth, which is as near as it comes to the next number from
/// below.
fn outer_period(time_us: u64) -> u64 {
    u64::from((whole(time_us) / OUTER_PERIOD_US as f64) as u32)
}

/// Since the last frame, us; `None` for the first. A gap of an hour is as long as any longer one.
fn elapsed_us(state: &StackState, frame: &SensorFrame) -> Option<u32> {
    state.time_us.map(|last| u32::try_from(frame.time_us.saturating_sub(last)).unwrap_or(u32::MAX))
}

#[cfg(test)]
mod fuzz;
#[cfg(test)]
pub(crate) mod tests;
