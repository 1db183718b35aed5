//! The answer of the workflow, in the words that files, tests and people share.

use crate::closed_loop::ClosedLoop;
use crate::find::Place;
use crate::leftover::Leftover;
use crate::predictor::CHANNELS;
use serde::Serialize;
use std::collections::BTreeMap;

/// Exactly one of these is the answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// No effect above its tolerance.
    None,
    /// These effects, in these forms.
    Named,
    /// These effects lead in evidence and hold on held-out flights; something else remains.
    NamedIncomplete,
    /// These effects, but none of their published forms accounts for all of it.
    NamedFormDiffers,
    /// One of several sets that these flights cannot tell apart.
    Ambiguous,
    /// Something is missing that the catalogue does not have.
    OutsideCatalogue,
    /// These flights do not show some effects at any plausible size.
    NotIdentifiable,
    /// The log contradicts itself; nothing is said about forces.
    DataProblem,
}

/// A number with its 95 % interval; choices (an axis, a side) have a word, at both ends, too.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Value {
    /// A number in the unit of its key.
    Number {
        /// Most likely value.
        value: f64,
        /// Lower end of the 95 % interval.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// A choice.
    Choice {
        /// As vehicle files write it.
        value: &'static str,
        /// The same.
        low: &'static str,
        /// The same.
        high: &'static str,
    },
}

/// One named effect.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NamedEffect {
    /// Name in the catalogue.
    pub name: &'static str,
    /// Its published form; `standard` where there is one form only.
    pub form: &'static str,
    /// What it is worth: evidence of the set with it over the set without it, nats.
    pub evidence_nats: f64,
    /// By key, as vehicle files write them.
    pub parameters: BTreeMap<&'static str, Value>,
}

/// A number of the vehicle, inside its declared tolerance or near it, that moved with the named
/// effects: theirs hold with it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Moved {
    /// `mass_error.mass_fraction`, `weak_rotor[2].thrust_loss_fraction`,
    /// `rotor[0].position_body_m[1]` (rotors of effects count from 1, tables of the file from 0).
    pub name: String,
    /// By how much, in the unit of the name.
    pub value: f64,
    /// Standard deviation that these flights leave it.
    pub sd: f64,
    /// What the vehicle file allows it, one standard deviation.
    pub tolerance: f64,
}

impl Moved {
    /// How many of its tolerances it moved.
    pub(crate) fn far(&self) -> f64 {
        self.value.abs() / self.tolerance
    }
}

/// Another explanation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Alternative {
    /// Names of its effects.
    pub effects: Vec<&'static str>,
    /// Evidence over no effect at all, nats.
    pub evidence_nats: f64,
    /// Its effects with their numbers, for who chooses it.
    #[serde(skip)]
    pub numbers: Vec<NamedEffect>,
}

/// What the names leave of the flights that they were fitted to.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Left {
    /// Part of the mean square above noise, in units of noise, that the names remove, over all
    /// channels.
    pub share_removed: f64,
    /// What is left above noise and tolerances, as part of what was measured about its mean, rms,
    /// in the channels that stand out; 0 where none does.
    pub share_left: f64,
    /// The channels that stand out, the worst first.
    pub channels: Vec<&'static str>,
    /// What it goes with, where something predicts it.
    pub goes_with: Option<String>,
}

impl Left {
    pub(crate) fn of(leftover: &Leftover) -> Self {
        let excess = |rms: f64, floor: f64| (rms.powi(2) - floor.powi(2)).max(0.0);
        let (mut before, mut after, mut left, mut measured) = (0.0, 0.0, 0.0, 0.0);
        for band in &leftover.bands {
            let noise = band.slow_floor.powi(2);
            before += excess(band.slow_nominal, band.slow_floor) / noise;
            after += excess(band.slow, band.slow_floor) / noise;
            if leftover.excess.iter().any(|(channel, _)| *channel == band.channel) {
                left += excess(band.slow, band.slow_floor);
                measured += band.slow_measured.powi(2);
            }
        }
        Self {
            share_removed: if before > 0.0 { 1.0 - after / before } else { 0.0 },
            share_left: if measured > 0.0 { (left / measured).sqrt() } else { 0.0 },
            channels: leftover.excess.iter().map(|(channel, _)| CHANNELS[*channel]).collect(),
            goes_with: leftover.goes_with(),
        }
    }
}

/// What the explanation is worth on flights that it never saw.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Gap {
    /// Names of the flights.
    pub held_out_flights: Vec<String>,
    /// Error over that of the noise floor, mean over channels, of the vehicle as it was; 1 is
    /// nothing but noise.
    pub before: f64,
    /// The same with the named effects.
    pub after: f64,
    /// The same with the best other name.
    pub best_rival: Option<f64>,
    /// Part of what was above the floor that the named effects remove.
    pub removed_fraction: f64,
    /// Part that the best other name removes.
    pub best_rival_removed_fraction: Option<f64>,
}

/// What flights are compared with, where they are compared with good ones of the same machine.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Since {
    /// Names of the good flights.
    pub flights: Vec<String>,
    /// Each rotor, in command order; empty where the flights do not show it.
    pub rotors: Vec<RotorHealth>,
}

/// How one rotor is against the good flights, whatever has a name.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RotorHealth {
    /// Number, from 1.
    pub rotor: usize,
    /// Part of its thrust that it lacks, with its 95 % interval if every rotor may be off.
    pub thrust_loss_fraction: Value,
    /// By how much it differs from one good flight to another, one standard deviation.
    pub usual: f64,
}

/// A flight that nothing is said about, because its data contradict themselves.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SetAside {
    /// Name of the flight.
    pub flight: String,
    /// Full name of the channel.
    pub channel: &'static str,
    /// What is wrong and what to change, in one line that names both.
    pub words: String,
}

/// The verdict on a set of flights.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    /// Which of the answers.
    pub verdict: Kind,
    /// What is missing, the most certain first.
    pub effects: Vec<NamedEffect>,
    /// What moved with the effects, the farthest first; without effects, what moved by three of its
    /// tolerances and more.
    pub moved: Vec<Moved>,
    /// Other sets, the best first.
    pub alternatives: Vec<Alternative>,
    /// Where the flights disagree with the vehicle as it was, the worst first.
    #[serde(rename = "where")]
    pub places: Vec<Place>,
    /// What a leftover goes with.
    pub goes_with: Option<String>,
    /// What to fly to know more.
    pub fly_next: Option<String>,
    /// On held-out flights, if there are any.
    pub gap: Option<Gap>,
    /// What the names leave; none where nothing was looked for, or only what lasts.
    pub leftover: Option<Left>,
    /// Held-out flights of our own flight code, flown again; empty until somebody does, and for
    /// those of other autopilots.
    pub closed_loop: Vec<ClosedLoop>,
    /// Path of the vehicle file with the effects added.
    pub model_patch: Option<String>,
    /// What the flights are compared with, if not with the vehicle file alone.
    pub baseline: Option<Since>,
    /// One paragraph in plain words.
    pub words: String,
    /// Flights that took no part, of those to fit and of those held out.
    pub set_aside: Vec<SetAside>,
    /// What the logs lack, and what was taken instead.
    pub notes: Vec<String>,
}

impl Verdict {
    /// Whether a flight was looked at, or set aside.
    pub fn has_looked_at(&self, flight: &str) -> bool {
        self.set_aside.iter().all(|aside| aside.flight != flight)
    }

    /// Whether something is missing, in flights that do not say how the vehicle moves through the
    /// air, so that it may be what the catalogue has.
    pub(crate) fn is_unseen(&self) -> bool {
        self.verdict == Kind::NotIdentifiable && self.effects.is_empty() && self.goes_with.is_some()
    }
}

/// Why a vehicle file has nothing to take from a verdict, in one line; `None` where the verdict
/// names what the file lacks.
pub fn nothing_to_add(verdict: &Verdict) -> Option<String> {
    Some(match verdict.verdict {
        Kind::Named | Kind::NamedIncomplete | Kind::NamedFormDiffers => return None,
        Kind::None => "no effect is above its tolerance".to_owned(),
        Kind::Ambiguous => {
            let own: Vec<&str> = verdict.effects.iter().map(|effect| effect.name).collect();
            let others = verdict.alternatives.iter().map(|other| other.effects.join(" + "));
            let sets: Vec<String> = std::iter::once(own.join(" + ")).chain(others).collect();
            format!(
                "these flights do not tell apart {}; `gap add --effect NAME` takes one of them",
                sets.join(", ")
            )
        }
        Kind::OutsideCatalogue => {
            "something is missing that the catalogue does not have".to_owned()
        }
        Kind::NotIdentifiable if verdict.is_unseen() => {
            "something is missing, which flights without attitude and velocity do not name"
                .to_owned()
        }
        Kind::NotIdentifiable if verdict.effects.is_empty() => {
            "nothing is above its tolerance, in flights that would not show every effect".to_owned()
        }
        Kind::NotIdentifiable => "too many names explain these flights".to_owned(),
        Kind::DataProblem => match &verdict.goes_with {
            Some(channel) => format!("the log contradicts itself, {channel}"),
            None => "the log contradicts itself".to_owned(),
        },
    })
}
