//! The scene of flights: plain numbers on one clock, and the pieces that are drawn.

use super::body::{ARROWS, Body, Piece, pieces};
use super::mesh::{MESHES, Mesh, triangles};
use super::moments::{Moment, moments};
use super::track::{Between, Clock, Kind, Track};
use super::{RotorNumbers, ViewFlight};
use serde::Serialize;
use squirrel_log::FlightLog;
use std::collections::BTreeMap;

/// Instants a second, the first that keeps a page below [`INSTANTS`].
const RATES_HZ: [f64; 6] = [50.0, 25.0, 10.0, 5.0, 2.0, 1.0];
/// Instants of all flights of a page: a megabyte or a little more.
const INSTANTS: f64 = 10_000.0;
/// Obstacles further from the path are not drawn, m.
const NEAR_M: f64 = 15.0;
/// Flights that are never lower have a level plane in place of the ground, m.
const HIGH_M: f64 = 4.0;
/// Triangles and draw calls of the ground.
const GROUND: [usize; 2] = [2, 1];

/// A flight of the scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SceneFlight {
    /// Name.
    pub name: String,
    /// Instants of its tracks.
    pub clock: Clock,
    /// What is taken from the log's time for that of the page, s.
    pub shift_s: f64,
    /// Vehicle.
    pub body: Body,
    /// What moves, by name: `position`, `attitude`, `deployment`, `rotor_speed`, ...
    pub tracks: BTreeMap<&'static str, Track>,
    /// When wings began to open, were half open and were open.
    pub moments: Vec<Moment>,
    /// Sentences on what the log lacks and what is drawn instead.
    pub lacks: Vec<String>,
    /// Obstacles that are too far from the path to be drawn.
    pub obstacles_left_out: usize,
    /// What is drawn.
    pub(super) pieces: Vec<Piece>,
}

/// Flights as a page shows them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scene {
    /// First and last instant, s of the page.
    pub range_s: [f64; 2],
    /// Whether flights that shared no time were moved to begin together.
    pub moved: bool,
    /// Where the ground is, or a level plane below a flight high above it, m down.
    pub ground_m: f64,
    /// Width of a square of the ground, m.
    pub cell_m: f64,
    /// Size of a vehicle: mean distance of its rotors from the middle, m.
    pub reach_m: f64,
    /// Length of an arrow, m a newton.
    pub arrow_m_per_n: f64,
    /// Length of an arrow, m for each m/s.
    pub arrow_s: f64,
    /// Triangles of a frame that shows everything.
    pub triangles: usize,
    /// Draw calls of that frame.
    pub draw_calls: usize,
    /// Flights.
    pub flights: Vec<SceneFlight>,
    pub(super) meshes: BTreeMap<&'static str, Mesh>,
}

/// The first of these channels that the log has, with its time axis.
fn first<'a>(log: &'a FlightLog, names: &[&'static str]) -> Option<(&'static str, &'a [f64])> {
    let has = |name: &&'static str| {
        let (times, channel) = log.channel(name)?;
        (!times.is_empty() && channel.values.len() == times.len() * channel.width)
            .then_some((*name, times))
    };
    names.iter().find_map(has)
}

const POSITION: [&str; 3] =
    ["truth.position_ned_m", "estimate.position_ned_m", "gnss.position_ned_m"];
const VELOCITY: [&str; 3] =
    ["truth.velocity_ned_m_s", "estimate.velocity_ned_m_s", "gnss.velocity_ned_m_s"];
const ATTITUDE: [&str; 3] = [
    "truth.q_ned_from_body_wxyz",
    "estimate.q_ned_from_body_wxyz",
    "attitude.q_ned_from_body_wxyz",
];
const REFERENCE: [&str; 2] = ["offboard.reference.position_ned_m", "reference.position_ned_m"];

/// Begin and end of what moves a vehicle, s of the log.
fn span(flight: &ViewFlight<'_>) -> Result<[f64; 2], String> {
    let found = [first(flight.log, &POSITION), first(flight.log, &ATTITUDE)];
    let times = || found.iter().flatten().flat_map(|(_, times)| [times[0], times[times.len() - 1]]);
    let begin = times().fold(f64::INFINITY, f64::min);
    let end = times().fold(f64::NEG_INFINITY, f64::max);
    if begin.is_finite() && end.is_finite() && end - begin < 1e7 {
        return Ok([begin, end]);
    }
    Err(nothing())
}

/// Why a flight cannot be shown.
fn nothing() -> String {
    let [attitude, position] = [ATTITUDE, POSITION].map(|names| names.join(", "));
    format!("has no attitude ({attitude}) and no position ({position})")
}

/// The scene of one or more flights.
///
/// # Errors
/// Which flight, by its place, has nothing that could be drawn, and what it would have to have.
pub fn scene(flights: &[ViewFlight<'_>]) -> Result<Scene, (usize, String)> {
    let spans = flights.iter().enumerate().map(|(i, flight)| span(flight).map_err(|e| (i, e)));
    let spans = spans.collect::<Result<Vec<_>, _>>()?;
    let apart = spans.iter().any(|[begin, _]| spans.iter().any(|[_, end]| begin > end));
    let whole: f64 = spans.iter().map(|[begin, end]| end - begin).sum();
    let rate_hz = RATES_HZ.into_iter().find(|rate| rate * whole <= INSTANTS);
    let rate_hz = rate_hz.unwrap_or(INSTANTS / whole);

    let mut seen: Vec<SceneFlight> = Vec::new();
    for (flight, [begin, end]) in flights.iter().zip(&spans) {
        let count = ((end - begin) * rate_hz + 1e-6).floor() as usize + 1;
        let clock = Clock { begin_s: *begin, rate_hz, count };
        let one = see(flight, clock, if apart { *begin } else { 0.0 });
        if !["position", "attitude"].iter().any(|name| one.tracks.contains_key(name)) {
            return Err((seen.len(), nothing()));
        }
        seen.push(one);
    }
    let shifted = || spans.iter().zip(&seen).map(|(span, f)| span.map(|t| t - f.shift_s));
    let range_s = [
        shifted().map(|s| s[0]).fold(f64::INFINITY, f64::min),
        shifted().map(|s| s[1]).fold(f64::NEG_INFINITY, f64::max),
    ];
    let reach_m = seen.iter().map(|f| f.body.reach_m()).fold(0.0, f64::max);
    let weight_n = seen.iter().filter_map(|f| f.body.weight_n).fold(0.0, f64::max);
    let mut scene = Scene {
        range_s,
        moved: apart,
        ground_m: ground_m(&seen, reach_m),
        cell_m: if reach_m >= 0.08 { 1.0 } else { 0.1 },
        reach_m,
        arrow_m_per_n: if weight_n > 0.0 { 2.6 * reach_m / weight_n } else { 0.05 },
        arrow_s: 0.25 * reach_m,
        triangles: 0,
        draw_calls: 0,
        flights: seen,
        meshes: MESHES.into_iter().map(|(name, make)| (name, make())).collect(),
    };
    scene.add_obstacles(flights);
    scene.count();
    Ok(scene)
}

/// The ground is where heights begin, or below the lowest point. Of a flight high above it a level
/// plane is shown instead, a whole number of metres up: without one nothing moves past.
fn ground_m(flights: &[SceneFlight], reach_m: f64) -> f64 {
    let lowest = |f: &SceneFlight| {
        let rows = f.tracks.get("position").map(Track::rows)?;
        rows.iter().map(|p| p[2]).filter(|z| !z.is_nan()).reduce(f64::max)
    };
    let lowest = flights.iter().filter_map(lowest).reduce(f64::max);
    let below = |z: f64| z + 2.0 * reach_m;
    lowest.map_or(4.0 * reach_m, |z| match z {
        z if z > 0.0 => below(z),
        z if z > -HIGH_M => 0.0,
        z => below(z).ceil(),
    })
}

/// Reads what a scene has of one log.
fn see(flight: &ViewFlight<'_>, clock: Clock, shift_s: f64) -> SceneFlight {
    let (log, mut tracks) = (flight.log, BTreeMap::new());
    let mut add = |name: &'static str, from: &[&'static str], width, step, between| {
        let kind = Kind { width, step, between };
        let found = from.iter().find_map(|channel| Track::of(log, channel, kind, clock));
        if let Some(track) = found {
            tracks.entry(name).or_insert(track);
        }
    };
    let (three, line) = (Some(3), Between::Line);
    add("position", &POSITION, three, 1e-3, line);
    add("attitude", &ATTITUDE, Some(4), 1e-4, Between::Turn);
    add("velocity", &VELOCITY, three, 1e-3, line);
    add("reference", &REFERENCE, three, 1e-3, line);
    if flight.body.wing.is_some() {
        add("deployment", &["wing.deployment"], Some(2), 1e-3, line);
        add("wing_command", &["wing.command"], Some(2), 1e-3, Between::Hold);
        add("deployment", &["wing.command"], Some(2), 1e-3, Between::Hold);
        add("wing_force", &["truth.wing_force_body_n"], three, 1e-3, line);
    }

    add("wind", &["truth.wind_ned_m_s"], three, 1e-2, line);
    tracks.extend(rotor_speed(flight, clock).map(|track| ("rotor_speed", track)));
    tracks.extend(thrust(flight, clock).map(|track| ("thrust", track)));
    let count = |name: &str| match name {
        "weight" => usize::from(flight.body.weight_n.is_some()),
        "thrust" => tracks.get(name).map_or(0, |track| track.width),
        // One on each wing.
        "wing_force" => 2 * usize::from(tracks.contains_key(name)),
        name => usize::from(tracks.contains_key(name)),
    };
    let arrows = ARROWS.map(|(name, _)| (name, count(name)));
    SceneFlight {
        name: flight.name.clone(),
        clock,
        shift_s,
        body: flight.body.clone(),
        moments: tracks.get("deployment").map_or_else(Vec::new, |track| moments(track, clock)),
        lacks: flight.notes.iter().cloned().chain(lacks(flight, &tracks)).collect(),
        obstacles_left_out: 0,
        pieces: pieces(&flight.body, &arrows, tracks.contains_key("reference")),
        tracks,
    }
}

/// A track of what is known of each rotor.
fn of_rotors(
    flight: &ViewFlight<'_>,
    clock: Clock,
    kind: Kind,
    pick: fn(&RotorNumbers) -> &Vec<f64>,
) -> Option<Track> {
    let (numbers, count) = (flight.rotors.as_ref()?, flight.body.rotors.len());
    let (times, _) = flight.log.channel(numbers.from)?;
    let values = pick(numbers);
    let row = |i: usize| values[i * count..(i + 1) * count].to_vec();
    (values.len() == times.len() * count)
        .then(|| Track::from_rows(numbers.from, times, row, count, (kind, clock)))?
}

/// Speed of each rotor, rad/s.
fn rotor_speed(flight: &ViewFlight<'_>, clock: Clock) -> Option<Track> {
    let kind = Kind { width: Some(flight.body.rotors.len()), step: 1.0, between: Between::Line };
    of_rotors(flight, clock, kind, |numbers| &numbers.speed_rad_s)
        .or_else(|| Track::of(flight.log, "rotor.speed_rad_s", kind, clock))
}

/// Thrust of each rotor by its speed, else as the mixer meant it, else of all together.
fn thrust(flight: &ViewFlight<'_>, clock: Clock) -> Option<Track> {
    let (log, rotors) = (flight.log, flight.body.rotors.len());
    let kind = |width| Kind { width: Some(width), step: 1e-3, between: Between::Line };
    of_rotors(flight, clock, kind(rotors), |numbers| &numbers.thrust_n)
        .or_else(|| Track::of(log, "control.inner.rotor_thrust_n", kind(rotors), clock))
        .or_else(|| Track::of(log, "control.inner.thrust_n", kind(1), clock))
}

/// What a log lacks, and what the scene shows instead.
fn lacks(flight: &ViewFlight<'_>, tracks: &BTreeMap<&'static str, Track>) -> Vec<String> {
    let wing = flight.body.wing.is_some();
    let asked: [(&str, bool, &str); 7] = [
        ("position", true, "no position: the vehicle stays at the origin"),
        ("attitude", true, "no attitude: the vehicle is drawn level"),
        ("deployment", wing, "no wing.deployment and no wing.command: wings are drawn folded"),
        ("rotor_speed", true, "no rotor.speed_rad_s: rotors stand still"),
        ("thrust", true, "no rotors of a known vehicle, nor control.inner: no arrows of thrust"),
        ("wing_force", wing, "no truth.wing_force_body_n: no arrow of the wings' force"),
        ("wind", true, "no truth.wind_ned_m_s: no arrow of wind"),
    ];
    let missing = asked.into_iter().filter(|(name, of_it, _)| *of_it && !tracks.contains_key(name));
    let mut sentences: Vec<String> =
        missing.map(|(_, _, what)| format!("{}: the log has {what}.", flight.name)).collect();
    let name = &flight.name;
    if tracks.get("rotor_speed").is_some_and(|track| track.from == "rotor.command") {
        sentences.push(format!(
            "{name}: rotors turn as commanded, without lag; the log has no rotor.speed_rad_s."
        ));
    }
    if tracks.get("deployment").is_some_and(|track| track.from == "wing.command") {
        sentences
            .push(format!("{name}: wings are drawn as commanded; the log has no wing.deployment."));
    }
    sentences
}

impl Scene {
    /// Obstacles near a path, as high as the flight and more.
    fn add_obstacles(&mut self, flights: &[ViewFlight<'_>]) {
        let ground = self.ground_m;
        for (seen, flight) in self.flights.iter_mut().zip(flights) {
            let path = seen.tracks.get("position").map(Track::rows).unwrap_or_default();
            let top = path.iter().map(|p| p[2]).filter(|z| !z.is_nan()).fold(ground, f64::min);
            let height = (1.3 * (ground - top)).max(2.0);
            for &[north, east, radius] in &flight.obstacles {
                let apart = |p: &Vec<f64>| (p[0] - north).hypot(p[1] - east) - radius;
                let sound = [north, east].iter().all(|x| x.abs() < 1e6) && radius > 0.0;
                if !(sound && path.iter().any(|p| apart(p) < NEAR_M)) {
                    seen.obstacles_left_out += 1;
                    continue;
                }
                let middle = ground - 0.5 * height;
                let [r, n, e, h, m] = [radius, north, east, height, middle].map(|x| x as f32);
                let at = [r, 0.0, 0.0, n, 0.0, r, 0.0, e, 0.0, 0.0, h, m];
                let (mesh, on) = ("cylinder", "world".to_owned());
                seen.pieces.push(Piece { mesh, on, ink: "block", alpha: 0.5, at });
            }
        }
    }

    /// Triangles and draw calls of a frame in which each flight has its view: its pieces, its path
    /// and that of its reference (two triangles a segment), the ground.
    fn count(&mut self) {
        for flight in &self.flights {
            let lines = ["position", "reference"];
            let lines = lines.iter().filter(|name| flight.tracks.contains_key(*name)).count();
            let pieces: usize = flight.pieces.iter().map(|piece| triangles(piece.mesh)).sum();
            self.triangles += pieces + lines * 2 * (flight.clock.count - 1) + GROUND[0];
            self.draw_calls += flight.pieces.len() + lines + GROUND[1];
        }
    }

    /// The scene as text that can stand in a page: nothing in it ends a script.
    pub fn json(&self) -> String {
        serde_json::to_string(self).unwrap_or_default().replace('<', "\\u003c")
    }
}
