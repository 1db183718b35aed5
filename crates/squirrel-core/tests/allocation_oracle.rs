//! The weighted allocation against Clarabel on the same quadratic programme in f64.
//!
//! An interior-point method stops short of the corner, and along what only the change of thrusts chooses the cost is flat. So
//! Clarabel's answer is polished: rotors that it leaves at a limit are held there, the others solved for directly, and the conditions of
//! Karush, Kuhn and Tucker are checked. The programme is strictly convex: what meets them is its only answer.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod airframe;
/// What the emulated M7 is asked.
#[allow(unreachable_pub, reason = "public where it is at home")]
#[path = "../../../firmware/m7/src/draws.rs"]
mod draws;

use airframe::{PAPER_SIGNS, PAPER_X, vehicle};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SupportedConeT};
use squirrel_core::control::allocation::{Allocation, AllocationTerms, STEPS_MAX, Weights};
use squirrel_core::control::mixer::{Mixer, ThrustTorque};
use squirrel_core::nalgebra::{SMatrix, SVector, Vector3, Vector4};
use squirrel_core::vehicle::{MAX_ROTORS, PerRotor, Vehicle};

/// A small deterministic generator, so that the demands are the same on every machine.
struct Draw(u64);
impl Draw {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
    fn below(&mut self, n: usize) -> usize {
        (self.unit() * n as f64) as usize
    }
    /// Mostly four rotors; every third layout is the paper's, the others irregular, and some with one rotor above another.
    fn airframe(&mut self) -> Vehicle<f32> {
        let count = [4, 4, 4, 6, 8][self.below(5)];
        if count == 4 && self.below(3) == 0 {
            return vehicle(&PAPER_X, &PAPER_SIGNS);
        }
        let is_stacked = count == 8 && self.below(3) == 0;
        let scatter = if self.below(3) == 0 { 0.0 } else { 0.3 };
        let (mut positions, mut signs) = (Vec::new(), Vec::new());
        for i in 0..count {
            let place = if is_stacked { i / 2 } else { i };
            let around = if is_stacked { 4.0 } else { count as f64 };
            let angle =
                core::f64::consts::TAU * (place as f64 + scatter * self.within(-1.0, 1.0)) / around + 0.3;
            let arm = 0.15 * (1.0 + scatter * self.within(-1.0, 1.0));
            positions.push([arm * angle.cos(), arm * angle.sin()]);
            signs.push(if (i + place * usize::from(is_stacked)) % 2 == 0 { 1.0 } else { -1.0 });
        }
        vehicle(&positions, &signs)
    }
    /// In the unit of the airframe: `reach` 1 is about what it can give, 0 a hover with small torques.
    fn demand(&mut self, rotors: usize, reach: f64) -> ThrustTorque {
        let total = rotors as f64 * 5.4;
        let torque = [0.06, 0.06, 0.008]
            .map(|arm| (total * arm * if reach > 0.0 { reach } else { 0.1 } * self.within(-1.0, 1.0)) as f32);
        let thrust = total * if reach > 0.0 { self.within(0.0, reach) } else { self.within(0.3, 0.6) };
        ThrustTorque { thrust_n: thrust as f32, torque_n_m: Vector3::from(torque) }
    }
    fn thrusts(&mut self) -> PerRotor<f32> {
        [(); MAX_ROTORS].map(|()| self.within(0.0, 5.4) as f32)
    }
    /// All rotors well, or some weak or out.
    fn limits(&mut self) -> PerRotor<f32> {
        let well = self.below(2) == 0;
        [(); MAX_ROTORS].map(|()| match (well, self.below(6)) {
            (false, 0) => 0.0,
            (false, 1 | 2) => self.within(0.0, 5.4) as f32,
            _ => 5.4,
        })
    }
}

type Thrusts = SVector<f64, MAX_ROTORS>;

/// The programme, from the numbers of the vehicle file. Places without a rotor have a limit of 0.
struct Programme {
    rows: SMatrix<f64, 4, MAX_ROTORS>,
    weights: Vector4<f64>,
    want: Vector4<f64>,
    before: Thrusts,
    most: Thrusts,
    change: f64,
}

impl Programme {
    fn new(
        v: &Vehicle<f32>,
        w: &Weights,
        demand: &ThrustTorque,
        before: &PerRotor<f32>,
        most: &PerRotor<f32>,
    ) -> Self {
        let (n, p) = (v.rotors().len(), &v.parameters().propulsion);
        let twist = p.torque_coefficient_n_m_s2 / p.thrust_coefficient_n_s2;
        let mut rows = SMatrix::<f64, 4, MAX_ROTORS>::zeros();
        for (i, rotor) in v.rotors().iter().enumerate() {
            let r = rotor.position.vector;
            rows.set_column(i, &Vector4::new(1.0, -r.y, r.x, rotor.yaw_sign * twist).map(f64::from));
        }
        let arms = rows.map(f64::abs).column_sum() / n as f64;
        let weights = Vector4::new(w.thrust, w.roll_pitch, w.roll_pitch, w.yaw).map(f64::from);
        let torque = demand.torque_n_m;
        let own = |x: &PerRotor<f32>| {
            Thrusts::from_fn(
                |i, _| {
                    if i < n { f64::from(x[i].clamp(0.0, v.rotor_thrust_max_n())) } else { 0.0 }
                },
            )
        };
        Self {
            weights: weights.component_div(&arms.component_mul(&arms)),
            rows,
            want: Vector4::new(demand.thrust_n, torque.x, torque.y, torque.z).map(f64::from),
            before: own(before),
            most: own(most),
            change: f64::from(w.change),
        }
    }
    fn curvature(&self) -> SMatrix<f64, MAX_ROTORS, MAX_ROTORS> {
        self.rows.transpose() * SMatrix::from_diagonal(&self.weights) * self.rows
            + SMatrix::identity() * self.change
    }
    fn slope(&self, x: &Thrusts) -> Thrusts {
        let missed = (self.rows * x - self.want).component_mul(&self.weights);
        self.rows.transpose() * missed + (x - self.before) * self.change
    }
    fn cost(&self, x: &Thrusts) -> f64 {
        let missed = self.rows * x - self.want;
        missed.component_mul(&missed).dot(&self.weights) + self.change * (x - self.before).norm_squared()
    }
    /// By how much the conditions of the optimum are missed, over the size of the slopes' terms.
    fn kkt(&self, x: &Thrusts) -> f64 {
        let slope = self.slope(x);
        let most = self.rows.map(f64::abs) * Thrusts::repeat(5.4) + self.want.map(f64::abs);
        let size = self.rows.transpose().map(f64::abs) * most.component_mul(&self.weights);
        let wrong = (0..MAX_ROTORS).map(|i| {
            let wrong = match (x[i] <= 0.0, x[i] >= self.most[i]) {
                (true, true) => 0.0,
                (true, false) => -slope[i],
                (false, true) => slope[i],
                (false, false) => slope[i].abs(),
            };
            wrong / (size[i] + self.change)
        });
        wrong.fold(0.0, f64::max)
    }

    /// Thrusts, and how much each limit pulls (low, high) over how far it is: beyond 1 the rotor is held there.
    fn by_clarabel(&self, scale: f64) -> (Thrusts, [Thrusts; 2]) {
        let able: Vec<usize> = (0..MAX_ROTORS).filter(|i| self.most[*i] > 0.0).collect();
        let n = able.len();
        if n == 0 {
            return (Thrusts::zeros(), [Thrusts::zeros(); 2]);
        }
        // What is missed has variables of its own: no product of rows, which would square how far the weights are apart.
        let variables = n + 4;
        let root = self.weights.map(f64::sqrt);
        let p: Vec<Vec<f64>> = (0..variables)
            .map(|a| {
                (0..variables)
                    .map(|b| {
                        if a != b {
                            0.0
                        } else if a < n {
                            self.change * scale
                        } else {
                            1e-2 * scale
                        }
                    })
                    .collect()
            })
            .collect();
        let q: Vec<f64> = (0..variables)
            .map(|a| if a < n { -self.change * scale * self.before[able[a]] } else { 0.0 })
            .collect();
        let (mut rows, mut limits) = (Vec::new(), Vec::new());
        for k in 0..4 {
            let own = |b: usize| {
                if b < n {
                    10.0 * root[k] * self.rows[(k, able[b])]
                } else {
                    -f64::from(u8::from(b == n + k))
                }
            };
            rows.push((0..variables).map(own).collect::<Vec<f64>>());
            limits.push(10.0 * root[k] * self.want[k]);
        }
        for sign in [1.0, -1.0] {
            for a in 0..n {
                rows.push((0..variables).map(|b| if a == b { sign } else { 0.0 }).collect::<Vec<f64>>());
                limits.push(if sign > 0.0 { self.most[able[a]] } else { 0.0 });
            }
        }
        let settings = DefaultSettings {
            verbose: false,
            tol_gap_abs: 1e-14,
            tol_gap_rel: 1e-14,
            tol_feas: 1e-12,
            max_iter: 200,
            static_regularization_constant: 1e-12,
            iterative_refinement_reltol: 1e-15,
            iterative_refinement_abstol: 1e-15,
            ..Default::default()
        };
        let cones = [SupportedConeT::ZeroConeT(4), SupportedConeT::NonnegativeConeT(2 * n)];
        let (p, rows) = (CscMatrix::from(&p), CscMatrix::from(&rows));
        let mut solver = DefaultSolver::new(&p, &q, &rows, &limits, &cones, settings).unwrap();
        solver.solve();
        let (mut x, mut held) = (Thrusts::zeros(), [Thrusts::zeros(); 2]);
        let (pull, room) = (&solver.solution.z, &solver.solution.s);
        for (a, i) in able.iter().enumerate() {
            x[*i] = solver.solution.x[a];
            held[0][*i] = pull[4 + n + a] / room[4 + n + a].max(1e-300);
            held[1][*i] = pull[4 + a] / room[4 + a].max(1e-300);
        }
        (x, held)
    }

    /// Clarabel's answer made exact, and Clarabel's own. Which rotors are at a limit is not always plain: sets within doubt are tried.
    fn optimum(&self) -> (Thrusts, Thrusts) {
        let mut best = (f64::INFINITY, Thrusts::zeros(), Thrusts::zeros());
        // Costs are between 1e-4 and 1e7: one scale does not suit all.
        for scale in [1.0 / self.change, 1.0, 1e2, 1e-2, 1e-4, 1e-5, 1e-6, 1e-3] {
            let (raw, held) = self.by_clarabel(scale);
            for doubt in [1.0, 1e-2, 1e2, 1e-4, 1e4, 1e-6, 1e6] {
                let (x, wrong) = self.polished(&raw, &held.map(|h| h.map(|h| h > doubt)));
                if wrong < best.0 {
                    best = (wrong, x, raw);
                }
            }
            if best.0 < 1e-14 {
                return (best.1, best.2);
            }
        }
        panic!("the oracle itself is not at the optimum: {:e}", best.0);
    }

    /// With these rotors held at a limit (low, high), and how far that is from the optimum.
    fn polished(&self, raw: &Thrusts, held: &[SVector<bool, MAX_ROTORS>; 2]) -> (Thrusts, f64) {
        let (mut x, mut part, mut free) = (*raw, self.curvature(), Thrusts::zeros());
        for i in 0..MAX_ROTORS {
            if held[0][i] || held[1][i] || self.most[i] == 0.0 {
                x[i] = if held[1][i] { self.most[i] } else { 0.0 };
                part.row_mut(i).fill(0.0);
                part.column_mut(i).fill(0.0);
                part[(i, i)] = 1.0;
            } else {
                free[i] = 1.0;
            }
        }
        let Some(factor) = part.cholesky() else { return (x, f64::INFINITY) };
        // Again and again takes off what rounding left.
        for _ in 0..3 {
            x -= factor.solve(&self.slope(&x).component_mul(&free)).component_mul(&free);
        }
        let is_inside = (0..MAX_ROTORS).all(|i| x[i] >= 0.0 && x[i] <= self.most[i]);
        (x, if is_inside { self.kkt(&x) } else { f64::INFINITY })
    }
}

fn thrusts(answer: &AllocationTerms, n: usize) -> Thrusts {
    Thrusts::from_fn(|i, _| if i < n { f64::from(answer.rotor_thrust_n[i]) } else { 0.0 })
}

#[test]
fn ten_thousand_answers_are_clarabel_s() {
    let (mut draw, weights) = (Draw(1), Weights::default());
    let (mut off, mut dearer, mut steps, mut held, mut alone) = (0.0_f64, 0.0_f64, 0, 0, 0);
    for case in 0..10_000 {
        let v = draw.airframe();
        let n = v.rotors().len();
        let allocation = Allocation::new(&v, &weights).unwrap();
        let demand = draw.demand(n, [0.0, 0.0, 0.3, 1.0, 3.0][case % 5]);
        let (before, most) = (draw.thrusts(), draw.limits());
        let answer = allocation.allocate(&demand, &before, &most);
        assert!(answer.optimal);
        let programme = Programme::new(&v, &weights, &demand, &before, &most);
        let (expected, raw) = programme.optimum();
        let got = thrusts(&answer, n);
        let gap = (got - expected).amax() / 5.4;
        assert!(gap < 1e-5, "case {case}: {got} for {expected}, {gap:e}");
        // Half a unit in the last place of every thrust, which is an f32, is no fault of the search.
        let rounding = programme.curvature().abs().sum() * (5.4 * 6e-8_f64).powi(2);
        let more = (programme.cost(&got) - programme.cost(&expected) - rounding) / programme.cost(&expected);
        assert!(more < 1e-5, "case {case}: dearer by {more:e}");
        (off, dearer, steps) = (off.max(gap), dearer.max(more), steps.max(answer.steps));
        held += usize::from(answer.steps > 0);
        alone += usize::from((raw - expected).amax() / 5.4 < 1e-5);
    }
    println!(
        "10 000 demands, {held} at limits: thrusts within {off:.1e} of the largest, cost within {dearer:.1e} and the rounding of thrusts, \
         at most {steps} steps; Clarabel without polishing is as near in {alone}"
    );
    assert!((5000..8000).contains(&held), "{held} demands are at limits");
}

/// No oracle, a hundred times as many, for any weights: the set of rotors at their limits is that of the optimum, as the conditions of
/// Karush, Kuhn and Tucker say once the others are solved for without the rounding of an f32.
#[test]
fn a_million_answers_meet_the_conditions_of_the_optimum() {
    let mut draw = Draw(2);
    let (mut worst, mut off, mut steps) = (0.0_f64, 0.0_f64, [0; MAX_ROTORS + 1]);
    for case in 0..10_000 {
        let v = draw.airframe();
        let n = v.rotors().len();
        let mut weights = Weights::default();
        if case % 2 == 1 {
            let mut any = || 10.0_f64.powf(draw.within(-2.0, 4.0)) as f32;
            weights = Weights { roll_pitch: any(), thrust: any(), yaw: any(), change: any() * 1e-2 };
        }
        let allocation = Allocation::new(&v, &weights).unwrap();
        for part in 0..100 {
            let demand = draw.demand(n, [0.0, 0.3, 1.0, 3.0][part % 4]);
            let (before, most) = (draw.thrusts(), draw.limits());
            let answer = allocation.allocate(&demand, &before, &most);
            assert!(answer.optimal && answer.steps <= STEPS_MAX / 5, "{answer:?} for {demand:?}");
            let programme = Programme::new(&v, &weights, &demand, &before, &most);
            let got = thrusts(&answer, n);
            let held = [got.map(|f| f <= 0.0), got.zip_map(&programme.most, |f, most| f >= most)];
            let (exact, wrong) = programme.polished(&got, &held);
            (worst, off) = (worst.max(wrong), off.max((got - exact).amax() / 5.4));
            steps[n] = steps[n].max(answer.steps);
        }
    }
    println!(
        "conditions within {worst:.1e} of their terms, thrusts within {off:.1e} of the largest, steps by rotors: {steps:?}"
    );
    assert!(worst < 1e-14 && off < 1e-6, "{worst:e} {off:e}");
}

#[test]
fn within_the_limits_it_is_the_mixer_s_answer() {
    let v = vehicle(&PAPER_X, &PAPER_SIGNS);
    let allocation = Allocation::new(&v, &Weights::default()).unwrap();
    let mixer = Mixer::new(&v).unwrap();
    let (mut draw, mut compared) = (Draw(3), 0);
    for _ in 0..1000 {
        let demand = draw.demand(4, 0.0);
        let mixed = mixer.allocate(&demand);
        if mixed.saturated {
            continue;
        }
        compared += 1;
        let answer = allocation.allocate(&demand, &mixed.rotor_thrust_n, &[5.4; MAX_ROTORS]);
        assert_eq!(answer.steps, 0);
        for (a, m) in answer.rotor_thrust_n.iter().zip(&mixed.rotor_thrust_n) {
            assert!((a - m).abs() < 2e-6, "{answer:?} for {mixed:?}");
        }
        // Far from the thrusts before, the weight of the change over that of yaw is what is not met.
        let answer = allocation.allocate(&demand, &[0.0; MAX_ROTORS], &[5.4; MAX_ROTORS]);
        for (a, m) in answer.rotor_thrust_n.iter().zip(&mixed.rotor_thrust_n) {
            assert!((a - m).abs() < 1e-4, "{answer:?} for {mixed:?}");
        }
    }
    assert!(compared > 800, "only {compared} demands are within the limits");
}

/// One rotor is out: the mixer would ask it for thrust. Roll and pitch are met by the others, yaw pays.
#[test]
fn without_a_rotor_roll_and_pitch_are_met() {
    let v = vehicle(&PAPER_X, &PAPER_SIGNS);
    let allocation = Allocation::new(&v, &Weights::default()).unwrap();
    for out in 0..4 {
        let mut most = [5.4; MAX_ROTORS];
        most[out] = 0.0;
        // Hover with a torque away from that rotor, which the opposite one alone can give.
        let [x, y] = PAPER_X[out].map(|x| x as f32);
        let demand = ThrustTorque { thrust_n: 5.4, torque_n_m: Vector3::new(0.2 * y, -0.2 * x, 0.0) };
        let answer = allocation.allocate(&demand, &[1.35; MAX_ROTORS], &most);
        assert_eq!(answer.rotor_thrust_n[out], 0.0);
        let missed = (answer.achieved.torque_n_m - demand.torque_n_m).xy().norm();
        assert!(missed < 2e-3 && (answer.achieved.thrust_n - 5.4).abs() < 0.1, "rotor {out}: {answer:?}");
        let mixed = Mixer::new(&v).unwrap().allocate(&demand).rotor_thrust_n;
        let lost = (mixed[out] * 0.085, missed);
        assert!(
            lost.0 > 10.0 * lost.1,
            "what the mixer loses with that rotor, and what is missed here: {lost:?}"
        );
    }
}

#[test]
fn nothing_comes_in_nothing_bad_goes_out() {
    let mut draw = Draw(4);
    let zero = ThrustTorque { thrust_n: 0.0, torque_n_m: Vector3::zeros() };
    for case in 0..10_000 {
        let v = draw.airframe();
        let allocation = Allocation::new(&v, &Weights::default()).unwrap();
        for _ in 0..100 {
            let mut wild = || match draw.below(8) {
                0 => f32::NAN,
                1 => f32::INFINITY,
                2 => -f32::MAX,
                3 => f32::MAX,
                4 => draw.within(-1e-30, 1e-30) as f32,
                _ => draw.within(-50.0, 50.0) as f32,
            };
            let demand = ThrustTorque { thrust_n: wild(), torque_n_m: Vector3::new(wild(), wild(), wild()) };
            let (before, most) = ([(); MAX_ROTORS].map(|()| wild()), [(); MAX_ROTORS].map(|()| wild()));
            let answer = allocation.allocate(&demand, &before, &most);
            for (i, (f, most)) in answer.rotor_thrust_n.iter().zip(&most).enumerate() {
                let top =
                    if i < v.rotors().len() && most.is_finite() { most.clamp(0.0, 5.4001) } else { 0.0 };
                assert!((0.0..=top).contains(f), "case {case}: {f} of {top} for {demand:?}, {answer:?}");
            }
            assert!(answer.optimal && answer.steps <= STEPS_MAX / 5, "{answer:?} for {demand:?}");
        }
        let nothing = ThrustTorque { thrust_n: f32::NAN, torque_n_m: Vector3::repeat(f32::NEG_INFINITY) };
        let (before, most) = (draw.thrusts(), draw.limits());
        assert_eq!(allocation.allocate(&nothing, &before, &most), allocation.allocate(&zero, &before, &most));
    }
}

/// `cargo xtask firmware` asks the same of the M7.
#[test]
fn the_hash_that_the_m7_must_have_is_this_one() {
    let (mut hash, mut steps) = (draws::HASH_START, [(0, 0); 4]);
    for (kind, (sum, worst)) in draws::KINDS.into_iter().zip(&mut steps) {
        let mut of_kind = draws::Draws::new(kind);
        let allocation = of_kind.allocation().unwrap();
        for _ in 0..draws::EACH {
            let answer = of_kind.case().allocate(&allocation);
            assert!(answer.optimal && (kind != draws::Kind::Within || answer.steps == 0));
            hash = draws::hash(hash, &answer);
            (*sum, *worst) = (*sum + answer.steps, answer.steps.max(*worst));
        }
    }
    println!("steps of {} demands of each kind, all and most: {steps:?}", draws::EACH);
    assert_eq!(hash, draws::EXPECTED, "{hash:#x}");
}

#[test]
fn weights_and_layouts_that_mean_nothing_are_refused_by_name() {
    let paper = vehicle(&PAPER_X, &PAPER_SIGNS);
    let sound = Weights::default();
    for (weights, name) in [
        (Weights { roll_pitch: -1.0, ..sound }, "allocation.roll_pitch = -1"),
        (Weights { thrust: f32::NAN, ..sound }, "allocation.thrust = NaN"),
        (Weights { yaw: f32::INFINITY, ..sound }, "allocation.yaw = inf"),
        (Weights { change: 0.0, ..sound }, "allocation.change = 0"),
        (Weights { change: 1e-6, ..sound }, "allocation.change = 0.00000"),
    ] {
        let error = Allocation::new(&paper, &weights).unwrap_err().to_string();
        assert!(error.starts_with(name), "{error}");
    }
    let line = [[0.1, 0.0], [0.2, 0.0], [-0.1, 0.0], [-0.2, 0.0]];
    let error = Allocation::new(&vehicle(&line, &PAPER_SIGNS), &sound).unwrap_err().to_string();
    assert!(error.starts_with("rotor[1]"), "{error}");
}
