//! One plant step, one call of the led plant, what it says at many states, and one vehicle in
//! complete closed loop.
//!
//! `plant_step_without_wing` counts RK4 steps of rigid body, four rotor lags, drag and battery;
//! `closed_loop` counts seconds of flight (plant at 1 kHz with membrane wing, battery, gusts and
//! noisy sensors; flight code at 300 and 10 Hz; no log), so its throughput is the ratio to real
//! time.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use squirrel_core::dynamics::State;
use squirrel_core::frames::In;
use squirrel_core::nalgebra::Vector3;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{Integrator, Setup};
use squirrel_sim::plant::{Plant, PlantState, WingPlant};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;
use std::hint::black_box;

fn start(plant: &Plant) -> PlantState {
    let mut body = State::at_rest();
    body.velocity = In::new(Vector3::new(5.0, 1.0, 0.3));
    body.rotor_speed_rad_s[..4].fill(1500.0);
    plant.initial_state(body, 1.0)
}

fn plant_steps(c: &mut Criterion) {
    let file = VehicleFile::squirrel();
    let mut group = c.benchmark_group("plant_step");
    for (name, wing) in [("without_wing", WingPlant::None), ("membrane_wing", file.wing.clone())] {
        let plant = Plant::new(file.vehicle, file.effects, wing, file.battery.clone(), 1e-3)
            .expect("sound");
        let command = [0.5, 0.501, 0.5, 0.499, 0.0, 0.0, 0.0, 0.0];
        let steps = 1000;
        group.throughput(Throughput::Elements(steps));
        group.bench_function(name, |b| {
            b.iter(|| {
                let mut state = start(&plant);
                for _ in 0..steps {
                    plant.step(&mut state, black_box(&command), [1.0; 2], In::zero());
                }
                state
            });
        });
    }
    group.finish();
}

fn leading(c: &mut Criterion) {
    let mut file = VehicleFile::squirrel();
    let none = file.effects;
    for (name, size) in [("linear_drag", 0.1), ("motor_lag", 0.03), ("ground_effect", 0.3)] {
        let found = file.effects.insert(name).expect("known");
        found.values[0] = size;
    }
    let mut group = c.benchmark_group("lead");
    let calls = 1000;
    group.throughput(Throughput::Elements(calls));
    for (name, effects) in [("without_wing", none), ("three_effects", file.effects)] {
        let plant = Plant::new(file.vehicle, effects, WingPlant::None, None, 1e-3).expect("sound");
        let motion = start(&plant).body;
        let command = [0.5, 0.501, 0.5, 0.499, 0.0, 0.0, 0.0, 0.0];
        group.bench_function(name, |b| {
            b.iter(|| {
                let mut state = start(&plant);
                for _ in 0..calls {
                    let (motion, command) = (black_box(&motion), black_box(&command));
                    black_box(plant.lead(&mut state, motion, command, [1.0; 2], 14.8, 0.01));
                }
                state
            });
        });
    }
    group.finish();
}

/// What plants with wings and four effects say at the same states: at one after the other, and at
/// all at once.
fn led(c: &mut Criterion) {
    let mut file = VehicleFile::squirrel();
    for (name, size) in [
        ("linear_drag", 0.1),
        ("cg_offset", 0.004),
        ("ground_effect", 0.3),
        ("quadratic_drag", 0.01),
    ] {
        let found = file.effects.insert(name).expect("known");
        found.values[0] = size;
    }
    let mut group = c.benchmark_group("led");
    let count = 1000;
    group.throughput(Throughput::Elements(count));
    for (name, wing) in [("without_wing", WingPlant::None), ("membrane_wing", file.wing.clone())] {
        let plant = Plant::new(file.vehicle, file.effects, wing, None, 1e-3).expect("sound");
        let states = vec![start(&plant); count as usize];
        let mut all = plant.side_by_side(states.len());
        for state in &states {
            all.push(state);
        }
        group.bench_function(format!("{name}_one_by_one"), |b| {
            b.iter(|| black_box(&states).iter().map(|s| plant.led(s)).collect::<Vec<_>>());
        });
        group.bench_function(format!("{name}_at_once"), |b| {
            b.iter(|| plant.led_at(black_box(&all)));
        });
    }
    group.finish();
}

fn closed_loop(c: &mut Criterion) {
    let mut scenario = Scenario::find("track").expect("built in");
    scenario.duration_s = 10.0;
    scenario.wind.gust_sigma_m_s = 0.5;
    let setup = Setup {
        vehicle: VehicleFile::squirrel(),
        arm: Arm::TwccFlat,
        scenario,
        integrator: Integrator::Rk4,
    };
    let mut group = c.benchmark_group("closed_loop");
    group.throughput(Throughput::Elements(10));
    group.bench_function("seconds_of_flight", |b| {
        b.iter(|| setup.fly(false, |_| {}).expect("flies").metrics);
    });
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20).measurement_time(std::time::Duration::from_secs(3));
    targets = plant_steps, leading, led, closed_loop
}
criterion_main!(benches);
