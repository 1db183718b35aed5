//! What is called a gust, and what is not: in flights whose air moves, and in flights on which a
//! force acts that has as little pattern.

use hidden_effects::case::{Case, Set};
use hidden_effects::catalogue::{HiddenEffect, Value};
use hidden_effects::outside::{Formula, Makes, Outside, Shape};
use squirrel_gap::{Kind, Verdict, diagnose};
use squirrel_log::FlightLog;
use squirrel_sim::vehicle_file::VehicleFile;

/// Verdict and names of a case.
pub(super) fn told(case: &Case) -> (Kind, Vec<&'static str>) {
    let found = verdict(case);
    (found.verdict, found.effects.iter().map(|effect| effect.name).collect())
}

fn verdict(case: &Case) -> Verdict {
    let vehicle = VehicleFile::parse(&case.vehicle_toml(), "vehicle.toml").unwrap();
    let flight = |number: usize| -> (String, FlightLog) {
        (format!("flight {number}"), case.flight(number).unwrap())
    };
    let (flights, held_out) = ([flight(0), flight(1)], [flight(2)]);
    diagnose(&vehicle, &flights, &held_out, &|_| ()).unwrap().verdict
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

/// A drag law that is another one goes with the motion through the air, which the wind that is
/// named makes of the motion over the ground.
#[test]
fn what_goes_with_the_motion_through_windy_air_is_no_gust() {
    let wind = [("wind_north_m_s", 3.0), ("wind_east_m_s", -2.0)];
    let wind = HiddenEffect {
        name: "constant_wind".to_owned(),
        form: "standard".to_owned(),
        parameters: wind.map(|(key, x)| (key.to_owned(), Value::Number(x))).into(),
    };
    let mut weights = [0.0; 8];
    weights[0] = 1.6;
    let drag = Outside::Formula(Formula {
        shape: Shape::Tanh,
        makes: Makes::BodyForce,
        size: 0.8,
        axis: [1.0, 0.0, 0.0],
        first: weights,
        second: weights,
        lag_s: 0.01,
        gate: None,
    });
    let case = Case::draw(Set::None, 0, 2).hiding(vec![wind], Some(drag));
    let found = verdict(&case);
    let goes_with = found.leftover.and_then(|left| left.goes_with).unwrap();
    let share = goes_with.strip_prefix("velocity (").and_then(|rest| rest.split_once(" %"));
    assert!(share.is_some_and(|(share, _)| share.parse::<f64>().unwrap() > 80.0), "{goes_with}");
    let names: Vec<_> = found.effects.iter().map(|effect| effect.name).collect();
    assert_eq!((found.verdict, names), (Kind::NamedIncomplete, vec!["constant_wind"]));
}
