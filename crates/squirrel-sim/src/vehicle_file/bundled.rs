//! Vehicles that are part of the program, by their names.

use super::{VehicleFile, VehicleFileError};
use squirrel_vehicles::VEHICLES;
use std::io;
use std::path::Path;

impl VehicleFile {
    /// The vehicle of this name that is part of the program.
    ///
    /// # Errors
    /// [`VehicleFileError::Read`], which lists the names, where there is none.
    pub fn bundled(name: &str) -> Result<Self, VehicleFileError> {
        let Some((name, text)) = VEHICLES.iter().find(|(own, _)| *own == name) else {
            let why = format!("no such vehicle; known are {}", Self::bundled_names());
            let source = io::Error::new(io::ErrorKind::NotFound, why);
            return Err(VehicleFileError::Read { file: name.to_owned(), source });
        };
        Self::parse(text, name)
    }

    /// The names of [`Self::bundled`], for a line.
    pub fn bundled_names() -> String {
        VEHICLES.map(|(name, _)| name).join(", ")
    }

    /// Whether a path stands for a bundled vehicle: a file of its name comes first, a folder does
    /// not.
    pub fn is_bundled(path: &Path) -> bool {
        let is_name = VEHICLES.iter().any(|(name, _)| path == Path::new(name));
        is_name && (path.is_dir() || !path.exists())
    }

    /// A file, or the name of a bundled vehicle where no such file is.
    ///
    /// # Errors
    /// As [`Self::load`]; one line that lists the names where the path is neither.
    pub fn find(path: &Path) -> Result<Self, VehicleFileError> {
        if Self::is_bundled(path) {
            return Self::bundled(&path.display().to_string());
        }
        Self::load(path).map_err(|error| match error {
            VehicleFileError::Read { file, source } if source.kind() == io::ErrorKind::NotFound => {
                let why = format!(
                    "no such file, and no bundled vehicle; known are {}",
                    Self::bundled_names()
                );
                VehicleFileError::Read { file, source: io::Error::new(source.kind(), why) }
            }
            other => other,
        })
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::{VEHICLES, VehicleFile};
    use std::path::Path;

    #[test]
    fn every_bundled_vehicle_is_sound_and_found_by_its_name() {
        for (name, text) in VEHICLES {
            let found = VehicleFile::find(Path::new(name)).unwrap();
            assert_eq!((found.text.as_str(), found.name.is_empty()), (text, false), "{name}");
        }
    }

    #[test]
    fn what_is_neither_file_nor_name_gets_one_line_with_the_names() {
        let error = VehicleFile::find(Path::new("sqirrel")).unwrap_err().to_string();
        assert!(error.starts_with("sqirrel: no such file, and no bundled vehicle"), "{error}");
        assert!(error.ends_with(&VehicleFile::bundled_names()), "{error}");
        assert!(!error.contains('\n'), "{error}");
    }

    #[test]
    fn every_vehicle_file_of_the_folder_is_bundled() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../vehicles");
        // The practice vehicle belongs to cases of the gap workflow.
        let not = ["Cargo", "practice"];
        let mut found = 0;
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_stem().unwrap().to_str().unwrap();
            if path.extension().is_some_and(|e| e == "toml") && !not.contains(&name) {
                assert!(VEHICLES.iter().any(|(own, _)| *own == name), "{name}");
                found += 1;
            }
        }
        assert_eq!(found, VEHICLES.len());
    }
}
