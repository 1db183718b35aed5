//! What wings are worth as a function of thrust, as a page.

use super::{PAPER_GAIN, Point, Thrust, words};
use crate::pages::{begin, facts, figure, ink, numbers};
use crate::statistics::Estimate;
use crate::tracking::Row;
use squirrel_report::chart::{Axis, Limit, LineChart, Range, Series, Svg};
use squirrel_report::page::{Columns, Figure};
use squirrel_sim::arm::Arm;

/// Up to this ratio thrust is scarce, and points lie near one another.
const SCARCE: f64 = 1.5;

/// Thrust-to-weight ratios as a page without network.
pub fn page(study: &Thrust) -> String {
    let lead = "What wings are worth as a function of the effective thrust-to-weight ratio: the avoidance manoeuvre, 7.3 m/s, R_d 4 m, a \
                turn of 110 to 130 deg. Gain is the mean error of pc over that of the arm, minus 1.";
    let facts = facts(&study.vehicle, study.trials, study.seed);
    let mut page =
        begin("What wings are worth where thrust is scarce", lead, &facts, &words(study));
    let views = views(study);
    let figures = |draw: &dyn Fn(&View<'_>) -> Svg| -> Vec<Figure> {
        views.iter().map(|view| figure(view.title.to_owned(), String::new(), draw(view))).collect()
    };
    page.section(
        "Gain over pc",
        "By arm, with 95 % intervals as strokes, a little beside one another. limit: the flight code may ask for so much; \
         battery: one limit, and a battery that is emptier from flight to flight.",
    );
    page.figures(
        Columns::Two,
        &figures(&|view| view.by_arm("gain over pc", "%", &|row| Some(in_percent(row.gain)))),
    );
    page.section(
        "What wings add to the better law",
        "The gain of twcc_plus over pc_plus, which decides alike with its wings folded. Where the interval excludes zero, wings \
         are worth something to the best controller there is.",
    );
    page.figures(Columns::Two, &figures(&|view| view.over_pc_plus()));
    page.section("Height lost", "Mean of the largest sinks.");
    let height = |row: &Row| {
        let value = row.height_lost_m;
        Some(Estimate { value, low: f64::NAN, high: f64::NAN })
    };
    page.figures(Columns::Two, &figures(&|view| view.by_arm("height lost", "m", &height)));
    let rows = study.points.iter().flat_map(|point| {
        let charge =
            point.charge.map_or_else(|| "\u{2013}".to_owned(), |charge| format!("{charge:.2}"));
        let place = vec![point.series.to_owned(), format!("{:.2}", point.thrust_to_weight), charge];
        point.rows.iter().map(move |row| (place.clone(), row))
    });
    numbers(&mut page, &["series", "T/W", "charge"], rows);
    page.html()
}

fn in_percent(e: Estimate) -> Estimate {
    let [value, low, high] = [e.value, e.low, e.high].map(|x| 100.0 * x);
    Estimate { value, low, high }
}

/// Points of one chart.
struct View<'a> {
    title: &'static str,
    points: Vec<&'a Point>,
}

/// The limit where thrust is scarce, the limit all along, and the battery.
fn views(study: &Thrust) -> Vec<View<'_>> {
    let view = |title, series: &str, largest: f64| {
        let shown = |point: &&Point| point.series == series && point.thrust_to_weight <= largest;
        View { title, points: study.points.iter().filter(shown).collect() }
    };
    let all = [
        view("limit, scarce thrust", "limit", SCARCE + 1e-9),
        view("limit, all ratios", "limit", f64::INFINITY),
        view("battery", "battery", f64::INFINITY),
    ];
    all.into_iter().filter(|view| !view.points.is_empty()).collect()
}

impl View<'_> {
    fn chart(&self, figure: &str, unit: &str) -> LineChart {
        let axis = |name: &str, unit: &str| Axis::new(name, unit);
        let y = axis(figure, unit).with_range(Range::Including(0.0, 0.0));
        let mut chart = LineChart::new(
            &format!("{figure} over T/W, {}", self.title),
            axis("effective T/W", ""),
            y,
        );
        chart.width = Columns::Two.width();
        chart.plot_height = 240.0;
        chart
    }

    /// A figure of an arm at every point, with its interval as strokes that are moved by `aside` of
    /// the axis.
    fn add(
        &self,
        chart: &mut LineChart,
        arm: &str,
        aside: f64,
        figure: &dyn Fn(&Row) -> Option<Estimate>,
    ) {
        let found = self.points.iter().filter_map(|point| {
            let row = point.rows.iter().find(|row| row.arm == arm)?;
            Some((point.thrust_to_weight, figure(row)?))
        });
        let (x, found): (Vec<f64>, Vec<Estimate>) = found.unzip();
        let (first, last) = (x.first().copied().unwrap_or(0.0), x.last().copied().unwrap_or(0.0));
        let beside: Vec<f64> = x.iter().map(|x| x + aside * (last - first)).collect();
        let [value, low, high] =
            [|e: &Estimate| e.value, |e: &Estimate| e.low, |e: &Estimate| e.high]
                .map(|f| found.iter().map(f).collect());
        let (low, high): (Vec<f64>, Vec<f64>) = (low, high);
        if low.iter().any(|low| low.is_finite()) {
            chart.series.push(Series::strokes("", ink(arm), &beside, &low, &high));
        }
        chart.series.push(Series::line(arm, ink(arm), x, value));
    }

    fn by_arm(&self, name: &str, unit: &str, figure: &dyn Fn(&Row) -> Option<Estimate>) -> Svg {
        let mut chart = self.chart(name, unit);
        let arms = self.points.first().map_or(&[][..], |point| &point.rows);
        for (place, row) in arms.iter().enumerate() {
            // pc is the zero of a gain.
            if unit != "%" || row.arm != Arm::Pc.name() {
                self.add(&mut chart, row.arm, 0.003 * (place as f64 - 4.0), figure);
            }
        }
        if unit == "%" {
            let label = format!("the paper's {:.1} %", 100.0 * PAPER_GAIN);
            chart.limits.push(Limit { y: 100.0 * PAPER_GAIN, label });
        }
        chart.svg()
    }

    fn over_pc_plus(&self) -> Svg {
        let mut chart = self.chart("gain of twcc_plus over pc_plus", "%");
        self.add(&mut chart, Arm::TwccPlus.name(), 0.0, &|row| {
            row.gain_over_pc_plus.map(in_percent)
        });
        // There is one line, and the axis says which.
        chart.series.iter_mut().for_each(|series| series.name.clear());
        chart.svg()
    }
}
