//! A verdict against the answer.
//!
//! [`Outcome::right`] is what the set asks of a case: exactly the hidden names, or that nothing or
//! something unknown is said where that is so. Beside an unmodelled rest and without an inertial
//! unit the first name is enough. An erring sensor is named or flagged: a flight that is set aside,
//! a contradiction in the data, or something outside the catalogue. Of a file that says too much,
//! the effect is named with a number that mends the file.

use super::ask::Asked;
use super::checked::Foreseen;
use super::verdict::{Verdict, Word};
use crate::case::{Answer, Generator, Set};
use crate::catalogue::{HiddenEffect, Value};
use crate::outside::Outside;
use crate::overstate::Stated;
use crate::recorder::Recorder;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// How the program did on one case.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(clippy::struct_excessive_bools, reason = "each is counted")]
pub struct Outcome {
    /// Name of the case.
    pub case: String,
    /// Its set.
    pub set: Set,
    /// Where it is counted.
    pub group: &'static str,
    /// Who flew it.
    pub generator: Generator,
    /// Hidden effects, or the kind outside the catalogue.
    pub hidden: Vec<String>,
    /// What the program said.
    pub verdict: Word,
    /// Effects that it named, in its order.
    pub named: Vec<String>,
    /// Why it failed, if it did.
    pub failure: Option<String>,
    /// The name with the highest evidence is hidden; nothing or "outside" is said where that is the
    /// answer.
    pub first_right: bool,
    /// Exactly the hidden names; nothing or "outside" is said where that is the answer.
    pub exact: bool,
    /// The program says openly that it has no single answer, and is not wrong in it.
    pub flagged: bool,
    /// A name that is not hidden, said without a doubt.
    pub silent_wrong: bool,
    /// What the set asks for.
    pub right: bool,
    /// A patched vehicle file was written.
    pub patched: bool,
    /// Part of the held-out residual that the true vehicle file removes and the patched one
    /// removes, too.
    pub removable_removed: Option<f64>,
    /// Part of the held-out gap that went away.
    pub gap_removed: Option<f64>,
    /// Wall time, s.
    pub seconds: f64,
    /// What the program says beforehand, where it was asked.
    pub foreseen: Option<Foreseen>,
    /// Relative error of the size, for effects with one size.
    pub parameter_errors: BTreeMap<String, f64>,
    /// Whether the 95 % interval holds the size, likewise.
    pub parameter_covered: BTreeMap<String, bool>,
}

/// The effect's only size, if it has one.
fn single_size(effect: &HiddenEffect) -> Option<(&str, f64)> {
    let mut sizes = effect.parameters.iter().filter_map(|(key, value)| match value {
        Value::Number(x) if key != "rotor" => Some((key.as_str(), *x)),
        _ => None,
    });
    sizes.next().filter(|_| sizes.next().is_none())
}

pub(super) fn score(answer: &Answer, asked: Asked) -> Outcome {
    let truth = truth(answer);
    let mut hidden: Vec<String> = truth.iter().map(|name| (*name).to_owned()).collect();
    hidden.extend(answer.outside.as_ref().map(Outside::name));
    if let Recorder::Faulty(fault) = &answer.recorder
        && fault.name().is_none()
    {
        hidden.push("gyro_drift".to_owned());
    }
    let mut outcome = Outcome {
        case: answer.case.clone(),
        set: answer.set,
        group: answer.group(),
        generator: answer.generator,
        hidden,
        verdict: Word::Failed,
        named: Vec::new(),
        failure: None,
        first_right: false,
        exact: false,
        flagged: false,
        silent_wrong: false,
        right: false,
        patched: false,
        removable_removed: None,
        gap_removed: None,
        seconds: asked.seconds,
        foreseen: None,
        parameter_errors: BTreeMap::new(),
        parameter_covered: BTreeMap::new(),
    };
    let verdict = match asked.verdict {
        Ok(verdict) => verdict,
        Err(failure) => {
            outcome.failure = Some(failure);
            return outcome;
        }
    };
    let word = verdict.verdict;
    outcome.verdict = word;
    outcome.named = verdict.effects.iter().map(|effect| effect.name.clone()).collect();
    outcome.gap_removed =
        verdict.gap.and_then(|gap| gap.removed_fraction).filter(|x| x.is_finite());
    outcome.patched = verdict.model_patch.is_some();
    let names_surely = verdict.names_surely();
    outcome.silent_wrong = names_surely && verdict.names().iter().any(|name| !truth.contains(name));
    let open = matches!(word, Word::OutsideCatalogue | Word::NotIdentifiable | Word::DataProblem);
    let rightly_ambiguous =
        word == Word::Ambiguous && !truth.is_empty() && truth.is_subset(&verdict.all_names());
    outcome.flagged = open || rightly_ambiguous;
    if truth.is_empty() {
        let right = if answer.hides_nothing() { Word::None } else { Word::OutsideCatalogue };
        // Where nobody knows the velocity, nothing is seen and not everything could be.
        let unseen = answer.set == Set::Inertial && word == Word::NotIdentifiable;
        let is_right = word == right || (unseen && verdict.names().is_empty());
        (outcome.first_right, outcome.exact) = (is_right, is_right);
    } else {
        let names = names_surely || word == Word::Ambiguous;
        outcome.first_right = names && verdict.first().is_some_and(|name| truth.contains(name));
        outcome.exact = names_surely && verdict.names() == truth;
    }
    let unknown = matches!(word, Word::OutsideCatalogue | Word::DataProblem) || rightly_ambiguous;
    let set_aside = !verdict.set_aside.is_empty() && !outcome.silent_wrong;
    outcome.right = match (answer.set, &answer.stated) {
        (Set::Sensors, _) => outcome.exact || unknown || set_aside,
        (_, Some(stated)) => {
            let effect = &stated.effect.name;
            outcome.first_right && names_surely && is_where_it_is(&verdict, stated) && {
                stated.is_mended(answer.effects.first(), |key| verdict.number(effect, key))
            }
        }
        (Set::Capture | Set::Misfit, _) => outcome.first_right,
        // What acts in that place alone may be taken for the rest of it.
        (Set::MisfitApart, _) => outcome.first_right || word == Word::OutsideCatalogue,
        _ => outcome.exact,
    };
    if names_surely && answer.stated.is_none() {
        sizes(answer, &verdict, &mut outcome);
    }
    outcome
}

/// Names that a right verdict has.
fn truth(answer: &Answer) -> BTreeSet<&str> {
    if let Some(stated) = &answer.stated {
        return [stated.effect.name.as_str()].into();
    }
    let fault = match &answer.recorder {
        Recorder::Faulty(fault) => fault.name(),
        _ => None,
    };
    answer.effects.iter().map(|effect| effect.name.as_str()).chain(fault).collect()
}

/// A rotor, an axis or a side is the one that the file speaks of.
fn is_where_it_is(verdict: &Verdict, stated: &Stated) -> bool {
    let named = verdict.effects.iter().find(|named| named.name == stated.effect.name);
    ["rotor", "axis", "side"].iter().all(|key| match stated.effect.parameters.get(*key) {
        None => true,
        Some(place) => {
            let said = named.and_then(|named| named.parameters.get(*key)).map(|p| &p.value);
            match place {
                Value::Number(number) => said.and_then(serde_json::Value::as_f64) == Some(*number),
                Value::Name(name) => said.and_then(serde_json::Value::as_str) == Some(name),
            }
        }
    })
}

/// Errors of the sizes of rightly named effects in their standard form.
fn sizes(answer: &Answer, verdict: &Verdict, outcome: &mut Outcome) {
    for effect in answer.effects.iter().filter(|effect| effect.form == "standard") {
        let Some((key, size)) = single_size(effect) else { continue };
        let named = verdict.effects.iter().find(|named| named.name == effect.name);
        let Some(parameter) = named.and_then(|named| named.parameters.get(key)) else { continue };
        let Some(value) = parameter.value.as_f64() else { continue };
        outcome.parameter_errors.insert(effect.name.clone(), ((value - size) / size).abs());
        if let (Some(low), Some(high)) = (parameter.low.as_f64(), parameter.high.as_f64()) {
            outcome.parameter_covered.insert(effect.name.clone(), (low..=high).contains(&size));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;

    fn against(set: Set, index: usize, verdict: &str) -> Outcome {
        let answer = Case::draw(set, index, 1).answer;
        score(&answer, Asked { verdict: Ok(serde_json::from_str(verdict).unwrap()), seconds: 1.0 })
    }
    fn said(word: &str, effects: &[&str], others: &[&str]) -> String {
        let effects: Vec<_> =
            effects.iter().map(|name| format!(r#"{{"name": "{name}"}}"#)).collect();
        let others: Vec<_> =
            others.iter().map(|name| format!(r#"{{"effects": ["{name}"]}}"#)).collect();
        let (effects, others) = (effects.join(","), others.join(","));
        format!(r#"{{"verdict": "{word}", "effects": [{effects}], "alternatives": [{others}]}}"#)
    }
    fn marks(outcome: &Outcome) -> [bool; 4] {
        [outcome.first_right, outcome.exact, outcome.flagged, outcome.silent_wrong]
    }

    /// Case 7 of the single effects hides a lag.
    #[test]
    fn verdicts_on_one_effect() {
        for (verdict, expected) in [
            (said("named", &["motor_lag"], &[]), [true, true, false, false]),
            (said("named_form_differs", &["motor_lag"], &[]), [true, true, false, false]),
            (said("named_incomplete", &["motor_lag"], &[]), [true, true, false, false]),
            (said("named_incomplete", &["gust"], &[]), [false, false, false, true]),
            (said("named", &["actuation_latency"], &[]), [false, false, false, true]),
            (said("named", &["motor_lag", "gust"], &[]), [true, false, false, true]),
            (
                said("ambiguous", &["actuation_latency"], &["motor_lag"]),
                [false, false, true, false],
            ),
            (said("ambiguous", &["motor_lag"], &["gust"]), [true, false, true, false]),
            (said("ambiguous", &["gust"], &["cg_offset"]), [false, false, false, false]),
            (said("outside_catalogue", &["motor_lag"], &[]), [false, false, true, false]),
            (said("not_identifiable", &[], &[]), [false, false, true, false]),
            (said("none", &[], &[]), [false, false, false, false]),
        ] {
            let outcome = against(Set::Single, 7, &verdict);
            assert_eq!(outcome.hidden, ["motor_lag"]);
            assert_eq!(marks(&outcome), expected, "{verdict}");
        }
    }

    #[test]
    fn verdicts_where_nothing_or_the_unknown_is_hidden() {
        assert_eq!(
            marks(&against(Set::None, 0, &said("none", &[], &[]))),
            [true, true, false, false]
        );
        assert_eq!(
            marks(&against(Set::None, 0, &said("named", &["gust"], &[]))),
            [false, false, false, true]
        );
        let outside = said("outside_catalogue", &[], &[]);
        assert_eq!(marks(&against(Set::Outside, 0, &outside)), [true, true, true, false]);
        assert_eq!(against(Set::Outside, 0, &outside).hidden, ["mass_lost"]);
        let named = said("named", &["mass_error"], &[]);
        assert_eq!(marks(&against(Set::Outside, 0, &named)), [false, false, false, true]);
        let incomplete = said("named_incomplete", &["mass_error"], &[]);
        assert_eq!(marks(&against(Set::Outside, 0, &incomplete)), [false, false, false, true]);
        let ambiguous = said("ambiguous", &["mass_error"], &["gust"]);
        assert_eq!(marks(&against(Set::Outside, 0, &ambiguous)), [false; 4]);
    }

    fn right(set: Set, index: usize, verdict: &str) -> bool {
        against(set, index, verdict).right
    }

    /// Cases 0 to 4 hide a gyroscope's scale, an accelerometer's, a compass, a clock, a drift.
    #[test]
    fn erring_sensors_are_named_or_flagged() {
        let set = Set::Sensors;
        assert!(right(set, 0, &said("named", &["gyro_scale"], &[])));
        assert!(right(set, 3, &said("named_incomplete", &["clock_step"], &[])));
        for index in 0..5 {
            assert!(right(set, index, &said("outside_catalogue", &["inertia_error"], &[])));
            assert!(right(set, index, &said("data_problem", &[], &[])));
            assert!(!right(set, index, &said("none", &[], &[])));
            assert!(!right(set, index, &said("not_identifiable", &[], &[])));
            for word in ["named", "named_incomplete"] {
                let verdict = said(word, &["inertia_error"], &[]);
                assert!(!right(set, index, &verdict) && against(set, index, &verdict).silent_wrong);
            }
        }
        let aside = |word: &str, names: &[&str]| {
            said(word, names, &[]).replacen('{', r#"{"set_aside": [{"flight": "a"}], "#, 1)
        };
        assert!(
            right(set, 0, &aside("none", &[]))
                && !right(set, 0, &aside("named", &["inertia_error"]))
        );
        assert_eq!(against(set, 4, &said("none", &[], &[])).hidden, ["gyro_drift"]);
    }

    /// The name alone is not enough: the number must mend the file.
    #[test]
    fn overstated_effects_are_found_with_a_number_that_mends_the_file() {
        let answer = Case::draw(Set::Overstated, 0, 1).answer;
        let (truth, stated) = (answer.effects[0].clone(), answer.stated.unwrap());
        let verdict = |drag: f64| {
            format!(
                r#"{{"verdict": "named", "effects": [{{"name": "linear_drag", "parameters":
                    {{"extra_drag_n_s_per_m": {{"value": {drag}}}}}}}]}}"#
            )
        };
        let [is, file] =
            [&truth, &stated.effect].map(|effect| effect.number("extra_drag_n_s_per_m"));
        assert!(
            right(Set::Overstated, 0, &verdict(is))
                && right(Set::Overstated, 0, &verdict(0.9 * is + 0.1 * file))
        );
        assert!(
            !right(Set::Overstated, 0, &verdict(file)) && !right(Set::Overstated, 0, &verdict(0.0))
        );
        assert!(!right(Set::Overstated, 0, &said("none", &[], &[])));
        let wrong = against(Set::Overstated, 0, &said("named", &["gust"], &[]));
        assert!(wrong.silent_wrong && !wrong.right && wrong.hidden == ["linear_drag"]);
    }

    /// Half sets: the second case hides nothing. Beside a misfit and without an inertial unit the
    /// first name counts.
    #[test]
    fn other_sets_against_those_who_always_say_the_same() {
        let unseen = said("not_identifiable", &[], &[]);
        assert!(right(Set::Inertial, 1, &unseen) && !right(Set::Estimates, 1, &unseen));
        assert!(!right(Set::Inertial, 0, &unseen));
        assert!(right(Set::Inertial, 0, &said("named_incomplete", &["battery_sag"], &[])));
        for set in [Set::Estimates, Set::Capture, Set::Baseline] {
            assert!(
                !right(set, 0, &said("none", &[], &[])) && right(set, 1, &said("none", &[], &[]))
            );
            assert!(right(set, 0, &said("named", &["linear_drag"], &[])));
            let alarm = against(set, 1, &said("named_incomplete", &["linear_drag"], &[]));
            assert!(alarm.silent_wrong && !alarm.right && alarm.group.ends_with("_none"));
        }
        let two = said("named_incomplete", &["linear_drag", "gust"], &[]);
        assert!(right(Set::Misfit, 0, &two) && !right(Set::Estimates, 0, &two));
        assert!(against(Set::Misfit, 0, &two).silent_wrong);
        assert!(!right(Set::Misfit, 1, &two), "the second hides quadratic drag");
        let patch =
            said("named", &["linear_drag"], &[]).replacen('{', r#"{"model_patch": "a.toml", "#, 1);
        assert!(against(Set::Misfit, 0, &patch).patched && !against(Set::Misfit, 0, &two).patched);
    }

    #[test]
    fn sizes_are_compared_and_their_intervals_too() {
        let truth =
            single_size(&Case::draw(Set::Single, 7, 1).answer.effects[0]).map(|(_, x)| x).unwrap();
        let verdict = format!(
            r#"{{"verdict": "named", "effects": [{{"name": "motor_lag", "parameters":
                {{"extra_time_constant_s": {{"value": {}, "low": {}, "high": {}}}}}}}]}}"#,
            1.1 * truth,
            0.9 * truth,
            1.3 * truth
        );
        let outcome = against(Set::Single, 7, &verdict);
        assert!((outcome.parameter_errors["motor_lag"] - 0.1).abs() < 1e-9);
        assert!(outcome.parameter_covered["motor_lag"]);
        // A weak rotor has a number and a size; the wind has two sizes.
        let size =
            |index| single_size(&Case::draw(Set::Single, index, 1).answer.effects[0]).is_some();
        assert!(size(8) && !size(2));
    }

    #[test]
    fn a_program_that_fails_has_named_nothing() {
        let answer = Case::draw(Set::None, 0, 1).answer;
        let outcome =
            score(&answer, Asked { verdict: Err("exit status: 1".to_owned()), seconds: 0.1 });
        assert_eq!((outcome.verdict, marks(&outcome)), (Word::Failed, [false; 4]));
    }
}
