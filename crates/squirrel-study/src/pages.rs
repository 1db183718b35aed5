//! What the pages of studies have in common: the figures that the paper shows, and every number.
//! The same study gives the same bytes.
//!
//! Tracks are those of the first trial, flown again for the page: a study keeps figures of its
//! flights, not their logs.

use crate::campaign::Plan;
use crate::statistics::Estimate;
use crate::tracking::{self, Condition, setup};
use squirrel_log::FlightLog;
use squirrel_plan::pilot;
use squirrel_report::chart::{ChartRow, Dot, Extent, Ink, Svg};
use squirrel_report::flight::{self, FlightView};
use squirrel_report::page::{Figure, Page, Row};
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{FlightError, Setup};

/// A page that begins with what was flown and with what it says, in words.
pub(crate) fn begin(title: &str, lead: &str, facts: &[(&str, String)], words: &[String]) -> Page {
    let mut page = Page::new(title, lead);
    let version = ("version", env!("CARGO_PKG_VERSION").to_owned());
    let facts = facts.iter().cloned().chain([version]);
    page.facts(&facts.map(|(name, value)| (name.to_owned(), value)).collect::<Vec<_>>());
    for word in words {
        page.text(word);
    }
    page
}

/// The colour of an arm, on every page.
pub(crate) fn ink(arm: &str) -> Ink {
    Arm::all().position(|known| known.name() == arm).map_or(Ink::Muted, Ink::Series)
}

pub(crate) fn figure(title: String, caption: String, drawing: Svg) -> Figure {
    Figure { title, caption, drawings: vec![drawing], ..Figure::default() }
}

pub(crate) fn head(names: &[&str]) -> Vec<String> {
    names.iter().map(|&name| name.to_owned()).collect()
}

/// A row of a table, with the colour of its arm.
pub(crate) fn row(arm: &str, rest: impl IntoIterator<Item = String>) -> Row {
    Row { ink: Some(ink(arm)), cells: std::iter::once(arm.to_owned()).chain(rest).collect() }
}

/// `+4.1 (+3.6 to +4.5)`, of a share in percent; a dash where there is none.
pub(crate) fn percent(e: Option<Estimate>, digits: u8) -> String {
    // Plus zero turns a rounded minus zero round.
    let unit = 10f64.powi(i32::from(digits));
    let signed =
        |x: f64| format!("{:+.*}", usize::from(digits), (100.0 * x * unit).round() / unit + 0.0);
    e.map_or_else(
        || "\u{2013}".to_owned(),
        // The interval is not broken between lines.
        |e| format!("{} ({}\u{a0}to\u{a0}{})", signed(e.value), signed(e.low), signed(e.high)),
    )
}

/// An estimate of an arm as a dot with its interval, in percent.
pub(crate) fn chart_row(arm: &str, e: Estimate, note: String) -> ChartRow {
    let (ink, [at, from, to]) = (ink(arm), [e.value, e.low, e.high].map(|share| 100.0 * share));
    ChartRow {
        label: arm.to_owned(),
        note,
        intervals: vec![Extent { from, to, ink, name: String::new() }],
        dots: vec![Dot { at, ink, name: String::new() }],
        ..ChartRow::default()
    }
}

/// Flies a setup again.
pub(crate) fn log(setup: &Setup) -> Result<FlightLog, FlightError> {
    let missing = || FlightError(format!("arm = {}: the flight has no log", setup.arm.name()));
    pilot::fly(setup, true, |_| {})?.log.ok_or_else(missing)
}

/// Adds the tracks of the first trial under a condition, by those of the arms that are among the
/// plan's.
pub(crate) fn tracks(
    page: &mut Page,
    plan: &Plan,
    condition: &Condition,
    arms: &[Arm],
) -> Result<(), FlightError> {
    let plan = plan.beside(Arm::Pc)?;
    let arms = arms.iter().filter(|arm| plan.arms.contains(arm));
    let setups: Vec<Setup> = arms.map(|arm| setup(&plan, condition, *arm, 0)).collect();
    let logs = setups.iter().map(log).collect::<Result<Vec<_>, _>>()?;
    let view = |(setup, log): (&Setup, _)| FlightView {
        arm: setup.arm.name(),
        log,
        obstacles: setup.scenario.all_obstacles(),
        tilt_max_rad: setup.vehicle.vehicle.parameters().limits.tilt_max_rad,
        thrust_max_n: setup.thrust_to_weight() * setup.vehicle.vehicle.weight_n(),
        summary: Vec::new(),
    };
    let views: Vec<FlightView<'_>> = setups.iter().zip(&logs).map(view).collect();
    let inks: Vec<Ink> = views.iter().map(|view| ink(view.arm)).collect();
    flight::tracks(page, &views, &inks);
    Ok(())
}

/// Facts of a study with one condition after the other.
pub(crate) fn facts(vehicle: &str, trials: u32, seed: u64) -> [(&'static str, String); 3] {
    [
        ("vehicle", vehicle.to_owned()),
        ("trials an arm and condition", trials.to_string()),
        ("seed", seed.to_string()),
    ]
}

/// Adds the table of every number.
///
/// * `own` - names of the columns that say where a row belongs
pub(crate) fn numbers<'a>(
    page: &mut Page,
    own: &[&str],
    rows: impl Iterator<Item = (Vec<String>, &'a tracking::Row)>,
) {
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
    let cells = |(place, of): (Vec<String>, &tracking::Row)| {
        let metres =
            [of.rmse_m, of.rmse_horizontal_m, of.rmse_measured_m].map(|x| format!("{x:.2}"));
        let gains = [
            Some(of.gain),
            Some(of.gain_horizontal),
            Some(of.gain_measured),
            of.gain_over_phantom,
            of.gain_over_pc_plus,
        ];
        let rest =
            [of.height_lost_m, of.height_gained_m, of.wings_open_s].map(|x| format!("{x:.2}"));
        let gains = gains.map(|gain| percent(gain, 1));
        row(of.arm, place.into_iter().chain(metres).chain(gains).chain(rest))
    };
    page.table(&names, &rows.map(cells).collect::<Vec<Row>>());
}
