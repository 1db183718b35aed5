//! The whole flight code as one function: `step(state, frame) -> output`.
//!
//! ```text
//! frame -> latest valid measurements
//!   10 Hz:  guidance -> TWCC (PC, WOEG, WIIC) -> roll, pitch, thrust, wings
//!   300 Hz: command filter (+ excitation) -> integral backstepping -> mixer -> rotor commands
//! ```
//! When a sensor is gone or hangs, [`failsafe`] levels or cuts. [`Stack`] is constant in flight; [`StackState`] is everything that changes, one plain struct that can be frozen, logged
//! and thawed. Time comes in with the frame. A step never panics, allocates or loops without bound; a measurement that is
//! not finite is rejected and the last valid one kept.

pub mod failsafe;
mod frame;
pub mod wire;

pub use frame::{Gnss, Imu, MAX_OBSTACLES, SensorFrame};

use crate::control::backstepping::{AttitudeGains, AttitudeState, AttitudeTerms, INNER_STEP_MAX_S};
use crate::control::command_filter::{self, EulerReference};
use crate::control::mixer::{Mixer, MixerTerms, ThrustTorque};
use crate::control::position::Motion;
use crate::control::twcc::{Airframe, TwccParameters, TwccState, TwccTerms};
use crate::control::{AttitudeThrust, Reference};
use crate::frames::{Body, In, Ned, Rotation};
use crate::guidance::excite::Excitation;
use crate::guidance::mission::{Mission, MissionState};
use crate::math::lower;
use crate::vehicle::{MAX_ROTORS, ParameterError, PerRotor, Vehicle};
use failsafe::{Failsafe, FailsafeMode, FailsafeReason, FailsafeState, LEVEL_THRUST_SHARE};
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
}

/// The flight code of one vehicle on one mission.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stack {
    vehicle: Vehicle<f32>,
    airframe: Airframe,
    mixer: Mixer,
    parameters: StackParameters,
    mission: Mission,
}

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
}

/// Everything that changes in flight.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StackState {
    /// Latest valid measurements.
    pub known: Known,
    /// Time of the last frame, us; `None` before the first.
    pub time_us: Option<u64>,
    /// Number of the outer period that was handled last.
    pub outer_index: Option<u64>,
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
    /// What the outer loop asked for last.
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
    /// The outer loop, where it ran in this step.
    pub outer: Option<TwccTerms>,
    /// The inner loop, once attitude and rate are known; rotors stand still before that and while the failsafe cuts. Until the first fix it asks for no
    /// thrust, and rotors only turn as far as levelling takes.
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
        mission.check()?;
        let tilt_max_rad = p.limits.tilt_max_rad - mission.excitation_tilt_rad();
        if !(tilt_max_rad > 0.0) {
            let reason = "must be above what the mission's multisine adds";
            return Err(ParameterError::of("limits.tilt_max_rad", p.limits.tilt_max_rad, reason));
        }
        let airframe = Airframe::new(&vehicle, parameters.twcc.thrust_min_n, tilt_max_rad);
        Ok(Self { mixer: Mixer::new(&vehicle)?, vehicle, airframe, parameters, mission })
    }

    /// The vehicle as the flight code believes it to be.
    pub fn vehicle(&self) -> &Vehicle<f32> {
        &self.vehicle
    }

    /// One inner step. Total: bounded work, no panic, outputs finite and within limits for any frame.
    pub fn step(&self, state: &mut StackState, frame: &SensorFrame) -> StackOutput {
        // A gap of an hour is as long as any longer one.
        let elapsed_us = state.time_us.map(|last| {
            let elapsed_us = frame.time_us.saturating_sub(last);
            u32::try_from(elapsed_us).unwrap_or(u32::MAX)
        });
        state.time_us = Some(frame.time_us);
        let merged = frame.merge_into(&mut state.known);
        state.rejected = state.rejected.saturating_add(merged.rejected);
        let was = state.failsafe.active.mode;
        let failsafe = state.failsafe.update(elapsed_us, merged, &state.known);
        if failsafe.mode != was || failsafe.mode != FailsafeMode::Off {
            self.forget(state, was);
        }

        // In most steps the period is the last one still; a processor without 64-bit division sees that sooner.
        let is_same_period = state.outer_index.is_some_and(|last| {
            let begin_us = last.wrapping_mul(OUTER_PERIOD_US);
            (begin_us..begin_us.saturating_add(OUTER_PERIOD_US)).contains(&frame.time_us)
        });
        let outer = if is_same_period {
            None
        } else {
            let outer_index = frame.time_us / OUTER_PERIOD_US;
            let periods = state.outer_index.map_or(1, |last| outer_index.saturating_sub(last));
            state.outer_index = Some(outer_index);
            let dt_s = lower(periods as f32, 10.0) * OUTER_PERIOD_US as f32 * 1e-6;
            if failsafe.mode == FailsafeMode::Off { self.outer(state, frame, dt_s) } else { None }
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
            *command = propulsion.command_for_thrust(thrust);
        }
        StackOutput {
            rotor_command,
            wing_command: [state.wing_command; 2],
            reference,
            rejected: state.rejected,
            failsafe,
            outer,
            inner,
        }
    }

    /// What flies while the failsafe acts, and what control resumes from afterwards.
    fn forget(&self, state: &mut StackState, was: FailsafeMode) {
        let thrust_n = LEVEL_THRUST_SHARE * self.vehicle.weight_n();
        state.command = AttitudeThrust { thrust_n, ..AttitudeThrust::default() };
        state.wing_command = 0.0;
        state.twcc = TwccState::default();
        if was == FailsafeMode::Cut {
            // It may have turned over meanwhile; the filter leads back from there.
            let (roll, pitch, yaw) = state.known.attitude.map_or((0.0, 0.0, 0.0), |a| a.euler());
            state.filter =
                EulerReference { angle: Vector3::new(roll, pitch, yaw), ..EulerReference::default() };
            state.attitude = AttitudeState::default();
        }
    }

    fn outer(&self, state: &mut StackState, frame: &SensorFrame, dt_s: f32) -> Option<TwccTerms> {
        let (Some(gnss), Some(ned_from_body)) = (state.known.gnss, state.known.attitude) else { return None };
        let mut position = gnss.position;
        if let Some(altitude) = state.known.altitude_m
            && state.failsafe.active.reason != FailsafeReason::AltitudeLost
        {
            position.vector.z = -altitude;
        }
        self.mission.sense(&mut state.mission, frame.time_us, position, gnss.velocity, frame.obstacles());
        let reference = self.mission.reference(&state.mission, frame.time_us);
        let (roll_rad, pitch_rad, yaw_rad) = ned_from_body.euler();
        let motion = Motion { position, velocity: gnss.velocity, roll_rad, pitch_rad, yaw_rad };
        let terms = self.parameters.twcc.update(
            &mut state.twcc,
            &self.airframe,
            &motion,
            &ned_from_body,
            state.known.wing_force,
            &reference,
            dt_s,
        );
        state.command = terms.command;
        state.wing_command = self.mission.wing_command(frame.time_us).unwrap_or(terms.wing_command);
        Some(terms)
    }

    fn inner(&self, state: &mut StackState, time_us: u64, yaw_rad: f32, dt_s: f32) -> Option<InnerTerms> {
        let (Some(imu), Some(ned_from_body)) = (state.known.imu, state.known.attitude) else { return None };
        let gains = &self.parameters.attitude;
        let target = Vector3::new(state.command.roll_rad, state.command.pitch_rad, yaw_rad);
        command_filter::step(
            &mut state.filter,
            &target,
            gains.filter_frequency_rad_s,
            gains.filter_damping,
            dt_s,
        );
        let excitation = self.mission.excitation(time_us);
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
        let demand = ThrustTorque { thrust_n, torque_n_m: attitude.torque_n_m };
        let mixer = self.mixer.allocate(&demand);
        state.saturated = mixer.saturated;
        Some(InnerTerms { filter: state.filter, excitation, attitude, demand, mixer })
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::control::backstepping::AttitudeForm;
    use crate::control::twcc;
    use crate::control::wing_force::{ForceModel, Guard, fixtures::loud};
    use crate::guidance::sensing::Obstacle;
    use crate::vehicle::fixtures::squirrel;
    use proptest::prelude::*;

    fn stack(form: AttitudeForm) -> Stack {
        stack_that_believes(&ForceModel::FlatPlate, form)
    }

    fn stack_that_believes(force_model: &ForceModel, form: AttitudeForm) -> Stack {
        flying(force_model, form, &Mission::Hover { position: In::zero() })
    }

    pub(crate) fn stack_on(force_model: &ForceModel, mission: &Mission) -> Stack {
        flying(force_model, AttitudeForm::Quaternion, mission)
    }

    fn flying(force_model: &ForceModel, form: AttitudeForm, mission: &Mission) -> Stack {
        let attitude = AttitudeGains {
            form,
            c1_per_s: Vector3::new(9.0, 9.0, 4.0),
            c2_per_s: Vector3::new(14.0, 14.0, 5.0),
            lambda_per_s2: Vector3::new(8.0, 8.0, 2.0),
            integral_max_rad_s: 0.1,
            filter_frequency_rad_s: 20.0,
            filter_damping: 1.0,
        };
        let twcc = TwccParameters { force_model: *force_model, ..twcc::fixtures::parameters() };
        let parameters = StackParameters { attitude, twcc };
        Stack::new(Vehicle::new(squirrel()).unwrap(), parameters, *mission).unwrap()
    }

    pub(crate) fn level(time_us: u64) -> SensorFrame {
        let mut frame = SensorFrame::empty(time_us);
        frame.imu =
            Some(Imu { omega: In::zero(), specific_force: In::new(Vector3::new(0.0, 0.0, -9.80665)) });
        frame.attitude = Some(Rotation::identity());
        frame.gnss = Some(Gnss { position: In::zero(), velocity: In::zero() });
        frame
    }

    #[test]
    fn level_on_the_spot_it_commands_hover() {
        for form in [AttitudeForm::Euler, AttitudeForm::Quaternion] {
            let (stack, mut state) = (stack(form), StackState::default());
            let output = stack.step(&mut state, &level(0));
            let p = &stack.vehicle().parameters().propulsion;
            let total: f32 = output.rotor_command[..4]
                .iter()
                .map(|u| p.thrust_coefficient_n_s2 * p.target_speed_rad_s(*u).powi(2))
                .sum();
            assert!((total - stack.vehicle().weight_n()).abs() < 1e-4);
            assert_eq!(output.rotor_command[4..], [0.0; 4]);
        }
    }

    #[test]
    fn the_outer_loop_runs_ten_times_a_second() {
        let (stack, mut state) = (stack(AttitudeForm::Quaternion), StackState::default());
        let ticks: Vec<u64> = (0..300u64)
            .map(|k| k * 1_000_000 / 300)
            .filter(|t| stack.step(&mut state, &level(*t)).outer.is_some())
            .collect();
        assert_eq!(ticks, (0..10).map(|k| k * 100_000).collect::<Vec<_>>());
    }

    #[test]
    fn rotors_stand_still_until_the_attitude_is_known() {
        let (stack, mut state) = (stack(AttitudeForm::Quaternion), StackState::default());
        let output = stack.step(&mut state, &SensorFrame::empty(0));
        assert_eq!(output.rotor_command, [0.0; MAX_ROTORS]);
        assert!(output.inner.is_none() && output.outer.is_none());
    }

    /// A thawed copy continues as the original: the state hides nothing, not even what the network saw.
    #[test]
    fn a_frozen_state_continues_bit_for_bit() {
        let (stack, mut state) =
            (stack_that_believes(&ForceModel::Parnn(loud()), AttitudeForm::Euler), StackState::default());
        let frame = |k: u64| {
            let mut f = level(k * 3333);
            f.attitude = Some(Rotation::from_euler(0.01 * (k as f32).sin(), 0.02, 0.0));
            let velocity = In::new(Vector3::new(5.0 + (0.01 * k as f32).sin(), 0.5, 1.0));
            f.gnss = Some(Gnss { position: In::zero(), velocity });
            f
        };
        for k in 0..450 {
            stack.step(&mut state, &frame(k));
        }
        let mut thawed = state;
        let (mut asked, mut forgetful) = (0, 0);
        for k in 450..900 {
            let output = stack.step(&mut state, &frame(k));
            assert_eq!(output, stack.step(&mut thawed, &frame(k)));
            let Some(terms) = output.outer.and_then(|outer| outer.parnn) else { continue };
            asked += i32::from(terms.guard == Guard::Inside);
            // One without memory would not know its window.
            let mut blank = StackState { twcc: TwccState::default(), outer_index: None, ..state };
            let again = stack.step(&mut blank, &frame(k)).outer.unwrap().parnn.unwrap();
            forgetful += i32::from(again.guard == Guard::WindowNotFull);
        }
        assert!(asked == 15 && forgetful == 15, "{asked}, {forgetful}");
    }

    /// A receiver that loses its velocity neither reaches the network nor makes it forget.
    #[test]
    fn a_velocity_that_is_no_number_never_leaves_the_frame() {
        let stack = stack_that_believes(&ForceModel::Parnn(loud()), AttitudeForm::Quaternion);
        let mut state = StackState::default();
        let mut guards = std::vec::Vec::new();
        for k in 0..20u64 {
            let mut f = level(k * OUTER_PERIOD_US);
            let x = if k == 15 { f32::NAN } else { 6.0 };
            let position = In::new(Vector3::new(0.6 * k as f32, 0.0, 0.0));
            f.gnss = Some(Gnss { position, velocity: In::new(Vector3::new(x, 0.0, 2.0)) });
            let output = stack.step(&mut state, &f);
            let outer = output.outer.unwrap();
            assert!(crate::math::all_finite(&outer.wing_force.vector), "{k}: {outer:?}");
            assert!(output.rotor_command.iter().all(|u| u.is_finite()), "{k}: {output:?}");
            guards.push(outer.parnn.unwrap().guard);
        }
        assert_eq!(state.rejected, 1);
        assert!(guards[..9].iter().all(|g| *g == Guard::WindowNotFull), "{guards:?}");
        assert!(guards[9..].iter().all(|g| *g == Guard::Inside), "{guards:?}");
    }

    /// Mostly plausible, sometimes anything, so that single sensors fail while the others fly on.
    fn number(size: f32) -> impl Strategy<Value = f32> {
        prop_oneof![
            20 => -size..size,
            1 => Just(f32::NAN),
            1 => Just(f32::INFINITY),
            1 => Just(f32::MAX),
            1 => Just(-f32::MAX),
        ]
    }
    fn vector(size: f32) -> impl Strategy<Value = Vector3<f32>> {
        [number(size), number(size), number(size)].prop_map(Vector3::from)
    }
    fn frame() -> impl Strategy<Value = SensorFrame> {
        let attitude = prop_oneof![
            6 => (-3.0..3.0f32, -1.5..1.5f32, -3.0..3.0f32).prop_map(|(r, p, y)| Some(Rotation::from_euler(r, p, y))),
            1 => [number(1.0), number(1.0), number(1.0), number(1.0)].prop_map(Rotation::from_wxyz),
            1 => Just(None),
        ];
        (0..3_000_000u64, vector(30.0), vector(40.0), attitude, vector(50.0), vector(15.0), number(100.0))
            .prop_map(|(time_us, omega, force, attitude, position, velocity, altitude)| {
                let mut frame = SensorFrame::empty(time_us);
                frame.imu = Some(Imu { omega: In::new(omega), specific_force: In::new(force) });
                frame.attitude = attitude;
                frame.gnss = Some(Gnss { position: In::new(position), velocity: In::new(velocity) });
                frame.altitude_m = Some(altitude);
                frame.wing_force = Some(In::new(force));
                frame.set_obstacles(&[Obstacle { id: 1, north_m: omega.x, east_m: omega.y }]);
                frame
            })
    }

    proptest! {
        /// State and outputs stay finite, outputs inside limits, for any sensor values and times, also backwards.
        #[test]
        fn state_and_outputs_stay_finite_and_inside_limits(
            frames in proptest::collection::vec(frame(), 60),
            euler in any::<bool>(),
            learned in any::<bool>(),
        ) {
            let form = if euler { AttitudeForm::Euler } else { AttitudeForm::Quaternion };
            let model = if learned { ForceModel::Parnn(loud()) } else { ForceModel::FlatPlate };
            let stack = stack_that_believes(&model, form);
            let mut state = StackState::default();
            for frame in frames {
                let output = stack.step(&mut state, &frame);
                for u in &output.rotor_command[..4] {
                    prop_assert!((0.0..=1.0).contains(u), "{u}");
                }
                prop_assert!((0.0..=1.0).contains(&output.wing_command[0]));
                let remembered = [
                    state.filter.angle,
                    state.filter.rate,
                    state.filter.acceleration,
                    state.attitude.integral,
                    state.twcc.position.integral,
                    state.twcc.position.last_error.unwrap_or_default(),
                ];
                prop_assert!(remembered.iter().all(crate::math::all_finite), "{remembered:?}");
                prop_assert!(state.twcc.history.window().into_iter().flatten().flatten().all(|x| x.is_finite()));
                if let Some(inner) = &output.inner {
                    let demand = inner.demand;
                    prop_assert!(demand.thrust_n.is_finite() && crate::math::all_finite(&demand.torque_n_m), "{demand:?}");
                }
            }
        }
    }

    #[test]
    fn a_filter_that_would_run_away_is_refused() {
        let mut gains = stack(AttitudeForm::Euler).parameters.attitude;
        gains.filter_frequency_rad_s = 60.0;
        let error = gains.check().unwrap_err().to_string();
        assert!(error.starts_with("control.attitude.filter_frequency_rad_s = 60"), "{error}");
        // The largest frequency that passes settles at the longest step.
        gains.filter_frequency_rad_s = 41.0;
        gains.check().unwrap();
        let mut filter = EulerReference::default();
        for _ in 0..5000 {
            command_filter::step(&mut filter, &Vector3::repeat(0.5), 41.0, 1.0, INNER_STEP_MAX_S);
        }
        assert!((filter.angle - Vector3::repeat(0.5)).norm() < 1e-3, "{filter:?}");
    }
}
