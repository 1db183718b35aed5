//! The first screen: five answers that a pilot can act on, and a picture of the worst channel
//! before and after.

use super::{FlightPanel, ReportData};
use crate::words::spoken;
use squirrel_report::chart::{Axis, Ink, Limit, LineChart, Range, Series, drawable};
use squirrel_report::page::{Card, Figure, Page};

/// Size of the picture, px.
const WIDTH: f64 = 400.0;
const PLOT_HEIGHT: f64 = 250.0;
/// Part of its residual that a channel may keep and still be helped.
const HELPED: f64 = 0.7;
/// Remarks about flights that were set aside; the verdict below and its notes have all.
const REMARKS: usize = 2;

pub(super) fn screen(page: &mut Page, data: &ReportData) {
    if data.screen.is_empty() {
        return page.panel("answers", "Answers", "", |page| page.missing("No verdict was given."));
    }
    let cards = data.screen.iter().map(|answer| Card {
        question: answer.question.clone(),
        answer: answer.answer.clone(),
        figure: answer.figure.clone(),
        figure_note: answer.figure_note.clone(),
        sentences: answer.sentences.clone(),
    });
    let mut remarks: Vec<String> =
        data.set_aside.iter().take(REMARKS).map(|words| format!("Set aside: {words}")).collect();
    if data.set_aside.len() > REMARKS {
        remarks.push(format!("Set aside: {} more flights.", data.set_aside.len() - REMARKS));
    }
    let picture = shown(data).map(|(flight, channel, why)| picture(data, flight, channel, why));
    page.cards("answers", &cards.collect::<Vec<_>>(), picture.as_slice(), &remarks);
}

/// The flight and channel that the answer helps most, in units of its noise, of the channels that
/// it acts on; where it helps none, the worst. What floats inside tolerances helps other channels,
/// too.
fn shown(data: &ReportData) -> Option<(&FlightPanel, usize, &'static str)> {
    let acts = |channel: &usize| {
        let name = data.channels.get(*channel);
        name.is_some_and(|name| data.conditional.iter().any(|c| c.channel == *name))
    };
    let known = (0..data.channels.len()).any(|channel| acts(&channel));
    let all = || {
        let drawn = data.flights.iter().filter(|f| drawable(f.window_s) && drawable(f.start_s));
        drawn.flat_map(|f| (0..f.before.len()).map(move |i| (f, i)))
    };
    let before = |(flight, channel): &(&FlightPanel, usize)| mean(&flight.before[*channel]);
    let after = |(flight, channel): &(&FlightPanel, usize)| {
        flight.after.get(*channel).map_or(f64::NAN, |row| mean(row))
    };
    let largest = |of: &dyn Fn(&(&FlightPanel, usize)) -> f64, among: &dyn Fn(&usize) -> bool| {
        let drawn = all().filter(|at| among(&at.1) && drawable(of(at)));
        drawn.reduce(|best, at| if of(&at) > of(&best) { at } else { best })
    };
    let gain = |at: &(&FlightPanel, usize)| before(at) - after(at);
    let helped = largest(&gain, &|channel| !known || acts(channel));
    match helped.filter(|at| after(at) < HELPED * before(at)) {
        Some((flight, channel)) => Some((flight, channel, "Where the answer acts")),
        None => largest(&before, &|_| true)
            .map(|(flight, channel)| (flight, channel, "Where they differ most")),
    }
}

/// Mean of what can be drawn; NaN without.
fn mean(row: &[f64]) -> f64 {
    let known: Vec<f64> = row.iter().copied().filter(|x| drawable(*x)).collect();
    known.iter().sum::<f64>() / known.len() as f64
}

fn picture(data: &ReportData, flight: &FlightPanel, channel: usize, why: &str) -> Figure {
    let name =
        data.channels.get(channel).map_or_else(|| "a channel".to_owned(), |name| spoken(name));
    let axis = Axis::new("error over noise", "").with_range(Range::Including(0.0, 2.0));
    let mut chart = LineChart::new(
        &format!("{name} of {} over time, before and after", flight.name),
        Axis::new("time", "s"),
        axis,
    );
    (chart.width, chart.plot_height) = (WIDTH, PLOT_HEIGHT);
    chart.limits.push(Limit { y: 1.0, label: "noise".to_owned() });
    let rows = [
        ("before", Ink::Series(1), Some(&flight.before)),
        ("after", Ink::Series(0), Some(&flight.after)),
    ];
    for (name, ink, rows) in rows {
        if let Some(row) = rows.and_then(|rows| rows.get(channel)) {
            let at = (0..row.len()).map(|k| flight.start_s + (k as f64 + 0.5) * flight.window_s);
            chart.series.push(Series::line(name, ink, at.collect(), row.clone()));
        }
    }
    let after = if flight.after.is_empty() { "; nothing was added to the model" } else { "" };
    Figure {
        title: format!("{why}: {name}"),
        caption: format!("{}, root mean square by window{after}.", flight.name),
        drawings: vec![chart.svg()],
        ..Figure::default()
    }
}
