//! The support function of the flat plate, exact and with a certificate (docs/equations.md F.3).
//!
//! Spread wings push with `b (v.n) n`, `b = rho A V^2`, so for a thrust `U` of 0 or the limit
//! `-(U + b v.n)(d.n)` is to be largest over the tilt set. Inside it the gradient is along `n` and
//! lies in the plane of `v` and `d`; the edge is made of circles. On the great circle of that plane
//! and on every edge the function is a trigonometric polynomial of degree two in one angle, whose
//! second derivative is bounded, so branch and bound finds the largest value to a stated gap. That
//! takes the place of the form with a semidefinite cone, which needs LAPACK.

use super::tilt::{Circle, Region, across};
use nalgebra::Vector3;

/// Gap at which a search ends, over the size of the polynomial.
const GAP: f64 = 1e-10;
/// Pieces that an arc begins with.
const PIECES: u32 = 8;

/// The largest value of a function of the normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Largest {
    pub(super) value: f64,
    /// No value is larger than this one.
    pub(super) upper: f64,
    pub(super) normal: Vector3<f64>,
}

/// `c0 + c1 cos(t) + s1 sin(t) + c2 cos(2 t) + s2 sin(2 t)`.
#[derive(Debug, Clone, Copy)]
struct Trigonometric {
    c0: f64,
    c1: f64,
    s1: f64,
    c2: f64,
    s2: f64,
}

impl Trigonometric {
    /// `-(thrust + b v.n)(d.n)` on a circle.
    fn new(circle: &Circle, thrust_n: f64, bv: Vector3<f64>, d: Vector3<f64>) -> Self {
        let line = |v: Vector3<f64>| [circle.centre, circle.u, circle.w].map(|part| v.dot(&part));
        let ([mut p0, p1, p2], [q0, q1, q2]) = (line(bv), line(d));
        p0 += thrust_n;
        Self {
            c0: -(p0 * q0 + 0.5 * (p1 * q1 + p2 * q2)),
            c1: -(p0 * q1 + p1 * q0),
            s1: -(p0 * q2 + p2 * q0),
            c2: -0.5 * (p1 * q1 - p2 * q2),
            s2: -0.5 * (p1 * q2 + p2 * q1),
        }
    }

    fn at(&self, t: f64) -> f64 {
        let ((s, c), (s2, c2)) = (t.sin_cos(), (2.0 * t).sin_cos());
        self.c0 + self.c1 * c + self.s1 * s + self.c2 * c2 + self.s2 * s2
    }

    /// Bound of the second derivative.
    fn bend(&self) -> f64 {
        self.c1.hypot(self.s1) + 4.0 * self.c2.hypot(self.s2)
    }

    /// The largest value between two angles: value, bound, angle.
    fn largest(&self, [from, to]: [f64; 2]) -> [f64; 3] {
        let bend = self.bend();
        let gap = GAP * (self.c0.abs() + bend) + f64::MIN_POSITIVE;
        let width = (to - from) / f64::from(PIECES);
        let ends = (0..PIECES).map(|i| {
            let [a, b] = [i, i + 1].map(|i| from + width * f64::from(i));
            [a, b, self.at(a), self.at(b)]
        });
        let mut open: Vec<[f64; 4]> = ends.collect();
        let [mut best, mut angle] = [self.at(from), from];
        let mut upper = best;
        while !open.is_empty() {
            for &[a, b, at_a, at_b] in &open {
                for (t, value) in [(a, at_a), (b, at_b)] {
                    if value > best {
                        [best, angle] = [value, t];
                    }
                }
            }
            let mut halves = Vec::with_capacity(2 * open.len());
            for [a, b, at_a, at_b] in open {
                // A function that bends so little rises above both ends of a piece by no more than
                // this.
                let bound = at_a.max(at_b) + bend * (b - a) * (b - a) / 8.0;
                if bound <= best + gap {
                    upper = upper.max(bound);
                    continue;
                }
                let middle = 0.5 * (a + b);
                let at_middle = self.at(middle);
                halves.push([a, middle, at_a, at_middle]);
                halves.push([middle, b, at_middle, at_b]);
            }
            open = halves;
        }
        [best, upper.max(best), angle]
    }
}

/// The largest `-(thrust + b v.n)(d.n)` over the region, N.
///
/// * `bv` - direction of motion times `b`, N
pub(super) fn largest(
    region: &Region,
    thrust_n: f64,
    bv: Vector3<f64>,
    d: Vector3<f64>,
) -> Option<Largest> {
    let axis = d.try_normalize(0.0)?;
    let aside = bv - axis * axis.dot(&bv);
    // Along `d`, every plane through both will do: what the one plane misses lies on circles around
    // `d` that meet the edge.
    let aside = if aside.norm() > 1e-9 * bv.norm() { aside.try_normalize(0.0) } else { None };
    let plane =
        Circle { centre: Vector3::zeros(), u: axis, w: aside.unwrap_or_else(|| across(axis)) };
    let mut found: Option<Largest> = None;
    for circle in region.edges().chain([plane]) {
        let function = Trigonometric::new(&circle, thrust_n, bv, d);
        for arc in region.arcs(&circle) {
            let [value, upper, angle] = function.largest(arc);
            let normal = circle.at(angle);
            let best = found.get_or_insert(Largest { value, upper, normal });
            if value > best.value {
                *best = Largest { value, normal, ..*best };
            }
            best.upper = best.upper.max(upper);
        }
    }
    found
}
