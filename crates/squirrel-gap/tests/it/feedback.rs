//! A controller feeds its gyroscope back, and with it the gyroscope's noise: what that makes of
//! commands and measured accelerations is no delay.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::support::{vehicle, vehicle_with};
use hidden_effects::draw::Draw;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use squirrel_core::dynamics::State;
use squirrel_core::effects::{CgOffset, Effect};
use squirrel_core::frames::In;
use squirrel_core::math::GRAVITY_M_S2;
use squirrel_core::vehicle::Vehicle;
use squirrel_gap::{Baseline, Kind, Value, Verdict, contradictions, diagnose, diagnose_since};
use squirrel_log::FlightLog;
use squirrel_sim::plant::Plant;
use squirrel_sim::vehicle_file::VehicleFile;
use std::f64::consts::{PI, SQRT_2};

const FILE: &str = "squirrel.toml";
/// A drag in the place of none, for vehicle files.
const DRAG: (&str, &str) = (
    "linear_n_s_per_m = { value = [0.0, 0.0, 0.0]",
    "linear_n_s_per_m = { value = [0.25, 0.25, 0.25]",
);
const RATE_HZ: f64 = 200.0;
const FLIGHT_S: f64 = 30.0;
/// Of attitude, 1/s^2 and 1/s.
const GAINS: [f64; 2] = [60.0, 12.0];

/// How a flight is flown: noise of the gyroscope, rad/s, how much thrust swings about hover, how
/// velocity is held, rad s/m, and how much all that is shaken at 3 to 4 Hz, 1/s^2 and of the thrust.
#[derive(Clone, Copy, Default, Debug)]
struct Flown {
    gyro_rad_s: f64,
    heave: f64,
    hold: f64,
    shake: [f64; 2],
}

/// A calm flight: attitude is held about slow sines, by a gyroscope with white noise.
fn flight(flown: &VehicleFile, seed: u64, how: Flown) -> (String, FlightLog) {
    let vehicle = flown.vehicle;
    let (p, rotors) = (*vehicle.parameters(), vehicle.rotors());
    let plant = Plant::new(vehicle, flown.effects, flown.wing.clone(), None, 1e-3).unwrap();
    let mut draw = Draw::new(seed);
    let mut body = State::at_rest();
    let hover_n = p.mass_kg * GRAVITY_M_S2 / rotors.len() as f64;
    let speed = |thrust_n: f64| (thrust_n / p.propulsion.thrust_coefficient_n_s2).sqrt();
    body.rotor_speed_rad_s[..rotors.len()].fill(speed(hover_n));
    let mut state = plant.initial_state(body, 1.0);
    let arms: Vec<Vector3<f64>> = rotors.iter().map(|rotor| rotor.position.vector).collect();
    let squares = arms.iter().fold(Vector3::zeros(), |sum, r| sum + r.component_mul(r));
    let turns = [0.8, 1.1].map(|w| w * (1.0 + 0.1 * seed as f64));
    let mut log = FlightLog::default();
    for k in 0..(FLIGHT_S * RATE_HZ) as usize {
        let t = k as f64 / RATE_HZ;
        let attitude = UnitQuaternion::new_unchecked(state.body.attitude);
        let (roll, pitch, _) = attitude.euler_angles();
        let gyro = state.body.omega.vector + Vector3::from(draw.normal3(how.gyro_rad_s));
        let v = attitude.inverse() * state.body.velocity.vector;
        let held = [-how.hold * v.y, how.hold * v.x];
        let asked = [0, 1].map(|axis| 0.15 * (turns[axis] * t).sin() + held[axis]);
        let turn =
            |axis: usize, angle: f64| GAINS[0] * (asked[axis] - angle) - GAINS[1] * gyro[axis];
        let [shaken, heaved] = how.shake;
        let quick = Vector3::new((19.0 * t).sin(), (23.0 * t).sin(), 0.0) * shaken;
        let moment =
            p.inertia_kg_m2 * (Vector3::new(turn(0, roll), turn(1, pitch), -gyro.z) + quick);
        let heave = how.heave * (0.7 * turns[0] * t).sin() + heaved * (25.0 * t).sin();
        let thrust_n = hover_n * (1.0 + heave);
        let mut command = [0.0; 8];
        for (u, r) in command.iter_mut().zip(&arms) {
            let more = r.x * moment.y / squares.x - r.y * moment.x / squares.y;
            *u = speed((thrust_n + more).max(0.0)) / p.propulsion.speed_max_rad_s;
        }
        let felt = plant.wrench(&state, In::new(Vector3::zeros())).force.vector / p.mass_kg
            + Vector3::from(draw.normal3(0.05));
        let seen = attitude * UnitQuaternion::from_scaled_axis(draw.normal3(0.002).into());
        let velocity = state.body.velocity.vector + Vector3::from(draw.normal3(0.01));
        let position = state.body.position.vector + Vector3::from(draw.normal3(0.002));
        let Quaternion { coords } = seen.into_inner();
        log.source_mut("imu").push(
            t,
            &[("omega_body_rad_s", gyro.as_slice()), ("specific_force_body_m_s2", felt.as_slice())],
        );
        let q = [coords.w, coords.x, coords.y, coords.z];
        log.source_mut("attitude").push(t, &[("q_ned_from_body_wxyz", &q)]);
        let fixes: [(&str, &[f64]); 2] =
            [("velocity_ned_m_s", velocity.as_slice()), ("position_ned_m", position.as_slice())];
        log.source_mut("gnss").push(t, &fixes);
        log.source_mut("rotor").push(t, &[("command", &command[..rotors.len()])]);
        for _ in 0..(1e3 / RATE_HZ) as usize {
            plant.step(&mut state, &command, [0.0; 2], In::new(Vector3::zeros()));
        }
    }
    (format!("flight {seed}"), log)
}

fn verdict(flown: &VehicleFile, how: Flown) -> Verdict {
    verdict_of(&vehicle(FILE), flown, how)
}

fn verdict_of(file: &VehicleFile, flown: &VehicleFile, how: Flown) -> Verdict {
    let flights = [1, 2, 3].map(|seed| flight(flown, seed, how));
    let verdict = diagnose(file, &flights[..2], &flights[2..], &|_| {}).unwrap().verdict;
    println!("{}", verdict.words);
    verdict
}

/// A log behind the filters of an autopilot: gyroscope and accelerometer pass a filter of second
/// order (Butterworth), which delays by sqrt(2) / (2 pi corner).
fn filtered((name, mut log): (String, FlightLog), corners_hz: [f64; 2]) -> (String, FlightLog) {
    let imu = log.source_mut("imu");
    let channels = ["omega_body_rad_s", "specific_force_body_m_s2"];
    for (channel, corner_hz) in channels.into_iter().zip(corners_hz) {
        let values = &mut imu.channels.get_mut(channel).unwrap().values;
        // Bilinear transform, its corner where it belongs.
        let w = (PI * corner_hz / RATE_HZ).tan();
        let scale = 1.0 + SQRT_2 * w + w * w;
        let (b, a1, a2) =
            (w * w / scale, 2.0 * (w * w - 1.0) / scale, (1.0 - SQRT_2 * w + w * w) / scale);
        for axis in 0..3 {
            let (mut x, mut y) = ([values[axis]; 2], [values[axis]; 2]);
            for row in values.chunks_exact_mut(3) {
                let now = row[axis];
                row[axis] = b * (now + 2.0 * x[0] + x[1]) - a1 * y[0] - a2 * y[1];
                (x, y) = ([now, x[0]], [row[axis], y[0]]);
            }
        }
    }
    (name, log)
}

/// A lively flight behind the filters that autopilots have by default. What is missing is named with
/// its number, and the delays are not: were commands that are late, and noise of the filtered
/// sensors that nothing explains.
#[test]
fn filters_of_an_autopilot_are_no_missing_physics() {
    let how = Flown { gyro_rad_s: 0.002, shake: [20.0, 0.3], ..Flown::default() };
    let corners_hz = [40.0, 30.0];
    let found = |flown: &VehicleFile| {
        let flights = [1, 2, 3].map(|seed| filtered(flight(flown, seed, how), corners_hz));
        let (known, other) = flights.split_at(2);
        let verdict = diagnose(&vehicle(FILE), known, other, &|_| {}).unwrap().verdict;
        println!("{}\n{:?}", verdict.words, verdict.moved);
        verdict
    };
    let none = found(&vehicle(FILE));
    assert!(none.effects.is_empty(), "{}", none.words);
    assert!([Kind::None, Kind::NotIdentifiable].contains(&none.verdict), "{}", none.words);
    let draggy = ("[limits]", "[effects.linear_drag]\nextra_drag_n_s_per_m = 0.2\n\n[limits]");
    let verdict = found(&vehicle_with(FILE, &[draggy]));
    let names: Vec<_> = verdict.effects.iter().map(|effect| effect.name).collect();
    assert_eq!((verdict.verdict, names), (Kind::Named, vec!["linear_drag"]), "{}", verdict.words);
    let Value::Number { value, .. } = verdict.effects[0].parameters["extra_drag_n_s_per_m"] else {
        panic!("{}", verdict.words)
    };
    assert!((value - 0.2).abs() < 0.01, "{value}");
    for (name, corner_hz) in ["gyroscope.delay_s", "accelerometer.delay_s"].iter().zip(corners_hz) {
        let late = verdict.moved.iter().find(|moved| moved.name == *name).unwrap();
        assert!((late.value - SQRT_2 / (2.0 * PI * corner_hz)).abs() < 0.003, "{late:?}");
    }
}

/// Behind a filter that looks ahead the fit finds rotors without any lag, with 172 nats; what the
/// gyroscope reads next is foretold far worse with it.
#[test]
fn noise_that_is_fed_back_is_no_lag() {
    let verdict = verdict(&vehicle(FILE), Flown { gyro_rad_s: 0.01, ..Flown::default() });
    assert!(verdict.effects.is_empty(), "{}", verdict.words);
    assert!([Kind::None, Kind::NotIdentifiable].contains(&verdict.verdict), "{}", verdict.words);
}

/// The same flights of rotors that really are slower.
#[test]
fn a_lag_is_named_where_noise_is_fed_back() {
    let slow = ("[limits]", "[effects.motor_lag]\nextra_time_constant_s = 0.04\n\n[limits]");
    let verdict =
        verdict(&vehicle_with(FILE, &[slow]), Flown { gyro_rad_s: 0.003, ..Flown::default() });
    let names: Vec<_> = verdict.effects.iter().map(|effect| effect.name).collect();
    assert_eq!((verdict.verdict, names), (Kind::Named, vec!["motor_lag"]), "{}", verdict.words);
}

/// A log that writes a command down in the middle of its period says that it acted before it was
/// given. Where thrust changes quickly that is several per cent of every force.
#[test]
fn commands_may_be_stamped_late() {
    let late_s = 0.5 / RATE_HZ;
    let how = Flown { gyro_rad_s: 0.001, shake: [20.0, 0.3], ..Flown::default() };
    let strong = vehicle_with(
        FILE,
        &[("[limits]", "[effects.thrust_coefficient]\nthrust_fraction = 0.1\n\n[limits]")],
    );
    let flights = [1, 2, 3].map(|seed| {
        let (name, mut log) = flight(&strong, seed, how);
        log.source_mut("rotor").time_s.iter_mut().for_each(|t| *t += late_s);
        (name, log)
    });
    let verdict = diagnose(&vehicle(FILE), &flights[..2], &flights[2..], &|_| {}).unwrap().verdict;
    println!("{}\n{:?}", verdict.words, verdict.moved);
    let names: Vec<_> = verdict.effects.iter().map(|effect| effect.name).collect();
    assert_eq!((verdict.verdict, names), (Kind::Named, vec!["thrust_coefficient"]));
    let latency = verdict.moved.iter().find(|number| number.name == "actuation_latency.latency_s");
    let latency_s = latency.unwrap().value;
    assert!((latency_s + late_s).abs() < 5e-4, "{latency_s} s");
}

/// Held-out flights may lack something else, too, beside which the gap hardly shrinks: they want the
/// name as much as the others do.
#[test]
fn a_name_stands_where_held_out_flights_lack_something_else_too() {
    let how = Flown { gyro_rad_s: 0.001, shake: [20.0, 0.3], ..Flown::default() };
    let draggy = "[effects.linear_drag]\nextra_drag_n_s_per_m = 0.2\n\n";
    let weak = "[effects.weak_rotor]\nrotor = 4\nthrust_loss_fraction = 0.12\n\n";
    let with = |effects: &[&str]| {
        vehicle_with(FILE, &[("[limits]", &[effects.concat().as_str(), "[limits]"].concat())])
    };
    let known = [1, 2].map(|seed| flight(&with(&[draggy]), seed, how));
    let other = [flight(&with(&[draggy, weak]), 3, how)];
    let verdict = diagnose(&vehicle(FILE), &known, &other, &|_| {}).unwrap().verdict;
    println!("{}", verdict.words);
    let names: Vec<_> = verdict.effects.iter().map(|effect| effect.name).collect();
    assert_eq!((verdict.verdict, names), (Kind::NamedIncomplete, vec!["linear_drag"]));
    assert!(verdict.gap.as_ref().unwrap().removed_fraction < 0.1, "{:?}", verdict.gap);
    assert!(verdict.words.contains("lack something else"), "{}", verdict.words);
}

/// The vehicle with a rotor that gives less.
fn with_weak_rotor(loss: f64) -> VehicleFile {
    let weak =
        format!("[effects.weak_rotor]\nrotor = 4\nthrust_loss_fraction = {loss}\n\n[limits]");
    vehicle_with(FILE, &[("[limits]", &weak)])
}

/// What a rotor gives less swings with the thrust, slowly and by far more than a calm flight turns;
/// what is quick is the gyroscope's noise. The file's moments go with the measured ones in neither,
/// but from row to row they are as large.
#[test]
fn a_weak_rotor_is_named_from_a_calm_flight_through_a_noisy_gyroscope() {
    let how = Flown { gyro_rad_s: 0.003, heave: 0.3, hold: 0.2, ..Flown::default() };
    let verdict = verdict(&with_weak_rotor(0.12), how);
    let names: Vec<_> = verdict.effects.iter().map(|effect| effect.name).collect();
    assert_eq!((verdict.verdict, names), (Kind::Named, vec!["weak_rotor"]), "{}", verdict.words);
}

/// What a weak rotor does hides that the moments of this machine are known, as its good flights show.
#[test]
fn what_good_flights_show_of_moments_holds_for_a_machine_that_has_changed() {
    let how = Flown { gyro_rad_s: 0.003, heave: 0.3, hold: 0.2, ..Flown::default() };
    let fly = |machine: &VehicleFile, seeds: [u64; 2]| seeds.map(|seed| flight(machine, seed, how));
    let own = vehicle(FILE);
    let good = Baseline::fit(&own, &fly(&own, [1, 2]), &|_| ()).unwrap();
    let since = |machine: &VehicleFile| {
        let verdict = diagnose_since(&good, &fly(machine, [3, 4]), &[], &|_| ()).unwrap().verdict;
        println!("{}", verdict.words);
        verdict.effects.iter().map(|effect| effect.name).collect::<Vec<_>>()
    };
    // Was the thrust of all rotors, or the mass.
    assert_eq!(since(&with_weak_rotor(0.2)), ["weak_rotor"]);
    assert!(since(&own).is_empty());
}

/// A chipped propeller gives less thrust and takes as much torque: the yaw moment that a slower one
/// lacks is there. Was the thrust of all rotors, or nothing.
#[test]
fn a_chipped_propeller_is_a_rotor_that_lacks_thrust_alone() {
    let chipped = "[effects.weak_rotor]\nrotor = 2\nthrust_loss_fraction = 0.15\nform = \"thrust_alone\"\n\n[limits]";
    let machine = vehicle_with(FILE, &[("[limits]", chipped)]);
    let verdict =
        verdict(&machine, Flown { gyro_rad_s: 0.003, heave: 0.3, hold: 0.2, ..Flown::default() });
    let [weak] = verdict.effects.as_slice() else { panic!("{}", verdict.words) };
    assert_eq!((verdict.verdict, weak.name), (Kind::Named, "weak_rotor"), "{}", verdict.words);
    assert_eq!(weak.form, "thrust_alone");
    let Value::Number { value, low, high } = weak.parameters["thrust_loss_fraction"] else {
        panic!("{weak:?}")
    };
    assert!(low < 0.15 && 0.15 < high && (value - 0.15).abs() < 0.02, "{value} {low} {high}");
}

/// In another order of the rotors that swing would be yaw, which nothing measures as well.
#[test]
fn a_weak_rotor_is_no_wrong_order() {
    let how = Flown { gyro_rad_s: 0.001, heave: 0.3, hold: 0.1, ..Flown::default() };
    let flights = [1, 2, 3].map(|seed| flight(&with_weak_rotor(0.06), seed, how));
    assert_eq!(contradictions(&vehicle(FILE), &flights).unwrap(), []);
}

/// What is slow of a machine that lacks a large moment goes with itself at other times and with
/// other rotors; what is quick does not.
#[test]
fn a_large_moment_is_no_problem_of_the_data() {
    let off = "[effects.cg_offset]\ncg_x_m = 0.0018\ncg_y_m = -0.0036\n\n[limits]";
    let beside = vehicle_with(FILE, &[("[limits]", off)]);
    let agree = |machine: &VehicleFile, how| {
        let flights = [1, 2, 3].map(|seed| flight(machine, seed, how));
        assert_eq!(contradictions(&vehicle(FILE), &flights).unwrap(), [], "{how:?}");
    };
    // Was said to act 258 to 401 ms before it is given.
    agree(
        &with_weak_rotor(0.12),
        Flown { gyro_rad_s: 0.001, heave: 0.1, hold: 0.3, ..Flown::default() },
    );
    // To have another order of rotors.
    agree(&with_weak_rotor(0.12), Flown { gyro_rad_s: 0.001, ..Flown::default() });
    // To have a clock that steps by 1.52 s.
    agree(&beside, Flown { gyro_rad_s: 0.001, heave: 0.3, hold: 0.0, ..Flown::default() });
}

/// Drag goes with the centre of mass here, and not with the middle of the rotors, as the file has
/// it: what it turns was read into rotors that are elsewhere, and nothing was named.
#[test]
fn a_centre_of_mass_is_named_wherever_drag_acts() {
    let off = [0.006, -0.008];
    let rotors = [[0.085, -0.085], [-0.085, -0.085], [-0.085, 0.085], [0.085, 0.085]];
    let places = rotors.map(|[x, y]| {
        let place = |x: f64, y: f64| format!("position_body_m = {{ value = [{x:?}, {y:?}, 0.0]");
        (place(x, y), place(x - off[0], y - off[1]))
    });
    let moved = places.iter().map(|(from, to)| (from.as_str(), to.as_str()));
    let machine = vehicle_with(FILE, &moved.chain([DRAG]).collect::<Vec<_>>());
    let how = Flown { gyro_rad_s: 0.003, heave: 0.05, hold: 0.1, ..Flown::default() };
    let flights = [1, 2, 3].map(|seed| flight(&machine, seed, how));
    let file = vehicle_with(FILE, &[DRAG]);
    let verdict = diagnose(&file, &flights[..2], &flights[2..], &|_| {}).unwrap().verdict;
    println!("{}", verdict.words);
    let names: Vec<_> = verdict.effects.iter().map(|effect| effect.name).collect();
    assert_eq!((verdict.verdict, names), (Kind::Named, vec!["cg_offset"]), "{}", verdict.words);
    for (key, off) in ["cg_x_m", "cg_y_m"].into_iter().zip(off) {
        let found = &verdict.effects[0].parameters[key];
        let Value::Number { low, high, .. } = *found else { panic!("{key}: {found:?}") };
        assert!((low..=high).contains(&off), "{key}: {found:?}");
    }
}

const LIVELY: Flown = Flown { gyro_rad_s: 0.001, heave: 0.1, hold: 0.0, shake: [10.0, 0.1] };

/// A machine on which drag acts this far above the centre of mass, as that of rotors does, and not
/// there, as its file has it.
fn with_drag_above(file: &VehicleFile, above_m: f64, mass: f64) -> VehicleFile {
    let mut machine = file.clone();
    let mut p = *file.vehicle.parameters();
    p.mass_kg *= mass;
    // Everything but the point that drag acts on is lower.
    for rotor in &mut p.rotors[..p.rotor_count] {
        rotor.position.vector.z += above_m;
    }
    machine.vehicle = Vehicle::new(p).unwrap();
    let values = machine.effects.insert(CgOffset::<f64>::NAME).unwrap().values;
    values.copy_from_slice(&[0.0, 0.0, above_m, 1.0]);
    machine
}

/// The fitted flights know where drag acts; flown without that, the held-out ones lacked "something
/// else".
#[test]
fn held_out_flights_have_drag_where_the_fitted_ones_have_it() {
    let file = vehicle_with(FILE, &[DRAG]);
    let machine = with_drag_above(&file, 0.012, 1.08);
    let verdict = verdict_of(&file, &machine, LIVELY);
    let names: Vec<_> = verdict.effects.iter().map(|effect| effect.name).collect();
    assert_eq!((verdict.verdict, names), (Kind::Named, vec!["mass_error"]), "{}", verdict.words);
    assert!(verdict.moved.iter().any(|moved| moved.name == "drag.centre_body_m[2]"));
    let gap = verdict.gap.unwrap();
    assert!(gap.removed_fraction > 0.9, "{gap:?}");
}

/// Its moment goes with velocity, as that of flapping blades does.
#[test]
fn drag_above_the_centre_of_mass_is_no_flapping() {
    const GAIN_N_M_S_PER_M: f64 = 0.004;
    let file = vehicle_with(FILE, &[DRAG]);
    let mut machine = with_drag_above(&file, 0.012, 1.0);
    let verdict = verdict_of(&file, &machine, LIVELY);
    assert!(verdict.effects.is_empty(), "{}", verdict.words);
    machine.effects.insert("flapping_moment").unwrap().values[0] = GAIN_N_M_S_PER_M;
    let verdict = verdict_of(&file, &machine, LIVELY);
    let names: Vec<_> = verdict.effects.iter().map(|effect| effect.name).collect();
    assert_eq!((verdict.verdict, names), (Kind::Named, vec!["flapping_moment"]));
    let found = &verdict.effects[0].parameters["gain_n_m_s_per_m"];
    let Value::Number { value, low, high } = *found else { panic!("{found:?}") };
    assert!((low..=high).contains(&GAIN_N_M_S_PER_M), "{found:?}");
    assert!((value / GAIN_N_M_S_PER_M - 1.0).abs() < 0.1, "{found:?}");
}
