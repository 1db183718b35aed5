//! What can be named: every effect of the catalogue with its choices, and how far each parameter
//! may be off without a name.
//!
//! A parameter has two priors, both Gaussian about what the vehicle file says: its **tolerance**,
//! the declared standard deviation of the nominal number that the effect would change, and, where
//! the effect is hypothesised, its **slab**, as wide as the effect is plausible. An effect is only
//! worth a name when the flights ask for more than the tolerance.

use super::point::{Airframe, DAY_FRACTION, Member};
use super::tolerance::{SHARE_OF_SMALLEST, airframe, middle_m, slip_ppm, spread_s, tolerance};
use crate::GapError;
use crate::leftover::{Slack, Usual};
use crate::predictor::{Predictor, TURNING};
use squirrel_core::effects::{
    Declared, EffectParameter, Effects, FORM, Kind, Profile, Response, Scale, Shown, SizeRange,
    Timing, Tolerance, forms,
};
use squirrel_core::vehicle::Vehicle;
use squirrel_sim::plant::WingPlant;
use squirrel_sim::vehicle_file::VehicleFile;

/// Width of the slab over the largest plausible size.
pub(crate) const SLAB_OF_LARGEST: f64 = 0.6;
/// How many times the largest plausible size a fraction, a time or a length may have: farther off
/// nothing linear holds, and a mass or an inertia would be below zero. Forces differ more from one
/// design to another.
const LARGEST_TIMES: f64 = 2.0;
const GROWING_TIMES: f64 = 8.0;
/// Part of the time from one command to the next by which a command may act before its stamp: a log
/// writes it down somewhere in between.
const STAMPED_LATE: f64 = 0.5;
/// How well the axes of markers lie along those of the rotors, rad: by eye. An accelerometer shows
/// the rotors' own.
const MARKERS_RAD: f64 = 0.03;

/// One number of one effect.
#[derive(Debug, Clone)]
pub(crate) struct Parameter {
    pub(crate) candidate: usize,
    /// Place in the effect's list of parameters.
    pub(crate) slot: usize,
    pub(crate) key: &'static str,
    /// What its tolerance comes from.
    pub(crate) within: Tolerance,
    pub(crate) smallest: f64,
    pub(crate) largest: f64,
    pub(crate) signed: bool,
    /// Least and greatest change of what the vehicle file has.
    pub(crate) bounds: (f64, f64),
    /// Standard deviation of the spike.
    pub(crate) tolerance: f64,
    /// Standard deviation of the slab.
    pub(crate) slab: f64,
    /// By how much the number that the effect adds to is off by itself, one standard deviation:
    /// flights show only the sum.
    pub(crate) spread: f64,
}

impl Parameter {
    /// Whether it changes a number that the vehicle file declares.
    pub(super) fn is_behind(&self, number: Declared) -> bool {
        self.within == Tolerance::Declared(number)
    }

    /// A change of the number, no farther from nothing than a vehicle can be, or than its file has
    /// it already.
    ///
    /// * `own` - what the vehicle file has
    pub(super) fn bounded(&self, own: f64, change: f64) -> f64 {
        let (least, most) = self.bounds;
        (own + change).clamp(own.min(least), own.max(most)) - own
    }
}

/// One effect, with its choices made: which rotor, which axis, which side.
#[derive(Debug, Clone)]
pub(crate) struct Candidate {
    pub(crate) effect: &'static str,
    pub(crate) profile: Profile,
    /// Slots with a fixed value, and slots where a search starts.
    pub(crate) fixed: Vec<(usize, f64)>,
    /// Indices of its parameters in [`Catalogue::parameters`] that act by themselves, from zero.
    pub(crate) parameters: Vec<usize>,
    /// Slots that only a refinement moves, with where they start.
    pub(crate) shape: Vec<(usize, f64)>,
    /// Whether it has the one form of the effect that floats: the file's, or the standard one.
    pub(crate) floats: bool,
}

/// Everything that can be named on a vehicle.
pub(crate) struct Catalogue {
    pub(crate) candidates: Vec<Candidate>,
    pub(crate) parameters: Vec<Parameter>,
    /// Effects that are not among them because these flights lack the channels that show them.
    pub(crate) unseen: Vec<&'static str>,
    /// Effects that are no longer looked for: they explain what the gyroscope has read, and do not
    /// help to foretell what it reads next.
    pub(crate) unforetold: Vec<&'static str>,
    /// Numbers of the airframe beside them, with their tolerances.
    pub(crate) airframe: Vec<(Airframe, f64)>,
    /// By how much thrust may differ from one flight to the next, as a fraction.
    pub(crate) day_fraction: f64,
    /// Its tolerances are those of one machine.
    pub(crate) is_of_one_machine: bool,
    /// What the model leaves of the flights of a baseline; nothing without one.
    pub(crate) usual: Usual,
}

impl Catalogue {
    /// * `payload_lengths_m` - at which a slung load is looked for: its frequency is not linear in
    ///   anything
    /// * `clock_step_s` - when a clock may have jumped, since the beginning of a flight
    ///
    /// # Errors
    /// The vehicle file lacks a tolerance that is needed.
    pub(crate) fn new(
        predictor: &Predictor,
        payload_lengths_m: &[f64],
        clock_step_s: Option<f64>,
    ) -> Result<Self, GapError> {
        let vehicle = predictor.vehicle;
        let unseen = |shown: Shown| {
            (!predictor.has_all_of(2) && !shown.has(Shown::LASTING))
                || (shown.has(Shown::MOMENTS) && !predictor.has_channel(3))
                || (shown.has(Shown::HORIZONTAL) && !predictor.has_channel(0))
                || (shown.has(Shown::HEIGHT) && !predictor.has_height())
                || (shown.has(Shown::COMMANDS) && predictor.has_rotor_speeds())
        };
        let mut all = Self {
            candidates: Vec::new(),
            parameters: Vec::new(),
            unseen: Vec::new(),
            unforetold: Vec::new(),
            airframe: airframe(predictor),
            day_fraction: DAY_FRACTION,
            is_of_one_machine: false,
            usual: Usual::default(),
        };
        for name in Effects::<f64>::NAMES {
            let Some(profile) = Effects::<f64>::profile(name) else { continue };
            let shown = profile.shown;
            // What nobody measured with is off by nothing.
            let is_unmeasured = (shown.has(Shown::ACCELEROMETER) && !predictor.has_accelerometer())
                || (shown.has(Shown::TURNS) && !predictor.has_channel(TURNING));
            let lacks_wings = profile.is_of_wings && vehicle.wing == WingPlant::None;
            if is_unmeasured || lacks_wings || profile.response == Response::Random {
                continue;
            }
            if unseen(shown) {
                all.unseen.push(*name);
                continue;
            }
            let list = Effects::<f64>::parameters(name).unwrap_or_default();
            for fixed in choices(list, vehicle.vehicle.rotors().len()) {
                // What nothing linear finds starts at each of these.
                let starts: Vec<(&str, f64)> = match profile.response {
                    Response::Swings { length } => {
                        payload_lengths_m.iter().map(|m| (length, *m)).collect()
                    }
                    Response::Jumps { at } => clock_step_s.iter().map(|s| (at, *s)).collect(),
                    _ => {
                        all.add(vehicle, (name, profile), list, fixed, &[])?;
                        continue;
                    }
                };
                for start in starts {
                    all.add(vehicle, (name, profile), list, fixed.clone(), &[start])?;
                }
            }
        }
        for parameter in &mut all.parameters {
            let Profile { timing, shown, .. } = all.candidates[parameter.candidate].profile;
            if timing == Some(Timing::Latency) && shown.has(Shown::COMMANDS) {
                parameter.bounds.0 = -STAMPED_LATE * predictor.command_period_s();
            }
            if timing == Some(Timing::ClockRate) {
                parameter.tolerance = parameter.tolerance.max(slip_ppm(predictor));
            }
            if parameter.within == Tolerance::RotorAxes && !predictor.has_accelerometer() {
                parameter.tolerance = parameter.tolerance.max(MARKERS_RAD);
            }
            parameter.spread = match spread_s(predictor, timing) {
                Some(spread) => spread,
                None if parameter.is_behind(Declared::RotorPlaces) => {
                    middle_m(vehicle, parameter.slot)
                }
                // What has no declared number has none to be off.
                None if parameter.tolerance == SHARE_OF_SMALLEST * parameter.smallest => 0.0,
                None => parameter.tolerance,
            };
        }
        Ok(all)
    }

    /// By how much the number that a member's slot adds to is off by itself, one standard
    /// deviation.
    pub(crate) fn spread(&self, member: &Member, slot: usize) -> f64 {
        self.own(member).find(|p| p.slot == slot).map_or(0.0, |p| p.spread)
    }

    /// The numbers of a member that act by themselves.
    pub(super) fn own(&self, member: &Member) -> impl Iterator<Item = &Parameter> {
        self.candidates[member.candidate].parameters.iter().map(|p| &self.parameters[*p])
    }

    /// The tolerance of what changes a declared number; 0 where these flights show no such effect.
    pub(crate) fn tolerance_of(&self, number: Declared) -> f64 {
        self.parameters.iter().find(|p| p.is_behind(number)).map_or(0.0, |p| p.tolerance)
    }

    /// Whether two candidates are one effect with the same choices, but for its form.
    pub(super) fn is_one_thing(&self, candidate: usize, other: usize) -> bool {
        self.in_form(candidate, None) == self.in_form(other, None)
    }

    /// The candidate that is the same effect with the same choices in another form, where that is
    /// looked for by itself; otherwise that of the standard form.
    ///
    /// * `form` - index of the form, and its slot
    pub(super) fn other_form(&self, candidate: usize, form: usize, slot: usize) -> usize {
        let has = |form: f64| {
            let wanted = self.in_form(candidate, Some((slot, form)));
            (0..self.candidates.len()).find(|other| {
                let own = self.candidates[*other].fixed.iter().find(|(s, _)| *s == slot);
                self.in_form(*other, own.copied()) == wanted
            })
        };
        has(form as f64).or_else(|| has(0.0)).unwrap_or(candidate)
    }

    /// An effect and its choices, with a form in place of its own.
    fn in_form(
        &self,
        candidate: usize,
        form: Option<(usize, f64)>,
    ) -> (&'static str, Vec<(usize, f64)>) {
        let Candidate { effect, fixed, .. } = &self.candidates[candidate];
        let list = Effects::<f64>::parameters(effect).unwrap_or_default();
        let choices = fixed.iter().copied().filter(|(slot, _)| list[*slot].key != FORM);
        (effect, choices.chain(form).collect())
    }

    /// What a number may be off by without anybody noticing: its tolerance, be it that of another
    /// form, or of what is there or not, a part of the smallest size.
    pub(super) fn least(&self, number: &Parameter) -> f64 {
        let same = |p: &&Parameter| {
            p.slot == number.slot && self.is_one_thing(p.candidate, number.candidate)
        };
        let tolerances = self.parameters.iter().filter(same).map(|p| p.tolerance);
        let most = tolerances.fold(0.0, f64::max);
        if most > 0.0 { most } else { SHARE_OF_SMALLEST * number.smallest }
    }

    /// Candidates of an effect, one for each way in which its choices are made.
    ///
    /// * `floats` - those in the form that floats, or those in another that is looked for
    pub(super) fn each_of(&self, effect: &str, floats: bool) -> Vec<usize> {
        let all = 0..self.candidates.len();
        all.filter(|c| {
            let candidate = &self.candidates[*c];
            candidate.effect == effect && candidate.floats == floats
        })
        .collect()
    }

    /// Tolerances of what has no number of its own.
    ///
    /// * `timing_s` - by how much commands may act beside their time
    /// * `thrust_fraction` - by how much thrust may drift in a flight
    pub(crate) fn slack(&self, timing_s: f64, thrust_fraction: f64) -> Slack {
        let drag_n_s_per_m = self.tolerance_of(Declared::LinearDrag(0));
        let (lever_m, usual) = (self.tolerance_of(Declared::RotorPlaces), self.usual);
        Slack { lever_m, drag_n_s_per_m, thrust_fraction, timing_s, usual }
    }

    fn add(
        &mut self,
        vehicle: &VehicleFile,
        (effect, profile): (&'static str, Profile),
        list: &'static [EffectParameter],
        fixed: Vec<(usize, f64)>,
        shape: &[(&str, f64)],
    ) -> Result<(), GapError> {
        let form = list.iter().enumerate().find_map(|(slot, p)| match p.kind {
            Kind::OneOf(names) if p.key == FORM => {
                let made = fixed.iter().find(|(other, _)| *other == slot);
                made.map(|(_, value)| (names[*value as usize], *value, slot))
            }
            _ => None,
        });
        let (form, index, slot) = form.unwrap_or_default();
        let mut effects = vehicle.effects;
        let own = effects.has(effect).then(|| effects.insert(effect).map(|e| e.values[slot]));
        let sought = sought(list);
        let floats = index == own.flatten().filter(|own| sought.contains(own)).unwrap_or(0.0);
        let (candidate, mut own, mut started) = (self.candidates.len(), Vec::new(), Vec::new());
        for (slot, parameter) in list.iter().enumerate() {
            let Some(range) = parameter.range_in(form, &vehicle.vehicle) else { continue };
            if !parameter.exists_in(form) {
                continue;
            }
            if let Some((_, start)) = shape.iter().find(|(key, _)| *key == parameter.key) {
                started.push((slot, *start));
                continue;
            }
            own.push(self.parameters.len());
            self.parameters.push(Parameter {
                candidate,
                slot,
                key: parameter.key,
                within: parameter.tolerance,
                smallest: range.smallest,
                largest: range.largest,
                signed: range.signed,
                bounds: bounds(&vehicle.vehicle, parameter, &range),
                tolerance: if floats {
                    tolerance(vehicle, parameter.tolerance, slot, &fixed, range.smallest)?
                } else {
                    0.0
                },
                slab: SLAB_OF_LARGEST * range.largest,
                spread: 0.0,
            });
        }
        let (parameters, shape) = (own, started);
        self.candidates.push(Candidate { effect, profile, fixed, parameters, shape, floats });
        Ok(())
    }
}

/// Part of a lag of the vehicle's own that may be taken away: a motor has some.
const LAG_MOST: f64 = 0.95;

/// How far a number may go: what takes away from one of the vehicle's own leaves it at nothing, and
/// no less.
pub(super) fn bounds(
    vehicle: &Vehicle<f64>,
    parameter: &EffectParameter,
    range: &SizeRange,
) -> (f64, f64) {
    if parameter.is_capped {
        return (if range.signed { -range.largest } else { 0.0 }, range.largest);
    }
    let times = match range.scale {
        Scale::Fixed | Scale::Arm | Scale::PerTipSpeed | Scale::PerTipSpeedSquared => LARGEST_TIMES,
        Scale::Mass | Scale::Inertia | Scale::MassTimesArm => GROWING_TIMES,
    };
    let most = times * range.largest;
    let is_lag = matches!(parameter.tolerance, Tolerance::Declared(number) if number.is_lag());
    let own = match parameter.base_number(vehicle) {
        Some((_, own)) if is_lag => LAG_MOST * own,
        Some((_, own)) => own,
        None if range.signed => most,
        None => 0.0,
    };
    (-own.min(most), most)
}

/// Forms of an effect that are looked for by themselves beside the standard one, by their numbers.
fn sought(list: &[EffectParameter]) -> Vec<f64> {
    let number = |(i, name)| {
        let is_sought = list.iter().any(|p| p.sought.contains(name));
        is_sought.then_some(i as f64)
    };
    forms(list).iter().enumerate().filter_map(number).collect()
}

/// Every way in which the choices of an effect can be made.
fn choices(list: &[EffectParameter], rotors: usize) -> Vec<Vec<(usize, f64)>> {
    let mut all = vec![Vec::new()];
    for (slot, parameter) in list.iter().enumerate() {
        let values: Vec<f64> = match parameter.kind {
            Kind::Rotor => (1..=rotors).map(|i| i as f64).collect(),
            Kind::OneOf(_) if parameter.key == FORM => {
                std::iter::once(0.0).chain(sought(list)).collect()
            }
            Kind::OneOf(names) => (0..names.len()).map(|i| i as f64).collect(),
            Kind::Size { .. } => continue,
        };
        all = all
            .into_iter()
            .flat_map(|made: Vec<(usize, f64)>| {
                values.iter().map(move |value| [made.clone(), vec![(slot, *value)]].concat())
            })
            .collect();
    }
    all
}
