//! A memory that is taken up again flies on to the bit.

use squirrel_batch::Scheme;
use squirrel_batch::task::course::CourseKind;
use squirrel_batch::task::{Level, Outcome, TaskSettings, Tasks};
use squirrel_batch::{BODY_NUMBERS, Batch, BatchVehicle, Settings};
use squirrel_core::policy::OBSERVATION;
use squirrel_sim::plant::{GustModel, WindParameters};
use squirrel_sim::simd::Path;
use squirrel_sim::simd::Paths;
use squirrel_sim::vehicle_file::VehicleFile;
use std::fmt::Debug;

const N: usize = 37;

fn file(extra: &str) -> VehicleFile {
    let plain = include_str!("../../../../vehicles/squirrel.toml");
    VehicleFile::parse(&format!("{plain}\n{extra}"), "test").unwrap()
}

/// Wings, battery, gusts of each kind, a load, late commands.
fn files() -> Vec<VehicleFile> {
    [
        "",
        "[effects.gust]\nsigma_m_s = 0.8\n",
        "[effects.gust]\nform = \"dryden\"\nsigma_m_s = 0.8\n",
        "[effects.actuation_latency]\nlatency_s = 0.02\n",
        "[effects.payload_swing]\nmass_kg = 0.05\nlength_m = 0.5\n",
    ]
    .into_iter()
    .map(file)
    .collect()
}

fn batch<T: Paths>(members: &[BatchVehicle]) -> Batch<T> {
    let mut batch = Batch::<T>::with_room(N, members, Settings::default()).unwrap();
    for number in 0..N {
        let gust = if number % 3 == 0 {
            GustModel::Mil { wind_6m_m_s: 4.0 }
        } else {
            GustModel::GaussMarkov { time_constant_s: 1.5 }
        };
        let wind = WindParameters { mean_ned_m_s: [2.0, -1.0, 0.1], gust_sigma_m_s: 0.7, gust };
        let member = &members[number % members.len()];
        batch.set_air(number, member, wind, number as u64).unwrap();
    }
    batch
}

fn fly<T: Paths>(batch: &mut Batch<T>, from: usize, periods: usize) -> Vec<T> {
    let mut rows = vec![nalgebra::convert(0.0); N * (BODY_NUMBERS + 4)];
    for period in from..from + periods {
        let of = |k: usize| nalgebra::convert(0.3 + 0.4 * ((k * 7 + period) % 11) as f64 / 11.0);
        let commands: Vec<T> = (0..N * 4).map(of).collect();
        let wings: Vec<T> = (0..N * 2).map(of).collect();
        batch.command_wings(&wings).unwrap();
        batch.fly(&commands, 7, &mut rows).unwrap();
    }
    rows
}

fn goes_on<T: Paths + PartialEq + Debug>() {
    let members: Vec<BatchVehicle> = files().iter().map(BatchVehicle::from).collect();
    let mut one = batch::<T>(&members);
    fly(&mut one, 0, 40);
    let memory = one.memory(&mut || true).unwrap();
    // Taken up by one that has flown something else, and by one that is new.
    let mut other = batch::<T>(&members);
    fly(&mut other, 3, 11);
    let mut third = Batch::<T>::with_room(N, &members, Settings::default()).unwrap();
    let wanted = fly(&mut one, 40, 30);
    for again in [&mut other, &mut third] {
        again.restore(&memory, &mut || true).unwrap();
        assert_eq!(again.memory(&mut || true).unwrap(), memory);
        assert_eq!(fly(again, 40, 30), wanted);
        for number in 0..N {
            assert_eq!(again.battery(number).unwrap(), one.battery(number).unwrap());
            assert_eq!(again.deployment(number).unwrap(), one.deployment(number).unwrap());
        }
    }
}

#[test]
fn a_batch_goes_on_to_the_bit() {
    goes_on::<f32>();
    goes_on::<f64>();
}

#[test]
fn what_is_no_memory_is_refused_and_changes_nothing() {
    let members: Vec<BatchVehicle> = files().iter().map(BatchVehicle::from).collect();
    let mut one = batch::<f32>(&members);
    fly(&mut one, 0, 5);
    let memory = one.memory(&mut || true).unwrap();
    let mut longer = memory.clone();
    longer.push(0);
    for wrong in [&memory[..memory.len() - 1], &memory[..100], &memory[..0], &longer] {
        let error = one.restore(wrong, &mut || true).unwrap_err().to_string();
        assert!(error.starts_with("state: "), "{error}");
    }
    let settings = Settings { dt_s: 2e-3, ..Settings::default() };
    let mut other = Batch::<f32>::with_room(N, &members, settings).unwrap();
    let error = other.restore(&memory, &mut || true).unwrap_err().to_string();
    assert!(error.contains("of another batch"), "{error}");
    assert!(one.restore(&memory, &mut || false).is_err(), "nobody waits");
    assert_eq!(one.memory(&mut || true).unwrap(), memory);
}

fn step(tasks: &mut Tasks, at: usize) -> (Vec<f32>, Vec<f32>, Vec<bool>, Vec<bool>) {
    let (n, numbers) = (tasks.len(), tasks.settings().level.numbers(4));
    let of = |k: usize| 0.5 * ((k * 13 + at * 5) % 17) as f32 / 17.0 - 0.25;
    let actions: Vec<f32> = (0..n * numbers).map(of).collect();
    let mut out = (vec![0.0; n * OBSERVATION], vec![0.0; n], vec![false; n], vec![false; n]);
    let outcome = Outcome {
        observation: &mut out.0,
        reward: &mut out.1,
        terminated: &mut out.2,
        truncated: &mut out.3,
    };
    tasks.step(&actions, outcome).unwrap();
    out
}

#[test]
fn environments_go_on_to_the_bit() {
    let texts =
        ["", "[effects.gust]\nsigma_m_s = 0.8\n", "[effects.mass_error]\nmass_fraction = 0.1\n"];
    let files: Vec<VehicleFile> = texts.into_iter().map(file).collect();
    for (level, sensors) in
        [(Level::Motor, false), (Level::BodyRate, true), (Level::AttitudeWing, true)]
    {
        let settings = TaskSettings {
            kind: CourseKind::Avoid,
            level,
            episode_s: 0.7,
            sensors,
            scheme: Scheme::Rk4,
            threads: 1,
            path: Path::best(),
        };
        let make = |seed| Tasks::<4>::new(&files, 150, seed, settings).unwrap();
        let mut one = make(1);
        let mut seen = vec![0.0; 150 * OBSERVATION];
        for at in 0..90 {
            step(&mut one, at);
            if at % 20 == 13 {
                one.reset(|number| number % 4 == at % 3, &mut seen).unwrap();
                one.seed(at, 5).unwrap();
            }
        }
        let memory = one.memory(&mut || true).unwrap();
        let mut again = make(9);
        again.restore(&memory, &mut || true).unwrap();
        assert_eq!(again.memory(&mut || true).unwrap(), memory);
        for at in 90..200 {
            assert_eq!(step(&mut again, at), step(&mut one, at), "{level:?} {at}");
        }
        assert!(make(1).restore(&memory[..memory.len() - 1], &mut || true).is_err());
        assert!(Tasks::<4>::new_while(&files, 300, 1, settings, &mut || false).is_err());
    }
}
