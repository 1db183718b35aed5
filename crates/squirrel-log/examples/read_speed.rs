//! How long an import takes in memory: `read_speed FILE [MAP]` prints the seconds of the best of
//! three, without a flight log being written. `benches/import/speed.py` asks it.
#![allow(clippy::print_stdout, reason = "this is where the program speaks")]

use squirrel_log::import::{ImportMap, import, import_without_map, is_bag, map_of_bag};
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let paths: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let (path, map) = match paths.as_slice() {
        [path] => (path, None),
        [path, map] => (path, Some(map)),
        _ => return Err("which FILE, and which MAP if it needs one?".into()),
    };
    let mut best_s = f64::INFINITY;
    for _ in 0..3 {
        let start = Instant::now();
        once(path, map.map(PathBuf::as_path))?;
        best_s = best_s.min(start.elapsed().as_secs_f64());
    }
    println!("{best_s}");
    Ok(())
}

fn once(path: &Path, map: Option<&Path>) -> Result<(), Box<dyn std::error::Error>> {
    let map = match map {
        Some(map) => Some(ImportMap::load(map)?),
        None if is_bag(path)? => Some(map_of_bag(path, &[])?.0),
        None => None,
    };
    let read = match map {
        Some(map) => import(&map, &[path.to_path_buf()])?,
        None => import_without_map(path, &|_, _| {})?,
    };
    black_box(read);
    Ok(())
}
