//! From a diagnosis to the data of its report, panel by panel.
//!
//! The predictor borrows the logs and is gone when a diagnosis is there, so that what only it knows
//! is kept beforehand ([`seen`]): windows of the residual, what the residual follows, and how white
//! the rest is. Numbers of the verdict are taken from the verdict, so that the page cannot say
//! anything else.

mod left;
mod outlook;
mod plain;
mod regressors;
mod screen;
mod units;
mod windows;

use crate::ClosedLoop;
use crate::GapError;
use crate::diagnosis::{Details, Diagnosis, Seen};
use crate::name::{Naming, Scored, Search, TURBULENCE_M_S};
use crate::predictor::DYNAMIC;
use crate::proof::HeldOut as Flown;
use crate::report::{
    Answer, Confusability, DomainRow, Errors, Evidence, FlyNext, HeldOut, HeldOutChannel, Horizon,
    ParameterRow, ReportData, RotorRow,
};
use crate::shrink::{BIN_S, BINS, CHANNELS as FLOWN_CHANNELS};
use crate::verdict::{Kind, NamedEffect, RotorHealth, Value};
use crate::words::short;
use squirrel_core::effects::{Effect, Effects, Gust, Kind as ParameterKind, SizeRange};
use squirrel_sim::vehicle_file::VehicleFile;
use units::{unit, without_unit};

pub use screen::first_screen;

/// The rows of the residual with their units, in the order of the predictor.
const CHANNELS: [(&str, &str); 9] = [
    ("specific force x", "m/s\u{b2}"),
    ("specific force y", "m/s\u{b2}"),
    ("specific force z", "m/s\u{b2}"),
    ("angular acceleration x", "rad/s\u{b2}"),
    ("angular acceleration y", "rad/s\u{b2}"),
    ("angular acceleration z", "rad/s\u{b2}"),
    ("velocity north", "m/s"),
    ("velocity east", "m/s"),
    ("velocity down", "m/s"),
];
/// The scenario that shows every effect, and whose card a pilot can fly.
const RICH: &str = "excite_rich";
/// Chi-square below which a pair of effects is not separated: 3 standard deviations.
const SEPARATED: f64 = 9.0;

/// Why the panels of a data problem are empty.
const CONTRADICTION: &str = "Empty: the logs contradict themselves, and nothing is computed from such logs. The verdict says where.";

/// Keeps what the report needs of the predictor.
///
/// # Errors
/// What the predictor says.
pub(crate) fn seen(
    search: &Search<'_>,
    naming: &Naming,
    rivals: &[Scored],
) -> Result<Seen, GapError> {
    let found = &naming.found;
    let name = |set: &Scored| {
        let names: Vec<&str> = set.members.iter().map(|m| search.effect(m)).collect();
        names.join(" + ")
    };
    let nats = |set: &Scored| set.log_evidence - found.null.log_evidence;
    let mut sets: Vec<(String, f64)> = Vec::new();
    if !found.best.members.is_empty() {
        sets.push((name(&found.best), nats(&found.best)));
    }
    if naming.gust_m_s.is_some() {
        let (beside, worth) = sets.pop().map_or((String::new(), 0.0), |(n, x)| (n + " + ", x));
        sets.push((beside + Gust::<f64>::NAME, worth + naming.gust_nats));
    }
    let has_answer = !sets.is_empty();
    for rival in rivals {
        // The same effect at another rotor or axis is the same name; the best comes first.
        if sets.iter().all(|(other, _)| *other != name(rival)) {
            sets.push((name(rival), nats(rival)));
        }
    }
    let catalogue = search.catalogue;
    let own = |p: &usize| &catalogue.parameters[*p];
    let mut tolerances = vec![(Gust::<f64>::NAME, Gust::<f64>::PARAMETERS[0].key, TURBULENCE_M_S)];
    for member in &found.best.members {
        let all = catalogue.candidates[member.candidate].parameters.iter().map(own);
        tolerances.extend(all.map(|p| (search.effect(member), p.key, p.tolerance)));
    }
    Ok(Seen {
        flights: windows::panels(search, naming)?,
        conditional: regressors::conditional(search, naming),
        whiteness: left::whiteness(search.predictor, naming),
        sets,
        has_answer,
        rival: rivals.first().map(name).unwrap_or_default(),
        tolerances,
    })
}

/// The data of the report of a diagnosis; the same for the same logs, and without absolute paths.
///
/// * `vehicle` - what was diagnosed
/// * `flights`, `held_out` - names of the logs as they were given to
///   [`diagnose`](crate::diagnose()); of an absolute path, the report says the names of the file
///   and its folder
/// * `patched` - text of the vehicle file with the effects in it, where there is one
pub fn picture(
    vehicle: &VehicleFile,
    diagnosis: &Diagnosis,
    flights: &[String],
    held_out: &[String],
    patched: Option<&str>,
) -> ReportData {
    let verdict = &diagnosis.verdict;
    let said = |text: &str| {
        let aside = verdict.set_aside.iter().map(|aside| &aside.flight);
        let names = flights.iter().chain(held_out).chain(aside);
        names.fold(text.to_owned(), |text, name| text.replace(name, &short(name)))
    };
    let domain = diagnosis.domain.iter().map(|c| DomainRow {
        name: c.name.to_owned(),
        low: c.low,
        high: c.high,
        unit: c.unit.to_owned(),
    });
    let mut data = ReportData {
        title: format!("Gap report: {}", vehicle.name),
        verdict: said(&verdict.words),
        domain: domain.collect(),
        rotors: verdict.baseline.iter().flat_map(|since| &since.rotors).filter_map(rotor).collect(),
        patch_diff: patched
            .map_or_else(String::new, |text| said(&crate::difference(&vehicle.text, text))),
        channels: CHANNELS.iter().map(|(name, _)| (*name).to_owned()).collect(),
        ..ReportData::default()
    };
    let screen = |data: &ReportData| -> Vec<Answer> {
        let mut screen = first_screen(verdict, vehicle, data);
        for answer in &mut screen {
            answer.sentences.iter_mut().for_each(|sentence| *sentence = said(sentence));
        }
        screen
    };
    let Some(details) = &diagnosis.details else {
        data.screen = screen(&data);
        return ReportData { stopped: CONTRADICTION.to_owned(), ..data };
    };
    data.set_aside = verdict.set_aside.iter().map(|aside| said(&aside.words)).collect();
    let seen = &details.seen;
    data.flights.clone_from(&seen.flights);
    for flight in &mut data.flights {
        flight.name = short(&flight.name);
    }
    if data.flights.iter().all(|f| f.before.len() == DYNAMIC) {
        data.channels.truncate(DYNAMIC);
    }
    data.evidence = evidence(details);
    data.conditional.clone_from(&seen.conditional);
    if !held_out.is_empty() {
        let flights = held_out.iter().map(|name| short(name)).collect();
        data.held_out = Some(proof(details.held_out.as_ref(), flights, &seen.rival));
    }
    let again = verdict.closed_loop.iter().cloned();
    data.closed_loop =
        again.map(|flight| ClosedLoop { flight: short(&flight.flight), ..flight }).collect();
    data.whiteness.clone_from(&seen.whiteness);
    data.parameters =
        verdict.effects.iter().flat_map(|e| parameters(vehicle, e, &seen.tolerances)).collect();
    let (names, chi_square) = &details.confusability;
    data.confusability = Some(confusability(names, chi_square));
    data.fly_next =
        fly_next(verdict.verdict, verdict.fly_next.as_deref(), data.confusability.as_ref());
    data.screen = screen(&data);
    data
}

/// A rotor as the page shows it.
fn rotor(health: &RotorHealth) -> Option<RotorRow> {
    let Value::Number { value: loss, low, high } = health.thrust_loss_fraction else { return None };
    Some(RotorRow { rotor: health.rotor, loss, low, high, usual: health.usual })
}

/// Single effects as the linear search ranks them, in the place of those that were refined their
/// refined evidence.
fn evidence(details: &Details) -> Vec<Evidence> {
    let sets = &details.seen.sets;
    let refined = sets.iter().enumerate().map(|(i, (name, nats))| Evidence {
        name: name.clone(),
        nats: *nats,
        is_answer: i == 0 && details.seen.has_answer,
    });
    let alone =
        details.evidence.iter().filter(|(name, _)| sets.iter().all(|(other, _)| other != name));
    let alone = alone.map(|(name, nats)| Evidence {
        name: (*name).to_owned(),
        nats: *nats,
        is_answer: false,
    });
    refined.chain(alone).collect()
}

fn proof(flown: Option<&Flown>, flights: Vec<String>, rival: &str) -> HeldOut {
    let Some(flown) = flown else {
        return HeldOut {
            flights,
            rival: String::new(),
            channels: Vec::new(),
            horizons: Vec::new(),
        };
    };
    let at = |channel: usize, bin: usize| Errors {
        nominal: flown.nominal.rms(channel, bin),
        rival: flown.rivals.first().map_or(f64::NAN, |rival| rival.errors.rms(channel, bin)),
        fitted: flown.fitted.rms(channel, bin),
        floor: flown.floor.mean.rms(channel, bin),
    };
    // A short flight has no segment of the full length, and rare fixes may leave a horizon out.
    let flown_at =
        |bin: &usize| flown.fitted.count[*bin] > 0.0 && flown.floor.mean.count[*bin] > 0.0;
    let bins: Vec<usize> = (0..BINS).filter(flown_at).collect();
    let horizon_s = |bin: usize| (bin + 1) as f64 * BIN_S;
    let last = bins.last().copied().unwrap_or(0);
    let channels = FLOWN_CHANNELS.iter().enumerate().map(|(channel, key)| {
        let unit = unit(key);
        let name = without_unit(key)
            .replace("omega", "angular rate")
            .replace("_body", "")
            .replace('_', " ");
        let horizons = bins
            .iter()
            .map(|bin| Horizon { horizon_s: horizon_s(*bin), errors: at(channel, *bin) });
        HeldOutChannel {
            name,
            unit: unit.to_owned(),
            errors: at(channel, last),
            second: Errors {
                nominal: flown.nominal.mse()[channel].sqrt(),
                rival: flown
                    .rivals
                    .first()
                    .map_or(f64::NAN, |rival| rival.errors.mse()[channel].sqrt()),
                fitted: flown.fitted.mse()[channel].sqrt(),
                floor: flown.floor.mean.mse()[channel].sqrt(),
            },
            horizons: horizons.collect(),
        }
    });
    let horizons = bins.iter().map(|bin| {
        let over = |of: fn(&Errors) -> f64| {
            let all = (0..FLOWN_CHANNELS.len())
                .map(|channel| at(channel, *bin))
                .filter(|e| e.floor > 0.0);
            let ratios: Vec<f64> = all.map(|e| of(&e) / e.floor).collect();
            ratios.iter().sum::<f64>() / ratios.len() as f64
        };
        let errors = Errors {
            nominal: over(|e| e.nominal),
            rival: over(|e| e.rival),
            fitted: over(|e| e.fitted),
            floor: over(|e| e.floor),
        };
        Horizon { horizon_s: horizon_s(*bin), errors }
    });
    let rival = if flown.rivals.is_empty() { String::new() } else { rival.to_owned() };
    HeldOut { flights, rival, channels: channels.collect(), horizons: horizons.collect() }
}

/// The sizes of an effect; its choices stand beside its name.
fn parameters(
    vehicle: &VehicleFile,
    effect: &NamedEffect,
    tolerances: &[(&str, &str, f64)],
) -> Vec<ParameterRow> {
    let list = Effects::<f64>::parameters(effect.name).unwrap_or_default();
    let mut name = effect.name.to_owned();
    let mut rows = Vec::new();
    for parameter in list {
        match (parameter.kind, effect.parameters.get(parameter.key)) {
            (_, Some(Value::Choice { value, .. })) => name = format!("{name} {value}"),
            (ParameterKind::Rotor, Some(Value::Number { value, .. })) => {
                name = format!("{name} {value}");
            }
            (ParameterKind::Size { .. }, Some(&Value::Number { value, low, high })) => {
                let Some(SizeRange { smallest, largest, .. }) = parameter.range(&vehicle.vehicle)
                else {
                    continue;
                };
                let own = tolerances
                    .iter()
                    .find(|(e, key, _)| *e == effect.name && *key == parameter.key);
                let tolerance = own.map_or(f64::NAN, |(.., tolerance)| *tolerance);
                let (effect, key, unit) =
                    (String::new(), parameter.key.to_owned(), unit(parameter.key).to_owned());
                rows.push(ParameterRow {
                    effect,
                    key,
                    unit,
                    value,
                    low,
                    high,
                    smallest,
                    largest,
                    tolerance,
                });
            }
            _ => {}
        }
    }
    for row in &mut rows {
        row.effect.clone_from(&name);
    }
    rows
}

fn confusability(names: &[&str], chi_square: &[Vec<f64>]) -> Confusability {
    let mut chi_square = chi_square.to_vec();
    for (i, row) in chi_square.iter_mut().enumerate() {
        row[i] = f64::NAN;
    }
    Confusability { names: names.iter().map(|n| (*n).to_owned()).collect(), chi_square }
}

/// What the verdict asks for; without that, a flight that separates what these flights do not.
fn fly_next(
    verdict: Kind,
    asked: Option<&str>,
    confusability: Option<&Confusability>,
) -> Vec<FlyNext> {
    let next = |why: String| vec![FlyNext { why, what: RICH.to_owned() }];
    let marked =
        confusability.is_some_and(|c| c.chi_square.iter().flatten().any(|x| *x < SEPARATED));
    match asked {
        Some(asked) => next(format!("To decide: {asked}")),
        None if marked && verdict != Kind::OutsideCatalogue => {
            next("To separate the marked pairs".to_owned())
        }
        None => Vec::new(),
    }
}
