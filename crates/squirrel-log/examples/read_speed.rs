//! An import in memory: `read_speed FILE [MAP]` reads a log and writes nothing, so that who starts
//! it (`benches/import/speed.py`) sees what the reader alone takes.

use squirrel_log::import::Reading;
use std::hint::black_box;
use std::path::{Path, PathBuf};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let paths: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let (path, map) = match paths.as_slice() {
        [path] => (path, None),
        [path, map] => (path, Some(map)),
        _ => return Err("which FILE, and which MAP if it needs one?".into()),
    };
    once(path, map.map(PathBuf::as_path))
}

fn once(path: &Path, map: Option<&Path>) -> Result<(), Box<dyn std::error::Error>> {
    black_box(Reading::new(&[path.to_path_buf()], map, &[])?.import(&|_, _| {})?);
    Ok(())
}
