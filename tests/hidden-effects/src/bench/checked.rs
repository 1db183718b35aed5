//! What `gap check` says of a hidden effect beforehand, against what is named afterwards.

use super::score::Outcome;
use crate::catalogue::{HiddenEffect, Value};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// The part of the check's JSON that the bench looks at.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Check {
    effects: Vec<Effect>,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct Effect {
    name: String,
    numbers: Vec<Number>,
    lacks: Option<String>,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct Number {
    key: String,
    choices: BTreeMap<String, serde_json::Value>,
    smallest_shown: Option<f64>,
    not_shown_below: Option<f64>,
}

/// What flights should show of an effect of its size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Foreseen {
    /// It is named in nearly all of them.
    Can,
    /// Between the two.
    Chance,
    /// In hardly any.
    Cannot,
}

impl Check {
    /// What it says of a hidden effect. Numbers of a vector count by their part of the size that
    /// each alone must have, squared.
    pub fn foresees(&self, hidden: &HiddenEffect) -> Foreseen {
        let told = self.effects.iter().find(|effect| effect.name == hidden.name);
        let Some(told) = told.filter(|effect| effect.lacks.is_none()) else {
            return Foreseen::Cannot;
        };
        let own = |key: &str| {
            let numbers = told.numbers.iter().filter(move |number| number.key == *key);
            numbers.filter(|number| number.is_of(hidden)).cloned().collect::<Vec<_>>()
        };
        let sum = |limit: fn(&Number) -> Option<f64>| -> f64 {
            let keys = hidden.sizes().concat();
            let part = |key: &&str| {
                let least = own(key).iter().filter_map(limit).reduce(f64::min)?;
                Some((hidden.number(key) / least).powi(2))
            };
            keys.iter().filter_map(part).sum()
        };
        if sum(|number| number.smallest_shown) >= 1.0 {
            Foreseen::Can
        } else if sum(|number| number.not_shown_below) < 1.0 {
            Foreseen::Cannot
        } else {
            Foreseen::Chance
        }
    }
}

/// What was foreseen, by set: cases, and those whose effect is named, of `can`, `chance`, `cannot`.
pub type Calibration = BTreeMap<&'static str, [[usize; 2]; 3]>;

/// Counts cases that were asked beforehand, by set and all together.
pub(super) fn calibration(cases: &[Outcome]) -> Calibration {
    let mut all = Calibration::new();
    for case in cases {
        let Some(foreseen) = case.foreseen else { continue };
        for group in [case.group, "all"] {
            let [cases, named] = &mut all.entry(group).or_default()[foreseen as usize];
            *cases += 1;
            *named += usize::from(case.exact);
        }
    }
    all
}

/// The same as a table.
pub(super) fn table(all: &Calibration) -> String {
    let mut text = format!(
        "\ncheck beforehand{:>19} {:>20} {:>20}\n",
        "can: named", "chance: named", "cannot: named"
    );
    for (group, counts) in all {
        let _ = write!(text, "{group:<15}");
        for [cases, named] in counts {
            let percent = 100.0 * *named as f64 / (*cases).max(1) as f64;
            let _ = write!(text, " {:>20}", format!("{named} of {cases} ({percent:.1} %)"));
        }
        text.push('\n');
    }
    text
}

impl Number {
    /// Whether it is of the rotor, the axis or the side where an effect is hidden.
    fn is_of(&self, hidden: &HiddenEffect) -> bool {
        self.choices.iter().all(|(key, choice)| match hidden.parameters.get(key) {
            Some(Value::Number(x)) => choice.as_f64() == Some(*x),
            Some(Value::Name(name)) => choice.as_str() == Some(name),
            None => true,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Case, Set};

    fn hidden(name: &str) -> HiddenEffect {
        (0..40)
            .flat_map(|index| Case::draw(Set::Single, index, 1).answer.effects)
            .find(|effect| effect.name == name)
            .unwrap()
    }

    fn check(effect: &str, numbers: &str, lacks: &str) -> Check {
        let text = format!(
            r#"{{"words": "", "effects": [{{"name": "{effect}", "numbers": [{numbers}], "lacks": {lacks}}}]}}"#
        );
        serde_json::from_str(&text).unwrap()
    }

    fn number(key: &str, choices: &str, from: f64, below: f64) -> String {
        format!(
            r#"{{"key": "{key}", "choices": {choices}, "smallest_shown": {from:e}, "not_shown_below": {below:e}}}"#
        )
    }

    #[test]
    fn sizes_are_compared_where_the_effect_is() {
        let weak = hidden("weak_rotor");
        let (rotor, size) = (weak.number("rotor"), weak.number("thrust_loss_fraction"));
        let told = |from: f64, below: f64, rotor: f64| {
            let number =
                number("thrust_loss_fraction", &format!(r#"{{"rotor": {rotor}}}"#), from, below);
            check("weak_rotor", &number, "null").foresees(&weak)
        };
        assert_eq!(told(0.9 * size, 0.5 * size, rotor), Foreseen::Can);
        assert_eq!(told(1.1 * size, 0.9 * size, rotor), Foreseen::Chance);
        assert_eq!(told(2.0 * size, 1.1 * size, rotor), Foreseen::Cannot);
        assert_eq!(told(0.9 * size, 0.5 * size, rotor + 1.0), Foreseen::Cannot, "another rotor");
        let number = number("thrust_loss_fraction", "{}", 0.1 * size, 0.05 * size);
        let lacking = check("weak_rotor", &number, r#""the log has no commands""#);
        assert_eq!(lacking.foresees(&weak), Foreseen::Cannot);
        assert_eq!(check("gust", &number, "null").foresees(&weak), Foreseen::Cannot);
    }

    #[test]
    fn a_vector_counts_by_both_of_its_numbers() {
        let wind = hidden("constant_wind");
        let [north, east] = ["wind_north_m_s", "wind_east_m_s"].map(|key| wind.number(key).abs());
        let told = |times: f64| {
            let numbers = [("wind_north_m_s", north), ("wind_east_m_s", east)]
                .map(|(key, size)| number(key, "{}", times * size, 0.5 * times * size));
            check("constant_wind", &numbers.join(","), "null").foresees(&wind)
        };
        assert_eq!(told(1.4), Foreseen::Can, "each is short, both together are not");
        assert_eq!(told(1.5), Foreseen::Chance);
        assert_eq!(told(3.0), Foreseen::Cannot);
    }
}
