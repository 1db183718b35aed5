//! The residual over time and against what explains it.

use super::{Conditional, FlightPanel, ReportData, WIDTH, lacking};
use squirrel_report::chart::{
    Axis, HeatGroup, HeatMap, Ink, LineChart, Range, Series, Strip, Values, drawable,
};
use squirrel_report::page::{Columns, Figure, Page};

/// Most cells over time; longer flights show the root mean square of several windows in a cell.
const CELLS: usize = 160;
/// Full colour, in units of the predicted noise: what is beyond shouts loud enough.
const FULL: f64 = 6.0;

pub(super) fn over_time(page: &mut Page, data: &ReportData) {
    let text = "Residual of each channel in units of its predicted noise: about 1 is noise, 6 and more has full colour. Look \
                for what the dark stretches share in the strips below, and for what is still dark after.";
    page.panel("panel-a", "Where and when", text, |page| {
        if data.flights.is_empty() {
            lacking(page, data, "No flight was given.");
            return;
        }
        let figures = data.flights.iter().map(|f| flight(f, &data.channels)).collect::<Vec<_>>();
        page.figures(Columns::One, &figures);
    });
}

fn flight(flight: &FlightPanel, channels: &[String]) -> Figure {
    let rows = flight.before.iter().chain(&flight.after);
    let windows = rows.map(Vec::len).chain([flight.speed_m_s.len()]).max().unwrap_or(0);
    let mut figure = Figure { title: flight.name.clone(), ..Figure::default() };
    let span_s = flight.window_s * windows as f64;
    if !(span_s > 0.0 && drawable(span_s) && drawable(flight.start_s)) {
        figure.notes.push("No windows in this flight.".to_owned());
        return figure;
    }
    let each = windows.div_ceil(CELLS);
    let group = |title: &str, rows: &[Vec<f64>]| {
        let name =
            |i: usize| channels.get(i).cloned().unwrap_or_else(|| format!("channel {}", i + 1));
        let rows =
            rows.iter().enumerate().map(|(i, v)| (name(i), merged(v, each, |x| x * x, f64::sqrt)));
        HeatGroup { title: title.to_owned(), rows: rows.collect() }
    };
    let mut groups = Vec::new();
    for (title, rows, lack) in [
        ("before", &flight.before, "No residual before."),
        ("after", &flight.after, "No residual after: nothing was added to the model."),
    ] {
        if rows.is_empty() {
            figure.notes.push(lack.to_owned());
        } else {
            groups.push(group(title, rows));
        }
    }
    let strips = [
        ("speed", "m/s", &flight.speed_m_s),
        ("height", "m", &flight.height_m),
        ("wings", "", &flight.wings),
    ];
    let strips =
        strips.into_iter().filter(|(.., v)| !v.is_empty()).map(|(label, unit, values)| Strip {
            label: label.to_owned(),
            unit: unit.to_owned(),
            values: merged(values, each, |x| x, |x| x),
        });
    let scale = Axis::new("residual over noise", "").with_range(Range::Exact(0.0, FULL));
    let map = HeatMap {
        label: format!("residual of {} over time", flight.name),
        width: WIDTH,
        x: Axis::new("time", "s"),
        from: flight.start_s,
        cell: flight.window_s * each as f64,
        values: Values::new(&scale, std::iter::empty()),
        groups,
        strips: strips.collect(),
    };
    figure.drawings.push(map.svg());
    figure
}

/// Means of groups of `each` numbers; numbers that cannot be drawn are left out.
fn merged(
    values: &[f64],
    each: usize,
    into: impl Fn(f64) -> f64,
    back: impl Fn(f64) -> f64,
) -> Vec<f64> {
    let mean = |group: &[f64]| {
        let known: Vec<f64> = group.iter().filter(|x| drawable(**x)).map(|x| into(*x)).collect();
        if known.is_empty() {
            f64::NAN
        } else {
            back(known.iter().sum::<f64>() / known.len() as f64)
        }
    };
    values.chunks(each.max(1)).map(mean).collect()
}

pub(super) fn against_regressors(page: &mut Page, data: &ReportData) {
    let text = "Mean residual in bins of what a unit of the named effect does to the channel, or of the quantity that a leftover \
                follows; strokes are one standard deviation. Look for a slope before that is flat after: it is the size of the \
                effect.";
    page.panel("panel-c", "Against what explains it", text, |page| {
        let (drawn, empty): (Vec<_>, Vec<_>) =
            data.conditional.iter().partition(|c| !c.bins.is_empty());
        if drawn.is_empty() {
            lacking(
                page,
                data,
                "No regressor was given: nothing was named that could explain the residual.",
            );
        } else {
            page.figures(Columns::Two, &drawn.into_iter().map(conditional).collect::<Vec<_>>());
        }
        for c in empty {
            page.missing(&format!("{} against {}: no samples.", c.channel, c.regressor));
        }
    });
}

fn conditional(c: &Conditional) -> Figure {
    let mut chart = LineChart::new(
        &format!("{} against {}", c.channel, c.regressor),
        Axis::new(&c.regressor, &c.regressor_unit),
        Axis::new(&c.channel, &c.unit),
    );
    let at: Vec<f64> = c.bins.iter().map(|b| b.at).collect();
    let before: Vec<[f64; 2]> = c.bins.iter().map(|b| [b.before_mean, b.before_sd]).collect();
    let after: Vec<[f64; 2]> = c.bins.iter().map(|b| [b.after_mean, b.after_sd]).collect();
    let mut notes = Vec::new();
    for (name, ink, points) in
        [("before", Ink::Series(1), before), ("after", Ink::Series(0), after)]
    {
        if points.iter().all(|[mean, _]| !drawable(*mean)) {
            notes.push(format!("No residual {name}."));
            continue;
        }
        let column =
            |sign: f64| points.iter().map(|[mean, sd]| mean + sign * sd).collect::<Vec<_>>();
        let strokes = Series::strokes("", ink, &at, &column(-1.0), &column(1.0));
        chart.series.push(Series { pale: true, ..strokes });
        let mean = points.iter().map(|[mean, _]| *mean).collect();
        chart.series.push(Series::line(name, ink, at.clone(), mean));
    }
    let samples: usize = c.bins.iter().map(|b| b.count).sum();
    Figure {
        title: format!("{} against {}", c.channel, c.regressor),
        caption: format!("{samples} samples in {} bins.", c.bins.len()),
        drawings: vec![chart.svg()],
        notes,
    }
}
