//! Cost of the world: one step in contact and in the air, and the question whether anything is
//! near. `cargo bench -p squirrel-sim --bench world`
#![allow(missing_docs)] // What the macros of criterion make.

use criterion::{Criterion, criterion_group, criterion_main};
use squirrel_core::dynamics::State;
use squirrel_core::frames::{In, Wrench};
use squirrel_core::nalgebra::Vector3;
use squirrel_sim::world::{Cylinder, World, WorldParameters};
use std::hint::black_box;

#[path = "../tests/it/world_fixture/mod.rs"]
mod world_fixture;

/// Trees on a bent grid over 100 m x 100 m, radius 0.15 m to 0.45 m.
fn forest(trees: u32) -> WorldParameters {
    let side = f64::from(trees).sqrt().ceil();
    let obstacles = (0..trees)
        .map(|i| {
            let (row, column) = ((f64::from(i) / side).floor(), f64::from(i) % side);
            Cylinder {
                north_m: (row + 0.4 * (1.7 * column).sin()) * 100.0 / side,
                east_m: (column + 0.4 * (2.3 * row).sin()) * 100.0 / side,
                radius_m: 0.3 + 0.15 * f64::from(i).sin(),
                height_m: 15.0,
            }
        })
        .collect();
    WorldParameters { obstacles, ..world_fixture::open_field() }
}

fn bench(c: &mut Criterion) {
    for trees in [1, 1500] {
        let mut world = World::new(&world_fixture::vehicle(), &forest(trees)).expect("possible");
        // A path through the forest at 7 m/s, 2 m up.
        let states: Vec<State<f64>> = (0..1000)
            .map(|i| {
                let mut state = world_fixture::thrown(2.0, [7.0, 0.0, 0.0], [0.1, -0.2, 0.3]);
                state.position.vector += Vector3::new(0.1, 0.03, 0.0) * f64::from(i);
                state
            })
            .collect();
        let mut i = 0;
        c.bench_function(&format!("is_near, {trees} trees"), |b| {
            b.iter(|| {
                i = (i + 1) % states.len();
                world.is_near(black_box(&states[i]), 1e-3)
            });
        });
        let lift = Wrench::from_force(In::new(Vector3::new(0.0, 0.0, -5.0)));
        let start = world_fixture::thrown(2.0, [0.0; 3], [0.0; 3]);
        let mut state = start;
        c.bench_function(&format!("step in the air, {trees} trees"), |b| {
            b.iter(|| {
                state = world.step(&state, &lift, 1e-3).expect("possible").0;
                if state.position.vector.z > -1.0 {
                    state = start;
                }
            });
        });
        let mut state = world_fixture::thrown(0.02, [0.0; 3], [0.0; 3]);
        c.bench_function(&format!("step on the ground, {trees} trees"), |b| {
            b.iter(|| state = world.step(&state, &lift, 1e-3).expect("possible").0);
        });
    }
}

criterion_group!(benches, bench);
criterion_main!(benches);
