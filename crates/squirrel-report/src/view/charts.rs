//! Plots beside the scene, of the same numbers.

use super::scene::{Scene, SceneFlight};
use crate::chart::{Axis, Ink, LineChart, Range, Series};
use crate::page::Figure;

/// Width of a plot, px.
const WIDTH: f64 = 400.0;

/// A number of each instant, from the rows of a track.
type Number = fn(&[f64]) -> f64;

/// A plot: its heading, axis, and curves by track, with a name each where a flight has several.
struct Plot {
    title: &'static str,
    axis: Axis,
    /// Track, number, dashed.
    curves: &'static [(&'static str, Number, bool)],
}

fn plots() -> [Plot; 5] {
    let from = |axis: Axis, lo, hi| axis.with_range(Range::Including(lo, hi));
    [
        Plot {
            title: "Wings",
            axis: from(Axis::new("deployment", ""), 0.0, 1.0),
            curves: &[
                ("wing_command", |w| f64::midpoint(w[0], w[1]), true),
                ("deployment", |w| f64::midpoint(w[0], w[1]), false),
            ],
        },
        Plot {
            title: "Speed",
            axis: from(Axis::new("speed", "m/s"), 0.0, 0.1),
            curves: &[("velocity", |v| v[0].hypot(v[1]).hypot(v[2]), false)],
        },
        Plot {
            title: "Height",
            axis: Axis::new("height", "m"),
            curves: &[("reference", |p| -p[2], true), ("position", |p| -p[2], false)],
        },
        Plot {
            title: "Tilt",
            axis: from(Axis::new("tilt", "deg"), 0.0, 10.0),
            curves: &[("attitude", tilt_deg, false)],
        },
        Plot {
            title: "Thrust",
            axis: from(Axis::new("thrust", "N"), 0.0, 0.1),
            curves: &[("thrust", |t| t.iter().sum(), false)],
        },
    ]
}

/// Angle between body z and world z, deg.
fn tilt_deg(q: &[f64]) -> f64 {
    (2.0 * q[1].hypot(q[2]).atan2(q[0].hypot(q[3]))).to_degrees()
}

/// The plots for which at least one flight has numbers.
pub(super) fn figures(scene: &Scene) -> Vec<Figure> {
    let [begin, end] = scene.range_s;
    let drawn = plots().into_iter().filter_map(|plot| {
        let x = Axis::new("time", "s").with_range(Range::Exact(begin, end));
        let mut chart = LineChart::new(&format!("{} over time", plot.title), x, plot.axis);
        chart.width = WIDTH;
        chart.plot_height = 82.0;
        chart.link = Some("time");
        for (i, flight) in scene.flights.iter().enumerate() {
            for &(track, number, dashed) in plot.curves {
                chart.series.extend(series(flight, i, track, number, dashed));
            }
        }
        (!chart.series.is_empty()).then(|| Figure {
            title: plot.title.to_owned(),
            caption: String::new(),
            drawings: vec![chart.svg()],
            notes: Vec::new(),
        })
    });
    drawn.collect()
}

fn series(
    flight: &SceneFlight,
    i: usize,
    track: &str,
    number: Number,
    dashed: bool,
) -> Option<Series> {
    let rows = flight.tracks.get(track)?.rows();
    let x = (0..rows.len()).map(|k| flight.clock.time_s(k) - flight.shift_s).collect();
    // What was asked for is behind what was done.
    let ink = if dashed { Ink::Muted } else { Ink::Series(i) };
    let line = Series::line("", ink, x, rows.iter().map(|row| number(row)).collect());
    Some(Series { dashed, ..line })
}
