//! `squirrel import`: foreign logs in, flight logs out.

use crate::output::{self, say, talk};
use squirrel_sim::import::{ImportMap, import_watched};
use squirrel_sim::log::FlightLog;
use std::path::PathBuf;

/// Smaller files are read before a progress bar could be seen.
const BAR_FROM_BYTES: u64 = 32 << 20;

/// Options of an import.
#[derive(Debug, clap::Args)]
pub(crate) struct Import {
    /// Map from columns to channels (TOML).
    #[arg(long, required_unless_present = "recover")]
    map: Option<PathBuf>,
    /// Save what is whole of a truncated flight log.
    #[arg(long, conflicts_with = "map")]
    recover: bool,
    /// Files or folders of one flight: CSV, Parquet, ULog, MCAP with JSON messages.
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
    pub(crate) fn run(&self) -> Result<(), String> {
        let Some(map) = &self.map else { return self.recover() };
        let map = ImportMap::load(map).map_err(|e| e.to_string())?;
        let bar = output::progress(0, "bytes");
        let imported = import_watched(&map, &self.paths, &|done, total| {
            if total >= BAR_FROM_BYTES {
                bar.set_length(total);
                bar.set_position(done);
            }
        });
        bar.finish_and_clear();
        let (log, report) = imported.map_err(|e| e.to_string())?;
        log.write(&self.out).map_err(|e| e.to_string())?;
        say(report.to_string().trim_end());
        talk(&format!("wrote {}", self.out.display()));
        output::write_json(self.json.as_deref(), &report)
    }

    fn recover(&self) -> Result<(), String> {
        let [path] = self.paths.as_slice() else {
            return Err(format!("PATH: --recover takes one flight log, got {}", self.paths.len()));
        };
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
        talk(&format!("wrote {}", self.out.display()));
        output::write_json(self.json.as_deref(), &recovery)
    }
}
