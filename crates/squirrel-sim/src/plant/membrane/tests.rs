//! The wing against physics; against measured plates it stands in `measured`.

use super::*;
use core::f64::consts::FRAC_PI_2;
use squirrel_core::dynamics::rk4;

const AREA_M2: f64 = 0.04;
const SPREAD: [f64; 2] = [1.0; 2];
const STILL: [f64; 2] = [0.0; 2];

pub(super) fn parameters() -> MembraneParameters {
    MembraneParameters::new(0.5 * AREA_M2, 0.09)
}
fn wing() -> Membrane {
    Membrane::new(parameters()).unwrap()
}
/// No camber under any load of these tests.
fn stiff() -> Membrane {
    Membrane::new(MembraneParameters { tension_n_per_m: 1e12, ..parameters() }).unwrap()
}
fn air(velocity: Vector3<f64>, omega: Vector3<f64>) -> Air<f64> {
    Air { velocity: In::new(velocity), speed: velocity.norm(), omega: In::new(omega) }
}
fn gliding(speed_m_s: f64, angle_rad: f64) -> Air<f64> {
    air(speed_m_s * Vector3::new(angle_rad.cos(), 0.0, angle_rad.sin()), Vector3::zeros())
}
/// Where the state settles in air that does not change.
fn steady(wing: &Membrane, air: &Air<f64>) -> MembraneState {
    let mut state = MembraneState::at_rest();
    for _ in 0..3000 {
        state = rk4(state, 5e-3, |s| wing.evaluate(air, STILL, SPREAD, s).1);
    }
    state
}
/// Lift, drag and normal coefficient in air without sideslip or rotation.
pub(super) struct Coefficients {
    pub(super) lift: f64,
    pub(super) drag: f64,
    pub(super) normal: f64,
}
fn coefficients(wing: &Membrane, air: &Air<f64>, state: &MembraneState) -> Coefficients {
    let force = wing.evaluate(air, STILL, SPREAD, state).0.force.vector;
    let c = -force / (0.5 * AIR_DENSITY_KG_M3 * AREA_M2 * air.speed * air.speed);
    let v = air.velocity.vector / air.speed;
    Coefficients { lift: c.z * v.x - c.x * v.z, drag: c.dot(&v), normal: c.z }
}
pub(super) fn steady_coefficients(wing: &Membrane, speed_m_s: f64, angle_deg: f64) -> Coefficients {
    let air = gliding(speed_m_s, angle_deg.to_radians());
    coefficients(wing, &air, &steady(wing, &air))
}

#[test]
fn still_wings_take_energy_out_of_air_from_everywhere() {
    let wing = wing();
    for octant in 0..8u8 {
        let sign = |bit: u8| if octant & bit == 0 { 1.0 } else { -1.0 };
        for direction in
            [[1.0, 0.1, 0.03], [0.3, 1.0, 0.5], [0.1, 0.2, 1.0], [1.0, 0.0, 0.5], [1.0, 0.5, 1e-9]]
        {
            for speed_m_s in [0.01, 1.0, 7.0] {
                let d = Vector3::new(
                    sign(1) * direction[0],
                    sign(2) * direction[1],
                    sign(4) * direction[2],
                );
                let air = air(d * (speed_m_s / d.norm()), Vector3::zeros());
                for state in [MembraneState::at_rest(), steady(&wing, &air)] {
                    let force = wing.evaluate(&air, STILL, SPREAD, &state).0.force.vector;
                    assert!(
                        force.dot(&air.velocity.vector) < 0.0,
                        "{d:?} at {speed_m_s} m/s, {state:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn steady_lift_rises_then_stalls() {
    let wing = wing();
    let lift: Vec<f64> =
        (0..=90).map(|a| steady_coefficients(&wing, 7.0, f64::from(a)).lift).collect();
    let peak = (0..lift.len()).max_by(|a, b| lift[*a].total_cmp(&lift[*b])).unwrap();
    println!("lift peaks at {peak} deg with {:.3}; {:?}", lift[peak], lift);
    assert!((28..=45).contains(&peak), "stall at {peak} deg");
    assert!(lift[..=peak].is_sorted(), "lift falls below the stall: {lift:?}");
    assert!(lift[peak] - lift[peak + 10] > 0.1 * lift[peak], "no stall: {lift:?}");
}

#[test]
fn small_angles_have_the_potential_slope() {
    let state = MembraneState::at_rest();
    let angle = 1e-3;
    let slope = coefficients(&wing(), &gliding(7.0, angle), &state).normal / angle;
    assert!((slope / 1.483 - 1.0).abs() < 0.005, "{slope}");
}

#[test]
fn broadside_air_finds_a_disc() {
    let flat = steady_coefficients(&stiff(), 7.0, 90.0);
    assert!((flat.normal / 1.128 - 1.0).abs() < 1e-3, "{}", flat.normal);
    // A cup holds more air, by the factor of the separated branch.
    let air = gliding(7.0, FRAC_PI_2);
    let state = steady(&wing(), &air);
    let camber = state.fast_camber[0] + state.creep_camber[0];
    let cup = coefficients(&wing(), &air, &state).normal;
    assert!(
        (cup / (1.128 * (1.0 + 1.5 * camber)) - 1.0).abs() < 1e-3 && camber > 0.05,
        "{cup}, {camber}"
    );
}

#[test]
fn stall_depends_on_where_one_comes_from() {
    let wing = wing();
    let (rate_rad_s, dt_s) = (3.0, 1e-3);
    // Lift at each degree of a ramp between two angles.
    let ramp = |from_deg: f64, to_deg: f64| {
        let mut state = steady(&wing, &gliding(7.0, from_deg.to_radians()));
        let rate = rate_rad_s * (to_deg - from_deg).signum();
        let mut angle = from_deg.to_radians();
        let mut lift = Vec::new();
        while (angle - to_deg.to_radians()) * rate < 0.0 {
            let air = gliding(7.0, angle);
            state = rk4(state, dt_s, |s| wing.evaluate(&air, [rate; 2], SPREAD, s).1);
            angle += rate * dt_s;
            lift.push((angle.to_degrees(), coefficients(&wing, &gliding(7.0, angle), &state).lift));
        }
        lift
    };
    let (up, down) = (ramp(0.0, 60.0), ramp(60.0, 0.0));
    let highest = |curve: &[(f64, f64)]| curve.iter().map(|c| c.1).fold(f64::MIN, f64::max);
    let statically = (20..=50)
        .map(|a| steady_coefficients(&wing, 7.0, f64::from(a)).lift)
        .fold(f64::MIN, f64::max);
    println!("static {statically:.3} up {:.3} down {:.3}", highest(&up), highest(&down));
    assert!(highest(&up) > 1.1 * statically, "no overshoot: {} over {statically}", highest(&up));
    let at = |curve: &[(f64, f64)], angle: f64| {
        curve.iter().find(|c| (c.0 - angle).abs() < 0.1).unwrap().1
    };
    assert!(at(&down, 32.0) < 0.8 * at(&up, 32.0), "no hysteresis");
    let recovered = steady(&wing, &gliding(7.0, 0.1)).attached[0];
    assert!(recovered > 0.99, "a stalled wing recovers, {recovered}");
}

#[test]
fn a_brake_at_7_m_s_is_worth_1_to_3_newton() {
    let air = gliding(7.0, 30f64.to_radians());
    let force = wing().evaluate(&air, STILL, SPREAD, &steady(&wing(), &air)).0.force.vector.norm();
    println!("{force:.3} N");
    assert!((1.0..3.0).contains(&force), "{force} N");
}

#[test]
fn symmetric_air_does_not_roll_and_rolling_is_damped() {
    let wing = wing();
    let v = Vector3::new(6.0, 0.0, 3.0);
    let state = steady(&wing, &air(v, Vector3::zeros()));
    let roll = |omega_x: f64| {
        wing.evaluate(&air(v, Vector3::x() * omega_x), STILL, SPREAD, &state).0.moment.vector.x
    };
    assert_eq!(roll(0.0), 0.0);
    for omega_x in [0.1, 1.0, 5.0] {
        assert!(
            roll(omega_x) < 0.0 && roll(-omega_x) > 0.0,
            "{omega_x} rad/s: {} N m",
            roll(omega_x)
        );
    }
}

#[test]
fn left_and_right_mirror_and_so_do_belly_and_back() {
    let wing = wing();
    let swap = |x: [f64; 2]| [x[1], x[0]];
    let (v, omega) = (Vector3::new(5.0, 1.5, 2.0), Vector3::new(0.7, -0.4, 1.1));
    let (rate, deployment) = ([2.0, -1.0], [0.9, 0.4]);
    let state = MembraneState {
        fast_camber: [0.05, 0.08],
        creep_camber: [0.02, -0.01],
        attached: [0.9, 0.4],
    };
    let (wrench, rates) = wing.evaluate(&air(v, omega), rate, deployment, &state);
    let (f, m) = (wrench.force.vector, wrench.moment.vector);
    assert!(f.amin() > 1e-3 && m.amin() > 1e-4, "a zero mirrors too easily: {f:?} {m:?}");

    let mirrored = MembraneState {
        fast_camber: swap(state.fast_camber),
        creep_camber: swap(state.creep_camber),
        attached: swap(state.attached),
    };
    let other_air = air(Vector3::new(v.x, -v.y, v.z), Vector3::new(-omega.x, omega.y, -omega.z));
    let (other, other_rates) = wing.evaluate(&other_air, swap(rate), swap(deployment), &mirrored);
    assert_eq!(other.force.vector, Vector3::new(f.x, -f.y, f.z));
    assert_eq!(other.moment.vector, Vector3::new(-m.x, m.y, -m.z));
    assert_eq!(other_rates.fast_camber, swap(rates.fast_camber));
    assert_eq!(other_rates.creep_camber, swap(rates.creep_camber));
    assert_eq!(other_rates.attached, swap(rates.attached));

    let minus = |x: [f64; 2]| x.map(|x| -x);
    let turned = MembraneState {
        fast_camber: minus(state.fast_camber),
        creep_camber: minus(state.creep_camber),
        attached: state.attached,
    };
    let other_air = air(Vector3::new(v.x, v.y, -v.z), Vector3::new(-omega.x, -omega.y, omega.z));
    let (other, other_rates) = wing.evaluate(&other_air, minus(rate), deployment, &turned);
    assert_eq!(other.force.vector, Vector3::new(f.x, f.y, -f.z));
    assert_eq!(other.moment.vector, Vector3::new(-m.x, -m.y, m.z));
    assert_eq!(other_rates.fast_camber, minus(rates.fast_camber));
    assert_eq!(other_rates.creep_camber, minus(rates.creep_camber));
    assert_eq!(other_rates.attached, rates.attached);
}

#[test]
fn steady_camber_solves_the_cubic() {
    let residual =
        |k: f64, prestrain: f64, load: f64| 8.0 * k * prestrain + 64.0 / 3.0 * k.powi(3) - load;
    for prestrain in [0.0, 1e-6, 0.02, 1.0] {
        let wing = MembraneParameters { prestrain, ..parameters() }.numbers();
        for load in [0.0, 1e-12, 1e-6, 1e-3, 0.033, 0.5, 10.0] {
            let k = wing.steady_camber(3.0 / 128.0 * load);
            assert_eq!(k, -wing.steady_camber(3.0 / 128.0 * -load));
            assert!(residual(k, prestrain, load).abs() <= 1e-9 * load, "{prestrain} {load}: {k:?}");
        }
    }
    // Settled in the air, the elastic camber carries the load that the force shows; the creep is
    // its fraction.
    let air = gliding(7.0, 0.4);
    let state = steady(&wing(), &air);
    let load =
        0.5 * AIR_DENSITY_KG_M3 * 49.0 * 0.2 / 275.0 * coefficients(&wing(), &air, &state).normal;
    assert!(residual(state.fast_camber[0], 0.02, load).abs() < 1e-9);
    assert!((state.creep_camber[0] / state.fast_camber[0] - 0.3).abs() < 1e-9);
    assert!((0.05..0.2).contains(&state.fast_camber[0]), "{state:?}");
}

#[test]
fn camber_snaps_through_with_delay() {
    let wing = wing();
    let mut state = steady(&wing, &gliding(7.0, 0.3));
    assert!(state.fast_camber[0] > 0.0);
    let above = gliding(7.0, -0.3);
    for _ in 0..10 {
        state = rk4(state, 1e-3, |s| wing.evaluate(&above, STILL, SPREAD, s).1);
    }
    assert!(state.fast_camber[0] > 0.0, "10 ms are less than the lag");
    for _ in 0..3000 {
        state = rk4(state, 1e-3, |s| wing.evaluate(&above, STILL, SPREAD, s).1);
    }
    assert!(state.fast_camber[0] < 0.0);
}

#[test]
fn fast_edge_on_air_bulges_the_membrane_and_slow_does_not() {
    let settled = |speed_m_s: f64| {
        let air = gliding(speed_m_s, 0.0);
        let mut state = MembraneState { fast_camber: [1e-3; 2], ..MembraneState::at_rest() };
        for _ in 0..10_000 {
            state = rk4(state, 5e-3, |s| wing().evaluate(&air, STILL, SPREAD, s).1);
        }
        state.fast_camber[0]
    };
    assert!(settled(7.0) < 1e-6 && settled(10.0) > 0.02, "{} {}", settled(7.0), settled(10.0));
}

#[test]
fn no_airspeed_no_force_and_never_a_nan() {
    let states = [
        MembraneState::at_rest(),
        MembraneState {
            fast_camber: [0.1, -0.1],
            creep_camber: [-0.05, 0.0],
            attached: [0.0, 0.5],
        },
    ];
    let mut directions = vec![Vector3::zeros()];
    for x in [-1.0, 0.0, 1e-160, 1e-9, 1.0] {
        for y in [0.0, -0.0, 1e-9, 1.0] {
            directions.extend([-1.0, -0.0, 1e-9, 0.5, 1.0].map(|z| Vector3::new(x, y, z)));
        }
    }
    for prestrain in [0.0, 0.02] {
        let wing = Membrane::new(MembraneParameters { prestrain, ..parameters() }).unwrap();
        for state in &states {
            for speed in [0.0, 1e-300, 1e-160, 1e-20, 1e-9, 0.05, 1.0, 20.0, 1e6] {
                for direction in &directions {
                    for omega in [Vector3::zeros(), Vector3::new(1e-12, 3.0, -30.0)] {
                        let air = air(direction * speed, omega);
                        let (wrench, rates) =
                            wing.evaluate(&air, [-1e3, f64::INFINITY], SPREAD, state);
                        let (f, m) = (wrench.force.vector, wrench.moment.vector);
                        let all = [
                            rates.fast_camber,
                            rates.creep_camber,
                            rates.attached,
                            wing.angle_of_attack(&air),
                        ];
                        assert!(
                            f.iter().chain(&m).chain(all.as_flattened()).all(|x| x.is_finite()),
                            "{air:?}"
                        );
                        if air.speed == 0.0 && omega.z == 0.0 {
                            assert_eq!((f.norm(), m.norm()), (0.0, 0.0));
                        }
                    }
                }
            }
        }
    }
    let lost = air(Vector3::new(f64::NAN, 0.0, 0.0), Vector3::zeros());
    let force = wing().evaluate(&lost, STILL, SPREAD, &states[0]).0.force.vector;
    assert!(force.z.is_nan(), "a lost airspeed must not pass for a force");
}

#[test]
fn deployment_scales_each_side_and_the_camber_it_tends_to() {
    let (wing, air) = (wing(), gliding(7.0, 0.4));
    let state = steady(&wing, &air);
    let (full, rates) = wing.evaluate(&air, STILL, SPREAD, &state);
    let (half, half_rates) = wing.evaluate(&air, STILL, [0.5; 2], &state);
    assert!((half.force.vector * 2.0 - full.force.vector).norm() < 1e-12);
    assert!((half.moment.vector * 2.0 - full.moment.vector).norm() < 1e-12);
    assert_eq!(half_rates.attached, rates.attached);
    // Settled at full deployment; at half of it the membrane goes to half of its camber.
    let p = wing.parameters();
    for (rate, camber, lag_s) in [
        (half_rates.fast_camber, state.fast_camber, p.camber_time_constant_s),
        (half_rates.creep_camber, state.creep_camber, p.creep_time_constant_s),
    ] {
        assert!((rate[0] * lag_s / camber[0] + 0.5).abs() < 1e-6, "{rate:?} {camber:?}");
    }
    let left = wing.evaluate(&air, STILL, [1.0, 0.0], &state).0;
    assert!((left.force.vector * 2.0 - full.force.vector).norm() < 1e-12);
    assert!(left.moment.vector.x > 0.0, "lift on the left rolls to the right");
    let folded = wing.evaluate(&air, STILL, [0.0; 2], &state).0;
    assert_eq!((folded.force.vector.norm(), folded.moment.vector.norm()), (0.0, 0.0));
}

#[test]
fn a_wing_that_was_folded_opens_flat_and_fills() {
    let (wing, air) = (wing(), gliding(7.0, 0.4));
    let full = steady(&wing, &air);
    let lead = |mut state: MembraneState, deployment: [f64; 2], duration_s: f64| {
        for _ in 0..(duration_s * 500.0) as u32 {
            state = rk4(state, 2e-3, |s| wing.evaluate(&air, STILL, deployment, s).1);
        }
        state
    };
    let camber = |state: &MembraneState| state.fast_camber[0] + state.creep_camber[0];
    // The stretch is gone; creep, which recovers with 0.5 s, leaves 0.4 % of the chord.
    let folded = lead(full, [0.0; 2], 1.0);
    println!("camber {:.4}, folded for 1 s {:.4}", camber(&full), camber(&folded));
    assert!(folded.fast_camber[0].abs() < 1e-6 && camber(&folded) < 0.04 * camber(&full));
    let normal = |state: &MembraneState| coefficients(&wing, &air, state).normal;
    let flat = normal(&MembraneState { attached: folded.attached, ..MembraneState::at_rest() });
    assert!((normal(&folded) / flat - 1.0).abs() < 0.02, "{} {flat}", normal(&folded));
    let never_opened = lead(MembraneState::at_rest(), [0.0; 2], 1.0);
    assert_eq!(camber(&never_opened), 0.0, "what was never spread has no camber");
    // Opened again, it has most of it after a few lags.
    let opened = lead(folded, SPREAD, 0.2);
    assert!(camber(&opened) > 0.7 * camber(&full), "{}", camber(&opened));
}

#[test]
fn the_pressure_centre_lies_towards_the_flow() {
    let state = MembraneState::at_rest();
    let moment = |v: Vector3<f64>| {
        wing().evaluate(&air(v, Vector3::zeros()), STILL, SPREAD, &state).0.moment.vector
    };
    let ahead = moment(Vector3::new(6.0, 0.0, 2.0));
    assert!(ahead.y > 0.0 && ahead.x == 0.0 && ahead.z == 0.0, "nose up: {ahead:?}");
    let right = moment(Vector3::new(0.0, 6.0, 2.0));
    assert!(right.x < 0.0 && right.y.abs() < 1e-15, "right wing up: {right:?}");
    assert_eq!(moment(Vector3::new(0.0, 0.0, 6.0)), Vector3::zeros());
    // A flat wing's pressure lies a quarter chord ahead at small angles, as plates show, an arc's
    // edge on at its middle.
    let centre_m = |state: &MembraneState, angle_rad: f64| {
        let wrench = wing().evaluate(&gliding(7.0, angle_rad), STILL, SPREAD, state).0;
        -wrench.moment.vector.y / wrench.force.vector.z
    };
    assert!((centre_m(&state, 1e-3) - 0.05).abs() < 1e-4);
    let arc = MembraneState { fast_camber: [0.1; 2], ..state };
    assert!(centre_m(&arc, 0.0).abs() < 1e-12);
    assert!(centre_m(&arc, 0.3) < centre_m(&state, 0.3) && centre_m(&arc, 0.3) > 0.01);
    let fixed =
        Membrane::new(MembraneParameters { pressure_centre_shift: 0.0, ..parameters() }).unwrap();
    assert_eq!(fixed.evaluate(&gliding(7.0, 0.3), STILL, SPREAD, &state).0.moment.vector.y, 0.0);
}

#[test]
fn each_side_has_its_own_angle_of_attack() {
    let wing = wing();
    for degrees in [-90, -60, -5, 0, 5, 60, 90] {
        let alpha = f64::from(degrees).to_radians();
        for side in wing.angle_of_attack(&gliding(7.0, alpha)) {
            assert!((side - alpha).abs() < 2e-9, "{degrees} deg gives {side} rad");
        }
    }
    let [left, right] = wing.angle_of_attack(&air(Vector3::x() * 7.0, Vector3::x()));
    assert!((right - (0.09f64 / 7.0).atan()).abs() < 2e-9 && left == -right, "{left} {right}");
    assert_eq!(wing.angle_of_attack(&air(Vector3::z() * 0.2, Vector3::zeros())), [0.0; 2]);
}
