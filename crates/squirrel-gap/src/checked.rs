//! What flights are worth before anybody looks for an effect in them, as plain data: the answer of
//! `squirrel gap check`.

use crate::verdict::SetAside;
use serde::Serialize;
use std::collections::BTreeMap;

/// What some flights are worth.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Check {
    /// One paragraph in plain words.
    pub words: String,
    /// The flights, those held out last.
    pub flights: Vec<FlightCheck>,
    /// What the flights to fit, together, could show; empty where all of them have a problem.
    pub effects: Vec<EffectCheck>,
    /// What to fly to show the rest; none where nothing is left, or no flight could.
    pub fly_next: Option<String>,
    /// What the logs lack, and what was taken instead.
    pub notes: Vec<String>,
}

/// One flight.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FlightCheck {
    /// Its name.
    pub flight: String,
    /// Whether it takes no part in the fit.
    pub is_held_out: bool,
    /// From the first sample of any source to the last, s.
    pub duration_s: f64,
    /// Time in which every needed channel is there, so that forces can be compared, s; 0 for a
    /// flight that is set aside.
    pub usable_s: f64,
    /// The channels that the workflow looks at, by name.
    pub channels: Vec<ChannelCheck>,
    /// Part of the commands at one of their ends, by rotor, in flight; empty without commands.
    pub saturated_share: Vec<f64>,
    /// Why it is set aside, and what to change: clocks, units, frames, held samples.
    pub problem: Option<SetAside>,
}

/// One channel of a flight.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChannelCheck {
    /// Full name.
    pub channel: String,
    /// Samples.
    pub samples: usize,
    /// One over the median time between two samples, Hz; 0 for less than two.
    pub rate_hz: f64,
    /// Longest time between two samples, s, and when it begins, s.
    pub largest_gap_s: f64,
    /// When it begins, s.
    pub largest_gap_at_s: f64,
    /// Part of the samples that repeat the one before to the bit.
    pub held_share: f64,
    /// Longest time without a change, s.
    pub longest_held_s: f64,
    /// Part of the samples that are not numbers.
    pub missing_share: f64,
}

/// Whether flights can show something.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Shows {
    /// At a plausible size.
    Can,
    /// At none.
    Cannot,
}

/// What flights could show of one effect.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EffectCheck {
    /// Name in the catalogue.
    pub name: &'static str,
    /// Whether each of its choices (a rotor, an axis, a side) could be named by one of its numbers.
    pub shown: Shows,
    /// Its numbers by choice.
    pub numbers: Vec<NumberCheck>,
    /// Effects that it cannot be told from at its largest plausible size.
    pub not_told_from: Vec<&'static str>,
    /// What keeps it from being shown, whatever is flown: a sensor, a part, a rate.
    pub lacks: Option<String>,
    /// The manoeuvre that shows it, where these flights cannot.
    pub fly: Option<&'static str>,
}

/// From which size on flights show one number of an effect.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NumberCheck {
    /// Key in the vehicle file, with its unit.
    pub key: &'static str,
    /// A rotor, an axis or a side, where the effect has one.
    pub choices: BTreeMap<&'static str, Choice>,
    /// Smallest size, of either sign, that would be named in nearly all flights like these; none
    /// where no size would.
    pub smallest_shown: Option<f64>,
    /// The same over the typical size, the geometric mean of `smallest` and `largest`.
    pub smallest_shown_of_typical: Option<f64>,
    /// Size below which it would not be named; between the two it is chance.
    pub not_shown_below: Option<f64>,
    /// Smallest size that is worth reporting.
    pub smallest: f64,
    /// Largest plausible size.
    pub largest: f64,
}

/// A choice as vehicle files write it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Choice {
    /// A rotor, from 1.
    Number(usize),
    /// An axis, a side, a form.
    Name(&'static str),
}

impl NumberCheck {
    /// Whether a plausible size would be named.
    pub fn can_be_shown(&self) -> bool {
        self.smallest_shown.is_some_and(|size| size <= self.largest)
    }

    /// Its choices in words: `rotor 2`; empty without.
    pub fn place(&self) -> String {
        let words = self.choices.iter().map(|(key, choice)| match choice {
            Choice::Number(number) => format!("{key} {number}"),
            Choice::Name(name) => format!("{key} {name}"),
        });
        words.collect::<Vec<_>>().join(", ")
    }
}

/// What an effect of wings lacks where there are none.
pub(crate) const NO_WINGS: &str = "the vehicle has no wings";

impl EffectCheck {
    /// Whether the vehicle has the part that it acts on.
    pub(crate) fn could_be(&self) -> bool {
        self.lacks.as_deref() != Some(NO_WINGS)
    }

    /// The number by which the choice that is shown worst is shown best: its size decides.
    pub fn decisive(&self) -> Option<&NumberCheck> {
        let size = |number: &NumberCheck| {
            number.smallest_shown.map_or(f64::INFINITY, |size| size / number.largest)
        };
        let mut best: Vec<&NumberCheck> = Vec::new();
        for number in &self.numbers {
            match best.iter_mut().find(|other| other.choices == number.choices) {
                Some(other) if size(number) < size(other) => *other = number,
                Some(_) => {}
                None => best.push(number),
            }
        }
        best.into_iter()
            .reduce(|worst, number| if size(number) > size(worst) { number } else { worst })
    }
}
