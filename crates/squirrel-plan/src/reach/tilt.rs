//! Where thrust may point: the tilt set as a part of the unit sphere (docs/equations.md F.1).
//!
//! Limits of roll and pitch,
//! `n = R_z(yaw) (sin(pitch) cos(roll), -sin(roll), cos(pitch) cos(roll))`, and a cone are both
//! half-spaces cut out of the sphere: `|n_x| <= tan(pitch_max) n_z` and `|n_y| <= sin(roll_max)` in
//! the frame turned by yaw, `n_z >= cos(max)`. What bounds the set are then circles, and a linear
//! function is largest in its own direction, on one of those circles, or where two meet.

use nalgebra::Vector3;
use squirrel_sim::setting::SettingError;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Rounding that a point on an edge is allowed.
const SLACK: f64 = 1e-11;

/// Limits of the attitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tilt {
    /// Roll and pitch each within a limit, as the flight code has it, at a heading.
    Box {
        /// Limit of roll, rad, in (0, pi/2).
        roll_max_rad: f64,
        /// Limit of pitch, rad, in (0, pi/2).
        pitch_max_rad: f64,
        /// Heading, rad.
        yaw_rad: f64,
    },
    /// Angle between thrust and the vertical within a limit.
    Cone {
        /// The limit, rad, in (0, pi/2).
        max_rad: f64,
    },
}

impl Tilt {
    /// The limits of a name, `box` or `cone`, with one angle for all.
    ///
    /// # Errors
    /// One line that lists the names.
    pub fn named(name: &str, max_rad: f64, yaw_rad: f64) -> Result<Self, SettingError> {
        match name {
            "box" => Ok(Self::Box { roll_max_rad: max_rad, pitch_max_rad: max_rad, yaw_rad }),
            "cone" => Ok(Self::Cone { max_rad }),
            other => Err(SettingError::Name {
                field: "tilt",
                name: other.to_owned(),
                what: "limit",
                known: "box, cone".to_owned(),
            }),
        }
    }

    /// Names the first number out of range.
    pub(super) fn check(&self) -> Result<(), SettingError> {
        let angle = |name: &str, rad: f64| {
            if rad > 0.0 && rad < FRAC_PI_2 {
                Ok(())
            } else {
                Err(SettingError::value(name, rad, "must be above 0 and below pi/2"))
            }
        };
        match *self {
            Self::Box { roll_max_rad, pitch_max_rad, yaw_rad } => {
                angle("tilt.roll_max_rad", roll_max_rad)?;
                angle("tilt.pitch_max_rad", pitch_max_rad)?;
                if !yaw_rad.is_finite() {
                    return Err(SettingError::value("tilt.yaw_rad", yaw_rad, "must be finite"));
                }
                Ok(())
            }
            Self::Cone { max_rad } => angle("tilt.max_rad", max_rad),
        }
    }

    /// A normal for each point of the unit square, and the solid angle that a unit of area there
    /// stands for.
    pub(super) fn normal(&self, p: f64, q: f64) -> (Vector3<f64>, f64) {
        match *self {
            Self::Box { roll_max_rad, pitch_max_rad, yaw_rad } => {
                let (roll, pitch) =
                    (roll_max_rad * (2.0 * p - 1.0), pitch_max_rad * (2.0 * q - 1.0));
                let ((sin_roll, cos_roll), (sin_pitch, cos_pitch)) =
                    (roll.sin_cos(), pitch.sin_cos());
                let n = Vector3::new(sin_pitch * cos_roll, -sin_roll, cos_pitch * cos_roll);
                (turned(n, yaw_rad), cos_roll * 4.0 * roll_max_rad * pitch_max_rad)
            }
            Self::Cone { max_rad } => {
                // Equal areas of the square are equal solid angles.
                let lost = 1.0 - max_rad.cos();
                let z = 1.0 - lost * p;
                let r = (1.0 - z * z).max(0.0).sqrt();
                let (s, c) = (TAU * q).sin_cos();
                (Vector3::new(r * c, r * s, z), TAU * lost)
            }
        }
    }
}

fn turned(v: Vector3<f64>, yaw_rad: f64) -> Vector3<f64> {
    let (s, c) = yaw_rad.sin_cos();
    Vector3::new(c * v.x - s * v.y, s * v.x + c * v.y, v.z)
}

/// `outward . n <= offset`, with a unit vector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Face {
    pub(super) outward: Vector3<f64>,
    pub(super) offset: f64,
}

/// The unit sphere within half-spaces.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Region {
    pub(super) faces: Vec<Face>,
}

/// A circle on the sphere: `centre + u cos(t) + w sin(t)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Circle {
    pub(super) centre: Vector3<f64>,
    pub(super) u: Vector3<f64>,
    pub(super) w: Vector3<f64>,
}

impl Circle {
    /// Normals at this sine above the plane across `axis`, a unit vector; `towards`, across the
    /// axis, is where the angle is zero.
    pub(super) fn around(axis: Vector3<f64>, sine: f64, towards: Vector3<f64>) -> Self {
        let radius = (1.0 - sine * sine).max(0.0).sqrt();
        Self { centre: axis * sine, u: towards * radius, w: axis.cross(&towards) * radius }
    }

    /// The point at an angle.
    pub(super) fn at(&self, t: f64) -> Vector3<f64> {
        let (s, c) = t.sin_cos();
        self.centre + self.u * c + self.w * s
    }

    /// Angles where the circle meets the edge of a half-space.
    pub(super) fn crossings(&self, face: &Face) -> Option<[f64; 2]> {
        let constant = face.outward.dot(&self.centre) - face.offset;
        let (c, s) = (face.outward.dot(&self.u), face.outward.dot(&self.w));
        let reach = c.hypot(s);
        // A circle that touches has its point found where it is largest.
        (constant.abs() < reach).then(|| {
            let (middle, half) = (s.atan2(c), (-constant / reach).acos());
            [middle - half, middle + half]
        })
    }
}

/// A unit vector across another.
pub(super) fn across(axis: Vector3<f64>) -> Vector3<f64> {
    let least = if axis.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
    (least - axis * axis.dot(&least)).try_normalize(0.0).unwrap_or(least)
}

impl Region {
    pub(super) fn new(tilt: &Tilt) -> Self {
        let faces = match *tilt {
            Tilt::Box { roll_max_rad, pitch_max_rad, yaw_rad } => {
                let ((sin_pitch, cos_pitch), sin_roll) =
                    (pitch_max_rad.sin_cos(), roll_max_rad.sin());
                let pitch = |sign: f64| Face {
                    outward: Vector3::new(sign * cos_pitch, 0.0, -sin_pitch),
                    offset: 0.0,
                };
                let roll =
                    |sign: f64| Face { outward: Vector3::new(0.0, sign, 0.0), offset: sin_roll };
                let turn = |face: Face| Face { outward: turned(face.outward, yaw_rad), ..face };
                [pitch(1.0), pitch(-1.0), roll(1.0), roll(-1.0)].map(turn).to_vec()
            }
            Tilt::Cone { max_rad } => vec![Face { outward: -Vector3::z(), offset: -max_rad.cos() }],
        };
        Self { faces }
    }

    /// Whether a unit vector is in it.
    pub(super) fn contains(&self, n: Vector3<f64>) -> bool {
        self.faces.iter().all(|face| face.outward.dot(&n) <= face.offset + SLACK)
    }

    /// The part between two sines above the plane across `axis`.
    pub(super) fn band(&self, axis: Vector3<f64>, [low, high]: [f64; 2]) -> Self {
        let mut faces = self.faces.clone();
        faces.push(Face { outward: axis, offset: high });
        faces.push(Face { outward: -axis, offset: -low });
        Self { faces }
    }

    /// The circles that bound it.
    pub(super) fn edges(&self) -> impl Iterator<Item = Circle> {
        let circle = |face: &Face| Circle::around(face.outward, face.offset, across(face.outward));
        self.faces.iter().filter(|face| face.offset.abs() < 1.0).map(circle)
    }

    /// Where `direction . n` is largest; nowhere in a set without points.
    pub(super) fn furthest(&self, direction: Vector3<f64>) -> Option<Vector3<f64>> {
        let own = direction.try_normalize(0.0).unwrap_or(Vector3::z());
        if self.contains(own) {
            return Some(own);
        }
        let mut best: Option<Vector3<f64>> = None;
        let mut offer = |n: Vector3<f64>| {
            if best.is_none_or(|best| direction.dot(&n) > direction.dot(&best)) && self.contains(n)
            {
                best = Some(n);
            }
        };
        for edge in self.edges() {
            offer(edge.at(direction.dot(&edge.w).atan2(direction.dot(&edge.u))));
            for t in self.faces.iter().filter_map(|face| edge.crossings(face)).flatten() {
                offer(edge.at(t));
            }
        }
        best
    }

    /// Arcs of a circle that lie in it, as angles that rise.
    pub(super) fn arcs(&self, circle: &Circle) -> Vec<[f64; 2]> {
        let crossings = self.faces.iter().filter_map(|face| circle.crossings(face)).flatten();
        let mut cuts: Vec<f64> = crossings.map(|t| t.rem_euclid(TAU)).collect();
        cuts.sort_by(f64::total_cmp);
        let first = cuts.first().copied().unwrap_or(0.0);
        cuts.push(first + TAU);
        let starts = std::iter::once(first).chain(cuts.iter().copied());
        let pieces = starts.zip(cuts.iter().copied()).map(|(from, to)| [from, to]);
        pieces
            .filter(|[from, to]| to > from && self.contains(circle.at(0.5 * (from + to))))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: Tilt = Tilt::Box { roll_max_rad: 0.4, pitch_max_rad: 0.6, yaw_rad: 0.7 };

    /// The square covers the set and nothing else, and its density adds up to the solid angle of
    /// the arcs of a cap.
    #[test]
    fn the_square_is_the_region() {
        for tilt in [BOX, Tilt::Cone { max_rad: 0.5 }] {
            let region = Region::new(&tilt);
            for (p, q) in [(0.0, 0.0), (1.0, 0.3), (0.5, 1.0), (0.2, 0.9)] {
                let (n, _) = tilt.normal(p, q);
                assert!(region.contains(n) && (n.norm() - 1.0).abs() < 1e-14, "{tilt:?} {p} {q}");
            }
            assert!(!region.contains(tilt.normal(1.02, 0.5).0), "{tilt:?}");
        }
        assert!(
            (Tilt::Cone { max_rad: 0.5 }.normal(0.1, 0.1).1 - TAU * (1.0 - 0.5_f64.cos())).abs()
                < 1e-14
        );
    }

    /// The furthest point is as far as the best of a fine grid and a little farther.
    #[test]
    fn the_furthest_normal_beats_a_grid() {
        for tilt in [BOX, Tilt::Cone { max_rad: 0.5 }] {
            let region = Region::new(&tilt);
            for k in 0..50 {
                let t = f64::from(k) * 0.37;
                let d = Vector3::new(t.cos(), (1.7 * t).sin(), (0.6 * t).cos());
                let found = region.furthest(d).unwrap();
                let grid =
                    (0..=100).flat_map(|i| (0..=100).map(move |j| (f64::from(i), f64::from(j))));
                let best = grid
                    .map(|(i, j)| tilt.normal(0.01 * i, 0.01 * j).0.dot(&d))
                    .fold(f64::MIN, f64::max);
                assert!(region.contains(found), "{tilt:?} {d}");
                assert!(
                    (0.0..2e-3).contains(&(found.dot(&d) - best + 1e-12)),
                    "{tilt:?} {d}: {best}"
                );
            }
        }
    }
}
