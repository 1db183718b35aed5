//! What a command reads and what it writes, compared before it begins: nothing that is read is
//! overwritten, and no two results go into one file.

use squirrel_log::files::{self, FileId};
use squirrel_sim::vehicle_file::VehicleFile;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Flight logs by path; a folder stands for the logs in it, in the order of their names.
pub(crate) fn log_files(paths: &[PathBuf]) -> Result<Vec<PathBuf>, String> {
    let mut files = Vec::new();
    for path in paths {
        if !path.is_dir() {
            files.push(path.clone());
            continue;
        }
        let at = |e: std::io::Error| format!("{}: {e}", path.display());
        let mut inside = Vec::new();
        for entry in std::fs::read_dir(path).map_err(at)? {
            let file = entry.map_err(at)?.path();
            if file.extension().is_some_and(|e| e == "mcap") {
                inside.push(file);
            }
        }
        if inside.is_empty() {
            return Err(format!("{}: no .mcap file in this folder", path.display()));
        }
        inside.sort();
        files.extend(inside);
    }
    Ok(files)
}

/// The files of a command, by the arguments that give them.
#[derive(Default)]
pub(crate) struct Paths {
    reads: Vec<Given>,
    writes: Vec<Given>,
    /// Folders that the command makes where they are missing.
    makes: Vec<FileId>,
}

struct Given {
    argument: &'static str,
    path: PathBuf,
    /// In a folder that the command makes, or in one in it.
    in_folder: bool,
    is_flight: bool,
}

impl Given {
    fn new(argument: &'static str, path: impl Into<PathBuf>) -> Self {
        Self { argument, path: path.into(), in_folder: false, is_flight: false }
    }

    /// Whether both are flights of lists of their own, which prove something of each other.
    fn is_to_be_apart_from(&self, other: &Self) -> bool {
        self.is_flight && other.is_flight && self.argument != other.argument
    }
}

impl Paths {
    /// Files that are read.
    pub(crate) fn reads<P: Into<PathBuf>>(
        mut self,
        argument: &'static str,
        paths: impl IntoIterator<Item = P>,
    ) -> Self {
        self.reads.extend(paths.into_iter().map(|path| Given::new(argument, path)));
        self
    }

    /// A vehicle file, and the weights that it names; a bundled vehicle is no file.
    pub(crate) fn vehicle<'a>(
        self,
        argument: &'static str,
        path: impl IntoIterator<Item = &'a PathBuf>,
    ) -> Self {
        let files = path.into_iter().filter(|path| !VehicleFile::is_bundled(path));
        files.fold(self, |paths, file| {
            // Where they are missing, others stand in for them.
            let weights = VehicleFile::weights_path(file).filter(|weights| weights.is_file());
            paths.reads(argument, [file]).reads("wing.parnn_weights of the vehicle", weights)
        })
    }

    /// A scenario, where it is a file and not the name of a built-in one.
    pub(crate) fn scenario(self, name: &str) -> Self {
        self.reads(
            "--scenario",
            Some(name).filter(|name| Path::new(name).extension().is_some_and(|e| e == "toml")),
        )
    }

    /// Flight logs, or folders of them.
    ///
    /// # Errors
    /// A folder that cannot be read, or that holds none.
    pub(crate) fn flights(
        mut self,
        argument: &'static str,
        paths: &[PathBuf],
    ) -> Result<Self, String> {
        let flight = |path| Given { is_flight: true, ..Given::new(argument, path) };
        self.reads.extend(log_files(paths)?.into_iter().map(flight));
        Ok(self)
    }

    /// Files that are written.
    pub(crate) fn writes<'a>(
        mut self,
        argument: &'static str,
        paths: impl IntoIterator<Item = &'a PathBuf>,
    ) -> Self {
        self.writes.extend(paths.into_iter().map(|path| Given::new(argument, path)));
        self
    }

    /// The figures, which `--out` may have, too: there both are one file with the same bytes, and
    /// may be.
    ///
    /// * `kept` - that file
    pub(crate) fn writes_json(self, json: Option<&PathBuf>, kept: Option<&PathBuf>) -> Self {
        let kept = kept.and_then(|path| FileId::written(path));
        let is_kept = |json: &PathBuf| kept.is_some() && FileId::written(json) == kept;
        self.writes("--json", json.filter(|json| !is_kept(json)))
    }

    /// Files that are written into the folder of `--out`.
    pub(crate) fn writes_into<N: AsRef<Path>>(
        mut self,
        folder: &Path,
        names: impl IntoIterator<Item = N>,
    ) -> Self {
        let given = |name: N| Given { in_folder: true, ..Given::new("--out", folder.join(name)) };
        self.writes.extend(names.into_iter().map(given));
        self.makes.extend(FileId::read(folder));
        self
    }

    /// Whether the command may begin.
    ///
    /// # Errors
    /// A result that would overwrite what is read, or another result; one that cannot be written,
    /// which nobody wants to learn after the work; a flight of two lists.
    pub(crate) fn check(&self) -> Result<(), String> {
        let mut taken: BTreeMap<FileId, (&Given, &str)> = BTreeMap::new();
        for input in &self.reads {
            let Some(id) = FileId::read(&input.path) else { continue };
            let other = taken.insert(id, (input, "what is read is never overwritten"));
            if let Some((other, _)) = other.filter(|(other, _)| input.is_to_be_apart_from(other)) {
                let (path, its) = (input.path.display(), other.path.display());
                return Err(format!(
                    "{} {path}: is {} {its}; a flight proves nothing about itself",
                    input.argument, other.argument
                ));
            }
        }
        for result in &self.writes {
            let Some(id) = FileId::written(&result.path) else { continue };
            if let Some((other, why)) = taken.get(&id) {
                let (path, its) = (result.path.display(), other.path.display());
                let (argument, other) = (result.argument, other.argument);
                return Err(format!(
                    "{argument} {path}: would be written over {other} {its}; {why}"
                ));
            }
            taken.insert(id, (result, "each result needs a file of its own"));
        }
        for given in &self.writes {
            if !self.is_yet_to_be(given) {
                writable(&given.path)?;
            } else if let Some(file) = no_folder(&given.path) {
                return Err(format!("{}: is a file, must be a folder", file.display()));
            }
        }
        Ok(())
    }

    /// Whether a result's folder is missing, and the command makes it.
    fn is_yet_to_be(&self, result: &Given) -> bool {
        let Some(folder) = result.path.parent().filter(|folder| !folder.is_dir()) else {
            return false;
        };
        result.in_folder || FileId::read(folder).is_some_and(|id| self.makes.contains(&id))
    }
}

/// What is there, above a path, and no folder: nothing can be made in it.
fn no_folder(path: &Path) -> Option<&Path> {
    path.ancestors().skip(1).find(|above| above.exists()).filter(|above| !above.is_dir())
}

/// Asks whether a result could be written.
fn writable(path: &Path) -> Result<(), String> {
    if path.is_dir() {
        return Err(format!("{}: is a folder, must be a file", path.display()));
    }
    files::writable(path).map_err(|e| format!("{}: {e}", path.display()))
}
