//! The first screen of the report: five questions of a pilot, and what the verdict says to each in plain sentences.
//!
//! All numbers are the verdict's. Beside it are needed: the evidence of the answer as a whole, which the verdict has by effect
//! only, the channels of the held-out flights, and what the vehicle file has where the answer differs.

use super::plain::{Size, noun, nouns, sizes, statement, times};
use super::units::{spoken, three, with_unit};
use crate::report::{Answer, HeldOutChannel, ReportData};
use crate::verdict::{Alternative, Kind, NamedEffect, Verdict};
use crate::words::manoeuvre;
use squirrel_sim::vehicle_file::VehicleFile;

/// Other explanations and flights set aside that are told on the first screen; the panels below have all.
const TOLD: usize = 3;
/// Evidence from which on the next explanation is out of the question, and below which held-out flights have decided, nats.
const VERY_SURE_NATS: f64 = 10.0;
const SURE_NATS: f64 = 5.0;
/// An error over that of noise that is worth a word.
const ABOVE_NOISE: f64 = 1.2;
/// Part of the error by which a rival that removes less is no worse.
const AS_GOOD: f64 = 0.02;
/// Part of the error of a force by which it must fall to be told before angles, rates and speeds.
const FORCE_FALLS: f64 = 0.1;
/// Interval over size from which on a number deserves a narrower one.
const WIDE: f64 = 0.2;

/// What the first screen says.
///
/// * `data` - the evidence and the held-out channels of the report
pub fn first_screen(verdict: &Verdict, vehicle: &VehicleFile, data: &ReportData) -> Vec<Answer> {
    let answer = |question: &str, own: Answer| Answer { question: question.to_owned(), ..own };
    let mass_kg = vehicle.vehicle.parameters().mass_kg;
    let channels = data.held_out.as_ref().map_or(&[][..], |held_out| &held_out.channels);
    vec![
        answer("What is missing", missing(verdict, vehicle)),
        answer("How sure", how_sure(verdict, vehicle, behind(verdict, data))),
        answer("How much better it predicts", prediction(verdict, channels, mass_kg)),
        answer("What remains", remains(verdict)),
        answer("What to fly next", next(verdict, vehicle)),
    ]
}

/// An answer without a number.
fn said(answer: impl Into<String>, sentences: Vec<String>) -> Answer {
    Answer { answer: answer.into(), sentences, ..Answer::default() }
}

/// Another explanation, and by how many nats it is behind the answer.
type Behind<'a> = Option<(&'a Alternative, f64)>;

/// The best explanation that does without a part of the answer. Gusts are weighed against calm air alone, so that other
/// explanations stand beside the answer without them.
fn behind<'a>(verdict: &'a Verdict, data: &ReportData) -> Behind<'a> {
    let whole = data.evidence.iter().find(|e| e.is_answer)?.nats;
    let gusts: f64 = verdict.effects.iter().filter(|e| e.name == "gust").map(|e| e.evidence_nats).sum();
    let has = |other: &Alternative, effect: &NamedEffect| {
        let same = |own: &NamedEffect| own.name == effect.name && noun(own) == noun(effect);
        if other.numbers.is_empty() {
            other.effects.contains(&effect.name)
        } else {
            other.numbers.iter().any(same)
        }
    };
    let calm = || verdict.effects.iter().filter(|e| e.name != "gust");
    let rival = verdict.alternatives.iter().find(|other| !calm().all(|effect| has(other, effect)))?;
    let nats = whole - gusts - rival.evidence_nats;
    nats.is_finite().then_some((rival, nats))
}

fn missing(verdict: &Verdict, vehicle: &VehicleFile) -> Answer {
    let effects = &verdict.effects;
    let first = effects.first().and_then(|effect| sizes(effect, vehicle).into_iter().next());
    let number = |own: Answer| match &first {
        Some(Size { value, note, .. }) => Answer { figure: value.clone(), figure_note: note.clone(), ..own },
        None => own,
    };
    let all = effects.iter().map(|e| statement(e, vehicle)).collect::<Vec<_>>().join("; ");
    let mut lines: Vec<String> = effects.iter().map(|e| with_sizes(e, vehicle)).collect();
    let others = verdict.alternatives.iter().take(TOLD).map(|other| format!("Or: {}.", nouns(other)));
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
            lines.push("It is this, but it follows none of the published formulas exactly.".to_owned());
            number(said(all, lines))
        }
        Kind::Ambiguous => {
            lines.extend(others);
            number(said(format!("One of these: {all}, or another"), lines))
        }
        Kind::OutsideCatalogue => {
            let mut lines = vec![goes_with];
            if let Some(effect) = effects.first() {
                lines.push(format!("The nearest name, {}, does not account for it.", noun(effect)));
            }
            said("Something that is not in the catalogue", lines)
        }
        Kind::NotIdentifiable if effects.is_empty() => {
            let what = verdict.words.split_once(". ").map_or(verdict.words.as_str(), |(first, _)| first);
            said("Nothing shows, but these flights could not show all", vec![full_stop(what)])
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

fn full_stop(text: &str) -> String {
    if text.ends_with('.') { text.to_owned() } else { format!("{text}.") }
}

/// `thrust of rotor 3 (weak_rotor): 24.3 %, thrust loss, 23.1 to 25.5 % (95 %).`
fn with_sizes(effect: &NamedEffect, vehicle: &VehicleFile) -> String {
    let all: Vec<String> =
        sizes(effect, vehicle).iter().map(|s| format!("{}: {}", s.value, s.note)).collect();
    format!("{}: {}.", capital(&noun(effect)), all.join("; "))
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

fn how_sure(verdict: &Verdict, vehicle: &VehicleFile, behind: Behind<'_>) -> Answer {
    let rival = |own: Answer| match behind {
        Some((_, nats)) if nats >= 0.0 => {
            let figure = format!("{} : 1", times(nats));
            Answer { figure, figure_note: "odds against the next explanation".to_owned(), ..own }
        }
        _ => own,
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
    // Where nothing does without the answer, its own worth: that of the name that is worth the least.
    let worth = || {
        let least = verdict.effects.iter().min_by(|a, b| a.evidence_nats.total_cmp(&b.evidence_nats))?;
        let nats = least.evidence_nats;
        let known = nats.is_finite() && nats > 0.0;
        known.then(|| {
            format!(
                "Without {}, the flights are {} times less likely ({} nats).",
                noun(least),
                times(nats),
                three(nats)
            )
        })
    };
    let far = |effect: &NamedEffect| {
        let size = sizes(effect, vehicle).into_iter().next().filter(|size| size.far.is_finite())?;
        Some(format!("{} standard deviations ({})", three(size.far.abs()), effect.name))
    };
    let far: Vec<String> = verdict.effects.iter().filter_map(far).collect();
    let far = (!far.is_empty())
        .then(|| format!("Its number is {} from what the vehicle file has.", far.join(" and ")));
    let lines = |first: Option<String>| first.into_iter().chain(far.clone()).collect::<Vec<_>>();
    match verdict.verdict {
        Kind::None => {
            let best = verdict.alternatives.first();
            let line = best.map(|best| {
                let nats = best.evidence_nats;
                format!(
                    "The best name that was tried, {}, has {} nats: too little to count.",
                    nouns(best),
                    three(nats)
                )
            });
            said("No name stands out", line.into_iter().collect())
        }
        Kind::DataProblem => said(
            "Nothing is said about forces",
            vec!["Nothing is computed from logs that contradict themselves.".to_owned()],
        ),
        Kind::OutsideCatalogue => {
            let line = "It stands well above noise and tolerances; no name accounts for it.";
            let lines = std::iter::once(line.to_owned()).chain(worth());
            said("Sure that something is missing, not what", lines.collect())
        }
        Kind::NotIdentifiable if verdict.effects.is_empty() => {
            said("Not sure", vec!["An effect that these flights cannot show may still be there.".to_owned()])
        }
        Kind::Ambiguous | Kind::NotIdentifiable => rival(said("Not decided between these", lines(next))),
        Kind::Named | Kind::NamedIncomplete | Kind::NamedFormDiffers => {
            let nats = behind.map_or(f64::INFINITY, |(_, nats)| nats);
            let words = if nats >= VERY_SURE_NATS {
                "Very sure"
            } else if nats >= SURE_NATS {
                "Sure"
            } else {
                "Fairly sure: the held-out flights decide"
            };
            rival(said(words, lines(next.or_else(worth))))
        }
    }
}

fn prediction(verdict: &Verdict, channels: &[HeldOutChannel], mass_kg: f64) -> Answer {
    let Some(gap) = &verdict.gap else {
        return if verdict.verdict == Kind::DataProblem {
            said("Not tested", vec!["Nothing is predicted from logs that contradict themselves.".to_owned()])
        } else {
            let why = "No held-out flight could be compared: give one with --held-out that took no part in the fit.";
            said("Not tested", vec![why.to_owned()])
        };
    };
    let flights = match gap.held_out_flights.len() {
        1 => "a flight".to_owned(),
        n => format!("{n} flights"),
    };
    let note = "squared error over that of noise, first second".to_owned();
    if verdict.effects.is_empty() {
        let line = format!(
            "The vehicle file as it is leaves {} times the squared error of noise on {flights} that it was not fitted to.",
            three(gap.before)
        );
        let answer = if gap.before > ABOVE_NOISE {
            "Nothing to add"
        } else {
            "The file predicts as well as noise allows"
        };
        return Answer { figure: three(gap.before), figure_note: note, ..said(answer, vec![line]) };
    }
    let removed = |fraction: f64| format!("{:.1} %", 100.0 * fraction);
    let mut lines = Vec::new();
    let answer = if gap.after > gap.before {
        lines.push(format!(
            "On {flights} that the fit never saw, the error grows: do not fly on this answer."
        ));
        "It predicts worse".to_owned()
    } else {
        lines.push(format!("On {flights} that the fit never saw, with noise taken off."));
        format!("{} less error", removed(gap.removed_fraction))
    };
    if let Some(rival) = gap.best_rival_removed_fraction {
        let as_good = rival > gap.removed_fraction - AS_GOOD;
        let so = if as_good { ", no worse: evidence decides between them" } else { "" };
        lines.push(format!("The best other explanation removes {}{so}.", removed(rival)));
    }
    lines.extend(largest_gain(channels, mass_kg));
    let figure = format!("{} \u{2192} {}", three(gap.before), three(gap.after));
    Answer { figure, figure_note: note, ..said(answer, lines) }
}

/// The channel that gains most, in its own unit: a force where one falls, or else what falls most over its noise.
fn largest_gain(channels: &[HeldOutChannel], mass_kg: f64) -> Option<String> {
    let gain = |c: &HeldOutChannel| {
        let e = &c.second;
        (e.nominal.powi(2) - e.fitted.powi(2)) / e.floor.powi(2)
    };
    let falls =
        |c: &&HeldOutChannel, by: f64| gain(c).is_finite() && c.second.fitted < (1.0 - by) * c.second.nominal;
    let most = |force: bool, by: f64| {
        let own = channels.iter().filter(|c| !force || c.name.starts_with("specific force"));
        own.filter(|c| falls(c, by)).max_by(|a, b| gain(a).total_cmp(&gain(b)))
    };
    let best = most(true, FORCE_FALLS).or_else(|| most(false, 0.0))?;
    let (unit, times) = match best.unit.as_str() {
        "m/s\u{b2}" => ("N", mass_kg),
        "rad" => ("\u{b0}", 180.0 / std::f64::consts::PI),
        unit => (unit, 1.0),
    };
    let [before, after] =
        [best.second.nominal, best.second.fitted].map(|x| with_unit(&three(times * x), unit));
    Some(format!("Largest gain: error of {} from {before} to {after}.", spoken(&best.name)))
}

fn remains(verdict: &Verdict) -> Answer {
    let Some(left) = &verdict.leftover else {
        return said("Not known", vec!["Nothing was looked for in these logs.".to_owned()]);
    };
    let mut lines = Vec::new();
    let held_out = verdict.gap.as_ref().filter(|gap| gap.after > ABOVE_NOISE && !verdict.effects.is_empty());
    let held_out = held_out.map(|gap| {
        format!("On the held-out flights, {} times the squared error of noise remains.", three(gap.after))
    });
    if !verdict.effects.is_empty() {
        lines.push(format!(
            "The answer takes away {:.1} % of what these flights differed by.",
            100.0 * left.share_removed
        ));
    }
    if left.channels.is_empty() {
        lines.extend(held_out);
        // Names that all explanations share may leave what each explains otherwise.
        if verdict.verdict == Kind::NamedIncomplete {
            lines.extend(
                verdict.alternatives.iter().take(TOLD).map(|other| format!("Perhaps {}.", nouns(other))),
            );
            return said("Something that these flights do not tell apart", lines);
        }
        return said("Nothing above noise and tolerances", lines);
    }
    let channels: Vec<String> = left.channels.iter().map(|channel| spoken(channel)).collect();
    lines.insert(
        0,
        left.goes_with.as_deref().map_or_else(
            || "Nothing that was tried predicts it.".to_owned(),
            |what| format!("It goes with {}.", spoken(what)),
        ),
    );
    lines.extend(held_out);
    Answer {
        figure: format!("{:.0} %", 100.0 * left.share_left),
        figure_note: "of what was measured there".to_owned(),
        ..said(format!("A part of {}", channels.join(", ")), lines)
    }
}

fn next(verdict: &Verdict, vehicle: &VehicleFile) -> Answer {
    if let Some(asked) = &verdict.fly_next {
        // The last part names the scenario that flies most of it.
        let (flights, rest) = asked.rsplit_once("; `").map_or((asked.as_str(), None), |(f, r)| (f, Some(r)));
        let mut lines: Vec<String> = flights.split("); ").map(|part| capital(&closed(part))).collect();
        let more = lines.len().saturating_sub(TOLD);
        lines.truncate(TOLD);
        if more > 0 {
            lines.push(format!("And {more} more, see below."));
        }
        lines.extend(rest.map(|rest| format!("`{rest}; its card is below.")));
        return said("One more flight, with this in it", lines);
    }
    let sharpen = || {
        let wide = |e: &&NamedEffect| {
            sizes(e, vehicle).first().map_or(0.0, |s| if s.width > WIDE { s.width } else { 0.0 })
        };
        let widest = verdict.effects.iter().max_by(|a, b| wide(a).total_cmp(&wide(b)))?;
        let width = wide(&widest);
        (width > 0.0).then(|| {
            format!("To narrow {} (\u{b1}{:.0} %): {}.", noun(widest), 100.0 * width, manoeuvre(widest.name))
        })
    };
    let unproven = || {
        let none = verdict.gap.is_none();
        none.then(|| "To prove it: any other flight of the same day, held out.".to_owned())
    };
    match verdict.verdict {
        Kind::DataProblem => said(
            "Nothing new: mend the import first",
            vec!["Change what stands above in the import map, import again, and run again.".to_owned()],
        ),
        Kind::OutsideCatalogue => said(
            "No flight can name it",
            vec!["Look at when and where it acts, below, and at the vehicle: loads, blades, mounts, loose parts.".to_owned()],
        ),
        Kind::NamedIncomplete | Kind::NamedFormDiffers => {
            let line = "No flight can name what remains; the answer may be used where it holds.".to_owned();
            said("Nothing more for this answer", [Some(line), sharpen(), unproven()].into_iter().flatten().collect())
        }
        _ => {
            let lines: Vec<String> = [sharpen(), unproven()].into_iter().flatten().collect();
            let answer = if lines.is_empty() { "Nothing more is needed" } else { "Nothing more to name it" };
            let all = if lines.is_empty() { vec!["These flights decide the answer.".to_owned()] } else { lines };
            said(answer, all)
        }
    }
}

/// A part of a list that was split at its closing brackets.
fn closed(part: &str) -> String {
    if part.contains('(') && !part.ends_with(')') { format!("{part}).") } else { full_stop(part) }
}
