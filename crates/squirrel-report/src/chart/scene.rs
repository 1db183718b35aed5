//! Tracks in three dimensions: an orthographic view from a fixed side, which the script of the page
//! can turn.
//!
//! Points are stored in the drawing as pixels around the middle of the box (`data-p`, `data-c`,
//! `data-t`), so the script only rotates; this file draws the first view with the same formulas,
//! and the picture stands without the script.

use super::axis::{Axis, extent};
use super::colour::{Ink, Ramp, Values};
use super::legend::{Key, Legend};
use super::scale::{Scale, drawable};
use super::svg::{Canvas, Path, Svg, escape, px};
use super::thin::{along, runs};

/// A track in space.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneTrack {
    /// Name in the legend; empty for none.
    pub name: String,
    /// Colour of the marks and of the shadow on the floor, and of the track where it has no values.
    pub ink: Ink,
    /// Drawn dashed and without a shadow.
    pub dashed: bool,
    /// North, east, height, m; NaN is a gap.
    pub points: Vec<[f64; 3]>,
    /// One number for each point that becomes its colour; empty for a track in its own ink.
    pub values: Vec<f64>,
    /// Points to mark with a dot.
    pub marks: Vec<[f64; 3]>,
}

/// An upright cylinder from the floor to the top of the box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cylinder {
    /// North, m.
    pub north_m: f64,
    /// East, m.
    pub east_m: f64,
    /// Radius, m.
    pub radius_m: f64,
}

/// A view of tracks and cylinders over a floor.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// What the scene shows, for readers who cannot see it.
    pub label: String,
    /// North, east and height; the ranges are those of the tracks.
    pub axes: [Axis; 3],
    /// Tracks.
    pub tracks: Vec<SceneTrack>,
    /// Obstacles.
    pub cylinders: Vec<Cylinder>,
    /// What the colour measures; `None` if no track has values.
    pub values: Option<Values>,
}

const WIDTH: f64 = 1160.0;
const HEIGHT: f64 = 550.0;
const TOP: f64 = 40.0;
/// Room for labels left, right and below.
const EDGE: f64 = 40.0;
/// First view: from the south-west, a little above.
const AZIMUTH: f64 = -0.6;
const ELEVATION: f64 = 0.42;

/// The box around everything and the way from metres to pixels around its middle.
#[derive(Debug)]
struct Frame {
    east: Scale,
    north: Scale,
    height: Scale,
    px_per_m: f64,
    /// Half size of the box: east, north, height, px.
    half: [f64; 3],
}

impl Frame {
    /// East, north, height in pixels around the middle of the box, NaN when it cannot be drawn.
    fn place(&self, [north, east, height]: [f64; 3]) -> [f64; 3] {
        if ![north, east, height].into_iter().all(drawable) {
            return [f64::NAN; 3];
        }
        let from_middle = |scale: &Scale, v: f64, half: f64| (2.0 * scale.fraction(v) - 1.0) * half;
        [
            from_middle(&self.east, east, self.half[0]),
            from_middle(&self.north, north, self.half[1]),
            from_middle(&self.height, height, self.half[2]),
        ]
    }

    /// Screen position of a placed point in the first view, and its depth: larger is farther.
    fn view(&self, [e, n, h]: [f64; 3]) -> ([f64; 2], f64) {
        let ((sin_a, cos_a), (sin_e, cos_e)) = (AZIMUTH.sin_cos(), ELEVATION.sin_cos());
        let zoom = self.zoom();
        let (right, away) = (e * cos_a + n * sin_a, n * cos_a - e * sin_a);
        let middle = 0.5 * (HEIGHT + TOP - EDGE);
        (
            [0.5 * WIDTH + zoom * right, middle - zoom * (h * cos_e + away * sin_e)],
            away * cos_e - h * sin_e,
        )
    }

    /// Shrinks the view so that the box fits whatever the azimuth.
    fn zoom(&self) -> f64 {
        let [e, n, h] = self.half;
        let (sin_e, cos_e) = ELEVATION.sin_cos();
        let room = 0.5 * (HEIGHT - TOP - EDGE);
        (room / (e.hypot(n) * sin_e + h * cos_e)).min(1.0)
    }
}

impl Scene {
    /// Draws the first view.
    pub fn svg(&self) -> Svg {
        let frame = self.frame();
        let mut canvas = Canvas::new(WIDTH, HEIGHT);
        draw_floor(&mut canvas, &frame, &self.axes);
        for track in self.tracks.iter().filter(|t| !t.dashed) {
            let shadow = format!("shadow {}", track.ink.class());
            let floor = |p: &[f64; 3]| frame.place([p[0], p[1], frame.height.lo()]);
            let points = track.points.iter().map(floor).collect::<Vec<_>>();
            for stretch in stretches(&points, usize::MAX, |_| None) {
                canvas.raw(&polyline(&frame, &shadow, &stretch.1));
            }
            // Stems tie the dots to the shadow: without them the eye cannot tell height from
            // distance.
            for mark in track.marks.iter().map(|m| frame.place(*m)).filter(|m| !m[0].is_nan()) {
                canvas.raw(&polyline(&frame, &shadow, &[mark, [mark[0], mark[1], -frame.half[2]]]));
            }
        }
        canvas.raw(r#"<g class="solid">"#);
        for (_, markup) in self.solids(&frame) {
            canvas.raw(&markup);
        }
        canvas.raw("</g>");
        self.draw_keys(&mut canvas);
        let [e, n, h] = frame.half.map(px);
        let attributes = format!(
            r#"data-view="{AZIMUTH},{ELEVATION}" data-half="{e},{n},{h}" data-frame="{WIDTH},{HEIGHT},{TOP},{EDGE}""#
        );
        canvas.finish("chart scene", &self.label, &attributes)
    }

    fn frame(&self) -> Frame {
        let points = || self.tracks.iter().flat_map(|t| t.points.iter());
        let disc = |axis: usize| {
            self.cylinders.iter().flat_map(move |c| {
                let centre = if axis == 0 { c.north_m } else { c.east_m };
                [centre - c.radius_m, centre + c.radius_m]
            })
        };
        let range =
            |axis: usize| extent(points().map(|p| p[axis]).chain(disc(axis))).unwrap_or((0.0, 1.0));
        let ((n_lo, n_hi), (e_lo, e_hi)) = (range(0), range(1));
        let (north, east) = (Scale::nice(n_lo, n_hi, 6), Scale::nice(e_lo, e_hi, 6));
        let (h_lo, h_hi) = extent(points().map(|p| p[2])).unwrap_or((0.0, 1.0));
        // The ground is the floor unless the flight is so high that the tracks would float far
        // above it.
        let ground = h_lo >= 0.0 && h_lo <= (n_hi - n_lo).max(e_hi - e_lo);
        let height = Scale::nice(if ground { 0.0 } else { h_lo }, h_hi, 3);
        let spans = [&east, &north, &height].map(|s| s.hi() - s.lo());
        let px_per_m = (WIDTH - 2.0 * EDGE) / spans[0].hypot(spans[1]).max(spans[2]);
        Frame { half: spans.map(|s| 0.5 * s * px_per_m), east, north, height, px_per_m }
    }

    /// Everything that can hide something else, the farthest first.
    fn solids(&self, frame: &Frame) -> Vec<(f64, String)> {
        let mut solids = Vec::new();
        for c in &self.cylinders {
            let middle = frame.place([c.north_m, c.east_m, frame.height.lo()]);
            let radius = c.radius_m * frame.px_per_m;
            if radius > 0.0 && radius.is_finite() && !middle[0].is_nan() {
                solids.push((
                    frame.view([middle[0], middle[1], 0.0]).1,
                    cylinder(frame, middle, radius),
                ));
            }
        }
        for track in &self.tracks {
            let points = track.points.iter().map(|p| frame.place(*p)).collect::<Vec<_>>();
            let value = |i: usize| track.values.get(i).copied().unwrap_or(f64::NAN);
            let bin = |i: usize| self.values.as_ref().and_then(|values| values.bin(value(i)));
            let dashed = if track.dashed { " dashed" } else { "" };
            for (colour, stretch) in stretches(&points, 16, bin) {
                let class = match colour {
                    Some(bin) => format!("track v{bin}"),
                    None => format!("line {}{dashed}", track.ink.class()),
                };
                let middle = stretch[stretch.len() / 2];
                solids.push((frame.view(middle).1, polyline(frame, &class, &stretch)));
            }
            for mark in track.marks.iter().map(|m| frame.place(*m)).filter(|m| !m[0].is_nan()) {
                // A little nearer than its own track, which it would otherwise half hide behind.
                solids.push((frame.view(mark).1 - 4.0, dot(frame, &track.ink.class(), mark)));
            }
        }
        solids.sort_by(|a, b| b.0.total_cmp(&a.0));
        solids
    }

    fn draw_keys(&self, canvas: &mut Canvas) {
        let right = WIDTH - 12.0;
        let bar = if self.values.is_some() { 330.0 } else { 0.0 };
        let mut legend = Legend::new(12.0, right - bar, 12.0);
        for track in &self.tracks {
            let (key, dashed) = if track.dashed { (Key::Line, " dashed") } else { (Key::Dot, "") };
            legend.add(key, format!("{}{dashed}", track.ink.class()), &track.name);
        }
        legend.draw(canvas, 16.0);
        if let Some(values) = &self.values {
            values.bar(canvas, Ramp::Track, right, 6.0, 200.0);
        }
    }
}

/// The thinned track as points of equal colour, at most `longest` segments each.
fn stretches(
    points: &[[f64; 3]],
    longest: usize,
    bin: impl Fn(usize) -> Option<usize>,
) -> Vec<(Option<usize>, Vec<[f64; 3]>)> {
    let kept = along(points, 2.0);
    let gap = |i: usize| points[kept[i]][0].is_nan() || points[kept[i + 1]][0].is_nan();
    runs(kept.len(), longest, |i| bin(kept[i]), gap)
        .into_iter()
        .map(|run| (run.bin, kept[run.first..=run.last].iter().map(|&i| points[i]).collect()))
        .collect()
}

fn triple(p: [f64; 3]) -> String {
    p.map(px).join(",")
}

fn polyline(frame: &Frame, class: &str, points: &[[f64; 3]]) -> String {
    let data = points.iter().map(|p| triple(*p)).collect::<Vec<_>>().join(" ");
    let d = Path::through(points.iter().map(|p| frame.view(*p).0));
    format!(r#"<path class="{class}" d="{d}" data-p="{data}"/>"#)
}

fn dot(frame: &Frame, class: &str, point: [f64; 3]) -> String {
    let [x, y] = frame.view(point).0.map(px);
    format!(r#"<circle class="dot {class}" cx="{x}" cy="{y}" r="4.2" data-p="{}"/>"#, triple(point))
}

/// The outline of an upright cylinder: two half ellipses and its sides, then the whole rim on top.
fn cylinder(frame: &Frame, [e, n, floor]: [f64; 3], radius: f64) -> String {
    let top = -floor;
    let [[x, low], [_, high]] = [floor, top].map(|h| frame.view([e, n, h]).0);
    let rx = frame.zoom() * radius;
    let [left, right, low, high, rx, ry] =
        [x - rx, x + rx, low, high, rx, rx * ELEVATION.sin()].map(px);
    format!(
        r#"<path class="obstacle" d="M{left} {low}A{rx} {ry} 0 0 0 {right} {low}L{right} {high}A{rx} {ry} 0 0 0 {left} {high}ZM{left} {high}A{rx} {ry} 0 0 0 {right} {high}" data-c="{},{}"/>"#,
        triple([e, n, floor]),
        px(radius)
    )
}

/// Grid on the floor, upright scale of height, and labels on the edges that face the reader.
fn draw_floor(canvas: &mut Canvas, frame: &Frame, axes: &[Axis; 3]) {
    let [half_e, half_n, half_h] = frame.half;
    let [east, north] = [(&frame.east, half_e), (&frame.north, half_n)].map(|(s, half)| {
        s.ticks().iter().map(|t| (2.0 * s.fraction(*t) - 1.0) * half).collect::<Vec<_>>()
    });
    for &e in &east {
        canvas.raw(&polyline(frame, "grid", &[[e, -half_n, -half_h], [e, half_n, -half_h]]));
    }
    for &n in &north {
        canvas.raw(&polyline(frame, "grid", &[[-half_e, n, -half_h], [half_e, n, -half_h]]));
    }
    for (e, scale) in east.iter().zip(frame.east.ticks()) {
        canvas.raw(&label(frame, 'e', *e, 26.0, "tick", &frame.east.label(*scale)));
    }
    for (n, scale) in north.iter().zip(frame.north.ticks()) {
        canvas.raw(&label(frame, 'n', *n, 26.0, "tick", &frame.north.label(*scale)));
    }
    // The floor itself goes without a number: the corner below already carries those of the floor
    // edges.
    for tick in frame.height.ticks().iter().skip(1) {
        let h = (2.0 * frame.height.fraction(*tick) - 1.0) * half_h;
        canvas.raw(&label(frame, 'h', h, 14.0, "tick", &frame.height.label(*tick)));
    }
    canvas.raw(&label(frame, 'e', 0.0, 62.0, "axis", &axes[1].title()));
    canvas.raw(&label(frame, 'n', 0.0, 62.0, "axis", &axes[0].title()));
    canvas.raw(&label(frame, 'h', half_h + 22.0, 14.0, "axis", &axes[2].title()));
}

/// A label `offset` px outside the edge of an axis (`e`, `n` or `h`) at `value` px along it.
///
/// The floor edges are those nearer to the reader, the height stands on the leftmost corner.
fn label(frame: &Frame, axis: char, value: f64, offset: f64, class: &str, text: &str) -> String {
    let [half_e, half_n, half_h] = frame.half;
    let (sin_a, cos_a) = AZIMUTH.sin_cos();
    let point = match axis {
        'e' => [value, -cos_a.signum() * (half_n + offset), -half_h],
        'n' => [sin_a.signum() * (half_e + offset), value, -half_h],
        _ => [-cos_a.signum() * (half_e + offset), -sin_a.signum() * (half_n + offset), value],
    };
    let [x, y] = frame.view(point).0.map(px);
    format!(
        r#"<text class="{class}" x="{x}" y="{y}" dy="4" text-anchor="middle" data-t="{axis},{},{}">{}</text>"#,
        px(value),
        px(offset),
        escape(text)
    )
}
