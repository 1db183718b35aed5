//! Environments: what happens in one depends on nothing but its seed, and rewards are for what they
//! say.

use squirrel_batch::task::course::CourseKind;
use squirrel_batch::task::{Level, Outcome, TaskSettings, Tasks};
use squirrel_batch::{Batch, BatchVehicle, Scheme, Settings};
use squirrel_core::dynamics::State;
use squirrel_core::frames::In;
use squirrel_core::nalgebra::Vector3;
use squirrel_core::policy::{OBSERVATION, PilotCommand, Span};
use squirrel_core::stack::{Gnss, Imu, SensorFrame, StackState};
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{Integrator, Setup};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::simd::Path;
use squirrel_sim::vehicle_file::VehicleFile;

fn settings(kind: CourseKind, level: Level) -> TaskSettings {
    TaskSettings {
        kind,
        level,
        episode_s: 10.0,
        sensors: false,
        scheme: Scheme::Rk4,
        threads: 2,
        path: Path::best(),
    }
}

/// Vehicles with wings, battery, gusts, and a heavier one.
fn vehicles() -> Vec<VehicleFile> {
    let plain = include_str!("../../../../vehicles/squirrel.toml");
    let gusty = format!("{plain}\n[effects.gust]\nsigma_m_s = 0.8\n");
    let heavy = format!("{plain}\n[effects.mass_error]\nmass_fraction = 0.1\n");
    [plain, &gusty, &heavy].iter().map(|text| VehicleFile::parse(text, "test").unwrap()).collect()
}

/// Outcomes of some steps: observations, rewards, ends.
#[derive(Debug, Clone, PartialEq, Default)]
struct Seen {
    observation: Vec<f32>,
    reward: Vec<f32>,
    terminated: Vec<bool>,
    truncated: Vec<bool>,
}

fn step(tasks: &mut Tasks, actions: &[f32]) -> Seen {
    let n = tasks.len();
    let mut seen = Seen {
        observation: vec![0.0; n * OBSERVATION],
        reward: vec![0.0; n],
        terminated: vec![false; n],
        truncated: vec![false; n],
    };
    let Seen { observation, reward, terminated, truncated } = &mut seen;
    tasks.step(actions, Outcome { observation, reward, terminated, truncated }).unwrap();
    seen
}

/// A hand-made pilot: leans towards where it should be.
fn lean(observation: &[f32]) -> [f32; 4] {
    let gain =
        |k: usize| 0.5 * (observation[k] * 2.0 * 1.2 + observation[3 + k] * 5.0 * 1.4) / 9.8 / 0.6;
    let thrust = (0.8 * observation[2] * 2.0 + 1.6 * observation[5] * 5.0) / -9.8;
    [gain(1) * 2.0, -gain(0) * 2.0, thrust, -1.0]
}

fn fly(tasks: &mut Tasks, steps: usize, pilot: impl Fn(&[f32]) -> Vec<f32>) -> Vec<Seen> {
    let mut observation = vec![0.0; tasks.len() * OBSERVATION];
    tasks.reset(|_| false, &mut observation).unwrap();
    let mut all = Vec::new();
    for _ in 0..steps {
        let actions: Vec<f32> = observation.chunks(OBSERVATION).flat_map(&pilot).collect();
        let seen = step(tasks, &actions);
        observation.clone_from(&seen.observation);
        all.push(seen);
    }
    all
}

/// The flight code beside a task: the same actions on the same plant, the same bits after each. It
/// gets true attitude and rates at 500 Hz, as the task's inner loop has them.
#[test]
fn an_action_turns_the_rotors_in_a_task_as_in_the_flight_code() {
    let vehicle = VehicleFile::squirrel();
    let scenario = Scenario::find("hover").unwrap();
    let setup =
        Setup { vehicle: vehicle.clone(), arm: Arm::Pc, scenario, integrator: Integrator::Rk4 };
    let stack = setup.stack().unwrap();
    let span = Span::of(stack.vehicle());
    let settings = TaskSettings { threads: 1, ..settings(CourseKind::Track, Level::AttitudeWing) };
    let mut tasks = Tasks::<4>::new(std::slice::from_ref(&vehicle), 1, 5, settings).unwrap();
    let mut observation = vec![0.0; OBSERVATION];
    tasks.reset(|_| false, &mut observation).unwrap();

    let batch = Settings { dt_s: 2e-3, scheme: Scheme::Rk4, threads: 1, path: Path::best() };
    let mut plant: Batch<f32> = Batch::with(&[BatchVehicle::from(&vehicle)], batch).unwrap();
    plant.reset(0, &tasks.state(0).unwrap().0).unwrap();
    let mut known = StackState::default();
    let mut control = |time_us: u64, state: &State<f32>, command: Option<PilotCommand>| {
        let mut frame = SensorFrame::empty(time_us);
        frame.imu =
            Some(Imu { omega: state.omega, specific_force: In::new(Vector3::new(0.0, 0.0, -9.8)) });
        frame.attitude = Some(state.ned_from_body());
        frame.gnss = Some(Gnss { position: state.position, velocity: state.velocity });
        frame.command = command;
        stack.control(&mut known, &frame)
    };
    // A first frame takes no time, and hover takes no rotor to its limit.
    control(0, &plant.state(0).unwrap(), Some(span.command(&[0.0, 0.0, 0.0, -1.0])));
    let (mut time_us, mut beyond, mut spread) = (2000, 0, 0.0_f32);
    for count in 0..300 {
        // Leans, throws, and cuts thrust below what the flight code allows.
        let k = count as f32;
        let throw = [
            0.9 * (k * 0.5).sin(),
            0.9 * (k * 0.3).cos(),
            1.2 * (k * 0.11).sin(),
            (k * 0.05).sin(),
        ];
        let action = if count % 50 < 25 { lean(&observation) } else { throw };
        let command = span.command(&action);
        for tick in 0..10 {
            let output = control(time_us, &plant.state(0).unwrap(), (tick == 0).then_some(command));
            time_us += 2000;
            beyond += u32::from(output.inner.unwrap().mixer.saturated);
            plant.command(&output.rotor_command[..4]).unwrap();
            plant.command_wings(&output.wing_command).unwrap();
            plant.step(1);
        }
        let seen = step(&mut tasks, &action);
        assert!(!seen.terminated[0], "action {count}");
        let (one, other) = (tasks.state(0).unwrap().0, plant.state(0).unwrap());
        assert_eq!(one, other, "action {count}");
        spread = spread.max(plant.deployment(0).unwrap()[0]);
        observation.clone_from(&seen.observation);
    }
    assert!(beyond > 100 && spread > 0.9, "{beyond} {spread}");
}

#[test]
fn an_environment_is_the_same_among_many_and_on_any_registers() {
    for (kind, level) in
        [(CourseKind::Avoid, Level::AttitudeWing), (CourseKind::Track, Level::Motor)]
    {
        for sensors in [false, true] {
            let settings = TaskSettings { sensors, ..settings(kind, level) };
            let pilot = |observation: &[f32]| match level {
                Level::AttitudeWing => lean(observation).to_vec(),
                _ => observation[..5].iter().map(|x| 0.2 * x).collect(),
            };
            let run = |count: usize, seed: u64, settings: TaskSettings| {
                let mut tasks: Tasks = Tasks::new(&vehicles(), count, seed, settings).unwrap();
                fly(&mut tasks, 150, pilot)
            };
            let one = run(1, 7, settings);
            let slow =
                run(1, 7, TaskSettings { path: Path::available()[0], threads: 1, ..settings });
            assert_eq!(one, slow);
            // More than a thread takes at once.
            let count = 300;
            let many = run(count, 7, TaskSettings { threads: 2, ..settings });
            assert_eq!(many, run(count, 7, TaskSettings { threads: 1, ..settings }));
            for number in [0, 130, count - 1] {
                let one = run(1, 7 + number as u64, settings);
                for (k, (one, many)) in one.iter().zip(&many).enumerate() {
                    let seen = &many.observation[OBSERVATION * number..][..OBSERVATION];
                    assert_eq!(one.observation, seen, "environment {number}, step {k}");
                    assert_eq!(one.reward[0].to_bits(), many.reward[number].to_bits(), "step {k}");
                    assert_eq!(one.terminated[0], many.terminated[number], "step {k}");
                }
            }
            let first: Vec<&[f32]> = many[0].observation.chunks(OBSERVATION).take(40).collect();
            assert!(
                first.iter().all(|row| *row == first[0] || row[..3] != first[0][..3]),
                "seeds differ"
            );
        }
    }
}

#[test]
fn who_follows_is_paid_and_who_falls_is_lost() {
    let mut tasks: Tasks =
        Tasks::new(&vehicles()[..1], 50, 3, settings(CourseKind::Track, Level::AttitudeWing))
            .unwrap();
    let good = fly(&mut tasks, 499, |observation| lean(observation).to_vec());
    let total: f32 = good.iter().flat_map(|seen| &seen.reward).sum::<f32>() / 50.0;
    assert!(total > 6.0, "{total}");
    let mut tasks: Tasks =
        Tasks::new(&vehicles()[..1], 50, 3, settings(CourseKind::Track, Level::AttitudeWing))
            .unwrap();
    let bad = fly(&mut tasks, 200, |_| vec![0.0, 0.0, -1.0, -1.0]);
    let lost = (0..50).filter(|k| bad.iter().any(|seen| seen.terminated[*k])).count();
    assert_eq!(lost, 50);
}

/// An episode ends at its time; the step after it starts another one, whatever the action, and pays
/// nothing.
#[test]
fn episodes_end_in_time_and_begin_again() {
    let short = TaskSettings { episode_s: 0.1, ..settings(CourseKind::Avoid, Level::AttitudeWing) };
    let mut tasks: Tasks = Tasks::new(&vehicles()[..1], 3, 1, short).unwrap();
    let before = tasks.obstacles(1).unwrap();
    let seen = fly(&mut tasks, 7, |observation| lean(observation).to_vec());
    let truncated: Vec<bool> = seen.iter().map(|seen| seen.truncated[1]).collect();
    assert_eq!(truncated, [false, false, false, false, true, false, false]);
    assert_eq!(seen[5].reward, [0.0; 3]);
    assert!(seen[6].reward[1] > 0.0);
    assert_ne!(tasks.obstacles(1).unwrap(), before, "other trunks");
}

/// Flying straight on through the trunks ends at the first that is in the way.
#[test]
fn trunks_are_solid_and_seen_before_they_are_hit() {
    let mut tasks: Tasks =
        Tasks::new(&vehicles()[..1], 100, 5, settings(CourseKind::Avoid, Level::AttitudeWing))
            .unwrap();
    let trunks: Vec<_> = (0..100).map(|k| tasks.obstacles(k).unwrap()).collect();
    let seen = fly(&mut tasks, 450, |observation| lean(observation).to_vec());
    let (mut hits, mut warned) = (0, 0);
    for k in 0..100 {
        let Some(end) = seen.iter().position(|seen| seen.terminated[k]) else { continue };
        let in_the_way = trunks[k].iter().any(|[_, east, radius]| east.abs() < radius + 0.25);
        hits += usize::from(in_the_way);
        let row = |step: usize| &seen[step].observation[k * OBSERVATION..][..OBSERVATION];
        warned += usize::from((end.saturating_sub(15)..end).any(|step| row(step)[21] == 1.0));
    }
    assert!(hits >= 90 && warned == hits, "{hits} hits, {warned} seen before");
}

#[test]
fn what_cannot_be_learned_is_named() {
    let bad = |vehicles: &[VehicleFile], count, episode_s| {
        let settings = TaskSettings { episode_s, ..settings(CourseKind::Avoid, Level::Motor) };
        Tasks::<4>::new(vehicles, count, 0, settings).unwrap_err().to_string()
    };
    assert_eq!(bad(&vehicles(), 0, 1.0), "num_envs = 0: must be at least 1");
    assert_eq!(bad(&vehicles(), 1, f64::NAN), "episode_s = NaN: must be at least 0.02 and finite");
    assert!(bad(&[], 1, 1.0).contains("none given"), "{}", bad(&[], 1, 1.0));
    let mut uncontrolled = vehicles();
    uncontrolled[1].control = None;
    assert!(bad(&uncontrolled, 1, 1.0).starts_with("vehicles[1]: [control] is missing"));
    let mut tasks: Tasks =
        Tasks::new(&vehicles(), 2, 0, settings(CourseKind::Avoid, Level::Motor)).unwrap();
    let error = tasks.reset(|_| true, &mut [0.0; 3]).unwrap_err().to_string();
    assert_eq!(error, "observation: 3 numbers, must be 50");
}
