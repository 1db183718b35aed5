//! `squirrel replay`: the flight code again on a log's inputs, bit for bit.

use crate::output::{self, say};
use crate::paths::Paths;
use serde::Serialize;
use squirrel_log::{FlightLog, LogReader};
use squirrel_sim::flight::Setup;
use squirrel_sim::replay;
use squirrel_sim::vehicle_file::VehicleFile;
use std::path::PathBuf;

/// Options of a replay.
#[derive(Debug, clap::Args)]
pub(crate) struct Replay {
    /// Flight log recorded by `squirrel fly` or `squirrel demo`.
    flight: PathBuf,
    /// Fly this vehicle, a file or the name of a bundled one, instead of the one in the log.
    #[arg(long)]
    vehicle: Option<PathBuf>,
    /// Write the result here as JSON.
    #[arg(long)]
    json: Option<PathBuf>,
}

#[derive(Serialize)]
struct Replayed<'a> {
    flight: String,
    arm: &'static str,
    identical: bool,
    #[serde(flatten)]
    replay: &'a replay::Replay,
}

impl Replay {
    /// What flies: the log's own setup, with another vehicle where one is asked for.
    fn setup(&self, mut setup: Setup) -> Result<Setup, String> {
        if let Some(path) = &self.vehicle {
            setup.vehicle = VehicleFile::find(path).map_err(|e| e.to_string())?;
        }
        Ok(setup)
    }

    pub(crate) fn run(&self) -> Result<(), String> {
        let paths =
            Paths::default().reads("FLIGHT", [&self.flight]).vehicle("--vehicle", &self.vehicle);
        paths.writes("--json", &self.json).check()?;
        let file = self.flight.display();
        let at = |problem| format!("{file}: {problem}");
        let in_pieces = match LogReader::open(&self.flight).map_err(|e| e.to_string())? {
            None => None,
            Some(mut log) => {
                let setup = self.setup(replay::setup_of(log.metadata()).map_err(at)?)?;
                let replay = replay::replay_pieces(&mut log, &setup).map_err(at)?;
                replay.map(|replay| (setup, replay))
            }
        };
        let (setup, replay) = if let Some(both) = in_pieces {
            both
        } else {
            let log = FlightLog::read(&self.flight).map_err(|e| e.to_string())?;
            let setup = self.setup(replay::setup(&log).map_err(at)?)?;
            let replay = replay::replay(&log, &setup).map_err(at)?;
            (setup, replay)
        };
        let result = Replayed {
            flight: file.to_string(),
            arm: setup.arm.name(),
            identical: replay.first_difference.is_none(),
            replay: &replay,
        };
        output::write_json(self.json.as_deref(), &result)?;
        match &replay.first_difference {
            None => {
                say(&format!(
                    "{file}: {} steps of {}, {} output numbers, every bit identical",
                    replay.steps,
                    setup.arm.name(),
                    replay.values
                ));
                Ok(())
            }
            Some(d) => Err(format!(
                "{file}: {}[{}] at {:.6} s is the first output that differs: {} in the log, {} in the replay",
                d.channel, d.index, d.time_s, d.logged, d.replayed
            )),
        }
    }
}
