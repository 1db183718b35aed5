//! The little of SVG that the charts need: escaped text, rounded numbers, paths that break at NaN.

use std::fmt::Write as _;

use super::scale::drawable;

/// A finished drawing: an `<svg>` element that can stand inside an HTML page.
#[derive(Debug, Clone, PartialEq)]
pub struct Svg {
    text: String,
    size: [f64; 2],
}

impl Svg {
    /// Width and height, px.
    pub fn size(&self) -> [f64; 2] {
        self.size
    }

    /// The element as text.
    pub fn as_str(&self) -> &str {
        &self.text
    }
}

/// Text made safe for HTML and SVG, in elements and in attributes; control characters become
/// U+FFFD.
pub fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            c if c.is_control() && c != '\n' => safe.push('\u{fffd}'),
            c => safe.push(c),
        }
    }
    safe
}

/// A coordinate in pixels with one decimal at most: a tenth of a pixel is below what the eye sees.
pub(super) fn px(value: f64) -> String {
    let tenths = (value.clamp(-1e6, 1e6) * 10.0).round() as i64;
    let (sign, size) = (if tenths < 0 { "-" } else { "" }, tenths.abs());
    if size % 10 == 0 {
        format!("{sign}{}", size / 10)
    } else {
        format!("{sign}{}.{}", size / 10, size % 10)
    }
}

/// Width of a text in pixels, guessed on the safe side: the font is the reader's.
pub(super) fn text_width(text: &str) -> f64 {
    text.chars().map(|c| if "mwMW@".contains(c) { 12.0 } else { 7.2 }).sum()
}

/// Where a text stands relative to its point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

impl Anchor {
    fn word(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Middle => "middle",
            Self::End => "end",
        }
    }
}

/// The `d` of a path under construction. A point that cannot be drawn lifts the pen.
#[derive(Debug, Default)]
pub(super) struct Path {
    d: String,
    points_in_stroke: usize,
}

impl Path {
    /// The path through all points.
    pub(super) fn through(points: impl IntoIterator<Item = [f64; 2]>) -> String {
        let mut path = Self::default();
        for [x, y] in points {
            path.to(x, y);
        }
        path.finish()
    }

    fn to(&mut self, x: f64, y: f64) {
        if !(drawable(x) && drawable(y)) {
            self.lift();
            return;
        }
        // After M, further pairs are lines: the letter L can stay out.
        self.d.push_str(match (self.points_in_stroke, self.d.is_empty()) {
            (0, _) => "M",
            _ => " ",
        });
        let _ = write!(self.d, "{} {}", px(x), px(y));
        self.points_in_stroke += 1;
    }

    fn lift(&mut self) {
        // A sample between two gaps is a stroke of no length: round caps make it a dot.
        if self.points_in_stroke == 1 {
            self.d.push_str("h0");
        }
        self.points_in_stroke = 0;
    }

    fn finish(mut self) -> String {
        self.lift();
        self.d
    }
}

/// A drawing under construction, coordinates in pixels, y down.
#[derive(Debug)]
pub(super) struct Canvas {
    /// Width, px.
    pub(super) width: f64,
    /// Height, px.
    pub(super) height: f64,
    body: String,
}

impl Canvas {
    pub(super) fn new(width: f64, height: f64) -> Self {
        Self { width, height, body: String::new() }
    }

    /// Adds markup that is already safe.
    pub(super) fn raw(&mut self, markup: &str) {
        self.body.push_str(markup);
    }

    /// A path of one class list; nothing when `d` is empty.
    pub(super) fn path(&mut self, class: &str, d: &str) {
        if !d.is_empty() {
            let _ = write!(self.body, r#"<path class="{class}" d="{d}"/>"#);
        }
    }

    pub(super) fn line(&mut self, class: &str, from: [f64; 2], to: [f64; 2]) {
        self.path(class, &Path::through([from, to]));
    }

    pub(super) fn rect(&mut self, class: &str, x: f64, y: f64, width: f64, height: f64) {
        let (x, y, width, height) = (px(x), px(y), px(width), px(height));
        let _ = write!(
            self.body,
            r#"<rect class="{class}" x="{x}" y="{y}" width="{width}" height="{height}"/>"#
        );
    }

    pub(super) fn circle(&mut self, class: &str, centre: [f64; 2], radius: f64) {
        let [x, y] = centre.map(px);
        let _ =
            write!(self.body, r#"<circle class="{class}" cx="{x}" cy="{y}" r="{}"/>"#, px(radius));
    }

    pub(super) fn text(&mut self, class: &str, at: [f64; 2], anchor: Anchor, text: &str) {
        let ([x, y], anchor) = (at.map(px), anchor.word());
        let _ = write!(
            self.body,
            r#"<text class="{class}" x="{x}" y="{y}" text-anchor="{anchor}">{}</text>"#,
            escape(text)
        );
    }

    /// A text that rises to the right by 45 deg from its begin.
    pub(super) fn slanted(&mut self, class: &str, at: [f64; 2], text: &str) {
        let [x, y] = at.map(px);
        let _ = write!(
            self.body,
            r#"<text class="{class}" transform="translate({x} {y}) rotate(-45)">{}</text>"#,
            escape(text)
        );
    }

    /// The finished drawing; `attributes` goes into the `<svg>` tag and is already safe.
    pub(super) fn finish(self, class: &str, label: &str, attributes: &str) -> Svg {
        let size = [self.width, self.height];
        let ([width, height], label) = (size.map(px), escape(label));
        let space = if attributes.is_empty() { "" } else { " " };
        let text = format!(
            "<svg class=\"{class}\" viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{label}\"{space}{attributes}>\
             {}</svg>\n",
            self.body
        );
        Svg { text, size }
    }
}
