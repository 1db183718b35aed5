//! The pictures of README and guide: `cargo xtask pictures`.
//!
//! Writes two files into the folder that is its argument. `wing.svg` is the wing over measured
//! plates. `avoidance.svg` flies the manoeuvre of `squirrel demo` (scenario `avoid`, seed 1) with a
//! little less thrust: the tracks from above, and height over time. `twcc_plus` stands for
//! `twcc_oracle`, whose track hides that of `twcc_flat`.

mod wing;

use squirrel_log::FlightLog;
use squirrel_report::chart::{Axis, Ink, Note, Obstacle, Range, Svg, Track, TrackChart};
use squirrel_report::picture::picture;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{Integrator, Setup};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;
use std::error::Error;
use std::path::PathBuf;

/// Who flies, in which colour and under which name.
const ARMS: [(Arm, Ink, &str); 3] = [
    (Arm::Pc, Ink::Series(1), "pc (wings folded)"),
    (Arm::TwccFlat, Ink::Series(0), "twcc_flat (wings)"),
    (Arm::TwccPlus, Ink::Series(2), "twcc_plus (wings, ours)"),
];
/// Where their names stand beside the height over time: s, m above the height that was wanted, and
/// whether the name ends there.
const NAMES: [(f64, f64, bool); 3] = [(3.3, -4.6, true), (3.4, -3.4, true), (-0.8, 0.9, false)];
const THRUST_TO_WEIGHT: f64 = 1.2;
const BEFORE_S: f64 = 1.0;
const AFTER_S: f64 = 6.0;

/// What is drawn of a flight: time since the obstacle is seen, s, and north, east and height, m.
struct Path(Vec<(f64, [f64; 3])>);

impl Path {
    /// A channel of positions around the moment when the obstacle is seen.
    fn of(log: &FlightLog, channel: &str) -> Result<Self, Box<dyn Error>> {
        let seen_s = seen_s(log)?;
        let (time_s, positions) = log.channel(channel).ok_or("no such channel")?;
        let points = time_s.iter().enumerate().map(|(i, time_s)| {
            let p = positions.row(i);
            (time_s - seen_s, [p[0], p[1], -p[2]])
        });
        Ok(Self(points.filter(|(time_s, _)| (-BEFORE_S..=AFTER_S).contains(time_s)).collect()))
    }

    /// As a chart shows it, with a dot each second.
    fn track(&self, name: &str, ink: Ink, project: impl Fn(f64, &[f64; 3]) -> [f64; 2]) -> Track {
        let dashed = ink == Ink::Reference;
        let marks =
            self.0.windows(2).filter(|pair| !dashed && pair[0].0.floor() < pair[1].0.floor());
        Track {
            name: name.to_owned(),
            ink,
            dashed,
            points: self.0.iter().map(|(t, p)| project(*t, p)).collect(),
            values: Vec::new(),
            marks: marks.map(|pair| project(pair[1].0, &pair[1].1)).collect(),
        }
    }
}

/// When the obstacle is seen: the reference, straight north until then, turns back.
fn seen_s(log: &FlightLog) -> Result<f64, Box<dyn Error>> {
    let (time_s, reference) = log.channel("reference.position_ned_m").ok_or("no reference")?;
    let turned = (1..time_s.len()).find(|i| reference.row(*i)[0] < reference.row(i - 1)[0]);
    Ok(time_s[turned.ok_or("the reference never turns")?])
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("usage: pictures FOLDER")?);
    std::fs::create_dir_all(&folder)?;
    wing::draw(&folder)?;
    let scenario =
        Scenario { seed: 1, thrust_to_weight: Some(THRUST_TO_WEIGHT), ..Scenario::find("avoid")? };
    let (mut paths, mut references, mut lost_m) = (Vec::new(), Vec::new(), Vec::new());
    for (arm, ..) in ARMS {
        let (vehicle, scenario) = (VehicleFile::squirrel(), scenario.clone());
        let flight =
            Setup { vehicle, arm, scenario, integrator: Integrator::Rk4 }.fly(true, |_| {})?;
        let log = flight.log.ok_or("no log")?;
        paths.push(Path::of(&log, "truth.position_ned_m")?);
        references.push(Path::of(&log, "reference.position_ned_m")?);
        lost_m.push(flight.metrics.height_lost_m);
    }
    let drawings = [
        above(&references[0], &paths, &scenario.all_obstacles()),
        height(&references[0], &paths, &lost_m, scenario.height_m),
    ];
    let lead = [
        "A quadrotor flies north at 7.3 m/s, sees an obstacle 4 m ahead and has to turn back by 110 to 130 deg.",
        "Its rotors lift 1.2 times its weight. Simulated; a dot each second; the obstacle is seen but not solid.",
    ];
    let text =
        picture("The avoidance manoeuvre: with folded wings the drone sinks", &lead, &drawings);
    Ok(std::fs::write(folder.join("avoidance.svg"), text)?)
}

/// The reference, and who should follow it.
fn tracks(
    reference: &Path,
    paths: &[Path],
    project: impl Fn(f64, &[f64; 3]) -> [f64; 2] + Copy,
) -> Vec<Track> {
    let arms =
        ARMS.iter().zip(paths).map(|((arm, ink, _), path)| path.track(arm.name(), *ink, project));
    std::iter::once(reference.track("", Ink::Reference, project)).chain(arms).collect()
}

fn note(at: [f64; 2], text: &str, ink: Ink, ends: bool) -> Note {
    Note { at, text: text.to_owned(), ink, ends }
}

fn above(reference: &Path, paths: &[Path], obstacles: &[[f64; 3]]) -> Svg {
    let discs = obstacles.iter().map(|o| Obstacle::Disc { centre: [o[1], o[0]], radius: o[2] });
    let mut notes: Vec<Note> = obstacles
        .iter()
        .map(|o| note([o[1] - o[2], o[0]], "obstacle", Ink::Reference, true))
        .collect();
    if let Some((_, [north, east, _])) = reference.0.iter().rfind(|(time_s, _)| *time_s <= 2.4) {
        notes.push(note([*east, *north], "reference", Ink::Reference, true));
    }
    TrackChart {
        label: "tracks from above".to_owned(),
        width: 405.0,
        plot_height: None,
        x: Axis::new("east", "m").with_range(Range::Including(-7.0, 30.0)),
        y: Axis::new("from above: north", "m"),
        tracks: tracks(reference, paths, |_, p| [p[1], p[0]]),
        obstacles: discs.collect(),
        notes,
        values: None,
    }
    .svg()
}

fn height(reference: &Path, paths: &[Path], lost_m: &[f64], wanted_m: f64) -> Svg {
    let names =
        ARMS.iter().zip(NAMES).zip(lost_m).map(|(((_, ink, name), (at_s, up_m, ends)), lost_m)| {
            note([at_s, wanted_m + up_m], &format!("{name} sinks {lost_m:.1} m"), *ink, ends)
        });
    let tracks = tracks(reference, paths, |time_s, p| [time_s, p[2]]);
    TrackChart {
        label: "height over time".to_owned(),
        width: 405.0,
        plot_height: Some(250.0),
        x: Axis::new("time since the obstacle was seen", "s")
            .with_range(Range::Exact(-BEFORE_S, AFTER_S)),
        y: Axis::new("height", "m").with_range(Range::Including(wanted_m - 6.0, wanted_m + 2.0)),
        // Their names stand in the plot.
        tracks: tracks.into_iter().map(|track| Track { name: String::new(), ..track }).collect(),
        obstacles: Vec::new(),
        notes: names.collect(),
        values: None,
    }
    .svg()
}
