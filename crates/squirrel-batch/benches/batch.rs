//! Vehicle-steps of batches: 10 000 and 100 vehicles, RK4 and Euler, one step and 100 steps a call,
//! all threads, widest registers; and what a reinforcement-learning loop does besides: commands in,
//! motions out. One core and each path: `cargo xtask batch-gate`.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use squirrel_batch::{BODY_NUMBERS, Batch, Scheme, Settings};
use squirrel_sim::simd::{Path, Paths};
use squirrel_sim::vehicle_file::VehicleFile;
use std::hint::black_box;

fn batch<T: Paths>(vehicles: usize, settings: Settings) -> Batch<T> {
    let vehicle = VehicleFile::squirrel().vehicle.cast().expect("sound");
    let mut batch = Batch::new(&vec![vehicle; vehicles], settings).expect("sound");
    batch.command(&vec![nalgebra::convert(0.5); vehicles * 4]).expect("fits");
    batch
}

fn steps<T: Paths>(c: &mut Criterion, scalar: &str) {
    for scheme in [Scheme::Rk4, Scheme::Euler] {
        for vehicles in [10_000, 100] {
            for steps in [1, 100] {
                let mut group =
                    c.benchmark_group(format!("{scalar}_{scheme:?}_{vehicles}x{steps}"));
                group.throughput(Throughput::Elements((vehicles * steps) as u64));
                let path = Path::best();
                let settings = Settings { scheme, path, ..Settings::default() };
                let mut batch = batch::<T>(vehicles, settings);
                group.bench_function(BenchmarkId::from_parameter(path.name()), |b| {
                    b.iter(|| batch.step(black_box(steps)));
                });
                group.finish();
            }
        }
    }
}

fn all_steps(c: &mut Criterion) {
    steps::<f32>(c, "f32");
    steps::<f64>(c, "f64");
}

fn commands_and_motions(c: &mut Criterion) {
    let mut group = c.benchmark_group("commands_in_step_motions_out");
    for vehicles in [10_000, 100] {
        let mut batch =
            batch::<f32>(vehicles, Settings { scheme: Scheme::Euler, ..Settings::default() });
        let commands = vec![0.5; vehicles * 4];
        let mut rows = vec![0.0; vehicles * (BODY_NUMBERS + 4)];
        group.throughput(Throughput::Elements(vehicles as u64));
        group.bench_function(BenchmarkId::from_parameter(vehicles), |b| {
            b.iter(|| {
                batch.fly(black_box(&commands), 1, black_box(&mut rows)).expect("fits");
            });
        });
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .sample_size(20)
        .warm_up_time(std::time::Duration::from_millis(300))
        .measurement_time(std::time::Duration::from_secs(1));
    targets = all_steps, commands_and_motions
}
criterion_main!(benches);
