//! Names beside a place that a model misses: what acts elsewhere keeps its name.

use super::gusts::told;
use hidden_effects::case::{Case, Set};
use squirrel_gap::Kind;

#[test]
fn what_acts_elsewhere_is_named_beside_moments_or_thrust_that_a_model_misses() {
    for (number, name) in [(2, "constant_wind"), (7, "weak_rotor")] {
        let case = Case::draw(Set::MisfitApart, number, 1);
        assert_eq!(case.answer.effects[0].name, name);
        let (verdict, names) = told(&case);
        assert!(verdict == Kind::NamedIncomplete && names == [name], "{verdict:?} {names:?}");
    }
}

/// Spread wings would feel a gust that blows up or down.
#[test]
fn a_horizontal_force_without_a_vertical_one_is_no_gust_to_spread_wings() {
    let case = Case::draw(Set::MisfitApart, 6, 1);
    assert_eq!(case.answer.effects[0].name, "motor_lag");
    let (verdict, names) = told(&case);
    assert!(verdict == Kind::NamedIncomplete && names == ["motor_lag"], "{verdict:?} {names:?}");
}

/// Motors that warm up lose thrust: moments alone ask for a smaller thrust coefficient, and what is
/// left of the force goes with time.
#[test]
fn what_changes_in_flight_is_no_constant_to_other_channels() {
    let case = Case::draw(Set::Outside, 16, 88181);
    assert_eq!(
        case.answer.outside.map(|outside| outside.name()).as_deref(),
        Some("thrust_heating")
    );
    let (verdict, _) = told(&case);
    assert_eq!(verdict, Kind::OutsideCatalogue);
}
