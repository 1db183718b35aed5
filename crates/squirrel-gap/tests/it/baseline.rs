//! What has changed on a machine since it flew well: on measured flights with cut propellers, and
//! on simulated ones whose truth is known.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::support::{flights, fly_rich, imported, vehicle};
use squirrel_gap::{
    Baseline, Diagnosis, Kind, Value, Workflow, add, check_since, diagnose, diagnose_since,
};
use squirrel_log::FlightLog;
use squirrel_sim::vehicle_file::VehicleFile;
use std::cell::Cell;

type Flights = Vec<(String, FlightLog)>;

fn since(vehicle: &VehicleFile, good: &Flights, now: &Flights) -> Diagnosis {
    let own = Baseline::fit(vehicle, good, &|_| ()).unwrap();
    diagnose_since(&own, now, &[], &|_| ()).unwrap()
}

/// Rotors that are named as weak, in order, with the part of their thrust that they lost.
fn weak(diagnosis: &Diagnosis) -> Vec<(usize, f64)> {
    let number = |value: &Value| match value {
        Value::Number { value, .. } => *value,
        Value::Choice { .. } => f64::NAN,
    };
    let weak = diagnosis.verdict.effects.iter().filter(|effect| effect.name == "weak_rotor");
    let mut all: Vec<(usize, f64)> = weak
        .map(|effect| {
            let of = |key: &str| number(&effect.parameters[key]);
            (of("rotor") as usize, of("thrust_loss_fraction"))
        })
        .collect();
    all.sort_unstable_by_key(|(rotor, _)| *rotor);
    all
}

/// Flights of `CrazyPAD` by their names.
fn crazypad(names: &[&str]) -> Flights {
    let folder = flights("crazypad-dev");
    let read = |name: &&str| {
        ((*name).to_owned(), imported("crazypad.toml", &folder.join(format!("{name}.bin"))))
    };
    names.iter().map(read).collect()
}

const NORMAL_E8: [&str; 4] = [
    "normal_flight__E8_log00",
    "normal_flight__E8_log01",
    "normal_flight__E8_log02",
    "normal_flight__E8_log06",
];
const NORMAL_E9: [&str; 3] =
    ["normal_flight__E9_log00", "normal_flight__E9_log03", "normal_flight__E9_log04"];

/// Both blades of the propeller of motor 3 were cut by 3.5 mm; nothing of the kind was seen before.
#[test]
fn a_cut_propeller_is_its_rotor() {
    let (good, now) = (crazypad(&NORMAL_E8), crazypad(&["cut_M3_3.5mm_3.5mm_40mm__E8_log02"]));
    let found = since(&vehicle("crazyflie21_brushed.toml"), &good, &now);
    let [(3, loss)] = weak(&found)[..] else { panic!("{:?}", found.verdict.effects) };
    assert_eq!((found.verdict.verdict, found.verdict.effects.len()), (Kind::Named, 1));
    // Its motor is asked for 54 g where the good flights ask for 41.5 g, in the firmware's own
    // measure.
    assert!((loss - (1.0 - 41.5 / 54.0)).abs() < 0.04, "{loss}");
    let health = &found.verdict.baseline.as_ref().unwrap().rotors;
    assert_eq!(health.iter().map(|r| r.rotor).collect::<Vec<_>>(), [1, 2, 3, 4]);
}

#[test]
fn two_cut_propellers_are_both_named() {
    let name = "pair_cut_M2_3.5mm_3.0mm_40.5mm_M1_3.5mm_3.0mm_40.5mm__E9_log05";
    let (good, now) = (crazypad(&NORMAL_E9), crazypad(&[name]));
    let file = vehicle("crazyflie21_brushed.toml");
    let found = since(&file, &good, &now);
    let [(1, first), (2, second)] = weak(&found)[..] else { panic!("{:?}", found.verdict.effects) };
    // The file with them has one table of the effect, and the other rotor's own number.
    let text = add(&file, &found, &[name.to_owned()]).unwrap();
    let patched = VehicleFile::parse(&text, "patched").unwrap();
    let own = Baseline::fit(&file, &good, &|_| ()).unwrap();
    let thrust = |file: &VehicleFile| file.effects.alter(&file.vehicle).unwrap().rotor_factors()[0];
    let (before, after) = (thrust(&own.vehicle), thrust(&patched));
    for (rotor, loss) in [(0, first), (1, second), (2, 0.0), (3, 0.0)] {
        let ratio = after[rotor] / before[rotor];
        assert!((ratio - (1.0 - loss)).abs() < 1e-4, "rotor {rotor}: {ratio}");
    }
}

#[test]
fn a_good_flight_has_no_name() {
    let mut good = crazypad(&NORMAL_E8);
    for _ in 0..good.len() {
        let now = vec![good.remove(0)];
        let found = since(&vehicle("crazyflie21_brushed.toml"), &good, &now);
        assert!(found.verdict.effects.is_empty(), "{}: {}", now[0].0, found.verdict.words);
        good.extend(now);
    }
}

/// The log has neither yaw nor pitch: the heading is the one at which roll makes the acceleration.
#[test]
fn a_flight_without_yaw_still_tells_its_rotor() {
    let (good, now) = (crazypad(&NORMAL_E8), crazypad(&["cut_M3_3mm__E8_log02"]));
    let found = since(&vehicle("crazyflie21_brushed.toml"), &good, &now);
    let [(3, loss)] = weak(&found)[..] else { panic!("{}", found.verdict.words) };
    // Its motor is asked for 46.3 g, where those of the good flights are asked for 41.3 g.
    assert!((loss - (1.0 - 41.3 / 46.3)).abs() < 0.08, "{loss}");
    let notes = found.verdict.notes.join("\n");
    assert!(notes.contains("taken to have held one heading"), "{notes}");
}

fn has_alternative(diagnosis: &Diagnosis, effects: &[&str]) -> bool {
    diagnosis.verdict.alternatives.iter().any(|set| set.effects == effects)
}

/// A weight between motors 3 and 4 makes both work harder, as two weak rotors would; neither its
/// mass nor its place stands out by itself.
#[test]
fn a_load_is_one_of_the_answers() {
    let names = ["add_weight_W1_at_M3_M4__E8_log02", "cut_M3_3.5mm_3.5mm_40mm__E8_log02"];
    let (good, flights) = (crazypad(&NORMAL_E8), crazypad(&names));
    let file = vehicle("crazyflie21_brushed.toml");
    let own = Baseline::fit(&file, &good, &|_| ()).unwrap();
    let [loaded, cut] =
        [0, 1].map(|i| diagnose_since(&own, &flights[i..=i], &[], &|_| ()).unwrap());
    assert_eq!(loaded.verdict.verdict, Kind::Ambiguous, "{}", loaded.verdict.words);
    assert!(has_alternative(&loaded, &["mass_error", "cg_offset"]), "{}", loaded.verdict.words);
    // What yaw shows to be no load is none.
    assert_eq!(cut.verdict.verdict, Kind::Named, "{}", cut.verdict.words);
}

/// Motor 3 was asked for 9 % more than in the good flights and motor 1 for 5 % more: one weak rotor
/// is sure, a single one is not.
#[test]
fn how_many_rotors_are_weak_may_be_open() {
    let name = "pair_cut_M2_0.5mm_46.5mm_M1_0.5mm_46.5mm__E9_log02";
    let (good, now) = (crazypad(&NORMAL_E9), crazypad(&[name]));
    let found = since(&vehicle("crazyflie21_brushed.toml"), &good, &now);
    assert!(matches!(weak(&found)[..], [(3, _)]), "{}", found.verdict.words);
    assert_eq!(found.verdict.verdict, Kind::Ambiguous, "{}", found.verdict.words);
    assert!(has_alternative(&found, &["weak_rotor"; 3]), "{}", found.verdict.words);
}

/// The file says too much thrust, too little drag and another centre of mass; then a rotor becomes
/// weak. Against the file that is one thing among others; against the machine's good flights it is
/// the only one.
#[test]
fn what_the_file_has_wrong_has_not_changed() {
    let file = VehicleFile::squirrel();
    let text = |effects: &str| {
        VehicleFile::parse(&format!("{}\n{effects}", file.text), "machine").unwrap()
    };
    let machine = "[effects.thrust_coefficient]\nthrust_fraction = -0.08\n[effects.cg_offset]\ncg_x_m = 0.004\ncg_y_m = -0.003\n[effects.linear_drag]\nextra_drag_n_s_per_m = 0.08\n";
    let well = text(machine);
    let weak_now =
        text(&format!("{machine}[effects.weak_rotor]\nrotor = 2\nthrust_loss_fraction = 0.12\n"));
    let good = vec![fly_rich(&well, 1), fly_rich(&well, 2)];
    let now = vec![fly_rich(&weak_now, 3)];
    let against_file = diagnose(&file, &now, &[], &|_| ()).unwrap();
    assert!(against_file.verdict.effects.len() > 1, "{}", against_file.verdict.words);
    let found = since(&file, &good, &now);
    println!("{}", found.verdict.words);
    let [(2, loss)] = weak(&found)[..] else { panic!("{}", found.verdict.words) };
    assert_eq!(found.verdict.effects.len(), 1, "{}", found.verdict.words);
    assert!((loss - 0.12).abs() < 0.015, "{loss}");
}

#[test]
fn a_good_flight_is_no_flight_to_judge() {
    let file = VehicleFile::squirrel();
    let good = vec![fly_rich(&file, 1)];
    let own = Baseline::fit(&file, &good, &|_| ()).unwrap();
    let error = diagnose_since(&own, &good, &[], &|_| ()).unwrap_err();
    assert_eq!(error.to_string(), "flight 1: two flights have this name");
}

/// Under whatever name: it would show that nothing has changed, as a fitted flight would prove
/// itself.
#[test]
fn a_copy_of_a_good_flight_is_set_aside() {
    let file = VehicleFile::squirrel();
    let good = vec![fly_rich(&file, 1)];
    let own = Baseline::fit(&file, &good, &|_| ()).unwrap();
    let copy = ("copy".to_owned(), good[0].1.clone());
    let words = "copy: imu.specific_force_body_m_s2: 100 % of its samples are those of flight 1";
    let now = [copy.clone(), fly_rich(&file, 2)];
    let check = check_since(&own, &now, &[], &|_| ()).unwrap();
    assert_eq!(check.flights[0].usable_s, 0.0, "{}", check.words);
    let alone = diagnose_since(&own, &now[..1], &now[1..], &|_| ()).unwrap().verdict;
    assert_eq!(alone.verdict, Kind::DataProblem);
    let held_out = diagnose_since(&own, &now[1..], &[copy], &|_| ()).unwrap().verdict;
    for found in [alone, held_out] {
        assert_eq!(found.set_aside.len(), 1, "{}", found.words);
        assert!(found.set_aside[0].words.starts_with(words), "{}", found.set_aside[0].words);
    }
}

/// A baseline that contradicts itself is one error with what is wrong, and a bad flight beside good
/// ones is left out.
#[test]
fn bad_good_flights_are_said() {
    let file = VehicleFile::squirrel();
    let (name, mut log) = fly_rich(&file, 1);
    for value in &mut log
        .sources
        .get_mut("imu")
        .unwrap()
        .channels
        .get_mut("omega_body_rad_s")
        .unwrap()
        .values
    {
        *value = value.to_degrees();
    }
    let bad = (name, log);
    let error = Baseline::fit(&file, std::slice::from_ref(&bad), &|_| ()).unwrap_err().to_string();
    assert!(
        error.starts_with("baseline: no flight is left: flight 1: imu.omega_body_rad_s"),
        "{error}"
    );
    let own = Baseline::fit(&file, &[bad, fly_rich(&file, 2)], &|_| ()).unwrap();
    assert_eq!((own.flights.len(), own.set_aside.len()), (1, 1));
}

/// Whoever asks twice, as `gap run` does, fits once.
#[test]
fn what_is_fitted_is_asked_again_without_another_fit() {
    let file = VehicleFile::squirrel();
    let (good, now) = (vec![fly_rich(&file, 1)], vec![fly_rich(&file, 3)]);
    let fits = Cell::new(0);
    let tell = |what: &str| fits.set(fits.get() + u32::from(what == "reading the baseline"));
    let own = Baseline::fit(&file, &good, &tell).unwrap();
    let check = check_since(&own, &now, &[], &tell).unwrap();
    let again = Workflow::diagnose_since(&own, now.clone(), Vec::new(), &tell).unwrap();
    assert_eq!((fits.get(), check.flights.len()), (1, 1));
    let anew = Workflow::diagnose(file, &good, now, Vec::new(), &tell).unwrap();
    let text = |found: &Workflow| serde_json::to_string(&found.diagnosis.verdict).unwrap();
    assert_eq!((fits.get(), text(&again)), (2, text(&anew)));
}

/// A file of another machine, and no good flights: its thrust is a quarter off, and with it the mass
/// would have to be, or the inertia of a pitch that nobody measured. Neither is said without a doubt.
#[test]
fn without_good_flights_another_machine_has_no_cause() {
    let file = vehicle("crazyflie21_brushed.toml");
    for flight in crazypad(&["normal_flight__E8_log02", "normal_flight__E9_log00"]) {
        let found = diagnose(&file, &[flight], &[], &|_| ()).unwrap().verdict;
        let is_sure =
            matches!(found.verdict, Kind::Named | Kind::NamedIncomplete | Kind::NamedFormDiffers);
        assert!(!is_sure, "{}", found.words);
        assert!(found.notes.iter().any(|n| n.contains("pitch was not measured")));
    }
}
