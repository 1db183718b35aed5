use super::*;
use crate::case::{Case, Set};
use crate::catalogue::Value;
use nalgebra::UnitQuaternion;

fn airframe() -> Airframe {
    Airframe::draw(&mut Draw::new(7))
}

fn world(effects: &[HiddenEffect]) -> World {
    World { airframe: airframe(), extras: Extras::new(effects), outside: None, unmodelled: None }
}

fn effect(name: &str, key: &str, x: f64) -> HiddenEffect {
    let parameters = [(key.to_owned(), Value::Number(x))].into();
    HiddenEffect { name: name.to_owned(), form: "standard".to_owned(), parameters }
}

fn hover_input(world: &World) -> Input {
    Input {
        time_s: 0.0,
        rotor: [world.airframe.hover_command(); MAX_ROTORS],
        wing: Vector2::zeros(),
        voltage_v: world.airframe.reference_voltage_v,
        current_ratio: 1.0,
        moving_air: Vector3::zeros(),
        noise: [0.0; 6],
    }
}

fn hovering(world: &World) -> State {
    at_hover(&world.airframe, Vector3::new(0.0, 0.0, -3.0), 0.4)
}

#[test]
fn hover_trim_stands_still_and_weighs_its_weight() {
    let world = world(&[]);
    let (mut state, input) = (hovering(&world), hover_input(&world));
    let felt = world.rates(&state, &input, 0.0).specific_force;
    assert!((felt - Vector3::new(0.0, 0.0, -crate::airframe::GRAVITY_M_S2)).norm() < 1e-9);
    for _ in 0..2400 {
        state = state.heun(1.0 / 1200.0, |s, ahead| world.rates(s, &input, ahead).state);
    }
    assert!(state.velocity.norm() < 1e-9 && state.omega.norm() < 1e-9);
}

/// A falling, tumbling vehicle without air and rotors keeps its energy and its angular momentum.
#[test]
fn a_free_body_keeps_energy_and_angular_momentum() {
    let mut world = world(&[]);
    (world.airframe.drag_area_m2, world.airframe.drag_n_s_per_m) = (0.0, Vector3::zeros());
    let input = Input { rotor: [0.0; MAX_ROTORS], ..hover_input(&world) };
    let mut state = hovering(&world);
    state.rotors *= 0.0;
    (state.velocity, state.omega) = (Vector3::new(2.0, -1.0, 0.5), Vector3::new(3.0, 0.2, 2.0));
    let inertia = world.airframe.inertia_kg_m2;
    let invariants = |s: &State| {
        let spin = inertia.component_mul(&s.omega);
        let height = -s.position.z;
        let energy = world.airframe.mass_kg
            * (0.5 * s.velocity.norm_squared() + crate::airframe::GRAVITY_M_S2 * height)
            + 0.5 * s.omega.dot(&spin);
        (energy, UnitQuaternion::new_normalize(s.attitude) * spin)
    };
    let (energy, momentum) = invariants(&state);
    for _ in 0..2400 {
        state = state.heun(1.0 / 1200.0, |s, ahead| world.rates(s, &input, ahead).state);
    }
    let (energy_end, momentum_end) = invariants(&state);
    assert!((energy_end / energy - 1.0).abs() < 1e-5, "{energy} became {energy_end}");
    assert!((momentum_end - momentum).norm() < 1e-4 * momentum.norm());
}

#[test]
fn drag_and_wings_oppose_the_motion_and_wind_pushes() {
    let world = world(&[]);
    let input = hover_input(&world);
    let mut state = hovering(&world);
    state.deployment = Vector2::repeat(1.0);
    state.velocity = Vector3::new(3.0, -4.0, 2.0);
    let still = world.rates(&hovering(&world), &input, 0.0).state.velocity;
    let moving = world.rates(&state, &input, 0.0).state.velocity;
    assert!((moving - still).dot(&state.velocity) < -0.5);
    let wind = [effect("constant_wind", "wind_north_m_s", 5.0)];
    let windy = super::World { extras: Extras::new(&wind), ..world.clone() };
    assert!(windy.rates(&hovering(&world), &input, 0.0).state.velocity.x > 0.3);
}

#[test]
fn open_wings_damp_roll_and_a_weak_side_rolls() {
    let weak = HiddenEffect {
        parameters: [
            ("side".to_owned(), Value::Name("left".to_owned())),
            ("loss_fraction".to_owned(), Value::Number(0.4)),
        ]
        .into(),
        ..effect("wing_asymmetry", "loss_fraction", 0.4)
    };
    for (effects, roll_rate, sign) in [(vec![], 2.0, -1.0), (vec![weak], 0.0, -1.0)] {
        let world = world(&effects);
        let mut state = hovering(&world);
        state.velocity.z = 4.0;
        state.omega.x = roll_rate;
        let folded = world.rates(&state, &hover_input(&world), 0.0).state.omega.x;
        state.deployment = Vector2::repeat(1.0);
        let open = world.rates(&state, &hover_input(&world), 0.0).state.omega.x;
        assert!(
            sign * (open - folded) > 0.1,
            "sinking, the stronger right wing lifts and rolls to the left"
        );
    }
}

#[test]
fn the_same_order_gives_the_same_flight_and_another_seed_another() {
    let case = Case::draw(Set::Single, 4, 11);
    assert_eq!(case.flight(0).unwrap(), Case::draw(Set::Single, 4, 11).flight(0).unwrap());
    assert_ne!(case.flight(0).unwrap(), case.flight(1).unwrap());
    assert_ne!(case.flight(0).unwrap(), Case::draw(Set::Single, 4, 12).flight(0).unwrap());
}

#[test]
fn logs_have_the_rates_and_the_noise_that_they_should() {
    let case = Case::draw(Set::None, 2, 1);
    let log = case.flight(0).unwrap();
    let sd = |name: &str, axis: usize| {
        // The fourth difference of white noise has 70 times its variance; of motion there is little
        // left.
        let (_, channel) = log.channel(name).unwrap();
        let x: Vec<f64> =
            (0..channel.values.len() / channel.width).map(|i| channel.row(i)[axis]).collect();
        let difference = |w: &[f64]| w[0] - 4.0 * w[1] + 6.0 * w[2] - 4.0 * w[3] + w[4];
        let squares: Vec<f64> = x.windows(5).map(|w| difference(w).powi(2)).collect();
        (squares.iter().sum::<f64>() / squares.len() as f64 / 70.0).sqrt()
    };
    for axis in 0..3 {
        let gyro = sd("imu.omega_body_rad_s", axis) / white::GYRO_RAD_S;
        let accel = sd("imu.specific_force_body_m_s2", axis) / white::ACCEL_M_S2;
        let gnss = sd("gnss.velocity_ned_m_s", axis) / white::GNSS_VELOCITY_M_S[axis];
        assert!((0.95..1.05).contains(&gyro) && (0.95..1.1).contains(&accel), "{gyro} {accel}");
        assert!((0.85..2.0).contains(&gnss), "10 Hz sees some of the motion: {gnss}");
    }
    assert!((0.93..1.1).contains(&(sd("baro.altitude_m", 0) / white::BARO_M)));
    assert!((0.93..1.2).contains(&(sd("battery.voltage_v", 0) / white::VOLTAGE_V)));
    let samples = |name: &str| log.channel(name).unwrap().0.len();
    assert_eq!(samples("imu.omega_body_rad_s"), 12_000);
    assert_eq!(samples("rotor.command"), 12_000);
    assert_eq!(samples("gnss.velocity_ned_m_s"), 399);
    assert_eq!(samples("baro.altitude_m"), 2000);
    assert_eq!(log.channel("rotor.command").unwrap().1.width, case.nominal().rotors.len());
}

/// Rms of receiver velocity minus the strapdown integral, each line removed, m/s.
fn kinematic_residual(case: &Case) -> f64 {
    let log = case.flight(0).unwrap();
    let (_, force) = log.channel("imu.specific_force_body_m_s2").unwrap();
    let (_, attitude) = log.channel("attitude.q_ned_from_body_wxyz").unwrap();
    let (_, gnss) = log.channel("gnss.velocity_ned_m_s").unwrap();
    let mut velocity = Vector3::zeros();
    let mut off = Vec::new();
    for k in 0..12_000 {
        if k % 30 == 0 && k > 0 {
            off.push(Vector3::from_column_slice(gnss.row(k / 30 - 1)) - velocity);
        }
        let q = attitude.row(k);
        let q = UnitQuaternion::new_normalize(Quaternion::new(q[0], q[1], q[2], q[3]));
        let felt = Vector3::from_column_slice(force.row(k));
        velocity += (q * felt + Vector3::new(0.0, 0.0, crate::airframe::GRAVITY_M_S2)) / IMU_HZ;
    }
    // A bias of the accelerometer turns with the vehicle; over one second it is a line.
    let rms = |window: &[Vector3<f64>]| {
        let n = window.len() as f64;
        let mean = window.iter().sum::<Vector3<f64>>() / n;
        let lever: Vec<f64> = (0..window.len()).map(|i| i as f64 - 0.5 * (n - 1.0)).collect();
        let slope = window.iter().zip(&lever).map(|(v, t)| v * *t).sum::<Vector3<f64>>()
            / lever.iter().map(|t| t * t).sum::<f64>();
        window.iter().zip(&lever).map(|(v, t)| (v - mean - slope * *t).norm_squared()).sum::<f64>()
            / n
    };
    let windows: Vec<f64> = off.chunks_exact(20).map(rms).collect();
    (windows.iter().sum::<f64>() / windows.len() as f64).sqrt()
}

/// Velocity is the integral of what the accelerometer feels, unless a sensor effect is hidden.
#[test]
fn receiver_and_accelerometer_agree_until_a_sensor_effect_is_hidden() {
    let none = Case::draw(Set::None, 0, 1);
    let [north, east, down] = white::GNSS_VELOCITY_M_S;
    let floor = (north * north + east * east + down * down).sqrt();
    let base = kinematic_residual(&none);
    assert!((0.85..1.5).contains(&(base / floor)), "{base} for {floor}");
    for (name, key, size) in
        [("gnss_latency", "latency_s", 0.12), ("heading_bias", "bias_rad", 0.2)]
    {
        let with = kinematic_residual(&none.hiding(vec![effect(name, key, size)], None));
        assert!(with > 1.3 * base, "{name}: {with} for {base}");
    }
    let dragged = none.hiding(vec![effect("linear_drag", "extra_drag_n_s_per_m", 0.2)], None);
    assert!(
        (kinematic_residual(&dragged) / base - 1.0).abs() < 0.1,
        "a force is not a sensor effect"
    );
}
