//! Whole vehicles in batches: wings, battery, moving air and every effect fly as in the plant, and
//! have one result.

use super::support::{Thrown, bits};
use nalgebra::{Vector3, convert, try_convert};
use squirrel_batch::{Batch, BatchVehicle, Scheme, Settings};
use squirrel_core::dynamics::{State, total_wind};
use squirrel_core::effects::{Effects, FORM, Kind, Present, forms};
use squirrel_core::frames::In;
use squirrel_core::vehicle::MAX_ROTORS;
use squirrel_sim::plant::{GustModel, Meeting, Plant, Wind, WindParameters, WingPlant};
use squirrel_sim::simd::{Path, Paths};
use squirrel_sim::vehicle_file::VehicleFile;

/// Sizes of one effect in one form, between its smallest and its largest.
fn put(effects: &mut Effects<f64>, name: &str, form: usize, share: f64) {
    let found = effects.insert(name).unwrap();
    let chosen = forms(found.parameters).get(form).copied().unwrap_or("");
    for (p, value) in found.parameters.iter().zip(found.values) {
        *value = match p.kind {
            _ if p.key == FORM => form as f64,
            Kind::Size { smallest, largest, .. } if chosen.is_empty() || p.exists_in(chosen) => {
                smallest + share * (largest - smallest)
            }
            Kind::Size { .. } => 0.0,
            Kind::Rotor => 2.0,
            Kind::OneOf(_) => 1.0,
        };
    }
}

fn member(wing: &str) -> BatchVehicle {
    let mut member = BatchVehicle::from(&VehicleFile::squirrel());
    let WingPlant::Membrane { servo, .. } = &member.wing else {
        panic!("the squirrel has membranes")
    };
    match wing {
        "none" => member.wing = WingPlant::None,
        "flat" => {
            member.wing =
                WingPlant::Flat { wing: member.vehicle.parameters().wing.unwrap(), servo: *servo }
        }
        _ => {}
    }
    member
}

/// Crafts with these wings, each with the airframe of a thrown vehicle and its share of effects, in
/// turn of their forms.
fn members<T: Paths>(thrown: &Thrown<T>, wing: &str, names: &[&str]) -> Vec<BatchVehicle> {
    let mut out = Vec::new();
    for (number, vehicle) in thrown.vehicles.iter().enumerate() {
        let mut member = BatchVehicle { vehicle: vehicle.cast().unwrap(), ..member(wing) };
        for name in names {
            let count = forms(Effects::<f64>::parameters(name).unwrap()).len().max(1);
            put(&mut member.effects, name, number % count, (number % 7) as f64 / 7.0);
        }
        out.push(member);
    }
    out
}

const WIND: WindParameters = WindParameters {
    mean_ned_m_s: [2.0, -1.0, 0.3],
    gust_sigma_m_s: 1.2,
    gust: GustModel::Dryden { scale_length_m: 6.0 },
};

/// Gusts that depend on the height and on where a vehicle flies, in air that turns.
const MIL: WindParameters = WindParameters {
    mean_ned_m_s: [2.0, -1.0, 0.3],
    gust_sigma_m_s: 0.0,
    gust: GustModel::Mil { wind_6m_m_s: 9.0 },
};

fn batch<T: Paths>(thrown: &Thrown<T>, members: &[BatchVehicle], settings: Settings) -> Batch<T> {
    batch_in(WIND, thrown, members, settings)
}

fn batch_in<T: Paths>(
    wind: WindParameters,
    thrown: &Thrown<T>,
    members: &[BatchVehicle],
    settings: Settings,
) -> Batch<T> {
    let mut batch = Batch::with(members, settings).unwrap();
    for (number, member) in members.iter().enumerate() {
        batch.reset(number, &thrown.states[number]).unwrap();
        batch.set_charge(number, 0.5 + 0.4 * (number % 2) as f64).unwrap();
        batch.set_air(number, member, wind, number as u64).unwrap();
    }
    batch.command(&thrown.commands[..4 * members.len()]).unwrap();
    batch
}

fn wings<T: Paths>(count: usize, step: usize) -> Vec<T> {
    let open = if (step / 200).is_multiple_of(2) { [1.0, 0.7] } else { [0.0, 0.2] };
    (0..count).flat_map(|_| open).map(convert).collect()
}

/// Flies in calls of `call` steps, wings moving every 100 ms.
fn flown<T: Paths>(
    thrown: &Thrown<T>,
    members: &[BatchVehicle],
    settings: Settings,
    call: usize,
) -> Vec<Vec<u64>> {
    let mut batch = batch(thrown, members, settings);
    for step in (0..400).step_by(100) {
        batch.command_wings(&wings::<T>(members.len(), step)).unwrap();
        for _ in 0..100 / call {
            batch.step(call);
        }
    }
    bits(&mut batch)
}

fn is_of_sensors(name: &str) -> bool {
    let mut effects = Effects::<f64>::none();
    effects.insert(name).unwrap();
    Present::of(&effects).of_sensors().is_some()
}

fn all_effects() -> Vec<&'static str> {
    Effects::<f64>::NAMES.iter().copied().filter(|name| !is_of_sensors(name)).collect()
}

fn neither_registers_nor_threads_nor_calls_matter<T: Paths>(wing: &str) {
    let thrown = Thrown::<T>::new(130);
    let members = members(&thrown, wing, &all_effects());
    for scheme in [Scheme::Rk4, Scheme::Euler] {
        let settings = Settings { scheme, threads: 1, ..Settings::default() };
        let expected = flown(&thrown, &members, settings, 100);
        assert!(expected.iter().flatten().all(|bits| f64::from_bits(*bits).is_finite()));
        for path in Path::available() {
            for (threads, call) in [(2, 100), (1, 1), (5, 20)] {
                let other = Settings { path, threads, ..settings };
                let same = flown(&thrown, &members, other, call) == expected;
                assert!(
                    same,
                    "{wing}, {scheme:?}, {}, {threads} threads, {call} steps a call",
                    path.name()
                );
            }
        }
    }
}

#[test]
fn membranes_in_f32_have_one_result() {
    neither_registers_nor_threads_nor_calls_matter::<f32>("membrane");
}

#[test]
fn membranes_in_f64_have_one_result() {
    neither_registers_nor_threads_nor_calls_matter::<f64>("membrane");
}

#[test]
fn plates_and_no_wings_have_one_result() {
    neither_registers_nor_threads_nor_calls_matter::<f32>("flat");
    neither_registers_nor_threads_nor_calls_matter::<f32>("none");
}

#[test]
fn a_vehicle_alone_is_the_same_among_a_thousand() {
    let all = Thrown::<f32>::new(1000);
    let members = members(&all, "membrane", &all_effects());
    let settings = Settings { threads: 1, ..Settings::default() };
    let thousand = flown(&all, &members, settings, 100);
    for count in [1, 17] {
        assert!(flown(&all, &members[..count], settings, 100)[..] == thousand[..count], "{count}");
    }
}

/// Largest difference of position (m), velocity (m/s) and voltage (V) between a batch and plants
/// that fly the same.
fn off_the_plant<T: Paths>(wind: WindParameters, wing: &str, names: &[&str], steps: usize) -> f64 {
    let thrown = Thrown::<T>::new(21);
    let members = members(&thrown, wing, names);
    let settings = Settings { threads: 1, ..Settings::default() };
    let mut batch = batch_in(wind, &thrown, &members, settings);
    let states: Vec<_> = members
        .iter()
        .enumerate()
        .map(|(number, member)| {
            let plant = Plant::new(
                member.vehicle,
                member.effects,
                member.wing.clone(),
                member.battery.clone(),
                1e-3,
            );
            let plant = plant.unwrap();
            let start = &thrown.states[number];
            let to = |x: T| try_convert::<T, f64>(x).unwrap();
            let mut body = squirrel_core::dynamics::State::at_rest();
            body.position = In::new(start.position.vector.map(to));
            body.velocity = In::new(start.velocity.vector.map(to));
            body.attitude.coords = start.attitude.coords.map(to);
            body.omega = In::new(start.omega.vector.map(to));
            body.rotor_speed_rad_s = start.rotor_speed_rad_s.map(to);
            let state = plant.initial_state(body, 0.5 + 0.4 * (number % 2) as f64);
            let seed = number as u64;
            let winds = Wind::of_flight(wind, &member.vehicle, &member.effects, seed);
            let mut command = [0.0; MAX_ROTORS];
            for i in 0..4 {
                command[i] = to(thrown.commands[4 * number + i]);
            }
            (plant, state, winds, command)
        })
        .collect();
    for step in (0..steps).step_by(100) {
        batch.command_wings(&wings::<T>(members.len(), step)).unwrap();
        batch.step(100.min(steps - step));
    }
    let mut worst = 0.0_f64;
    for (number, (plant, mut state, mut winds, command)) in states.into_iter().enumerate() {
        let late = (plant.effects().command_latency_s() * 1e3).round() as usize;
        let hold = [0.0; MAX_ROTORS];
        let (mut tick, mut last) = (0, 0);
        let air = |winds: &[Wind]| winds.iter().fold(In::zero(), |sum, wind| sum + wind.velocity());
        for step in 0..steps {
            if step * 300 >= tick * 1000 {
                let meeting = Meeting {
                    through_air: state.body.velocity
                        - total_wind(plant.acting(), &state.body, air(&winds)),
                    height_m: -state.body.position.vector.z,
                };
                for wind in &mut winds {
                    wind.advance((step - last) as f64 * 1e-3, || meeting);
                }
                state.air_omega = winds.iter().find_map(Wind::angular_velocity);
                (tick, last) = (tick + 1, step);
            }
            let (rotor, wing) = match step.checked_sub(late) {
                Some(sent) => (command, wings::<f64>(1, sent)),
                None => (hold, vec![0.0; 2]),
            };
            plant.step(&mut state, &rotor, [wing[0], wing[1]], air(&winds));
        }
        let flown = batch.state(number).unwrap();
        let off = |a: Vector3<T>, b: Vector3<f64>| {
            (a.map(|x| try_convert::<T, f64>(x).unwrap()) - b).norm() / b.norm().max(1.0)
        };
        worst = worst.max(off(flown.position.vector, state.body.position.vector));
        worst = worst.max(off(flown.velocity.vector, state.body.velocity.vector));
        worst = worst.max(off(flown.omega.vector, state.body.omega.vector));
        let [_, volt, _] = batch.battery(number).unwrap().unwrap();
        worst = worst.max((try_convert::<T, f64>(volt).unwrap() - state.battery.voltage_v).abs());
    }
    worst
}

/// In f64 the operations are the plant's, but for its servo within the step in which a rate limit
/// ends (a polynomial there, relative error 6e-11) and for factors of rotors; a tumbling vehicle
/// makes these larger.
#[test]
fn vehicles_in_f64_fly_as_the_plant_does() {
    for wing in ["none", "flat", "membrane"] {
        let worst = off_the_plant::<f64>(WIND, wing, &[], 400);
        assert!(worst < 1e-8, "{wing}: {worst:e}");
    }
}

#[test]
fn every_effect_acts_as_in_the_plant() {
    for name in all_effects() {
        for wing in ["membrane", "flat"] {
            let worst = off_the_plant::<f64>(WIND, wing, &[name], 300);
            assert!(worst < 1e-7, "{name}, {wing}: {worst:e}");
        }
    }
}

#[test]
fn air_that_turns_is_felt_as_by_the_plant() {
    for wing in ["none", "flat", "membrane"] {
        for names in [&[] as &[&str], &["angular_damping"], &["rotor_gyro_torque", "added_mass"]] {
            let worst = off_the_plant::<f64>(MIL, wing, names, 400);
            assert!(worst < 1e-8, "{wing}, {names:?}: {worst:e}");
        }
    }
}

#[test]
fn in_air_that_turns_calls_registers_and_neighbours_do_not_matter() {
    let thrown = Thrown::<f32>::new(40);
    let members = members(&thrown, "membrane", &[]);
    let fly = |count: usize, settings: Settings, call: usize| {
        let mut batch = batch_in(MIL, &thrown, &members[..count], settings);
        for _ in 0..200 / call {
            batch.step(call);
        }
        bits(&mut batch)
    };
    let settings = Settings { threads: 1, ..Settings::default() };
    let all = fly(40, settings, 200);
    assert_ne!(all, {
        let mut calm = batch(&thrown, &members, settings);
        calm.step(200);
        bits(&mut calm)
    });
    assert!(fly(17, settings, 200)[..] == all[..17]);
    for path in Path::available() {
        assert!(fly(40, Settings { path, ..settings }, 20) == all, "{}", path.name());
    }
}

#[test]
fn in_f32_a_vehicle_stays_near_the_plant() {
    let worst = off_the_plant::<f32>(
        WIND,
        "membrane",
        &["battery_sag", "ground_effect", "payload_swing"],
        200,
    );
    assert!(worst < 5e-3, "{worst:e}");
}

#[test]
fn effects_make_a_difference() {
    let thrown = Thrown::<f64>::new(21);
    // Fast through the rotors from below, where a vortex ring is.
    let mut sinking = Thrown::<f64>::new(21);
    for state in &mut sinking.states {
        state.velocity = state.ned_from_body() * In::new(Vector3::new(0.0, 0.0, 9.0));
    }
    let settings = Settings { threads: 1, ..Settings::default() };
    let fly = |thrown: &Thrown<f64>, names: &[&str]| {
        flown(thrown, &members(thrown, "membrane", names), settings, 100)
    };
    let [usual, of_a_state] = [thrown, sinking].map(|thrown| {
        let without = fly(&thrown, &[]);
        (thrown, without)
    });
    for name in all_effects() {
        let is_of_a_state = Effects::<f64>::profile(name).unwrap().is_of_a_state;
        let (thrown, without) = if is_of_a_state { &of_a_state } else { &usual };
        assert_ne!(fly(thrown, &[name])[20], without[20], "{name}");
    }
}

#[test]
fn what_does_not_fly_in_a_batch_is_named() {
    let refused = |change: &dyn Fn(&mut BatchVehicle)| {
        let mut members = vec![member("membrane"), member("membrane")];
        change(&mut members[1]);
        Batch::<f32>::with(&members, Settings::default()).unwrap_err().to_string()
    };
    for name in Effects::<f64>::NAMES.iter().filter(|name| is_of_sensors(name)) {
        let text = refused(&|member| put(&mut member.effects, name, 0, 0.5));
        assert!(text.starts_with(&format!("vehicles[1]: effects.{name}: ")), "{text}");
    }
    let text = refused(&|c| c.wing = member("flat").wing);
    assert_eq!(text, "vehicles[1]: wing.model: flat and membrane do not fly in one batch");
    let text = refused(&|c| put(&mut c.effects, "mass_error", 0, -20.0));
    assert!(text.starts_with("vehicles[1]: with effects, mass.mass_kg = "), "{text}");

    let mut batch = Batch::<f32>::with(&[member("none")], Settings::default()).unwrap();
    let text = batch.refit(0, &member("membrane")).unwrap_err().to_string();
    assert!(text.starts_with("vehicles[0]: wing: the batch was made without"), "{text}");
    let mut heavy = member("none");
    put(&mut heavy.effects, "added_mass", 0, 0.5);
    let text = batch.refit(0, &heavy).unwrap_err().to_string();
    assert!(text.starts_with("vehicles[0]: added_mass: the batch was made without"), "{text}");
    put(&mut heavy.effects, "actuation_latency", 0, 0.5);
    let text = batch.refit(0, &heavy).unwrap_err().to_string();
    assert!(
        text.starts_with("vehicles[0]: added_mass: the batch was made without"),
        "steps first: {text}"
    );
    // What changes the airframe once has a place everywhere.
    let mut other = member("none");
    put(&mut other.effects, "mass_error", 0, 0.5);
    put(&mut other.effects, "motor_lag", 0, 0.5);
    batch.refit(0, &other).unwrap();
    assert_eq!(
        batch.set_charge(0, 1.5).unwrap_err().to_string(),
        "charge of vehicle 0: 1.5, must be 0 to 1"
    );
}

/// A vehicle may come into a batch with another form of an effect that is there: it then flies as
/// in a batch made with it, and its neighbour does not notice. A form that is an equation of its
/// own has no place.
#[test]
fn another_form_may_come_later() {
    let formed = |name: &str, form: usize| {
        let mut member = member("membrane");
        put(&mut member.effects, name, form, 0.5);
        member
    };
    let fly = |mut batch: Batch<f64>| {
        for number in 0..2 {
            let mut state = State::at_rest();
            (state.velocity.vector.x, state.velocity.vector.y) = (5.0, 2.0);
            batch.reset(number, &state).unwrap();
        }
        batch.command(&[0.6; 8]).unwrap();
        batch.step(200);
        [0, 1].map(|number| batch.state(number).unwrap())
    };
    for (name, form) in [
        ("battery_sag", 1),
        ("battery_sag", 2),
        ("flapping_moment", 1),
        ("flapping_moment", 2),
        ("linear_drag", 1),
        ("linear_drag", 2),
        ("axial_inflow", 2),
        ("translational_lift", 1),
        ("translational_lift", 3),
    ] {
        let (first, other) = (formed(name, 0), formed(name, form));
        let made = Batch::with(&[first.clone(), other.clone()], Settings::default()).unwrap();
        let mut refitted =
            Batch::with(&[first.clone(), first.clone()], Settings::default()).unwrap();
        refitted.refit(1, &other).unwrap();
        let (expected, alike) =
            (fly(made), fly(Batch::with(&[first.clone(), first], Settings::default()).unwrap()));
        assert_eq!(fly(refitted), expected, "{name}");
        assert!(alike[0] == expected[0] && alike[1] != expected[1], "{name}");
    }
    for name in ["constant_wind", "ground_effect"] {
        let mut batch = Batch::<f64>::with(&[formed(name, 0)], Settings::default()).unwrap();
        let text = batch.refit(0, &formed(name, 1)).unwrap_err().to_string();
        assert!(
            text.starts_with(&format!("vehicles[0]: {name}: the batch was made without")),
            "{text}"
        );
        let mut batch = Batch::<f64>::with(&[formed(name, 1)], Settings::default()).unwrap();
        batch.refit(0, &formed(name, 0)).unwrap();
    }
}
