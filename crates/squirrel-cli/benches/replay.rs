//! What the commands `fly --out`, `replay` and `fly --report` cost for the demo's flight.

use criterion::{Criterion, criterion_group, criterion_main};
use squirrel_log::FlightLog;
use squirrel_report::flight::{FlightView, Heading, render};
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{Integrator, Setup};
use squirrel_sim::replay;
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;

fn commands(c: &mut Criterion) {
    let scenario = Scenario::find("avoid").expect("built in");
    let setup = Setup {
        vehicle: VehicleFile::squirrel(),
        arm: Arm::TwccFlat,
        scenario,
        integrator: Integrator::Rk4,
    };
    let log = setup.fly(true, |_| {}).expect("flies").log.expect("recorded");
    let path = std::env::temp_dir().join(format!("squirrel-bench-{}.mcap", std::process::id()));
    c.bench_function("write_log", |b| b.iter(|| log.write(&path).expect("writes")));
    c.bench_function("read_log", |b| b.iter(|| FlightLog::read(&path).expect("reads")));
    c.bench_function("replay_log", |b| b.iter(|| replay::replay(&log, &setup).expect("replays")));
    c.bench_function("render_report", |b| {
        let view = FlightView {
            arm: "twcc_flat",
            log: &log,
            obstacles: setup.scenario.all_obstacles(),
            tilt_max_rad: 0.52,
            thrust_max_n: 6.7,
            summary: Vec::new(),
        };
        let heading = Heading::default();
        b.iter(|| render(&heading, std::slice::from_ref(&view)));
    });
    let _ = std::fs::remove_file(&path);
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20);
    targets = commands
}
criterion_main!(benches);
