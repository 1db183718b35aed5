//! What registers are worth to a batch, on one core: `cargo xtask batch-gate`.
//!
//! Prints million vehicle-steps a second of each path for the base model and for whole vehicles
//! (membrane wing, battery, gusts), and fails where the base model is less than 5 times (AVX2) or 7
//! times (AVX-512) as fast as the path of one number at a time.
#![allow(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "prints a table of measured times"
)]

use squirrel_batch::{Batch, BatchVehicle, Scheme, Settings};
use squirrel_sim::plant::{GustModel, WindParameters};
use squirrel_sim::simd::Path;
use squirrel_sim::vehicle_file::VehicleFile;
use std::error::Error;
use std::hint::black_box;
use std::time::Instant;

const VEHICLES: usize = 1024;
const STEPS: usize = 100;
const CALLS: usize = 6;
const ROUNDS: usize = 6;
const WIND: WindParameters = WindParameters {
    mean_ned_m_s: [3.0, 0.0, 0.0],
    gust_sigma_m_s: 0.8,
    gust: GustModel::Dryden { scale_length_m: 6.0 },
};

type Made = Result<Batch<f32>, Box<dyn Error>>;

fn base(settings: Settings) -> Made {
    Ok(Batch::new(&vec![VehicleFile::squirrel().vehicle.cast()?; VEHICLES], settings)?)
}

fn whole(settings: Settings) -> Made {
    let member = BatchVehicle::from(&VehicleFile::squirrel());
    let mut batch = Batch::with(&vec![member.clone(); VEHICLES], settings)?;
    for number in 0..VEHICLES {
        batch.set_air(number, &member, WIND, number as u64)?;
    }
    batch.command_wings(&[1.0; 2 * VEHICLES])?;
    Ok(batch)
}

/// Calls `work` so many frames further down the stack.
fn further_down<T>(frames: usize, work: &mut dyn FnMut() -> T) -> T {
    let frame = black_box([0_u8; 600]);
    let done = if frames == 0 { work() } else { further_down(frames - 1, work) };
    black_box(frame);
    done
}

/// Million vehicle-steps a second, the best of rounds in turn: what disturbs a shared machine only
/// ever takes time away. Where a batch lies in memory beside what registers are spilled to may
/// halve its speed, so each round has batches of its own, none is freed before the end, and the
/// stack begins elsewhere.
fn speeds(make: fn(Settings) -> Made) -> Result<Vec<f64>, Box<dyn Error>> {
    let paths = Path::available();
    let mut best = vec![0.0_f64; paths.len()];
    let mut kept = Vec::new();
    for round in 0..ROUNDS {
        for (best, path) in best.iter_mut().zip(paths.iter().copied()) {
            let mut batch = make(Settings { dt_s: 1e-3, scheme: Scheme::Rk4, threads: 1, path })?;
            batch.command(&[0.5; 4 * VEHICLES])?;
            let seconds = further_down(round, &mut || {
                let start = Instant::now();
                for _ in 0..CALLS {
                    batch.step(STEPS);
                }
                start.elapsed().as_secs_f64()
            });
            *best = best.max(1e-6 * (CALLS * VEHICLES * STEPS) as f64 / seconds);
            kept.push(batch);
        }
    }
    Ok(best)
}

fn main() -> Result<(), Box<dyn Error>> {
    let (base, whole) = (speeds(base)?, speeds(whole)?);
    println!("one core, RK4, f32, million vehicle-steps a second, and times the first row");
    println!("path      base model           wing, battery, gusts");
    let mut slow = Vec::new();
    for (i, path) in Path::available().iter().enumerate() {
        let [one, other] = [&base, &whole].map(|speeds| speeds[i] / speeds[0]);
        println!(
            "{:8} {:7.1}  x{one:5.1}     {:7.1}  x{other:5.1}",
            path.name(),
            base[i],
            whole[i]
        );
        let least = match path.name() {
            "avx512" => 7.0,
            "avx2" => 5.0,
            _ => 0.0,
        };
        if one < least {
            slow.push(format!("{}: x{one:.2} of the first path, must be x{least}", path.name()));
        }
    }
    if slow.is_empty() { Ok(()) } else { Err(slow.join("; ").into()) }
}
