//! What a board sends down its serial line becomes the flight log of the same flight.

use squirrel_core::stack::wire::{HASH_START, Record, Wire, hash, written};
use squirrel_core::stack::{Stack, StackState};
use squirrel_log::FlightLog;
use squirrel_log::flight_code::frames;
use squirrel_log::import::{BoardReport, import_board};
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{Integrator, Setup};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;
use std::path::PathBuf;

fn wire(value: &impl Wire) -> Vec<u8> {
    written(value, <[u8]>::to_vec).unwrap()
}

/// A flight, and each of its records as a board would send it: the setup first.
pub(super) fn flown() -> (FlightLog, Vec<Vec<u8>>) {
    let scenario = Scenario { duration_s: 4.0, ..Scenario::find("random_spread").unwrap() };
    let setup = Setup {
        vehicle: VehicleFile::squirrel(),
        arm: Arm::TwccFlat,
        scenario,
        integrator: Integrator::Rk4,
    };
    let log = setup.fly(true, |_| {}).unwrap().log.unwrap();
    let stack: Stack = setup.stack().unwrap();
    let sent = |record: &Record| {
        let mut line = cobs::encode_vec(&wire(record));
        line.push(0);
        line
    };
    let mut lines = vec![sent(&Record::Setup(stack))];
    let (mut state, mut outputs) = (StackState::default(), HASH_START);
    for frame in frames(&log).unwrap() {
        outputs = hash(outputs, &wire(&stack.step(&mut state, &frame)));
        lines.push(sent(&Record::Frame(frame, outputs)));
    }
    (log, lines)
}

fn imported(name: &str, bytes: &[u8]) -> Result<(FlightLog, BoardReport), String> {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, bytes).unwrap();
    import_board(&path).map_err(|e| e.to_string())
}

/// Sources of the flight code of both, compared bit for bit up to a time.
fn assert_same(log: &FlightLog, again: &FlightLog, until_s: f64) {
    let mut compared = 0;
    for (name, source) in &log.sources {
        if ["truth", "battery"].contains(&name.as_str()) {
            continue;
        }
        let n = source.time_s.iter().filter(|t| **t <= until_s).count();
        assert_eq!(source.time_s[..n], again.sources[name].time_s[..n], "{name}");
        for (channel, values) in &again.sources[name].channels {
            let rows = n * values.width;
            let bits = |x: &[f64]| x[..rows].iter().map(|v| v.to_bits()).collect::<Vec<_>>();
            assert_eq!(
                bits(&source.channels[channel].values),
                bits(&values.values),
                "{name}.{channel}"
            );
            compared += rows;
        }
    }
    assert!(compared > 10_000, "{compared} numbers");
}

#[test]
fn a_whole_log_is_the_flight_to_the_bit() {
    let (log, lines) = flown();
    let (again, report) = imported("whole.bin", &lines.concat()).unwrap();
    assert_same(&log, &again, f64::INFINITY);
    assert_eq!((report.frames, report.lost_records), (lines.len() - 1, 0));
    assert_eq!(report.outputs_until_s, Some(report.time_s[1]));
    assert!(report.to_string().ends_with("every output is the board's to the bit"), "{report}");
}

/// Inputs go on behind a lost frame; outputs would be guesses.
#[test]
fn a_damaged_frame_ends_the_outputs_and_no_input_but_its_own() {
    let (log, mut lines) = flown();
    let bad = lines.len() / 2;
    lines[bad].remove(5);
    let (again, report) = imported("damaged.bin", &lines.concat()).unwrap();
    let last_good_s = log.sources["frame"].time_s[bad - 2];
    assert_eq!((report.frames, report.lost_records), (lines.len() - 2, 1));
    assert_eq!(report.outputs_until_s, Some(last_good_s));
    assert_same(&log, &again, last_good_s);
    assert_eq!(again.sources["rotor"].time_s.last(), Some(&last_good_s));
    assert_eq!(again.sources["imu"].time_s.last(), log.sources["imu"].time_s.last());
}

#[test]
fn a_log_that_was_cut_off_keeps_what_is_whole() {
    let (_, lines) = flown();
    let mut bytes = lines.concat();
    bytes.truncate(bytes.len() - 7);
    let (_, report) = imported("cut.bin", &bytes).unwrap();
    assert_eq!((report.frames, report.lost_records), (lines.len() - 2, 1));
    assert_eq!(report.outputs_until_s, Some(report.time_s[1]));
}

#[test]
fn what_is_no_flight_is_one_clear_error() {
    let (_, lines) = flown();
    let refused = |name: &str, bytes: &[u8], says: &str| {
        let error = imported(name, bytes).unwrap_err();
        assert!(error.contains(name) && error.contains(says), "{error}");
    };
    refused("empty.bin", &[], "no frame behind a setup in 0 bytes");
    refused("headless.bin", &lines[1..20].concat(), "19 records are damaged or belong to no setup");
    refused("twice.bin", &[&lines[..20], &lines[..20]].concat().concat(), "2 flights");
    let swapped = [&lines[..10], &lines[11..12], &lines[10..11]].concat().concat();
    refused("swapped.bin", &swapped, "not after the frame before it");
    refused("noise.bin", &[0x5A; 4000], "no frame behind a setup in 4000 bytes; 1 records");
}
