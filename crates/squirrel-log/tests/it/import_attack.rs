//! Every reader under mutation: bits flipped, files cut, lengths made huge, parts moved. Each kind
//! runs in a child process whose address space and processor time are limited, so that a panic, a
//! hang and a file that asks for too much memory all end it.
//!
//! `cargo xtask attack COUNT SEED` runs more of it; a file that ends the child is kept, and belongs
//! into `tests/data/attack/`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use mcap::{Compression, WriteOptions};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use squirrel_log::FlightLog;
use squirrel_log::import::{
    ImportMap, Reading, import, import_without_map, map_of_bag, parameters,
};

use crate::import_fields::data;
use crate::import_support::formats::{Cells, mcap_by, parquet_bytes, parquet_split};
use crate::import_support::{OMEGA, one_source};
use crate::log_attack;

/// Set in the child: the kind, how many files, the seed.
const ASKED: &str = "SQUIRREL_ATTACK_CHILD";
/// Set by the chore: how many files a kind.
const COUNT: &str = "SQUIRREL_ATTACK_COUNT";
const SEED: &str = "SQUIRREL_ATTACK_SEED";
/// Files a kind in a test, for seconds; the chore takes more.
const COUNT_IN_TESTS: u64 = 300;
/// Good files are cut to this, so that 64 MiB is far more than four times any of them.
const GOOD_BYTES_MAX: usize = 24_000;
/// Address space of a child: what the test itself maps before it reads anything, and 64 MiB.
const CHILD_KIB: u64 = (192 + 64) << 10;
/// Processor time of a thousand files, s: a hang of 5 s shows.
const CHILD_S: u64 = 5;

const KINDS: [&str; 21] = [
    "ulog",
    "ulog-map",
    "ardupilot",
    "blackbox",
    "usd",
    "csv",
    "parquet",
    "parquet-split",
    "map",
    "map-table",
    "mcap",
    "mcap-loose",
    "json",
    "json-zstd",
    "bag",
    "protobuf",
    "mat",
    "mat-packed",
    "mat-v73",
    "hdf5",
    "hdf5-latest",
];

const TABLE: &str = "t,x,y,z\n1,2,3,4\n2,3,4,5\n3.5,-1e-3,nan,7\n";

const CRAZYPAD: &str = include_str!("../../../../vehicles/maps/crazypad.toml");

/// A good file of a kind.
fn good(kind: &str) -> Vec<u8> {
    let mut bytes = match kind {
        "ulog" => fs::read(data("ulog/sample_cut.ulg")).unwrap(),
        "ulog-map" => {
            // The begin of the file is definitions; what they define stands at its end.
            let all = fs::read(data("ulog/sample_cut.ulg")).unwrap();
            all[..64_000].to_vec()
        }
        "ardupilot" => fs::read(data("ardupilot/quad.bin")).unwrap(),
        "blackbox" => fs::read(data("blackbox/sitl.bbl")).unwrap(),
        "mcap" => return own_log(),
        // Its records; see `log_attack`.
        "mcap-loose" => return log_attack::records(&own_log()),
        "json" => return json(None),
        "json-zstd" => return json(Some(Compression::Zstd)),
        "bag" => return fs::read(data("ros/ros.mcap")).unwrap(),
        "protobuf" => return fs::read(data("protobuf/flight.mcap")).unwrap(),
        "mat" => return fs::read(data("mat/plain.mat")).unwrap(),
        "mat-packed" => return fs::read(data("mat/packed.mat")).unwrap(),
        "mat-v73" => return fs::read(data("mat/v73.mat")).unwrap(),
        "hdf5" => return fs::read(data("hdf5/flight.h5")).unwrap(),
        "hdf5-latest" => return fs::read(data("hdf5/latest.h5")).unwrap(),
        "usd" => return fs::read(data("crazypad/E8_log00.bin")).unwrap(),
        "csv" => TABLE.repeat(3).into_bytes(),
        "map" => CRAZYPAD.as_bytes().to_vec(),
        "map-table" => one_source(OMEGA).into_bytes(),
        "parquet" => {
            return parquet(|schema, columns| {
                parquet_bytes(schema, columns, 16, parquet::basic::Compression::SNAPPY)
            });
        }
        "parquet-split" => return parquet(|schema, columns| parquet_split(schema, columns, 16)),
        other => panic!("no kind `{other}`"),
    };
    bytes.truncate(if kind == "ulog-map" { 64_000 } else { GOOD_BYTES_MAX });
    bytes
}

fn parquet(bytes: impl Fn(&str, &[Cells]) -> Vec<u8>) -> Vec<u8> {
    let column = || (0..40).map(|i| (i % 7 > 0).then_some(i as f32)).collect();
    let whole = || (0..40).map(|i| Some(i as f32)).collect();
    bytes(
        "required int64 t; required float x; optional float y; required float z;",
        &[
            Cells::Longs((0..40).map(Some).collect()),
            Cells::Floats(whole()),
            Cells::Floats(column()),
            Cells::Floats(whole()),
        ],
    )
}

/// Messages in JSON, without the checksums that would tell of a change.
fn json(compression: Option<Compression>) -> Vec<u8> {
    let message = |k: u32| {
        let x = f64::from(k) / 8.0;
        let text = format!(r#"{{"stamp":{k},"w":{{"x":{x},"yz":[{x},null,"NaN"]}},"up":true}}"#);
        ("/imu", "json", u64::from(k) * 1000, text)
    };
    let options = WriteOptions::new().chunk_size(Some(1500)).compression(compression);
    let options = options.calculate_chunk_crcs(false).calculate_data_section_crc(false);
    mcap_by(options, &(0..60).map(message).collect::<Vec<_>>())
}

/// A flight of a second, as squirrel writes it.
fn own_log() -> Vec<u8> {
    let mut log = FlightLog::default();
    log.metadata.insert("vehicle_toml".to_owned(), "name = \"x\"".repeat(40));
    for (source, rate) in [("imu", 300_u32), ("gnss", 10)] {
        for k in 0..rate {
            let t = f64::from(k) / f64::from(rate);
            log.source_mut(source).push(t, &[("x", &[t, -t, 9.81]), ("y", &[f64::from(k)])]);
        }
    }
    let path = folder("own").join("own.mcap");
    log.write(&path).unwrap();
    fs::read(path).unwrap()
}

/// A refusal says which file or map it is of.
pub(crate) fn is_placed<T>(read: Result<T, impl std::fmt::Display>, path: &Path) -> Option<T> {
    read.map_err(|error| {
        let (error, name) = (error.to_string(), path.file_name().unwrap().to_string_lossy());
        assert!(error.starts_with("map") || error.contains(&*name), "{name}: {error}");
    })
    .ok()
}

/// Reads a file as its kind is read; what comes out does not matter.
fn read(kind: &str, path: &Path) {
    let by_map = |map: &str| {
        if let Some(map) = is_placed(ImportMap::parse(map, "map"), path) {
            is_placed(import(&map, &[path.to_path_buf()]), path);
        }
    };
    let topic = |topic: &str, time: &str, unit: &str, columns: &str| {
        format!(
            "[[source]]\ntopic = {topic:?}\ntime = {{ column = {time:?}, unit = {unit:?} }}\nchannels = {{ \"truth.x\" = {{ columns = [{columns}] }} }}\n"
        )
    };
    match kind {
        "ulog" | "ardupilot" | "blackbox" => {
            let _ = parameters(path);
            let found = is_placed(import_without_map(path, &|_, _| {}), path);
            let Some((log, report)) = found else { return };
            assert!(!report.to_string().is_empty());
            // What is read can be written.
            log.write(&path.with_extension("mcap")).unwrap();
        }
        "ulog-map" => by_map(&topic("sensor_combined", "timestamp", "us", "\"gyro_rad[0]\"")),
        "mcap" | "mcap-loose" => log_attack::read(path),
        "bag" => {
            if let Some((map, _)) = is_placed(map_of_bag(path, &[]), path) {
                is_placed(import(&map, &[path.to_path_buf()]), path);
            }
        }
        "usd" => {
            by_map(CRAZYPAD);
            let reading = Reading::new(&[path.to_path_buf()], None, &[]);
            is_placed(reading.and_then(|reading| reading.import(&|_, _| {})), path);
        }
        "csv" | "parquet" | "parquet-split" => by_map(&one_source(OMEGA)),
        "json" | "json-zstd" => {
            by_map(&topic("/imu", "log_time", "ns", "\"w.x\", \"w.yz[0]\", \"up\""));
        }
        "protobuf" => by_map(&topic("/flight", "log_time", "ns", "\"maybe\"")),
        "mat" | "mat-packed" | "mat-v73" => {
            let map = topic("", "t", "s", "\"gyro[0]\", \"log.battery.voltage\"");
            by_map(&map.replace("topic = \"\"\n", ""));
        }
        "hdf5" | "hdf5-latest" => {
            let columns = "\"imu.gyro[0]\", \"imu.packed[1]\", \"imu.grows\", \"battery.voltage\"";
            by_map(&topic("", "t", "s", columns).replace("topic = \"\"\n", ""));
        }
        // A map that is taken reads the file that it was made for.
        _ => {
            let Ok(text) = fs::read_to_string(path) else { return };
            let Some(map) = is_placed(ImportMap::parse(&text, "map"), path) else { return };
            let of = if kind == "map" {
                data("crazypad/E8_log00.bin")
            } else {
                let table = path.with_extension("csv");
                fs::write(&table, TABLE).unwrap();
                table
            };
            is_placed(import(&map, std::slice::from_ref(&of)), &of);
        }
    }
}

fn mutate(good: &[u8], kind: &str, rng: &mut Pcg64Mcg) -> Vec<u8> {
    let mut bytes = good.to_vec();
    for _ in 0..rng.random_range(1..4) {
        if bytes.is_empty() {
            break;
        }
        // Headers are short and matter most.
        let end = if rng.random_range(0..3) == 0 { bytes.len().min(600) } else { bytes.len() };
        let at = rng.random_range(0..end);
        let length = rng.random_range(1..=(bytes.len() - at).min(64));
        match rng.random_range(0..8) {
            0 => (0..8).for_each(|_| {
                let at = rng.random_range(0..bytes.len());
                bytes[at] ^= 1 << rng.random_range(0..8);
            }),
            1 => bytes[at] = rng.random_range(0..=255),
            2 => bytes.truncate(at),
            3 => bytes[at..at + length.min(8)].fill(0xFF),
            4 => bytes[at..at + length.min(8)].fill(0),
            5 => drop(bytes.drain(at..at + length)),
            6 => {
                let part = bytes[at..at + length].to_vec();
                let to = rng.random_range(0..=bytes.len());
                bytes.splice(to..to, part);
            }
            _ => {
                // A digit more in a text, a length more in a binary.
                let byte = rng.random_range(b'0'..=b'9');
                bytes.insert(at, byte);
            }
        }
    }
    if kind == "usd" && bytes.len() > 4 && rng.random_range(0..4) > 0 {
        // Else nearly all end at the sum over the file.
        let at = bytes.len() - 4;
        let crc = crc32fast::hash(&bytes[..at]);
        bytes[at..].copy_from_slice(&crc.to_le_bytes());
    }
    bytes
}

/// The file of what is mutated.
fn file_of(kind: &str, content: Vec<u8>) -> Vec<u8> {
    if kind == "mcap-loose" { log_attack::file(&content) } else { content }
}

fn folder(name: &str) -> PathBuf {
    let folder =
        std::env::temp_dir().join(format!("squirrel-attack-{}-{name}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Reads files as the kind is read, in a process that may have so much memory and processor time.
///
/// * `count` - of mutations; none of them: the file alone, as it is
#[cfg(unix)]
fn read_in_child(kind: &str, count: u64, seed: u64, file: &Path) {
    let seconds = CHILD_S * count.div_ceil(1000).max(2);
    let child = Command::new("sh")
        .arg("-c")
        .arg(format!("ulimit -v {CHILD_KIB} && ulimit -t {seconds} && exec \"$0\" \"$@\""))
        .arg(std::env::current_exe().unwrap())
        .args(["import_attack::attack_child", "--exact", "--test-threads=1"])
        .env(ASKED, format!("{kind} {count} {seed} {}", file.display()))
        .env("MALLOC_ARENA_MAX", "1")
        .env("RUST_BACKTRACE", "0")
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&child.stdout);
    assert!(
        child.status.success() && said.contains("1 passed"),
        "{kind}: {} by {}\n{said}{}",
        child.status,
        file.display(),
        String::from_utf8_lossy(&child.stderr)
    );
}

/// The child's part: nothing, unless it is one.
#[test]
fn attack_child() {
    let Ok(asked) = std::env::var(ASKED) else { return };
    let [kind, count, seed, file]: [&str; 4] =
        asked.split(' ').collect::<Vec<_>>().try_into().unwrap();
    let (good, file, count) = (good(kind), Path::new(file), count.parse::<u64>().unwrap());
    if count == 0 {
        return read(kind, file);
    }
    fs::write(file, file_of(kind, good.clone())).unwrap();
    read(kind, file);
    let mut rng = Pcg64Mcg::seed_from_u64(seed.parse().unwrap());
    for _ in 0..count {
        fs::write(file, file_of(kind, mutate(&good, kind, &mut rng))).unwrap();
        read(kind, file);
    }
}

#[cfg(unix)]
#[test]
fn no_mutated_file_ends_a_reader() {
    let number = |name: &str, default: u64| {
        std::env::var(name).map_or(default, |text| text.parse().unwrap())
    };
    let (count, seed) = (number(COUNT, COUNT_IN_TESTS), number(SEED, 1));
    let folder = folder("run");
    for kind in KINDS {
        read_in_child(kind, count, seed, &folder.join(format!("{kind}.mutated")));
    }
    fs::remove_dir_all(folder).unwrap();
}

/// Files that once ended a reader, within the limits of the others.
#[cfg(unix)]
#[test]
fn what_ended_a_reader_once_does_not_again() {
    for entry in fs::read_dir(data("attack")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let copy = folder("finds").join(&name);
        fs::copy(&path, &copy).unwrap();
        if let Some(kind) = KINDS.iter().rev().find(|kind| name.starts_with(&format!("{kind}."))) {
            read_in_child(kind, 0, 0, &copy);
        }
    }
}
