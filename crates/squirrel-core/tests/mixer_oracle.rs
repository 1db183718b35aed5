//! The mixer's answers against an interior-point solver (Clarabel) that solves the stated problem
//! step by step.
//!
//! Lexicographic: the largest share of roll and pitch, then the nearest thrust, then the nearest
//! yaw torque, over all rotor thrusts of a quadrotor within their limits.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod airframe;

use airframe::{PAPER_SIGNS, PAPER_X, vehicle};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};
use squirrel_core::control::mixer::{Mixer, ThrustTorque};
use squirrel_core::nalgebra::Vector3;

/// A small deterministic generator, so that the thousand demands are the same on every machine.
struct Draw(u64);
impl Draw {
    fn unit(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
}

/// Minimises `1/2 x' diag(p) x + q' x` subject to `a x = b` and `g x <= h`; panics unless solved.
fn solve(p: &[f64], q: &[f64], a: &[(Vec<f64>, f64)], g: &[(Vec<f64>, f64)]) -> Vec<f64> {
    let n = q.len();
    let rows: Vec<&(Vec<f64>, f64)> = a.iter().chain(g).collect();
    let matrix = CscMatrix::from(&rows.iter().map(|(row, _)| row.clone()).collect::<Vec<_>>());
    let bounds: Vec<f64> = rows.iter().map(|(_, b)| *b).collect();
    let diagonal: Vec<Vec<f64>> =
        (0..n).map(|i| (0..n).map(|j| if i == j { p[i] } else { 0.0 }).collect()).collect();
    let cones = [SupportedConeT::ZeroConeT(a.len()), SupportedConeT::NonnegativeConeT(g.len())];
    let settings = DefaultSettings {
        verbose: false,
        tol_gap_abs: 1e-11,
        tol_gap_rel: 1e-11,
        tol_feas: 1e-11,
        ..Default::default()
    };
    let mut solver =
        DefaultSolver::new(&CscMatrix::from(&diagonal), q, &matrix, &bounds, &cones, settings)
            .unwrap();
    solver.solve();
    assert!(
        matches!(solver.solution.status, SolverStatus::Solved | SolverStatus::AlmostSolved),
        "{:?}",
        solver.solution.status
    );
    solver.solution.x.clone()
}

/// Rotor thrusts of the lexicographic optimum; variables are four thrusts and the share.
fn oracle(t: &[[f64; 4]; 4], thrust_max: f64, demand: &ThrustTorque) -> Vec<f64> {
    let want = [demand.thrust_n, demand.torque_n_m.x, demand.torque_n_m.y, demand.torque_n_m.z]
        .map(f64::from);
    let row = |k: usize, share: f64| t[k].iter().copied().chain([share]).collect::<Vec<f64>>();
    let unit =
        |i: usize, sign: f64| (0..5).map(|j| if i == j { sign } else { 0.0 }).collect::<Vec<f64>>();
    // Torque rows are scaled to newtons, so that all constraints are of one size.
    let scale = 10.0;
    let scaled =
        |k: usize, share: f64| row(k, share).into_iter().map(|x| x * scale).collect::<Vec<f64>>();
    let equal = vec![(scaled(1, -want[1]), 0.0), (scaled(2, -want[2]), 0.0)];
    let mut bounds = vec![(unit(4, 1.0), 1.0), (unit(4, -1.0), 0.0)];
    for i in 0..4 {
        bounds.push((unit(i, 1.0), thrust_max));
        bounds.push((unit(i, -1.0), 0.0));
    }
    let share = solve(&[0.0; 5], &[0.0, 0.0, 0.0, 0.0, -1.0], &equal, &bounds)[4].min(1.0);
    // A hair of slack keeps the later problems strictly feasible.
    bounds[1] = (unit(4, -1.0), -(share - 1e-8).max(0.0));
    // |thrust - demand| through an extra variable would do; a square does too, and keeps the size.
    let nearest = |k: usize, goal: f64, equal: &[(Vec<f64>, f64)], bounds: &[(Vec<f64>, f64)]| {
        let lift = |r: &[(Vec<f64>, f64)]| {
            r.iter()
                .map(|(v, b)| (v.iter().copied().chain([0.0]).collect(), *b))
                .collect::<Vec<(Vec<f64>, f64)>>()
        };
        let mut a = lift(equal);
        let s = if k == 0 { 1.0 } else { 100.0 };
        let mut definition: Vec<f64> = row(k, 0.0).into_iter().map(|x| x * s).collect();
        definition.push(-1.0);
        a.push((definition, goal * s));
        solve(&[0.0, 0.0, 0.0, 0.0, 0.0, 1.0], &[0.0; 6], &a, &lift(bounds))
    };
    let x = nearest(0, want[0], &equal, &bounds);
    let thrust: f64 = x[..4].iter().sum();
    bounds.push((row(0, 0.0), thrust + 1e-8));
    bounds.push((row(0, 0.0).iter().map(|v| -v).collect(), -(thrust - 1e-8)));
    let x = nearest(3, want[3], &equal, &bounds);
    x[..4].to_vec()
}

#[test]
fn saturated_answers_match_the_oracle_on_a_thousand_random_demands() {
    let mut draw = Draw(1);
    let mut saturated = 0;
    for n in 0..1000 {
        // Every fourth layout is irregular: no symmetry to lean on.
        let mut positions = PAPER_X;
        if n % 4 == 3 {
            for p in &mut positions {
                p[0] *= draw.within(0.7, 1.3);
                p[1] *= draw.within(0.7, 1.3);
            }
        }
        let vehicle = vehicle(&positions, &PAPER_SIGNS);
        let mixer = Mixer::new(&vehicle).unwrap();
        let demand = ThrustTorque {
            thrust_n: draw.within(0.0, 24.0) as f32,
            torque_n_m: Vector3::new(
                draw.within(-1.0, 1.0),
                draw.within(-1.0, 1.0),
                draw.within(-0.2, 0.2),
            )
            .map(|x| x as f32),
        };
        let answer = mixer.allocate(&demand);
        saturated += usize::from(answer.saturated);
        let mut t = [[0.0; 4]; 4];
        for (i, rotor) in vehicle.rotors().iter().enumerate() {
            let r = rotor.position.vector;
            t[0][i] = 1.0;
            t[1][i] = f64::from(-r.y);
            t[2][i] = f64::from(r.x);
            t[3][i] = f64::from(rotor.yaw_sign) * 0.011;
        }
        let expected = oracle(&t, 5.4, &demand);
        for i in 0..4 {
            let gap = (f64::from(answer.rotor_thrust_n[i]) - expected[i]).abs();
            assert!(
                gap < 2e-3,
                "case {n}, rotor {i}: {answer:?} for {expected:?}, demand {demand:?}"
            );
        }
    }
    assert!(saturated > 500, "only {saturated} demands saturate");
}

/// With more rotors than axes the mixer stays on `T^+`: thrusts `s a + u b + y c`. Its share is the
/// largest there.
#[test]
fn the_share_of_six_and_eight_rotors_is_the_largest() {
    let mut draw = Draw(4);
    let mut limited = 0;
    for n in 0..400 {
        let count = 6 + 2 * (n % 2);
        let (mut positions, mut signs) = (Vec::new(), Vec::new());
        for i in 0..count {
            let angle = core::f64::consts::TAU * (f64::from(i) + draw.within(-0.1, 0.1))
                / f64::from(count)
                + 0.3;
            let arm = draw.within(0.12, 0.2);
            positions.push([arm * angle.cos(), arm * angle.sin()]);
            signs.push(if i % 2 == 0 { 1.0 } else { -1.0 });
        }
        let Ok(mixer) = Mixer::new(&vehicle(&positions, &signs)) else { continue };
        let thrusts = |u: f32, torque: [f32; 3]| {
            let answer =
                mixer.allocate(&ThrustTorque { thrust_n: u, torque_n_m: Vector3::from(torque) });
            assert!(!answer.saturated);
            answer.rotor_thrust_n.map(f64::from)
        };
        // The columns of `T^+`, from small demands around a hover.
        let hover = thrusts(15.0, [0.0; 3]);
        let column = |torque: [f32; 3]| {
            let f = thrusts(15.0, torque);
            (0..8).map(|i| (f[i] - hover[i]) / 0.01).collect::<Vec<f64>>()
        };
        let (roll, pitch, yaw) =
            (column([0.01, 0.0, 0.0]), column([0.0, 0.01, 0.0]), column([0.0, 0.0, 0.01]));
        let torque = [draw.within(-3.0, 3.0), draw.within(-3.0, 3.0), draw.within(-0.1, 0.1)];
        let mut bounds = vec![(vec![1.0, 0.0, 0.0], 1.0), (vec![-1.0, 0.0, 0.0], 0.0)];
        for i in 0..usize::try_from(count).unwrap() {
            let row =
                vec![roll[i] * torque[0] + pitch[i] * torque[1], hover[i] / 15.0, 0.1 * yaw[i]];
            bounds.push((row.iter().map(|x| -x).collect(), 0.0));
            bounds.push((row, f64::from(mixer.rotor_thrust_max_n())));
        }
        let largest = solve(&[0.0; 3], &[-1.0, 0.0, 0.0], &[], &bounds)[0];
        let demand = ThrustTorque {
            thrust_n: draw.within(5.0, 40.0) as f32,
            torque_n_m: Vector3::from(torque.map(|x| x as f32)),
        };
        let answer = mixer.allocate(&demand);
        limited += usize::from(answer.roll_pitch_share < 1.0);
        let gap = (f64::from(answer.roll_pitch_share) - largest).abs();
        assert!(gap < 2e-3, "case {n}: {} for {largest}", answer.roll_pitch_share);
        // And no rotor has to be cut for it.
        let reached = f64::from(answer.achieved.torque_n_m.x) - largest * torque[0];
        assert!(reached.abs() < 5e-3, "case {n}: {answer:?} for {torque:?}");
    }
    assert!(limited > 150, "only {limited} demands are beyond the limits");
}

#[test]
fn round_trip_for_random_layouts() {
    let mut draw = Draw(2);
    let mut compared = 0;
    for n in 0..500 {
        let count = 4 + 2 * (n % 3);
        let mut positions = Vec::new();
        let mut signs = Vec::new();
        for i in 0..count {
            let angle = core::f64::consts::TAU * (f64::from(i) + draw.within(-0.2, 0.2))
                / f64::from(count)
                + 0.3;
            let arm = draw.within(0.08, 0.2);
            positions.push([arm * angle.cos(), arm * angle.sin()]);
            signs.push(if i % 2 == 0 { 1.0 } else { -1.0 });
        }
        // Some draws carry a rotor that would hang in hover: construction names it.
        let Ok(mixer) = Mixer::new(&vehicle(&positions, &signs)) else { continue };
        let demand = ThrustTorque {
            thrust_n: draw.within(8.0, 14.0) as f32,
            torque_n_m: Vector3::new(
                draw.within(-0.1, 0.1),
                draw.within(-0.1, 0.1),
                draw.within(-0.005, 0.005),
            )
            .map(|x| x as f32),
        };
        let answer = mixer.allocate(&demand);
        if answer.saturated {
            continue;
        }
        compared += 1;
        assert!((answer.achieved.thrust_n - demand.thrust_n).abs() < 1e-4);
        assert!((answer.achieved.torque_n_m - demand.torque_n_m).norm() < 1e-5, "{answer:?}");
    }
    assert!(compared > 300, "only {compared} of 500 layouts can fly this demand unsaturated");
}

/// docs/equations.md T2 on the printed matrix: rotor 1 front-left, 2 back-left, 3 back-right, 4
/// front-right.
#[test]
fn torque_signs_are_the_paper_s() {
    let mixer = Mixer::new(&vehicle(&PAPER_X, &PAPER_SIGNS)).unwrap();
    let rotors = |x: f32, y: f32, z: f32| {
        let f = mixer
            .allocate(&ThrustTorque { thrust_n: 6.0, torque_n_m: Vector3::new(x, y, z) })
            .rotor_thrust_n;
        [f[0] > 1.5, f[1] > 1.5, f[2] > 1.5, f[3] > 1.5]
    };
    assert_eq!(rotors(0.05, 0.0, 0.0), [true, true, false, false], "roll right: left rotors");
    assert_eq!(rotors(0.0, 0.05, 0.0), [true, false, false, true], "pitch up: front rotors");
    assert_eq!(
        rotors(0.0, 0.0, 0.005),
        [false, true, false, true],
        "yaw right: counter-clockwise rotors"
    );
}

#[test]
fn layouts_that_cannot_fly_are_refused_by_name() {
    let line = [[0.1, 0.0], [0.2, 0.0], [-0.1, 0.0], [-0.2, 0.0]];
    let error = Mixer::new(&vehicle(&line, &PAPER_SIGNS)).unwrap_err().to_string();
    assert!(error.starts_with("rotor"), "{error}");
}

#[test]
fn nothing_comes_in_nothing_bad_goes_out() {
    let mixer = Mixer::new(&vehicle(&PAPER_X, &PAPER_SIGNS)).unwrap();
    let mut draw = Draw(3);
    for _ in 0..1000 {
        let mut wild = || match (draw.unit() * 6.0) as u8 {
            0 => f32::NAN,
            1 => f32::INFINITY,
            2 => -f32::MAX,
            _ => draw.within(-50.0, 50.0) as f32,
        };
        let demand =
            ThrustTorque { thrust_n: wild(), torque_n_m: Vector3::new(wild(), wild(), wild()) };
        for f in &mixer.allocate(&demand).rotor_thrust_n[..4] {
            assert!((0.0..=5.4 + 1e-4).contains(f), "{f} for {demand:?}");
        }
    }
}
