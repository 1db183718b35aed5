//! Where the arms flew: in space, from above and from the side.

use super::curves::{Lack, Path, flown, reference, speed};
use super::{FlightView, columns_for, lacks};
use crate::chart::{
    Axis, Cylinder, Ink, Obstacle, Range, Scale, Scene, SceneTrack, Svg, Track, TrackChart, Values,
    extent,
};
use crate::page::{Columns, Figure, Page};

/// What one arm flew, as far as its log tells.
struct Flown {
    path: Result<Path, Lack>,
    reference: Result<Path, Lack>,
    /// One number for each point of the path, m/s.
    speed: Result<Vec<f64>, Lack>,
}

/// What all track panels share, so that arms can be compared.
struct Tracks<'a> {
    flights: &'a [FlightView<'a>],
    /// Of each flight.
    inks: &'a [Ink],
    flown: Vec<Flown>,
    values: Option<Values>,
    mark_every_s: f64,
    /// Extent of north, east and height over all arms, references and obstacles, m.
    extents: [(f64, f64); 3],
}

const NAMES: [&str; 3] = ["north", "east", "height"];

/// Adds the panels.
pub(super) fn add(page: &mut Page, flights: &[FlightView<'_>], inks: &[Ink]) {
    let tracks = Tracks::new(flights, inks);
    page.section("Tracks", "");
    page.figures(Columns::One, &[tracks.scene()]);
    page.section(
        "From above and from the side",
        &format!(
            "Look for the distance to the obstacle and for height or speed lost in the turn (a dot every {} s); the side view \
             unrolls the track, stretches height, and has an obstacle where the arm passes it.",
            tracks.mark_every_s
        ),
    );
    let columns = columns_for(flights.len());
    let mut figures = Vec::new();
    for (i, flight) in flights.iter().enumerate() {
        let (above, side) = (tracks.above(i, columns), tracks.side(i, columns));
        let figure = |title: &str, drawings, notes| Figure {
            title: title.to_owned(),
            drawings,
            notes,
            ..Figure::default()
        };
        // One arm alone has the width of the page to itself.
        if flights.len() == 1 {
            figures.push(figure("Seen from above", vec![above], tracks.notes(i)));
            figures.push(figure("Seen from the side", vec![side], Vec::new()));
        } else {
            figures.push(figure(flight.arm, vec![above, side], tracks.notes(i)));
        }
    }
    page.figures(columns, &figures);
}

impl<'a> Tracks<'a> {
    fn new(flights: &'a [FlightView<'a>], inks: &'a [Ink]) -> Self {
        let flown = flights.iter().map(|f| Flown::read(f)).collect::<Vec<_>>();
        let paths = || flown.iter().flat_map(|f| f.path.iter().chain(&f.reference));
        let obstacles = || flights.iter().flat_map(|f| &f.obstacles);
        let extents = [0, 1, 2].map(|axis| {
            let points = paths().flat_map(|p| p.points.iter().map(|p| p[axis]));
            let discs =
                obstacles().filter(|_| axis < 2).flat_map(|o| [o[axis] - o[2], o[axis] + o[2]]);
            extent(points.chain(discs)).unwrap_or((0.0, 1.0))
        });
        let speeds = || flown.iter().filter_map(|f| f.speed.as_ref().ok()).flatten().copied();
        let values = extent(speeds()).map(|_| Values::new(&Axis::new("speed", "m/s"), speeds()));
        let times = extent(
            flown
                .iter()
                .filter_map(|f| f.path.as_ref().ok())
                .flat_map(|p| p.time_s.iter().copied()),
        );
        let duration = times.map_or(1.0, |(from, to)| to - from);
        let mark_every_s = Scale::nice(0.0, duration, 15).step().max(1.0);
        Self { flights, inks, flown, values, mark_every_s, extents }
    }

    fn ink(&self, i: usize) -> Ink {
        self.inks.get(i).copied().unwrap_or(Ink::Muted)
    }

    fn axis(&self, axis: usize) -> Axis {
        let (lo, hi) = self.extents[axis];
        Axis::new(NAMES[axis], "m").with_range(Range::Including(lo, hi))
    }

    fn scene(&self) -> Figure {
        let mut tracks = Vec::new();
        for reference in self.flown.iter().filter_map(|f| f.reference.as_ref().ok()).take(1) {
            tracks.push(SceneTrack {
                name: "reference".to_owned(),
                ink: Ink::Reference,
                dashed: true,
                points: reference.points.clone(),
                values: Vec::new(),
                marks: Vec::new(),
            });
        }
        for (i, flown) in self.flown.iter().enumerate() {
            let Ok(path) = &flown.path else { continue };
            tracks.push(SceneTrack {
                name: self.flights[i].arm.to_owned(),
                ink: self.ink(i),
                dashed: false,
                points: path.points.clone(),
                values: flown.speed.clone().unwrap_or_default(),
                marks: path.marks(self.mark_every_s).into_iter().map(|i| path.points[i]).collect(),
            });
        }
        let mut cylinders: Vec<Cylinder> = Vec::new();
        for &[north_m, east_m, radius_m] in self.flights.iter().flat_map(|f| &f.obstacles) {
            let cylinder = Cylinder { north_m, east_m, radius_m };
            if !cylinders.contains(&cylinder) {
                cylinders.push(cylinder);
            }
        }
        let axes = ["north", "east", "height"].map(|name| Axis::new(name, "m"));
        let scene = Scene {
            label: "3-D tracks".to_owned(),
            axes,
            tracks,
            cylinders,
            values: self.values.clone(),
        };
        Figure {
            title: "3-D track of every arm".to_owned(),
            caption: format!(
                "Look for the arm that leaves the dashed reference or loses height; drag to turn, a dot every {} s in the \
                 colour of the arm, whose thin line on the floor is the shadow of the track.",
                self.mark_every_s
            ),
            drawings: vec![scene.svg()],
            notes: (0..self.flights.len()).flat_map(|i| self.notes(i)).collect(),
        }
    }

    fn above(&self, i: usize, columns: Columns) -> Svg {
        let obstacles = self.flights[i].obstacles.iter();
        let discs = obstacles.map(|o| Obstacle::Disc { centre: [o[1], o[0]], radius: o[2] });
        let [north, east] = [self.axis(0), self.axis(1)];
        let flat = |path: &Path| path.points.iter().map(|p| [p[1], p[0]]).collect();
        self.view(i, "from above", columns, (east, north), &flat, discs.collect())
    }

    /// The track unrolled: height over the distance flown. An obstacle stands where the arm passes
    /// it.
    fn side(&self, i: usize, columns: Columns) -> Svg {
        let paths = || self.flown.iter().flat_map(|f| f.path.iter().chain(&f.reference));
        let longest = extent(paths().flat_map(Path::distances)).map_or(1.0, |(_, longest)| longest);
        let distance = Axis::new("distance flown", "m").with_range(Range::Including(0.0, longest));
        let mut columns_passed = Vec::new();
        if let Ok(path) = &self.flown[i].path {
            let passed = self.flights[i]
                .obstacles
                .iter()
                .filter_map(|o| Some((path.nearest([o[0], o[1]])?, o[2])));
            columns_passed.extend(
                passed.map(|(at, radius)| Obstacle::Column { x: [at - radius, at + radius] }),
            );
        }
        let flat = |path: &Path| {
            path.distances().into_iter().zip(&path.points).map(|(d, p)| [d, p[2]]).collect()
        };
        self.view(i, "from the side", columns, (distance, self.axis(2)), &flat, columns_passed)
    }

    /// The track of arm `i` and its reference as `flat` projects them.
    fn view(
        &self,
        i: usize,
        what: &str,
        columns: Columns,
        (x, y): (Axis, Axis),
        flat: &dyn Fn(&Path) -> Vec<[f64; 2]>,
        obstacles: Vec<Obstacle>,
    ) -> Svg {
        let flown = &self.flown[i];
        // Alone the side view stands beside the view from above, otherwise below it.
        let beside = if self.flights.len() == 1 { 360.0 } else { 135.0 };
        let plot_height = (y.label == NAMES[2]).then_some(beside);
        let mut tracks = Vec::new();
        if let Ok(path) = &flown.path {
            let points = flat(path);
            tracks.push(Track {
                name: String::new(),
                ink: self.ink(i),
                dashed: false,
                marks: path.marks(self.mark_every_s).into_iter().map(|i| points[i]).collect(),
                points,
                values: flown.speed.clone().unwrap_or_default(),
            });
        }
        if let Ok(reference) = &flown.reference {
            tracks.push(Track {
                name: "reference".to_owned(),
                ink: Ink::Reference,
                dashed: true,
                points: flat(reference),
                values: Vec::new(),
                marks: Vec::new(),
            });
        }
        TrackChart {
            label: format!("{} {what}", self.flights[i].arm),
            width: columns.width(),
            plot_height,
            x,
            y,
            tracks,
            obstacles,
            notes: Vec::new(),
            values: self.values.clone(),
        }
        .svg()
    }

    fn notes(&self, i: usize) -> Vec<String> {
        let Flown { path, reference, speed } = &self.flown[i];
        let missing = [path.as_ref().err(), reference.as_ref().err(), speed.as_ref().err()];
        missing.into_iter().flatten().map(|lack| lacks(&self.flights[i], lack)).collect()
    }
}

impl Flown {
    fn read(flight: &FlightView<'_>) -> Self {
        Self {
            path: flown(flight.log),
            reference: reference(flight.log),
            speed: speed(flight.log, "truth").map(|curve| curve.values),
        }
    }
}
