//! One convex problem of the successive convexification, for Clarabel.
//!
//! The model is linear about an iterate; obstacles are half-spaces that touch them where the
//! iterate is nearest, so that whoever stays in the half-space stays out of the obstacle.
//! Constraints that may have no solution have a slack that costs more than anything else.
//!
//! ```text
//! min  sum_k |p - p_ref|_P^2 + |v - v_ref|_V^2 + r |T+ - T|^2 + c |w+ - w| + d w + mu s + nu f
//! a = a_bar + A (v - v_bar) + B (T - T_bar) + C (w - w_bar)        v+, p+ as in `model`
//! |T| + r <= T_max     r >= c |T+ - 2 T + T-|_xy / h^2     T_z >= T_min     |T_x| <= tan(tilt) T_z     |T_y| <= tan(tilt) (T_x, T_z).e     |T+ - T| <= rates     |T - T_bar| <= trust
//! 0 <= w <= 1      |w+ - w| <= rate      d.(p - centre) + s >= radius      |v_xy| <= v_max + f
//! ```
//! The roll limit `|T_y| <= tan(tilt) |(T_x, T_z)|` is not convex; its tangent at the iterate lies
//! inside of it (docs/equations.md F).

use super::model::{Craft, Motion};
use super::task::Task;
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};
use nalgebra::{Vector2, Vector3};

/// What counts how much.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights {
    /// Of a distance to the reference, horizontal and vertical, 1/m^2.
    pub position_per_m2: [f64; 2],
    /// Of a difference to its velocity, s^2/m^2.
    pub velocity_s2_per_m2: f64,
    /// Of the last node over the others.
    pub last: f64,
    /// Of changes of the thrust from node to node, 1/N^2.
    pub thrust_change_per_n2: f64,
    /// Of folding or spreading once.
    pub wing_move: f64,
    /// Of spread wings at a node: they fold where they hardly help.
    pub wing_spread: f64,
    /// Of the depth in an obstacle, 1/m: more than any reference is worth that leads away from
    /// where there is a way, such as one that turned back.
    pub violation_per_m: f64,
    /// Of being too fast, s/m.
    pub overspeed_s_per_m: f64,
}

impl Weights {
    /// What a way costs: without violations, and with what they cost.
    pub(super) fn cost(&self, task: &Task, path: &[Motion], controls: &[Control]) -> (f64, f64) {
        let (mut cost, mut violations) = (0.0, 0.0);
        for (k, (motion, wanted)) in path.iter().zip(task.wanted()).enumerate() {
            let share = if k + 1 == path.len() { self.last } else { 1.0 };
            let (off, slip) =
                (motion.position - wanted.position, motion.velocity - wanted.velocity);
            let [level, height] = self.position_per_m2;
            let place = level * off.xy().norm_squared() + height * off.z * off.z;
            cost += share * (place + self.velocity_s2_per_m2 * slip.norm_squared());
            if k > 0 {
                violations += self.violation_per_m * task.violation_m(&path[k - 1], motion)
                    + self.overspeed_s_per_m * task.overspeed_m_s(motion);
                let ((thrust, spread), (thrust_before, spread_before)) =
                    (controls[k], controls[k - 1]);
                cost += self.thrust_change_per_n2 * (thrust - thrust_before).norm_squared()
                    + self.wing_move * (spread - spread_before).abs()
                    + self.wing_spread * spread;
            }
        }
        (cost, cost + violations)
    }
}

impl Default for Weights {
    fn default() -> Self {
        Self {
            position_per_m2: [1.0, 10.0],
            velocity_s2_per_m2: 0.1,
            last: 4.0,
            thrust_change_per_n2: 0.02,
            wing_move: 0.05,
            wing_spread: 0.01,
            violation_per_m: 1000.0,
            overspeed_s_per_m: 100.0,
        }
    }
}

/// `U n`, N, and deployment at a node.
pub(super) type Control = (Vector3<f64>, f64);

/// About what the problem is linear.
#[derive(Debug, Clone)]
pub(super) struct Iterate {
    /// At each node.
    pub(super) controls: Vec<Control>,
    /// Thrust at the first node as it was planned before: how the vehicle was told to turn. What it
    /// is measured to be there lags behind.
    pub(super) told: Vector3<f64>,
    /// Where they lead.
    pub(super) path: Vec<Motion>,
    /// Where obstacles are linearised at: the path, or a guess to which side of them it shall lead.
    pub(super) sides: Vec<Vector2<f64>>,
}

/// Numbers of a node: position, velocity, acceleration, thrust, deployment, its change, depth in
/// what to stay out of, thrust given up for turning, how much too fast.
const WIDTH: usize = 17;
const P: usize = 0;
const V: usize = 3;
const A: usize = 6;
const T: usize = 9;
const W: usize = 12;
const DW: usize = 13;
const S: usize = 14;
const R: usize = 15;
const F: usize = 16;
/// Obstacles further than this from an iterate's node do not matter there, m.
const NEAR_M: f64 = 4.0;
/// How much further than its servo goes the deployment may be for a trust of 1 N, 1/N.
const SPREAD_TRUST_PER_N: f64 = 0.5;

/// Rows `a x + s = b`, `s` in a cone, in the order of their cones.
#[derive(Default)]
struct Rows {
    row: Vec<usize>,
    column: Vec<usize>,
    value: Vec<f64>,
    b: Vec<f64>,
}

impl Rows {
    fn push(&mut self, terms: &[(usize, f64)], b: f64) {
        for (column, value) in terms {
            self.row.push(self.b.len());
            self.column.push(*column);
            self.value.push(*value);
        }
        self.b.push(b);
    }
}

fn at(node: usize, what: usize) -> usize {
    node * WIDTH + what
}

/// The problem about an iterate.
pub(super) struct Subproblem<'a> {
    pub(super) craft: &'a Craft,
    pub(super) task: &'a Task,
    pub(super) weights: &'a Weights,
    pub(super) iterate: &'a Iterate,
    /// Largest change of a component of the thrust, N.
    pub(super) trust_n: f64,
    /// Wings may spread; otherwise they fold where they are not.
    pub(super) may_spread: bool,
}

impl Subproblem<'_> {
    fn nodes(&self) -> usize {
        self.iterate.path.len()
    }

    /// Nodes whose thrust is on its way already, the first among them.
    fn held(&self) -> usize {
        1 + (self.craft.delay_s / self.task.step_s()).round() as usize
    }

    /// Controls, and where the linear model takes them to lead; `None` where Clarabel finds no
    /// solution, which only numbers out of all proportion bring about.
    ///
    /// * `iterations` - grows by those of Clarabel
    pub(super) fn solve(&self, iterations: &mut u32) -> Option<(Vec<Control>, Vec<Motion>)> {
        let nodes = self.nodes();
        let (p, q) = self.cost();
        let mut rows = Rows::default();
        self.dynamics(&mut rows);
        let equalities = rows.b.len();
        self.bounds(&mut rows);
        let inequalities = rows.b.len() - equalities;
        let mut cones = vec![
            SupportedConeT::ZeroConeT(equalities),
            SupportedConeT::NonnegativeConeT(inequalities),
        ];
        self.cones(&mut rows, &mut cones);
        let size = (rows.b.len(), nodes * WIDTH);
        let a = CscMatrix::new_from_triplets(size.0, size.1, rows.row, rows.column, rows.value);
        let settings = DefaultSettings {
            verbose: false,
            presolve_enable: false,
            tol_gap_abs: 1e-6,
            tol_gap_rel: 1e-6,
            tol_feas: 1e-7,
            max_iter: 60,
            ..DefaultSettings::default()
        };
        let mut solver = DefaultSolver::new(&p, &q, &a, &rows.b, &cones, settings).ok()?;
        solver.solve();
        *iterations += solver.solution.iterations;
        let usable = matches!(
            solver.solution.status,
            SolverStatus::Solved
                | SolverStatus::AlmostSolved
                | SolverStatus::MaxIterations
                | SolverStatus::InsufficientProgress
        );
        let x = &solver.solution.x;
        if !usable || !x.iter().all(|x| x.is_finite()) {
            return None;
        }
        let control = |k: usize| {
            // What is held is held to the bit.
            let found = Vector3::from_column_slice(&x[at(k, T)..at(k, T) + 3]);
            let thrust = if k < self.held() { self.iterate.controls[k].0 } else { found };
            // A solver's zero is none.
            let spread = x[at(k, W)].clamp(0.0, 1.0);
            (thrust, if spread < 1e-6 { 0.0 } else { spread })
        };
        let motion = |k: usize| {
            let three = |what: usize| Vector3::from_column_slice(&x[at(k, what)..at(k, what) + 3]);
            Motion { position: three(P), velocity: three(V), acceleration: three(A) }
        };
        Some(((0..nodes).map(control).collect(), (0..nodes).map(motion).collect()))
    }

    fn cost(&self) -> (CscMatrix<f64>, Vec<f64>) {
        let (nodes, weights) = (self.nodes(), self.weights);
        let mut square = Rows::default();
        let mut q = vec![0.0; nodes * WIDTH];
        let mut entry = |i: usize, j: usize, value: f64| {
            square.row.push(i);
            square.column.push(j);
            square.value.push(value);
        };
        let [level, height] = weights.position_per_m2;
        for (k, wanted) in self.task.wanted().iter().enumerate() {
            let share = if k + 1 == nodes { weights.last } else { 1.0 };
            for axis in 0..3 {
                let by_position = 2.0 * share * if axis == 2 { height } else { level };
                let by_velocity = 2.0 * share * weights.velocity_s2_per_m2;
                entry(at(k, P + axis), at(k, P + axis), by_position);
                entry(at(k, V + axis), at(k, V + axis), by_velocity);
                q[at(k, P + axis)] = -by_position * wanted.position[axis];
                q[at(k, V + axis)] = -by_velocity * wanted.velocity[axis];
                let change = 2.0 * weights.thrust_change_per_n2;
                let ends = if k == 0 || k + 1 == nodes { 1.0 } else { 2.0 };
                entry(at(k, T + axis), at(k, T + axis), change * ends);
                if k > 0 {
                    entry(at(k - 1, T + axis), at(k, T + axis), -change);
                }
            }
            q[at(k, W)] = weights.wing_spread;
            q[at(k, DW)] = weights.wing_move;
            q[at(k, S)] = weights.violation_per_m;
            q[at(k, F)] = weights.overspeed_s_per_m;
        }
        let size = nodes * WIDTH;
        (CscMatrix::new_from_triplets(size, size, square.row, square.column, square.value), q)
    }

    fn dynamics(&self, rows: &mut Rows) {
        let (begin, h) = (self.task.begin(), self.task.step_s());
        for axis in 0..3 {
            rows.push(&[(at(0, P + axis), 1.0)], begin.position[axis]);
            rows.push(&[(at(0, V + axis), 1.0)], begin.velocity[axis]);
        }
        rows.push(&[(at(0, W), 1.0)], begin.spread);
        for (k, (thrust, _)) in self.iterate.controls.iter().enumerate().take(self.held()) {
            for axis in 0..3 {
                rows.push(&[(at(k, T + axis), 1.0)], thrust[axis]);
            }
        }
        for (k, motion) in self.iterate.path.iter().enumerate() {
            let (thrust, spread) = self.iterate.controls[k];
            let slopes = self.craft.slopes(&motion.velocity, &thrust, spread);
            let rest = motion.acceleration
                - slopes.by_velocity * motion.velocity
                - slopes.by_thrust * thrust
                - slopes.by_spread * spread;
            for axis in 0..3 {
                let mut terms = vec![(at(k, A + axis), 1.0), (at(k, W), -slopes.by_spread[axis])];
                for other in 0..3 {
                    terms.push((at(k, V + other), -slopes.by_velocity[(axis, other)]));
                    terms.push((at(k, T + other), -slopes.by_thrust[(axis, other)]));
                }
                rows.push(&terms, rest[axis]);
                if k + 1 < self.nodes() {
                    let of = |what: usize| (at(k, what + axis), at(k + 1, what + axis));
                    let ((p, p_next), (v, v_next), (a, a_next)) = (of(P), of(V), of(A));
                    rows.push(&[(v_next, 1.0), (v, -1.0), (a, -h / 2.0), (a_next, -h / 2.0)], 0.0);
                    let h2 = h * h;
                    rows.push(
                        &[(p_next, 1.0), (p, -1.0), (v, -h), (a, -h2 / 3.0), (a_next, -h2 / 6.0)],
                        0.0,
                    );
                }
            }
        }
    }

    fn bounds(&self, rows: &mut Rows) {
        let (craft, h) = (self.craft, self.task.step_s());
        let slope = craft.tilt_max_rad.tan();
        let sideways = craft.tilt_rate_max_rad_s * craft.hover().z * h;
        let upwards = craft.thrust_rate_max_n_s * h;
        for k in 0..self.nodes() {
            for what in [S, DW, R, F] {
                rows.push(&[(at(k, what), -1.0)], 0.0);
            }
            if k == 0 {
                continue;
            }
            self.wings(k, rows);
            self.turning(k, rows);
            self.half_spaces(k, rows);
            if k < self.held() {
                continue;
            }
            let (thrust, _) = self.iterate.controls[k];
            let z = at(k, T + 2);
            let trust = self.trust_n;
            rows.push(&[(z, -1.0)], -craft.thrust_min_n.max(thrust.z - trust));
            rows.push(&[(z, 1.0)], thrust.z + trust);
            let (x, y) = (at(k, T), at(k, T + 1));
            let forward =
                Vector2::new(thrust.x, thrust.z).try_normalize(1e-9).unwrap_or_else(Vector2::y)
                    * slope;
            for sign in [1.0, -1.0] {
                rows.push(&[(x, sign), (z, -slope)], 0.0);
                rows.push(&[(x, -forward.x), (y, sign), (z, -forward.y)], 0.0);
            }
            for axis in 0..2 {
                let x = at(k, T + axis);
                rows.push(&[(x, 1.0)], thrust[axis] + trust);
                rows.push(&[(x, -1.0)], trust - thrust[axis]);
            }
            for axis in 0..3 {
                let limit = if axis == 2 { upwards } else { sideways };
                let (now, before) = (at(k, T + axis), at(k - 1, T + axis));
                rows.push(&[(now, 1.0), (before, -1.0)], limit);
                rows.push(&[(now, -1.0), (before, 1.0)], limit);
            }
        }
    }

    /// What turning takes of the thrust.
    fn turning(&self, k: usize, rows: &mut Rows) {
        let h2 = self.task.step_s() * self.task.step_s();
        if k + 1 < self.nodes() && k + 1 >= self.held() {
            for axis in 0..2 {
                let share = self.craft.turning_s2[axis] / h2;
                let [before, now, after] = [k - 1, k, k + 1].map(|node| at(node, T + axis));
                for sign in [1.0, -1.0] {
                    let by = share * sign;
                    let mut terms = vec![(after, by), (now, -2.0 * by), (at(k, R), -1.0)];
                    let told = if k == 1 { self.iterate.told[axis] } else { 0.0 };
                    if k > 1 {
                        terms.push((before, by));
                    }
                    rows.push(&terms, -by * told);
                }
            }
        }
        if k + 1 == self.held() {
            // That thrust is on its way. Where it leaves nothing for turning, a turn that was begun
            // may still end as it was planned to. A newton beyond costs what a metre in an obstacle
            // does, so that there is always a solution.
            let left = self.craft.thrust_max_n - self.iterate.controls[k].0.norm();
            rows.push(&[(at(k, R), 1.0), (at(k, S), -1.0)], left.max(self.turned(k)));
        }
    }

    /// What turning takes of the thrust in the iterate.
    fn turned(&self, k: usize) -> f64 {
        let controls = &self.iterate.controls;
        let before = if k == 1 { self.iterate.told } else { controls[k - 1].0 };
        let bend = controls
            .get(k + 1)
            .map_or_else(Vector3::zeros, |after| after.0 - controls[k].0 * 2.0 + before);
        let h2 = self.task.step_s() * self.task.step_s();
        (0..2).map(|axis| self.craft.turning_s2[axis] * bend[axis].abs() / h2).fold(0.0, f64::max)
    }

    fn wings(&self, k: usize, rows: &mut Rows) {
        let (craft, h) = (self.craft, self.task.step_s());
        let may_spread = self.may_spread && craft.wing.is_some();
        let (_, spread) = self.iterate.controls[k];
        let (now, before, change) = (at(k, W), at(k - 1, W), at(k, DW));
        let room = SPREAD_TRUST_PER_N * self.trust_n;
        let left = self.task.begin().spread - craft.wing_rate_max_per_s * h * k as f64;
        let most = if may_spread { (spread + room).min(1.0) } else { left.max(0.0) };
        rows.push(&[(now, 1.0)], most);
        rows.push(&[(now, -1.0)], -(spread - room).clamp(0.0, most));
        rows.push(&[(now, 1.0), (before, -1.0), (change, -1.0)], 0.0);
        rows.push(&[(now, -1.0), (before, 1.0), (change, -1.0)], 0.0);
        rows.push(&[(change, 1.0)], craft.wing_rate_max_per_s * h);
    }

    /// Obstacles near a node, and near the middle of the way to it: between two nodes a path cuts
    /// corners.
    fn half_spaces(&self, k: usize, rows: &mut Rows) {
        let h = self.task.step_s();
        for keep in self.task.keep_out() {
            let outward = |place: Vector2<f64>| {
                let away = place - keep.centre;
                (away.norm() < keep.radius_m + NEAR_M).then(|| away / away.norm().max(1e-9))
            };
            if let Some(d) = outward(self.iterate.sides[k]) {
                let terms = [(at(k, P), -d.x), (at(k, P + 1), -d.y), (at(k, S), -1.0)];
                rows.push(&terms, -keep.radius_m - d.dot(&keep.centre));
            }
            if k > 1
                && let Some(d) = outward((self.iterate.sides[k] + self.iterate.sides[k - 1]) * 0.5)
            {
                let mut terms = vec![(at(k, S), -1.0)];
                for axis in 0..2 {
                    for node in [k - 1, k] {
                        terms.push((at(node, P + axis), -0.5 * d[axis]));
                        let sign = if node == k { -1.0 } else { 1.0 };
                        terms.push((at(node, V + axis), -d[axis] * sign * h / 8.0));
                    }
                }
                rows.push(&terms, -keep.radius_m - d.dot(&keep.centre));
            }
        }
    }

    fn cones(&self, rows: &mut Rows, cones: &mut Vec<SupportedConeT<f64>>) {
        for k in self.held()..self.nodes() {
            rows.push(&[(at(k, R), 1.0)], self.craft.thrust_max_n);
            for axis in 0..3 {
                rows.push(&[(at(k, T + axis), -1.0)], 0.0);
            }
            cones.push(SupportedConeT::SecondOrderConeT(4));
        }
        let fastest = self.task.speed_max_m_s();
        for k in 1..self.nodes() {
            if fastest.is_finite() {
                rows.push(&[(at(k, F), -1.0)], fastest);
                for axis in 0..2 {
                    rows.push(&[(at(k, V + axis), -1.0)], 0.0);
                }
                cones.push(SupportedConeT::SecondOrderConeT(3));
            }
        }
    }
}
