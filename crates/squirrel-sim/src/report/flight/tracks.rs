//! Where the arms flew: in space, from above and from the side.

use super::curves::{Lack, Path, flown, reference, speed};
use super::{FlightView, columns_for, lacks};
use crate::report::chart::{
    Axis, Cylinder, Ink, Obstacle, Range, Scale, Scene, SceneTrack, Svg, Track, TrackChart, Values, extent,
};
use crate::report::page::{Columns, Figure, Page};

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
    flown: Vec<Flown>,
    values: Option<Values>,
    mark_every_s: f64,
    /// Extent of north, east and height over all arms, references and obstacles, m.
    extents: [(f64, f64); 3],
    /// The horizontal axis of the side view, 0 north or 1 east: the one along which the arms flew farther.
    along: usize,
}

const NAMES: [&str; 3] = ["north", "east", "height"];

/// Adds the panels.
pub(super) fn add(page: &mut Page, flights: &[FlightView<'_>]) {
    let tracks = Tracks::new(flights);
    page.section("Tracks", "");
    page.figures(Columns::One, &[tracks.scene()]);
    page.section(
        "From above and from the side",
        &format!(
            "Look for the distance to the obstacle and for speed lost in the turn (a dot every {} s); seen from above both \
             scales are equal, seen from the side height is stretched.",
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
    fn new(flights: &'a [FlightView<'a>]) -> Self {
        let flown = flights.iter().map(|f| Flown::read(f)).collect::<Vec<_>>();
        let paths = || flown.iter().flat_map(|f| f.path.iter().chain(&f.reference));
        let obstacles = || flights.iter().flat_map(|f| f.obstacles);
        let extents = [0, 1, 2].map(|axis| {
            let points = paths().flat_map(|p| p.points.iter().map(|p| p[axis]));
            let discs = obstacles().filter(|_| axis < 2).flat_map(|o| [o[axis] - o[2], o[axis] + o[2]]);
            extent(points.chain(discs)).unwrap_or((0.0, 1.0))
        });
        let speeds = || flown.iter().filter_map(|f| f.speed.as_ref().ok()).flatten().copied();
        let values = extent(speeds()).map(|_| Values::new(&Axis::new("speed", "m/s"), speeds()));
        let times = extent(flown.iter().filter_map(|f| f.path.as_ref().ok()).flat_map(|p| p.time_s.iter().copied()));
        let duration = times.map_or(1.0, |(from, to)| to - from);
        let along = usize::from(extents[1].1 - extents[1].0 > extents[0].1 - extents[0].0);
        let mark_every_s = Scale::nice(0.0, duration, 15).step().max(1.0);
        Self { flights, flown, values, mark_every_s, extents, along }
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
                ink: Ink::Series(i),
                dashed: false,
                points: path.points.clone(),
                values: flown.speed.clone().unwrap_or_default(),
                marks: path.marks(self.mark_every_s),
            });
        }
        let mut cylinders: Vec<Cylinder> = Vec::new();
        for &[north_m, east_m, radius_m] in self.flights.iter().flat_map(|f| f.obstacles) {
            let cylinder = Cylinder { north_m, east_m, radius_m };
            if !cylinders.contains(&cylinder) {
                cylinders.push(cylinder);
            }
        }
        let scene = Scene { label: "3-D tracks".to_owned(), tracks, cylinders, values: self.values.clone() };
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
        self.view(i, "from above", columns, [1, 0], discs.collect())
    }

    fn side(&self, i: usize, columns: Columns) -> Svg {
        let (along, obstacles) = (self.along, self.flights[i].obstacles.iter());
        let uprights = obstacles.map(|o| Obstacle::Column { x: [o[along] - o[2], o[along] + o[2]] });
        self.view(i, "from the side", columns, [along, 2], uprights.collect())
    }

    /// The track of arm `i` projected on two axes.
    fn view(&self, i: usize, what: &str, columns: Columns, axes: [usize; 2], obstacles: Vec<Obstacle>) -> Svg {
        let flat = |points: &[[f64; 3]]| points.iter().map(|p| axes.map(|axis| p[axis])).collect::<Vec<_>>();
        let flown = &self.flown[i];
        let mut tracks = Vec::new();
        if let Ok(path) = &flown.path {
            tracks.push(Track {
                name: String::new(),
                ink: Ink::Series(i),
                dashed: false,
                points: flat(&path.points),
                values: flown.speed.clone().unwrap_or_default(),
                marks: flat(&path.marks(self.mark_every_s)),
            });
        }
        if let Ok(reference) = &flown.reference {
            tracks.push(Track {
                name: "reference".to_owned(),
                ink: Ink::Reference,
                dashed: true,
                points: flat(&reference.points),
                values: Vec::new(),
                marks: Vec::new(),
            });
        }
        TrackChart {
            label: format!("{} {what}", self.flights[i].arm),
            width: columns.width(),
            plot_height: (axes[1] == 2).then_some(0.36 * columns.width()),
            x: self.axis(axes[0]),
            y: self.axis(axes[1]),
            tracks,
            obstacles,
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
