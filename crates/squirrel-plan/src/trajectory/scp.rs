//! Successive convexification: solve about an iterate, fly the answer through the model, believe it
//! as far as the model agreed.
//!
//! Every iterate is a motion that the model really makes, so a plan that is stopped early can be
//! flown. The wings stay folded until the way without them is found and may open from there: a plan
//! with wings is never worse than the one without. Where the reference leads through obstacles,
//! both sides of up to two of them are tried first.

use super::model::{Craft, Motion};
use super::sides::guesses;
use super::subproblem::{Control, Iterate, Subproblem, Weights};
use super::task::{Plan, Status, Task};
use nalgebra::{Vector2, Vector3};
use squirrel_sim::track::{Track, TrackPoint};

/// Trust at the beginning without a plan to start from, N: more than any change.
const COLD_TRUST_N: f64 = 20.0;
/// The same with one.
const WARM_TRUST_N: f64 = 4.0;
/// Trust below which nothing moves any more, N.
const TRUST_MIN_N: f64 = 1e-2;
/// Relative gain that is not worth another iteration.
const GAIN: f64 = 2e-3;
/// Depth in an obstacle that counts as none, m.
const TOUCH_M: f64 = 0.01;
/// Speed above the limit that counts as none, m/s.
const TOO_FAST_M_S: f64 = 0.05;
/// Iterations in which a side is judged.
const TRIAL: u32 = 2;

/// Plans.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Planner {
    /// What counts how much.
    pub weights: Weights,
    /// Bound on convex problems: with folded wings, and again where they may spread.
    pub iterations_max: u32,
}

impl Default for Planner {
    fn default() -> Self {
        Self { weights: Weights::default(), iterations_max: 12 }
    }
}

/// What a plan took.
#[derive(Default)]
struct Work {
    problems: u32,
    solver_iterations: u32,
}

/// An iterate and what it costs.
struct Held {
    iterate: Iterate,
    /// Without what violations cost, and with.
    cost: f64,
    merit: f64,
    trust_n: f64,
    is_settled: bool,
}

impl Planner {
    /// Plans; always ends, with the plan that violates least where all constraints cannot be held.
    ///
    /// * `warm` - an earlier plan, and how much of it has passed, s
    pub fn plan(&self, craft: &Craft, task: &Task, warm: Option<(&Track, f64)>) -> Plan {
        let mut work = Work::default();
        let mut held = self.begin(craft, task, warm, &mut work);
        self.improve(craft, task, false, self.iterations_max, &mut held, &mut work);
        // As many rounds for a craft without wings: what wings are worth is not what more rounds
        // are.
        (held.is_settled, held.trust_n) = (false, held.trust_n.max(WARM_TRUST_N));
        self.improve(craft, task, true, self.iterations_max, &mut held, &mut work);
        self.finish(task, held, &work)
    }

    fn finish(&self, task: &Task, held: Held, work: &Work) -> Plan {
        let Iterate { controls, path, .. } = held.iterate;
        let (cost, _) = self.weights.cost(task, &path, &controls);
        let depths = path.windows(2).map(|pair| task.violation_m(&pair[0], &pair[1]));
        let violation_m = depths.fold(0.0, f64::max);
        let overspeed_m_s =
            path.iter().skip(1).map(|node| task.overspeed_m_s(node)).fold(0.0, f64::max);
        let is_motion = path.iter().all(|node| node.position.iter().all(|x| x.is_finite()));
        let holds = is_motion && violation_m <= TOUCH_M && overspeed_m_s <= TOO_FAST_M_S;
        let status = match (holds, held.is_settled) {
            (true, true) => Status::Solved,
            (true, false) => Status::Feasible,
            (false, _) => Status::Infeasible,
        };
        let point = |(motion, (thrust, wing)): (&Motion, &Control)| TrackPoint {
            position: motion.position,
            velocity: motion.velocity,
            acceleration: motion.acceleration,
            thrust: -thrust,
            wing: *wing,
        };
        let track = Track::even(task.step_s(), path.iter().zip(&controls).map(point).collect());
        let (iterations, solver_iterations) = (work.problems, work.solver_iterations);
        Plan { status, track, cost, violation_m, overspeed_m_s, iterations, solver_iterations }
    }

    /// The best of a few first guesses.
    fn begin(
        &self,
        craft: &Craft,
        task: &Task,
        warm: Option<(&Track, f64)>,
        work: &mut Work,
    ) -> Held {
        let controls = first_controls(craft, task, warm);
        let told = warm.and_then(|(track, passed_s)| track.at(passed_s));
        let told = told.map_or(controls[0].0, |point| craft.limited(&-point.thrust));
        let start = (task.begin().position, task.begin().velocity);
        let path = craft.roll_out(start, &controls, task.step_s());
        let (cost, merit) = self.weights.cost(task, &path, &controls);
        let trust_n = if warm.is_some() { WARM_TRUST_N } else { COLD_TRUST_N };
        let held = |sides| Held {
            iterate: Iterate { controls: controls.clone(), told, path: path.clone(), sides },
            cost,
            merit,
            trust_n,
            is_settled: false,
        };
        let flown: Vec<Vector2<f64>> = path.iter().map(|node| node.position.xy()).collect();
        let base = match warm {
            Some(_) => flown,
            None => task.wanted().iter().map(|node| node.position.xy()).collect(),
        };
        let mut best: Option<Held> = None;
        for sides in guesses(task, &base) {
            let mut next = held(sides);
            self.improve(craft, task, false, TRIAL, &mut next, work);
            if best.as_ref().is_none_or(|best| next.merit < best.merit) {
                best = Some(next);
            }
        }
        best.unwrap_or_else(|| held(base))
    }

    fn improve(
        &self,
        craft: &Craft,
        task: &Task,
        may_spread: bool,
        most: u32,
        held: &mut Held,
        work: &mut Work,
    ) {
        let start = (task.begin().position, task.begin().velocity);
        for _ in 0..most {
            if held.is_settled {
                return;
            }
            let problem = Subproblem {
                craft,
                task,
                weights: &self.weights,
                iterate: &held.iterate,
                trust_n: held.trust_n,
                may_spread,
            };
            work.problems += 1;
            let Some((controls, foreseen)) = problem.solve(&mut work.solver_iterations) else {
                held.trust_n *= 0.5;
                continue;
            };
            let path = craft.roll_out(start, &controls, task.step_s());
            let (cost, merit) = self.weights.cost(task, &path, &controls);
            let (_, promised) = self.weights.cost(task, &foreseen, &controls);
            let (gain, hope) = (held.merit - merit, held.merit - promised);
            let enough = GAIN * (1.0 + held.cost);
            if gain > 0.0 {
                let sides = path.iter().map(|node| node.position.xy()).collect();
                held.iterate = Iterate { controls, told: held.iterate.told, path, sides };
                (held.cost, held.merit) = (cost, merit);
            }
            if hope <= enough {
                held.is_settled = true;
            } else if gain < 0.1 * hope {
                held.trust_n *= 0.5;
                held.is_settled = held.trust_n < TRUST_MIN_N;
            } else if gain > 0.7 * hope {
                held.trust_n = (2.0 * held.trust_n).min(COLD_TRUST_N);
            }
        }
    }
}

/// Thrusts to start from: those of the earlier plan, or what carries the weight; wings fold where
/// nothing else is known.
fn first_controls(craft: &Craft, task: &Task, warm: Option<(&Track, f64)>) -> Vec<Control> {
    let begin = task.begin();
    let rate = craft.wing_rate_max_per_s * task.step_s();
    let mut controls = vec![(craft.limited(&-begin.thrust), begin.spread)];
    let held_s = craft.delay_s + 0.5 * task.step_s();
    for k in 1..task.wanted().len() {
        let is_held = k as f64 * task.step_s() < held_s;
        let fold = (begin.spread - rate * k as f64).max(0.0);
        controls.push(match warm {
            Some((track, passed_s)) => match track.at(passed_s + k as f64 * task.step_s()) {
                Some(point) => (craft.limited(&-point.thrust), fold),
                None => (craft.hover(), fold),
            },
            None if is_held => (controls[0].0, fold),
            None => (craft.hover(), fold),
        });
    }
    controls
}

impl Craft {
    /// The nearest thrust that may be asked for: a plan begins there.
    fn limited(&self, thrust: &Vector3<f64>) -> Vector3<f64> {
        let z = thrust.z.clamp(self.thrust_min_n, self.thrust_max_n);
        let slope = self.tilt_max_rad.tan() * z;
        let inside = Vector3::new(thrust.x.clamp(-slope, slope), thrust.y.clamp(-slope, slope), z);
        inside * (self.thrust_max_n / inside.norm()).min(1.0)
    }
}
