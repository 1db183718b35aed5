//! What stands around the canvas: names, time, camera, arrows, numbers, in words and controls.

use super::body::ARROWS;
use super::scene::Scene;
use crate::chart::{Ink, escape};
use std::fmt::Write as _;

/// The canvas and what stands over it.
pub(super) fn stage(scene: &Scene) -> String {
    let mut names = String::new();
    for (i, flight) in scene.flights.iter().enumerate() {
        let (class, name) = (Ink::Series(i).class(), escape(&flight.name));
        let _ = write!(names, "<p class=\"name\"><i class=\"swatch {class}\"></i>{name}</p>");
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
pub(super) fn controls(scene: &Scene) -> String {
    let [begin, end] = scene.range_s;
    let mut html = format!(
        "<div class=\"transport\">\n<button type=\"button\" id=\"play\" aria-label=\"play\">\u{25b6}</button>\n\
         <input type=\"range\" id=\"time\" min=\"{begin}\" max=\"{end}\" step=\"any\" value=\"{begin}\" aria-label=\"time, s\"/>\n\
         <output id=\"now\"></output>\n<select id=\"pace\" aria-label=\"speed of playing\">"
    );
    for (value, name) in [("0.1", "1/10"), ("0.25", "1/4"), ("1", "1x"), ("4", "4x")] {
        let selected = if value == "0.25" { " selected" } else { "" };
        let _ = write!(html, "<option value=\"{value}\"{selected}>{name}</option>");
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
    let _ = writeln!(
        html,
        "<p class=\"say\"><span id=\"count\">{} triangles in {} draw calls a frame with everything shown</span>. \
         {} 1 N is {:.1} cm of an arrow, 1 m/s {:.1} cm. Rotors turn at a fiftieth of their speed.{}\
         <span id=\"larger\"></span></p>",
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
    let shown = ARROWS.iter().filter(|(name, _)| has(name));
    let boxes = shown.map(|(name, ink)| {
        let checked = if *name == "velocity" { "" } else { " checked" };
        format!(
            "<label><input type=\"checkbox\" name=\"arrow\" value=\"{name}\"{checked}/><i class=\"swatch {ink}\"></i>{}</label>\n",
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
        let _ = write!(html, "<p class=\"moments\"><i class=\"swatch {class}\"></i>wings:");
        for moment in flight.moments.iter().take(MOST) {
            let at = moment.time_s - flight.shift_s;
            let _ = write!(html, " <a href=\"#t={at:.2}\">{} {at:.2} s</a>", moment.what);
        }
        html += "</p>\n";
    }
    html
}
