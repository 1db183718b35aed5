//! `squirrel import`: foreign logs in, flight logs out.

use crate::output::{self, say, talk};
use crate::paths::Paths;
use squirrel_log::FlightLog;
use squirrel_log::import::{ImportReport, Reading, import_board};
use std::path::{Path, PathBuf};

/// Smaller files are read before a progress bar could be seen.
const BAR_FROM_BYTES: u64 = 32 << 20;

/// Who is told of bytes read, and of all.
type Watch<'a> = &'a dyn Fn(u64, u64);

/// Options of an import.
#[derive(Debug, clap::Args)]
pub(crate) struct Import {
    /// Map from columns to channels (TOML), or the name of a built-in one: nanobench, crazypad, arpl;
    /// logs of PX4, ArduPilot, Betaflight, INAV and Crazyflies, and ROS 2 bags of known types, need
    /// none.
    #[arg(long)]
    map: Option<PathBuf>,
    /// Topic of a ROS 2 bag to take where several say the same, without --map; may be repeated.
    #[arg(long, conflicts_with_all = ["map", "recover", "board"])]
    topic: Vec<String>,
    /// Save what is whole of a truncated flight log.
    #[arg(long, conflicts_with = "map")]
    recover: bool,
    /// Fly what a board wrote down its serial line again: inputs and outputs of its flight code.
    #[arg(long, conflicts_with_all = ["map", "recover"])]
    board: bool,
    /// The log of an autopilot: ULog (PX4), dataflash (ArduPilot), blackbox (Betaflight, INAV), micro-SD
    /// (Crazyflie); a ROS 2 bag (MCAP); with --map files or folders of one flight: these, CSV, Parquet,
    /// MATLAB .mat, HDF5, MCAP with JSON or protobuf; with --board what the board wrote.
    #[arg(required = true)]
    paths: Vec<PathBuf>,
    /// Flight log to write.
    #[arg(long)]
    out: PathBuf,
    /// Write what was read here as JSON.
    #[arg(long)]
    json: Option<PathBuf>,
}

impl Import {
    /// What is read, and where it goes.
    fn paths(&self, read: &[PathBuf]) -> Paths {
        Paths::default()
            .reads("PATHS", read)
            .writes("--out", [&self.out])
            .writes("--json", &self.json)
    }

    pub(crate) fn run(&self) -> Result<(), String> {
        if self.board || self.recover {
            self.paths(&self.paths).check()?;
            return if self.board { self.board() } else { self.recover() };
        }
        let reading = Reading::new(&self.paths, self.map.as_deref(), &self.topic)
            .map_err(|e| e.to_string())?;
        // A folder may hold more than is read; an earlier import, for one.
        let found = reading.files().map_err(|e| e.to_string())?;
        self.paths(&found).reads("--map", &self.map).check()?;
        let notes = reading.notes.clone();
        self.finish(&notes, |watch| reading.import(watch).map_err(|e| e.to_string()))
    }

    /// Imports with a progress bar, writes the log and says what was read.
    fn finish(
        &self,
        notes: &[String],
        import: impl FnOnce(Watch<'_>) -> Result<(FlightLog, ImportReport), String>,
    ) -> Result<(), String> {
        let bar = output::progress(0, "bytes");
        let imported = import(&|done, total| {
            if total >= BAR_FROM_BYTES {
                bar.set_length(total);
                bar.set_position(done);
            }
        });
        bar.finish_and_clear();
        let (log, report) = imported?;
        log.write(&self.out).map_err(|e| e.to_string())?;
        say(report.to_string().trim_end());
        for note in notes {
            say(note);
        }
        talk(&format!("wrote {}", self.out.display()));
        output::write_json(self.json.as_deref(), &report)
    }

    fn one_path(&self, option: &str) -> Result<&Path, String> {
        match self.paths.as_slice() {
            [path] => Ok(path),
            all => Err(format!("PATH: {option} takes one file, got {}", all.len())),
        }
    }

    fn board(&self) -> Result<(), String> {
        let (log, report) = import_board(self.one_path("--board")?).map_err(|e| e.to_string())?;
        log.write(&self.out).map_err(|e| e.to_string())?;
        say(&report.to_string());
        talk(&format!("wrote {}", self.out.display()));
        output::write_json(self.json.as_deref(), &report)
    }

    fn recover(&self) -> Result<(), String> {
        let path = self.one_path("--recover")?;
        let (log, recovery) = FlightLog::recover(path).map_err(|e| e.to_string())?;
        log.write(&self.out).map_err(|e| e.to_string())?;
        say(&format!(
            "{}: {} of {} bytes are whole: {:.3} s of flight, {} messages",
            path.display(),
            recovery.bytes_whole,
            recovery.bytes_total,
            recovery.end_time_s,
            recovery.messages
        ));
        if !recovery.metadata_checked {
            say("its metadata (vehicle, scenario, settings) have no checksum: look at them");
        }
        talk(&format!("wrote {}", self.out.display()));
        output::write_json(self.json.as_deref(), &recovery)
    }
}
