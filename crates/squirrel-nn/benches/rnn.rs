//! The recurrent network 2-8-8-2 over windows of ten: forwards in flight and in bulk, and an epoch
//! of training.
//!
//! `benches/rnn/compare.py` runs JAX and PyTorch beside these.

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use squirrel_core::rnn::elman::Elman;
use squirrel_core::rnn::parnn::WINDOW;
use squirrel_nn::kernel::{forward, simd::Path};
use squirrel_nn::model::Model;
use squirrel_nn::train::{Settings, Trainer};
use squirrel_nn::windows::{Window, Windows};
use std::hint::black_box;

/// Any numbers within [-1, 1), all different.
fn numbers() -> impl FnMut() -> f32 {
    let mut state = 1_u32;
    move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / 8_388_608.0 - 1.0
    }
}

fn network() -> Elman<2, 8, 2> {
    let (mut net, mut number) = (Elman::filled(0.0), numbers());
    net.tensors_mut().into_iter().flatten().for_each(|weight| *weight = 0.35 * number());
    net
}

fn windows(count: usize) -> Vec<[[f32; 2]; WINDOW]> {
    let mut number = numbers();
    (0..count).map(|_| core::array::from_fn(|_| [number(), number()])).collect()
}

fn forwards(c: &mut Criterion) {
    let (net, rows) = (network(), windows(1000));
    let mut group = c.benchmark_group("rnn_forward");
    group.bench_function("1_window", |b| {
        b.iter(|| black_box(&net).window::<f32>(black_box(&rows[0])));
    });
    for path in Path::available() {
        group.bench_function(format!("1000_windows_{}", path.name()), |b| {
            b.iter(|| forward::<WINDOW, 2, _>(path, black_box(&net), black_box(&rows)));
        });
    }
    group.finish();
}

fn epochs(c: &mut Criterion) {
    let mut number = numbers();
    let rows = windows(5000);
    let windows: Vec<Window> = rows
        .into_iter()
        .map(|rows| Window {
            rows,
            velocity_body_m_s: core::array::from_fn(|_| 6.0 * number()),
            q_ned_from_body_wxyz: [1.0, 0.0, 0.0, 0.0],
            label_body_n: core::array::from_fn(|_| number()),
            truth_body_n: None,
        })
        .collect();
    let mut data = Windows::new();
    data.push("bench", &windows).expect("sound");
    let settings = Settings { batch: 64, ..Settings::default() };
    let mut group = c.benchmark_group("rnn_epoch");
    for model in [Model::VanillaPlane, Model::Parnn] {
        for path in Path::available() {
            let trainer = Trainer::new(model, "bench", 0.04, &data, &Windows::new(), settings);
            let trainer = trainer.expect("sound").on(path);
            group.bench_function(format!("{}_{}", model.name(), path.name()), |b| {
                b.iter_batched_ref(
                    || trainer.clone(),
                    |trainer| trainer.epoch().expect("finite"),
                    BatchSize::LargeInput,
                );
            });
        }
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20).measurement_time(std::time::Duration::from_secs(2));
    targets = forwards, epochs
}
criterion_main!(benches);
