//! The stack as a whole: the loops' rates, limits for any input, commands from outside.

use super::*;
use crate::control::backstepping::AttitudeForm;
use crate::control::twcc;
use crate::control::wing_force::{ForceModel, Guard, fixtures::loud};
use crate::estimate::eskf::EskfParameters;
use crate::estimate::navigator::Filter;
use crate::guidance::excite::{Leg, Multisine, Programme};
use crate::guidance::sensing::Obstacle;
use crate::math::GRAVITY_M_S2;
use crate::vehicle::fixtures::squirrel;
use nalgebra::UnitQuaternion;
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

/// In hover, on an estimator of its own.
pub(crate) fn stack_with(navigation: Navigation) -> Stack {
    let hover = Mission::Hover { position: In::zero() };
    let stack = flying(&ForceModel::FlatPlate, AttitudeForm::Quaternion, &hover);
    let parameters = StackParameters { navigation, ..stack.parameters };
    Stack::new(stack.vehicle, parameters, hover).unwrap()
}

fn flying(force_model: &ForceModel, form: AttitudeForm, mission: &Mission) -> Stack {
    let attitude = AttitudeGains {
        form,
        c1_per_s: Vector3::new(9.0, 9.0, 4.0),
        c2_per_s: Vector3::new(14.0, 14.0, 5.0),
        lambda_per_s2: Vector3::new(8.0, 8.0, 2.0),
        integral_max_rad_s: 0.1,
        rotor_lead: 1.0,
        filter_frequency_rad_s: 20.0,
        filter_damping: 1.0,
    };
    let twcc = TwccParameters { force_model: *force_model, ..twcc::fixtures::parameters() };
    let parameters = StackParameters {
        attitude,
        twcc,
        navigation: Navigation::external(),
        thrust: ThrustByVoltage::CONSTANT,
    };
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

/// A body that turns as the rotors make it, on the spot, yawed away from the reference, which asks
/// it to tilt: degrees between the thrust axis and the one that was asked for, worst after
/// `settled_s`, and of yaw in the end.
fn beside_what_was_asked_deg(form: AttitudeForm, yaw_rad: f32, settled_s: f32) -> (f32, f32) {
    let goal = Mission::Hover { position: In::new(Vector3::new(0.9, -0.5, 0.0)) };
    let (stack, mut state) = (flying(&ForceModel::FlatPlate, form, &goal), StackState::default());
    let inertia = stack.vehicle().parameters().inertia_kg_m2;
    let (mut attitude, mut omega) =
        (Rotation::<Ned, Body, f32>::from_euler(0.0, 0.0, yaw_rad), Vector3::zeros());
    let (mut asked, mut worst) = (Vector3::z(), 0.0_f32);
    let dt_s = 1.0 / 300.0;
    for k in 0..1200u64 {
        let mut frame = level(k * 1_000_000 / 300);
        frame.attitude = Some(attitude);
        frame.imu = Some(Imu {
            omega: In::new(omega),
            specific_force: In::new(Vector3::new(0.0, 0.0, -9.8)),
        });
        let output = stack.step(&mut state, &frame);
        if let Some(outer) = output.outer {
            let pull =
                Vector3::new(0.0, 0.0, GRAVITY_M_S2 as f32) - outer.position.acceleration.vector;
            asked = pull / pull.norm();
        }
        let torque = output.inner.unwrap().mixer.achieved.torque_n_m;
        omega += inertia.try_inverse().unwrap() * (torque - omega.cross(&(inertia * omega))) * dt_s;
        attitude =
            Rotation::new(attitude.quaternion * UnitQuaternion::from_scaled_axis(omega * dt_s));
        let beside = (attitude * In::new(Vector3::z())).vector.angle(&asked).to_degrees();
        if k as f32 * dt_s > settled_s {
            worst = worst.max(beside);
        }
    }
    (worst, attitude.euler().2.to_degrees().abs())
}

/// Where the vehicle points and where it should point are two things: thrust goes where the outer
/// loop wants it all the while that yaw is on its way.
#[test]
fn thrust_points_where_it_was_asked_to_whatever_the_yaw_error() {
    for form in [AttitudeForm::Euler, AttitudeForm::Quaternion] {
        for yaw_deg in [0.0_f32, 10.0, -30.0, 60.0, 90.0, -90.0] {
            let (beside, yaw) = beside_what_was_asked_deg(form, yaw_deg.to_radians(), 0.5);
            // The Euler law's roll and pitch are of the heading of the last tick while it turns on.
            let most = if form == AttitudeForm::Euler { 9.0 } else { 4.0 };
            assert!(
                beside < most,
                "{form:?} at {yaw_deg} deg of yaw: {beside} deg beside what was asked for"
            );
            assert!(yaw < 3.0, "{form:?} from {yaw_deg} deg: still {yaw} deg of yaw");
        }
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

#[test]
fn another_start_is_taken_or_refused() {
    let stack = stack(AttitudeForm::Quaternion);
    let start = Start { altitude_offset_m: 3.0, ..Start::at_origin() };
    let elsewhere = stack.starting(start).unwrap();
    assert_eq!(elsewhere.parameters().navigation.start, start);
    assert_eq!(elsewhere.vehicle(), stack.vehicle());
    let nowhere = Start { altitude_offset_m: f32::NAN, ..start };
    assert_eq!(stack.starting(nowhere).unwrap_err().field, "estimation.start.position_ned_m");
}

/// A thawed copy continues as the original: the state hides nothing, not even what the network saw.
#[test]
fn a_frozen_state_continues_bit_for_bit() {
    let (stack, mut state) = (
        stack_that_believes(&ForceModel::Parnn(loud()), AttitudeForm::Euler),
        StackState::default(),
    );
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
        let mut blank = StackState { twcc: TwccState::default(), outer_begin_us: None, ..state };
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
    let command = proptest::option::of([number(1.0), number(1.0), number(10.0), number(2.0)]);
    (
        0..3_000_000u64,
        vector(30.0),
        vector(40.0),
        attitude,
        vector(50.0),
        vector(15.0),
        number(100.0),
        command,
    )
        .prop_map(
            |(time_us, omega, force, attitude, position, velocity, altitude, command)| {
                let mut frame = SensorFrame::empty(time_us);
                frame.imu = Some(Imu { omega: In::new(omega), specific_force: In::new(force) });
                frame.attitude = attitude;
                frame.gnss =
                    Some(Gnss { position: In::new(position), velocity: In::new(velocity) });
                frame.altitude_m = Some(altitude);
                frame.wing_force = Some(In::new(force));
                frame.command = command.map(commanded);
                frame.set_obstacles(&[Obstacle { id: 1, north_m: omega.x, east_m: omega.y }]);
                frame
            },
        )
}

proptest! {
    /// State and outputs stay finite, outputs inside limits, for any sensor values and times, also
    /// backwards.
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

/// Roll, pitch, thrust, wings.
pub(crate) fn commanded([roll_rad, pitch_rad, thrust_n, wing]: [f32; 4]) -> PilotCommand {
    PilotCommand { attitude: AttitudeThrust { roll_rad, pitch_rad, thrust_n }, wing }
}

#[test]
fn a_command_flies_within_limits_instead_of_the_outer_loop() {
    let (stack, mut state) = (stack(AttitudeForm::Quaternion), StackState::default());
    let mut fly = |time_us: u64, command: Option<[f32; 4]>| {
        let mut frame = level(time_us);
        frame.command = command.map(commanded);
        let output = stack.step(&mut state, &frame);
        assert_eq!(output.outer.is_none(), command.is_some_and(|c| c[0].is_finite()), "{time_us}");
        (state.command, output)
    };
    let (before, _) = fly(0, Some([f32::NAN, 0.0, 5.0, 0.0]));
    let (inside, flown) = fly(100_000, Some([0.1, -0.2, 6.0, 0.25]));
    let expected = AttitudeThrust { roll_rad: 0.1, pitch_rad: -0.2, thrust_n: 6.0 };
    assert_eq!((inside, flown.wing_command), (expected, [0.25; 2]));
    assert_eq!(flown.rejected, 1, "the one before was no number, so {before:?} flew");
    assert_eq!(flown.inner.unwrap().demand.thrust_n, 6.0);
    let limits = stack.airframe.envelope;
    let (beyond, flown) = fly(200_000, Some([f32::MAX, -9.0, 1e9, 7.0]));
    assert_eq!((beyond.roll_rad, beyond.pitch_rad), (limits.tilt_max_rad, -limits.tilt_max_rad));
    assert_eq!((beyond.thrust_n, flown.wing_command), (limits.thrust_max_n, [1.0; 2]));
    let (beyond, _) = fly(300_000, Some([0.0, 0.0, -1.0, -1.0]));
    assert_eq!(beyond.thrust_n, limits.thrust_min_n);
}

#[test]
fn when_commands_cease_the_outer_loop_flies_again_as_if_new() {
    let (stack, mut state) = (stack(AttitudeForm::Quaternion), StackState::default());
    let frame = |time_us: u64| {
        let mut frame = level(time_us);
        frame.gnss =
            Some(Gnss { position: In::new(Vector3::new(3.0, 0.0, 0.0)), velocity: In::zero() });
        frame
    };
    // A second of its own, so that the outer loop has something to forget; then commands up to 1.48
    // s.
    let mut resumed = None;
    for k in 0..700u64 {
        let time_us = k * 10_000 / 3;
        let mut frame = frame(time_us);
        frame.command = ((1_000_000..=1_480_000).contains(&time_us) && k % 6 == 0)
            .then(|| commanded([0.2, 0.0, 6.0, 1.0]));
        let output = stack.step(&mut state, &frame);
        let lost = time_us > 1_480_000 + u64::from(failsafe::COMMAND_LIMIT_US);
        assert_eq!(output.failsafe.reason == FailsafeReason::CommandLost, lost, "{time_us}");
        if lost && output.outer.is_some() {
            resumed = resumed.or(output.outer.map(|terms| (time_us, terms)));
        } else if lost && resumed.is_none() {
            assert_eq!(
                (state.command.roll_rad, state.wing_command),
                (0.0, 0.0),
                "level until then"
            );
        } else if (1_000_000..=1_980_000).contains(&time_us) {
            assert_eq!((state.command.roll_rad, output.outer), (0.2, None), "{time_us}");
        }
    }
    let (time_us, terms) = resumed.unwrap();
    assert_eq!(Some(terms), stack.step(&mut StackState::default(), &frame(time_us)).outer);
}

#[test]
fn the_failsafe_acts_whatever_is_commanded() {
    let (stack, mut state) = (stack(AttitudeForm::Quaternion), StackState::default());
    for k in 0..600u64 {
        let mut frame = level(k * 3333);
        frame.command = Some(commanded([0.2, 0.0, 6.0, 1.0]));
        if k >= 300 {
            frame.imu = None;
        }
        let output = stack.step(&mut state, &frame);
        let cut = output.failsafe.mode == FailsafeMode::Cut;
        assert_eq!(cut, k >= 330, "{k}");
        assert_eq!(
            (output.rotor_command == [0.0; 8], output.wing_command == [0.0; 2]),
            (cut, cut),
            "{k}"
        );
    }
}

/// Sines leave half of the thrust above the weight, and are whole where there is enough of it.
#[test]
fn an_excitation_follows_the_thrust_that_is_left() {
    let multisine = Multisine::new([0.01, 0.01, 0.0015], 0.01, 3).unwrap();
    let programme = Programme::new(In::zero(), &[Leg::UNUSED], multisine).unwrap();
    let (mission, parameters) =
        (Mission::Excite(programme), stack(AttitudeForm::Quaternion).parameters);
    let flown = |ratio: f32| {
        let mut vehicle = squirrel();
        vehicle.limits.thrust_max_n = ratio * vehicle.mass_kg * GRAVITY_M_S2 as f32;
        let stack = Stack::new(Vehicle::new(vehicle).unwrap(), parameters, mission).unwrap();
        let taken_n = mission.excitation_thrust_n(&stack.vehicle);
        let output = stack.control(&mut StackState::default(), &level(2_000_000));
        (output.inner.unwrap().excitation.unwrap(), taken_n / stack.vehicle.weight_n())
    };
    let (whole, taken) = flown(2.0);
    assert_eq!(Some(whole), mission.excitation(2_000_000));
    assert!(taken > 0.06 && taken < 0.2, "{taken} of the weight");
    let (smaller, _) = flown(1.1);
    let share = smaller.attitude.angle.norm() / whole.attitude.angle.norm();
    assert!((share * taken - 0.05).abs() < 1e-3, "{share} of {taken}");
    assert!((smaller.thrust_share / whole.thrust_share - share).abs() < 1e-4);
    assert_eq!(flown(1.0).0.attitude.acceleration.norm(), 0.0, "nothing is left");
}

/// Below its reference with all the thrust there is, and only then.
#[test]
fn who_sinks_with_all_the_thrust_says_so() {
    let parameters = stack(AttitudeForm::Quaternion).parameters;
    let says = |down_m: f32, ratio: f32, command: Option<PilotCommand>| {
        let mut vehicle = squirrel();
        vehicle.limits.thrust_max_n = ratio * vehicle.mass_kg * GRAVITY_M_S2 as f32;
        let mission = Mission::Hover { position: In::zero() };
        let stack = Stack::new(Vehicle::new(vehicle).unwrap(), parameters, mission).unwrap();
        let mut frame = level(0);
        let position = In::new(Vector3::new(0.0, 0.0, down_m));
        frame.gnss = Some(Gnss { position, velocity: In::zero() });
        frame.altitude_m = Some(-down_m);
        frame.command = command;
        stack.step(&mut StackState::default(), &frame).health.has(Health::SUNK)
    };
    assert!(says(2.0, 1.1, None));
    assert!(!says(1.0, 1.1, None), "not yet");
    assert!(!says(2.0, 2.0, None), "there is thrust to climb with");
    assert!(!says(2.0, 1.1, Some(commanded([0.0, 0.0, 100.0, 0.0]))), "asked for from outside");
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

/// An inertial unit that hangs is found though the filter takes another bias off it in each step;
/// and it stays with what it knew.
#[test]
fn a_single_unit_that_hangs_in_flight_is_found_behind_the_filter() {
    let eskf = Filter::Eskf(EskfParameters::default());
    let stack = stack_with(Navigation { filter: eskf, ..Navigation::external() });
    let mut state = StackState::default();
    let (mut last, mut found) = (None, None);
    for k in 0..1200u64 {
        let mut frame = level(k * 3333);
        let wobble = 0.02 * (k as f32 * 0.3).sin();
        if let Some(imu) = &mut frame.imu {
            imu.omega = In::new(Vector3::new(0.05 + wobble, -wobble, 0.01));
        }
        frame.altitude_m = k.is_multiple_of(6).then_some(wobble);
        frame.gnss = frame.gnss.filter(|_| k.is_multiple_of(30));
        if k >= 900 {
            frame.imu = last;
        }
        last = frame.imu;
        let output = stack.step(&mut state, &frame);
        if output.failsafe.reason == FailsafeReason::ImuStuck && found.is_none() {
            found = Some(k);
            assert_eq!(output.failsafe.mode, FailsafeMode::Cut);
        }
        assert!(k >= 900 || output.failsafe.mode == FailsafeMode::Off, "{k}: {output:?}");
    }
    assert!(found.is_some_and(|k| (995..=1010).contains(&k)), "{found:?}");
}
