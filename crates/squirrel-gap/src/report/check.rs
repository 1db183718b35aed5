//! What flights are worth before any verdict: their data, and what of each effect they could show.

use super::{WIDTH, figure};
use crate::checked::{ChannelCheck, Check, EffectCheck, FlightCheck, NumberCheck, Shows};
use crate::words::short;
use squirrel_report::chart::{Axis, ChartRow, Extent, Ink, Range, RowChart};
use squirrel_report::page::{Columns, Figure, Page, Row};
use std::collections::BTreeMap;

/// Identifiers of the panels.
const FLIGHTS: &str = "check-flights";
const EFFECTS: &str = "check-effects";
/// Periods without a sample that are a gap worth its place.
const PERIODS: f64 = 3.0;

/// The page of `squirrel gap check` as one HTML file.
pub fn render_check(vehicle: &str, check: &Check) -> String {
    let mut page = Page::new(&format!("Flights of {vehicle} before any verdict"), &check.words);
    panels(&mut page, check);
    page.html()
}

/// Both panels.
pub(super) fn panels(page: &mut Page, check: &Check) {
    let text = "Rates, gaps and held samples as they are in the logs, and commands at their ends. Commands are held by what \
                they drive; what is measured is not. A flight whose data \
                contradict themselves is set aside, and the line says what to change.";
    page.panel(FLIGHTS, "Before any verdict: the data", text, |page| {
        flights(page, &check.flights);
        channels(page, &check.flights);
    });
    let text = "What the flights to fit, together, could show: noise, what their model leaves, and the tolerances of the \
                vehicle file stand against each effect. From its smallest size on an effect would be named in nearly all \
                flights like these, below another hardly ever; between them it is chance. A row ends at the largest \
                plausible size.";
    page.panel(EFFECTS, "Before any verdict: what the flights could show", text, |page| {
        if check.effects.is_empty() {
            page.missing("Nothing: no flight is left whose data agree with themselves.");
            return;
        }
        chart(page, &check.effects);
        effects(page, &check.effects);
    });
}

fn percent(share: f64) -> String {
    format!("{} %", figure((1e5 * share).round() / 1e3))
}

fn head(cells: &[&str]) -> Vec<String> {
    cells.iter().map(|cell| (*cell).to_owned()).collect()
}

fn flights(page: &mut Page, all: &[FlightCheck]) {
    let row = |flight: &FlightCheck| {
        let saturated = flight.saturated_share.iter().copied().reduce(f64::max);
        let role = if flight.is_held_out { "held out" } else { "fit" };
        Row {
            ink: None,
            cells: vec![
                short(&flight.flight),
                role.to_owned(),
                format!("{:.1}", flight.duration_s),
                format!("{:.1}", flight.usable_s),
                saturated.map_or_else(|| "\u{2013}".to_owned(), percent),
                flight.problem.as_ref().map_or_else(
                    || "none".to_owned(),
                    |p| p.words.replace(&flight.flight, &short(&flight.flight)),
                ),
            ],
        }
    };
    let names = [
        "flight",
        "role",
        "length s",
        "usable s",
        "commands at their ends, worst rotor",
        "problem",
    ];
    page.table(&head(&names), &all.iter().map(row).collect::<Vec<_>>());
}

/// A line for each channel, with its worst over all flights.
fn channels(page: &mut Page, all: &[FlightCheck]) {
    let mut by_name: BTreeMap<&str, Vec<(&str, &ChannelCheck)>> = BTreeMap::new();
    for flight in all {
        for channel in &flight.channels {
            by_name.entry(&channel.channel).or_default().push((&flight.flight, channel));
        }
    }
    let rows = by_name.iter().map(|(name, own)| {
        let most =
            |of: fn(&ChannelCheck) -> f64| own.iter().map(|(_, c)| of(c)).fold(0.0, f64::max);
        let rates = own.iter().map(|(_, c)| c.rate_hz);
        let low = rates.clone().fold(f64::INFINITY, f64::min);
        let high = rates.fold(0.0, f64::max);
        let same = figure(low) == figure(high);
        let rate = if same { figure(low) } else { format!("{} to {}", figure(low), figure(high)) };
        let gap = own.iter().max_by(|a, b| a.1.largest_gap_s.total_cmp(&b.1.largest_gap_s));
        let gap = gap.map_or_else(String::new, |(flight, c)| {
            if c.largest_gap_s * c.rate_hz < PERIODS {
                return figure(c.largest_gap_s);
            }
            let at = format!("at {:.2} s", c.largest_gap_at_s);
            let at = if all.len() > 1 { format!("{}, {at}", short(flight)) } else { at };
            format!("{} ({at})", figure(c.largest_gap_s))
        });
        Row {
            ink: None,
            cells: vec![
                (*name).to_owned(),
                format!("{} of {}", own.len(), all.len()),
                rate,
                gap,
                percent(most(|c| c.held_share)),
                figure(most(|c| c.longest_held_s)),
                percent(most(|c| c.missing_share)),
            ],
        }
    });
    let names = [
        "channel",
        "flights",
        "rate Hz",
        "largest gap s",
        "held samples",
        "longest held s",
        "missing",
    ];
    page.table(&head(&names), &rows.collect::<Vec<_>>());
}

/// Sizes of one effect as parts of the largest plausible one.
fn chart(page: &mut Page, all: &[EffectCheck]) {
    let mut axis = Axis::new("size over the largest plausible one", "");
    axis.range = Range::Exact(0.0, 1.0);
    let mut chart = RowChart::new("sizes of each effect that the flights could show", WIDTH, axis);
    for effect in all {
        let decisive = effect.decisive();
        let part = |size: Option<f64>, largest: f64| size.map_or(1.0, |s| (s / largest).min(1.0));
        let bars = decisive.map_or_else(Vec::new, |number| {
            let never = part(number.not_shown_below, number.largest);
            let from = part(number.smallest_shown, number.largest).max(never);
            let zones = [
                (0.0, never, Ink::Muted, "not named"),
                (never, from, Ink::Highlight, "chance"),
                (from, 1.0, Ink::Series(0), "named"),
            ];
            let drawn = zones.into_iter().filter(|(from, to, ..)| to > from);
            drawn
                .map(|(from, to, ink, name)| Extent { from, to, ink, name: name.to_owned() })
                .collect()
        });
        let note = match (effect.shown, decisive) {
            (Shows::Can, Some(number)) => {
                format!(
                    "from {} {}",
                    number.smallest_shown.map_or_else(String::new, figure),
                    number.key
                )
            }
            _ => "cannot".to_owned(),
        };
        chart.rows.push(ChartRow {
            label: effect.name.to_owned(),
            note,
            bars,
            ..ChartRow::default()
        });
    }
    page.figures(Columns::One, &[Figure { drawings: vec![chart.svg()], ..Figure::default() }]);
}

fn effects(page: &mut Page, all: &[EffectCheck]) {
    let mut rows = Vec::new();
    for effect in all {
        let told = |words: Vec<String>| {
            let mut cells = vec![effect.name.to_owned()];
            cells.extend(words);
            cells
        };
        let not_told = effect.not_told_from.join(", ");
        let remedy = effect.lacks.clone().or(effect.fly.map(str::to_owned)).unwrap_or_default();
        if effect.numbers.is_empty() {
            let dash = || "\u{2013}".to_owned();
            let words = vec![dash(), "cannot".to_owned(), dash(), dash(), dash(), not_told, remedy];
            rows.push(Row { ink: None, cells: told(words) });
            continue;
        }
        for (i, number) in effect.numbers.iter().enumerate() {
            let words =
                if i == 0 { [not_told.clone(), remedy.clone()] } else { Default::default() };
            rows.push(Row {
                ink: None,
                cells: told(sizes(number).into_iter().chain(words).collect()),
            });
        }
    }
    let names = [
        "effect",
        "number",
        "shown",
        "smallest shown",
        "of its typical size",
        "not shown below",
        "cannot be told from",
        "what is lacking, or what to fly",
    ];
    page.table(&head(&names), &rows);
}

fn sizes(number: &NumberCheck) -> Vec<String> {
    let place = number.place();
    let key =
        if place.is_empty() { number.key.to_owned() } else { format!("{} ({place})", number.key) };
    let or_none = |size: Option<f64>| size.map_or_else(|| "no size".to_owned(), figure);
    vec![
        key,
        if number.can_be_shown() { "can" } else { "cannot" }.to_owned(),
        or_none(number.smallest_shown),
        or_none(number.smallest_shown_of_typical),
        or_none(number.not_shown_below),
    ]
}
