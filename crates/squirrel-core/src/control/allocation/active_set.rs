//! The search of [`Allocation`] among the rotors that are held at a limit, in f64.

use super::{Allocation, STEPS_MAX};
use crate::math::{limit, upper};
use crate::vehicle::{MAX_ROTORS, PerRotor};

/// Rounding of a gradient over the size of its terms.
const NOISE: f64 = 4e-16;

/// Rotors that no limit holds.
pub(super) type Free = PerRotor<bool>;

/// One demand.
pub(super) struct Problem {
    pub(super) want: [f64; 4],
    pub(super) before: PerRotor<f64>,
    pub(super) most: PerRotor<f64>,
}

impl Allocation {
    /// Slopes below these are rounding.
    fn noise(&self, want: &[f64; 4]) -> PerRotor<f64> {
        let mut size = want.map(f64::abs);
        for of in &self.effectiveness {
            for (s, x) in size.iter_mut().zip(of) {
                *s += f64::from(x.abs() * self.thrust_max_n);
            }
        }
        self.pull.map(|pull| NOISE * pull.iter().zip(&size).map(|(p, s)| p.abs() * s).sum::<f64>())
    }

    pub(super) fn search(
        &self,
        problem: &Problem,
        start: PerRotor<f64>,
        start_free: Free,
    ) -> (PerRotor<f64>, u32, bool) {
        let n = self.rotors();
        let (mut at, mut free) = (start, start_free);
        let noise = self.noise(&problem.want);
        // Rotors that rounding alone let go: not again until something has moved.
        let mut settled = [false; MAX_ROTORS];
        let mut slope = self.slope(problem, &at);
        for step in 1..=STEPS_MAX {
            let way = self.newton_step(free, &slope.map(|x| -x));
            let (mut share, mut stop) = (1.0, None);
            for i in 0..n {
                let goal = at[i] + way[i];
                if free[i] && !(goal >= 0.0 && goal <= problem.most[i]) {
                    let bound = if goal < 0.0 { 0.0 } else { problem.most[i] };
                    let part = upper((bound - at[i]) / way[i], 0.0);
                    if stop.is_none() || part < share {
                        (share, stop) = (part, Some((i, bound)));
                    }
                }
            }
            for i in 0..n {
                if free[i] {
                    at[i] = limit(at[i] + share * way[i], 0.0, problem.most[i]);
                }
            }
            if share > 0.0 {
                settled = [false; MAX_ROTORS];
            }
            if let Some((i, bound)) = stop {
                // The remainder is the index; with it the compiler sees a place in the array.
                let i = i % MAX_ROTORS;
                (at[i], free[i], settled[i]) = (bound, false, share == 0.0);
            }
            slope = self.slope(problem, &at);
            if stop.is_some() {
                continue;
            }
            let mut best = (0.0, None);
            for i in 0..n {
                let gain = if at[i] > 0.0 { slope[i] } else { -slope[i] };
                if !free[i] && !settled[i] && problem.most[i] > 0.0 && gain > upper(noise[i], best.0) {
                    best = (gain, Some(i));
                }
            }
            match best.1 {
                Some(i) => free[i % MAX_ROTORS] = true,
                None => return (at, step, true),
            }
        }
        (at, STEPS_MAX, false)
    }

    /// What thrusts give more than is wanted, on each axis.
    pub(super) fn missed(&self, problem: &Problem, at: &PerRotor<f64>) -> [f64; 4] {
        let mut missed = problem.want.map(|x| -x);
        for i in 0..self.rotors() {
            for (m, x) in missed.iter_mut().zip(&self.effectiveness[i]) {
                *m += f64::from(*x) * at[i];
            }
        }
        missed
    }

    /// Gradient of half the cost, by what is missed: small where the demand is met, and so is its rounding.
    fn slope(&self, problem: &Problem, at: &PerRotor<f64>) -> PerRotor<f64> {
        let missed = self.missed(problem, at);
        let mut slope = [0.0; MAX_ROTORS];
        for i in 0..self.rotors() {
            slope[i] = self.change * (at[i] - problem.before[i]);
            for (p, m) in self.pull[i].iter().zip(&missed) {
                slope[i] += p * m;
            }
        }
        slope
    }

    /// The way to the minimum over the free rotors: elimination without square roots; 0 for the others.
    pub(super) fn newton_step(&self, free: Free, against: &PerRotor<f64>) -> PerRotor<f64> {
        let n = self.rotors();
        let (mut m, mut way, mut inverse) = (self.curvature, *against, [0.0; MAX_ROTORS]);
        for k in 0..n {
            if !free[k] {
                way[k] = 0.0;
                continue;
            }
            inverse[k] = 1.0 / m[k][k];
            let pivot = m[k];
            for i in k + 1..n {
                if free[i] {
                    let factor = pivot[i] * inverse[k];
                    way[i] -= factor * way[k];
                    for j in i..n {
                        m[i][j] -= factor * pivot[j];
                    }
                }
            }
        }
        for k in (0..n).rev() {
            if free[k] {
                for i in k + 1..n {
                    way[k] -= m[k][i] * way[i];
                }
                way[k] *= inverse[k];
            }
        }
        way
    }
}
