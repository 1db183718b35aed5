//! The shapes that a vehicle and its surroundings are put together from, as triangles of unit size.
//!
//! A shape is nine numbers a triangle. Faces need no normals: the page takes them from the depth of
//! what it draws.

use std::f32::consts::TAU;

/// Corners of triangles, one after the other.
pub(super) type Mesh = Vec<f32>;

/// How a shape is made.
pub(super) type Make = fn() -> Mesh;

/// Names of the shapes, and how each is made.
pub(super) const MESHES: [(&str, Make); 9] = [
    ("ball", ball),
    ("box", block),
    ("cylinder", cylinder),
    ("disc", disc),
    ("head", head),
    ("hull", hull),
    ("ring", ring),
    ("shaft", shaft),
    ("sheet", sheet),
];

/// Triangles of a shape.
pub(super) fn triangles(name: &str) -> usize {
    MESHES.iter().find(|(own, _)| *own == name).map_or(0, |(_, make)| make().len() / 9)
}

fn round(x: f32) -> f32 {
    (x * 1e4).round() / 1e4
}

fn quad(mesh: &mut Mesh, [a, b, c, d]: [[f32; 3]; 4]) {
    triangle(mesh, [a, b, c]);
    triangle(mesh, [a, c, d]);
}

fn triangle(mesh: &mut Mesh, corners: [[f32; 3]; 3]) {
    mesh.extend(corners.iter().flatten().copied().map(round));
}

/// Rings of `sides` corners around an axis, joined to a skin. A ring of no radius is a tip.
///
/// * `rings` - place on the axis and radii across it
/// * `point` - the corner at a place on the axis and two coordinates across it
fn lathe(sides: usize, rings: &[(f32, [f32; 2])], point: fn(f32, [f32; 2]) -> [f32; 3]) -> Mesh {
    let corner = |(at, [a, b]): (f32, [f32; 2]), k: usize| {
        let (sin, cos) = (TAU * k as f32 / sides as f32).sin_cos();
        point(at, [a * cos, b * sin])
    };
    let is_tip = |(_, [a, b]): (f32, [f32; 2])| a == 0.0 && b == 0.0;
    let mut mesh = Mesh::new();
    for pair in rings.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        for k in 0..sides {
            let [a, b, c, d] =
                [corner(from, k), corner(from, k + 1), corner(to, k + 1), corner(to, k)];
            if is_tip(from) {
                triangle(&mut mesh, [a, c, d]);
            } else if is_tip(to) {
                triangle(&mut mesh, [a, b, c]);
            } else {
                quad(&mut mesh, [a, b, c, d]);
            }
        }
    }
    mesh
}

fn along_z(at: f32, [a, b]: [f32; 2]) -> [f32; 3] {
    [a, b, at]
}

fn along_x(at: f32, [a, b]: [f32; 2]) -> [f32; 3] {
    [at, a, b]
}

/// Edges of one around the origin.
fn block() -> Mesh {
    let mut mesh = Mesh::new();
    for axis in 0..3 {
        for side in [-0.5, 0.5] {
            let corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]].map(|[a, b]| {
                let mut corner = [side; 3];
                corner[(axis + 1) % 3] = a;
                corner[(axis + 2) % 3] = b;
                corner
            });
            quad(&mut mesh, corners);
        }
    }
    mesh
}

/// Radius one around the origin.
fn ball() -> Mesh {
    let rings: Vec<_> = (0..=6)
        .map(|k| {
            let (sin, cos) = (0.5 * TAU * k as f32 / 6.0).sin_cos();
            let radius = if k == 0 || k == 6 { 0.0 } else { sin };
            (cos, [radius; 2])
        })
        .collect();
    lathe(12, &rings, along_z)
}

/// Radius one, from -0.5 to 0.5 along z.
fn cylinder() -> Mesh {
    lathe(24, &[(-0.5, [0.0; 2]), (-0.5, [1.0; 2]), (0.5, [1.0; 2]), (0.5, [0.0; 2])], along_z)
}

/// Radius one in the plane of x and y.
fn disc() -> Mesh {
    lathe(36, &[(0.0, [0.0; 2]), (0.0, [1.0; 2])], along_z)
}

/// The outer twentieth of [`disc`].
fn ring() -> Mesh {
    lathe(36, &[(0.0, [0.95; 2]), (0.0, [1.0; 2])], along_z)
}

/// Of an arrow: radius one, from 0 to 1 along z.
fn shaft() -> Mesh {
    lathe(10, &[(0.0, [0.0; 2]), (0.0, [1.0; 2]), (1.0, [1.0; 2])], along_z)
}

/// Of an arrow: from radius one at 0 to its tip at 1 along z.
fn head() -> Mesh {
    lathe(14, &[(0.0, [0.0; 2]), (0.0, [1.0; 2]), (1.0, [0.0; 2])], along_z)
}

/// From 0 to 1 along y and a half to both sides along x.
fn sheet() -> Mesh {
    let mut mesh = Mesh::new();
    quad(&mut mesh, [[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0], [0.5, 1.0, 0.0], [-0.5, 1.0, 0.0]]);
    mesh
}

/// A fuselage of half length, half width and half height one; its nose is at x = 1.
fn hull() -> Mesh {
    let rings = [
        (-1.0, [0.0, 0.0]),
        (-1.0, [0.35, 0.4]),
        (-0.8, [0.7, 0.75]),
        (-0.3, [1.0, 1.0]),
        (0.35, [1.0, 1.0]),
        (0.75, [0.75, 0.8]),
        (0.95, [0.4, 0.5]),
        (1.0, [0.0, 0.0]),
    ];
    lathe(14, &rings, along_x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_are_whole_triangles_inside_of_their_unit() {
        for (name, make) in MESHES {
            let mesh = make();
            assert!(!mesh.is_empty() && mesh.len() % 9 == 0, "{name}: {}", mesh.len());
            assert!(mesh.iter().all(|x| x.abs() <= 1.0), "{name}");
            assert_eq!(triangles(name), mesh.len() / 9);
        }
        assert_eq!([triangles("box"), triangles("disc"), triangles("sheet")], [12, 36, 2]);
    }

    /// Each edge of a closed skin belongs to two triangles.
    #[test]
    fn solids_are_closed() {
        for name in ["ball", "box", "cylinder", "head", "hull"] {
            let (_, make) = MESHES.iter().find(|(own, _)| *own == name).unwrap();
            let mut edges = std::collections::BTreeMap::<[String; 2], usize>::new();
            for corners in make().chunks_exact(9) {
                let name = |k: usize| {
                    format!(
                        "{:?}",
                        corners[3 * k..3 * k + 3].iter().map(|x| x + 0.0).collect::<Vec<_>>()
                    )
                };
                for (a, b) in [(0, 1), (1, 2), (2, 0)] {
                    let mut edge = [name(a), name(b)];
                    edge.sort();
                    *edges.entry(edge).or_default() += 1;
                }
            }
            assert!(edges.values().all(|count| *count == 2), "{name}: {edges:?}");
        }
    }
}
