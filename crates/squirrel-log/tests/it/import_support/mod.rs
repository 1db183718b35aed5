//! A flight folder in the temporary directory, for tests of the import.
#![allow(dead_code, reason = "each test binary uses its part")]

pub(crate) mod formats;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use squirrel_log::FlightLog;
use squirrel_log::import::{ImportError, ImportMap, ImportReport, import};

/// A channel that needs no conversion.
pub(crate) const OMEGA: &str =
    r#""imu.omega_body_rad_s" = { columns = ["x", "y", "z"], body = "frd" }"#;

/// A map with these channels and time in seconds in column `t`.
pub(crate) fn one_source(channels: &str) -> String {
    format!(
        "[[source]]\ntime = {{ column = \"t\", unit = \"s\" }}\n[source.channels]\n{channels}\n"
    )
}

/// Is removed when dropped.
pub(crate) struct Flight {
    folder: PathBuf,
}

impl Flight {
    pub(crate) fn new(name: &str, files: &[(&str, &str)]) -> Self {
        static COUNT: AtomicUsize = AtomicUsize::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let folder = std::env::temp_dir()
            .join(format!("squirrel-import-{}-{count}-{name}", std::process::id()));
        let flight = Self { folder };
        fs::create_dir_all(&flight.folder).unwrap();
        for (file, text) in files {
            flight.write(file, text.as_bytes());
        }
        flight
    }

    pub(crate) fn write(&self, file: &str, bytes: &[u8]) {
        let path = self.folder.join(file);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }

    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Imports some files of the folder; `""` is the folder itself.
    pub(crate) fn import(
        &self,
        map: &str,
        paths: &[&str],
    ) -> Result<(FlightLog, ImportReport), ImportError> {
        let paths: Vec<PathBuf> = paths.iter().map(|path| self.folder.join(path)).collect();
        import(&ImportMap::parse(map, "map.toml")?, &paths)
    }

    /// Imports the folder.
    pub(crate) fn import_folder(
        &self,
        map: &str,
    ) -> Result<(FlightLog, ImportReport), ImportError> {
        self.import(map, &[""])
    }

    /// Imports `f.csv`.
    pub(crate) fn import_file(&self, map: &str) -> Result<(FlightLog, ImportReport), ImportError> {
        self.import(map, &["f.csv"])
    }

    /// An error message without the temporary folder.
    pub(crate) fn message(&self, error: &ImportError) -> String {
        error.to_string().replace(&format!("{}/", self.folder.display()), "")
    }
}

impl Drop for Flight {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.folder);
    }
}
