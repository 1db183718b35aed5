//! Plain words: what a verdict means, and what to fly next.

use crate::number::significant;
use crate::verdict::{Kind, NamedEffect, Value, Verdict};
use squirrel_core::effects::Effects;
use std::fmt::Write;
use std::path::Path;

/// Channels as files and panels call them, and as pilots do.
const CHANNELS: [(&str, &str); 21] = [
    ("force_body_x_n", "the forward force"),
    ("force_body_y_n", "the sideways force"),
    ("force_body_z_n", "the vertical force"),
    ("moment_body_x_n_m", "the roll moment"),
    ("moment_body_y_n_m", "the pitch moment"),
    ("moment_body_z_n_m", "the yaw moment"),
    ("gnss.velocity_north_m_s", "the velocity north"),
    ("gnss.velocity_east_m_s", "the velocity east"),
    ("gnss.velocity_down_m_s", "the velocity down"),
    ("specific force x", "the forward force"),
    ("specific force y", "the sideways force"),
    ("specific force z", "the vertical force"),
    ("angular acceleration x", "the roll moment"),
    ("angular acceleration y", "the pitch moment"),
    ("angular acceleration z", "the yaw moment"),
    ("attitude x", "the roll angle"),
    ("attitude y", "the pitch angle"),
    ("attitude z", "the heading"),
    ("angular rate x", "the roll rate"),
    ("angular rate y", "the pitch rate"),
    ("angular rate z", "the yaw rate"),
];

/// A text with its channels in a pilot's words.
pub(crate) fn spoken(text: &str) -> String {
    CHANNELS.iter().fold(text.to_owned(), |text, (name, words)| text.replace(name, words))
}

/// The manoeuvre that shows an effect and tells it from those it is confused with.
pub(crate) fn manoeuvre(effect: &str) -> &'static str {
    Effects::<f64>::profile(effect).map_or("the excite_rich scenario", |profile| profile.words.fly)
}

/// A path as it may be shown: of an absolute one, the last folder and the file.
pub(crate) fn short(name: &str) -> String {
    let path = Path::new(name);
    if !path.is_absolute() {
        return name.to_owned();
    }
    let parts: Vec<_> = path.iter().skip(1).map(|part| part.to_string_lossy()).collect();
    parts[parts.len().saturating_sub(2)..].join("/")
}

/// What to fly to see or to separate some effects.
pub(crate) fn fly_for(effects: &[&str]) -> String {
    let mut said: Vec<&str> = Vec::new();
    let mut text = String::new();
    for effect in effects {
        let what = manoeuvre(effect);
        if said.contains(&what) {
            continue;
        }
        said.push(what);
        let _ = write!(text, "{}{what} ({effect})", if text.is_empty() { "" } else { "; " });
    }
    text.push_str("; `squirrel fly --scenario excite_rich` flies most of it");
    text
}

/// An effect with its numbers: `motor_lag (extra_time_constant_s 0.0531, 0.0522 to 0.0540)`.
fn with_numbers(effect: &NamedEffect) -> String {
    let numbers: Vec<String> = effect
        .parameters
        .iter()
        .map(|(key, value)| match value {
            Value::Choice { value, .. } => format!("{key} {value}"),
            Value::Number { value, low, high } if low == high => format!("{key} {value}"),
            Value::Number { value, low, high } => {
                let [value, low, high] = [value, low, high].map(|x| significant(*x, 3));
                format!("{key} {value}, {low} to {high}")
            }
        })
        .collect();
    format!("{} ({})", effect.name, numbers.join("; "))
}

/// What is said of effects where numbers of the file moved and none has a name.
const TOO_LITTLE: &str = "No effect has the evidence that a name needs";

/// The verdict in one paragraph.
///
/// * `blind` - effects that these flights do not show
/// * `curve_hides_sag` - the thrust curve may be off by as much as a battery sags
pub(crate) fn paragraph(verdict: &Verdict, blind: &[&str], curve_hides_sag: bool) -> String {
    let effects: Vec<String> = verdict.effects.iter().map(with_numbers).collect();
    let effects = effects.join(" and ");
    let others: Vec<String> = verdict.alternatives.iter().map(|a| a.effects.join(" + ")).collect();
    let goes_with = verdict.goes_with.as_deref().unwrap_or("nothing that was tried");
    let lacks = match verdict.baseline {
        Some(_) => "Since its good flights the machine has got",
        None => "The vehicle file lacks",
    };
    let mut text = match verdict.verdict {
        // What moved beyond its tolerance is said below.
        Kind::None if !verdict.moved.is_empty() => format!("{TOO_LITTLE}."),
        Kind::None => "No effect above its tolerance: what the flights disagree by is what noise and the declared tolerances explain.".to_owned(),
        Kind::Named => format!("{lacks} {effects}."),
        Kind::NamedFormDiffers => format!(
            "{lacks} {effects}, but none of the published forms accounts for all of it; the rest goes with {goes_with}."
        ),
        Kind::NamedIncomplete => format!("{lacks} {effects}. {}.", remains(verdict)),
        Kind::Ambiguous => format!(
            "{lacks} {effects}, or one of: {}. These flights do not tell them apart.",
            others.join("; ")
        ),
        Kind::OutsideCatalogue => format!(
            "Something is missing that the catalogue does not have; it goes with {goes_with}.{}",
            if effects.is_empty() { String::new() } else { format!(" The nearest name, {effects}, does not account for it.") }
        ),
        Kind::NotIdentifiable if verdict.is_unseen() => format!(
            "Something is missing, and without attitude and velocity these flights cannot say what: they would not show {} at any plausible size.",
            blind.join(", ")
        ),
        Kind::NotIdentifiable if effects.is_empty() => format!(
            "{}, but these flights would not show {} at any plausible size.",
            if verdict.moved.is_empty() {
                "Nothing above its tolerance shows"
            } else {
                TOO_LITTLE
            },
            blind.join(", ")
        ),
        Kind::NotIdentifiable => format!("Something is missing, and too many names explain it in these flights: {effects}, or {}.", others.join("; ")),
        Kind::DataProblem => String::new(),
    };
    if let Some(gap) = &verdict.gap
        && !verdict.effects.is_empty()
    {
        let (before, after) = (gap.before, gap.after);
        let _ = if after > before {
            write!(
                text,
                " On held-out flights it makes the error larger ({before:.2} to {after:.2} times the noise floor)."
            )
        } else {
            write!(
                text,
                " On held-out flights it removes {:.1} % of the error above the noise floor ({before:.2} to {after:.2} times the floor).",
                100.0 * gap.removed_fraction
            )
        };
    }
    if verdict.effects.is_empty()
        && let Some(number) = verdict.moved.first()
    {
        let _ = write!(
            text,
            " Numbers of the file moved beyond their tolerance, which is too little for a name: {} by {:.1} tolerances{}.",
            number.name,
            number.far(),
            if verdict.moved.len() > 1 { ", and others" } else { "" }
        );
    }
    if !blind.is_empty() && verdict.verdict != Kind::NotIdentifiable {
        let _ = write!(text, " These flights would not show: {}.", blind.join(", "));
    }
    if curve_hides_sag {
        text.push_str(" Battery sag and the thrust curve are confounded in these flights: the curve's sd covers either.");
    }
    if let Some(fly_next) = &verdict.fly_next {
        let _ = write!(text, " Fly next: {fly_next}.");
    }
    text
}

/// What an incomplete answer leaves: how much, where, and with what it goes; or what held-out
/// flights alone lack; or names that the flights do not tell apart.
fn remains(verdict: &Verdict) -> String {
    let Some(left) = verdict.leftover.as_ref().filter(|left| !left.channels.is_empty()) else {
        if let Some(goes_with) = &verdict.goes_with {
            return format!("Something else remains; it goes with {goes_with}");
        }
        let sets: Vec<String> =
            verdict.alternatives.iter().map(|set| set.effects.join(" + ")).collect();
        return format!(
            "Something else remains, which these flights do not tell apart: {}",
            sets.join("; or ")
        );
    };
    let goes_with = left.goes_with.as_ref().map_or_else(
        || "nothing that was tried predicts it".to_owned(),
        |family| format!("it goes with {family}"),
    );
    let (share, channels) = (100.0 * left.share_left, left.channels.join(", "));
    format!("Something else remains, {share:.0} % of what was measured in {channels}; {goes_with}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_are_spoken_wherever_they_stand() {
        assert_eq!(
            spoken("velocity (60 % of force_body_z_n)"),
            "velocity (60 % of the vertical force)"
        );
    }

    #[test]
    fn numbers_read_as_people_write_them() {
        for (value, text) in [
            (0.0, "0"),
            (0.053_12, "0.0531"),
            (-0.000_123_4, "-0.000123"),
            (651.3, "651"),
            (1.0, "1.00"),
            (1.66e-5, "1.66e-5"),
            (-2.5e7, "-2.50e7"),
        ] {
            assert_eq!(significant(value, 3), text);
        }
    }
}
