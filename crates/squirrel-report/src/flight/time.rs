//! What the arms did over time: tilt, thrust, wings and error, all on one time axis.

use super::curves::{Curve, Errors, Lack, errors, followed, scalar, speed, tilt_deg, wings};
use super::{FlightView, columns_for, is_limit, lacks};
use crate::chart::{Axis, Ink, Lane, Limit, LineChart, Range, Series, Span, extent};
use crate::page::{Columns, Figure, Page};

/// The flights and the time axis that all charts share.
struct Time<'a> {
    flights: &'a [FlightView<'a>],
    range_s: (f64, f64),
}

/// Adds the panels.
pub(super) fn add(page: &mut Page, flights: &[FlightView<'_>]) {
    let times = || {
        flights.iter().flat_map(|f| f.log.sources.values()).flat_map(|s| s.time_s.iter().copied())
    };
    let time = Time { flights, range_s: extent(times()).unwrap_or((0.0, 1.0)) };

    page.section("Limits", "");
    page.figures(Columns::Two, &[time.tilt(), time.thrust()]);
    let wings = "Look for wings that open while the flag says they help, and for what the outer loop did meanwhile: the \
                 line is the mean deployment of both wings, the steps are the command.";
    let error = "Look for the arm that is nearest to the reference at the end of the turn, and what it paid in height.";
    if let [flight] = flights {
        page.section("Wings and speed", wings);
        page.figures(
            Columns::Two,
            &[time.wings(0, flight, Columns::Two), time.speed(Columns::Two)],
        );
        page.section("Tracking error", error);
        page.figures(Columns::Three, &time.errors(Columns::Three));
        return;
    }
    let columns = columns_for(flights.len());
    page.section("Wings", wings);
    let figures =
        flights.iter().enumerate().map(|(i, f)| time.wings(i, f, columns)).collect::<Vec<_>>();
    page.figures(columns, &figures);
    page.section("Tracking error", error);
    let mut figures = time.errors(Columns::Two).to_vec();
    figures.push(time.speed(Columns::Two));
    page.figures(Columns::Two, &figures);
}

impl Time<'_> {
    fn chart(&self, label: &str, columns: Columns, y: Axis) -> LineChart {
        let (from, to) = self.range_s;
        let mut chart =
            LineChart::new(label, Axis::new("time", "s").with_range(Range::Exact(from, to)), y);
        chart.width = columns.width();
        chart.link = Some("time");
        chart
    }

    /// Adds a curve of each arm, or a note on what its log lacks.
    fn all(
        &self,
        chart: &mut LineChart,
        notes: &mut Vec<String>,
        read: impl Fn(&FlightView<'_>) -> Result<Curve, Lack>,
    ) {
        for (i, flight) in self.flights.iter().enumerate() {
            match read(flight) {
                Ok(curve) => {
                    chart.series.push(Series::line(
                        flight.arm,
                        Ink::Series(i),
                        curve.time_s,
                        curve.values,
                    ));
                }
                Err(lack) => notes.push(lacks(flight, &lack)),
            }
        }
    }

    fn tilt(&self) -> Figure {
        let y = Axis::new("tilt", "deg").with_range(Range::Including(0.0, 10.0));
        let (mut chart, mut notes) = (self.chart("tilt over time", Columns::Two, y), Vec::new());
        self.all(&mut chart, &mut notes, |flight| tilt_deg(flight.log));
        let limits = self.flights.iter().map(|f| (f.tilt_max_rad, f.tilt_max_rad.to_degrees()));
        chart.limits = distinct_limits(limits, "deg");
        let caption = "Look for arms that sit at the limit: they ask for more sideways force than tilt can give.";
        figure("Tilt", caption, &chart, notes)
    }

    fn thrust(&self) -> Figure {
        let y = Axis::new("thrust", "N");
        let (mut chart, mut notes) =
            (self.chart("collective thrust over time", Columns::Two, y), Vec::new());
        for (i, flight) in self.flights.iter().enumerate() {
            match scalar(flight.log, "control.inner.thrust_n") {
                Ok(c) => {
                    let line = Series::line("", Ink::Series(i), c.time_s, c.values);
                    chart.series.push(Series { pale: true, ..line });
                }
                Err(lack) => notes.push(lacks(flight, &lack)),
            }
        }
        for (i, flight) in self.flights.iter().enumerate() {
            match scalar(flight.log, "control.outer.thrust_command_n") {
                Ok(c) => {
                    chart.series.push(Series::steps(
                        flight.arm,
                        Ink::Series(i),
                        c.time_s,
                        c.values,
                    ));
                }
                Err(lack) => notes.push(lacks(flight, &lack)),
            }
        }
        chart.limits =
            distinct_limits(self.flights.iter().map(|f| (f.thrust_max_n, f.thrust_max_n)), "N");
        let caption = "Look for commands that reach the limit: there the vehicle sinks; steps are the outer loop, thin \
                       lines the inner loop.";
        figure("Collective thrust command", caption, &chart, notes)
    }

    fn wings(&self, i: usize, flight: &FlightView<'_>, columns: Columns) -> Figure {
        let y = Axis::new("deployment", "").with_range(Range::Including(0.0, 1.0));
        let mut chart =
            self.chart(&format!("{}: wings, flag and mode over time", flight.arm), columns, y);
        chart.plot_height = 130.0;
        let mut notes = Vec::new();
        let mut note = |lack: &Lack| notes.push(lacks(flight, lack));
        match wings(flight.log, "wing.command") {
            Ok(c) => chart.series.push(Series::steps("command", Ink::Muted, c.time_s, c.values)),
            Err(lack) => note(&lack),
        }
        match wings(flight.log, "wing.deployment") {
            Ok(c) => chart.series.push(Series::line("wings", Ink::Series(i), c.time_s, c.values)),
            Err(lack) => note(&lack),
        }
        match scalar(flight.log, "control.outer.flag") {
            Ok(c) => chart.spans = flags(&c),
            Err(lack) => note(&lack),
        }
        match scalar(flight.log, "control.outer.mode") {
            Ok(c) => chart.lanes.push(lane(&c)),
            Err(lack) => note(&lack),
        }
        figure(flight.arm, "", &chart, notes)
    }

    fn errors(&self, columns: Columns) -> [Figure; 3] {
        let read = self.flights.iter().map(|f| errors(f.log)).collect::<Vec<_>>();
        let panel = |title: &str, caption: &str, y: Axis, pick: fn(&Errors) -> &Vec<f64>| {
            let (mut chart, mut notes) = (self.chart(title, columns, y), Vec::new());
            for (i, (flight, errors)) in self.flights.iter().zip(&read).enumerate() {
                match errors {
                    Ok(e) => {
                        let line = Series::line(
                            flight.arm,
                            Ink::Series(i),
                            e.time_s.clone(),
                            pick(e).clone(),
                        );
                        chart.series.push(line);
                    }
                    Err(lack) => notes.push(lacks(flight, lack)),
                }
            }
            figure(title, caption, &chart, notes)
        };
        let distance = || Axis::new("error", "m").with_range(Range::Including(0.0, 0.1));
        [
            panel("3-D error", "Distance to the reference.", distance(), |e| &e.distance_m),
            panel("Horizontal error", "The part that avoids the obstacle.", distance(), |e| {
                &e.horizontal_m
            }),
            panel(
                "Height error",
                "Above zero is too high; look for sinking while the wings are open.",
                Axis::new("error", "m").with_range(Range::Including(-0.1, 0.1)),
                |e| &e.height_m,
            ),
        ]
    }

    fn speed(&self, columns: Columns) -> Figure {
        let y = Axis::new("speed", "m/s");
        let (mut chart, mut notes) = (self.chart("speed over time", columns, y), Vec::new());
        for flight in self.flights {
            match speed(flight.log, followed(flight.log)) {
                // All arms fly the same reference: one line stands for all.
                Ok(c) if chart.series.is_empty() => {
                    let line = Series::line("reference", Ink::Reference, c.time_s, c.values);
                    chart.series.push(Series { dashed: true, ..line });
                }
                Ok(_) => {}
                Err(lack) => notes.push(lacks(flight, &lack)),
            }
        }
        self.all(&mut chart, &mut notes, |flight| speed(flight.log, "truth"));
        figure("Speed", "Look for arms that brake where the reference does not.", &chart, notes)
    }
}

fn figure(title: &str, caption: &str, chart: &LineChart, notes: Vec<String>) -> Figure {
    // A frame without a curve says nothing that the notes do not say.
    let empty = chart.series.is_empty() && chart.spans.is_empty() && chart.lanes.is_empty();
    let drawings = if empty { Vec::new() } else { vec![chart.svg()] };
    Figure { title: title.to_owned(), caption: caption.to_owned(), drawings, notes }
}

/// One line for each different limit; pairs of the limit as stored and as drawn.
fn distinct_limits(limits: impl Iterator<Item = (f64, f64)>, unit: &str) -> Vec<Limit> {
    let mut lines: Vec<Limit> = Vec::new();
    for (_, y) in limits.filter(|(stored, _)| is_limit(*stored)) {
        if lines.iter().all(|line| line.y != y) {
            let digits = format!("{y:.2}");
            let digits = digits.trim_end_matches('0').trim_end_matches('.');
            lines.push(Limit { y, label: format!("limit {digits} {unit}") });
        }
    }
    lines
}

/// The stretches of a curve that have a meaning, as coloured spans.
fn spans(curve: &Curve, meaning: impl Fn(f64) -> Option<(Ink, &'static str)>) -> Vec<Span> {
    let stretches = curve.stretches().into_iter();
    let named = stretches.filter_map(|(from, to, value)| meaning(value).map(|m| (from, to, m)));
    named.map(|(from, to, (ink, name))| Span { from, to, ink, name: name.to_owned() }).collect()
}

/// A span of no length: names a state that may never come, so that the legends, and the plots below
/// them, align from arm to arm.
fn never(ink: Ink, name: &str) -> Span {
    Span { from: 0.0, to: 0.0, ink, name: name.to_owned() }
}

/// When the outer loop found that wings would help.
fn flags(flag: &Curve) -> Vec<Span> {
    let (ink, name) = (Ink::Highlight, "flag");
    let on = spans(flag, |value| (value > 0.5).then_some((ink, name)));
    std::iter::once(never(ink, name)).chain(on).collect()
}

/// What the outer loop did: 0 position control, 1 wings in control, 2 thrust at its limit.
fn lane(modes: &Curve) -> Lane {
    let inks = [(Ink::Muted, "pc"), (Ink::Reference, "wiic"), (Ink::Limit, "thrust limit")];
    let meaning = |mode: f64| (0..inks.len()).find(|&i| i as f64 == mode).map(|i| inks[i]);
    let names = inks.map(|(ink, name)| never(ink, name));
    Lane {
        label: "mode".to_owned(),
        spans: names.into_iter().chain(spans(modes, meaning)).collect(),
    }
}
