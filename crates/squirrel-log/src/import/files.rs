//! Which of the given paths is which file of the map.

use std::fs;
use std::path::{Path, PathBuf};

use super::error::ImportError;
use super::map::{ImportMap, SourceMap};

/// The path of each source's file, in the order of the map.
///
/// # Errors
/// A file that none or two of the paths offer, a path that does not exist or that nothing reads.
pub(super) fn find(map: &ImportMap, paths: &[PathBuf]) -> Result<Vec<PathBuf>, ImportError> {
    for path in paths {
        fs::metadata(path)
            .map_err(|source| ImportError::Read { file: path.display().to_string(), source })?;
    }
    let found = map
        .sources
        .iter()
        .enumerate()
        .map(|(index, source)| find_one(map, index, source, paths))
        .collect::<Result<Vec<_>, _>>()?;
    match paths.iter().find(|path| found.iter().all(|file| !file.starts_with(path))) {
        None => Ok(found),
        Some(unused) => Err(ImportError::UnusedPath {
            map: map.name.clone(),
            path: unused.display().to_string(),
        }),
    }
}

/// File names without folders.
pub(super) fn names(found: &[PathBuf]) -> Vec<String> {
    found
        .iter()
        .map(|path| path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned())
        .collect()
}

fn find_one(
    map: &ImportMap,
    index: usize,
    source: &SourceMap,
    paths: &[PathBuf],
) -> Result<PathBuf, ImportError> {
    let given = || match paths {
        [] => "none".to_owned(),
        paths => paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", "),
    };
    let Some(file) = &source.file else {
        return match paths {
            [path] if !path.is_dir() => Ok(path.clone()),
            _ => Err(ImportError::MapField {
                map: map.name.clone(),
                field: format!("source {}, file", index + 1),
                problem: format!("without it PATH must be one file, given: {}", given()),
            }),
        };
    };
    let offered: Vec<PathBuf> = paths
        .iter()
        .filter_map(|path| {
            if path.is_dir() {
                Some(path.join(file)).filter(|inside| inside.is_file())
            } else {
                (path.file_name() == Path::new(file).file_name()).then(|| path.clone())
            }
        })
        .collect();
    match offered.as_slice() {
        [one] => Ok(one.clone()),
        [] => Err(ImportError::MissingFile {
            map: map.name.clone(),
            file: file.clone(),
            given: given(),
        }),
        [first, second, ..] => Err(ImportError::AmbiguousFile {
            map: map.name.clone(),
            file: file.clone(),
            first: first.display().to_string(),
            second: second.display().to_string(),
        }),
    }
}
