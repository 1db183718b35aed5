//! A file that is fitted has its own numbers where the flights have them: what is proven is the
//! whole explanation, and not its names alone.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::support::{flights, fly_rich, imported, vehicle, vehicle_with};
use squirrel_gap::{Kind, add, diagnose, find, fit, nothing_to_add};
use squirrel_sim::vehicle_file::VehicleFile;

/// Rotors inside their tolerance of 1 %, of a flown vehicle that the file takes for alike.
const ROTORS: [f64; 4] = [1.008, 0.993, 1.0, 0.99];

/// The file of a vehicle whose rotors differ, with more text at its end.
fn flown(effects: &str) -> VehicleFile {
    let file = VehicleFile::squirrel();
    let mut fractions = ROTORS.iter();
    let with = |line: &str| match line.trim() {
        "[[rotor]]" => format!("[[rotor]]\nthrust_fraction = {}\n", fractions.next().unwrap()),
        _ => format!("{line}\n"),
    };
    let text: String = file.text.lines().map(with).collect();
    VehicleFile::parse(&format!("{text}\n{effects}"), "flown").unwrap()
}

fn parse(text: &str) -> VehicleFile {
    VehicleFile::parse(text, "patched").unwrap()
}

#[test]
fn a_fitted_file_predicts_held_out_flights_better_than_its_names_alone() {
    let (file, drag) =
        (VehicleFile::squirrel(), "[effects.linear_drag]\nextra_drag_n_s_per_m = 0.08\n");
    let flown = flown(drag);
    let diagnosis = diagnose(&file, &[fly_rich(&flown, 1)], &[], &|_| {}).unwrap();
    assert_eq!(diagnosis.verdict.verdict, Kind::Named, "{}", diagnosis.verdict.words);
    let [fitted, names_alone] =
        [fit, add].map(|patch| parse(&patch(&file, &diagnosis, &["flight 1".to_owned()]).unwrap()));
    let unseen = [fly_rich(&flown, 2)];
    let roll =
        |vehicle: &VehicleFile| find(vehicle, &unseen).unwrap().residual.moment_body_rms_n_m[0];
    let (with_numbers, without) = (roll(&fitted), roll(&names_alone));
    println!("{with_numbers:.2e} N m with the file's numbers, {without:.2e} without");
    assert!(with_numbers < 0.7 * without, "{with_numbers:.2e} {without:.2e}");
}

#[test]
fn numbers_are_fitted_inside_their_tolerance_where_nothing_is_missing() {
    let file = VehicleFile::squirrel();
    let flown = flown("");
    let diagnosis =
        diagnose(&file, &[fly_rich(&flown, 1), fly_rich(&flown, 2)], &[], &|_| {}).unwrap();
    assert_eq!(diagnosis.verdict.verdict, Kind::None, "{}", diagnosis.verdict.words);
    assert!(nothing_to_add(&diagnosis.verdict).is_some());
    let text = fit(&file, &diagnosis, &["flight 1".to_owned(), "flight 2".to_owned()]).unwrap();
    assert!(!text.contains("[effects.weak_rotor]"), "{text}");
    let [thrust, _] = parse(&text).vehicle.rotor_factors();
    let about_mean =
        |all: &[f64]| all.iter().map(|x| x - all.iter().sum::<f64>() / 4.0).collect::<Vec<_>>();
    let own = about_mean(&thrust.iter().copied().take(4).collect::<Vec<_>>());
    for (rotor, (fitted, true_fraction)) in own.iter().zip(about_mean(&ROTORS)).enumerate() {
        println!("rotor {}: {fitted:.4}, {true_fraction:.4} in truth", rotor + 1);
        assert!((fitted - true_fraction).abs() < 0.004, "rotor {}", rotor + 1);
    }
}

#[test]
fn numbers_do_not_take_up_what_no_name_fits() {
    // A rotor that weakens by a fifth in the middle of the flight.
    let file = VehicleFile::squirrel();
    let weak = vehicle_with(
        "squirrel.toml",
        &[("[limits]", "[effects.weak_rotor]\nrotor = 2\nthrust_loss_fraction = 0.2\n\n[limits]")],
    );
    let (name, mut log) = fly_rich(&file, 1);
    let (_, later) = fly_rich(&weak, 1);
    for (own, other) in log.sources.values_mut().zip(later.sources.values()) {
        let n = own.time_s.len().min(other.time_s.len());
        own.time_s.truncate(n);
        for (channel, other) in own.channels.values_mut().zip(other.channels.values()) {
            channel.values.truncate(n * channel.width);
            let half = n / 2 * channel.width;
            channel.values[half..].copy_from_slice(&other.values[half..n * other.width]);
        }
    }
    let diagnosis = diagnose(&file, &[(name, log)], &[], &|_| {}).unwrap();
    assert_eq!(diagnosis.verdict.verdict, Kind::OutsideCatalogue, "{}", diagnosis.verdict.words);
    let error = fit(&file, &diagnosis, &[]).unwrap_err();
    assert!(error.contains("nothing to fit: something is missing"), "{error}");
}

/// Of a Crazyflie's moments its file explains next to nothing, and nothing is named from them.
/// Fitted to three flights, it predicts those of a fourth.
#[test]
fn moments_that_a_file_knows_nothing_of_are_fitted_and_predict() {
    let file = vehicle("crazyflie21_brushed.toml");
    let read = |name: &str| {
        let csv = flights("nanobench").join(format!("{name}.csv"));
        (name.to_owned(), imported("nanobench.toml", &csv))
    };
    let seen = ["B2_circle_medium_rep1", "B3_figure8_fast_rep1", "B9_trefoil_slow_rep1"].map(read);
    let diagnosis = diagnose(&file, &seen, &[], &|_| {}).unwrap();
    assert!(
        diagnosis.verdict.notes.iter().any(|note| note.starts_with("moments:")),
        "{:?}",
        diagnosis.verdict.notes
    );
    let text = fit(&file, &diagnosis, &["three flights".to_owned()]).unwrap();
    assert!(text.contains("moments beyond it"), "the file says where its numbers are from");
    let unseen = [read("B8_star_slow_rep1")];
    let residual = |vehicle: &VehicleFile| find(vehicle, &unseen).unwrap().residual;
    let (before, after) = (residual(&file), residual(&parse(&text)));
    for axis in 0..3 {
        let ratio = after.moment_body_rms_n_m[axis] / before.moment_body_rms_n_m[axis];
        println!("axis {axis}: {ratio:.2} of the moment");
        // About yaw 0.63; 0.60 where the file has no drag.
        assert!(ratio < 0.65, "axis {axis}: {ratio}");
        assert!(after.force_body_rms_n[axis] < before.force_body_rms_n[axis], "axis {axis}");
    }
}
