//! `squirrel study merge`: the parts of a study, put together.

use super::Studies;
use crate::output;
use crate::paths::Paths;
use clap::Parser;
use squirrel_log::files::Lock;
use squirrel_study::journal::locked;
use squirrel_study::merge::{journals, merge};
use std::collections::BTreeSet;
use std::path::PathBuf;

/// Options of the merge.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Folders of the parts.
    #[arg(required = true)]
    folders: Vec<PathBuf>,
    /// Folder for the whole study, as its own --out.
    #[arg(long)]
    out: PathBuf,
    /// The vehicle that the parts were flown with, a file or the name of a bundled one; squirrel if
    /// left out.
    #[arg(long)]
    vehicle: Option<PathBuf>,
    /// Write the figures here as JSON.
    #[arg(long)]
    json: Option<PathBuf>,
}

/// The arguments that a part was flown with.
#[derive(Parser)]
#[command(name = "study", no_binary_name = true)]
struct Again {
    #[command(subcommand)]
    study: Studies,
}

impl Options {
    pub(super) fn run(&self) -> Result<(), String> {
        self.paths()?.check()?;
        let is_new = !self.out.exists();
        output::folder(&self.out)?;
        let lock = locked(&self.out).map_err(|e| e.to_string())?;
        let merged = self.merged(&lock);
        drop(lock);
        if merged.is_err() && is_new {
            // Nothing half done is left.
            std::fs::remove_dir_all(&self.out)
                .map_err(|e| format!("{}: {e}", self.out.display()))?;
        }
        merged
    }

    /// The journals that are read, and those that are written; what follows from them is the
    /// study's.
    fn paths(&self) -> Result<Paths, String> {
        let mut paths =
            Paths::default().vehicle("--vehicle", &self.vehicle).writes("--json", &self.json);
        let mut all = BTreeSet::new();
        for folder in &self.folders {
            let names = journals(folder).map_err(|e| e.to_string())?;
            paths = paths.reads("FOLDERS", names.iter().map(|name| folder.join(name)));
            all.extend(names);
        }
        Ok(paths.writes_into(&self.out, &all))
    }

    fn merged(&self, lock: &Lock) -> Result<(), String> {
        let command = merge(&self.folders, &self.out).map_err(|e| e.to_string())?;
        let unknown = |_| format!("{}: is no study of this version", command.join(" "));
        let Studies::Fly(mut flown) = Again::try_parse_from(&command).map_err(unknown)?.study
        else {
            return Err("merge: no study".to_owned());
        };
        flown.common.out = Some(self.out.clone());
        flown.common.vehicle.clone_from(&self.vehicle);
        flown.common.json.clone_from(&self.json);
        flown.merged = true;
        flown.run(Some(lock))
    }
}
