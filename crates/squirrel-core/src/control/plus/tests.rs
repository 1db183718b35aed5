use super::super::AttitudeThrust;
use super::super::position::fixtures::{at, gains, still};
use super::super::position::{AngleLaw, ForceResidual, MeasuredMotion};
use super::super::twcc::OuterAirframe;
use super::super::twcc::fixtures::{airframe, parameters};
use super::super::twcc::{Reason, TwccParameters, TwccState, TwccTerms, WingPolicy};
use super::choice::{Believed, Demand, Residual, normal};
use super::lean::Lean;
use super::*;
use crate::frames::{Body, In, Ned, Rotation};
use proptest::prelude::*;

pub(super) fn plus() -> Plus {
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
        tilt_limit: TiltLimit::Cone,
    }
}

fn calm(airframe: &OuterAirframe) -> Believed<'_> {
    Believed { airframe, velocity: Vector3::zeros(), residual: Residual::default() }
}

fn demand(airframe: &OuterAirframe, acceleration: [f32; 3], velocity: [f32; 3]) -> Demand<'_> {
    let believed = Believed { velocity: velocity.into(), ..calm(airframe) };
    let lean = Lean::of(TiltLimit::Cone, airframe);
    Demand { believed, acceleration: acceleration.into(), weight: 0.25, lean }
}

/// As the position loop asks, which knows no wings.
fn request(forward: f32, right: f32, down: f32) -> AttitudeThrust {
    let pitch_rad = libm::atan2f(-forward, 9.8 - down);
    let roll_rad = libm::atan2f(right * cos(pitch_rad), 9.8 - down);
    AttitudeThrust { roll_rad, pitch_rad, thrust_n: 5.0 }
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
        let guess = request(forward, right, down);
        let best = demand.best(&guess, f32::from(wings));
        prop_assume!(best.command.roll_rad.abs() < 0.5 && best.command.pitch_rad.abs() < 0.5);
        prop_assume!(best.command.thrust_n > 0.6 && best.command.thrust_n < 9.9);
        prop_assert!(best.cost < 0.02, "{best:?}");
        let got = demand.believed.acceleration(&best.command, f32::from(wings));
        prop_assert!((got - demand.acceleration).norm() < 0.3, "{got} for {}", demand.acceleration);
    }

    /// No grid of a degree over the cone and no thrust finds anything better than a hundredth.
    #[test]
    fn outside_them_the_search_finds_what_a_grid_finds(
        forward in -20.0..20.0f32, right in -10.0..10.0f32, down in -6.0..6.0f32, speed in 0.0..9.0f32, climb in -4.0..4.0f32,
        wings in any::<bool>(), thrust_max_n in 6.0..12.0f32,
    ) {
        let mut airframe = airframe();
        airframe.envelope.thrust_max_n = thrust_max_n;
        let demand = demand(&airframe, [forward, right, down], [speed, 0.0, climb]);
        let wings = f32::from(wings);
        let best = demand.best(&request(forward, right, down), wings);
        let degrees = || (-42i8..=42).map(|k| f32::from(k).to_radians());
        let grid = degrees()
            .flat_map(|roll| degrees().map(move |pitch| (roll, pitch)))
            .filter(|(roll, pitch)| demand.lean.within(*roll, *pitch) == (*roll, *pitch))
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

/// Wings that were opened and then are felt to be pushed down fold at the next tick, without a
/// dwell, unless they are worth opening even so.
#[test]
fn wings_that_harm_fold_at_once() {
    let opened = |wings_n: f32| {
        let p = TwccParameters { plus: Some(plus()), dwell_s: 1.0, ..parameters() };
        let mut state = TwccState::default();
        assert_eq!(tick(&p, &mut state, 6.45).wing_command, 1.0);
        let felt = ForceResidual { wings_n, ..ForceResidual::default() };
        tick_with(&p, &mut state, 6.45, felt)
    };
    let (fair, harmed) = (opened(0.0), opened(2.5));
    assert_eq!((fair.wing_command, harmed.wing_command), (1.0, 0.0));
    assert_eq!(harmed.reason, Reason::InsideLimits, "no dwell");
    // What they are worth goes down with the push, and ends where they would not be opened.
    for n in 0u8..=25 {
        let terms = opened(0.1 * f32::from(n));
        let worth = terms.wing.helpful_n / airframe().mass_kg;
        let least = if f32::from(n) > 5.4 { plus().open_above_m_s2 } else { 0.0 };
        assert_eq!(terms.wing_command > 0.0, worth > least, "{n}: {worth}");
    }
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
    let p = TwccParameters { plus: Some(incremental), policy: WingPolicy::Folded, ..parameters() };
    let airframe = airframe();
    let weight = Vector3::new(0.0, 0.0, airframe.mass_kg * GRAVITY_M_S2 as f32);
    for beside in [[0.0; 3], [1.0, -0.5, 0.3], [-1.5, 0.7, -0.8]] {
        let residual =
            ForceResidual { short_n: 1.0, wings_n: 1.0, beside: In::new(Vector3::from(beside)) };
        let mut state = TwccState::default();
        let mut command = AttitudeThrust::default();
        // Attitude follows at once, so that thrust is chosen for where it is.
        for _ in 0..5 {
            let AttitudeThrust { roll_rad, pitch_rad, .. } = command;
            let motion = MeasuredMotion { roll_rad, pitch_rad, residual, ..still() };
            let attitude = Rotation::<Ned, Body, f32>::from_euler(roll_rad, pitch_rad, 0.0);
            state.last = None;
            let goal = at(0.0, 0.0, 0.0);
            command = p.update(&mut state, &airframe, &motion, &attitude, None, &goal, 0.1).command;
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
    assert_eq!(weight(30.0, 0.0), weight(3.0, 0.0), "a vehicle that is level climbs no faster");
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
    assert!(error(Plus { delay_s: f32::NAN, ..plus() }).starts_with("control.plus.delay_s = NaN"));
    assert!(
        error(Plus { thrust_share: 1.5, ..plus() }).starts_with("control.plus.thrust_share = 1.5")
    );
    let exact = PositionGains { angle_law: AngleLaw::Exact, integral_max_m: -1.0, ..gains() };
    assert!(
        error(Plus { position: exact, ..plus() })
            .starts_with("control.position.integral_max_m = -1")
    );
    plus().check().unwrap();
}

/// What leans too far leans to the same side as far as it may, wherever the nose points; the box's
/// corner is as far, and never what thrust cannot hold.
#[test]
fn a_cone_has_no_corners() {
    let mut airframe = airframe();
    let weight_n = airframe.mass_kg * GRAVITY_M_S2 as f32;
    let box_max = airframe.envelope.tilt_max_rad;
    let corner = libm::acosf(cos(box_max) * cos(box_max));
    for (thrust_to_weight, most_rad) in
        [(1.0, box_max), (1.2, libm::acosf(0.97 / 1.2)), (1.3, corner), (3.0, corner)]
    {
        airframe.envelope.thrust_max_n = thrust_to_weight * weight_n;
        let cone = Lean::of(TiltLimit::Cone, &airframe);
        for side in 0u8..24 {
            let (right, ahead) = libm::sincosf(f32::from(side) * core::f32::consts::TAU / 24.0);
            let (roll_rad, pitch_rad) = (1.2 * right, -1.2 * ahead);
            let (asked, n) = (normal(roll_rad, pitch_rad), {
                let (roll_rad, pitch_rad) = cone.within(roll_rad, pitch_rad);
                normal(roll_rad, pitch_rad)
            });
            assert!((libm::acosf(n.z) - most_rad).abs() < 1e-3, "{thrust_to_weight} {side}: {n}");
            let beside = n.x * asked.y - n.y * asked.x;
            assert!(beside.abs() < 1e-5 && n.x * asked.x + n.y * asked.y > 0.0, "{side}");
            let within = (0.5 * right, -0.1 * ahead);
            assert_eq!(cone.within(within.0, within.1), within);
        }
    }
    // A small-angle request of 3 rad leans ahead, not back.
    let cone = Lean::of(TiltLimit::Cone, &airframe);
    assert!(cone.within(0.0, -3.0).1 < -0.5);
    let four_sides = Lean::of(TiltLimit::Box, &airframe);
    assert_eq!(four_sides.within(1.2, -0.1), (box_max, -0.1));
    assert_eq!(four_sides.within(-1.2, 1.2), (-box_max, box_max));
}

/// Braking along the nose and across it are the same in the cone; the box brakes less along an axis.
#[test]
fn it_brakes_alike_to_every_side() {
    let mut airframe = airframe();
    airframe.envelope.thrust_max_n = 2.0 * airframe.mass_kg * GRAVITY_M_S2 as f32;
    let left = |tilt: TiltLimit, heading_rad: f32| {
        let (s, c) = libm::sincosf(heading_rad);
        let asked = demand(&airframe, [-8.0 * c, -8.0 * s, 0.0], [0.0; 3]);
        let asked = Demand { lean: Lean::of(tilt, &airframe), ..asked };
        let guess = AttitudeThrust { roll_rad: -0.6 * s, pitch_rad: 0.6 * c, thrust_n: 5.0 };
        sqrt(asked.best(&guess, 0.0).cost)
    };
    for heading_rad in [0.0, 0.4, 0.785, 1.2, 1.571] {
        assert!(left(TiltLimit::Cone, heading_rad) < 0.1, "{heading_rad}");
    }
    assert!(left(TiltLimit::Box, 0.0) > 1.0 && left(TiltLimit::Box, 0.785) < 0.1);
}
