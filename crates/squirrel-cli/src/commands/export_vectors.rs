//! `squirrel export-vectors`: the sensor frames of flights for a target without files, with the
//! hash of every output.
//!
//! The bytes are those of [`squirrel_core::stack::wire`]: `vectors.bin` is a header, then for each
//! flight its setup and its frames; `setup-K.bin` is the setup of flight K alone, a file of vectors
//! without frames, for a board to fly with. Before anything is written the host flies all of them
//! again: vectors whose outputs are not the log's would test nothing.

use crate::output::{self, Table, talk};
use crate::paths::Paths;
use crate::paths::log_files;
use clap::value_parser;
use serde::Serialize;
use squirrel_core::stack::wire::{HASH_START, Header, RECORD_MAX, Record, Wire, hash, written};
use squirrel_core::stack::{SensorFrame, Stack, StackState};
use squirrel_log::FlightLog;
use squirrel_log::flight_code::frames;
use squirrel_sim::faults::Fault;
use squirrel_sim::replay;
use std::path::PathBuf;

const VECTORS: &str = "vectors.bin";
/// Most pieces of a flight: what is more was not meant.
const FAULTS_MAX: i64 = 10_000;

/// Options of the export.
#[derive(Debug, clap::Args)]
pub(crate) struct ExportVectors {
    /// Flight logs recorded by `squirrel fly`, or folders of them.
    #[arg(required = true)]
    flights: Vec<PathBuf>,
    /// Instead of each flight as it was, this many pieces of it with a sensor fault each.
    #[arg(long, default_value_t = 0, value_parser = value_parser!(u32).range(0..=FAULTS_MAX))]
    faults: u32,
    /// Seed of the faults.
    #[arg(long, default_value_t = 0)]
    seed: u32,
    /// Folder for `vectors.bin` and, of each flight, `setup-0.bin` and so on; made where it is
    /// missing.
    #[arg(long)]
    out: PathBuf,
    /// Write the result here as JSON.
    #[arg(long)]
    json: Option<PathBuf>,
}

/// One flight in the file.
#[derive(Serialize)]
struct Sequence {
    flight: String,
    /// File of its setup.
    setup: String,
    arm: &'static str,
    /// The whole flight, or the fault in a piece of it.
    what: String,
    steps: u32,
    /// Of all outputs, 16 hexadecimal digits.
    hash: String,
}

impl ExportVectors {
    pub(crate) fn run(&self) -> Result<(), String> {
        let flights = log_files(&self.flights)?;
        let names = (0..flights.len()).map(setup_file).chain([VECTORS.to_owned()]);
        let paths = Paths::default().reads("FLIGHTS", &flights).writes_into(&self.out, names);
        paths.writes("--json", &self.json).check()?;
        let mut setups = Vec::new();
        let mut sequences = Vec::new();
        let mut records = Vec::new();
        for path in flights {
            let file = path.display().to_string();
            let at = |e: String| format!("{file}: {e}");
            let log = FlightLog::read(&path).map_err(|e| e.to_string())?;
            let setup = replay::setup(&log).map_err(at)?;
            if let Some(d) = replay::replay(&log, &setup).map_err(at)?.first_difference {
                return Err(format!(
                    "{file}: {} at {:.6} s differs from the log; the vectors would not be of this flight",
                    d.channel, d.time_s
                ));
            }
            let stack = setup.stack().map_err(|e| at(e.to_string()))?;
            let frames = frames(&log).map_err(|e| at(e.to_string()))?;
            let setup_file = setup_file(setups.len());
            let alone = Header { sequences: 1, frames: 0 };
            setups.push([wire(&alone)?, record(&Record::Setup(stack))?].concat());
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let mut add = |what: String, frames: &[SensorFrame]| {
                let hash = format!("{:016x}", append(&mut records, &stack, frames)?);
                let (flight, steps) = (name.clone(), frames.len() as u32);
                let (setup, arm) = (setup_file.clone(), setup.arm.name());
                sequences.push(Sequence { flight, setup, arm, what, steps, hash });
                Ok::<_, String>(())
            };
            if self.faults == 0 {
                add("whole".to_owned(), &frames).map_err(at)?;
            }
            for k in 0..self.faults {
                let (fault, broken) =
                    Fault::draw(&frames, self.seed.wrapping_add(k)).map_err(at)?;
                let Fault { sensor, kind, start_us, end_us } = fault;
                let length_s = (end_us - start_us) as f64 * 1e-6;
                add(format!("{sensor:?} {kind:?} {length_s:.2} s"), &broken).map_err(at)?;
            }
        }
        let frames = sequences.iter().map(|s| s.steps).sum();
        let header = Header { sequences: sequences.len() as u32, frames };
        let mut bytes = wire(&header)?;
        bytes.append(&mut records);
        output::folder(&self.out)?;
        for (k, setup) in setups.iter().enumerate() {
            output::write_file(&self.out.join(setup_file(k)), setup)?;
        }
        let vectors = self.out.join(VECTORS);
        output::write_file(&vectors, &bytes)?;
        let mut table =
            Table::new(&["flight", "setup", "arm", "what", "steps", "hash of the outputs"]);
        for s in &sequences {
            let steps = s.steps.to_string();
            let (flight, setup, arm) = (s.flight.clone(), s.setup.clone(), s.arm.to_owned());
            table.row(vec![flight, setup, arm, s.what.clone(), steps, s.hash.clone()]);
        }
        table.print();
        talk(&format!("wrote {}, {} bytes", vectors.display(), bytes.len()));
        output::write_json(self.json.as_deref(), &sequences)
    }
}

/// The setup of a flight alone.
fn setup_file(flight: usize) -> String {
    format!("setup-{flight}.bin")
}

/// What a value is on the wire.
pub(crate) fn wire(value: &impl Wire) -> Result<Vec<u8>, String> {
    written(value, <[u8]>::to_vec)
        .ok_or_else(|| format!("a record is longer than {RECORD_MAX} bytes"))
}

/// A record behind its length.
pub(crate) fn record(record: &Record) -> Result<Vec<u8>, String> {
    let bytes = wire(record)?;
    let length = u16::try_from(bytes.len())
        .map_err(|e| format!("a record of {} bytes: {e}", bytes.len()))?;
    Ok([&length.to_le_bytes()[..], &bytes].concat())
}

/// A setup and its frames; the hash of all outputs.
fn append(records: &mut Vec<u8>, stack: &Stack, frames: &[SensorFrame]) -> Result<u64, String> {
    records.extend(record(&Record::Setup(*stack))?);
    let (mut state, mut outputs) = (StackState::default(), HASH_START);
    for frame in frames {
        outputs = hash(outputs, &wire(&stack.step(&mut state, frame))?);
        records.extend(record(&Record::Frame(*frame, outputs))?);
    }
    Ok(outputs)
}
