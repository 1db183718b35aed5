//! The report of one manoeuvre flown by several controller arms: `report.html`.
//!
//! Reads `truth.*`, `reference.*`, `wing.*` and `control.*` of each log. A log may lack any of
//! them: the panel then names the missing channel and shows the other arms.
mod curves;
mod shown;
mod time;
mod tracks;

pub use shown::Shown;

use super::chart::{Ink, LARGEST};
use super::page::{Columns, Page, Row};
use super::view::{self, Scene};
use squirrel_log::FlightLog;

/// What stands above the panels.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Heading {
    /// Title of the page.
    pub title: String,
    /// What was flown and why, in a sentence or two; may be empty.
    pub lead: String,
    /// Names and values, such as vehicle, seed and thrust-to-weight.
    pub facts: Vec<(String, String)>,
    /// The manoeuvres in words, one a line; may be empty.
    pub card: String,
}

/// One flight of the manoeuvre.
#[derive(Debug, Clone, PartialEq)]
pub struct FlightView<'a> {
    /// Name of the controller arm.
    pub arm: &'a str,
    /// The flight.
    pub log: &'a FlightLog,
    /// North m, east m, radius m of upright cylinders.
    pub obstacles: Vec<[f64; 3]>,
    /// Largest tilt that the controller may command, rad.
    pub tilt_max_rad: f64,
    /// Largest collective thrust, N.
    pub thrust_max_n: f64,
    /// Cells of the arm's row in the table: name with unit, value.
    pub summary: Vec<(String, String)>,
}

/// The report as one HTML file. The same flights give the same bytes.
pub fn render(heading: &Heading, flights: &[FlightView<'_>]) -> String {
    report(heading, flights, None)
}

/// The report with the flights in three dimensions, too.
pub fn render_with_scene(heading: &Heading, flights: &[FlightView<'_>], scene: &Scene) -> String {
    report(heading, flights, Some(scene))
}

fn report(heading: &Heading, flights: &[FlightView<'_>], scene: Option<&Scene>) -> String {
    let mut page = Page::new(&heading.title, &heading.lead);
    page.facts(&heading.facts);
    if !heading.card.is_empty() {
        page.section("Pilot's card", "What was flown, from the scenario.");
        page.preformatted(&heading.card);
    }
    arms(&mut page, flights);
    if let Some(scene) = scene {
        let text = "Look for wings that open while the vehicle tilts, and for what the rotors do meanwhile: a press on a chart \
                    below goes to its instant.";
        page.section("In three dimensions", text);
        view::embed(&mut page, scene);
    }
    if !flights.is_empty() {
        let inks: Vec<Ink> = (0..flights.len()).map(Ink::Series).collect();
        tracks::add(&mut page, flights, &inks);
        time::add(&mut page, flights);
    }
    page.html()
}

/// Adds the panels of tracks to a page that shows more than these flights.
///
/// * `inks` - of each flight, as elsewhere on the page; a flight beyond them is muted
pub fn tracks(page: &mut Page, flights: &[FlightView<'_>], inks: &[Ink]) {
    tracks::add(page, flights, inks);
}

/// The table of arms: the columns of all summaries in the order in which they first appear.
fn arms(page: &mut Page, flights: &[FlightView<'_>]) {
    page.section(
        "Arms",
        "Look for the column in which the arms differ most; the panels below show where it comes from.",
    );
    let mut head = vec!["arm".to_owned()];
    for (name, _) in flights.iter().flat_map(|f| &f.summary) {
        if !head[1..].contains(name) {
            head.push(name.clone());
        }
    }
    let cell = |flight: &FlightView<'_>, column: &String| {
        let found = flight.summary.iter().find(|(name, _)| name == column);
        found.map_or_else(|| "\u{2013}".to_owned(), |(_, value)| value.clone())
    };
    let rows = flights.iter().enumerate().map(|(i, flight)| {
        let cells =
            std::iter::once(flight.arm.to_owned()).chain(head[1..].iter().map(|c| cell(flight, c)));
        Row { ink: Some(Ink::Series(i)), cells: cells.collect() }
    });
    let rows = rows.collect::<Vec<_>>();
    page.table(&head, &rows);
}

/// The sentence for something that a log does not have.
fn lacks(flight: &FlightView<'_>, lack: &str) -> String {
    format!("{}: the log lacks {lack}.", flight.arm)
}

/// A limit worth drawing: a limit of zero or infinity is none.
fn is_limit(limit: f64) -> bool {
    limit > 0.0 && limit <= LARGEST
}

/// Columns for a panel that has one figure an arm; of four, three columns would leave one alone.
fn columns_for(arms: usize) -> Columns {
    if arms < 3 || arms == 4 { Columns::Two } else { Columns::Three }
}
