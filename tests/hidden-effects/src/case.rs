//! Cases: what is drawn, what is hidden, and the files that go to the program and those that do not.

use crate::airframe::Airframe;
use crate::catalogue::{CATALOGUE, CLASS_MASS_KG, Entry, HiddenEffect};
use crate::draw::{Draw, mix};
use crate::independent::{self, Excitation, Order, Pack};
use crate::outside::Outside;
use crate::squirrel_made;
use serde::{Deserialize, Serialize};
use squirrel_sim::log::LogError;
use std::fs;
use std::path::{Path, PathBuf};

/// A group of cases that is scored together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Set {
    /// One effect of the catalogue.
    Single,
    /// Two of different kinds.
    Two,
    /// Nothing.
    None,
    /// Physics that no catalogue has.
    Outside,
    /// One effect in another published form.
    OtherForm,
    /// One effect, twice the noise.
    NoiseX2,
    /// One effect, three times the noise.
    NoiseX3,
    /// One effect, normal excitation.
    Normal,
    /// One effect, calm excitation.
    Calm,
}

impl Set {
    /// All sets with the number of cases of a full run.
    pub const ALL: [(Self, usize); 9] = [
        (Self::Single, 290),
        (Self::Two, 200),
        (Self::None, 300),
        (Self::Outside, 200),
        (Self::OtherForm, 60),
        (Self::NoiseX2, 60),
        (Self::NoiseX3, 60),
        (Self::Normal, 60),
        (Self::Calm, 60),
    ];

    /// Name as on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Single => "single",
            Self::Two => "two",
            Self::None => "none",
            Self::Outside => "outside",
            Self::OtherForm => "other_form",
            Self::NoiseX2 => "noise_x2",
            Self::NoiseX3 => "noise_x3",
            Self::Normal => "normal",
            Self::Calm => "calm",
        }
    }

    /// The set of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().map(|(set, _)| set).find(|set| set.name() == name)
    }

    fn excitation(self) -> Excitation {
        match self {
            Self::Normal => Excitation::Normal,
            Self::Calm => Excitation::Calm,
            _ => Excitation::Rich,
        }
    }

    fn noise(self) -> f64 {
        match self {
            Self::NoiseX2 => 2.0,
            Self::NoiseX3 => 3.0,
            _ => 1.0,
        }
    }
}

/// Who flies a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Generator {
    /// [`crate::independent`].
    Independent,
    /// [`crate::squirrel_made`].
    Squirrel,
}

impl Generator {
    /// Each flies every other case of a set, and so every effect and form. What no catalogue has, only one can fly.
    fn of(set: Set, index: usize) -> Self {
        let round = match set {
            Set::Outside => return Self::Independent,
            // An even number of forms: the generators change places from one round to the next.
            Set::OtherForm => index / forms().len(),
            _ => 0,
        };
        if (index + round).is_multiple_of(2) { Self::Independent } else { Self::Squirrel }
    }
}

/// Every form that is not the standard one.
fn forms() -> Vec<(&'static Entry, &'static str)> {
    CATALOGUE.iter().flat_map(|entry| entry.forms.iter().map(move |form| (entry, *form))).collect()
}

/// What a case hides; the file that the program under test never sees.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// Name of the case's folder.
    pub case: String,
    /// The set that it belongs to.
    pub set: Set,
    /// Who flew it.
    pub generator: Generator,
    /// What was flown.
    pub excitation: Excitation,
    /// Factor on the sensors' white noise.
    pub noise: f64,
    /// Effects of the catalogue.
    pub effects: Vec<HiddenEffect>,
    /// What no catalogue has.
    pub outside: Option<Outside>,
}

/// A drawn case.
#[derive(Debug, Clone)]
pub struct Case {
    /// What it hides.
    pub answer: Answer,
    nominal: Airframe,
    seed: u64,
}

/// Why a case could not be made; one line.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CaseError {
    /// The disk refuses.
    #[error("{file}: {source}")]
    Io {
        /// Path as given.
        file: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// A flight could not be written.
    #[error(transparent)]
    Log(#[from] LogError),
    /// A flight ended early.
    #[error("case {case} ({hidden}): {reason}")]
    Flight {
        /// Name of the case.
        case: String,
        /// What it hides.
        hidden: String,
        /// When and how.
        reason: String,
    },
}

impl CaseError {
    pub(crate) fn io(path: &Path) -> impl FnOnce(std::io::Error) -> Self + '_ {
        |source| Self::Io { file: path.display().to_string(), source }
    }
}

const STANDARD: &str = "standard";

/// A case whose vehicle does not stay up is drawn anew so often: an effect near its largest can make a low hover impossible.
const REDRAWS: u64 = 12;

/// Seeds of a case: its own, and those that are tried where the vehicle fell.
pub(crate) fn seeds(seed: u64) -> impl Iterator<Item = u64> {
    std::iter::once(seed).chain((1..REDRAWS).map(move |again| mix(seed, again)))
}

impl Case {
    /// The case of a number in a set. The same arguments give the same case.
    pub fn draw(set: Set, index: usize, seed: u64) -> Self {
        let seed = mix(mix(seed, set as u64), index as u64);
        let mut draw = Draw::new(mix(seed, 1));
        let nominal = Airframe::draw(&mut draw);
        let one = |draw: &mut Draw, entry: &Entry, form: &str| {
            entry.draw(draw, form, nominal.mass_kg, nominal.rotors.len())
        };
        let mut outside = None;
        let first = &CATALOGUE[index % CATALOGUE.len()];
        let effects = match set {
            Set::None => Vec::new(),
            Set::Outside => {
                outside = Some(Outside::draw(
                    index % Outside::KINDS,
                    &mut draw,
                    nominal.mass_kg,
                    nominal.rotors.len(),
                ));
                Vec::new()
            }
            Set::Two => {
                let partners: Vec<_> = CATALOGUE.iter().filter(|other| first.goes_with(other)).collect();
                let second = partners[draw.index(partners.len())];
                vec![one(&mut draw, first, STANDARD), one(&mut draw, second, STANDARD)]
            }
            Set::OtherForm => {
                let forms = forms();
                let (entry, form) = forms[index % forms.len()];
                vec![one(&mut draw, entry, form)]
            }
            Set::Single | Set::NoiseX2 | Set::NoiseX3 | Set::Normal | Set::Calm => {
                vec![one(&mut draw, first, STANDARD)]
            }
        };
        let answer = Answer {
            case: format!("{:010x}", mix(seed, 2) >> 24),
            set,
            generator: Generator::of(set, index),
            excitation: set.excitation(),
            noise: set.noise(),
            effects,
            outside,
        };
        Self { answer, nominal, seed }
    }

    /// Draws a case and makes it in a folder, as [`Self::make`]; one that cannot be flown is drawn again.
    ///
    /// # Errors
    /// [`CaseError`]
    pub fn draw_and_make(
        set: Set,
        index: usize,
        seed: u64,
        folder: &Path,
    ) -> Result<(Self, PathBuf), CaseError> {
        let make = |seed| {
            let case = Self::draw(set, index, seed);
            case.make(folder).map(|path| (case, path))
        };
        let mut made = make(seed);
        for seed in seeds(seed).skip(1) {
            if !matches!(made, Err(CaseError::Flight { .. })) {
                break;
            }
            made = make(seed);
        }
        made
    }

    /// The same vehicle and the same flights with something else hidden.
    #[must_use]
    pub fn hiding(&self, effects: Vec<HiddenEffect>, outside: Option<Outside>) -> Self {
        let mut other = self.clone();
        (other.answer.effects, other.answer.outside) = (effects, outside);
        other
    }

    /// Flies the case and writes `FOLDER/cases/ID/` (`vehicle.toml`, `train/`, `held-out/`) and `FOLDER/answers/ID.json`.
    /// Returns the case's folder, which appears only when it is whole.
    ///
    /// # Errors
    /// [`CaseError`]
    pub fn make(&self, folder: &Path) -> Result<PathBuf, CaseError> {
        let id = &self.answer.case;
        let (cases, answers) = (folder.join("cases"), folder.join("answers"));
        let flights = [self.flight(0)?, self.flight(1)?, self.flight(2)?];
        let partial = cases.join(format!("{id}.partial"));
        for path in [&partial.join("train"), &partial.join("held-out"), &answers] {
            fs::create_dir_all(path).map_err(CaseError::io(path))?;
        }
        let vehicle = partial.join("vehicle.toml");
        fs::write(&vehicle, self.nominal.to_toml()).map_err(CaseError::io(&vehicle))?;
        for (flight, name) in flights.iter().zip(FLIGHTS) {
            flight.write(&partial.join(name))?;
        }
        let whole = cases.join(id);
        if whole.exists() {
            fs::remove_dir_all(&whole).map_err(CaseError::io(&whole))?;
        }
        fs::rename(&partial, &whole).map_err(CaseError::io(&whole))?;
        let answer = answers.join(format!("{id}.json"));
        write_json(&answer, &self.answer)?;
        Ok(whole)
    }

    /// Flight 0 and 1 of the training, 2 held out.
    ///
    /// # Errors
    /// [`CaseError::Flight`] if the vehicle does not stay up.
    pub fn flight(&self, number: usize) -> Result<squirrel_sim::log::FlightLog, CaseError> {
        let mut draw = Draw::new(mix(self.seed, 3));
        let (real, errors) = self.nominal.individual(&mut draw);
        let heavy = self.nominal.mass_kg / CLASS_MASS_KG;
        let pack = Pack {
            resistance_ohm: draw.uniform(0.035, 0.08) / heavy,
            slow_ohm: draw.uniform(0.01, 0.03) / heavy,
            capacity_ah: 1.3 * heavy,
        };
        // One training flight starts high, the other low; the held-out one anywhere between.
        let charges = [draw.uniform(0.85, 0.95), draw.uniform(0.5, 0.65), draw.uniform(0.55, 0.9)];
        let order = Order {
            nominal: &self.nominal,
            real: &real,
            errors,
            pack,
            effects: &self.answer.effects,
            outside: self.answer.outside,
            excitation: self.answer.excitation,
            noise: self.answer.noise,
            charge: charges[number],
            seed: 0,
        };
        // A flight that ends early is flown again in another order of manoeuvres.
        let attempt = |attempt: u64| {
            let seed = mix(self.seed, 10 + number as u64 + 100 * attempt);
            match self.answer.generator {
                Generator::Independent => independent::fly(&Order { seed, ..order.clone() }),
                Generator::Squirrel => squirrel_made::fly(&squirrel_made::Order {
                    real: order.real,
                    errors,
                    resistance_ohm: pack.resistance_ohm,
                    effects: order.effects,
                    excitation: order.excitation,
                    noise: order.noise,
                    charge: order.charge,
                    seed,
                }),
            }
        };
        attempt(0).or_else(|_| attempt(1)).or_else(|_| attempt(2)).map_err(|reason| CaseError::Flight {
            case: self.answer.case.clone(),
            hidden: format!("{:?} {:?}", self.answer.effects, self.answer.outside),
            reason,
        })
    }

    /// The vehicle as its file states it.
    pub fn nominal(&self) -> &Airframe {
        &self.nominal
    }
}

/// Where the flights of a case stand in its folder.
pub const FLIGHTS: [&str; 3] = ["train/flight00.mcap", "train/flight01.mcap", "held-out/flight00.mcap"];

/// Writes JSON under a temporary name, then renames.
///
/// # Errors
/// [`CaseError::Io`] if the disk refuses.
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<(), CaseError> {
    let mut text = serde_json::to_string_pretty(value)
        .map_err(|error| CaseError::Io { file: path.display().to_string(), source: error.into() })?;
    text.push('\n');
    let partial = path.with_extension("partial");
    fs::write(&partial, text).map_err(CaseError::io(&partial))?;
    fs::rename(&partial, path).map_err(CaseError::io(path))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn sets_hide_what_they_say() {
        for index in 0..60 {
            let hidden = |set| Case::draw(set, index, 1).answer;
            assert!(hidden(Set::None).effects.is_empty() && hidden(Set::None).outside.is_none());
            assert_eq!(hidden(Set::Two).effects.len(), 2);
            assert_ne!(hidden(Set::OtherForm).effects[0].form, STANDARD);
            assert!(hidden(Set::Outside).outside.is_some() && hidden(Set::Outside).effects.is_empty());
            assert_eq!(hidden(Set::NoiseX3).noise, 3.0);
        }
        let names: BTreeSet<_> =
            (0..29).map(|index| Case::draw(Set::Single, index, 1).answer.effects[0].name.clone()).collect();
        assert_eq!(names.len(), 29);
    }

    #[test]
    fn names_say_nothing_and_are_unique() {
        let mut names = BTreeSet::new();
        for (set, count) in Set::ALL {
            for index in 0..count {
                let name = Case::draw(set, index, 1).answer.case;
                assert!(name.len() == 10 && name.bytes().all(|b| b.is_ascii_hexdigit()));
                assert!(names.insert(name));
            }
        }
    }

    #[test]
    fn answers_survive_their_file() {
        for set in [Set::Two, Set::Outside, Set::OtherForm] {
            for index in 0..20 {
                let answer = Case::draw(set, index, 5).answer;
                let text = serde_json::to_string(&answer).unwrap();
                assert_eq!(serde_json::from_str::<Answer>(&text).unwrap(), answer);
            }
        }
    }
}
