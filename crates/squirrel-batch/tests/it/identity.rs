//! What a vehicle does in a batch has one result, to the last bit, and it is that of the vehicle
//! alone.

use super::support::{Thrown, bits};
use nalgebra::{Vector3, convert};
use squirrel_batch::{Batch, Scheme, Settings};
use squirrel_core::dynamics::{Held, RotorDrive, State, VectorSpace, derivative, rk4};
use squirrel_core::effects::{Acting, Effects};
use squirrel_core::frames::{In, Wrench};
use squirrel_core::vehicle::MAX_ROTORS;
use squirrel_sim::plant::{Plant, WingPlant};
use squirrel_sim::simd::{Path, Paths};

const SCHEMES: [Scheme; 2] = [Scheme::Rk4, Scheme::Euler];

fn settings(scheme: Scheme) -> Settings {
    Settings { scheme, threads: 1, ..Settings::default() }
}

fn flown<T: Paths>(thrown: &Thrown<T>, settings: Settings, calls: &[usize]) -> Vec<Vec<u64>> {
    let mut batch = thrown.batch(settings);
    for steps in calls {
        batch.step(*steps);
    }
    bits(&mut batch)
}

/// Registers, threads, and calls that a flight is cut into.
fn neither_registers_nor_threads_nor_calls_matter<T: Paths>() {
    let thrown = Thrown::<T>::new(203);
    for scheme in SCHEMES {
        let expected = flown(&thrown, settings(scheme), &[500]);
        assert!(expected.iter().flatten().all(|bits| f64::from_bits(*bits).is_finite()));
        for path in Path::available() {
            for threads in [1, 2, 5] {
                let other = Settings { path, threads, ..settings(scheme) };
                for calls in [&[1; 500][..], &[0, 7, 93, 400], &[500]] {
                    let calls_made = calls.len();
                    assert!(
                        flown(&thrown, other, calls) == expected,
                        "{scheme:?}, {}, {threads} threads, {calls_made} calls",
                        path.name()
                    );
                }
            }
        }
    }
}

#[test]
fn neither_registers_nor_threads_nor_calls_matter_in_f32() {
    neither_registers_nor_threads_nor_calls_matter::<f32>();
}

#[test]
fn neither_registers_nor_threads_nor_calls_matter_in_f64() {
    neither_registers_nor_threads_nor_calls_matter::<f64>();
}

/// Rows are exchanged by all threads, and the last chunk is not full.
fn one_pass_is_command_step_and_look<T: Paths>() {
    let thrown = Thrown::<T>::new(1801);
    let other: Vec<T> = thrown.commands.iter().rev().copied().collect();
    let mut batch = thrown.batch(settings(Scheme::Rk4));
    batch.step(3);
    batch.command(&other).unwrap();
    batch.step(2);
    let expected = bits(&mut batch);
    for threads in [1, 2, 5] {
        let mut batch = thrown.batch(Settings { threads, ..settings(Scheme::Rk4) });
        let mut rows = vec![convert::<f64, T>(f64::NAN); 1801 * 17];
        batch.fly(&thrown.commands, 3, &mut rows).unwrap();
        batch.fly(&other, 2, &mut rows).unwrap();
        let flown: Vec<u64> =
            rows.iter().map(|x| nalgebra::try_convert::<T, f64>(*x).unwrap().to_bits()).collect();
        assert!(flown == expected.concat(), "{threads} threads");
        assert!(bits(&mut batch) == expected, "{threads} threads");
        let refused = batch.fly(&other, 2, &mut rows[1..]).unwrap_err();
        assert_eq!(refused.to_string(), "rows: 30616 numbers, must be 30617");
        let refused = batch.fly(&other[..4], 2, &mut rows).unwrap_err();
        assert_eq!(refused.to_string(), "commands: 4 numbers, must be 7204");
        assert!(bits(&mut batch) == expected, "what is refused moves nothing");
    }
}

#[test]
fn one_pass_is_command_step_and_look_in_f32() {
    one_pass_is_command_step_and_look::<f32>();
}

#[test]
fn one_pass_is_command_step_and_look_in_f64() {
    one_pass_is_command_step_and_look::<f64>();
}

#[test]
fn a_vehicle_alone_is_the_same_among_a_thousand() {
    let all = Thrown::<f32>::new(1000);
    for scheme in SCHEMES {
        let thousand = flown(&all, settings(scheme), &[200]);
        for count in [1, 15, 16, 17, 100] {
            let few = flown(&Thrown::<f32>::new(count), settings(scheme), &[200]);
            assert!(few[..] == thousand[..count], "{scheme:?}, {count}");
        }
        let last = Thrown {
            vehicles: all.vehicles[999..].to_vec(),
            states: all.states[999..].to_vec(),
            winds: all.winds[999..].to_vec(),
            commands: all.commands[4 * 999..].to_vec(),
        };
        assert_eq!(
            flown(&last, settings(scheme), &[200])[0],
            thousand[999],
            "in the first column, too"
        );
    }
}

/// Steps of the functions that the plant and the gap workflow use.
fn a_batch_is_the_core<T: Paths>() {
    let thrown = Thrown::<T>::new(21);
    let dt = convert::<f64, T>(1e-3);
    let none = Acting::new(&Effects::none(), &thrown.vehicles[0]);
    for scheme in SCHEMES {
        let mut batch = thrown.batch(settings(scheme));
        let mut states = thrown.states.clone();
        for step in 0..800 {
            for (number, state) in states.iter_mut().enumerate() {
                let vehicle = &thrown.vehicles[number];
                let mut command = [convert::<f64, T>(0.0); MAX_ROTORS];
                command[..4].copy_from_slice(&thrown.commands[4 * number..4 * number + 4]);
                let drive = RotorDrive::new(vehicle, &none, &command, convert(14.8));
                drive.settle(&mut state.rotor_speed_rad_s);
                let wind = In::new(Vector3::from(thrown.winds[number]));
                let held = Held { wind, ..Held::in_still_air(drive) };
                let rate = |s: &State<T>| derivative(vehicle, &none, s, &held, |_| Wrench::zero());
                let next = match scheme {
                    Scheme::Rk4 => rk4(*state, dt, rate),
                    Scheme::Euler => state.plus_scaled(dt, &rate(state)),
                };
                *state = next.normalised();
            }
            batch.step(1);
            for (number, state) in states.iter().enumerate() {
                assert_eq!(
                    batch.state(number).unwrap(),
                    *state,
                    "{scheme:?}, vehicle {number}, step {step}"
                );
            }
        }
    }
}

#[test]
fn a_batch_is_the_core_in_f32() {
    a_batch_is_the_core::<f32>();
}

#[test]
fn a_batch_is_the_core_in_f64() {
    a_batch_is_the_core::<f64>();
}

#[test]
fn a_batch_is_the_plant_without_wing_and_battery() {
    let thrown = Thrown::<f64>::new(17);
    let mut batch = thrown.batch(settings(Scheme::Rk4));
    batch.step(1000);
    for (number, vehicle) in thrown.vehicles.iter().enumerate() {
        let plant = Plant::new(*vehicle, Effects::none(), WingPlant::None, None, 1e-3).unwrap();
        let mut state = plant.initial_state(thrown.states[number], 1.0);
        let mut command = [0.0; MAX_ROTORS];
        command[..4].copy_from_slice(&thrown.commands[4 * number..4 * number + 4]);
        let wind = In::new(Vector3::from(thrown.winds[number]));
        for _ in 0..1000 {
            plant.step(&mut state, &command, [0.0; 2], wind);
        }
        assert_eq!(batch.state(number).unwrap(), state.body, "vehicle {number}");
    }
}

/// Places for rotors that no vehicle has change nothing, whatever is written there.
#[test]
fn places_without_a_rotor_are_still() {
    let thrown = Thrown::<f32>::new(20);
    let expected = flown(&thrown, settings(Scheme::Rk4), &[300]);
    let mut wide = Batch::<f32, 8>::new(&thrown.vehicles, settings(Scheme::Rk4)).unwrap();
    for number in 0..20 {
        let mut state = thrown.states[number];
        state.rotor_speed_rad_s[4..].fill(900.0);
        wide.reset(number, &state).unwrap();
        wide.set_wind(number, In::new(Vector3::from(thrown.winds[number]))).unwrap();
    }
    let commands: Vec<f32> = thrown
        .commands
        .chunks(4)
        .flat_map(|c| [c[0], c[1], c[2], c[3], 1.0, f32::NAN, 0.5, -1.0])
        .collect();
    wide.command(&commands).unwrap();
    wide.step(300);
    for (wide, expected) in bits(&mut wide).iter().zip(&expected) {
        assert_eq!(wide[..17], expected[..]);
        assert_eq!(wide[17..], [0; 4]);
    }
}

/// A vehicle that blows up, or is put back, is nobody else's business.
#[test]
fn neighbours_do_not_notice() {
    let thrown = Thrown::<f32>::new(40);
    let expected = flown(&thrown, settings(Scheme::Rk4), &[400]);
    for path in Path::available() {
        let mut batch = thrown.batch(Settings { path, ..settings(Scheme::Rk4) });
        let mut wild = State::at_rest();
        wild.velocity = In::new(Vector3::new(1e30, 0.0, 0.0));
        batch.reset(18, &wild).unwrap();
        batch.step(150);
        assert!(!batch.state(18).unwrap().is_finite(), "blown up");
        batch.reset(3, &thrown.states[4]).unwrap();
        batch.replace(5, &thrown.vehicles[6]).unwrap();
        batch.step(250);
        let flown = bits(&mut batch);
        for number in (0..40).filter(|number| ![3, 5, 18].contains(number)) {
            assert_eq!(flown[number], expected[number], "vehicle {number}, {}", path.name());
        }
        assert_ne!(flown[3], expected[3]);
        assert_ne!(flown[5], expected[5]);
        batch.reset(18, &thrown.states[18]).unwrap();
        batch.step(400);
        assert_eq!(bits(&mut batch)[18], expected[18], "what was broken flies again");
    }
}
