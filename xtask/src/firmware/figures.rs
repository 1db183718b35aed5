//! The figures: their names, their budget, and what is recorded of them.

use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Where they are recorded.
pub(super) const FIGURES: &str = "firmware/figures.txt";
/// A figure that grows by more than this is an error: compilers differ a little, careless code
/// more.
const GROWTH_ALLOWED: f64 = 0.05;
/// Clock of the real part, and rate of the step, Hz.
const CLOCK_HZ: f64 = 480e6;
const RATE_HZ: f64 = 300.0;

/// A figure by its name with unit.
pub(super) type Figures = BTreeMap<&'static str, u64>;

const INNER: &str = "inner step, worst, instructions";
const OUTER: &str = "inner and outer step with paRNN, worst, instructions";
const INERTIAL: &str = "estimator, inertial units alone, worst, instructions";
const WHOLE_MEAN: &str = "whole step, mean, instructions";
const WHOLE_WORST: &str = "whole step, worst, instructions";
const CONTROL_TEXT: &str = "control image: text, B";
const STATE: &str = "state, B";

/// Largest of all flights, and where a line of the image `play` has it. Inner and outer are control
/// without the estimator.
pub(super) const OF_ANY_FLIGHT: [(&str, usize); 8] = [
    ("inner step, mean of the worst arm, instructions", 6),
    (INNER, 7),
    ("estimator, inertial units alone, mean, instructions", 14),
    (INERTIAL, 15),
    ("estimator, fix, barometer or compass too, mean, instructions", 18),
    ("estimator, fix, barometer or compass too, worst, instructions", 19),
    (WHOLE_MEAN, 22),
    (WHOLE_WORST, 23),
];
/// Of the arm that has most to do in its outer loop.
pub(super) const OF_THE_LEARNED_ARM: [(&str, usize); 2] =
    [("inner and outer step with paRNN, mean, instructions", 10), (OUTER, 11)];
/// Text, constants and stack of the image that holds nothing but control.
pub(super) const OF_CONTROL: [&str; 3] =
    [CONTROL_TEXT, "control image: constants, B", "control: stack, worst case, B"];
/// And of the one that holds nothing but the whole step.
pub(super) const OF_STEP: [&str; 3] =
    ["step image: text, B", "step image: constants, B", "step: stack, worst case, B"];

/// What must not be exceeded, however slowly it grew.
const BUDGET: [(&str, u64); 6] = [
    (INNER, 4500),
    (OUTER, 40_000),
    (INERTIAL, 60_000),
    (CONTROL_TEXT, 52 * 1024),
    (STATE, 6 * 1024),
    // A load of 1.2 % at 480 MHz, one instruction a cycle.
    (WHOLE_MEAN, 19_200),
];

/// # Errors
/// What is missing or above its budget.
pub(super) fn check_budget(measured: &Figures) -> Result<(), String> {
    let within = |name: &str, most: u64| measured.get(name).is_some_and(|now| *now <= most);
    let above: Vec<String> = BUDGET
        .iter()
        .filter(|(name, most)| !within(name, *most))
        .map(|(name, most)| format!("{name} must be at most {most}"))
        .collect();
    if above.is_empty() { Ok(()) } else { Err(above.join("; ")) }
}

/// Name, budget, recorded and measured figure a line, and what grew.
pub(super) fn compare(
    measured: &Figures,
    recorded: &BTreeMap<String, u64>,
) -> (String, Vec<&'static str>) {
    let mut text = format!("{:<62} {:>7} {:>9} {:>9}\n", "figure", "budget", "recorded", "now");
    let mut grown = Vec::new();
    for (name, now) in measured {
        let before = recorded.get(*name);
        let shown = |figure: Option<&u64>| figure.map_or("-".to_owned(), u64::to_string);
        let most = BUDGET.iter().find(|(of, _)| of == name).map(|(_, most)| most);
        let _ = writeln!(text, "{name:<62} {:>7} {:>9} {now:>9}", shown(most), shown(before));
        if before.is_none_or(|before| *now as f64 > *before as f64 * (1.0 + GROWTH_ALLOWED)) {
            grown.push(*name);
        }
    }
    for (what, name) in [("mean", WHOLE_MEAN), ("were all as the worst", WHOLE_WORST)] {
        let percent = 100.0 * RATE_HZ * measured.get(name).map_or(0.0, |n| *n as f64) / CLOCK_HZ;
        let load = format!("load at 480 MHz, one instruction a cycle (a proxy), {what}");
        let _ = writeln!(text, "{load:<80} {percent:>8.2}%");
    }
    (text, grown)
}

/// The file of the figures.
pub(super) fn recorded(figures: &Figures) -> String {
    let mut text = String::from(
        "# Figures of the flight code on a Cortex-M7; `cargo xtask firmware --write` makes this file.\n",
    );
    for (name, value) in figures {
        let _ = writeln!(text, "{name}: {value}");
    }
    text
}

/// Reads what [`recorded`] wrote.
///
/// # Errors
/// The first line that is no figure.
pub(super) fn parse(text: &str) -> Result<BTreeMap<String, u64>, String> {
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    lines
        .map(|line| {
            let entry = line
                .rsplit_once(": ")
                .and_then(|(name, n)| Some((name.to_owned(), n.parse().ok()?)));
            entry
                .ok_or_else(|| format!("{FIGURES}: `{line}`: must be a name, a colon and a number"))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_grows_is_named_and_the_rest_is_shown() {
        let now = Figures::from([(STATE, 110), (INNER, 100)]);
        let before = parse(&recorded(&Figures::from([(STATE, 100), (INNER, 99)])));
        let (table, grown) = compare(&now, &before.unwrap());
        assert_eq!(grown, [STATE]);
        assert!(table.lines().any(|line| line.ends_with("6144       100       110")), "{table}");
        let (_, new) = compare(&now, &BTreeMap::new());
        assert_eq!(new.len(), 2, "a figure that is not recorded is not passed over");
        assert!(parse("state").is_err());
    }

    #[test]
    fn what_is_above_its_budget_or_missing_is_an_error() {
        let mut figures: Figures = BUDGET.into_iter().collect();
        assert_eq!(check_budget(&figures), Ok(()));
        figures.insert(INNER, 4501);
        figures.remove(STATE);
        let error = check_budget(&figures).unwrap_err();
        assert_eq!(
            error,
            "inner step, worst, instructions must be at most 4500; state, B must be at most 6144"
        );
    }
}
