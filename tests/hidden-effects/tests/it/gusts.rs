//! What is called a gust, and what is not: in flights whose air moves, and in flights on which a
//! force acts that has as little pattern.

use hidden_effects::case::{Case, Set};
use squirrel_gap::{Kind, diagnose};
use squirrel_log::FlightLog;
use squirrel_sim::vehicle_file::VehicleFile;

/// Verdict and names of a case.
pub(super) fn told(case: &Case) -> (Kind, Vec<&'static str>) {
    let vehicle = VehicleFile::parse(&case.vehicle_toml(), "vehicle.toml").unwrap();
    let flight = |number: usize| -> (String, FlightLog) {
        (format!("flight {number}"), case.flight(number).unwrap())
    };
    let (flights, held_out) = ([flight(0), flight(1)], [flight(2)]);
    let found = diagnose(&vehicle, &flights, &held_out, &|_| ()).unwrap().verdict;
    (found.verdict, found.effects.iter().map(|effect| effect.name).collect())
}

/// A force along an axis that is mostly down: nothing predicts it, as a gust. It is as large with
/// folded wings, which hardly feel a gust, as with spread ones.
#[test]
fn a_force_that_folded_wings_feel_as_much_is_no_gust() {
    let case = Case::draw(Set::Outside, 21, 82121);
    assert_eq!(
        case.answer.outside.map(|outside| outside.name()),
        Some("formula_sin_ned_force".to_owned())
    );
    let (verdict, names) = told(&case);
    assert!(verdict == Kind::OutsideCatalogue && !names.contains(&"gust"), "{verdict:?} {names:?}");
}

/// Throttle predicts nearly half of one, as the autopilot answers it; the drag of the other acts
/// beside the middle of the rotors, where a gust is a moment.
#[test]
fn strong_gusts_are_named_though_the_autopilot_answers_them_and_they_turn_the_vehicle() {
    for number in [465, 399] {
        let case = Case::draw(Set::Single, number, 82122);
        let hidden: Vec<_> = case.answer.effects.iter().map(|effect| &effect.name).collect();
        assert_eq!(hidden, ["gust"], "{number}");
        assert_eq!(told(&case), (Kind::Named, vec!["gust"]), "{number}");
    }
}
