//! Checkpoints of trainings under mutation: none ends the program, and what is taken trains on or
//! is refused in one line.
//!
//! `cargo xtask attack COUNT SEED` runs more of it.

use super::support::{AREA_M2, folder, sets};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use squirrel_nn::model::Model;
use squirrel_nn::train::{Settings, Trainer};
use std::fs;

/// Files in a test, for seconds; the chore takes more.
const COUNT_IN_TESTS: u64 = 300;
/// Of so many that are taken one trains an epoch.
const TRAINED_EVERY: u64 = 50;

/// Numbers of the record that are none of a training's.
const ENDS: [&str; 8] = ["0", "-1", "1e308", "18446744073709551615", "null", "true", "\"\"", "[]"];

fn changed(good: &[u8], rng: &mut Pcg64Mcg) -> Vec<u8> {
    let mut bytes = good.to_vec();
    let head = 8 + u64::from_le_bytes(good[..8].try_into().unwrap()) as usize;
    // The head has the record and matters most.
    let end = if rng.random_range(0..3) > 0 { head } else { bytes.len() };
    let at = rng.random_range(0..end);
    match rng.random_range(0..6) {
        0 => bytes[at] ^= 1 << rng.random_range(0..8),
        1 => bytes[at] = rng.random_range(0..=255),
        2 => bytes.truncate(at),
        3 => bytes[at..(at + 4).min(end)].fill(0xFF),
        _ => {
            // A number of the record becomes another, and the head as long as it says.
            let digits = (8..head).filter(|i| bytes[*i - 1] == b':' && bytes[*i].is_ascii_digit());
            let digits: Vec<usize> = digits.collect();
            let at = digits[rng.random_range(0..digits.len())];
            let old = bytes[at..].iter().take_while(|b| b"0123456789.e-+".contains(b)).count();
            let new = ENDS[rng.random_range(0..ENDS.len())];
            bytes.splice(at..at + old, new.bytes());
            let grown = (head - 8 + new.len() - old) as u64;
            bytes[..8].copy_from_slice(&grown.to_le_bytes());
        }
    }
    bytes
}

#[test]
fn no_mutated_checkpoint_ends_a_training() {
    let number = |name: &str, default: u64| {
        std::env::var(name).map_or(default, |text| text.parse().unwrap())
    };
    let count = number("SQUIRREL_ATTACK_COUNT", COUNT_IN_TESTS);
    let mut rng = Pcg64Mcg::seed_from_u64(number("SQUIRREL_ATTACK_SEED", 1));
    let (training, validation) = sets();
    let path = folder("attack").join("c.safetensors");
    let settings = Settings { epochs: 2, ..Settings::default() };
    let mut trainer =
        Trainer::new(Model::Parnn, "test", AREA_M2, &training, &validation, settings).unwrap();
    trainer.epoch().unwrap();
    trainer.save(&path).unwrap();
    let good = fs::read(&path).unwrap();
    let mut taken = 0;
    for _ in 0..count {
        fs::write(&path, changed(&good, &mut rng)).unwrap();
        match Trainer::resume(&path, &training, &validation) {
            Ok(mut trainer) => {
                taken += 1;
                if taken % TRAINED_EVERY == 1
                    && let Err(error) = trainer.epoch()
                {
                    assert!(!error.to_string().contains('\n'), "{error}");
                }
            }
            Err(error) => {
                let error = error.to_string();
                assert!(!error.contains('\n') && error.contains("c.safetensors"), "{error}");
            }
        }
    }
    assert!(taken > count / 50, "{taken} of {count} taken");
}
