//! From flights to a verdict: check that the logs agree with themselves, name what is missing, prove it on other flights.

use crate::GapError;
use crate::compatibility::{self, Ready};
use crate::find::{self, Place};
use crate::name::{
    Catalogue, Member, NATS_MIN, Naming, Point, Scored, Search, TURBULENCE_M_S, explain, heights, hypothesis,
    payload_lengths_m, sds, silent_tolerances,
};
use crate::picture;
use crate::predictor::{Hypothesis, Predictor};
use crate::shrink::{self, Errors12, Floor};
use crate::verdict::{Alternative, Gap, Kind, NamedEffect, SetAside, Value, Verdict};
use crate::words;
use squirrel_core::effects::{Effects, Kind as ParameterKind};
use squirrel_core::vehicle::{ThrustCurve, Vehicle};
use squirrel_sim::log::FlightLog;
use squirrel_sim::vehicle_file::VehicleFile;
use std::collections::BTreeMap;

/// Part of what the nominal model leaves that a form which differs may leave; more is outside the catalogue.
const FORM_SHARE: f64 = 0.1;
/// Part of the held-out gap that a name in another form must remove.
const FORM_REMOVED: f64 = 0.6;
/// How much more of the held-out gap the best other name must leave.
const RIVAL_GAP: f64 = 3.0;
/// Part of an error on held-out flights by which another one may be larger and no worse: the floor takes what noise is beyond it.
const HELD_OUT_NOISE: f64 = 0.05;
/// More alternatives than this within the evidence of a name are no answer.
const ALTERNATIVES_MAX: usize = 3;

/// Everything that the workflow found out.
#[derive(Debug)]
pub struct Diagnosis {
    /// The answer.
    pub verdict: Verdict,
    /// What the flights covered: name, low, high, unit.
    pub domain: Vec<Covered>,
    /// For the report.
    pub(crate) details: Option<Details>,
}

/// A range of flight conditions that the flights covered, 2nd to 98th percentile.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Covered {
    /// What: speed, height, tilt, voltage.
    pub name: &'static str,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Unit of both.
    pub unit: &'static str,
}

/// What the pictures are made of.
#[derive(Debug)]
pub(crate) struct Details {
    pub(crate) evidence: Vec<(&'static str, f64)>,
    pub(crate) confusability: (Vec<&'static str>, Vec<Vec<f64>>),
    pub(crate) held_out: Option<HeldOut>,
    pub(crate) seen: picture::Seen,
}

/// Errors on held-out flights.
#[derive(Debug)]
pub(crate) struct HeldOut {
    pub(crate) nominal: Errors12,
    /// Of the best other name and of all that the evidence hardly tells from the answer, the best first.
    pub(crate) rivals: Vec<Errors12>,
    pub(crate) fitted: Errors12,
    /// What the explanation leaves if it is true, and what is left in air without gusts.
    pub(crate) floor: Floor,
    pub(crate) calm: Floor,
}

/// Looks at flights of a vehicle and says which effect its file lacks.
///
/// * `flights` - name and log of each, which the explanation is fitted to
/// * `held_out` - flights that it never sees, for the proof; may be empty
/// * `progress` - called with what is being done
///
/// # Errors
/// [`GapError`]: a log or vehicle that nothing can be computed with. A log that contradicts itself is no error but the
/// verdict [`Kind::DataProblem`].
pub fn diagnose(
    vehicle: &VehicleFile,
    flights: &[(String, FlightLog)],
    held_out: &[(String, FlightLog)],
    progress: &dyn Fn(&str),
) -> Result<Diagnosis, GapError> {
    progress("reading");
    let mut diagnosis = sorted(vehicle, flights, held_out, progress)?;
    let verdict = &mut diagnosis.verdict;
    compatibility::tell(verdict, flights.len() + held_out.len());
    Ok(diagnosis)
}

/// The diagnosis of the flights whose data agree with themselves.
fn sorted(
    vehicle: &VehicleFile,
    flights: &[(String, FlightLog)],
    held_out: &[(String, FlightLog)],
    progress: &dyn Fn(&str),
) -> Result<Diagnosis, GapError> {
    let without = |aside: Vec<SetAside>| {
        let [flights, held_out] = [flights, held_out].map(|logs| compatibility::kept(logs, &aside));
        let mut diagnosis = sorted(vehicle, &flights, &held_out, progress)?;
        diagnosis.verdict.set_aside.splice(..0, aside);
        Ok(diagnosis)
    };
    let ready = match Ready::new(vehicle, flights, held_out) {
        Ok(ready) => ready,
        Err(error) => return without(compatibility::unreadable(vehicle, flights, held_out, error)?),
    };
    progress("checking the data");
    let aside = compatibility::problems(&ready, flights, held_out)?;
    let is_bad = |(name, _): &(String, FlightLog)| aside.iter().any(|a| a.flight == *name);
    if let Some(first) = aside.first().filter(|_| flights.iter().all(is_bad)) {
        let (goes_with, words) = (format!("{}: {}", first.flight, first.channel), first.words.clone());
        let places = find::places(&ready.predictor, &ready.nominal)?;
        let verdict = Verdict {
            verdict: Kind::DataProblem,
            effects: Vec::new(),
            moved: Vec::new(),
            alternatives: Vec::new(),
            places,
            goes_with: Some(goes_with),
            fly_next: None,
            gap: None,
            closed_loop: Vec::new(),
            model_patch: None,
            words,
            set_aside: aside,
            notes: ready.predictor.notes.clone(),
        };
        return Ok(Diagnosis { verdict, domain: covered(&ready.predictor), details: None });
    }
    if aside.is_empty() { judged(vehicle, flights, held_out, ready, progress) } else { without(aside) }
}

/// The diagnosis of flights that agree with themselves.
fn judged(
    vehicle: &VehicleFile,
    flights: &[(String, FlightLog)],
    held_out: &[(String, FlightLog)],
    ready: Ready<'_>,
    progress: &dyn Fn(&str),
) -> Result<Diagnosis, GapError> {
    let Ready { mut predictor, nominal, mut unseen } = ready;
    let domain = covered(&predictor);
    let places = find::places(&predictor, &nominal)?;
    let nominal = if let Some(parts) = predictor.in_parts(flights)? {
        predictor = parts;
        predictor.residual(&predictor.nominal())?
    } else {
        nominal
    };
    if !predictor.has_motion() {
        predictor.leave_out_drag();
    }
    if !(predictor.has_motion() && compatibility::moments_fit(&predictor, &nominal)) {
        predictor.leave_out_moments();
        if let Some(unseen) = &mut unseen {
            unseen.leave_out_moments();
        }
    }
    let curve_hides_sag = curve_hides_sag(&predictor, &nominal)?;
    if curve_hides_sag {
        predictor.notes.push(
            "propulsion.pwm_to_thrust_n: inside its sd the thrust curve does in these flights what battery_sag does".to_owned(),
        );
    }
    predictor.notes.extend(silent_tolerances(vehicle));
    progress("naming");
    let catalogue = Catalogue::new(&predictor, &payload_lengths_m(&predictor, &nominal))?;
    let tick = || progress("naming");
    let search = Search { predictor: &predictor, catalogue: &catalogue, gust_m_s: None, progress: &tick };
    let naming = explain(&search)?;
    let rivals = search.rivals(&naming.found)?;
    let best = naming.found.best.log_evidence;
    let close = rivals.iter().filter(|rival| rival.log_evidence > best - NATS_MIN).count();
    progress("flying the held-out flights");
    let proof = match &unseen {
        Some(unseen) => prove(unseen, &search, &naming, &rivals[..rivals.len().min(1.max(close))])?,
        None => None,
    };
    let gap = proof.as_ref().map(|proof| gap(held_out, proof));
    let verdict = decide(&search, &naming, &rivals, proof.as_ref(), gap, places, curve_hides_sag);
    let details = Details {
        evidence: search.single_evidence(&naming.found),
        confusability: search.confusability(&naming.found.null),
        seen: picture::seen(&search, &naming, &rivals)?,
        held_out: proof,
    };
    Ok(Diagnosis { verdict, domain, details: Some(details) })
}

/// The one answer.
fn decide(
    search: &Search<'_>,
    naming: &Naming,
    rivals: &[Scored],
    proof: Option<&HeldOut>,
    gap: Option<Gap>,
    places: Vec<Place>,
    curve_hides_sag: bool,
) -> Verdict {
    let found = &naming.found;
    let effects = named(search, naming);
    let nats = |set: &Scored| set.log_evidence - found.null.log_evidence;
    // Another name is as good if the evidence hardly tells them apart and held-out flights do not either.
    let clearly_worse = |rival: usize| {
        let (Some(proof), Some(gap)) = (proof, &gap) else { return false };
        let left = proof.rivals.get(rival).map(|errors| errors.over(&proof.floor.of(&proof.fitted)));
        left.is_some_and(|left| left - 1.0 >= RIVAL_GAP * (gap.after - 1.0).max(HELD_OUT_NOISE))
    };
    let close: Vec<&Scored> = rivals
        .iter()
        .enumerate()
        .filter(|(i, rival)| rival.log_evidence > found.best.log_evidence - NATS_MIN && !clearly_worse(*i))
        .map(|(_, rival)| rival)
        .collect();
    let leftover = &naming.leftover;
    let mut blind = search.blind(&found.best);
    if curve_hides_sag && !blind.contains(&"battery_sag") && effects.iter().all(|e| e.name != "battery_sag") {
        blind.push("battery_sag");
    }
    let share = left_share(naming);
    // What explains some flights and makes others worse is no name for what the vehicle lacks.
    let fails = gap.as_ref().is_some_and(|gap| gap.after > (1.0 + HELD_OUT_NOISE) * gap.before);
    let kind = if effects.is_empty() {
        match (leftover.is_real(), blind.is_empty()) {
            (true, _) => Kind::OutsideCatalogue,
            (false, false) => Kind::NotIdentifiable,
            (false, true) => Kind::None,
        }
    } else if leftover.is_real() {
        let shrinks = gap.as_ref().is_none_or(|gap| gap.removed_fraction > FORM_REMOVED);
        if share < FORM_SHARE && !leftover.is_foreign() && search.is_plausible(&found.best) && shrinks {
            Kind::NamedFormDiffers
        } else {
            Kind::OutsideCatalogue
        }
    } else if close.len() > ALTERNATIVES_MAX {
        Kind::NotIdentifiable
    } else if close.is_empty() && fails {
        Kind::OutsideCatalogue
    } else if close.is_empty() {
        Kind::Named
    } else {
        Kind::Ambiguous
    };
    let names = |set: &Scored| set.members.iter().map(|m| search.effect(m)).collect::<Vec<_>>();
    let shown = rivals.iter().take(5);
    let mut alternatives: Vec<Alternative> =
        shown.map(|set| Alternative { effects: names(set), evidence_nats: nats(set) }).collect();
    if curve_hides_sag && effects.is_empty() {
        let single = search.single_evidence(found).into_iter().find(|(name, _)| *name == "battery_sag");
        let evidence_nats = single.map_or(0.0, |(_, nats)| nats);
        alternatives.push(Alternative { effects: vec!["battery_sag"], evidence_nats });
    }
    let goes_with = if leftover.is_real() {
        Some(leftover.goes_with().unwrap_or_else(|| leftover.channels()))
    } else {
        fails.then(|| "the flight, since the held-out ones lack something else".to_owned())
    };
    let goes_with = goes_with.filter(|_| kind != Kind::Named);
    let fly_next = match kind {
        Kind::NotIdentifiable if effects.is_empty() => Some(words::fly_for(&blind)),
        Kind::Ambiguous | Kind::NotIdentifiable => {
            let mut all: Vec<&str> = effects.iter().map(|e| e.name).collect();
            all.extend(close.iter().flat_map(|set| names(set)));
            Some(words::fly_for(&all))
        }
        _ => None,
    };
    let moved = if effects.is_empty() { Vec::new() } else { search.moved(&found.best) };
    let mut verdict = Verdict {
        verdict: kind,
        effects,
        moved,
        alternatives,
        places,
        goes_with,
        fly_next,
        gap,
        closed_loop: Vec::new(),
        model_patch: None,
        words: String::new(),
        set_aside: Vec::new(),
        notes: search.predictor.notes.clone(),
    };
    verdict.words = words::paragraph(&verdict, &blind, curve_hides_sag);
    verdict
}

/// Part of what the vehicle as it was leaves, above noise, that the explanation leaves, too, in the channels that it
/// explains; 1 where it explains none. What stands out in other channels is another thing.
fn left_share(naming: &Naming) -> f64 {
    let excess = |slow: f64, floor: f64| (slow.powi(2) / floor.powi(2) - 1.0).max(0.0);
    let (mut before, mut after) = (0.0, 0.0);
    for band in &naming.leftover.bands {
        let was = excess(band.slow_nominal, band.slow_floor);
        let is = excess(band.slow, band.slow_floor);
        if is < EXPLAINED * was && was > 1.0 {
            before += was;
            after += is;
        }
    }
    if before > 0.0 { after / before } else { 1.0 }
}

/// Part of its excess that a channel may keep and still be explained.
const EXPLAINED: f64 = 0.5;

/// The members of the explanation as the verdict writes them, the most certain first.
fn named(search: &Search<'_>, naming: &Naming) -> Vec<NamedEffect> {
    let found = &naming.found;
    let mut all: Vec<NamedEffect> = found
        .best
        .members
        .iter()
        .enumerate()
        .map(|(index, member)| NamedEffect {
            name: search.effect(member),
            form: search.form(member),
            evidence_nats: found.worth(index),
            parameters: parameters(search, naming, index, member),
        })
        .collect();
    if let Some(sigma) = naming.gust_m_s {
        let number = Value::Number { value: sigma, low: 0.8 * sigma, high: 1.25 * sigma };
        all.push(NamedEffect {
            name: "gust",
            form: "gauss_markov",
            evidence_nats: naming.gust_nats,
            parameters: BTreeMap::from([("sigma_m_s", number)]),
        });
    }
    all.sort_by(|a, b| b.evidence_nats.total_cmp(&a.evidence_nats));
    all
}

/// 95 % of a normal distribution lies within this many standard deviations.
const INTERVAL: f64 = 1.96;

fn parameters(
    search: &Search<'_>,
    naming: &Naming,
    index: usize,
    member: &Member,
) -> BTreeMap<&'static str, Value> {
    let list = Effects::<f64>::parameters(search.effect(member)).unwrap_or_default();
    let form = search.form(member);
    let free = &naming.found.best.free;
    list.iter()
        .enumerate()
        .filter(|(_, p)| p.key != squirrel_core::effects::FORM && p.exists_in(form))
        .map(|(slot, parameter)| {
            let value = member.values[slot];
            let value = match parameter.kind {
                ParameterKind::OneOf(names) => {
                    let value = names[value as usize];
                    Value::Choice { value, low: value, high: value }
                }
                ParameterKind::Rotor => Value::Number { value, low: value, high: value },
                ParameterKind::Size { .. } => {
                    let column = free.iter().position(|f| *f == (index, slot));
                    let sd = column.map_or(0.0, |column| naming.deviations[column]);
                    Value::Number { value, low: value - INTERVAL * sd, high: value + INTERVAL * sd }
                }
            };
            (parameter.key, value)
        })
        .collect()
}

/// Re-simulates the held-out flights as the vehicle was, with the explanation and with other names.
fn prove(
    unseen: &Predictor,
    search: &Search<'_>,
    naming: &Naming,
    others: &[Scored],
) -> Result<Option<HeldOut>, GapError> {
    let at = |members: &[Member], base: &[f64]| -> Result<Hypothesis, GapError> {
        // What floats inside its tolerance is shared; what the sensors of other flights did is not. A barometer's own error is
        // found from its flight.
        let mut base = base[..search.catalogue.shared_columns()].to_vec();
        base.resize(search.catalogue.columns(unseen), 0.0);
        let mut point = Point { members: members.to_vec(), base };
        heights(unseen, search.catalogue, &naming.found.linear.whitener, &mut point)?;
        hypothesis(unseen, search.catalogue, &point)
    };
    let whole = search.whole(&naming.found.best);
    let fitted_at = at(&whole.members, &whole.base)?;
    let Some(fitted) = shrink::errors(unseen, &fitted_at)? else { return Ok(None) };
    let Some(nominal) = shrink::errors(unseen, &at(&[], &whole.base)?)? else { return Ok(None) };
    let mut rivals = Vec::with_capacity(others.len());
    for rival in others {
        rivals.extend(shrink::errors(unseen, &at(&rival.members, &search.whole(rival).base)?)?);
    }
    let calm = shrink::floor(unseen, &fitted_at, TURBULENCE_M_S)?;
    let floor = match naming.gust_m_s {
        Some(sigma) => shrink::floor(unseen, &fitted_at, sigma)?,
        None => calm.clone(),
    };
    Ok(Some(HeldOut { nominal, rivals, fitted, floor, calm }))
}

fn gap(held_out: &[(String, FlightLog)], proof: &HeldOut) -> Gap {
    // Gusts are no force that could be foreseen: with them, errors are as large as expected, and without them larger.
    let before = proof.nominal.over(&proof.calm.of(&proof.fitted));
    let floor = proof.floor.of(&proof.fitted);
    let after = proof.fitted.over(&floor);
    let best_rival = proof.rivals.iter().map(|rival| rival.over(&floor)).reduce(f64::min);
    let removed = |left: f64| if before > 1.0 { 1.0 - (left - 1.0) / (before - 1.0) } else { 0.0 };
    Gap {
        held_out_flights: held_out.iter().map(|(name, _)| name.clone()).collect(),
        before,
        after,
        best_rival,
        removed_fraction: removed(after),
        best_rival_removed_fraction: best_rival.map(removed),
    }
}

/// Whether the thrust curve of the vehicle file, moved by its sd, changes the vertical force more than the smallest sag
/// worth reporting: then nothing tells the two apart.
fn curve_hides_sag(predictor: &Predictor, nominal: &[f64]) -> Result<bool, GapError> {
    if !predictor.has_voltage() {
        return Ok(false);
    }
    let vehicle = predictor.vehicle;
    let mut p = *vehicle.vehicle.parameters();
    let (Some(curve), Some(sd)) = (p.propulsion.thrust_curve, sds(vehicle, "propulsion.pwm_to_thrust_n"))
    else {
        return Ok(false);
    };
    let change = |hypothesis: &Hypothesis| -> Result<f64, GapError> {
        let rows = predictor.residual(hypothesis)?;
        let own = predictor.segments.iter().filter(|s| s.channel == 2).flat_map(|s| s.rows.clone());
        Ok(own.map(|row| (rows[row] - nominal[row]).powi(2)).sum())
    };
    let mut sag = predictor.nominal();
    if let Some(found) = sag.effects.insert("battery_sag") {
        found.values[0] += 0.4;
    }
    let sag = change(&sag)?;
    for (i, sd) in sd.iter().enumerate().take(4).filter(|(_, sd)| **sd > 0.0) {
        let mut coefficients = curve.coefficients();
        coefficients[i] += sd;
        let Ok(moved) = ThrustCurve::new(coefficients, p.propulsion.reference_voltage_v) else { continue };
        p.propulsion.thrust_curve = Some(moved);
        let Ok(vehicle) = Vehicle::new(p) else { continue };
        if change(&Hypothesis { vehicle, ..predictor.nominal() })? > sag {
            return Ok(true);
        }
    }
    Ok(false)
}

/// What the flights covered.
fn covered(predictor: &Predictor) -> Vec<Covered> {
    let (mut speed, mut height, mut tilt, mut voltage) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (track, motion) in predictor.tracks.iter().zip(predictor.plain()) {
        for (body, volt) in motion.body.iter().zip(&track.voltage_v).step_by(track.every) {
            speed.push(body.velocity.vector.norm());
            height.push(-body.position.vector.z);
            let down = body.ned_from_body().quaternion.inverse() * nalgebra::Vector3::z();
            tilt.push(down.z.clamp(-1.0, 1.0).acos().to_degrees());
            voltage.push(*volt);
        }
    }
    let logged = predictor.has_motion();
    let mut all = Vec::new();
    let mut push = |name, values: &mut Vec<f64>, unit, is_logged: bool| {
        if is_logged && !values.is_empty() {
            values.sort_unstable_by(f64::total_cmp);
            let at = |share: f64| values[(share * (values.len() - 1) as f64) as usize];
            all.push(Covered { name, low: at(0.02), high: at(0.98), unit });
        }
    };
    push("speed", &mut speed, "m/s", logged);
    push("height", &mut height, "m", logged);
    push("tilt", &mut tilt, "deg", logged);
    push("voltage", &mut voltage, "V", predictor.has_voltage());
    all
}
