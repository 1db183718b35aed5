//! Row charts: one row a name, with bars, intervals and dots over a shared axis.
//!
//! A bar chart of evidence, an interval plot of parameters and a dot plot of errors are the same
//! drawing: names to the left, marks in the middle, figures to the right.

use super::axis::Axis;
use super::colour::Ink;
use super::legend::{Key, Legend};
use super::plot::Plot;
use super::scale::{Scale, drawable};
use super::svg::{Anchor, Canvas, Svg, text_width};

/// A stretch of a row.
#[derive(Debug, Clone, PartialEq)]
pub struct Extent {
    /// One end, in the unit of the axis.
    pub from: f64,
    /// The other end.
    pub to: f64,
    /// Colour.
    pub ink: Ink,
    /// Name in the legend; empty for none.
    pub name: String,
}

/// A point of a row.
#[derive(Debug, Clone, PartialEq)]
pub struct Dot {
    /// Place, in the unit of the axis; NaN is not drawn.
    pub at: f64,
    /// Colour.
    pub ink: Ink,
    /// Name in the legend; empty for none.
    pub name: String,
}

/// A row.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ChartRow {
    /// Name, left of the row.
    pub label: String,
    /// Figures, right of the row; may be empty.
    pub note: String,
    /// Pale, behind the marks: what would be normal.
    pub bands: Vec<Extent>,
    /// Thick.
    pub bars: Vec<Extent>,
    /// Thin, with ends.
    pub intervals: Vec<Extent>,
    /// In front.
    pub dots: Vec<Dot>,
}

/// Rows over a shared axis.
#[derive(Debug, Clone, PartialEq)]
pub struct RowChart {
    /// What the chart shows, for readers who cannot see it.
    pub label: String,
    /// Width, px.
    pub width: f64,
    /// Horizontal axis.
    pub x: Axis,
    /// From top to bottom.
    pub rows: Vec<ChartRow>,
}

const ROW: f64 = 20.0;

impl RowChart {
    /// A chart without rows.
    pub fn new(label: &str, width: f64, x: Axis) -> Self {
        Self { label: label.to_owned(), width, x, rows: Vec::new() }
    }

    /// Draws the chart.
    pub fn svg(&self) -> Svg {
        let widest =
            |texts: &mut dyn Iterator<Item = &str>| texts.map(text_width).fold(0.0, f64::max);
        let left = widest(&mut self.rows.iter().map(|r| r.label.as_str())) + 16.0;
        let notes = widest(&mut self.rows.iter().map(|r| r.note.as_str()));
        // However long the texts, a fifth of the width stays for the marks.
        let left = left.min(0.5 * self.width);
        let right = (self.width - notes - 22.0).max(left + 0.2 * self.width);
        let legend = self.legend(right.max(self.width - 16.0));
        let top = if legend.is_empty() { 8.0 } else { 14.0 + legend.height() };
        let bottom = top + ROW * self.rows.len() as f64;
        let mut canvas = Canvas::new(self.width, bottom + 38.0);
        let plot = Plot { x: self.scale(), y: Scale::exact(0.0, 1.0, 1), left, right, top, bottom };
        for &tick in plot.x.ticks() {
            let x = plot.x_px(tick);
            canvas.line(if tick == 0.0 { "zero" } else { "grid" }, [x, top], [x, bottom]);
            canvas.text("tick", [x, bottom + 16.0], Anchor::Middle, &plot.x.label(tick));
        }
        for (i, row) in self.rows.iter().enumerate() {
            draw_row(&mut canvas, &plot, row, top + ROW * i as f64);
        }
        canvas.text("axis", [right, bottom + 33.0], Anchor::End, &self.x.title());
        legend.draw(&mut canvas, 16.0);
        canvas.finish("chart", &self.label, "")
    }

    fn scale(&self) -> Scale {
        let ends = |e: &Extent| [e.from, e.to];
        let data = self.rows.iter().flat_map(|row| {
            let extents = row.bands.iter().chain(&row.bars).chain(&row.intervals);
            extents.flat_map(ends).chain(row.dots.iter().map(|d| d.at)).collect::<Vec<_>>()
        });
        self.x.scale(data, 6)
    }

    fn legend(&self, right: f64) -> Legend {
        let mut legend = Legend::new(4.0, right, 4.0);
        for row in &self.rows {
            for band in &row.bands {
                legend.add(Key::Swatch, format!("{} shade", band.ink.class()), &band.name);
            }
            for bar in &row.bars {
                legend.add(Key::Swatch, bar.ink.class(), &bar.name);
            }
            for interval in &row.intervals {
                legend.add(Key::Line, interval.ink.class(), &interval.name);
            }
            for dot in &row.dots {
                legend.add(Key::Dot, dot.ink.class(), &dot.name);
            }
        }
        legend
    }
}

fn draw_row(canvas: &mut Canvas, plot: &Plot, row: &ChartRow, y: f64) {
    let middle = y + 0.5 * ROW;
    canvas.text("label", [plot.left - 8.0, middle + 4.0], Anchor::End, &row.label);
    canvas.text("tick", [plot.right + 10.0, middle + 4.0], Anchor::Start, &row.note);
    // An end beyond the axis is drawn at its edge, one that is no number not at all.
    let ends = |e: &Extent| {
        let [a, b] = [e.from, e.to].map(|x| plot.x_px(x).clamp(plot.left, plot.right));
        (!a.is_nan() && !b.is_nan()).then(|| (a.min(b), a.max(b)))
    };
    for band in &row.bands {
        if let Some((from, to)) = ends(band) {
            let class = format!("shade {}", band.ink.class());
            canvas.rect(&class, from, y + 2.0, (to - from).max(1.0), ROW - 4.0);
        }
    }
    for bar in &row.bars {
        if let Some((from, to)) = ends(bar) {
            let class = format!("fill {}", bar.ink.class());
            canvas.rect(&class, from, y + 4.0, (to - from).max(1.0), ROW - 8.0);
        }
    }
    for interval in &row.intervals {
        if let Some((from, to)) = ends(interval) {
            let class = format!("line {}", interval.ink.class());
            canvas.line(&class, [from, middle], [to, middle]);
            for end in [from, to] {
                canvas.line(&class, [end, middle - 4.0], [end, middle + 4.0]);
            }
        }
    }
    for dot in row.dots.iter().filter(|d| drawable(d.at)) {
        let x = plot.x_px(dot.at).clamp(plot.left, plot.right);
        canvas.circle(&format!("dot {}", dot.ink.class()), [x, middle], 4.5);
    }
}
