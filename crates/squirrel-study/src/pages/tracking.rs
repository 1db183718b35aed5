//! The paper's real flights and what wings are worth as a function of thrust, as pages.

use super::{begin, chart_row, figure, head, ink, percent, row, tracks};
use crate::campaign::Plan;
use crate::statistics::Estimate;
use crate::table3::{self, Table3};
use crate::thrust::{self, PAPER_GAIN, Point, Thrust};
use crate::tracking::Row;
use squirrel_report::chart::{Axis, Extent, Ink, Limit, LineChart, Range, RowChart, Series, Svg};
use squirrel_report::page::{self, Columns, Figure, Page};
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::FlightError;

/// Arms whose tracks are shown.
const SHOWN: [Arm; 4] = [Arm::Pc, Arm::TwccParnn, Arm::TwccPlus, Arm::PcPlus];
/// Up to this ratio thrust is scarce, and points lie near one another.
const SCARCE: f64 = 1.5;

/// Table III as a page without network.
///
/// # Errors
/// A flight that fails.
pub fn table3(study: &Table3, plan: &Plan) -> Result<String, FlightError> {
    let lead = "The paper's real flights, 7.3 m/s, R_d 4 m, a turn of 110 to 130 deg, with the error as its log has it, by satellite \
                fix and barometer. The paper does not say how much thrust there was. Gain is the mean error of pc over that of \
                the arm, minus 1.";
    let facts = facts(&study.vehicle, study.trials, study.seed);
    let mut page = begin("Table III: the paper's real flights", lead, &facts, &[]);
    page.section(
        "Measured gain",
        "Gain of the measured errors over pc with its paired 95 % interval; the red stroke is the paper's gain of twcc_parnn.",
    );
    let of_point = |point: &table3::Point| {
        figure(format!("T/W {:.2}", point.thrust_to_weight), String::new(), measured(point))
    };
    page.figures(Columns::Two, &study.points.iter().map(of_point).collect::<Vec<Figure>>());
    if let (Some(point), Some(condition)) = (study.points.first(), table3::conditions(&plan.vehicle)?.first())
    {
        page.section(
            &format!("The first trial at T/W {:.2}", point.thrust_to_weight),
            "Tracks are coloured by speed. The paper's drone without wings sank.",
        );
        tracks(&mut page, plan, condition, &SHOWN)?;
    }
    let rows = study
        .points
        .iter()
        .flat_map(|point| point.rows.iter().map(|row| (vec![format!("{:.2}", point.thrust_to_weight)], row)));
    numbers(&mut page, &["T/W"], rows);
    Ok(page.html())
}

fn facts(vehicle: &str, trials: u32, seed: u64) -> [(&'static str, String); 3] {
    [
        ("vehicle", vehicle.to_owned()),
        ("trials an arm and condition", trials.to_string()),
        ("seed", seed.to_string()),
    ]
}

fn measured(point: &table3::Point) -> Svg {
    let axis = Axis::new("measured gain over pc", "%");
    let label = format!("measured gain by arm at T/W {:.2}", point.thrust_to_weight);
    let mut chart = RowChart::new(&label, Columns::Two.width(), axis);
    let paper = || Extent {
        from: 100.0 * PAPER_GAIN,
        to: 100.0 * PAPER_GAIN,
        ink: Ink::Limit,
        name: format!("the paper's {:.1} %", 100.0 * PAPER_GAIN),
    };
    chart.rows.extend(point.rows.iter().filter(|row| row.arm != Arm::Pc.name()).map(|row| {
        // Plus zero turns a rounded minus zero round.
        let note = format!("{:+.1} %", (1e3 * row.gain_measured.value).round() / 10.0 + 0.0);
        let mut row = chart_row(row.arm, row.gain_measured, note);
        row.bars.push(paper());
        row
    }));
    chart.svg()
}

/// Thrust-to-weight ratios as a page without network.
pub fn thrust(study: &Thrust) -> String {
    let lead = "What wings are worth as a function of the effective thrust-to-weight ratio: the avoidance manoeuvre, 7.3 m/s, R_d 4 m, a \
                turn of 110 to 130 deg. Gain is the mean error of pc over that of the arm, minus 1.";
    let facts = facts(&study.vehicle, study.trials, study.seed);
    let mut page = begin("What wings are worth where thrust is scarce", lead, &facts, &thrust::words(study));
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
        let charge = point.charge.map_or_else(|| "\u{2013}".to_owned(), |charge| format!("{charge:.2}"));
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
        let mut chart =
            LineChart::new(&format!("{figure} over T/W, {}", self.title), axis("effective T/W", ""), y);
        chart.width = Columns::Two.width();
        chart.plot_height = 240.0;
        chart
    }

    /// A figure of an arm at every point, with its interval as strokes that are moved by `aside` of the axis.
    fn add(&self, chart: &mut LineChart, arm: &str, aside: f64, figure: &dyn Fn(&Row) -> Option<Estimate>) {
        let found = self.points.iter().filter_map(|point| {
            let row = point.rows.iter().find(|row| row.arm == arm)?;
            Some((point.thrust_to_weight, figure(row)?))
        });
        let (x, found): (Vec<f64>, Vec<Estimate>) = found.unzip();
        let (first, last) = (x.first().copied().unwrap_or(0.0), x.last().copied().unwrap_or(0.0));
        let beside: Vec<f64> = x.iter().map(|x| x + aside * (last - first)).collect();
        let [value, low, high] = [|e: &Estimate| e.value, |e: &Estimate| e.low, |e: &Estimate| e.high]
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
        self.add(&mut chart, Arm::TwccPlus.name(), 0.0, &|row| row.gain_over_pc_plus.map(in_percent));
        // There is one line, and the axis says which.
        chart.series.iter_mut().for_each(|series| series.name.clear());
        chart.svg()
    }
}

/// Adds the table of every number.
///
/// * `own` - names of the columns that say where a row belongs
fn numbers<'a>(page: &mut Page, own: &[&str], rows: impl Iterator<Item = (Vec<String>, &'a Row)>) {
    page.section(
        "Every number",
        "Gains with their paired 95 % intervals, in %; heights are means of the largest.",
    );
    let names = [
        "RMSE m",
        "horizontal m",
        "measured m",
        "gain",
        "gain horizontal",
        "gain measured",
        "over phantom",
        "over pc_plus",
        "lost m",
        "gained m",
        "wings open s",
    ];
    let names = head(&[&["arm"][..], own, &names].concat());
    let cells = |(place, of): (Vec<String>, &Row)| {
        let metres = [of.rmse_m, of.rmse_horizontal_m, of.rmse_measured_m].map(|x| format!("{x:.2}"));
        let gains = [
            Some(of.gain),
            Some(of.gain_horizontal),
            Some(of.gain_measured),
            of.gain_over_phantom,
            of.gain_over_pc_plus,
        ];
        let rest = [of.height_lost_m, of.height_gained_m, of.wings_open_s].map(|x| format!("{x:.2}"));
        let gains = gains.map(|gain| percent(gain, 1));
        row(of.arm, place.into_iter().chain(metres).chain(gains).chain(rest))
    };
    page.table(&names, &rows.map(cells).collect::<Vec<page::Row>>());
}
