//! Line charts: curves over a shared axis, with limits, shaded spans and lanes of states.

use super::axis::{Axis, Range, extent};
use super::colour::Ink;
use super::legend::{Key, Legend};
use super::plot::Plot;
use super::scale::{Scale, drawable};
use super::svg::{Anchor, Canvas, Path, Svg, escape, px, text_width};
use super::thin::columns;

/// A curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name in the legend; empty for none.
    pub name: String,
    /// Colour.
    pub ink: Ink,
    /// Drawn dashed.
    pub dashed: bool,
    /// Drawn thin and pale, behind what matters.
    pub pale: bool,
    /// Held from sample to sample, as a command is.
    pub step: bool,
    /// Rising, in the unit of the x axis.
    pub x: Vec<f64>,
    /// One number for each `x`; NaN is a gap.
    pub y: Vec<f64>,
}

impl Series {
    /// A solid curve that joins its samples.
    pub fn line(name: &str, ink: Ink, x: Vec<f64>, y: Vec<f64>) -> Self {
        Self { name: name.to_owned(), ink, dashed: false, pale: false, step: false, x, y }
    }

    /// A curve that holds each sample until the next.
    pub fn steps(name: &str, ink: Ink, x: Vec<f64>, y: Vec<f64>) -> Self {
        Self { step: true, ..Self::line(name, ink, x, y) }
    }

    /// A vertical stroke from `low` to `high` at each `x`: the stems of a correlation from zero,
    /// the spread of a mean.
    pub fn strokes(name: &str, ink: Ink, x: &[f64], low: &[f64], high: &[f64]) -> Self {
        let places = x.iter().zip(low).zip(high);
        let x = x.iter().flat_map(|x| [*x; 3]).collect();
        let y = places.flat_map(|((_, low), high)| [*low, *high, f64::NAN]).collect();
        Self::line(name, ink, x, y)
    }

    fn class(&self) -> String {
        let dashed = if self.dashed { " dashed" } else { "" };
        let pale = if self.pale { " pale" } else { "" };
        format!("{}{dashed}{pale}", self.ink.class())
    }

    /// The drawable corners of the curve in data units, NaN at gaps.
    fn corners(&self) -> Vec<[f64; 2]> {
        let mut corners = Vec::with_capacity(self.x.len());
        let mut held = f64::NAN;
        for (&x, &y) in self.x.iter().zip(&self.y) {
            if self.step && held != y {
                corners.push([x, held]);
            }
            held = y;
            corners.push([x, y]);
        }
        corners
    }
}

/// A horizontal line that the data should not cross.
#[derive(Debug, Clone, PartialEq)]
pub struct Limit {
    /// Height, in the unit of the y axis.
    pub y: f64,
    /// Text at the line.
    pub label: String,
}

/// A stretch of the x axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Span {
    /// Begin, in the unit of the x axis.
    pub from: f64,
    /// End, in the unit of the x axis.
    pub to: f64,
    /// Colour.
    pub ink: Ink,
    /// Name in the legend; spans of one name share an entry.
    pub name: String,
}

/// A strip below the plot that shows a state over x.
#[derive(Debug, Clone, PartialEq)]
pub struct Lane {
    /// Text left of the strip, a short word.
    pub label: String,
    /// When the state had which value.
    pub spans: Vec<Span>,
}

/// A line chart.
#[derive(Debug, Clone, PartialEq)]
pub struct LineChart {
    /// What the chart shows, for readers who cannot see it.
    pub label: String,
    /// Width, px.
    pub width: f64,
    /// Height of the plot area, px; legend, lanes and labels come on top of it.
    pub plot_height: f64,
    /// Horizontal axis. Unlike the y axis it ends where the data ends.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Curves, the later ones in front.
    pub series: Vec<Series>,
    /// Limits.
    pub limits: Vec<Limit>,
    /// Shaded spans behind the curves.
    pub spans: Vec<Span>,
    /// Strips below the plot.
    pub lanes: Vec<Lane>,
    /// Charts of one link share a cursor; they should share the x range too.
    pub link: Option<&'static str>,
}

const LEFT: f64 = 52.0;
const RIGHT: f64 = 16.0;
const LANE: f64 = 16.0;

impl LineChart {
    /// An empty chart, 570 px wide.
    pub fn new(label: &str, x: Axis, y: Axis) -> Self {
        Self {
            label: label.to_owned(),
            width: 570.0,
            plot_height: 190.0,
            x,
            y,
            series: Vec::new(),
            limits: Vec::new(),
            spans: Vec::new(),
            lanes: Vec::new(),
            link: None,
        }
    }

    /// Draws the chart.
    pub fn svg(&self) -> Svg {
        let legend = self.legend();
        let top = 12.0 + legend.height();
        let bottom = top + self.plot_height;
        let lanes_bottom =
            bottom + if self.lanes.is_empty() { 0.0 } else { 6.0 } + LANE * self.lanes.len() as f64;
        let mut canvas = Canvas::new(self.width, lanes_bottom + 38.0);
        let plot = Plot {
            x: self.x_scale(),
            y: self.y_scale(),
            left: LEFT,
            right: self.width - RIGHT,
            top,
            bottom,
        };

        for span in &self.spans {
            draw_span(&mut canvas, &plot, span, "shade", top, self.plot_height);
        }
        plot.grid(&mut canvas, lanes_bottom);
        for (i, lane) in self.lanes.iter().enumerate() {
            let y = bottom + 6.0 + LANE * i as f64;
            canvas.text("tick", [LEFT - 7.0, y + 10.0], Anchor::End, &lane.label);
            for span in &lane.spans {
                draw_span(&mut canvas, &plot, span, "fill", y, LANE - 4.0);
            }
        }
        for series in &self.series {
            let corners = series.corners().into_iter().map(|p| plot.point(p)).collect::<Vec<_>>();
            canvas
                .path(&format!("line {}", series.class()), &Path::through(columns(&corners, 1.5)));
        }
        for limit in self.limits.iter().filter(|l| drawable(l.y)) {
            let y = plot.y_px(limit.y);
            canvas.line("line limit", [plot.left, y], [plot.right, y]);
            canvas.text("note limit", [plot.right - 4.0, y - 5.0], Anchor::End, &limit.label);
        }
        canvas.text("axis", [4.0, 16.0], Anchor::Start, &self.y.title());
        canvas.text("axis", [plot.right, lanes_bottom + 33.0], Anchor::End, &self.x.title());
        legend.draw(&mut canvas, 16.0);
        canvas.finish("chart", &self.label, &self.cursor(&plot, lanes_bottom))
    }

    fn legend(&self) -> Legend {
        let title_end = 4.0 + text_width(&self.y.title()) + 14.0;
        let mut legend = Legend::new(LEFT, self.width - RIGHT, LEFT.max(title_end));
        for series in &self.series {
            legend.add(Key::Line, series.class(), &series.name);
        }
        for span in &self.spans {
            legend.add(Key::Swatch, format!("{} shade", span.ink.class()), &span.name);
        }
        for span in self.lanes.iter().flat_map(|lane| &lane.spans) {
            legend.add(Key::Swatch, span.ink.class(), &span.name);
        }
        legend
    }

    /// The x axis ends where the data ends: time has no nicer end than that.
    fn x_scale(&self) -> Scale {
        let data = self.series.iter().flat_map(|s| s.x.iter().copied());
        let (lo, hi) = match self.x.range {
            Range::Exact(lo, hi) => (lo, hi),
            Range::Data => extent(data).unwrap_or((0.0, 1.0)),
            Range::Including(a, b) => extent(data.chain([a, b])).unwrap_or((0.0, 1.0)),
        };
        Scale::exact(lo, hi, 8)
    }

    fn y_scale(&self) -> Scale {
        let data = self.series.iter().flat_map(|s| s.y.iter().copied());
        self.y.scale(data.chain(self.limits.iter().map(|l| l.y)), 5)
    }

    /// What the script of the page needs to draw one cursor through all charts of a link.
    fn cursor(&self, plot: &Plot, bottom: f64) -> String {
        let Some(link) = self.link else { return String::new() };
        let [left, right, top, bottom] = [plot.left, plot.right, plot.top, bottom].map(px);
        let (lo, hi) = (plot.x.lo(), plot.x.hi());
        let [link, unit] = [link, &self.x.unit].map(escape);
        format!(
            r#"data-link="{link}" data-box="{left},{top},{right},{bottom}" data-range="{lo:e},{hi:e}" data-unit="{unit}""#
        )
    }
}

fn draw_span(canvas: &mut Canvas, plot: &Plot, span: &Span, class: &str, y: f64, height: f64) {
    let [from, to] = [span.from, span.to].map(|x| plot.x_px(x).clamp(plot.left, plot.right));
    // Also refuses NaN ends.
    if to > from {
        canvas.rect(&format!("{class} {}", span.ink.class()), from, y, to - from, height);
    }
}
