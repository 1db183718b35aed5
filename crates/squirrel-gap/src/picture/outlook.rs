//! The second half of the first screen: how much better the answer predicts, what remains, what to
//! fly next.

use super::plain::{TOLD, capital, full_stop, noun, nouns, said, sizes};
use super::units::{three, with_unit};
use crate::report::{Answer, HeldOut, HeldOutChannel};
use crate::verdict::{Alternative, Gap, Kind, NamedEffect, Verdict};
use crate::words::{manoeuvre, spoken};
use squirrel_sim::vehicle_file::VehicleFile;

/// An error over that of noise that is worth a word.
const ABOVE_NOISE: f64 = 1.2;
/// The same where the held-out flights have something of their own.
const FAR_ABOVE_NOISE: f64 = 2.0;
/// Part of the error by which that of a rival may differ and be the same.
const AS_GOOD: f64 = 0.05;
/// Part of the error of a force by which it must fall to be told before angles, rates and speeds.
const FORCE_FALLS: f64 = 0.1;
/// Interval over size from which on a number deserves a narrower one.
const WIDE: f64 = 0.2;

/// Whether what is named explains its flights and makes held-out ones worse.
pub(super) fn grows(verdict: &Verdict) -> bool {
    let explains = verdict.leftover.as_ref().is_none_or(|left| left.channels.is_empty());
    let worse = verdict.gap.as_ref().is_some_and(|gap| gap.after > (1.0 + AS_GOOD) * gap.before);
    !verdict.effects.is_empty() && explains && worse
}

pub(super) fn prediction(verdict: &Verdict, held_out: Option<&HeldOut>, mass_kg: f64) -> Answer {
    let Some(gap) = &verdict.gap else {
        return if verdict.verdict == Kind::DataProblem {
            said(
                "Not tested",
                vec!["Nothing is predicted from logs that contradict themselves.".to_owned()],
            )
        } else {
            let why = if held_out.is_some() {
                "The held-out flights cannot be re-simulated: that needs attitude and velocity throughout."
            } else {
                "No flight was held out: give one with --held-out that takes no part in the fit."
            };
            said("Not tested", vec![why.to_owned()])
        };
    };
    let flights = match gap.held_out_flights.len() {
        1 => "a flight".to_owned(),
        n => format!("{n} flights"),
    };
    let note = "squared error over that of noise, first second".to_owned();
    if verdict.effects.is_empty() {
        let times = three(gap.before);
        let line = format!(
            "On {flights} held out, the file as it is leaves {times} times the squared error of noise."
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
        lines.push(format!("Counted above noise, on {flights} that the fit never saw."));
        let whose =
            if verdict.verdict == Kind::OutsideCatalogue { "With the nearest name, " } else { "" };
        format!("{whose}{} less error", removed(gap.removed_fraction))
    };
    if let Some(rival) = gap.best_rival {
        let so = if rival > (1.0 + AS_GOOD) * gap.after {
            ""
        } else if rival < (1.0 - AS_GOOD) * gap.after {
            ", which is less: evidence speaks for the answer"
        } else {
            ", no worse: evidence decides between them"
        };
        lines.push(format!("The best other explanation leaves {}{so}.", three(rival)));
    }
    lines.extend(held_out.and_then(|held_out| largest_gain(&held_out.channels, mass_kg)));
    let figure = format!("{} \u{2192} {}", three(gap.before), three(gap.after));
    Answer { figure, figure_note: note, ..said(answer, lines) }
}

/// The channel that gains most, in its own unit: a force where one falls, or else what falls most
/// over its noise.
fn largest_gain(channels: &[HeldOutChannel], mass_kg: f64) -> Option<String> {
    let gain = |c: &HeldOutChannel| {
        let e = &c.second;
        (e.nominal.powi(2) - e.fitted.powi(2)) / e.floor.powi(2)
    };
    let falls = |c: &&HeldOutChannel, by: f64| {
        gain(c).is_finite() && c.second.fitted < (1.0 - by) * c.second.nominal
    };
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

pub(super) fn remains(verdict: &Verdict) -> Answer {
    let Some(left) = &verdict.leftover else {
        let why = match verdict.verdict {
            Kind::DataProblem => "Nothing was looked for in these logs.",
            _ => "What lasts of forces was looked at; these logs say too little of quick ones.",
        };
        return said("Not known", vec![why.to_owned()]);
    };
    let mut lines = Vec::new();
    let held_out =
        verdict.gap.as_ref().filter(|gap| gap.after > ABOVE_NOISE && !verdict.effects.is_empty());
    if !verdict.effects.is_empty() {
        let what =
            if verdict.verdict == Kind::OutsideCatalogue { "nearest name" } else { "answer" };
        let (share, than) = (100.0 * left.share_removed, "what these flights differed by");
        lines.push(if share < 0.0 {
            format!(
                "The {what} adds {:.1} % to {than}, inside what the file's tolerances allow.",
                -share
            )
        } else {
            format!("The {what} takes away {share:.1} % of {than}.")
        });
    }
    if left.channels.is_empty() {
        // Names that all explanations share may leave what each explains otherwise.
        if verdict.verdict == Kind::NamedIncomplete {
            let beside = verdict.alternatives.iter().map(|other| beside(verdict, other));
            let beside = beside.filter(|other| !other.effects.is_empty()).take(TOLD);
            lines.extend(beside.map(|other| format!("Perhaps {}.", nouns(&other))));
            return said("Something that these flights do not tell apart", lines);
        }
        let nothing = "Nothing above noise and the file's tolerances";
        return match held_out {
            Some(gap) => Answer {
                figure: three(gap.after),
                figure_note: "squared error over that of noise, on held-out flights".to_owned(),
                ..said(format!("{nothing} here, more on held-out flights"), lines)
            },
            None if lines.is_empty() => said(nothing, vec![accounted_for(verdict)]),
            None => said(nothing, lines),
        };
    }
    let channels: Vec<String> = left.channels.iter().map(|channel| spoken(channel)).collect();
    lines.insert(
        0,
        left.goes_with.as_deref().map_or_else(
            || "Nothing that was tried predicts it.".to_owned(),
            |what| format!("It goes with {}.", spoken(what)),
        ),
    );
    lines.extend(held_out.map(|gap| {
        format!(
            "On the held-out flights, {} times the squared error of noise remains.",
            three(gap.after)
        )
    }));
    Answer {
        figure: format!("{:.0} %", 100.0 * left.share_left),
        figure_note: "of what was measured there, about its mean".to_owned(),
        ..said(format!("A part of {}", channels.join(" and ")), lines)
    }
}

/// What accounts for flights in which nothing has a name.
fn accounted_for(verdict: &Verdict) -> String {
    match verdict.moved.first() {
        None => "What these flights show, the vehicle file accounts for.".to_owned(),
        Some(number) => format!(
            "The vehicle file accounts for these flights if {} is {:.1} tolerances off; check that number.",
            number.name,
            number.far()
        ),
    }
}

/// What another explanation has beside the answer.
fn beside(verdict: &Verdict, other: &Alternative) -> Alternative {
    let is_new = |name: &str| verdict.effects.iter().all(|own| own.name != name);
    let effects = other.effects.iter().copied().filter(|name| is_new(name)).collect();
    let numbers = other.numbers.iter().filter(|effect| is_new(effect.name)).cloned().collect();
    Alternative { effects, evidence_nats: other.evidence_nats, numbers }
}

pub(super) fn next(verdict: &Verdict, vehicle: &VehicleFile, held_out: bool) -> Answer {
    if let Some(asked) = &verdict.fly_next {
        // The last part names the scenario that flies most of it.
        let (flights, rest) =
            asked.rsplit_once("; `").map_or((asked.as_str(), None), |(f, r)| (f, Some(r)));
        let mut lines: Vec<String> =
            flights.split("); ").map(|part| capital(&closed(part))).collect();
        let more = lines.len().saturating_sub(TOLD);
        lines.truncate(TOLD);
        if more > 0 {
            lines.push(format!("And {more} more, see below."));
        }
        lines.extend(rest.map(|rest| {
            format!("\u{201c}{}; its card is below.", rest.replacen('`', "\u{201d}", 1))
        }));
        return said("One more flight, with this in it", lines);
    }
    let sharpen = || {
        let wide = |e: &&NamedEffect| {
            sizes(e, vehicle).first().map_or(0.0, |s| if s.width > WIDE { s.width } else { 0.0 })
        };
        let widest = verdict.effects.iter().max_by(|a, b| wide(a).total_cmp(&wide(b)))?;
        let width = wide(&widest);
        (width > 0.0).then(|| {
            format!(
                "To narrow {} (\u{b1}{:.0} %): {}.",
                noun(widest),
                100.0 * width,
                manoeuvre(widest.name)
            )
        })
    };
    let unproven = || {
        let differ = |gap: &Gap| gap.after > FAR_ABOVE_NOISE && !verdict.effects.is_empty();
        let line = match &verdict.gap {
            None if held_out => "To prove it: held-out logs with attitude and velocity throughout.",
            None => "To prove it: any other flight of the same day, held out.",
            Some(gap) if differ(gap) => {
                "The held-out flights differ by more than these: put one like them among those to fit."
            }
            Some(_) => return None,
        };
        Some(line.to_owned())
    };
    match verdict.verdict {
        Kind::DataProblem => said(
            "Nothing new: mend the import first",
            vec![
                "Change what stands above in the import map, import again, and run again."
                    .to_owned(),
            ],
        ),
        Kind::OutsideCatalogue if grows(verdict) => said(
            "The same flights again",
            vec![
                "Fly those to fit and those to hold out with the vehicle unchanged between them."
                    .to_owned(),
            ],
        ),
        Kind::OutsideCatalogue => said(
            "No flight can name it",
            vec![
                "Look at when and where it acts, below.".to_owned(),
                "Look at the vehicle: loads, blades, mounts, loose parts.".to_owned(),
            ],
        ),
        Kind::NamedIncomplete | Kind::NamedFormDiffers => {
            let line = "No flight can name what remains; the answer may be used where it holds."
                .to_owned();
            let lines = [Some(line), sharpen(), unproven()].into_iter().flatten();
            said("Nothing more for this answer", lines.collect())
        }
        _ => {
            let mut lines: Vec<String> = [sharpen(), unproven()].into_iter().flatten().collect();
            if lines.is_empty() {
                lines.push("These flights decide the answer.".to_owned());
                return said("Nothing more is needed", lines);
            }
            let to = if verdict.effects.is_empty() { "" } else { " to name it" };
            said(format!("Nothing more is needed{to}"), lines)
        }
    }
}

/// A part of a list that was split at its closing brackets.
fn closed(part: &str) -> String {
    if part.contains('(') && !part.ends_with(')') { format!("{part}).") } else { full_stop(part) }
}
