//! Proof: errors on flights that were not used, and whether what is left is noise.

use super::{Errors, HeldOut, Horizon, ReportData, Whiteness, figure, lacking, quantity};
use squirrel_report::chart::{
    Axis, ChartRow, Dot, Extent, Ink, Limit, LineChart, Range, RowChart, Series, Svg, drawable,
};
use squirrel_report::page::{Columns, Figure, Page, Row};

/// The models with their colours, in the order of [`parts`].
const INKS: [Ink; 4] = [Ink::Series(1), Ink::Series(5), Ink::Series(0), Ink::Muted];
/// Place of the rival among them.
const RIVAL: usize = 1;

fn parts(e: &Errors) -> [f64; 4] {
    [e.nominal, e.rival, e.fitted, e.floor]
}

fn names(held_out: &HeldOut) -> [String; 4] {
    let rival = if held_out.rival.is_empty() {
        "best rival".to_owned()
    } else {
        format!("best rival ({})", held_out.rival)
    };
    ["nominal".to_owned(), rival, "fitted".to_owned(), "noise floor".to_owned()]
}

pub(super) fn held_out(page: &mut Page, data: &ReportData) {
    let text = "Re-simulation with logged commands of flights that were not used to find the answer. Look for the distance \
                from the best rival: a wrong name also shrinks the gap, the right one shrinks it to the noise floor.";
    page.panel("panel-d", "Held-out flights", text, |page| {
        let Some(held_out) = &data.held_out else {
            lacking(
                page,
                data,
                "No held-out flight was given: nothing proves the answer on data that it has not seen.",
            );
            return;
        };
        if !held_out.flights.is_empty() {
            page.text(&format!("Flights: {}.", held_out.flights.join(", ")));
        }
        if held_out.channels.is_empty() && held_out.horizons.is_empty() {
            page.missing(
                "These flights cannot be re-simulated: that needs attitude and velocity throughout.",
            );
            return;
        }
        page.figures(Columns::Two, &[by_channel(held_out), by_horizon(held_out)]);
        if held_out.channels.is_empty() {
            return;
        }
        let each = held_out.channels.iter().filter(|c| !c.horizons.is_empty()).map(|c| {
            let y = Axis::new("RMSE", &c.unit).with_range(Range::Including(0.0, 0.0));
            // The legend stands above.
            let names = [const { String::new() }; 4];
            let drawings = vec![over_horizon(&c.name, names, &c.horizons, y, Columns::Three)];
            Figure { title: c.name.clone(), drawings, ..Figure::default() }
        });
        page.figures(Columns::Three, &each.collect::<Vec<_>>());
        let last = held_out.horizons.last();
        let head =
            last.map_or_else(|| "RMSE".to_owned(), |h| format!("RMSE at {}", quantity(h.horizon_s, "s")));
        // Without a rival there is no column for it.
        let shown = |i: &usize| *i != RIVAL || !held_out.rival.is_empty();
        let shown: Vec<usize> = (0..INKS.len()).filter(shown).collect();
        let names = names(held_out);
        let head = std::iter::once(head).chain(shown.iter().map(|i| names[*i].clone())).collect::<Vec<_>>();
        let rows = held_out.channels.iter().map(|c| {
            let errors = parts(&c.errors);
            let cells = shown.iter().map(|i| quantity(errors[*i], &c.unit));
            Row { ink: None, cells: std::iter::once(c.name.clone()).chain(cells).collect() }
        });
        page.table(&head, &rows.collect::<Vec<_>>());
        closed_loop(page, data);
    });
}

/// Flights that the flight code flew again, in a table.
fn closed_loop(page: &mut Page, data: &ReportData) {
    if data.closed_loop.is_empty() {
        return;
    }
    page.text(
        "The same flights flown again in closed loop by the flight code of the log: root mean square of simulated less \
         measured position over the whole flight.",
    );
    let axes = ["north", "east", "down"];
    let columns =
        axes.iter().flat_map(|axis| ["nominal", "fitted"].map(|model| format!("{axis}, {model}")));
    let head: Vec<String> = std::iter::once("flight".to_owned()).chain(columns).collect();
    let rows = data.closed_loop.iter().map(|again| {
        let pairs = again.before_ned_m.iter().zip(&again.after_ned_m);
        let cells = pairs.flat_map(|(before, after)| [before, after].map(|x| quantity(*x, "m")));
        Row { ink: None, cells: std::iter::once(again.flight.clone()).chain(cells).collect() }
    });
    page.table(&head, &rows.collect::<Vec<_>>());
}

fn by_channel(held_out: &HeldOut) -> Figure {
    let mut figure = Figure { title: "Error of each channel".to_owned(), ..Figure::default() };
    if held_out.channels.is_empty() {
        figure.notes.push("No channels were given.".to_owned());
        return figure;
    }
    let axis = Axis::new("RMSE over nominal", "%").with_range(Range::Including(0.0, 100.0));
    let mut chart = RowChart::new("held-out error of each channel", Columns::Two.width(), axis);
    for c in &held_out.channels {
        let share = |x: f64| 100.0 * x / c.errors.nominal;
        let [nominal, rival, fitted, floor] = names(held_out);
        let dot = |at: f64, i: usize, name: String| Dot { at: share(at), ink: INKS[i], name };
        let dots = [
            dot(c.errors.nominal, 0, nominal),
            dot(c.errors.rival, 1, rival),
            dot(c.errors.fitted, 2, fitted),
        ];
        chart.rows.push(ChartRow {
            label: c.name.clone(),
            bars: vec![Extent { from: 0.0, to: share(c.errors.floor), ink: INKS[3], name: floor }],
            dots: dots.into_iter().filter(|d| drawable(d.at)).collect(),
            ..ChartRow::default()
        });
    }
    figure.drawings.push(chart.svg());
    figure
}

fn by_horizon(held_out: &HeldOut) -> Figure {
    let mut figure = Figure {
        title: "Error over the length of the re-simulation".to_owned(),
        ..Figure::default()
    };
    if held_out.horizons.is_empty() {
        figure.notes.push("No horizons were given.".to_owned());
        return figure;
    }
    let y = Axis::new("RMSE over noise floor", "").with_range(Range::Including(0.0, 1.0));
    let label = "held-out error over horizon";
    figure.drawings.push(over_horizon(label, names(held_out), &held_out.horizons, y, Columns::Two));
    figure
}

fn over_horizon(
    label: &str,
    names: [String; 4],
    horizons: &[Horizon],
    y: Axis,
    columns: Columns,
) -> Svg {
    let mut chart = LineChart::new(label, Axis::new("horizon", "s"), y);
    chart.width = columns.width();
    chart.x.range = Range::Including(0.0, 0.0);
    let at: Vec<f64> = horizons.iter().map(|h| h.horizon_s).collect();
    for (i, (ink, name)) in INKS.into_iter().zip(names).enumerate() {
        let values: Vec<f64> = horizons.iter().map(|h| parts(&h.errors)[i]).collect();
        if values.iter().any(|x| drawable(*x)) {
            chart.series.push(Series::line(&name, ink, at.clone(), values));
        }
    }
    chart.svg()
}

pub(super) fn whiteness(page: &mut Page, data: &ReportData) {
    let text = "Correlation of what is left with itself and with the inputs; dashed is the band that holds 99 % of the \
                correlations of white noise. Look for inputs outside the band: there the model still lacks something. Slow \
                noise alone gives an autocorrelation outside it.";
    page.panel("panel-e", "What is left", text, |page| {
        if data.whiteness.is_empty() {
            lacking(
                page,
                data,
                "No residual after the fit was given: whether what is left is noise is not known.",
            );
            return;
        }
        for w in &data.whiteness {
            page.figures(Columns::Two, &[own(w), with_inputs(w)]);
        }
    });
}

fn band(chart: &mut LineChart, w: &Whiteness) {
    chart.plot_height = 110.0;
    for y in [w.band_99, -w.band_99] {
        chart.limits.push(Limit { y, label: String::new() });
    }
}

fn lags(w: &Whiteness, first: usize, count: usize) -> Vec<f64> {
    (first..first + count).map(|k| k as f64 * w.lag_s).collect()
}

fn own(w: &Whiteness) -> Figure {
    let mut figure_of =
        Figure { title: format!("{}: autocorrelation", w.channel), ..Figure::default() };
    if w.autocorrelation.is_empty() {
        figure_of.notes.push("No autocorrelation was given.".to_owned());
    } else {
        let y = Axis::new("correlation", "").with_range(Range::Including(-0.2, 0.2));
        let mut chart = LineChart::new(&figure_of.title, Axis::new("lag", "s"), y);
        let at = lags(w, 1, w.autocorrelation.len());
        let zero = vec![0.0; at.len()];
        chart.series.push(Series::strokes("", Ink::Series(0), &at, &zero, &w.autocorrelation));
        chart.x.range = Range::Including(0.0, 0.0);
        band(&mut chart, w);
        figure_of.drawings.push(chart.svg());
    }
    let outside = w.autocorrelation.iter().filter(|x| x.abs() > w.band_99).count();
    figure_of.caption = format!(
        "{outside} of {} lags outside the band of {}; Ljung-Box Q({}) = {}, p = {}.",
        w.autocorrelation.len(),
        figure(w.band_99),
        w.ljung_box_lags,
        figure(w.ljung_box),
        figure(w.ljung_box_p),
    );
    figure_of
}

fn with_inputs(w: &Whiteness) -> Figure {
    let mut figure_of =
        Figure { title: format!("{}: correlation with inputs", w.channel), ..Figure::default() };
    if w.inputs.is_empty() {
        figure_of.notes.push("No inputs were given.".to_owned());
        return figure_of;
    }
    // The title says what it is; the legend needs the line.
    let y = Axis::new("", "").with_range(Range::Including(-0.2, 0.2));
    let mut chart = LineChart::new(&figure_of.title, Axis::new("lag of the input", "s"), y);
    let mut largest: Vec<String> = Vec::new();
    for (i, input) in w.inputs.iter().enumerate() {
        let at = lags(w, 0, input.values.len());
        chart.series.push(Series::line(&input.input, Ink::Series(i), at, input.values.clone()));
        let size =
            input.values.iter().filter(|x| drawable(**x)).fold(0.0_f64, |a, x| a.max(x.abs()));
        largest.push(format!("{} {}", input.input, figure(size)));
    }
    band(&mut chart, w);
    figure_of.drawings.push(chart.svg());
    figure_of.caption = format!("Largest: {}.", largest.join(", "));
    figure_of
}
