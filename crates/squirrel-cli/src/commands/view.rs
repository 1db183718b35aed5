//! `squirrel view`: flights as a scene in three dimensions, on one page.

use crate::output::{self, Table, say, talk};
use crate::paths::Paths;
use serde::Serialize;
use squirrel_core::dynamics::rotors::{spin_signs, thrust_and_moment};
use squirrel_core::vehicle::MAX_ROTORS;
use squirrel_log::FlightLog;
use squirrel_report::view::{
    Body, Moment, RotorNumbers, RotorShape, Scene, ViewFlight, WingShape, render, scene,
};
use squirrel_sim::flight::Setup;
use squirrel_sim::vehicle_file::VehicleFile;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Options of a view.
#[derive(Debug, clap::Args)]
pub(crate) struct View {
    /// Flight log, and another to show beside it.
    #[arg(required = true, num_args = 1..=2, value_name = "FLIGHT")]
    flights: Vec<PathBuf>,
    /// Vehicle to draw, a file or the name of a bundled one; the one in the log if left out.
    #[arg(long)]
    vehicle: Option<PathBuf>,
    /// Page to write (.html); it needs nothing else, and no network.
    #[arg(long)]
    out: PathBuf,
    /// Write the figures here as JSON.
    #[arg(long)]
    json: Option<PathBuf>,
}

#[derive(Serialize)]
struct Viewed {
    bytes: usize,
    triangles: usize,
    draw_calls: usize,
    flights: Vec<Seen>,
}

#[derive(Serialize)]
struct Seen {
    flight: String,
    name: String,
    begin_s: f64,
    end_s: f64,
    rate_hz: f64,
    instants: usize,
    /// What moves, the channel that it comes from, and what one count of it means.
    drawn: BTreeMap<&'static str, Drawn>,
    /// When wings opened.
    moments: Vec<Moment>,
    lacks: Vec<String>,
}

#[derive(Serialize)]
struct Drawn {
    channel: String,
    step: f64,
}

impl View {
    pub(crate) fn run(&self) -> Result<(), String> {
        Paths::default()
            .reads("FLIGHT", &self.flights)
            .vehicle("--vehicle", &self.vehicle)
            .writes("--out", [&self.out])
            .writes("--json", &self.json)
            .check()?;
        let read = |path: &PathBuf| FlightLog::read(path).map_err(|e| e.to_string());
        let logs = self.flights.iter().map(read).collect::<Result<Vec<_>, _>>()?;
        let vehicle = self.vehicle.as_deref().map(VehicleFile::find).transpose();
        let vehicle = vehicle.map_err(|e| e.to_string())?;
        let names = names(&self.flights, &logs);
        let flights =
            logs.iter().zip(&names).map(|(log, name)| flight(log, name, vehicle.as_ref()));
        let flights: Vec<ViewFlight<'_>> = flights.collect();
        let scene = scene(&flights)
            .map_err(|(i, problem)| format!("{}: {problem}", self.flights[i].display()))?;
        let html = render(&names.join(" and "), &facts(&logs), &scene);
        output::write_file(&self.out, html.as_bytes())?;
        output::write_json(self.json.as_deref(), &self.viewed(&scene, html.len()))?;
        print(&scene);
        for note in scene.flights.iter().flat_map(|flight| &flight.lacks) {
            talk(note);
        }
        talk(&format!("wrote {}, {:.0} kB", self.out.display(), html.len() as f64 / 1e3));
        Ok(())
    }

    fn viewed(&self, scene: &Scene, bytes: usize) -> Viewed {
        let seen = self.flights.iter().zip(&scene.flights).map(|(path, flight)| Seen {
            flight: path.display().to_string(),
            name: flight.name.clone(),
            begin_s: flight.clock.begin_s,
            end_s: flight.clock.time_s(flight.clock.count - 1),
            rate_hz: flight.clock.rate_hz,
            instants: flight.clock.count,
            drawn: flight
                .tracks
                .iter()
                .map(|(name, t)| (*name, Drawn { channel: t.from.clone(), step: t.step }))
                .collect(),
            moments: flight.moments.clone(),
            lacks: flight.lacks.clone(),
        });
        let (triangles, draw_calls) = (scene.triangles, scene.draw_calls);
        Viewed { bytes, triangles, draw_calls, flights: seen.collect() }
    }
}

/// The scene of flights that were just flown.
pub(crate) fn scene_of(flights: &[(&Setup, &FlightLog)]) -> Result<Scene, String> {
    let flights = flights
        .iter()
        .map(|(setup, log)| flight(log, setup.arm.name(), Some(&setup.vehicle)))
        .collect::<Vec<_>>();
    scene(&flights).map_err(|(_, problem)| problem)
}

/// What is drawn, in a table.
fn print(scene: &Scene) {
    let mut table = Table::new(&["flight", "from s", "to s", "rate Hz", "wings open at s"]);
    for flight in &scene.flights {
        let clock = flight.clock;
        let open = flight.moments.iter().find(|moment| moment.what == "open");
        table.row(vec![
            flight.name.clone(),
            format!("{:.2}", clock.begin_s),
            format!("{:.2}", clock.time_s(clock.count - 1)),
            clock.rate_hz.to_string(),
            open.map_or_else(|| "-".to_owned(), |moment| format!("{:.2}", moment.time_s)),
        ]);
    }
    table.print();
    say(&format!("{} triangles in {} draw calls a frame", scene.triangles, scene.draw_calls));
}

/// What to call flights: by their arms where these tell them apart, else by their files.
fn names(paths: &[PathBuf], logs: &[FlightLog]) -> Vec<String> {
    let arms: Vec<&String> = logs.iter().filter_map(|log| log.metadata.get("arm")).collect();
    if arms.len() == logs.len() && (arms.len() < 2 || arms[0] != arms[1]) {
        return arms.into_iter().cloned().collect();
    }
    let stem = |path: &Path| path.file_stem().map(|s| s.to_string_lossy().into_owned());
    let stems: Vec<_> = paths.iter().filter_map(|path| stem(path)).collect();
    if stems.len() == paths.len() && (stems.len() < 2 || stems[0] != stems[1]) {
        return stems;
    }
    paths.iter().map(|path| path.display().to_string()).collect()
}

/// What logs say of themselves, once where they agree.
fn facts(logs: &[FlightLog]) -> Vec<(String, String)> {
    let fact = |key: &str| {
        let said = logs.iter().filter_map(|log| log.metadata.get(key).cloned());
        let mut said: Vec<String> = said.collect();
        said.dedup();
        (!said.is_empty()).then(|| (key.to_owned(), said.join(", ")))
    };
    ["vehicle", "arm", "seed", "estimator", "version"].into_iter().filter_map(fact).collect()
}

/// A flight with the vehicle of its log, the one that was asked for, or a stand-in.
fn flight<'a>(log: &'a FlightLog, name: &str, asked: Option<&VehicleFile>) -> ViewFlight<'a> {
    let mut notes = Vec::new();
    let own = || {
        let text = log.metadata.get("vehicle_toml")?;
        let read = VehicleFile::parse_with(text, "metadata vehicle_toml", None);
        read.map_err(|problem| notes.push(format!("{name}: {problem}"))).ok()
    };
    let vehicle = asked.cloned().or_else(own);
    let body = vehicle.as_ref().map_or_else(
        || {
            let rotors = ["rotor.speed_rad_s", "rotor.command"].iter().find_map(|c| log.channel(c));
            notes.push(format!(
                "{name}: no vehicle file in the log and no --vehicle: what is drawn is a stand-in."
            ));
            Body::unknown(rotors.map_or(4, |(_, channel)| channel.width).min(MAX_ROTORS))
        },
        body,
    );
    ViewFlight {
        name: name.to_owned(),
        log,
        body,
        rotors: vehicle.and_then(|vehicle| rotors(log, &vehicle)),
        obstacles: obstacles(log),
        notes,
    }
}

/// How the vehicle of a file looks.
fn body(file: &VehicleFile) -> Body {
    let (vehicle, p) = (&file.vehicle, file.vehicle.parameters());
    let spins = spin_signs(vehicle);
    let rotor = |(rotor, spin): (&squirrel_core::vehicle::Rotor<f64>, &f64)| RotorShape {
        hub_body_m: rotor.position.vector.into(),
        spin: *spin,
        radius_m: p.propulsion.propeller_radius_m,
    };
    let wing = |w: &squirrel_core::vehicle::Wing<f64>| {
        let centre = [w.longitudinal_arm_m, w.lateral_arm_m, w.vertical_arm_m];
        WingShape::new(w.area_per_side_m2, w.chord_m, centre)
    };
    Body {
        rotors: vehicle.rotors().iter().zip(&spins).map(rotor).collect(),
        wing: p.wing.as_ref().map(wing),
        height_m: file.size_body_m[2],
        weight_n: Some(vehicle.weight_n()),
    }
}

/// Rotors as their speeds say, else as they were commanded; thrust in air at rest.
fn rotors(log: &FlightLog, file: &VehicleFile) -> Option<RotorNumbers> {
    let p = &file.vehicle.parameters().propulsion;
    let (per_square, none) = ([p.thrust_coefficient_n_s2], [0.0]);
    let thrust = |speed: &f64| thrust_and_moment([&per_square, &none, &none, &none], &[*speed]).0;
    let target = |command: &f64| {
        if command.is_finite() { p.target_speed_rad_s(*command) } else { f64::NAN }
    };
    let numbers = |from: &'static str, speed: &dyn Fn(&f64) -> f64| {
        let (_, channel) = log.channel(from)?;
        let speeds: Vec<f64> = channel.values.iter().map(speed).collect();
        let some =
            channel.width == file.vehicle.rotors().len() && speeds.iter().any(|x| x.is_finite());
        some.then(|| RotorNumbers {
            from,
            thrust_n: speeds.iter().map(thrust).collect(),
            speed_rad_s: speeds,
        })
    };
    numbers("rotor.speed_rad_s", &|x| *x).or_else(|| numbers("rotor.command", &target))
}

/// Obstacles that the log knows.
fn obstacles(log: &FlightLog) -> Vec<[f64; 3]> {
    let text = log.metadata.get("obstacles_json");
    text.and_then(|text| serde_json::from_str(text).ok()).unwrap_or_default()
}
