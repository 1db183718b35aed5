//! One file a command.

pub(crate) mod demo;
pub(crate) mod export_vectors;
pub(crate) mod fly;
pub(crate) mod gap;
pub(crate) mod help;
pub(crate) mod hil;
pub(crate) mod import;
pub(crate) mod plan;
pub(crate) mod reach;
pub(crate) mod replay;
pub(crate) mod study;
pub(crate) mod train;
pub(crate) mod vehicle;
pub(crate) mod view;

use squirrel_log::FlightLog;
use squirrel_report::flight::FlightView;
use squirrel_sim::flight::{Metrics, Setup};
use squirrel_sim::vehicle_file::VehicleFile;
use std::path::Path;

/// The vehicle of a `--vehicle` option: a file, a bundled one by its name, or the squirrel.
fn vehicle(path: Option<&Path>) -> Result<VehicleFile, String> {
    path.map_or_else(
        || Ok(VehicleFile::squirrel()),
        |path| VehicleFile::find(path).map_err(|e| e.to_string()),
    )
}

/// Writes a log that says which commit of the program flew.
fn write_log(log: &mut FlightLog, path: &Path) -> Result<(), String> {
    log.metadata.extend([commit()]);
    log.write(path).map_err(|e| e.to_string())
}

/// The commit of the program, where there was git when it was built.
const COMMIT: Option<&str> = option_env!("SQUIRREL_COMMIT");

/// Metadata: the commit of the program.
fn commit() -> (String, String) {
    ("git".to_owned(), COMMIT.unwrap_or("unknown").to_owned())
}

/// The table columns that every flight has: name with unit, and the figure.
fn figures(metrics: &Metrics) -> Vec<(String, String)> {
    let cell = |name: &str, value: String| (name.to_owned(), value);
    vec![
        cell("RMSE 3-D m", format!("{:.2}", metrics.rmse_m)),
        cell("RMSE horiz. m", format!("{:.2}", metrics.rmse_horizontal_m)),
        cell("height lost m", format!("{:.2}", metrics.height_lost_m)),
        cell("height gained m", format!("{:.2}", metrics.height_gained_m)),
        cell("wings open s", format!("{:.2}", metrics.wings_open_s)),
        cell(
            "clearance m",
            metrics.clearance_m.map_or_else(|| "-".to_owned(), |c| format!("{c:.2}")),
        ),
        cell("contact s", metrics.contact_s.map_or_else(|| "-".to_owned(), |t| format!("{t:.2}"))),
    ]
}

/// How the report sees one flight.
fn view<'a>(
    setup: &'a Setup,
    log: &'a FlightLog,
    summary: Vec<(String, String)>,
) -> FlightView<'a> {
    // The limit holds for roll and for pitch; both at once tilt the thrust further.
    let one_axis = setup.vehicle.vehicle.parameters().limits.tilt_max_rad.cos();
    FlightView {
        arm: setup.arm.name(),
        log,
        obstacles: passed(setup, log),
        tilt_max_rad: (one_axis * one_axis).acos(),
        thrust_max_n: setup.thrust_to_weight() * setup.vehicle.vehicle.weight_n(),
        summary,
    }
}

/// Obstacles that the flight came near; a forest has a thousand more.
fn passed(setup: &Setup, log: &FlightLog) -> Vec<[f64; 3]> {
    /// Further away nothing is seen.
    const NEAR_M: f64 = 8.0;
    let mut obstacles = setup.scenario.all_obstacles();
    if let Some((time_s, path)) = log.channel("truth.position_ned_m") {
        let near =
            |[north, east, _]: &[f64; 3], at: &[f64]| (north - at[0]).hypot(east - at[1]) < NEAR_M;
        obstacles.retain(|trunk| (0..time_s.len()).step_by(10).any(|i| near(trunk, path.row(i))));
    }
    obstacles
}

/// Facts at the head of a report.
fn facts(setup: &Setup) -> Vec<(String, String)> {
    let fact = |name: &str, value: String| (name.to_owned(), value);
    vec![
        fact("vehicle", setup.vehicle.name.clone()),
        fact("scenario", setup.scenario.name.clone()),
        fact("seed", setup.scenario.seed.to_string()),
        fact("effective thrust-to-weight", format!("{:.2}", setup.thrust_to_weight())),
        fact("integrator", setup.integrator.name().to_owned()),
        fact("version", env!("CARGO_PKG_VERSION").to_owned()),
    ]
}
