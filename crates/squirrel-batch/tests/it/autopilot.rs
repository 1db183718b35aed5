//! The inner loop in a batch is the flight code's, and what it does to a vehicle depends on nothing
//! but the vehicle.

use super::support::{Thrown, bits};
use nalgebra::Vector3;
use squirrel_batch::{Autopilot, Batch, BatchError, Scheme, SetPoint, Settings, Tuned};
use squirrel_core::control::backstepping::{AttitudeForm, AttitudeGains, AttitudeState};
use squirrel_core::control::command_filter::{self, EulerReference};
use squirrel_core::control::lead::Lead;
use squirrel_core::control::mixer::{Mixer, ThrustTorque};
use squirrel_sim::simd::Path;
use squirrel_sim::vehicle_file::VehicleFile;

fn squirrel() -> Tuned {
    let file = VehicleFile::squirrel();
    let gains = AttitudeGains { form: AttitudeForm::Quaternion, ..file.control.unwrap().attitude };
    Tuned { vehicle: file.vehicle.cast().unwrap(), gains }
}

fn settings(threads: usize, path: Path) -> Settings {
    Settings { dt_s: 2e-3, scheme: Scheme::Rk4, threads, path }
}

fn attitudes(period_steps: usize) -> Autopilot {
    Autopilot { set_point: SetPoint::Attitude, period_steps }
}

/// Set points that a vehicle of this number follows in this half second.
fn set_point(number: usize, half_second: usize) -> [f32; 4] {
    let k = (number * 7 + half_second * 3) as f32;
    [
        0.5 * (k * 0.9).sin(),
        0.5 * (k * 1.7).cos(),
        2.0 * (k * 0.3).sin(),
        5.4 + 2.0 * (k * 0.5).sin(),
    ]
}

/// The squirrel with commands of another kind.
fn commanded(kind: &str) -> Tuned {
    let text =
        include_str!("../../../../vehicles/squirrel.toml").replace("\"speed_fraction\"", kind);
    let vehicle = VehicleFile::parse(&text, "test").unwrap().vehicle.cast().unwrap();
    Tuned { vehicle, ..squirrel() }
}

/// The flight code and the loop in the batch, each flying the same plant: the same bits, at the
/// rotors' limits and with yaw far behind, too.
fn flies_as_the_flight_code(tuned: &Tuned) {
    let settings = settings(1, Path::best());
    let mut batch: Batch<f32> = Batch::new(&[tuned.vehicle], settings).unwrap();
    let mut plant: Batch<f32> = Batch::new(&[tuned.vehicle], settings).unwrap();
    batch.engage(attitudes(1), std::slice::from_ref(tuned)).unwrap();
    let mixer = Mixer::new(&tuned.vehicle).unwrap();
    let inertia = tuned.vehicle.parameters().inertia_kg_m2;
    let lead = Lead::new(tuned.gains.rotor_lead, &tuned.vehicle.parameters().propulsion);
    let mut followed = [0.0; 3];
    let (mut filter, mut loop_state, mut saturated) =
        (EulerReference::default(), AttitudeState::default(), false);
    let (mut tilted, mut beyond, mut led) = (0.0_f32, 0, 0);
    for step in 0..2000 {
        let t = step as f32 * 2e-3;
        let [roll, pitch, yaw] =
            [0.5 * (2.0 * t).sin(), 0.4 * (1.5 * t).sin(), 3.0 * (0.7 * t).sin()];
        let thrust_n = 6.4 + 4.0 * (1.1 * t).sin();
        let state = plant.state(0).unwrap();
        let measured_rad = state.ned_from_body().heading();
        let yaw_rad = tuned.gains.form.yaw_target_rad(measured_rad, yaw);
        led += u32::from((yaw_rad - measured_rad).abs() > 0.349);
        let target = Vector3::new(roll, pitch, yaw_rad);
        let (frequency, damping) = (tuned.gains.filter_frequency_rad_s, tuned.gains.filter_damping);
        command_filter::step(&mut filter, &target, frequency, damping, 2e-3);
        let terms = tuned.gains.update(
            &mut loop_state,
            &inertia,
            &state.ned_from_body(),
            &state.omega.vector,
            &filter,
            saturated,
            2e-3,
        );
        let torque_n_m = lead.step(&mut followed, &terms.torque_n_m.into(), 2e-3).into();
        let mixed = mixer.allocate(&ThrustTorque { thrust_n, torque_n_m });
        saturated = mixed.saturated;
        beyond += u32::from(saturated);
        let propulsion = &tuned.vehicle.parameters().propulsion;
        let commands: Vec<f32> =
            mixed.rotor_thrust_n[..4].iter().map(|f| propulsion.command_for_thrust(*f)).collect();
        plant.command(&commands).unwrap();
        plant.step(1);
        batch.set_points(&[roll, pitch, yaw, thrust_n]).unwrap();
        batch.step(1);
        assert_eq!(bits(&mut batch), bits(&mut plant), "step {step}");
        tilted = tilted.max(state.ned_from_body().euler().0.abs());
    }
    assert!(tilted > 0.4 && beyond > 50 && led > 20, "{tilted} {beyond} {led}");
}

#[test]
fn it_flies_as_the_flight_code_to_the_bit() {
    for kind in ["\"speed_fraction\"", "\"thrust_n\"", "\"pwm_us\""] {
        flies_as_the_flight_code(&commanded(kind));
    }
    let gains = AttitudeGains { rotor_lead: 3.0, ..squirrel().gains };
    flies_as_the_flight_code(&Tuned { gains, ..squirrel() });
}

fn flown<const N: usize>(
    count: usize,
    settings: Settings,
    pattern: [usize; N],
    level: SetPoint,
) -> Vec<Vec<u64>> {
    let thrown = Thrown::<f32>::new(count);
    let mut batch = thrown.batch(settings);
    let tuned: Vec<Tuned> =
        thrown.vehicles.iter().map(|vehicle| Tuned { vehicle: *vehicle, ..squirrel() }).collect();
    batch.engage(Autopilot { set_point: level, period_steps: 3 }, &tuned).unwrap();
    let (mut done, mut turn) = (0, 0);
    while done < 300 {
        if done % 100 == 0 {
            let rows: Vec<f32> =
                (0..count).flat_map(|number| set_point(number, done / 100)).collect();
            batch.set_points(&rows).unwrap();
        }
        let steps = pattern[turn % N].min(100 - done % 100);
        batch.step(steps);
        (done, turn) = (done + steps, turn + 1);
    }
    bits(&mut batch)
}

#[test]
fn bits_depend_on_nothing_but_the_vehicle() {
    for level in [SetPoint::Attitude, SetPoint::BodyRate] {
        let expected = flown(100, settings(1, Path::available()[0]), [100], level);
        for path in Path::available() {
            assert!(flown(100, settings(1, path), [100], level) == expected, "{}", path.name());
        }
        let best = settings(2, Path::best());
        assert!(flown(100, best, [1], level) == expected, "one step a call");
        assert!(flown(100, best, [7, 2, 30], level) == expected, "any pattern");
        assert!(flown(1, best, [100], level)[0] == expected[0], "alone");
        assert!(flown(1000, best, [100], level)[..100] == expected[..], "among many");
    }
}

#[test]
fn body_rates_are_reached_and_thrust_is_the_thrust_asked_for() {
    let tuned = squirrel();
    let mut batch: Batch<f32> = Batch::new(&[tuned.vehicle], settings(1, Path::best())).unwrap();
    let level = Autopilot { set_point: SetPoint::BodyRate, period_steps: 1 };
    batch.engage(level, std::slice::from_ref(&tuned)).unwrap();
    batch.set_points(&[0.8, -0.5, 0.3, 6.0]).unwrap();
    batch.step(500);
    let state = batch.state(0).unwrap();
    let error = (state.omega.vector - Vector3::new(0.8, -0.5, 0.3)).norm();
    assert!(error < 0.05, "{error}");
    let k = tuned.vehicle.parameters().propulsion.thrust_coefficient_n_s2;
    let thrust: f32 = state.rotor_speed_rad_s[..4].iter().map(|speed| k * speed * speed).sum();
    assert!((thrust - 6.0).abs() < 0.05, "{thrust}");
}

/// More than the rotors have: tilt first, then thrust, yaw last; and what was not met is not
/// integrated.
#[test]
fn limits_hold_and_tilt_comes_first() {
    let tuned = squirrel();
    let mut batch: Batch<f32> = Batch::new(&[tuned.vehicle], settings(1, Path::best())).unwrap();
    batch.engage(attitudes(1), std::slice::from_ref(&tuned)).unwrap();
    let most = Mixer::new(&tuned.vehicle).unwrap().rotor_thrust_max_n();
    let k = tuned.vehicle.parameters().propulsion.thrust_coefficient_n_s2;
    batch.set_points(&[0.6, 0.0, 0.5, 1e3]).unwrap();
    for _ in 0..1000 {
        batch.step(1);
        let speeds = batch.state(0).unwrap().rotor_speed_rad_s;
        assert!(
            speeds.iter().all(|speed| (0.0..=(most / k).sqrt() * 1.0001).contains(speed)),
            "{speeds:?}"
        );
    }
    let (roll, _, _) = batch.state(0).unwrap().ned_from_body().euler();
    assert!((roll - 0.6).abs() < 0.1, "{roll}");
}

#[test]
fn what_cannot_be_engaged_is_named() {
    let tuned = squirrel();
    let mut batch: Batch<f32> = Batch::new(&[tuned.vehicle; 2], settings(1, Path::best())).unwrap();
    let error = batch.set_points(&[0.0; 8]).unwrap_err();
    assert!(matches!(error, BatchError::NoAutopilot), "{error}");
    let error = batch.engage(attitudes(1), std::slice::from_ref(&tuned)).unwrap_err().to_string();
    assert_eq!(error, "vehicles of the autopilot: 1 numbers, must be 2");
    let error =
        batch.engage(attitudes(0), &[tuned.clone(), tuned.clone()]).unwrap_err().to_string();
    assert_eq!(error, "period_steps = 0: must be at least 1");
    let mut bad = tuned.clone();
    bad.gains.c1_per_s.y = f32::NAN;
    let error = batch.engage(attitudes(1), &[tuned, bad]).unwrap_err().to_string();
    assert!(
        error.contains("vehicles[1]") && error.contains("control.attitude.c1_per_s[1] = NaN"),
        "{error}"
    );
}
