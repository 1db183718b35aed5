//! A verdict against the answer.

use super::ask::Asked;
use super::verdict::{Verdict, Word};
use crate::case::{Answer, Generator, Set};
use crate::catalogue::{HiddenEffect, Value};
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
    /// The name with the highest evidence is hidden; nothing or "outside" is said where that is the answer.
    pub first_right: bool,
    /// Exactly the hidden names; nothing or "outside" is said where that is the answer.
    pub exact: bool,
    /// The program says openly that it has no single answer, and is not wrong in it.
    pub flagged: bool,
    /// A name that is not hidden, said without a doubt.
    pub silent_wrong: bool,
    /// Part of the held-out gap that went away.
    pub gap_removed: Option<f64>,
    /// Wall time, s.
    pub seconds: f64,
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
    let truth: BTreeSet<&str> = answer.effects.iter().map(|effect| effect.name.as_str()).collect();
    let mut hidden: Vec<String> = truth.iter().map(|name| (*name).to_owned()).collect();
    if let Some(outside) = &answer.outside {
        let kind = serde_json::to_value(outside).ok().and_then(|v| v["kind"].as_str().map(str::to_owned));
        hidden.push(kind.unwrap_or_default());
    }
    let mut outcome = Outcome {
        case: answer.case.clone(),
        set: answer.set,
        generator: answer.generator,
        hidden,
        verdict: Word::Failed,
        named: Vec::new(),
        failure: None,
        first_right: false,
        exact: false,
        flagged: false,
        silent_wrong: false,
        gap_removed: None,
        seconds: asked.seconds,
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
    outcome.gap_removed = verdict.gap.and_then(|gap| gap.removed_fraction).filter(|x| x.is_finite());
    let names_surely = matches!(word, Word::Named | Word::NamedFormDiffers);
    outcome.silent_wrong = names_surely && verdict.names().iter().any(|name| !truth.contains(name));
    let open = matches!(word, Word::OutsideCatalogue | Word::NotIdentifiable | Word::DataProblem);
    let rightly_ambiguous =
        word == Word::Ambiguous && !truth.is_empty() && truth.is_subset(&verdict.all_names());
    outcome.flagged = open || rightly_ambiguous;
    if truth.is_empty() {
        let right = if answer.outside.is_some() { Word::OutsideCatalogue } else { Word::None };
        (outcome.first_right, outcome.exact) = (word == right, word == right);
        return outcome;
    }
    outcome.first_right =
        (names_surely || word == Word::Ambiguous) && verdict.first().is_some_and(|name| truth.contains(name));
    outcome.exact = names_surely && verdict.names() == truth;
    if names_surely {
        sizes(answer, &verdict, &mut outcome);
    }
    outcome
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
        let effects: Vec<_> = effects.iter().map(|name| format!(r#"{{"name": "{name}"}}"#)).collect();
        let others: Vec<_> = others.iter().map(|name| format!(r#"{{"effects": ["{name}"]}}"#)).collect();
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
            (said("named", &["actuation_latency"], &[]), [false, false, false, true]),
            (said("named", &["motor_lag", "gust"], &[]), [true, false, false, true]),
            (said("ambiguous", &["actuation_latency"], &["motor_lag"]), [false, false, true, false]),
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
        assert_eq!(marks(&against(Set::None, 0, &said("none", &[], &[]))), [true, true, false, false]);
        assert_eq!(
            marks(&against(Set::None, 0, &said("named", &["gust"], &[]))),
            [false, false, false, true]
        );
        let outside = said("outside_catalogue", &[], &[]);
        assert_eq!(marks(&against(Set::Outside, 0, &outside)), [true, true, true, false]);
        assert_eq!(against(Set::Outside, 0, &outside).hidden, ["mass_lost"]);
        let named = said("named", &["mass_error"], &[]);
        assert_eq!(marks(&against(Set::Outside, 0, &named)), [false, false, false, true]);
        let ambiguous = said("ambiguous", &["mass_error"], &["gust"]);
        assert_eq!(marks(&against(Set::Outside, 0, &ambiguous)), [false; 4]);
    }

    #[test]
    fn sizes_are_compared_and_their_intervals_too() {
        let truth = single_size(&Case::draw(Set::Single, 7, 1).answer.effects[0]).map(|(_, x)| x).unwrap();
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
        let size = |index| single_size(&Case::draw(Set::Single, index, 1).answer.effects[0]).is_some();
        assert!(size(8) && !size(2));
    }

    #[test]
    fn a_program_that_fails_has_named_nothing() {
        let answer = Case::draw(Set::None, 0, 1).answer;
        let outcome = score(&answer, Asked { verdict: Err("exit status: 1".to_owned()), seconds: 0.1 });
        assert_eq!((outcome.verdict, marks(&outcome)), (Word::Failed, [false; 4]));
    }
}
