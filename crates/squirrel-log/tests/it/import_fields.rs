//! Every field on every sample, as other readers of the same files read them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use squirrel_log::Channel;
use squirrel_log::import::{ImportMap, import};

pub(crate) fn data(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(file)
}

/// Names and numbers of one message.
type Fields<'t> = Vec<(&'t str, f64)>;

/// Columns of one topic as they are, by a map.
fn columns(path: &Path, topic: &str, clock: (&str, &str), wanted: &[&str]) -> Channel {
    let quoted: Vec<String> = wanted.iter().map(|name| format!("{name:?}")).collect();
    let (time, unit) = clock;
    let map = format!(
        "[[source]]\n{topic}\ntime = {{ column = {time:?}, unit = {unit:?} }}\nchannels = {{ \"truth.all\" = {{ columns = [{}] }} }}\n",
        quoted.join(", ")
    );
    let map = ImportMap::parse(&map, "map.toml").unwrap();
    let (log, _) = import(&map, &[path.to_path_buf()]).unwrap();
    log.channel("truth.all").unwrap().1.clone()
}

fn crc(numbers: impl Iterator<Item = [u8; 8]>) -> String {
    let mut hasher = crc32fast::Hasher::new();
    numbers.for_each(|number| hasher.update(&number));
    format!("{:08x}", hasher.finalize())
}

#[test]
fn ulog_fields_are_what_pyulog_reads() {
    let path = data("ulog/sample_cut.ulg");
    let expected = std::fs::read_to_string(data("ulog/sample_cut.pyulog.csv")).unwrap();
    let mut topics: BTreeMap<&str, Vec<Vec<&str>>> = BTreeMap::new();
    for line in expected.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        topics.entry(cells[0]).or_default().push(cells);
    }
    let parameters = squirrel_log::import::parameters(&path).unwrap();
    for cells in topics.remove("parameter").unwrap() {
        assert_eq!(parameters[cells[1]], cells[3].parse::<f64>().unwrap(), "{}", cells[1]);
    }
    assert_eq!(topics.len(), 4);
    for (topic, rows) in topics {
        let names: Vec<&str> = rows.iter().map(|cells| cells[1]).collect();
        let read = columns(&path, &format!("topic = {topic:?}"), ("timestamp", "us"), &names);
        for (i, cells) in rows.iter().enumerate() {
            let column = || read.values.iter().skip(i).step_by(names.len());
            assert_eq!(column().count().to_string(), cells[2], "{topic}.{}", cells[1]);
            let crc = crc(column().map(|x| x.to_le_bytes()));
            assert_eq!(crc, cells[3], "{topic}.{}", cells[1]);
        }
    }
}

#[test]
fn ardupilot_fields_are_what_dfreader_reads() {
    let path = data("ardupilot/quad.bin");
    let expected = std::fs::read_to_string(data("ardupilot/quad.dfreader.csv")).unwrap();
    let mut messages: BTreeMap<(&str, u8), Vec<Fields>> = BTreeMap::new();
    let mut parameters = BTreeMap::new();
    for line in expected.lines() {
        let (name, rest) = line.split_once(',').unwrap();
        let fields: Vec<(&str, &str)> =
            rest.split(',').map(|field| field.split_once('=').unwrap()).collect();
        let find = |wanted: &[&str]| fields.iter().find(|(name, _)| wanted.contains(name));
        if name == "PARM" {
            let name = fields[1].1.trim_matches('\'').to_owned();
            parameters.insert(name, fields[2].1.parse::<f64>().unwrap());
            continue;
        }
        let instance = find(&["I", "Instance", "Inst", "C"]).filter(|_| name != "RATE");
        let instance = instance.map_or(0, |(_, text)| text.parse().unwrap());
        let numbers = fields.iter().map(|(name, text)| (*name, text.parse().unwrap()));
        messages.entry((name, instance)).or_default().push(numbers.collect());
    }
    assert_eq!(squirrel_log::import::parameters(&path).unwrap(), parameters);
    assert_eq!(messages.len(), 17);
    for ((name, instance), rows) in messages {
        let names: Vec<&str> = rows[0].iter().map(|(name, _)| *name).collect();
        let topic = format!("topic = {name:?}\ninstance = {instance}");
        let read = columns(&path, &topic, ("TimeUS", "us"), &names);
        let expected: Vec<f64> = rows.iter().flatten().map(|(_, number)| *number).collect();
        assert_eq!(read.values, expected, "{name} {instance}");
    }
}

#[test]
fn blackbox_fields_are_what_a_decoder_of_its_own_reads() {
    let expected = std::fs::read_to_string(data("blackbox/sitl.decoded.csv")).unwrap();
    let rows: Vec<Vec<&str>> =
        expected.lines().skip(1).map(|line| line.split(',').collect()).collect();
    let names: Vec<&str> = rows.iter().map(|cells| cells[0]).collect();
    let path = data("blackbox/sitl.bbl");
    let read = columns(&path, "topic = \"main\"", ("time", "us"), &names);
    assert_eq!(rows.len(), 38);
    for (i, cells) in rows.iter().enumerate() {
        let column = || read.values.iter().skip(i).step_by(names.len());
        assert_eq!(column().count().to_string(), cells[1], "{}", cells[0]);
        assert_eq!(crc(column().map(|&x| (x as i64).to_le_bytes())), cells[2], "{}", cells[0]);
    }
}
