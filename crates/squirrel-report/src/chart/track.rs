//! Track plots: a path in a plane whose colour is a value, with obstacles, and equal scales where
//! shape matters.

use super::axis::{Axis, Range, extent};
use super::colour::{Ink, Ramp, Values};
use super::legend::{Key, Legend};
use super::plot::Plot;
use super::scale::Scale;
use super::svg::{Anchor, Canvas, Path, Svg, text_width};
use super::thin::{along, runs};

/// A path in the plane.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// Name in the legend; empty for none.
    pub name: String,
    /// Colour of the marks, and of the path where it has no values.
    pub ink: Ink,
    /// Drawn dashed.
    pub dashed: bool,
    /// x and y in the units of the axes; NaN is a gap.
    pub points: Vec<[f64; 2]>,
    /// One number for each point that becomes its colour; empty for a path in its own ink.
    pub values: Vec<f64>,
    /// Points to mark with a dot, such as one each second.
    pub marks: Vec<[f64; 2]>,
}

/// Something not to fly into.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Obstacle {
    /// A circle seen from above.
    Disc {
        /// Centre in the units of the axes.
        centre: [f64; 2],
        /// Radius in the unit of the x axis.
        radius: f64,
    },
    /// An upright obstacle seen from the side, as high as the plot.
    Column {
        /// Left and right end in the unit of the x axis.
        x: [f64; 2],
    },
}

/// A word at a point, in the colour of what it names.
#[derive(Debug, Clone, PartialEq)]
pub struct Note {
    /// Where it begins, or ends, in the units of the axes.
    pub at: [f64; 2],
    /// The word.
    pub text: String,
    /// Colour.
    pub ink: Ink,
    /// Ends at the point instead of beginning there.
    pub ends: bool,
}

/// A track plot.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackChart {
    /// What the chart shows, for readers who cannot see it.
    pub label: String,
    /// Width, px.
    pub width: f64,
    /// Height of the plot area, px; `None` for equal scales on both axes, which then decide the
    /// height.
    pub plot_height: Option<f64>,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Tracks, the later ones in front.
    pub tracks: Vec<Track>,
    /// Obstacles.
    pub obstacles: Vec<Obstacle>,
    /// Words in the plot, in front of everything.
    pub notes: Vec<Note>,
    /// What the colour measures; `None` if no track has values.
    pub values: Option<Values>,
}

const LEFT: f64 = 46.0;
const RIGHT: f64 = 14.0;
const BAR: f64 = 96.0;
const TALLEST: f64 = 440.0;

impl TrackChart {
    /// Draws the chart.
    pub fn svg(&self) -> Svg {
        let width = self.width - LEFT - RIGHT;
        let right = self.width - RIGHT;
        let mut legend = Legend::new(LEFT, right, LEFT);
        for track in &self.tracks {
            let dashed = if track.dashed { " dashed" } else { "" };
            legend.add(Key::Line, format!("{}{dashed}", track.ink.class()), &track.name);
        }
        let (x, y, height) = self.scales(width);
        let top = 38.0;
        let plot = Plot { x, y, left: LEFT, right, top, bottom: top + height };
        let mut canvas = Canvas::new(self.width, top + height + 38.0);

        plot.grid(&mut canvas, plot.bottom);
        for obstacle in &self.obstacles {
            draw_obstacle(&mut canvas, &plot, *obstacle);
        }
        for track in &self.tracks {
            self.draw_track(&mut canvas, &plot, track);
        }
        for track in &self.tracks {
            for mark in track.marks.iter().map(|m| plot.point(*m)).filter(|m| !m[0].is_nan()) {
                canvas.circle(&format!("dot {}", track.ink.class()), mark, 3.2);
            }
        }
        for note in &self.notes {
            let [x, y] = plot.point(note.at);
            let (anchor, x) =
                if note.ends { (Anchor::End, x - 8.0) } else { (Anchor::Start, x + 8.0) };
            if x.is_finite() {
                canvas.text(
                    &format!("note {}", note.ink.class()),
                    [x, y + 4.0],
                    anchor,
                    &note.text,
                );
            }
        }
        canvas.text("axis", [4.0, 12.0], Anchor::Start, &self.y.title());
        canvas.text("axis", [right, plot.bottom + 33.0], Anchor::End, &self.x.title());
        legend.draw(&mut canvas, plot.bottom + 33.0);
        if let Some(values) = &self.values {
            let free = right - 4.0 - text_width(&self.y.title()) - values.bar_title_width() - 14.0;
            values.bar(&mut canvas, Ramp::Track, right - 4.0, 3.0, BAR.min(free.max(30.0)));
        }
        canvas.finish("chart", &self.label, "")
    }

    /// The two scales and the height of the plot, px.
    fn scales(&self, width: f64) -> (Scale, Scale, f64) {
        let x = range(&self.x, self.coordinates(0));
        let y = range(&self.y, self.coordinates(1));
        let intervals = |px: f64| ((px / 55.0) as usize).clamp(2, 10);
        if let Some(height) = self.plot_height {
            return (
                Scale::exact(x[0], x[1], intervals(width)),
                self.y.scale(self.coordinates(1), 4),
                height,
            );
        }
        // A sane scale has a positive finite span, whatever the data.
        let spans = [x, y]
            .map(|r| Scale::exact(r[0], r[1], 2))
            .map(|s| [f64::midpoint(s.lo(), s.hi()), s.hi() - s.lo()]);
        let [[x_middle, x_span], [y_middle, y_span]] = spans;
        // Equal scales: a long narrow track gets air on its sides instead of a very tall or flat
        // plot.
        let height = (width * (y_span / x_span).clamp(0.4, 1.3)).min(TALLEST);
        let per_px = (x_span / width).max(y_span / height);
        let scale = |middle: f64, px: f64| {
            let half = 0.5 * px * per_px;
            Scale::exact(middle - half, middle + half, intervals(px))
        };
        (scale(x_middle, width), scale(y_middle, height), height)
    }

    /// All coordinates of one axis, obstacles included.
    fn coordinates(&self, axis: usize) -> impl Iterator<Item = f64> {
        let points = self.tracks.iter().flat_map(move |t| t.points.iter().map(move |p| p[axis]));
        points.chain(self.obstacles.iter().flat_map(move |o| match *o {
            Obstacle::Disc { centre, radius } => [centre[axis] - radius, centre[axis] + radius],
            Obstacle::Column { x } if axis == 0 => x,
            Obstacle::Column { .. } => [f64::NAN; 2],
        }))
    }

    fn draw_track(&self, canvas: &mut Canvas, plot: &Plot, track: &Track) {
        let points = track.points.iter().map(|p| plot.point(*p)).collect::<Vec<_>>();
        let kept = along(&points, 1.5);
        let path = |kept: &[usize]| Path::through(kept.iter().map(|&i| points[i]));
        let dashed = if track.dashed { " dashed" } else { "" };
        match &self.values {
            Some(values) if !track.values.is_empty() => {
                let value = |i: usize| track.values.get(i).copied().unwrap_or(f64::NAN);
                let bin = |i: usize| values.bin(0.5 * (value(kept[i]) + value(kept[i + 1])));
                let gap = |i: usize| points[kept[i]][0].is_nan() || points[kept[i + 1]][0].is_nan();
                for run in runs(kept.len(), usize::MAX, bin, gap) {
                    let class = run.bin.map_or_else(|| "muted".to_owned(), |bin| format!("v{bin}"));
                    canvas.path(&format!("track {class}"), &path(&kept[run.first..=run.last]));
                }
            }
            _ => canvas.path(&format!("line {}{dashed}", track.ink.class()), &path(&kept)),
        }
    }
}

/// The range of an axis with a little air around data, so that no track runs along the frame.
fn range(axis: &Axis, data: impl Iterator<Item = f64>) -> [f64; 2] {
    let (lo, hi) = match axis.range {
        Range::Exact(lo, hi) => return [lo, hi],
        Range::Data => extent(data),
        Range::Including(a, b) => extent(data.chain([a, b])),
    }
    .unwrap_or((0.0, 1.0));
    let air = 0.05 * (hi - lo);
    [lo - air, hi + air]
}

fn draw_obstacle(canvas: &mut Canvas, plot: &Plot, obstacle: Obstacle) {
    match obstacle {
        Obstacle::Disc { centre, radius } => {
            let centre_px = plot.point(centre);
            let radius_px = plot.x_px(centre[0] + radius) - centre_px[0];
            if radius_px > 0.0 && centre_px[0].is_finite() {
                canvas.circle("obstacle", centre_px, radius_px);
            }
        }
        Obstacle::Column { x } => {
            let [from, to] = x.map(|x| plot.x_px(x).clamp(plot.left, plot.right));
            if to > from {
                canvas.rect("obstacle", from, plot.top, to - from, plot.bottom - plot.top);
            }
        }
    }
}
