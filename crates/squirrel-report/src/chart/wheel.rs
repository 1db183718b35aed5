//! Wheels: a spoke for each case, and a closed line through one number on each.
//!
//! The first spoke points up, the others follow clockwise. The centre is the low end of the axis,
//! which need not be zero: lines that lie near one another are told apart, areas mean nothing.

use super::axis::Axis;
use super::colour::Ink;
use super::legend::{Key, Legend};
use super::line::Limit;
use super::scale::drawable;
use super::svg::{Anchor, Canvas, Path, Svg, text_width};

/// A closed line.
#[derive(Debug, Clone, PartialEq)]
pub struct WheelLine {
    /// Name in the legend; empty for none.
    pub name: String,
    /// Colour.
    pub ink: Ink,
    /// One number a spoke; NaN and what is missing is a gap.
    pub values: Vec<f64>,
}

/// Lines around a wheel.
#[derive(Debug, Clone, PartialEq)]
pub struct Wheel {
    /// What the chart shows, for readers who cannot see it.
    pub label: String,
    /// Width, px.
    pub width: f64,
    /// Radius of the rim, px; legend and names come on top of it.
    pub rim_px: f64,
    /// What the distance from the centre measures. What is beyond its range lies at the rim or in
    /// the centre.
    pub radius: Axis,
    /// Names of the spokes.
    pub spokes: Vec<String>,
    /// Circles to compare with.
    pub limits: Vec<Limit>,
    /// Lines, the later ones in front.
    pub lines: Vec<WheelLine>,
}

/// Around the rim, for the names of the spokes, px.
const NAMES: f64 = 24.0;

impl Wheel {
    /// A wheel without lines, 570 px wide.
    pub fn new(label: &str, radius: Axis, spokes: Vec<String>) -> Self {
        let (limits, lines) = (Vec::new(), Vec::new());
        Self { label: label.to_owned(), width: 570.0, rim_px: 180.0, radius, spokes, limits, lines }
    }

    /// Draws the chart.
    pub fn svg(&self) -> Svg {
        let legend = self.legend();
        let top = 10.0 + legend.height() + NAMES;
        let mut canvas = Canvas::new(self.width, top + 2.0 * self.rim_px + NAMES);
        let centre = [0.5 * self.width, top + self.rim_px];
        let data =
            self.lines.iter().flat_map(|line| line.values.iter().take(self.spokes.len()).copied());
        let scale = self.radius.scale(data.chain(self.limits.iter().map(|limit| limit.y)), 4);
        let radius_px = |value: f64| self.rim_px * scale.fraction(value).clamp(0.0, 1.0);
        let place = |spoke: usize, radius_px: f64| {
            let [east, north] = self.direction(spoke);
            [centre[0] + radius_px * east, centre[1] - radius_px * north]
        };

        for &tick in scale.ticks() {
            let class = if tick == scale.hi() { "zero" } else { "grid" };
            canvas.circle(class, centre, radius_px(tick));
        }
        for (i, name) in self.spokes.iter().enumerate() {
            canvas.line("grid", centre, place(i, self.rim_px));
            let ([x, y], [east, north]) = (place(i, self.rim_px + 12.0), self.direction(i));
            let anchor = match east {
                east if east > 0.1 => Anchor::Start,
                east if east < -0.1 => Anchor::End,
                _ => Anchor::Middle,
            };
            canvas.text("label", [x, y + 4.0 - 4.0 * north], anchor, name);
        }
        for limit in self.limits.iter().filter(|limit| drawable(limit.y)) {
            canvas.circle("line limit", centre, radius_px(limit.y));
        }
        for line in &self.lines {
            let point = |i: usize| match line.values.get(i) {
                Some(value) if drawable(*value) => place(i, radius_px(*value)),
                _ => [f64::NAN; 2],
            };
            // Once round, and to the first spoke again.
            let round =
                (0..self.spokes.len()).chain([0]).filter(|i| *i < self.spokes.len()).map(point);
            canvas.path(&format!("line {}", line.ink.class()), &Path::through(round));
        }
        // In front of the lines, left of the spoke that points up.
        for &tick in scale.ticks() {
            let y = centre[1] - radius_px(tick) + 4.0;
            canvas.text("note ref", [centre[0] - 5.0, y], Anchor::End, &scale.label(tick));
        }
        canvas.text("axis", [4.0, 16.0], Anchor::Start, &self.radius.title());
        legend.draw(&mut canvas, 16.0);
        canvas.finish("chart", &self.label, "")
    }

    /// Of a spoke, to the right and up, of length 1.
    fn direction(&self, spoke: usize) -> [f64; 2] {
        let angle = std::f64::consts::TAU * spoke as f64 / self.spokes.len().max(1) as f64;
        [angle.sin(), angle.cos()]
    }

    fn legend(&self) -> Legend {
        let title_end = 4.0 + text_width(&self.radius.title()) + 14.0;
        let mut legend = Legend::new(4.0, self.width - 4.0, title_end);
        for line in &self.lines {
            legend.add(Key::Line, line.ink.class(), &line.name);
        }
        for limit in self.limits.iter().filter(|limit| drawable(limit.y)) {
            legend.add(Key::Line, Ink::Limit.class(), &limit.label);
        }
        legend
    }
}
