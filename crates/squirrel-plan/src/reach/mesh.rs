//! The convex hull as a closed mesh: a corner for each direction of a refined icosahedron, where
//! the support function has its point.
//!
//! Corners lie on the hull, so the mesh lies in it but for facets that fold where the hull has an
//! edge, and both go away as the directions get denser, four times with each step.

use super::{Reach, Wings};
use nalgebra::Vector3;
use squirrel_core::frames::{In, Ned};
use std::collections::BTreeMap;

/// A closed mesh of triangles, seen from outside counter-clockwise.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// Accelerations, m/s^2.
    pub corners: Vec<In<Ned, f64>>,
    /// Three corners each.
    pub triangles: Vec<[usize; 3]>,
}

impl Mesh {
    /// Enclosed volume, (m/s^2)^3.
    pub fn volume_m3_s6(&self) -> f64 {
        let middle = self.corners.iter().map(|c| c.vector).sum::<Vector3<f64>>()
            / self.corners.len().max(1) as f64;
        let corner = |i: usize| self.corners[i].vector - middle;
        let parts =
            self.triangles.iter().map(|[a, b, c]| corner(*a).dot(&corner(*b).cross(&corner(*c))));
        parts.sum::<f64>() / 6.0
    }
}

/// Directions all around, each with the triangles between them; `halvings` of the edges of an
/// icosahedron.
pub(super) fn icosphere(halvings: u32) -> (Vec<Vector3<f64>>, Vec<[usize; 3]>) {
    let (mut points, mut triangles) = icosahedron();
    for _ in 0..halvings {
        let mut middles = BTreeMap::new();
        let mut finer = Vec::with_capacity(4 * triangles.len());
        for [a, b, c] in triangles {
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(i, j)| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    points.push(unit(points[i] + points[j]));
                    points.len() - 1
                })
            });
            finer.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    (points, triangles)
}

fn unit(v: Vector3<f64>) -> Vector3<f64> {
    v.try_normalize(0.0).unwrap_or(v)
}

/// Corners at the poles and on two rings of five.
fn icosahedron() -> (Vec<Vector3<f64>>, Vec<[usize; 3]>) {
    let ring = |height: f64, half_steps: f64| {
        (0..5).map(move |i| {
            let (s, c) = (std::f64::consts::TAU * (f64::from(i) + half_steps) / 5.0).sin_cos();
            unit(Vector3::new(2.0 * c, 2.0 * s, height))
        })
    };
    let points = [Vector3::z()].into_iter().chain(ring(1.0, 0.0)).chain(ring(-1.0, 0.5));
    let triangles = (0..5).flat_map(|i| {
        let [upper, next_upper, lower, next_lower] =
            [1 + i, 1 + (i + 1) % 5, 6 + i, 6 + (i + 1) % 5];
        [
            [0, upper, next_upper],
            [upper, lower, next_upper],
            [next_upper, lower, next_lower],
            [11, next_lower, lower],
        ]
    });
    (points.chain([-Vector3::z()]).collect(), triangles.collect())
}

impl Reach {
    /// The acceleration that lies furthest along a direction: with folded wings, or with a choice
    /// of both.
    pub(super) fn furthest(&self, direction: In<Ned, f64>, wings: Wings) -> In<Ned, f64> {
        let folded = self.folded(direction);
        if wings == Wings::Folded {
            return folded.acceleration;
        }
        let spread = self.spread_by(direction.vector, None);
        if spread.value_m_s2 > folded.value_m_s2 {
            spread.acceleration
        } else {
            folded.acceleration
        }
    }

    /// Convex hull of the accelerations: with folded wings, or with a choice of both.
    ///
    /// * `halvings` - of the edges of an icosahedron: 12, 42, 162, 642, ... corners
    pub fn hull(&self, wings: Wings, halvings: u32) -> Mesh {
        let (directions, triangles) = icosphere(halvings);
        Mesh {
            corners: directions.iter().map(|d| self.furthest(In::new(*d), wings)).collect(),
            triangles,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_icosphere_is_closed_and_becomes_round() {
        for (halvings, count) in [(0, 12), (1, 42), (4, 2562)] {
            let (points, triangles) = icosphere(halvings);
            assert_eq!((points.len(), triangles.len()), (count, 2 * count - 4));
            let corners = points.into_iter().map(In::new).collect();
            let volume = Mesh { corners, triangles }.volume_m3_s6();
            let ball = 4.0 / 3.0 * std::f64::consts::PI;
            let lost = [0.4, 0.14, 2.2e-3][[0, 1, 4].iter().position(|h| *h == halvings).unwrap()];
            assert!(volume < ball && volume > (1.0 - lost) * ball, "{halvings}: {}", volume / ball);
        }
    }
}
