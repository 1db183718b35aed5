//! The registers are worth their code. Measures time, so it is run alone and in release:
//! `cargo test -p squirrel-sim --release --test batch_speed -- --ignored`.
#![allow(clippy::unwrap_used, reason = "tests")]
#![allow(clippy::disallowed_methods, reason = "measures time")]

mod batch_support;

use batch_support::Thrown;
use squirrel_sim::batch::simd::Path;
use squirrel_sim::batch::{Batch, Scheme, Settings};
use std::time::Instant;

const VEHICLES: usize = 1024;
const STEPS: usize = 100;
const CALLS: usize = 10;

/// Vehicle-steps a second.
fn speed(batch: &mut Batch<f32>) -> f64 {
    let start = Instant::now();
    for _ in 0..CALLS {
        batch.step(STEPS);
    }
    (CALLS * VEHICLES * STEPS) as f64 / start.elapsed().as_secs_f64()
}

#[test]
#[ignore = "measures time"]
fn wide_registers_are_faster_than_one_number_by_far() {
    let mut thrown = Thrown::<f32>::new(VEHICLES);
    thrown.commands.fill(0.5);
    let paths = Path::available();
    let mut batches: Vec<Batch<f32>> = paths
        .iter()
        .map(|path| thrown.batch(Settings { dt_s: 1e-3, scheme: Scheme::Rk4, threads: 1, path: *path }))
        .collect();
    // Best of rounds in turn: what disturbs a shared machine only ever takes time away.
    let mut best = vec![0.0_f64; paths.len()];
    for _ in 0..8 {
        for (best, batch) in best.iter_mut().zip(&mut batches) {
            *best = best.max(speed(batch));
        }
    }
    for (path, best_speed) in paths.iter().zip(&best) {
        let ratio = best_speed / best[0];
        let needed = match path.name() {
            "avx512" => 7.0,
            "avx2" => 5.0,
            _ => 0.0,
        };
        println!("{}: {:.1} million vehicle-steps a second, x{ratio:.1}", path.name(), best_speed * 1e-6);
        assert!(ratio >= needed, "{}: x{ratio:.2} of the scalar path, must be x{needed}", path.name());
    }
}
