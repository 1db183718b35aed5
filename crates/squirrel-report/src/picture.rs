//! Drawings as one SVG file that needs nothing else, for a page that is not ours.

use super::chart::{Svg, escape};
use std::fmt::Write as _;

/// The colours by day alone: a page in the dark shows a light picture rather than dark lines on a
/// dark ground.
const STYLE: &str = concat!(
    include_str!("colours.css"),
    include_str!("charts.css"),
    "svg { color-scheme: light; font-family: system-ui, \"Segoe UI\", Roboto, \"Helvetica Neue\", \"DejaVu Sans\", sans-serif; }\n\
     .ground { fill: var(--ground); }\n\
     svg .title { font-size: 17px; font-weight: 600; }\n\
     svg .lead { font-size: 13px; fill: var(--quiet); }\n",
);
const MARGIN: f64 = 16.0;
const LINE: f64 = 20.0;
/// Between drawings.
const GAP: f64 = 24.0;

/// Drawings side by side below a title and lines of text, on a white ground.
pub fn picture(title: &str, lead: &[&str], drawings: &[Svg]) -> String {
    let top = MARGIN + 24.0 + LINE * lead.len() as f64;
    let width: f64 = drawings.iter().map(|drawing| drawing.size()[0]).sum();
    let width = 2.0 * MARGIN + width + GAP * drawings.len().saturating_sub(1) as f64;
    let height =
        top + drawings.iter().map(|drawing| drawing.size()[1]).fold(0.0, f64::max) + MARGIN;
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" role=\"img\">\n\
         <title>{title}</title>\n<style>\n{STYLE}</style>\n\
         <rect class=\"ground\" width=\"{width}\" height=\"{height}\"/>\n\
         <text class=\"title\" x=\"{MARGIN}\" y=\"{}\">{title}</text>\n",
        MARGIN + 14.0,
        title = escape(title),
    );
    for (k, line) in lead.iter().enumerate() {
        let y = MARGIN + 14.0 + LINE * (k + 1) as f64;
        let _ =
            writeln!(text, "<text class=\"lead\" x=\"{MARGIN}\" y=\"{y}\">{}</text>", escape(line));
    }
    let mut left = MARGIN;
    for drawing in drawings {
        let _ = writeln!(text, "<g transform=\"translate({left} {top})\">{}</g>", sized(drawing));
        left += drawing.size()[0] + GAP;
    }
    text + "</svg>\n"
}

/// A drawing inside of another has no page to take its size from.
fn sized(drawing: &Svg) -> String {
    let [width, height] = drawing.size();
    drawing.as_str().replacen("<svg ", &format!("<svg width=\"{width}\" height=\"{height}\" "), 1)
}
