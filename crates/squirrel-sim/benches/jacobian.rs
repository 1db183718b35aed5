//! A step of the plant that carries derivatives by twelve numbers, beside the step alone, of which
//! central differences take 24.
//!
//! By itself, because it takes the compiler long.

use criterion::{Criterion, criterion_group, criterion_main};
use squirrel_core::dynamics::State;
use squirrel_core::frames::In;
use squirrel_core::nalgebra::Vector3;
use squirrel_sim::plant::Plant;
use squirrel_sim::vehicle_file::VehicleFile;
use std::hint::black_box;

fn jacobian(c: &mut Criterion) {
    let file = VehicleFile::squirrel();
    let plant =
        Plant::new(file.vehicle, file.effects, file.wing, file.battery, 1e-3).expect("sound");
    let mut body = State::at_rest();
    body.velocity = In::new(Vector3::new(5.0, 1.0, 0.3));
    body.rotor_speed_rad_s[..4].fill(1500.0);
    let state = plant.initial_state(body, 1.0);
    let command = [0.5, 0.501, 0.5, 0.499, 0.0, 0.0, 0.0, 0.0];
    let mut group = c.benchmark_group("membrane_wing");
    group.bench_function("step", |b| {
        b.iter(|| {
            let mut state = state;
            plant.step(&mut state, black_box(&command), [1.0; 2], In::zero());
            state
        });
    });
    group.bench_function("jacobian", |b| {
        b.iter(|| plant.jacobian(black_box(&state), black_box(&command), [1.0; 2], In::zero()));
    });
    group.finish();
}

criterion_group!(benches, jacobian);
criterion_main!(benches);
