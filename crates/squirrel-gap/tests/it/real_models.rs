//! Models of real vehicles miss a little everywhere, and logs hold what a filter believed: names
//! that stand in spite of it, and names that are not to be had.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::support::{fly, fly_rich, vehicle_with};
use hidden_effects::case::{Case, Set};
use hidden_effects::draw::Draw;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use squirrel_gap::{Diagnosis, Kind, add, diagnose};
use squirrel_log::FlightLog;
use squirrel_sim::vehicle_file::VehicleFile;
use std::path::Path;

fn logs(folder: &Path) -> Vec<(String, FlightLog)> {
    let mut files: Vec<_> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files.iter().map(|file| (file.display().to_string(), FlightLog::read(file).unwrap())).collect()
}

/// A blind case with its vehicle file.
fn blind(set: Set, index: usize) -> (Case, VehicleFile, Diagnosis) {
    let folder =
        Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("real-models-{set:?}-{index}"));
    let (case, path) = Case::draw_and_make(set, index, 11, &folder).unwrap();
    let vehicle = VehicleFile::load(&path.join("vehicle.toml")).unwrap();
    let diagnosis =
        diagnose(&vehicle, &logs(&path.join("train")), &logs(&path.join("held-out")), &|_| {})
            .unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    println!("{}", diagnosis.verdict.words);
    (case, vehicle, diagnosis)
}

/// A coloured force and moment of 10 to 25 % of what was measured lies on every axis beside the
/// effect.
#[test]
fn a_name_stands_beside_what_a_model_misses_everywhere() {
    let (case, vehicle, diagnosis) = blind(Set::Misfit, 0);
    let verdict = &diagnosis.verdict;
    assert_eq!(verdict.verdict, Kind::NamedIncomplete, "{}", verdict.words);
    assert_eq!(verdict.effects[0].name, case.answer.effects[0].name, "{}", verdict.words);
    let left = verdict.leftover.as_ref().unwrap();
    assert!((0.08..0.4).contains(&left.share_left), "{left:?}");
    assert!(left.channels.len() >= 3, "{left:?}");
    assert!(verdict.words.contains("Something else remains"), "{}", verdict.words);
    let patched = add(&vehicle, &diagnosis, &["flight".to_owned()]).unwrap();
    assert!(patched.contains(&format!("[effects.{}]", verdict.effects[0].name)), "{patched}");
}

/// A circle is flown with moments that the vibration in a gyroscope is larger than: what is measured
/// has little to do with what the file predicts, and all of what it predicts is in there.
#[test]
fn vibration_in_a_calm_flight_does_not_hide_a_moment() {
    let off = "[effects.cg_offset]\ncg_x_m = 0.006\ncg_y_m = -0.005\n\n[limits]";
    let flown = vehicle_with("squirrel.toml", &[("[limits]", off)]);
    let mut draw = Draw::new(5);
    let flights = [1, 2].map(|seed| {
        let (name, mut log) = fly("track", &flown, seed);
        let imu = log.sources.get_mut("imu").unwrap();
        let gyro = imu.channels.get_mut("omega_body_rad_s").unwrap();
        gyro.values.iter_mut().for_each(|x| *x += draw.uniform(-0.3, 0.3));
        (name, log)
    });
    let verdict = diagnose(&VehicleFile::squirrel(), &flights, &[], &|_| {}).unwrap().verdict;
    println!("{} {:?}", verdict.words, verdict.notes);
    assert!(!verdict.notes.iter().any(|note| note.starts_with("moments:")), "{:?}", verdict.notes);
    assert_eq!(verdict.effects[0].name, "cg_offset", "{}", verdict.words);
}

/// A moment that no effect of the catalogue makes, so large that the file explains little of all:
/// quick moments still follow the commands, so that they take part and it is seen.
#[test]
fn a_large_moment_that_no_name_fits_is_seen() {
    let is_one = |index: &usize| {
        outside(*index).is_some_and(|outside| outside.name() == "formula_product_moment")
    };
    let (_, _, diagnosis) = blind(Set::Outside, (0..40).find(is_one).unwrap());
    assert_eq!(diagnosis.verdict.verdict, Kind::OutsideCatalogue, "{}", diagnosis.verdict.words);
    let channels = diagnosis.verdict.leftover.unwrap().channels;
    assert!(channels.iter().any(|channel| channel.starts_with("moment")), "{channels:?}");
}

fn outside(index: usize) -> Option<hidden_effects::outside::Outside> {
    Case::draw(Set::Outside, index, 11).answer.outside
}

/// The thrust of each flight drifts by itself, as with a pack that warms up: a drag that the file
/// lacks is named beside it, and the force that is left is told. A thrust that drifts by itself has
/// no name.
#[test]
fn a_name_stands_beside_a_slow_force_of_each_flight() {
    let drag = (
        "linear_n_s_per_m = { value = [0.0, 0.0, 0.0]",
        "linear_n_s_per_m = { value = [0.2, 0.2, 0.0]",
    );
    let (file, flown) = (VehicleFile::squirrel(), vehicle_with("squirrel.toml", &[drag]));
    let answer = |vehicle: &VehicleFile| {
        let drifts = [(1, 0.004), (2, -0.004), (3, 0.003)];
        let flights = drifts.map(|(seed, drift)| drifting(fly("track", vehicle, seed), drift));
        let verdict = diagnose(&file, &flights[..2], &flights[2..], &|_| {}).unwrap().verdict;
        println!("{}", verdict.words);
        verdict
    };
    let verdict = answer(&flown);
    assert_eq!(verdict.verdict, Kind::NamedIncomplete, "{}", verdict.words);
    assert_eq!(
        verdict.effects.iter().map(|e| e.name).collect::<Vec<_>>(),
        ["linear_drag"],
        "{}",
        verdict.words
    );
    assert!(verdict.leftover.unwrap().channels.contains(&"force_body_z_n"), "{}", verdict.words);
    assert_eq!(answer(&file).verdict, Kind::OutsideCatalogue);
}

/// A ladder of hovers and a few dashes are each flown at one time of a flight: what acts there
/// alone, or several names together, can stand in for thrust that drifts by four per cent over it,
/// and are no names for it.
#[test]
fn thrust_that_drifts_over_one_flight_has_no_name() {
    let file = VehicleFile::squirrel();
    let flight = drifting(fly("excite_normal", &file, 1), -0.01);
    let verdict = diagnose(&file, &[flight], &[], &|_| {}).unwrap().verdict;
    let refused = [Kind::None, Kind::OutsideCatalogue, Kind::NotIdentifiable];
    assert!(refused.contains(&verdict.verdict), "{}", verdict.words);
}

/// A flight whose rotors were told less and less of what the log says, or more and more.
fn drifting((name, mut log): (String, FlightLog), drift: f64) -> (String, FlightLog) {
    let rotor = log.sources.get_mut("rotor").unwrap();
    let (start_s, end_s) = (rotor.time_s[0], rotor.time_s[rotor.time_s.len() - 1]);
    let times = rotor.time_s.clone();
    let command = rotor.channels.get_mut("command").unwrap();
    for (own, time_s) in command.values.chunks_exact_mut(command.width).zip(times) {
        let share = 2.0 * (time_s - start_s) / (end_s - start_s) - 1.0;
        for u in own {
            *u *= 1.0 + drift * share;
        }
    }
    (name, log)
}

/// Where the file overstates what there is, that is found, and what it takes away leaves no less
/// than nothing.
#[test]
fn a_drag_that_the_file_overstates_is_found() {
    let drag = (
        "linear_n_s_per_m = { value = [0.0, 0.0, 0.0]",
        "linear_n_s_per_m = { value = [0.1, 0.1, 0.1]",
    );
    let file = vehicle_with("squirrel.toml", &[drag]);
    let flown = VehicleFile::squirrel();
    let verdict =
        diagnose(&file, &[fly_rich(&flown, 1)], &[fly_rich(&flown, 2)], &|_| {}).unwrap().verdict;
    assert_eq!(verdict.verdict, Kind::Named, "{}", verdict.words);
    assert_eq!(verdict.effects[0].name, "linear_drag", "{}", verdict.words);
    let squirrel_gap::Value::Number { value, .. } =
        verdict.effects[0].parameters["extra_drag_n_s_per_m"]
    else {
        panic!("{}", verdict.words);
    };
    assert!((-0.1..-0.09).contains(&value), "{value}");
}

/// A lag or delay that the file has and the vehicle has not looks like commands that act before
/// they are given, and a load that is not there like one that weighs less than nothing.
#[test]
fn a_lag_a_latency_or_a_load_that_is_not_there_is_found() {
    let flown = VehicleFile::squirrel();
    let flights = [fly_rich(&flown, 1)];
    for (effect, numbers, key) in [
        ("motor_lag", "extra_time_constant_s = 0.045", "extra_time_constant_s"),
        ("actuation_latency", "latency_s = 0.033", "latency_s"),
        ("payload_swing", "mass_kg = 0.1\nlength_m = 0.45", "mass_kg"),
    ] {
        let stated = format!("[effects.{effect}]\n{numbers}\n\n[limits]");
        let file = vehicle_with("squirrel.toml", &[("[limits]", &stated)]);
        let verdict = diagnose(&file, &flights, &[], &|_| {}).unwrap().verdict;
        assert_eq!(verdict.effects.first().map(|e| e.name), Some(effect), "{}", verdict.words);
        assert_eq!(verdict.effects.len(), 1, "{}", verdict.words);
        let squirrel_gap::Value::Number { value, .. } = verdict.effects[0].parameters[key] else {
            panic!("{}", verdict.words);
        };
        assert!(value.abs() < 0.005, "{effect}: {value}");
    }
}

/// Three flights on motors and propellers that give 2.5 % more or less: that is no reason to doubt
/// what holds in each of them.
#[test]
fn flights_that_differ_in_thrust_lack_the_same_effect() {
    let sd = |text: &str| {
        let line = text.lines().find(|line| line.starts_with("thrust_coefficient_n_s2")).unwrap();
        let value: f64 = line.split(&['=', ','][..]).nth(2).unwrap().trim().parse().unwrap();
        let tolerant =
            format!("thrust_coefficient_n_s2 = {{ value = {value:e}, sd = {:e} }}", 0.05 * value);
        (line.to_owned(), tolerant)
    };
    let (line, tolerant) = sd(&VehicleFile::squirrel().text);
    let file = vehicle_with("squirrel.toml", &[(&line, &tolerant)]);
    let day = |seed: u64, fraction: f64| {
        let effects = format!(
            "[effects.linear_drag]\nextra_drag_n_s_per_m = 0.08\n\n[effects.thrust_coefficient]\nthrust_fraction = {fraction}\n\n[limits]"
        );
        fly_rich(&vehicle_with("squirrel.toml", &[("[limits]", &effects)]), seed)
    };
    let verdict = diagnose(&file, &[day(1, -0.025), day(2, 0.0), day(3, 0.025)], &[], &|_| {})
        .unwrap()
        .verdict;
    assert_eq!(verdict.verdict, Kind::Named, "{}", verdict.words);
    assert_eq!(
        verdict.effects.iter().map(|e| e.name).collect::<Vec<_>>(),
        ["linear_drag"],
        "{}",
        verdict.words
    );
}

/// The attitude as a filter has it that takes a lasting acceleration for the vertical: 0.6 deg at a
/// metre per second squared.
fn levelled(mut log: FlightLog) -> FlightLog {
    let (times, forces) = {
        let (times, forces) = log.channel("imu.specific_force_body_m_s2").unwrap();
        (times.to_vec(), forces.values.clone())
    };
    let source = log.source_mut("attitude");
    let stamps = source.time_s.clone();
    let values = &mut source.channels.get_mut("q_ned_from_body_wxyz").unwrap().values;
    let (mut acceleration, mut before_s) = (Vector3::zeros(), stamps[0]);
    for (q, stamp_s) in values.chunks_exact_mut(4).zip(&stamps) {
        let i = times.partition_point(|t| t <= stamp_s).saturating_sub(1);
        let true_attitude = UnitQuaternion::new_normalize(Quaternion::new(q[0], q[1], q[2], q[3]));
        let force = true_attitude * Vector3::from_column_slice(&forces[3 * i..3 * i + 3]);
        let keep = (-(stamp_s - before_s) / 1.2_f64).exp();
        acceleration = acceleration * keep + Vector3::new(force.x, force.y, 0.0) * (1.0 - keep);
        before_s = *stamp_s;
        let lean = Vector3::new(acceleration.y, -acceleration.x, 0.0) * 0.01;
        let believed = UnitQuaternion::from_scaled_axis(lean) * true_attitude;
        q.copy_from_slice(&[believed.w, believed.i, believed.j, believed.k]);
    }
    log
}

#[test]
fn an_attitude_that_leans_into_accelerations_is_no_effect() {
    let file = VehicleFile::squirrel();
    let [a, b] = [1, 2].map(|seed| {
        let (name, log) = fly_rich(&file, seed);
        (name, levelled(log))
    });
    let verdict = diagnose(&file, &[a], &[b], &|_| {}).unwrap().verdict;
    assert_eq!(verdict.verdict, Kind::None, "{}", verdict.words);
}

/// A held-out flight on propellers that give 0.8 % less thrust: a name that is right is not worse
/// for that.
#[test]
fn a_held_out_flight_of_another_day_does_not_take_a_name_away() {
    let file = VehicleFile::squirrel();
    let effect = "[effects.linear_drag]\nextra_drag_n_s_per_m = 0.08\n\n[limits]";
    let worn = "[effects.linear_drag]\nextra_drag_n_s_per_m = 0.08\n\n[effects.thrust_coefficient]\nthrust_fraction = -0.008\n\n[limits]";
    let flown = vehicle_with("squirrel.toml", &[("[limits]", effect)]);
    let later = vehicle_with("squirrel.toml", &[("[limits]", worn)]);
    let verdict =
        diagnose(&file, &[fly_rich(&flown, 1)], &[fly_rich(&later, 2)], &|_| {}).unwrap().verdict;
    assert_eq!(verdict.verdict, Kind::Named, "{}", verdict.words);
    let gap = verdict.gap.as_ref().unwrap();
    assert!(gap.removed_fraction > 0.98, "{gap:?}");
}
