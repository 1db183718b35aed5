//! Plans of one task as an HTML page: where they lead, how far the wings are spread, and what they
//! ask of rotors and attitude.

use super::task::{Plan, Task};
use nalgebra::Vector3;
use squirrel_report::chart::{Axis, Ink, Limit, LineChart, Range, Series};
use squirrel_report::flight::{FlightView, tracks};
use squirrel_report::page::{Columns, Figure, Page, Row};
use squirrel_sim::track::TrackPoint;

/// A plan with what stands beside it.
#[derive(Debug, Clone, Copy)]
pub struct Shown<'a> {
    /// Its tracks; the summary is its row of the table.
    pub view: &'a FlightView<'a>,
    /// What was asked for.
    pub task: &'a Task,
    /// What was planned.
    pub plan: &'a Plan,
}

/// The page. The same plans give the same bytes.
pub fn page(title: &str, facts: &[(String, String)], plans: &[Shown<'_>]) -> String {
    let mut page = Page::new(
        title,
        "What a plan makes of it that knows it all before: planned motion, not flown.",
    );
    page.facts(facts);
    page.section("Plans", "The same weights and limits; only the wings differ.");
    let heads = plans.first().map_or(&[][..], |shown| &shown.view.summary);
    let head: Vec<String> = std::iter::once("wings".to_owned())
        .chain(heads.iter().map(|(name, _)| name.clone()))
        .collect();
    let row = |(i, shown): (usize, &Shown<'_>)| {
        let cells = shown.view.summary.iter().map(|(_, value)| value.clone());
        Row {
            ink: Some(Ink::Series(i)),
            cells: std::iter::once(shown.view.arm.to_owned()).chain(cells).collect(),
        }
    };
    page.table(&head, &plans.iter().enumerate().map(row).collect::<Vec<_>>());
    let views: Vec<FlightView<'_>> = plans.iter().map(|shown| shown.view.clone()).collect();
    let inks: Vec<Ink> = (0..views.len()).map(Ink::Series).collect();
    tracks(&mut page, &views, &inks);
    page.section("Over time", "Look for wings that are spread while the thrust is at its limit.");
    let tilt = |point: &TrackPoint| {
        let up = -point.thrust;
        up.xy().norm().atan2(up.z).to_degrees()
    };
    let most_n = views.first().map_or(0.0, |view| view.thrust_max_n);
    page.figures(
        Columns::Two,
        &[
            over_time(plans, "deployment", "", None, &|_, point| point.wing),
            over_time(plans, "thrust", "N", Some(most_n), &|_, point| point.thrust.norm()),
            over_time(plans, "tilt", "deg", None, &|_, point| tilt(point)),
            over_time(plans, "distance to what was wanted", "m", None, &|wanted, point| {
                (point.position - wanted).norm()
            }),
        ],
    );
    page.html()
}

/// One number of every node.
fn over_time(
    plans: &[Shown<'_>],
    name: &str,
    unit: &str,
    most: Option<f64>,
    of: &dyn Fn(Vector3<f64>, &TrackPoint) -> f64,
) -> Figure {
    let y = Axis::new(name, unit).with_range(Range::Including(0.0, most.unwrap_or(1.0)));
    let mut chart = LineChart::new(&format!("{name} over time"), Axis::new("time", "s"), y);
    for (i, shown) in plans.iter().enumerate() {
        let numbers = shown.task.wanted().iter().zip(shown.plan.track.points());
        let numbers = numbers.map(|(wanted, point)| of(wanted.position, point)).collect();
        let time_s = shown.plan.track.time_s().to_vec();
        chart.series.push(Series::line(shown.view.arm, Ink::Series(i), time_s, numbers));
    }
    chart.limits.extend(most.map(|y| Limit { y, label: "limit".to_owned() }));
    Figure { title: name.to_owned(), drawings: vec![chart.svg()], ..Figure::default() }
}
