//! Heat maps: rows of cells over a shared axis, with strips of what went on meanwhile; and matrices
//! of named rows.
//!
//! Cells of one step of the colour map are one path, and neighbours in a row one piece of it: a map
//! of ten thousand cells is a few kilobytes. The map fades to the ground, so that what is small is
//! quiet in light and in dark.

use super::axis::{Axis, extent};
use super::colour::{BINS, Ramp, Values};
use super::scale::{LARGEST, Scale, drawable};
use super::svg::{Anchor, Canvas, Path, Svg, px, text_width};
use std::fmt::Write as _;

/// Rows of cells under a title.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatGroup {
    /// Title, above the rows.
    pub title: String,
    /// Name and one number a cell; NaN stays empty.
    pub rows: Vec<(String, Vec<f64>)>,
}

/// A curve below the cells, from zero (or what is below it) to its largest number.
#[derive(Debug, Clone, PartialEq)]
pub struct Strip {
    /// Name, left of the strip.
    pub label: String,
    /// Unit of the numbers.
    pub unit: String,
    /// One number a cell; NaN is a gap.
    pub values: Vec<f64>,
}

/// Cells over an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatMap {
    /// What the map shows, for readers who cannot see it.
    pub label: String,
    /// Width, px.
    pub width: f64,
    /// Horizontal axis; its range is that of the cells.
    pub x: Axis,
    /// Where the first cell begins, in the unit of the axis.
    pub from: f64,
    /// Width of a cell, > 0.
    pub cell: f64,
    /// What colour measures.
    pub values: Values,
    /// Groups from top to bottom.
    pub groups: Vec<HeatGroup>,
    /// Strips below them.
    pub strips: Vec<Strip>,
}

/// How a [`Matrix`] marks its cells: below each limit, the stronger the lower.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// Cells below this number, and not below an earlier level's.
    pub below: f64,
    /// Step of the colour map, up to [`BINS`] - 1.
    pub bin: usize,
    /// Name in the legend.
    pub name: String,
}

/// Numbers between names, each in a cell; what is below a limit stands out.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrix {
    /// What the matrix shows, for readers who cannot see it.
    pub label: String,
    /// Names of rows and columns.
    pub names: Vec<String>,
    /// One row a name; NaN stays empty.
    pub values: Vec<Vec<f64>>,
    /// Rising limits.
    pub levels: Vec<Level>,
}

const ROW: f64 = 17.0;
const TITLE: f64 = 20.0;
const STRIP: f64 = 30.0;
const RIGHT: f64 = 106.0;

impl HeatMap {
    /// Draws the map.
    pub fn svg(&self) -> Svg {
        let names = self.groups.iter().flat_map(|g| &g.rows).map(|(name, _)| name);
        let widest = names.chain(self.strips.iter().map(|s| &s.label)).map(|n| text_width(n));
        let left = (widest.fold(36.0, f64::max) + 16.0).min(0.4 * self.width);
        let right = self.width - RIGHT;
        let rows: usize = self.groups.iter().map(|g| g.rows.len()).sum();
        let top = 34.0;
        let cells_end = top + TITLE * self.groups.len() as f64 + ROW * rows as f64;
        let bottom = cells_end + STRIP * self.strips.len() as f64 + 4.0;
        let mut canvas = Canvas::new(self.width, bottom + 38.0);
        let scale = self.x_scale();
        let x_px = |x: f64| left + (right - left) * scale.fraction(x);
        self.values.bar(&mut canvas, Ramp::Heat, right, 3.0, 200.0);
        let mut y = top;
        for group in &self.groups {
            canvas.text("axis", [4.0, y + 13.0], Anchor::Start, &group.title);
            y += TITLE;
            for (name, _) in &group.rows {
                canvas.text("tick", [left - 7.0, y + 12.5], Anchor::End, name);
                y += ROW;
            }
        }
        self.cells(&mut canvas, top, &x_px);
        for (i, strip) in self.strips.iter().enumerate() {
            self.strip(
                &mut canvas,
                strip,
                cells_end + 8.0 + STRIP * i as f64,
                [left, right],
                &x_px,
            );
        }
        for &tick in scale.ticks() {
            let x = x_px(tick);
            canvas.line("zero", [x, bottom], [x, bottom + 4.0]);
            canvas.text("tick", [x, bottom + 17.0], Anchor::Middle, &scale.label(tick));
        }
        canvas.text("axis", [right, bottom + 33.0], Anchor::End, &self.x.title());
        canvas.finish("chart", &self.label, "")
    }

    fn x_scale(&self) -> Scale {
        let rows = self.groups.iter().flat_map(|g| &g.rows).map(|(_, v)| v.len());
        let cells = rows.chain(self.strips.iter().map(|s| s.values.len())).max().unwrap_or(0);
        Scale::exact(self.from, self.from + self.cell * cells as f64, 8)
    }

    fn cells(&self, canvas: &mut Canvas, top: f64, x_px: &impl Fn(f64) -> f64) {
        let mut paths = vec![String::new(); BINS];
        let mut y = top;
        for group in &self.groups {
            y += TITLE;
            for (_, values) in &group.rows {
                let mut start = 0;
                while start < values.len() {
                    let bin = self.values.bin(values[start]);
                    let run =
                        values[start..].iter().take_while(|v| self.values.bin(**v) == bin).count();
                    if let Some(bin) = bin {
                        let [a, b] =
                            [start, start + run].map(|k| x_px(self.from + self.cell * k as f64));
                        let (x, y, w, h) = (px(a), px(y + 1.0), px(b - a), px(ROW - 2.0));
                        let _ = write!(paths[bin], "M{x} {y}h{w}v{h}h-{w}z");
                    }
                    start += run;
                }
                y += ROW;
            }
        }
        for (bin, d) in paths.iter().enumerate() {
            canvas.path(&format!("fill h{bin}"), d);
        }
    }

    fn strip(
        &self,
        canvas: &mut Canvas,
        strip: &Strip,
        top: f64,
        [left, right]: [f64; 2],
        x_px: &impl Fn(f64) -> f64,
    ) {
        let height = STRIP - 8.0;
        let (lowest, largest) =
            extent(strip.values.iter().copied().chain([0.0])).unwrap_or((0.0, 0.0));
        let scale = Scale::exact(lowest, if largest > lowest { largest } else { lowest + 1.0 }, 2);
        let points = strip.values.iter().enumerate().map(|(k, v)| {
            let x = x_px(self.from + self.cell * (k as f64 + 0.5));
            let y = if drawable(*v) { top + height * (1.0 - scale.fraction(*v)) } else { f64::NAN };
            [x, y]
        });
        canvas.line("zero", [left, top + height], [right, top + height]);
        canvas.path("line ref", &Path::through(points));
        canvas.text("tick", [left - 7.0, top + 15.0], Anchor::End, &strip.label);
        let space = if strip.unit.is_empty() { "" } else { " " };
        let most = if largest < 1e5 { format!("{largest:.1}") } else { format!("{largest:.1e}") };
        canvas.text(
            "tick",
            [right + 8.0, top + 9.0],
            Anchor::Start,
            &format!("max {most}{space}{}", strip.unit),
        );
    }
}

impl Matrix {
    /// Draws the matrix.
    pub fn svg(&self) -> Svg {
        const CELL: f64 = 34.0;
        const LINE: f64 = 21.0;
        let left = self.names.iter().map(|n| text_width(n)).fold(60.0, f64::max) + 12.0;
        // Names of columns lean by 45 deg.
        let head = 0.72 * left + 10.0;
        let top = head + 26.0;
        let count = self.names.len() as f64;
        let mut canvas = Canvas::new(left + CELL * count + 0.72 * left, top + LINE * count + 8.0);
        let mut x = 4.0;
        for level in &self.levels {
            canvas.rect(&format!("fill h{}", level.bin.min(BINS - 1)), x, 6.0, 20.0, 11.0);
            canvas.text("legend", [x + 26.0, 16.0], Anchor::Start, &level.name);
            x += 26.0 + text_width(&level.name) + 18.0;
        }
        for (i, name) in self.names.iter().enumerate() {
            let middle = left + CELL * (i as f64 + 0.5);
            canvas.text("label", [left - 8.0, top + LINE * i as f64 + 15.0], Anchor::End, name);
            canvas.slanted("label", [middle - 3.0, top - 6.0], name);
            let line_end = left + CELL * count;
            let y = top + LINE * i as f64;
            canvas.line("grid", [left, y], [line_end, y]);
        }
        for (i, row) in self.values.iter().take(self.names.len()).enumerate() {
            for (j, &value) in row.iter().take(self.names.len()).enumerate() {
                if !value.is_nan() {
                    let (x, y) = (left + CELL * j as f64, top + LINE * i as f64);
                    if let Some(level) = self.levels.iter().find(|l| value < l.below) {
                        let class = format!("fill h{}", level.bin.min(BINS - 1));
                        canvas.rect(&class, x + 1.0, y + 1.0, CELL - 2.0, LINE - 2.0);
                    }
                    canvas.text("cell", [x + 0.5 * CELL, y + 15.0], Anchor::Middle, &short(value));
                }
            }
        }
        let width = px(canvas.width);
        let natural = format!(r#"style="max-width:{width}px;min-width:min({width}px,1000px)""#);
        canvas.finish("chart natural", &self.label, &natural)
    }
}

/// A number in four characters.
fn short(value: f64) -> String {
    let size = value.abs();
    if size >= LARGEST {
        "\u{221e}".to_owned()
    } else if size >= 1000.0 {
        ">999".to_owned()
    } else if size >= 9.95 {
        format!("{value:.0}")
    } else {
        format!("{value:.1}")
    }
}
