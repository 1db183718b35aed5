//! Wire records under mutation: a log that a board sent down its serial line, and the tables of a
//! test bench. What is taken is flown by the flight code, whatever its setup and its frames say.
//!
//! `cargo xtask attack COUNT SEED` runs more of it.

use crate::attack::{ENDS, bytes, count_and_rng, folder, is_a_line, mutated};
use crate::board_log::flown;
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use squirrel_log::import::import_board;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_sim::vehicle_file::fit::{Stand, Swing, swings};

/// Setup and frames that are sent: enough for every law to have had its turn.
const RECORDS: usize = 40;

/// Numbers of a record that are none, or at the ends of what there is.
const ENDS_F32: [f32; 8] =
    [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, f32::MIN_POSITIVE, 0.0, -1.0];

/// A record with a number or a byte changed, and framed anew: the framing does not tell.
fn changed(line: &[u8], rng: &mut Pcg64Mcg) -> Vec<u8> {
    let mut record = cobs::decode_vec(&line[..line.len() - 1]).unwrap();
    let at = rng.random_range(0..record.len());
    let room = (record.len() - at).min(4);
    match rng.random_range(0..4) {
        0 => record[at] ^= 1 << rng.random_range(0..8),
        1 => record[at] = rng.random_range(0..=255),
        _ => {
            let number = ENDS_F32[rng.random_range(0..ENDS_F32.len())].to_le_bytes();
            record[at..at + room].copy_from_slice(&number[..room]);
        }
    }
    let mut line = cobs::encode_vec(&record);
    line.push(0);
    line
}

#[test]
fn no_mutated_board_log_ends_the_program() {
    let (count, mut rng) = count_and_rng();
    let (_, mut good) = flown();
    good.truncate(RECORDS);
    let path = folder().join("board.bin");
    let mut taken = 0;
    for k in 0..count {
        let log = if k % 4 == 0 {
            bytes(&good.concat(), &mut rng)
        } else {
            let mut lines = good.clone();
            for _ in 0..rng.random_range(1..4) {
                // The setup is one of many records and matters most.
                let at = rng.random_range(0..2) * rng.random_range(0..lines.len());
                lines[at] = changed(&lines[at], &mut rng);
            }
            lines.concat()
        };
        std::fs::write(&path, log).unwrap();
        match import_board(&path) {
            Ok((log, report)) => {
                taken += 1;
                is_a_line(&report.to_string());
                if k % 16 == 1 {
                    // What is read can be written, or is refused.
                    if let Err(error) = log.write(&path.with_extension("mcap")) {
                        is_a_line(&error.to_string());
                    }
                }
            }
            Err(error) => is_a_line(&error.to_string()),
        }
    }
    assert!(taken > count / 10, "{taken} of {count} taken");
}

const STAND: &str = "thrust_n,rotor_speed_rad_s,command,torque_n_m,voltage_v\n0.5, 300, 0.2, 0.008, 16.5\n\
                     1.1, 450, 0.35, 0.017, 16.3\n2.0, 600, 0.5, 0.03, 16.0\n3.1, 750, 0.65, 0.047, 15.7\n\
                     4.5, 900, 0.8, 0.069, 15.2\n6.1, 1050, 1.0, 0.093, 14.8\n";
const SWINGS: &str = "axis,period_s,thread_length_m,thread_distance_m,mass_kg\nx, 1.1, 0.9, 0.3, 0.7\n\
                      y, 1.2, 0.9, 0.3, 0.7\nz, 1.3, 0.9, 0.3, 0.7\n";

/// A table with a number that stands in a cell for itself, or a place or a line changed.
fn table(good: &str, rng: &mut Pcg64Mcg) -> String {
    let text = mutated(good, rng);
    let mut cells: Vec<&str> = text.split_inclusive([',', '\n']).collect();
    let at = rng.random_range(0..cells.len().max(1));
    if rng.random_range(0..2) == 0 && at < cells.len() {
        let end = [",", "\n"][usize::from(cells[at].ends_with('\n'))];
        cells[at] = ENDS[rng.random_range(0..ENDS.len())];
        cells.insert(at + 1, end);
    }
    cells.concat()
}

#[test]
fn no_mutated_table_of_a_bench_ends_the_program() {
    let (count, mut rng) = count_and_rng();
    let vehicle = VehicleFile::squirrel();
    let mut fitted = 0;
    for k in 0..count {
        let said = if k % 2 == 0 {
            Stand::parse(&table(STAND, &mut rng), "stand.csv")
                .and_then(|stand| stand.fit(&vehicle, "stand.csv"))
                .map(|fit| fit.numbers)
        } else {
            Swing::parse(&table(SWINGS, &mut rng), "swings.csv")
                .and_then(|all| swings(&vehicle, &all, "swings.csv"))
                .map(|fit| fit.numbers)
        };
        match said {
            Ok(numbers) => {
                fitted += 1;
                for number in numbers {
                    assert!(number.value.iter().all(|x| x.is_finite()), "{number:?}");
                }
            }
            Err(error) => is_a_line(&error),
        }
    }
    assert!(fitted > count / 20, "{fitted} of {count} fitted");
}
