//! The force of spread wings at one speed, over the angle of attack (docs/equations.md F.2).
//!
//! Every model pushes in the plane of the motion `v` and the normal `n`, so at one speed two
//! numbers are all there is: `f = along v + across m`, where `n = sin(alpha) v + cos(alpha) m`. For
//! the flat plate they are `-b sin^2` and `-b sin cos`; for the others they are asked once on
//! nodes, with straight lines between. A set costs thousands of forces, a settled membrane tens of
//! microseconds.

use crate::wing::WingForce;
use nalgebra::Vector3;
use squirrel_core::aero::flat_plate;
use squirrel_core::frames::In;
use std::f64::consts::{FRAC_PI_2, PI};

/// Intervals between nodes; a line misses the membrane by less than a millinewton.
const INTERVALS: usize = 1600;
/// A membrane in fast air bulges to either side of edge on: the node there is two, this far from
/// it, rad.
const EDGE_ON_RAD: f64 = 1e-7;

/// Force in the plane of motion and normal, N.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Polar {
    Flat { force_n: f64 },
    Nodes(Vec<Node>),
}

/// A force and the angle it belongs to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Node {
    alpha_rad: f64,
    /// Along the motion and across it.
    force_n: [f64; 2],
}

impl Polar {
    /// * `speed_m_s` - through the air
    pub(super) fn new(wing: &WingForce, speed_m_s: f64) -> Self {
        if let WingForce::Flat { area_m2 } = wing {
            return Self::Flat { force_n: -flat_plate::impedance(*area_m2, speed_m_s) * speed_m_s };
        }
        let step = PI / INTERVALS as f64;
        let middle = INTERVALS / 2;
        let angles = (0..=INTERVALS).flat_map(|i| {
            let alpha = step * i as f64 - FRAC_PI_2;
            if i == middle { vec![-EDGE_ON_RAD, EDGE_ON_RAD] } else { vec![alpha] }
        });
        let node = |alpha_rad: f64| {
            let (s, c) = alpha_rad.sin_cos();
            let motion = In::new(Vector3::new(speed_m_s, 0.0, 0.0));
            let force = wing.force(motion, In::new(Vector3::new(s, 0.0, c))).vector;
            Node { alpha_rad, force_n: [force.x, force.z] }
        };
        Self::Nodes(angles.map(node).collect())
    }

    /// The nodes around an angle.
    fn around(nodes: &[Node], alpha_rad: f64) -> [Node; 2] {
        let after =
            nodes.partition_point(|node| node.alpha_rad < alpha_rad).clamp(1, nodes.len() - 1);
        [nodes[after - 1], nodes[after]]
    }

    /// Force at an angle of attack, N: along the motion and across it, towards the normal.
    pub(super) fn force(&self, alpha_rad: f64) -> [f64; 2] {
        match self {
            Self::Flat { force_n } => {
                let (s, c) = alpha_rad.sin_cos();
                [-force_n * s * s, -force_n * s * c]
            }
            Self::Nodes(nodes) => {
                let [a, b] = Self::around(nodes, alpha_rad);
                let share = (alpha_rad - a.alpha_rad) / (b.alpha_rad - a.alpha_rad);
                [0, 1].map(|i| a.force_n[i] + share * (b.force_n[i] - a.force_n[i]))
            }
        }
    }

    /// Least and largest force between two angles.
    pub(super) fn range(&self, [from, to]: [f64; 2]) -> [[f64; 2]; 2] {
        let [a, b] = [self.force(from), self.force(to)];
        match self {
            Self::Flat { force_n } => {
                // A quarter of the curve bends no more than this.
                let rise = force_n * (to - from) * (to - from) / 4.0;
                [0, 1].map(|i| [a[i].min(b[i]) - rise, a[i].max(b[i]) + rise])
            }
            Self::Nodes(nodes) => {
                let first = nodes.partition_point(|node| node.alpha_rad < from);
                let last = nodes.partition_point(|node| node.alpha_rad < to).max(first);
                [0, 1].map(|i| {
                    let inner = nodes[first..last].iter().map(|node| node.force_n[i]);
                    inner.fold([a[i].min(b[i]), a[i].max(b[i])], |[low, high], x| {
                        [low.min(x), high.max(x)]
                    })
                })
            }
        }
    }
}
