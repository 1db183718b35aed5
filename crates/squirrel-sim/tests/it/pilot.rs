//! A policy in the loop: what it commands flies, is logged as an input, and is taken over by the
//! outer loop where it ceases.

use squirrel_core::nalgebra::Vector3;
use squirrel_core::policy::{Policy, Span};
use squirrel_core::stack::failsafe::{COMMAND_LIMIT_US, FailsafeReason};
use squirrel_core::stack::{SensorFrame, StackOutput};
use squirrel_log::FlightLog;
use squirrel_log::flight_code::INPUT_SOURCES;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{
    Flight, FlightComputer, FlightError, InProcess, Integrator, Pilot, Setup,
};
use squirrel_sim::replay::{replay, setup as setup_of};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_sim::weights::PolicyWeights;

fn setup(scenario: &str) -> Setup {
    let scenario = Scenario::find(scenario).unwrap();
    Setup { vehicle: VehicleFile::squirrel(), arm: Arm::Pc, scenario, integrator: Integrator::Rk4 }
}

/// A controller that anybody would write, as a network: acceleration from position and velocity
/// errors, where tanh is nearly linear; wings folded.
fn by_hand(span: &Span) -> Policy {
    const POSITION_PER_S2: f32 = 1.5;
    const VELOCITY_PER_S: f32 = 2.2;
    const SMALL: f32 = 0.1;
    let tilt = 1.0 / (9.81 * span.tilt_max_rad);
    let mut policy = Policy::filled(0.0);
    // North by pitching down, east by rolling right, down by less thrust.
    for (axis, action, gain) in [(0, 1, -tilt), (1, 0, tilt), (2, 2, -1.0 / 9.81)] {
        // Of what is seen over its scale: position 2 m, velocity 5 m/s.
        policy.first.weight[axis][axis] = SMALL * gain * POSITION_PER_S2 * 2.0;
        policy.first.weight[3 + axis][axis] = SMALL * gain * VELOCITY_PER_S * 5.0;
        policy.second.weight[axis][axis] = 1.0;
        policy.output.weight[axis][action] = 1.0 / SMALL;
    }
    policy.output.bias[3] = -1.0;
    policy
}

/// Weights that mean nothing.
fn random() -> Policy {
    let (mut policy, mut bits) = (Policy::filled(0.0), 1u32);
    for number in policy.tensors_mut().into_iter().flatten() {
        bits = bits.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        *number = (bits >> 8) as f32 / (1u32 << 23) as f32 - 1.0;
    }
    policy
}

fn fly(setup: &Setup, computer: &mut dyn FlightComputer, policy: &Policy) -> Flight {
    let weights = PolicyWeights { policy: *policy, name: "test".to_owned() };
    let mut pilot = Pilot::new(weights, setup, &setup.stack().unwrap()).unwrap();
    setup.fly_on(computer, Some(&mut pilot), true, |_| {}).unwrap()
}

fn flown(setup: &Setup, policy: &Policy) -> Flight {
    fly(setup, &mut InProcess::new(setup.stack().unwrap()), policy)
}

fn hand_of(setup: &Setup) -> Policy {
    by_hand(&Span::of(setup.stack().unwrap().vehicle()))
}

#[test]
fn a_controller_in_a_network_hovers_and_tracks_and_a_random_one_does_not() {
    for (scenario, within_m) in [("hover", 0.3), ("track", 2.5)] {
        let setup = setup(scenario);
        let hand = flown(&setup, &hand_of(&setup)).metrics;
        let chance = flown(&setup, &random()).metrics;
        assert!(hand.rmse_m < within_m, "{scenario}: {hand:?}");
        assert!(chance.rmse_m > 5.0 * hand.rmse_m, "{scenario}: {chance:?}");
        assert!(hand.wings_open_s == 0.0, "{hand:?}");
    }
}

#[test]
fn a_flight_replays_to_the_bit_without_the_policy() {
    let setup = setup("track");
    let policy = hand_of(&setup);
    let folder = std::env::temp_dir().join(format!("squirrel-pilot-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("track.mcap");
    flown(&setup, &policy).log.unwrap().write(&path).unwrap();
    let mut log = FlightLog::read(&path).unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    let hash = PolicyWeights { policy, name: String::new() }.hash();
    assert_eq!((log.metadata["policy"].as_str(), &log.metadata["policy_hash"]), ("test", &hash));
    let result = replay(&log, &setup_of(&log).unwrap()).unwrap();
    assert_eq!(result.first_difference, None);
    // The outer loop flies until the first fix at most, the policy 50 times a second from there.
    let (times, _) = log.channel("offboard.roll_rad_pitch_rad_thrust_n_wing").unwrap();
    assert!((980..=1001).contains(&times.len()), "{}", times.len());
    assert!(log.sources.get("control.outer").is_none_or(|outer| outer.time_s.len() < 5));

    // A command is an input as any other.
    assert!(INPUT_SOURCES.contains(&"offboard"));
    let time_s = times[500];
    let numbers = log.source_mut("offboard").channels.values_mut().next().unwrap();
    numbers.values[4 * 500 + 2] += 0.01;
    let difference = replay(&log, &setup_of(&log).unwrap()).unwrap().first_difference.unwrap();
    assert_eq!(difference.time_s, time_s);
    assert!(difference.channel.starts_with("control.inner."), "{difference:?}");
}

/// The mission goes straight on for a policy: to avoid is its own business.
#[test]
fn an_obstacle_counts_when_the_lookout_sees_it_and_the_reference_goes_on() {
    let setup = setup("avoid");
    let flight = flown(&setup, &hand_of(&setup));
    assert_eq!(flight.metrics.encounters, 1);
    assert!(flight.metrics.window_s > 5.9, "{:?}", flight.metrics);
    let log = flight.log.unwrap();
    let (_, reference) = log.channel("reference.position_ned_m").unwrap();
    let rows = || reference.values.chunks_exact(3);
    assert!(rows().all(|row| row[1] == 0.0) && rows().last().unwrap()[0] > 50.0, "straight on");
}

/// A flight computer whose link to the policy breaks.
struct Deaf {
    computer: InProcess,
    from_us: u64,
    lost_us: Option<u64>,
    resumed_us: Option<u64>,
}

impl FlightComputer for Deaf {
    fn step(&mut self, frame: &SensorFrame) -> Result<(StackOutput, u32), FlightError> {
        let mut frame = *frame;
        if frame.time_us >= self.from_us {
            frame.command = None;
        }
        let answer = self.computer.step(&frame)?;
        if answer.0.failsafe.reason == FailsafeReason::CommandLost {
            self.lost_us = self.lost_us.or(Some(frame.time_us));
            if answer.0.outer.is_some() {
                self.resumed_us = self.resumed_us.or(Some(frame.time_us));
            }
        }
        Ok(answer)
    }
}

#[test]
fn when_the_link_breaks_the_outer_loop_flies_the_mission() {
    let setup = setup("track");
    let computer = InProcess::new(setup.stack().unwrap());
    let mut deaf = Deaf { computer, from_us: 8_000_000, lost_us: None, resumed_us: None };
    let log = fly(&setup, &mut deaf, &hand_of(&setup)).log.unwrap();
    let (lost_us, resumed_us) = (deaf.lost_us.unwrap(), deaf.resumed_us.unwrap());
    let limit_us = u64::from(COMMAND_LIMIT_US);
    assert!(
        (8_000_000 + limit_us - 20_000..=8_000_000 + limit_us + 4000).contains(&lost_us),
        "{lost_us}"
    );
    assert!(resumed_us - lost_us < 100_000, "{resumed_us}");
    // In the end it is where a flight without any policy is.
    let alone = setup.fly(true, |_| {}).unwrap().log.unwrap();
    let at = |log: &FlightLog, t_s: f64| {
        let (time_s, truth) = log.channel("truth.position_ned_m").unwrap();
        Vector3::from_row_slice(truth.row(time_s.partition_point(|t| *t < t_s)))
    };
    let apart_m = |t_s: f64| (at(&log, t_s) - at(&alone, t_s)).norm();
    assert!(apart_m(7.9) > 0.5, "{}: the policy flies another way", apart_m(7.9));
    assert!(apart_m(19.9) < 0.1, "{}", apart_m(19.9));
}
