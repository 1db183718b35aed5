//! Flights that once got a wrong name, or no answer, and why they do not.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::foreign::flown;
use crate::support::{fly_rich, vehicle_with};
use hidden_effects::case::{Case, Set};
use squirrel_gap::{Kind, Verdict, diagnose};
use squirrel_sim::vehicle_file::VehicleFile;

/// The verdict on a case of the bench, and the names in it.
fn asked(set: Set, index: usize, seed: u64) -> (Verdict, Vec<&'static str>) {
    let (vehicle, flights, held_out) = flown(&Case::draw(set, index, seed));
    let verdict = diagnose(&vehicle, &flights, &held_out, &|_| {}).unwrap().verdict;
    println!("{}", verdict.words);
    let names = verdict.effects.iter().map(|effect| effect.name).collect();
    (verdict, names)
}

/// A case of the bench in which one effect is off, and nothing else is.
fn is_named(set: Set, index: usize, seed: u64, effect: &'static str) {
    let (verdict, names) = asked(set, index, seed);
    assert_eq!((verdict.verdict, names), (Kind::Named, vec![effect]));
}

/// A case of the bench in which two effects are off, and nothing else is.
fn both_are_named(index: usize, seed: u64, mut effects: [&'static str; 2]) {
    let (verdict, mut names) = asked(Set::Two, index, seed);
    names.sort_unstable();
    effects.sort_unstable();
    assert_eq!((verdict.verdict, names), (Kind::Named, effects.to_vec()));
}

/// A damping that is five of its tolerances off and known to a hundredth: 9 nats, for which a first
/// number that is a little wrong would not pass.
#[test]
fn a_second_number_that_flights_know_well_is_a_name() {
    both_are_named(18, 90909, ["actuation_latency", "angular_damping"]);
}

/// Round jets where the file's are square leave 12 nats for wings of another slope, by less than
/// four standard deviations.
#[test]
fn what_a_first_name_of_another_form_leaves_is_no_further_name() {
    both_are_named(48, 90909, ["flapping_moment", "rotor_wash"]);
}

/// Two flights ask for wings that meet the air at another angle, by 7 and 9 nats, and the third is
/// predicted worse with it.
#[test]
fn what_held_out_flights_are_worse_with_is_no_name() {
    for index in [2, 6] {
        let (verdict, names) = asked(Set::None, index, 82003);
        assert_eq!((verdict.verdict, names), (Kind::None, Vec::new()), "case {index}");
    }
}

/// A rotor that lost less than the file says, 7 nats; other names in its place are worth 2.
#[test]
fn what_flights_hardly_ask_for_is_no_other_explanation() {
    is_named(Set::Overstated, 39, 82003, "weak_rotor");
}

/// The force near the ground grows with the square of the radius: a third of the radius less is
/// half of the force less, whatever a third of the smallest radius is.
#[test]
fn an_effect_that_starts_flat_is_off_by_what_it_does() {
    is_named(Set::Overstated, 35, 82003, "ground_effect");
}

/// More of it than the file has looks like nothing that the flights show, less like everything.
#[test]
fn a_file_may_have_all_of_an_effect_that_starts_flat_too_much() {
    is_named(Set::Overstated, 3, 93007, "ground_effect");
}

/// Rotors that blow on the wings push where the wings are: a centimetre, which the file allows, is
/// no wing of another kind.
#[test]
fn wings_may_be_where_the_file_allows() {
    let wash = "[effects.rotor_wash]\ngain = 0.8\n\n[limits]";
    let flat = [
        ("model = \"membrane\"", "model = \"flat\""),
        ("parnn_weights = \"squirrel-parnn.safetensors\"", ""),
        ("filter = \"eskf\"", "filter = \"external\""),
        ("[limits]", wash),
    ];
    let file = vehicle_with("squirrel.toml", &flat);
    let off = [
        ("lateral_arm_m = { value = 0.09,", "lateral_arm_m = { value = 0.092,"),
        ("longitudinal_arm_m = { value = 0.0,", "longitudinal_arm_m = { value = 0.005,"),
        ("vertical_arm_m = { value = 0.02,", "vertical_arm_m = { value = 0.03,"),
    ];
    let real = vehicle_with("squirrel.toml", &[flat.as_slice(), &off].concat());
    let fly = |vehicle: &VehicleFile, seed: u64| fly_rich(vehicle, seed);
    let verdict = diagnose(&file, &[fly(&real, 1), fly(&real, 2)], &[fly(&real, 3)], &|_| {});
    let verdict = verdict.unwrap().verdict;
    assert_eq!(verdict.verdict, Kind::None, "{}", verdict.words);
}
