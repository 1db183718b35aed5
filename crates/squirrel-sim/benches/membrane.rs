//! Cost of the membrane wing, both sides: one evaluation, and RK4 steps where each stage waits for
//! the one before.
//!
//! Read the smallest of several runs on a quiet machine. The target is 60 ns an evaluation in a
//! generic x86-64 build.

use criterion::{Criterion, criterion_group, criterion_main};
use squirrel_core::aero::Air;
use squirrel_core::dynamics::{VectorSpace, rk4};
use squirrel_core::frames::In;
use squirrel_core::nalgebra::Vector3;
use squirrel_sim::plant::{Membrane, MembraneParameters, MembraneState};
use std::hint::black_box;

const SPREAD: [f64; 2] = [1.0; 2];
const ANGLE_RATE_RAD_S: [f64; 2] = [0.5; 2];

/// A wing that moves without rotation.
#[derive(Clone, Copy)]
struct Falling {
    velocity_m_s: Vector3<f64>,
    membrane: MembraneState,
}

impl VectorSpace<f64> for Falling {
    fn plus_scaled(&self, h: f64, rate: &Self) -> Self {
        Self {
            velocity_m_s: self.velocity_m_s + rate.velocity_m_s * h,
            membrane: self.membrane.plus_scaled(h, &rate.membrane),
        }
    }
}

fn air(velocity_m_s: Vector3<f64>) -> Air<f64> {
    let omega = In::new(Vector3::new(0.5, -0.2, 0.1));
    Air { velocity: In::new(velocity_m_s), speed: velocity_m_s.norm(), omega }
}

fn bench(c: &mut Criterion) {
    let wing =
        Membrane::new(MembraneParameters::new(0.02, 0.09)).expect("the defaults are possible");
    let start =
        Falling { velocity_m_s: Vector3::new(6.0, 0.5, 3.0), membrane: MembraneState::at_rest() };

    c.bench_function("membrane: evaluate", |b| {
        let air = air(start.velocity_m_s);
        b.iter(|| {
            let (air, state) = (black_box(&air), black_box(&start.membrane));
            wing.evaluate(air, black_box(ANGLE_RATE_RAD_S), black_box(SPREAD), state)
        });
    });
    c.bench_function("membrane: angle of attack", |b| {
        let air = air(start.velocity_m_s);
        b.iter(|| wing.angle_of_attack(black_box(&air)));
    });
    c.bench_function("membrane: RK4 step of a falling wing", |b| {
        let mut state = start;
        b.iter(|| {
            state = rk4(state, 1e-3, |s| {
                let (wrench, membrane) =
                    wing.evaluate(&air(s.velocity_m_s), ANGLE_RATE_RAD_S, SPREAD, &s.membrane);
                // A push to each side keeps every velocity away from 0, where subnormal numbers
                // would be timed.
                let push_m_s2 = Vector3::new(1.0, 0.3, 9.8);
                Falling { velocity_m_s: push_m_s2 + wrench.force.vector * 2.0, membrane }
            });
            state.velocity_m_s
        });
    });
}

criterion_group!(benches, bench);
criterion_main!(benches);
