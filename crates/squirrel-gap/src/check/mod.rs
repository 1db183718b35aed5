//! What flights are worth before any verdict: whether their data agree with themselves, what of
//! each effect they could show, and what to fly for the rest.

mod effects;

use crate::baseline::Baseline;
use crate::checked::{Check, EffectCheck, FlightCheck, Shows};
use crate::compatibility::{self, Moments, Ready, channels, saturation};
use crate::flight::series::Span;
use crate::name::silent_tolerances;
use crate::predictor::Predictor;
use crate::verdict::SetAside;
use crate::{GapError, SOURCES, words};
use squirrel_log::FlightLog;
use squirrel_sim::vehicle_file::VehicleFile;
use std::collections::BTreeMap;

/// Looks at flights before anybody looks for an effect in them.
///
/// * `flights` - name and log of each, from which names are to come
/// * `held_out` - flights for the proof, of which the data alone are looked at; may be empty
/// * `progress` - called with what is being done
///
/// # Errors
/// [`GapError`]: a log or vehicle that nothing can be computed with. A log that contradicts itself
/// is no error but what was to be found.
pub fn check(
    vehicle: &VehicleFile,
    flights: &[(String, FlightLog)],
    held_out: &[(String, FlightLog)],
    progress: &dyn Fn(&str),
) -> Result<Check, GapError> {
    seen(Seen::default(), vehicle, flights, held_out, progress)
}

/// What flights of a machine are worth before anybody looks for what has changed since those of a
/// baseline.
///
/// * other arguments as of [`check`]
///
/// # Errors
/// As [`check`]; a flight that is one of the baseline.
pub fn check_since(
    baseline: &Baseline,
    flights: &[(String, FlightLog)],
    held_out: &[(String, FlightLog)],
    progress: &dyn Fn(&str),
) -> Result<Check, GapError> {
    baseline.has_none_of(flights.iter().chain(held_out))?;
    let mut found = Seen { own: Some(baseline), ..Seen::default() };
    let aside = baseline.set_aside.iter();
    found.notes.extend(aside.map(|a| format!("set aside of the baseline: {}", a.words)));
    seen(found, &baseline.declared, flights, held_out, progress)
}

fn seen(
    mut found: Seen<'_>,
    vehicle: &VehicleFile,
    flights: &[(String, FlightLog)],
    held_out: &[(String, FlightLog)],
    progress: &dyn Fn(&str),
) -> Result<Check, GapError> {
    progress("reading");
    found.look(vehicle, flights, held_out, progress)?;
    let all = flights.iter().map(|flight| (flight, false));
    let all = all.chain(held_out.iter().map(|flight| (flight, true)));
    let flights: Vec<FlightCheck> = all
        .map(|((name, log), is_held_out)| found.flight(vehicle, name, log, is_held_out))
        .collect();
    let Seen { effects, mut notes, .. } = found;
    notes.extend(silent_tolerances(vehicle));
    let unseen: Vec<&str> =
        effects.iter().filter(|effect| effect.fly.is_some()).map(|effect| effect.name).collect();
    let fly_next = (!unseen.is_empty()).then(|| words::fly_for(&unseen));
    Ok(Check { words: paragraph(&flights, &effects), flights, effects, fly_next, notes })
}

/// What was seen of flights.
#[derive(Default)]
struct Seen<'b> {
    /// The machine as it flew when it flew well.
    own: Option<&'b Baseline>,
    aside: Vec<SetAside>,
    /// By flight, when forces can be compared.
    spans: BTreeMap<String, Vec<Span>>,
    effects: Vec<EffectCheck>,
    notes: Vec<String>,
}

impl Seen<'_> {
    /// Looks at flights, and without those that have a problem again.
    fn look(
        &mut self,
        vehicle: &VehicleFile,
        flights: &[(String, FlightLog)],
        held_out: &[(String, FlightLog)],
        progress: &dyn Fn(&str),
    ) -> Result<(), GapError> {
        let ready = match Ready::new(vehicle, flights, held_out) {
            Ok(ready) => ready,
            Err(error) => {
                let aside = compatibility::unreadable(vehicle, flights, held_out, error)?;
                return self.without(vehicle, flights, held_out, aside, progress);
            }
        };
        progress("checking the data");
        let before = self.own.map_or(&[][..], |own| &own.known);
        let aside = compatibility::problems(&ready, before, flights, held_out)?;
        if !aside.is_empty() {
            return self.without(vehicle, flights, held_out, aside, progress);
        }
        self.spans.extend(spans(&ready.predictor));
        self.spans.extend(ready.unseen.iter().flat_map(spans));
        progress("what the flights could show");
        let (ready, moments) = match self.own {
            // As a diagnosis does: the data are the file's matter, sizes are the machine's.
            Some(own) => (Ready::new(&own.vehicle, flights, held_out)?, own.moments),
            None if ready.turns_in_unknown_air() => (ready, Moments::All),
            None => (ready, Moments::IfKnown),
        };
        let ready = ready.narrowed(flights, moments)?;
        let scatter = self.own.map(|own| &own.scatter);
        self.effects = effects::effects(&ready, scatter, command_hz(flights))?;
        self.notes.extend_from_slice(&ready.predictor.notes);
        Ok(())
    }

    fn without(
        &mut self,
        vehicle: &VehicleFile,
        flights: &[(String, FlightLog)],
        held_out: &[(String, FlightLog)],
        aside: Vec<SetAside>,
        progress: &dyn Fn(&str),
    ) -> Result<(), GapError> {
        let [flights, held_out] = [flights, held_out].map(|logs| compatibility::kept(logs, &aside));
        self.aside.extend(aside);
        if flights.is_empty() {
            return Ok(());
        }
        self.look(vehicle, &flights, &held_out, progress)
    }

    fn flight(
        &self,
        vehicle: &VehicleFile,
        name: &str,
        log: &FlightLog,
        is_held_out: bool,
    ) -> FlightCheck {
        let times = || log.sources.values().map(|source| &source.time_s);
        let first = times().filter_map(|t| t.first()).copied().fold(f64::INFINITY, f64::min);
        let last = times().filter_map(|t| t.last()).copied().fold(f64::NEG_INFINITY, f64::max);
        let spans = self.spans.get(name);
        let whole = vec![(first, last)];
        let propulsion = &vehicle.vehicle.parameters().propulsion;
        FlightCheck {
            flight: name.to_owned(),
            is_held_out,
            duration_s: (last - first).max(0.0),
            usable_s: spans.map_or(0.0, |spans| spans.iter().map(|(from, to)| to - from).sum()),
            channels: channels(log, &SOURCES),
            saturated_share: saturation(log, propulsion, spans.unwrap_or(&whole)),
            problem: self.aside.iter().find(|aside| aside.flight == name).cloned(),
        }
    }
}

/// By flight, when all needed channels are there.
fn spans(predictor: &Predictor<'_>) -> BTreeMap<String, Vec<Span>> {
    let mut all: BTreeMap<String, Vec<Span>> = BTreeMap::new();
    for track in &predictor.tracks {
        if let (Some(from), Some(to)) = (track.time_s.first(), track.time_s.last()) {
            all.entry(predictor.names[track.flight].to_owned()).or_default().push((*from, *to));
        }
    }
    all
}

/// How often commands change in the flight where they do so most often, Hz; `None` without any.
fn command_hz(flights: &[(String, FlightLog)]) -> Option<f64> {
    let of = |(_, log): &(String, FlightLog)| {
        let all = channels(log, &["rotor"]);
        let own = all.into_iter().find(|channel| channel.channel == "rotor.command")?;
        Some(own.rate_hz * (1.0 - own.held_share))
    };
    flights.iter().filter_map(of).filter(|hz| *hz > 0.0).reduce(f64::max)
}

fn paragraph(flights: &[FlightCheck], effects: &[EffectCheck]) -> String {
    let bad = flights.iter().filter(|flight| flight.problem.is_some()).count();
    let fitted = flights.iter().filter(|flight| !flight.is_held_out && flight.usable_s > 0.0);
    let (n, usable_s) = fitted.fold((0, 0.0), |(n, sum), flight| (n + 1, sum + flight.usable_s));
    let data = match (bad, flights.len()) {
        (0, 1) => "The data of the flight agree with themselves".to_owned(),
        (0, 2) => "The data of both flights agree with themselves".to_owned(),
        (0, all) => format!("The data of all {all} flights agree with themselves"),
        (bad, all) => format!("{bad} of {all} flights contradict themselves"),
    };
    if effects.is_empty() {
        return format!("{data}. Nothing can be named from them: mend the import first.");
    }
    let possible = || effects.iter().filter(|effect| effect.could_be());
    let cannot: Vec<&str> =
        possible().filter(|e| e.shown == Shows::Cannot).map(|e| e.name).collect();
    let what = if cannot.is_empty() {
        "every effect".to_owned()
    } else {
        let all = possible().count();
        format!("{} of {all} effects", all - cannot.len())
    };
    let flights = if n == 1 { "one flight".to_owned() } else { format!("{n} flights together") };
    let beside =
        if cannot.is_empty() { String::new() } else { format!(", and not {}", cannot.join(", ")) };
    format!("{data}. {usable_s:.0} s of {flights} could show {what} at a plausible size{beside}.")
}
