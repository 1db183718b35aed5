//! Effects in a pilot's words, and how likely one explanation is beside another.

use super::units::{grouped, read_as, three, with_unit};
use crate::report::Answer;
use crate::verdict::{Alternative, NamedEffect, Value};
use squirrel_core::effects::{Effects, Kind as ParameterKind};
use squirrel_sim::vehicle_file::VehicleFile;

/// Other explanations and flights set aside that are told on the first screen; the panels below
/// have all.
pub(super) const TOLD: usize = 3;

fn words(effect: &NamedEffect) -> [String; 3] {
    let which = effect.parameters.iter().find_map(|(key, value)| match (*key, value) {
        ("rotor", Value::Number { value, .. }) => Some(format!("{value:.0}")),
        ("axis", Value::Choice { value: "x", .. }) => Some("roll".to_owned()),
        ("axis", Value::Choice { value: "y", .. }) => Some("pitch".to_owned()),
        ("axis", Value::Choice { value: "z", .. }) => Some("yaw".to_owned()),
        ("side", Value::Choice { value, .. }) => Some((*value).to_owned()),
        _ => None,
    });
    let own = Effects::<f64>::profile(effect.name).map(|profile| profile.words);
    let all = own.map_or([effect.name; 3], |own| [own.what, own.more, own.less]);
    all.map(|words| words.replace('@', which.as_deref().unwrap_or("?")))
}

/// An effect without its numbers: `thrust of rotor 3 (weak_rotor)`.
pub(super) fn noun(effect: &NamedEffect) -> String {
    let [noun, ..] = words(effect);
    format!("{noun} ({})", effect.name)
}

/// The effects of another explanation.
pub(super) fn nouns(other: &Alternative) -> String {
    let nouns = if other.numbers.len() == other.effects.len() {
        other.numbers.iter().map(noun).collect()
    } else {
        let words = |name: &str| Effects::<f64>::profile(name).map(|profile| profile.words);
        let find = |name: &str| words(name).filter(|words| !words.what.contains('@'));
        let noun = |name: &&str| {
            find(name).map_or((*name).to_owned(), |words| format!("{} ({name})", words.what))
        };
        other.effects.iter().map(noun).collect::<Vec<_>>()
    };
    nouns.join(" with ")
}

/// One size of an effect beside that of the vehicle file.
pub(super) struct Size {
    /// `thrust loss`, `24.3 %` and `23.1 to 25.5 %`.
    pub(super) name: String,
    pub(super) value: String,
    pub(super) interval: String,
    /// `; the file has 10.0 %`; empty where the file has none.
    pub(super) declared: String,
    /// By how many standard deviations it is above the vehicle file; NaN where it has none.
    pub(super) far: f64,
    /// Half width of the interval over the size, or over that of the file where it is larger; NaN
    /// where both are zero.
    pub(super) width: f64,
}

/// An interval of 95 % is so many standard deviations wide.
const WIDTH: f64 = 2.0 * 1.96;

/// The sizes of an effect, the farthest from the vehicle file first; an effect that the file lacks
/// is zero there.
pub(super) fn sizes(effect: &NamedEffect, vehicle: &VehicleFile) -> Vec<Size> {
    let mut declared = vehicle.effects;
    let declared =
        declared.get_mut(effect.name).map_or_else(Vec::new, |found| found.values.to_vec());
    let list = Effects::<f64>::parameters(effect.name).unwrap_or_default();
    let slot = |key: &str| list.iter().position(|p| p.key == key);
    // The file's own number is that of the same rotor, axis or side.
    let is_same = effect.parameters.iter().all(|(key, value)| {
        let Some(i) = slot(key) else { return true };
        let own = declared.get(i).copied().unwrap_or_default();
        match (list[i].kind, value) {
            (ParameterKind::Rotor, Value::Number { value, .. }) => own == *value,
            (ParameterKind::OneOf(names), Value::Choice { value, .. }) => {
                names.get(own as usize) == Some(value)
            }
            _ => true,
        }
    });
    let mut sizes: Vec<Size> = effect
        .parameters
        .iter()
        .filter_map(|(key, value)| {
            let Value::Number { value, low, high } = *value else { return None };
            let i = slot(key)?;
            if !matches!(list[i].kind, ParameterKind::Size { .. }) {
                return None;
            }
            let own = if is_same { declared.get(i).copied().unwrap_or_default() } else { 0.0 };
            let (name, unit, times) = read_as(key, value);
            let [of, from, to] = [value, low, high].map(|x| three(times * x));
            let declared = if own == 0.0 {
                String::new()
            } else {
                format!("; the file has {}", with_unit(&three(times * own), unit))
            };
            let sd = (high - low) / WIDTH;
            let larger = value.abs().max(own.abs());
            Some(Size {
                name,
                value: with_unit(&of, unit),
                interval: with_unit(&format!("{from} to {to}"), unit),
                declared,
                far: if sd > 0.0 { (value - own) / sd } else { f64::NAN },
                width: 0.5 * (high - low) / larger,
            })
        })
        .collect();
    let far = |size: &Size| if size.far.is_nan() { 0.0 } else { size.far.abs() };
    sizes.sort_by(|a, b| far(b).total_cmp(&far(a)));
    sizes
}

/// What an effect says: `Rotor 3 gives less thrust`.
pub(super) fn statement(effect: &NamedEffect, vehicle: &VehicleFile) -> String {
    let [_, more, less] = words(effect);
    let is_less = sizes(effect, vehicle).first().is_some_and(|size| size.far < 0.0);
    if is_less { less } else { more }
}

/// More than this many times is not counted.
const COUNTLESS: f64 = 1e6;

/// How many times likelier something is than what is so many nats behind: `400`, or
/// `more than a million`.
pub(super) fn times(nats: f64) -> String {
    let times = nats.exp();
    if times >= COUNTLESS {
        "more than a million".to_owned()
    } else if times >= 10.0 {
        // One digit: nobody knows the second.
        let digit = 10f64.powf(times.log10().floor());
        grouped(&format!("{}", (times / digit).round() * digit))
    } else {
        format!("{times:.1}")
    }
}

/// The same as odds: `400 : 1`.
pub(super) fn odds(nats: f64) -> String {
    if nats.exp() >= COUNTLESS {
        "> 1 million : 1".to_owned()
    } else {
        format!("{} : 1", times(nats))
    }
}

/// An answer without a number.
pub(super) fn said(answer: impl Into<String>, sentences: Vec<String>) -> Answer {
    Answer { answer: answer.into(), sentences, ..Answer::default() }
}

pub(super) fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

pub(super) fn small(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_lowercase().chain(letters).collect())
}

pub(super) fn full_stop(text: &str) -> String {
    if text.ends_with(['.', '?']) { text.to_owned() } else { format!("{text}.") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odds_are_read_with_one_digit() {
        let said = [0.5, 3.0, 6.0, 12.0, 14.0, 1e4].map(times);
        assert_eq!(
            said,
            ["1.6", "20", "400", "200\u{202f}000", "more than a million", "more than a million"]
        );
    }
}
