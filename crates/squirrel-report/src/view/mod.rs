//! Flights as a scene in three dimensions: `view.html`.
//!
//! [`scene`] takes plain numbers from flight logs: position, attitude, wings, rotors and forces on
//! one clock, as whole numbers of a stated step, and the pieces that a vehicle is drawn of.
//! [`render`] puts them on a page, with plots of the same numbers beside, and with a renderer of its
//! own (`view_gl.js`) that needs WebGL 2 and no library. What a log lacks is said on the page, and
//! drawn as it would be without.

mod body;
mod charts;
mod mesh;
mod moments;
mod scene;
mod track;

pub use body::{Body, RotorShape, WingShape};
pub use moments::Moment;
pub use scene::{Scene, SceneFlight, scene};
pub use track::{Clock, Track};

use crate::chart::{Ink, escape};
use crate::page::{Columns, Page, Row};
use squirrel_log::FlightLog;

const STYLE: &str = include_str!("view.css");
const SCRIPT: &str =
    concat!(include_str!("view_gl.js"), include_str!("view_state.js"), include_str!("view.js"));

/// A flight to look at.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewFlight<'a> {
    /// Name.
    pub name: String,
    /// The flight.
    pub log: &'a FlightLog,
    /// How its vehicle looks.
    pub body: Body,
    /// Thrust of each rotor at each sample of `rotor.speed_rad_s`, N, sample after sample, where it
    /// is known.
    pub thrust_n: Option<Vec<f64>>,
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

/// Adds scene, controls and plots to a page.
fn add(page: &mut Page, scene: &Scene) {
    page.needs(STYLE, SCRIPT);
    page.add("<div class=\"viewer\">\n<div class=\"seen\">\n");
    page.add(&stage(scene));
    page.add(&controls(scene));
    for note in scene.flights.iter().flat_map(|flight| &flight.lacks) {
        page.missing(note);
    }
    if scene.moved {
        page.missing("The flights share no time: each begins at 0 s here.");
    }
    page.add("</div>\n<div class=\"plots\">\n");
    page.figures(Columns::One, &charts::figures(scene));
    page.add("</div>\n</div>\n");
    page.add(&format!(
        "<script type=\"application/json\" id=\"scene\">{}</script>\n",
        scene.json()
    ));
}

/// The canvas and what stands over it.
fn stage(scene: &Scene) -> String {
    let mut names = String::new();
    for (i, flight) in scene.flights.iter().enumerate() {
        let (class, name) = (Ink::Series(i).class(), escape(&flight.name));
        names += &format!("<p class=\"name\"><i class=\"swatch {class}\"></i>{name}</p>");
    }
    format!(
        "<div class=\"stage\">\n<canvas tabindex=\"0\" role=\"img\" aria-label=\"The flight in three dimensions; \
         arrow keys turn the view, plus and minus zoom, space plays\"></canvas>\n<div class=\"names\">{names}</div>\n\
         <p class=\"missing\" id=\"no-gl\" hidden>This browser has no WebGL 2, so there is no scene; time, numbers and \
         plots work without.</p>\n</div>\n\
         <noscript><p class=\"missing\">The scene needs JavaScript; the plots do not.</p></noscript>\n"
    )
}

/// Time, camera, arrows, numbers.
fn controls(scene: &Scene) -> String {
    let [begin, end] = scene.range_s;
    let mut html = format!(
        "<div class=\"transport\">\n<button type=\"button\" id=\"play\" aria-label=\"play\">\u{25b6}</button>\n\
         <input type=\"range\" id=\"time\" min=\"{begin}\" max=\"{end}\" step=\"any\" value=\"{begin}\" aria-label=\"time, s\">\n\
         <output id=\"now\"></output>\n<select id=\"pace\" aria-label=\"speed of playing\">"
    );
    for (value, name) in [("0.1", "1/10"), ("0.25", "1/4"), ("1", "1x"), ("4", "4x")] {
        let selected = if value == "0.25" { " selected" } else { "" };
        html += &format!("<option value=\"{value}\"{selected}>{name}</option>");
    }
    html += "</select>\n</div>\n<div class=\"options\">\n<select id=\"camera\" aria-label=\"camera\">\
             <option value=\"follow\">follow</option><option value=\"whole\">whole flight</option>\
             <option value=\"above\">from above</option></select>\n";
    if scene.flights.len() > 1 {
        html += "<select id=\"layout\" aria-label=\"layout\"><option value=\"beside\">side by side</option>\
                 <option value=\"one\">one scene</option></select>\n";
    }
    html += &arrow_boxes(scene);
    html += "</div>\n";
    html += &moment_links(scene);
    html += "<div class=\"wide\"><table id=\"readings\"></table></div>\n";
    html += &format!(
        "<p class=\"say\"><span id=\"count\">{} triangles in {} draw calls a frame with everything shown</span>. \
         {} 1 N is {:.1} cm of an arrow, 1 m/s {:.1} cm. Rotors turn at a fiftieth of their speed.{}\
         <span id=\"larger\"></span></p>\n",
        scene.triangles,
        scene.draw_calls,
        ground_words(scene),
        100.0 * scene.arrow_m_per_n,
        100.0 * scene.arrow_s,
        wing_words(scene),
    );
    html
}

/// What the squares below the flight are.
fn ground_words(scene: &Scene) -> String {
    let cell = scene.cell_m;
    if scene.ground_m < 0.0 {
        let height = -scene.ground_m;
        return format!("The squares are {cell} m wide, on a level plane {height} m high.");
    }
    format!("The squares of the ground are {cell} m wide.")
}

/// What a share of deployment is drawn as.
fn wing_words(scene: &Scene) -> String {
    let wing = scene.flights.iter().find_map(|flight| flight.body.wing);
    wing.map_or_else(String::new, |wing| {
        format!(
            " Wings from folded (0 %) to spread (100 %) are drawn as {:.0} deg of a crank; of their force each shows half.",
            wing.stroke_deg
        )
    })
}

/// A box for each arrow that a flight has.
fn arrow_boxes(scene: &Scene) -> String {
    let has = |name: &str| {
        let on = format!("{name}.shaft.0");
        scene.flights.iter().any(|flight| flight.pieces.iter().any(|piece| piece.on == on))
    };
    let shown = body::ARROWS.iter().filter(|(name, _)| has(name));
    let boxes = shown.map(|(name, ink)| {
        let checked = if *name == "velocity" { "" } else { " checked" };
        format!(
            "<label><input type=\"checkbox\" name=\"arrow\" value=\"{name}\"{checked}><i class=\"swatch {ink}\"></i>{}</label>\n",
            name.replace('_', " ")
        )
    });
    boxes.collect()
}

/// Links to when wings opened.
fn moment_links(scene: &Scene) -> String {
    /// More of them say nothing new.
    const MOST: usize = 9;
    let mut html = String::new();
    for (i, flight) in scene.flights.iter().enumerate() {
        if flight.moments.is_empty() {
            continue;
        }
        let class = Ink::Series(i).class();
        html += &format!("<p class=\"moments\"><i class=\"swatch {class}\"></i>wings:");
        for moment in flight.moments.iter().take(MOST) {
            let at = moment.time_s - flight.shift_s;
            html += &format!(" <a href=\"#t={at:.2}\">{} {at:.2} s</a>", moment.what);
        }
        html += "</p>\n";
    }
    html
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
            text += &format!(
                "; {} obstacles far from the path are left out",
                flight.obstacles_left_out
            );
        }
        page.text(&(text + "."));
    }
}
