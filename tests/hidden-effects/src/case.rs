//! Cases: what is drawn, what is hidden, and the files that go to the program and those that do
//! not.

use crate::airframe::{Airframe, SensorErrors};
use crate::catalogue::{CATALOGUE, CLASS_MASS_KG, Entry, HiddenEffect};
use crate::draw::{Draw, mix};
use crate::further::{BLOWN, Further};
use crate::independent::{self, Excitation, Misfit, Order, Pack};
use crate::outside::Outside;
use crate::overstate::{Overstatement, Stated};
use crate::poor::Poor;
use crate::recorder::{Capture, Estimator, Recorder, SensorFault};
pub use crate::set::{Generator, Set};
use crate::set::{LOAD, forms};
use crate::squirrel_made;
use serde::{Deserialize, Serialize};
use squirrel_log::{FlightLog, LogError};
use std::fs;
use std::path::{Path, PathBuf};

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
    /// What the vehicle file says too much of.
    pub stated: Option<Stated>,
    /// What writes the log down.
    pub recorder: Recorder,
    /// Part of the variation of force and moment that is unmodelled.
    pub misfit: Option<Misfit>,
    /// What is poor about its flights.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub poor: Option<Poor>,
    /// What is flown, or stated, for the sake of what is hidden.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}

impl Answer {
    /// Whether there is nothing to be found.
    pub fn hides_nothing(&self) -> bool {
        let errs = matches!(self.recorder, Recorder::Faulty(_));
        self.effects.is_empty() && self.outside.is_none() && self.stated.is_none() && !errs
    }

    /// Where the case is counted.
    pub fn group(&self) -> &'static str {
        self.set.group(self.hides_nothing())
    }
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

/// What jets do depends on what files need not say; part of the vehicles whose file says it.
const DETAILED: f64 = 0.7;

/// A case whose vehicle does not stay up is drawn anew so often: an effect near its largest can
/// make a low hover impossible.
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
        let mut answer = Answer {
            case: format!("{:010x}", mix(seed, 2) >> 24),
            set,
            generator: Generator::of(set, index),
            excitation: set.excitation(),
            noise: set.noise(),
            effects: Vec::new(),
            outside: None,
            stated: None,
            recorder: Recorder::Board,
            misfit: None,
            poor: None,
            notes: Vec::new(),
        };
        let turn = if set.is_half() { index / 2 } else { index };
        let hides_nothing = set.is_half() && index % 2 == 1;
        let effects = set.effects();
        let first = effects[turn % effects.len()];
        let (mass_kg, rotors) = (nominal.mass_kg, nominal.rotors.len());
        match set {
            Set::None => {}
            Set::Outside => answer.outside = Some(Outside::draw(index, &mut draw, mass_kg, rotors)),
            Set::Sensors => answer.recorder = Recorder::Faulty(SensorFault::draw(index, &mut draw)),
            Set::Two => {
                let with_a_partner = |first: &'static Entry, draw: &mut Draw| {
                    let partners: Vec<_> =
                        CATALOGUE.iter().filter(|other| first.goes_with(other)).collect();
                    [first, partners[draw.index(partners.len())]]
                };
                let mut pair = with_a_partner(first, &mut draw);
                while pair.iter().any(|entry| entry.name == LOAD) {
                    pair = with_a_partner(&CATALOGUE[draw.index(CATALOGUE.len())], &mut draw);
                }
                answer.effects = pair.map(|entry| one(&mut draw, entry, STANDARD)).into();
            }
            Set::OtherForm => {
                let forms = forms();
                let (entry, form) = forms[index % forms.len()];
                answer.effects = vec![one(&mut draw, entry, form)];
            }
            Set::Overstated => {
                // Few cases see all four kinds of overstatement, and four rounds see each with each
                // effect.
                let round = index / effects.len() + index / 2;
                let drawn = Overstatement::draw(first, round, &mut draw, mass_kg, rotors);
                if drawn.is_of_the_other_side() {
                    answer.generator = Generator::Independent;
                }
                answer.effects = drawn.real.into_iter().collect();
                answer.stated = Some(drawn.stated);
            }
            _ if hides_nothing => {}
            _ => answer.effects = vec![one(&mut draw, first, STANDARD)],
        }
        match set {
            Set::Estimates => answer.recorder = Recorder::Estimator(Estimator::draw(&mut draw)),
            Set::Capture => answer.recorder = Recorder::Capture(Capture::draw(&mut draw)),
            Set::Misfit => answer.misfit = Some(Misfit::draw(&mut draw)),
            Set::MisfitApart => {
                // Each effect beside each place in three rounds.
                let place = index + index / effects.len();
                answer.misfit = Some(Misfit::draw(&mut draw).apart(place));
            }
            Set::Inertial => answer.poor = Some(Poor::inertial()),
            Set::Poor => {
                let poor = Poor::draw(index, &mut draw);
                answer.excitation = poor.excitation;
                answer.poor = Some(poor);
            }
            _ => {}
        }
        let mut case = Self { answer, nominal, seed };
        let mut draw = Draw::new(mix(seed, 5));
        // Some say no more of their propellers than most files do.
        if case.about().any(|name| name == BLOWN) && draw.uniform(0.0, 1.0) < DETAILED {
            case.nominal = case.nominal.detailed(&mut draw);
            case.answer.notes.push(
                "vehicle.toml: diameter of the propellers, place and chord of the wings".to_owned(),
            );
        }
        case.answer.notes.extend(case.further().notes());
        case
    }

    /// Names of the effects that it hides, or that its file states too much of.
    fn about(&self) -> impl Iterator<Item = &str> + Clone {
        let stated = self.answer.stated.iter().map(|stated| &stated.effect);
        self.answer.effects.iter().chain(stated).map(|effect| effect.name.as_str())
    }

    /// What is flown after the programme. Flights that are to excite less have nothing more.
    fn further(&self) -> Further {
        match self.answer.excitation {
            Excitation::Rich => Further::of(&self.about(), &self.nominal),
            Excitation::Normal | Excitation::Calm => Further::default(),
        }
    }

    /// Draws a case and makes it in a folder, as [`Self::make`]; one that cannot be flown is drawn
    /// again.
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
        other.answer.notes = other.further().notes();
        other
    }

    /// Flies the case and writes `FOLDER/cases/ID/` (`vehicle.toml`, `train/`, `held-out/`, and
    /// `baseline/` where good flights are given) and `FOLDER/answers/ID.json`, beside it the true
    /// vehicle as `ID.toml` where a patch is compared with it. Returns the case's folder, which
    /// appears only when it is whole.
    ///
    /// # Errors
    /// [`CaseError`]
    pub fn make(&self, folder: &Path) -> Result<PathBuf, CaseError> {
        let id = &self.answer.case;
        let (cases, answers) = (folder.join("cases"), folder.join("answers"));
        let names = self.flight_names();
        let flights =
            (0..names.len()).map(|number| self.flight(number)).collect::<Result<Vec<_>, _>>()?;
        let partial = cases.join(format!("{id}.partial"));
        let write = |path: &Path, text: &str| fs::write(path, text).map_err(CaseError::io(path));
        for (flight, name) in flights.iter().zip(names) {
            let path = partial.join(name);
            let folder = path.parent().unwrap_or(&partial);
            fs::create_dir_all(folder).map_err(CaseError::io(folder))?;
            flight.write(&path)?;
        }
        fs::create_dir_all(&answers).map_err(CaseError::io(&answers))?;
        write(&partial.join("vehicle.toml"), &self.vehicle_toml())?;
        let whole = cases.join(id);
        if whole.exists() {
            fs::remove_dir_all(&whole).map_err(CaseError::io(&whole))?;
        }
        fs::rename(&partial, &whole).map_err(CaseError::io(&whole))?;
        let answer = answers.join(format!("{id}.json"));
        write_json(&answer, &self.answer)?;
        if self.answer.misfit.is_some() {
            let tables: String =
                self.answer.effects.iter().map(squirrel_made::effect_table).collect();
            write(&answer.with_extension("toml"), &(self.vehicle_toml() + &tables))?;
        }
        Ok(whole)
    }

    /// The vehicle file that the program is given.
    pub fn vehicle_toml(&self) -> String {
        let Some(stated) = &self.answer.stated else { return self.nominal.to_toml() };
        let text = stated.in_airframe(&self.nominal).to_toml();
        if stated.in_base { text } else { text + &squirrel_made::effect_table(&stated.effect) }
    }

    /// Files of the flights in the case's folder, by number.
    pub fn flight_names(&self) -> &'static [&'static str] {
        if self.answer.set == Set::Baseline { &FLIGHTS } else { &FLIGHTS[..3] }
    }

    /// The individual that flies, and its sensors.
    fn individual(&self, draw: &mut Draw) -> (Airframe, SensorErrors) {
        if self.answer.set == Set::Baseline {
            return self.nominal.of_a_fleet(&mut Draw::new(mix(self.seed, 4))).individual(draw);
        }
        self.nominal.individual(draw)
    }

    /// Flight 0 and 1 of the training, 2 held out, 3 and 4 before anything was hidden, as its
    /// recorder writes it down.
    ///
    /// # Errors
    /// [`CaseError::Flight`] if the vehicle does not stay up.
    pub fn flight(&self, number: usize) -> Result<FlightLog, CaseError> {
        let log = self.flown(number)?;
        let draw = Draw::new(mix(self.seed, 1000 + number as u64));
        let late = |effect: &&HiddenEffect| effect.name == "gnss_latency";
        let latency_s =
            self.answer.effects.iter().find(late).map_or(0.0, |effect| effect.number("latency_s"));
        let log = self.answer.recorder.record(log, latency_s, draw);
        Ok(self.answer.poor.map_or(log.clone(), |poor| poor.of(log)))
    }

    /// A flight with the sensors' readings and the truth.
    pub(crate) fn flown(&self, number: usize) -> Result<FlightLog, CaseError> {
        self.ordered(number, |order| match self.answer.generator {
            Generator::Independent => independent::fly(order),
            Generator::Squirrel => squirrel_made::fly(&squirrel_made::Order {
                real: order.real,
                errors: order.errors,
                resistance_ohm: order.pack.resistance_ohm,
                effects: order.effects,
                excitation: order.excitation,
                further: order.further,
                noise: order.noise,
                charge: order.charge,
                seed: order.seed,
            }),
        })
    }

    /// A flight with the sums of what is measured, hidden and unmodelled in it.
    #[cfg(test)]
    pub(crate) fn watched(&self, number: usize) -> Result<independent::Watched, CaseError> {
        self.ordered(number, independent::watched)
    }

    /// Has a flight flown; one that ends early is flown again in another order of manoeuvres.
    fn ordered<T>(
        &self,
        number: usize,
        fly: impl Fn(&Order<'_>) -> Result<T, String>,
    ) -> Result<T, CaseError> {
        let mut draw = Draw::new(mix(self.seed, 3));
        let (real, errors) = self.individual(&mut draw);
        let heavy = self.nominal.mass_kg / CLASS_MASS_KG;
        let pack = Pack {
            resistance_ohm: draw.uniform(0.035, 0.08) / heavy,
            slow_ohm: draw.uniform(0.01, 0.03) / heavy,
            capacity_ah: 1.3 * heavy,
        };
        // One training flight starts high, the other low; the held-out one anywhere between.
        let charges = [
            draw.uniform(0.85, 0.95),
            draw.uniform(0.5, 0.65),
            draw.uniform(0.55, 0.9),
            draw.uniform(0.85, 0.95),
            draw.uniform(0.5, 0.7),
        ];
        let effects = if number < GOOD_FROM { &self.answer.effects[..] } else { &[] };
        let order = Order {
            nominal: &self.nominal,
            real: &real,
            errors,
            pack,
            effects,
            outside: self.answer.outside,
            excitation: self.answer.excitation,
            further: self.further(),
            noise: self.answer.noise,
            charge: charges[number],
            unmodelled: None,
            seed: 0,
        };
        let refused = |reason| CaseError::Flight {
            case: self.answer.case.clone(),
            hidden: format!("{:?} {:?}", self.answer.effects, self.answer.outside),
            reason,
        };
        // What is unmodelled belongs to the vehicle: its size comes from the first flight,
        // whichever is flown.
        let unmodelled = match self.answer.misfit {
            Some(misfit) => {
                let first = Order { charge: charges[0], seed: mix(self.seed, 10), ..order.clone() };
                Some(independent::unmodelled(&first, misfit).map_err(refused)?)
            }
            None => None,
        };
        let attempt = |attempt: u64| {
            let seed = mix(self.seed, 10 + number as u64 + 100 * attempt);
            fly(&Order { seed, unmodelled: unmodelled.as_ref(), ..order.clone() })
        };
        attempt(0).or_else(|_| attempt(1)).or_else(|_| attempt(2)).map_err(refused)
    }

    /// The vehicle that everybody believes: what its file states, unless that says too much of
    /// something.
    pub fn nominal(&self) -> &Airframe {
        &self.nominal
    }
}

/// Where the flights of a case stand in its folder; only some have the last two.
pub const FLIGHTS: [&str; 5] = [
    "train/flight00.mcap",
    "train/flight01.mcap",
    "held-out/flight00.mcap",
    "baseline/flight00.mcap",
    "baseline/flight01.mcap",
];
/// The first of the flights from before anything was hidden.
pub(crate) const GOOD_FROM: usize = 3;

/// Writes JSON under a temporary name, then renames.
///
/// # Errors
/// [`CaseError::Io`] if the disk refuses.
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<(), CaseError> {
    let mut text = serde_json::to_string_pretty(value).map_err(|error| CaseError::Io {
        file: path.display().to_string(),
        source: error.into(),
    })?;
    text.push('\n');
    let partial = path.with_extension("partial");
    fs::write(&partial, text).map_err(CaseError::io(&partial))?;
    fs::rename(&partial, path).map_err(CaseError::io(path))
}

#[cfg(test)]
mod tests {
    use super::*;
    use squirrel_sim::vehicle_file::VehicleFile;
    use std::collections::BTreeSet;

    #[test]
    fn sets_hide_what_they_say() {
        for index in 0..60 {
            let hidden = |set| Case::draw(set, index, 1).answer;
            assert!(hidden(Set::None).effects.is_empty() && hidden(Set::None).outside.is_none());
            assert_eq!(hidden(Set::Two).effects.len(), 2);
            assert_ne!(hidden(Set::OtherForm).effects[0].form, STANDARD);
            assert!(
                hidden(Set::Outside).outside.is_some() && hidden(Set::Outside).effects.is_empty()
            );
            assert_eq!(hidden(Set::NoiseX3).noise, 3.0);
        }
        let names: BTreeSet<_> = (0..CATALOGUE.len())
            .map(|index| Case::draw(Set::Single, index, 1).answer.effects[0].name.clone())
            .collect();
        assert_eq!(names.len(), CATALOGUE.len());
    }

    /// Half of the cases of a half set hide one effect, half of them nothing; the other new sets
    /// hide what they say.
    #[test]
    fn new_sets_hide_what_they_say() {
        for index in 0..60 {
            let hidden = |set| Case::draw(set, index, 1).answer;
            for set in [Set::Estimates, Set::Capture, Set::Baseline, Set::Inertial] {
                let answer = hidden(set);
                assert_eq!(answer.effects.len(), 1 - index % 2, "{set:?}");
                assert_eq!(answer.group().ends_with("_none"), index % 2 == 1);
            }
            let (sensors, overstated, misfit) =
                (hidden(Set::Sensors), hidden(Set::Overstated), hidden(Set::Misfit));
            assert!(matches!(sensors.recorder, Recorder::Faulty(_)) && !sensors.hides_nothing());
            assert!(overstated.stated.is_some() && overstated.group() == "overstated");
            let share = misfit.misfit.unwrap().share;
            assert!((0.1..0.25).contains(&share) && misfit.effects.len() == 1);
        }
        let mut met = BTreeSet::new();
        for index in 0..63 {
            let Answer { effects, misfit, .. } = Case::draw(Set::MisfitApart, index, 1).answer;
            met.insert((effects[0].name.clone(), misfit.unwrap().channels));
        }
        assert_eq!(met.len(), 63, "each effect beside each place");
        let stated = (0..32)
            .map(|index| Case::draw(Set::Overstated, index, 1).answer.stated.unwrap().effect.name);
        let names: BTreeSet<_> = stated.collect();
        assert!(names.len() == 32 && !names.contains("gust"));
    }

    /// The file says what the answer says it says.
    #[test]
    fn overstated_files_carry_the_effect() {
        for index in 0..128 {
            let case = Case::draw(Set::Overstated, index, 1);
            let stated = case.answer.stated.clone().unwrap();
            let file = VehicleFile::parse(&case.vehicle_toml(), "vehicle.toml").unwrap();
            assert_eq!(file.effects.has(&stated.effect.name), !stated.in_base, "{index}");
            assert_eq!(stated.in_airframe(case.nominal()) != *case.nominal(), stated.in_base);
        }
    }

    #[test]
    fn fleets_are_farther_off_than_their_tolerance() {
        let case = Case::draw(Set::Baseline, 1, 1);
        let (real, _) = case.individual(&mut Draw::new(1));
        let off = (real.mass_kg / case.nominal().mass_kg - 1.0).abs();
        assert!((0.0..0.11).contains(&off));
        let offs: Vec<f64> = (0..40)
            .map(|index| {
                let case = Case::draw(Set::Baseline, index, 1);
                case.individual(&mut Draw::new(1)).0.mass_kg / case.nominal().mass_kg - 1.0
            })
            .collect();
        let rms = (offs.iter().map(|x| x * x).sum::<f64>() / 40.0).sqrt();
        assert!((0.04..0.075).contains(&rms), "evenly to 10 %: {rms}");
        assert_eq!(case.flight_names().len(), 5);
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
        for (set, _) in Set::ALL {
            for index in 0..20 {
                let answer = Case::draw(set, index, 5).answer;
                let text = serde_json::to_string(&answer).unwrap();
                assert_eq!(serde_json::from_str::<Answer>(&text).unwrap(), answer);
            }
        }
    }
}
