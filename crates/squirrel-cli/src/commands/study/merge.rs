//! `squirrel study merge`: the parts of a study, put together.

use super::Study;
use crate::output;
use crate::paths::Paths;
use clap::Parser;
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
    /// The vehicle file that the parts were flown with; the shipped squirrel if left out.
    #[arg(long)]
    vehicle: Option<PathBuf>,
    /// Write the figures here as JSON.
    #[arg(long)]
    json: Option<PathBuf>,
}

/// The arguments that a part was flown with.
#[derive(Debug, Parser)]
#[command(name = "study", no_binary_name = true)]
struct Again {
    #[command(subcommand)]
    study: Study,
}

impl Options {
    pub(super) fn run(&self) -> Result<(), String> {
        self.paths()?.check()?;
        let is_new = !self.out.exists();
        output::folder(&self.out)?;
        let merged = self.merged();
        if merged.is_err() && is_new {
            // Nothing half done is left.
            std::fs::remove_dir_all(&self.out).map_err(|e| format!("{}: {e}", self.out.display()))?;
        }
        merged
    }

    /// The journals that are read, and those that are written; what follows from them is the study's.
    fn paths(&self) -> Result<Paths, String> {
        let mut paths = Paths::default().vehicle("--vehicle", &self.vehicle).writes("--json", &self.json);
        let mut all = BTreeSet::new();
        for folder in &self.folders {
            let names = journals(folder).map_err(|e| e.to_string())?;
            paths = paths.reads("FOLDERS", names.iter().map(|name| folder.join(name)));
            all.extend(names);
        }
        Ok(paths.writes_into(&self.out, &all))
    }

    fn merged(&self) -> Result<(), String> {
        let command = merge(&self.folders, &self.out).map_err(|e| e.to_string())?;
        let unknown = |_| format!("{}: is no study of this version", command.join(" "));
        let mut study = Again::try_parse_from(&command).map_err(unknown)?.study;
        let common = study.common_mut().ok_or("merge: no study")?;
        common.out = Some(self.out.clone());
        common.vehicle.clone_from(&self.vehicle);
        common.json.clone_from(&self.json);
        common.merged = true;
        study.run()
    }
}
