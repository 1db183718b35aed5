//! Flights as a scene in three dimensions: `view.html`.
//!
//! [`scene`] takes plain numbers from flight logs: position, attitude, wings, rotors and forces on
//! one clock, as whole numbers of a stated step, and the pieces that a vehicle is drawn of.
//! [`render`] puts them on a page, with plots of the same numbers beside, and with a renderer of its
//! own (`view_gl.js`) that needs WebGL 2 and no library. What a log lacks is said on the page, and
//! drawn as it would be without.

mod body;
mod charts;
mod controls;
mod mesh;
mod moments;
mod scene;
mod track;

pub use body::{Body, RotorShape, WingShape};
pub use moments::Moment;
pub use scene::{Scene, SceneFlight, scene};
pub use track::{Clock, Track};

use crate::page::{Columns, Page, Row};
use squirrel_log::FlightLog;
use std::fmt::Write as _;

const STYLE: &str = include_str!("view.css");
const SCRIPT: &str =
    concat!(include_str!("view_gl.js"), include_str!("view_state.js"), include_str!("view.js"));

/// Speed and thrust of each rotor, sample after sample.
#[derive(Debug, Clone, PartialEq)]
pub struct RotorNumbers {
    /// The channel that they are made of, whose times they have.
    pub from: &'static str,
    /// rad/s.
    pub speed_rad_s: Vec<f64>,
    /// N.
    pub thrust_n: Vec<f64>,
}

/// A flight to look at.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewFlight<'a> {
    /// Name.
    pub name: String,
    /// The flight.
    pub log: &'a FlightLog,
    /// How its vehicle looks.
    pub body: Body,
    /// What its rotors do, where the vehicle is known.
    pub rotors: Option<RotorNumbers>,
    /// North m, east m, radius m of upright cylinders.
    pub obstacles: Vec<[f64; 3]>,
    /// Sentences that the page shall have, such as on a vehicle that is a stand-in.
    pub notes: Vec<String>,
}

/// The page as one HTML file. The same scene gives the same bytes.
///
/// * `facts` - names and values at its head
pub fn render(title: &str, facts: &[(String, String)], scene: &Scene) -> String {
    let mut page = Page::new(title, "");
    page.facts(facts);
    add(&mut page, scene);
    drawn(&mut page, scene);
    page.html()
}

/// Adds scene and controls to a page that has plots of its own.
pub(crate) fn embed(page: &mut Page, scene: &Scene) {
    page.add("<div class=\"viewer alone\">\n");
    seen(page, scene);
    page.add("</div>\n");
}

/// Adds scene, controls and plots to a page.
fn add(page: &mut Page, scene: &Scene) {
    page.add("<div class=\"viewer\">\n");
    seen(page, scene);
    page.add("<div class=\"plots\">\n");
    page.figures(Columns::One, &charts::figures(scene));
    page.add("</div>\n</div>\n");
}

/// The scene with what it needs.
fn seen(page: &mut Page, scene: &Scene) {
    page.needs(STYLE, SCRIPT);
    page.add("<div>\n");
    page.add(&controls::stage(scene));
    page.add(&controls::controls(scene));
    for note in scene.flights.iter().flat_map(|flight| &flight.lacks) {
        page.missing(note);
    }
    if scene.moved {
        page.missing("The flights share no time: each begins at 0 s here.");
    }
    page.add(&format!(
        "<script type=\"application/json\" id=\"scene\">{}</script>\n",
        scene.json()
    ));
    page.add("</div>\n");
}

/// A table of the channels that are drawn.
fn drawn(page: &mut Page, scene: &Scene) {
    page.section(
        "What is drawn",
        "The channel of the log behind each moving thing, and how fine its numbers are here.",
    );
    let mut names: Vec<&str> =
        scene.flights.iter().flat_map(|flight| flight.tracks.keys().copied()).collect();
    names.sort_unstable();
    names.dedup();
    let mut head = vec!["drawn".to_owned(), "step".to_owned()];
    head.extend(scene.flights.iter().map(|flight| flight.name.clone()));
    let rows = names.into_iter().map(|name| {
        let tracks = || scene.flights.iter().map(move |flight| flight.tracks.get(name));
        let step = tracks().flatten().next().map_or(0.0, |track| track.step);
        let from = tracks().map(|t| t.map_or_else(|| "\u{2013}".to_owned(), |t| t.from.clone()));
        let cells = [name.replace('_', " "), step.to_string()];
        Row { ink: None, cells: cells.into_iter().chain(from).collect() }
    });
    let rows: Vec<Row> = rows.collect();
    page.table(&head, &rows);
    for flight in &scene.flights {
        let (name, clock) = (&flight.name, flight.clock);
        let mut text = format!("{name}: {} instants at {} Hz", clock.count, clock.rate_hz);
        if flight.obstacles_left_out > 0 {
            let left_out = flight.obstacles_left_out;
            let _ = write!(text, "; {left_out} obstacles far from the path are left out");
        }
        page.text(&(text + "."));
    }
}
