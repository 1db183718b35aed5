//! `squirrel gap check`: what flights are worth before any verdict, in tables.

use crate::output::{Table, say};
use squirrel_gap::{Check, EffectCheck, FlightCheck, NumberCheck, Shows, significant};
use std::collections::BTreeMap;

/// Everything.
pub(super) fn show(check: &Check) {
    say(&format!("{}\n", check.words));
    flights(&check.flights);
    channels(&check.flights);
    if !check.effects.is_empty() {
        effects(&check.effects);
    }
    let lacking: Vec<(&str, &str)> = check
        .effects
        .iter()
        .filter_map(|effect| Some((effect.name, effect.lacks.as_deref()?)))
        .collect();
    list("not shown, whatever is flown:", &lacking);
    let fly: Vec<(&str, &str)> =
        check.effects.iter().filter_map(|effect| Some((effect.name, effect.fly?))).collect();
    list("what to fly (`squirrel fly --scenario excite_rich` flies most of it):", &fly);
}

/// Effects by what is said of them, in the order in which it is said first.
fn list(title: &str, told: &[(&str, &str)]) {
    let mut lines: Vec<(&str, Vec<&str>)> = Vec::new();
    for (effect, what) in told {
        match lines.iter_mut().find(|(other, _)| other == what) {
            Some((_, effects)) => effects.push(effect),
            None => lines.push((what, vec![effect])),
        }
    }
    if !lines.is_empty() {
        say(&format!("\n{title}"));
    }
    for (what, effects) in lines {
        say(&format!("  {}: {what}", effects.join(", ")));
    }
}

fn flights(all: &[FlightCheck]) {
    let mut table =
        Table::new(&["flight", "role", "length s", "usable s", "saturated %", "problem"]);
    for flight in all {
        let saturated = flight.saturated_share.iter().copied().reduce(f64::max);
        let problem = flight.problem.as_ref().map_or("none", |problem| problem.channel);
        table.row(vec![
            flight.flight.clone(),
            if flight.is_held_out { "held out" } else { "fit" }.to_owned(),
            format!("{:.1}", flight.duration_s),
            format!("{:.1}", flight.usable_s),
            saturated.map_or_else(|| "-".to_owned(), |share| format!("{:.1}", 100.0 * share)),
            problem.to_owned(),
        ]);
    }
    table.print();
    say("");
    for problem in all.iter().filter_map(|flight| flight.problem.as_ref()) {
        say(&format!("set aside: {}\n", problem.words));
    }
}

/// A line for each channel, with its worst over all flights.
fn channels(all: &[FlightCheck]) {
    let mut worst: BTreeMap<&str, (usize, [f64; 5])> = BTreeMap::new();
    for channel in all.iter().flat_map(|flight| &flight.channels) {
        let own = [
            channel.rate_hz,
            channel.largest_gap_s,
            channel.held_share,
            channel.longest_held_s,
            channel.missing_share,
        ];
        let (flights, found) = worst.entry(&channel.channel).or_insert((0, own));
        *flights += 1;
        found[0] = found[0].min(own[0]);
        for (found, own) in found.iter_mut().zip(own).skip(1) {
            *found = found.max(own);
        }
    }
    let mut table = Table::new(&[
        "channel",
        "flights",
        "rate Hz",
        "largest gap s",
        "held %",
        "longest held s",
        "missing %",
    ]);
    for (name, (flights, [rate_hz, gap_s, held, held_s, missing])) in worst {
        table.row(vec![
            name.to_owned(),
            flights.to_string(),
            significant(rate_hz, 3),
            significant(gap_s, 3),
            format!("{:.1}", 100.0 * held),
            significant(held_s, 3),
            format!("{:.1}", 100.0 * missing),
        ]);
    }
    table.print();
    say("");
}

fn effects(all: &[EffectCheck]) {
    let mut table = Table::new(&[
        "effect",
        "shown",
        "number",
        "smallest shown",
        "x typical",
        "not below",
        "cannot be told from",
    ]);
    for effect in all {
        let shown = if effect.shown == Shows::Can { "can" } else { "cannot" };
        let mut row = vec![effect.name.to_owned(), shown.to_owned()];
        let size = |size: Option<f64>| size.map_or_else(|| "-".to_owned(), |x| significant(x, 3));
        match effect.decisive() {
            Some(number) => row.extend([
                key(number),
                size(number.smallest_shown),
                size(number.smallest_shown_of_typical),
                size(number.not_shown_below),
            ]),
            None => row.extend(["", "-", "-", "-"].map(str::to_owned)),
        }
        row.push(effect.not_told_from.join(", "));
        table.row(row);
    }
    table.print();
}

fn key(number: &NumberCheck) -> String {
    let place = number.place();
    if place.is_empty() { number.key.to_owned() } else { format!("{} ({place})", number.key) }
}
