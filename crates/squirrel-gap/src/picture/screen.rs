//! The first screen of the report: five questions of a pilot, and what the verdict says to each in
//! plain sentences.
//!
//! All numbers are the verdict's. Beside it are needed: the evidence of the answer as a whole,
//! which the verdict has by effect only, the channels of the held-out flights, and what the vehicle
//! file has where the answer differs. A difference of `n` nats in evidence is one of `e^n` in odds.

use super::outlook::{grows, next, prediction, remains};
use super::plain::{
    Size, TOLD, capital, full_stop, noun, nouns, odds as odds_of, said, sizes, small, statement,
    times,
};
use super::units::three;
use crate::name::NATS_MIN;
use crate::report::{Answer, ReportData};
use crate::verdict::{Alternative, Kind, NamedEffect, Verdict};
use crate::words::spoken;
use squirrel_core::effects::{Effect, Gust};
use squirrel_sim::vehicle_file::VehicleFile;

/// Evidence from which on the next explanation is out of the question, nats. Below [`NATS_MIN`],
/// held-out flights have decided.
const VERY_SURE_NATS: f64 = 10.0;

/// What the first screen says.
///
/// * `data` - the evidence and the held-out channels of the report
pub fn first_screen(verdict: &Verdict, vehicle: &VehicleFile, data: &ReportData) -> Vec<Answer> {
    let answer = |question: &str, own: Answer| Answer { question: question.to_owned(), ..own };
    let mass_kg = vehicle.vehicle.parameters().mass_kg;
    vec![
        answer("What is missing", missing(verdict, vehicle)),
        answer("How sure", how_sure(verdict, vehicle, behind(verdict, data))),
        answer("How much better it predicts", prediction(verdict, data.held_out.as_ref(), mass_kg)),
        answer("What remains", remains(verdict)),
        answer("What to fly next", next(verdict, vehicle, data.held_out.is_some())),
    ]
}

/// Another explanation, and by how many nats it is behind the answer.
type Behind<'a> = Option<(&'a Alternative, f64)>;

/// The best explanation that does without a part of the answer. Gusts are weighed against calm air
/// alone, so that other explanations stand beside the answer without them.
fn behind<'a>(verdict: &'a Verdict, data: &ReportData) -> Behind<'a> {
    let whole = data.evidence.iter().find(|e| e.is_answer)?.nats;
    let gusts: f64 = verdict
        .effects
        .iter()
        .filter(|e| e.name == Gust::<f64>::NAME)
        .map(|e| e.evidence_nats)
        .sum();
    let has = |other: &Alternative, effect: &NamedEffect| {
        let same = |own: &NamedEffect| own.name == effect.name && noun(own) == noun(effect);
        if other.numbers.is_empty() {
            other.effects.contains(&effect.name)
        } else {
            other.numbers.iter().any(same)
        }
    };
    let calm = || verdict.effects.iter().filter(|e| e.name != Gust::<f64>::NAME);
    let rival =
        verdict.alternatives.iter().find(|other| !calm().all(|effect| has(other, effect)))?;
    let nats = whole - gusts - rival.evidence_nats;
    nats.is_finite().then_some((rival, nats))
}

fn missing(verdict: &Verdict, vehicle: &VehicleFile) -> Answer {
    let effects = &verdict.effects;
    let first = effects.first().and_then(|effect| sizes(effect, vehicle).into_iter().next());
    let number = |own: Answer| match &first {
        Some(Size { name, value, interval, .. }) => Answer {
            figure: value.clone(),
            figure_note: format!("{name}, 95 %: {interval}"),
            ..own
        },
        None => own,
    };
    let all: Vec<String> = effects.iter().map(|e| statement(e, vehicle)).collect();
    let all = all
        .into_iter()
        .reduce(|all, next| format!("{all}, and {}", small(&next)))
        .unwrap_or_default();
    let mut lines: Vec<String> = effects.iter().map(|e| with_sizes(e, vehicle)).collect();
    let others =
        verdict.alternatives.iter().take(TOLD).map(|other| format!("Or: {}.", nouns(other)));
    let goes_with = verdict.goes_with.as_deref().map_or_else(
        || "It goes with nothing that was tried.".to_owned(),
        |what| format!("It goes with {}.", spoken(what)),
    );
    match verdict.verdict {
        Kind::None => said(
            "Nothing",
            vec![
                "The flights differ from the vehicle file by no more than noise and its tolerances."
                    .to_owned(),
            ],
        ),
        Kind::Named | Kind::NamedIncomplete => number(said(all, lines)),
        Kind::NamedFormDiffers => {
            lines.push(
                "It is this, but it follows none of the published formulas exactly.".to_owned(),
            );
            number(said(all, lines))
        }
        Kind::Ambiguous => {
            lines.extend(others);
            number(said(format!("One of these: {}, or another", small(&all)), lines))
        }
        Kind::OutsideCatalogue if grows(verdict) => {
            let names: Vec<String> = effects.iter().map(noun).collect();
            let line = format!(
                "{} explains the flights and makes the held-out ones worse.",
                capital(&names.join(" with "))
            );
            let changed = "Was the vehicle changed between them?".to_owned();
            said("The held-out flights lack something else", vec![line, changed])
        }
        Kind::OutsideCatalogue => {
            let mut lines = vec![goes_with];
            if let Some(effect) = effects.first() {
                lines.push(format!("The nearest name, {}, does not account for it.", noun(effect)));
            }
            said("Something that is not in the catalogue", lines)
        }
        Kind::NotIdentifiable if effects.is_empty() => {
            let what =
                verdict.words.split_once(". ").map_or(verdict.words.as_str(), |(first, _)| first);
            let title = if verdict.is_unseen() {
                "Something, in flights that cannot show what"
            } else {
                "Nothing seen, but these flights could not show everything"
            };
            said(title, vec![full_stop(what)])
        }
        Kind::NotIdentifiable => {
            lines.extend(others);
            said("Something, and too many explanations fit", lines)
        }
        Kind::DataProblem => {
            let mut lines: Vec<String> =
                verdict.set_aside.iter().take(TOLD).map(|aside| full_stop(&aside.words)).collect();
            if lines.is_empty() {
                lines.push(full_stop(&verdict.words));
            }
            said("The logs contradict themselves", lines)
        }
    }
}

/// `Thrust of rotor 3 (weak_rotor): thrust loss 24.3 %, 23.1 to 25.5 %.`
fn with_sizes(effect: &NamedEffect, vehicle: &VehicleFile) -> String {
    let all: Vec<String> = sizes(effect, vehicle)
        .iter()
        .map(|s| format!("{} {}, {}{}", s.name, s.value, s.interval, s.declared))
        .collect();
    format!("{}: {}.", capital(&noun(effect)), all.join("; "))
}

fn how_sure(verdict: &Verdict, vehicle: &VehicleFile, behind: Behind<'_>) -> Answer {
    // Where nothing does without the answer, its own worth: that of the name that is worth the
    // least.
    let least = verdict.effects.iter().min_by(|a, b| a.evidence_nats.total_cmp(&b.evidence_nats));
    let worth = least
        .map(|e| (e.name, e.evidence_nats))
        .filter(|(_, nats)| nats.is_finite() && *nats > 0.0);
    let odds = |own: Answer| {
        let (nats, note) = match (behind, worth) {
            (Some((_, nats)), _) => (nats, "odds against the next explanation"),
            (None, Some((_, nats))) => (nats, "odds against doing without it"),
            (None, None) => return own,
        };
        let figure = if nats >= 0.0 { odds_of(nats) } else { String::new() };
        Answer { figure, figure_note: note.to_owned(), ..own }
    };
    let next = behind.map(|(other, nats)| {
        let name = nouns(other);
        if nats >= 0.0 {
            format!(
                "The next best explanation, {name}, is {} times less likely ({} nats).",
                times(nats),
                three(nats)
            )
        } else {
            format!(
                "{} fits these flights as well ({} nats), but not the others.",
                capital(&name),
                three(nats)
            )
        }
    });
    let without = worth.map(|(name, nats)| {
        format!(
            "Leaving out {name} makes these flights {} times less likely ({} nats).",
            times(nats),
            three(nats)
        )
    });
    let far = verdict.effects.iter().filter_map(|effect| {
        let size = sizes(effect, vehicle).into_iter().next().filter(|size| size.far.is_finite())?;
        Some((effect.name, three(size.far.abs())))
    });
    let far = far.fold(String::new(), |text, (name, far)| match text.as_str() {
        "" => format!("{name} is {far} standard deviations from what the vehicle file has"),
        _ => format!("{text}, {name} {far}"),
    });
    let far = (!far.is_empty()).then(|| format!("{far}."));
    let lines = |first: Option<String>| first.into_iter().chain(far.clone()).collect::<Vec<_>>();
    match verdict.verdict {
        // It is this answer only where the flights would show everything.
        Kind::None => said(
            "Sure: these flights would have shown it",
            vec![
                "Every effect that the vehicle can have would stand out at a plausible size."
                    .to_owned(),
            ],
        ),
        Kind::DataProblem => said(
            "Nothing is said about forces",
            vec!["Nothing is computed from logs that contradict themselves.".to_owned()],
        ),
        Kind::OutsideCatalogue if grows(verdict) => said("Not sure of any name", lines(without)),
        Kind::OutsideCatalogue => {
            let line = "It stands well above noise and tolerances; no name accounts for it.";
            let lines = std::iter::once(line.to_owned()).chain(without);
            said("Sure that something is missing, not what", lines.collect())
        }
        Kind::NotIdentifiable if verdict.effects.is_empty() => said(
            "Not sure",
            vec!["An effect that these flights cannot show may still be there.".to_owned()],
        ),
        Kind::Ambiguous | Kind::NotIdentifiable => {
            let few = format!("Odds below {} do not decide.", odds_of(NATS_MIN));
            odds(said("Not decided between these", lines(next).into_iter().chain([few]).collect()))
        }
        Kind::Named | Kind::NamedIncomplete | Kind::NamedFormDiffers => {
            let nats =
                behind.map(|(_, nats)| nats).or(worth.map(|(_, nats)| nats)).unwrap_or_default();
            let words = if nats >= VERY_SURE_NATS {
                "Very sure"
            } else if nats >= NATS_MIN {
                "Sure"
            } else {
                "Fairly sure: the held-out flights decide"
            };
            odds(said(words, lines(next.or(without))))
        }
    }
}
