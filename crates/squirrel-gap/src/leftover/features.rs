//! What a leftover may go with: families of features of the flight, and how well each predicts it
//! where it was not fitted.

use crate::predictor::{Motion, Predictor, Track};
use nalgebra::{DMatrix, DVector, Matrix2, Vector2, Vector3};

/// The family of features by which an autopilot answers what disturbs it.
pub(super) const THROTTLE: &str = "throttle";

/// Parts of all flights, each left out once.
const FOLDS: usize = 8;

/// A family of features: what a leftover would be said to go with.
pub(super) struct Family {
    pub(super) name: &'static str,
    /// One row a block of the leftover, in the order of tracks and time.
    pub(super) rows: Vec<Vec<f64>>,
}

/// Where the vehicle was in one block of the leftover.
pub(crate) struct Moment {
    pub(crate) flight: usize,
    pub(crate) time_s: f64,
    pub(crate) duration_s: f64,
    pub(crate) position: Vector3<f64>,
    pub(crate) velocity_body: Vector3<f64>,
    pub(crate) velocity_ned: Vector3<f64>,
    pub(crate) omega: Vector3<f64>,
    pub(crate) heading_rad: f64,
    pub(crate) ned_from_body: nalgebra::Matrix3<f64>,
    pub(crate) throttle: f64,
    pub(crate) wings: f64,
    pub(crate) voltage_v: f64,
}

/// Means over a block of rows of the residual.
pub(crate) fn moment(
    predictor: &Predictor,
    track: &Track,
    motion: &Motion,
    first: usize,
    rows: usize,
) -> Moment {
    let start = track.edge() + first * track.every;
    let end = (start + rows * track.every).min(track.time_s.len());
    let middle = usize::midpoint(start, end).min(track.time_s.len() - 1);
    let body = &motion.body[middle];
    let q = body.ned_from_body().quaternion;
    let time_s = track.time_s[middle];
    let (throttle, wings) = predictor.commanded(track.flight, time_s);
    let last_s = track.time_s[track.time_s.len() - 1];
    let horizontal = horizontal_position(track, time_s);
    let velocity = body.velocity.vector;
    let mean = |v: &[Vector3<f64>]| {
        v[start..end].iter().sum::<Vector3<f64>>() / (end - start).max(1) as f64
    };
    Moment {
        flight: track.flight,
        time_s: time_s - track.began_s,
        duration_s: last_s - track.began_s,
        position: Vector3::new(horizontal.x, horizontal.y, body.position.vector.z),
        velocity_body: q.inverse() * velocity,
        velocity_ned: velocity,
        omega: mean(track.omega()),
        heading_rad: q.euler_angles().2,
        ned_from_body: q.to_rotation_matrix().into_inner(),
        throttle,
        wings,
        voltage_v: track.voltage_v[middle],
    }
}

fn horizontal_position(track: &Track, time_s: f64) -> Vector3<f64> {
    let fixes = track.position();
    let after = fixes.partition_point(|(t, _)| *t <= time_s);
    match (fixes.get(after.wrapping_sub(1)), fixes.get(after)) {
        (Some((t0, p0)), Some((t1, p1))) => p0 + (p1 - p0) * ((time_s - t0) / (t1 - t0)),
        (Some((_, p)), None) | (None, Some((_, p))) => *p,
        (None, None) => Vector3::zeros(),
    }
}

/// Every family at the moments of the leftover.
pub(super) fn families(moments: &[Moment]) -> Vec<Family> {
    let family = |name, row: &dyn Fn(&Moment) -> Vec<f64>| Family {
        name,
        rows: moments.iter().map(row).collect(),
    };
    let flights = moments.iter().map(|m| m.flight).max().map_or(0, |f| f + 1);
    let down = |m: &Moment, v: Vector3<f64>| m.ned_from_body.tr_mul(&v);
    vec![
        family("time in flight", &|m| {
            // Steps at eighths of the flight, and a line, for each flight by itself.
            let mut row = vec![0.0; flights * 8];
            for step in 0..7 {
                row[m.flight * 8 + step] =
                    f64::from(m.time_s > m.duration_s * (step + 1) as f64 / 8.0);
            }
            row[m.flight * 8 + 7] = m.time_s / m.duration_s;
            row
        }),
        family("position", &|m| {
            let p = m.position * 0.2;
            let mut row = Vec::new();
            for direction in [Vector3::x(), Vector3::y(), Vector3::z()] {
                let d = down(m, direction).sum();
                row.extend([p.x * d, p.y * d, p.z * d, d]);
            }
            row.extend([p.x, p.y, p.z, p.x * p.x, p.y * p.y, p.x * p.y, p.z * p.z]);
            row
        }),
        family("velocity", &|m| {
            let (v, w) = (m.velocity_body, m.velocity_ned);
            let mut row: Vec<f64> = v.iter().copied().chain(w.iter().copied()).collect();
            row.extend(v.iter().map(|x| x * x.abs()));
            row.extend(v.iter().map(|x| x * x));
            row.extend(v.iter().map(|x| x.powi(3)));
            row.extend([v.x * v.y, v.y * v.z, v.x * v.z]);
            row
        }),
        family("angular rates", &|m| {
            let w = m.omega;
            vec![
                w.x,
                w.y,
                w.z,
                w.x * w.x,
                w.y * w.y,
                w.z * w.z,
                w.x * w.y,
                w.y * w.z,
                w.x * w.z,
                w.z.abs(),
                w.x.abs(),
                w.y.abs(),
            ]
        }),
        family(THROTTLE, &|m| {
            let u = m.throttle;
            vec![u, u * u, u.powi(3)]
        }),
        family("wings", &|m| {
            let (d, v) = (m.wings, m.velocity_body);
            vec![d, d * v.x, d * v.y, d * v.z, d * v.norm(), d * v.x * v.x, d * v.z * v.z]
        }),
        family("heading", &|m| {
            let (s, c) = m.heading_rad.sin_cos();
            vec![s, c, s * c, c * c - s * s]
        }),
        family("battery voltage", &|m| vec![m.voltage_v, m.voltage_v * m.voltage_v]),
    ]
}

/// Distance over which a place has one force, m, and time after which one comes back to it and does
/// not linger, s.
const PLACE_M: f64 = 1.5;
const AWAY_S: f64 = 5.0;
/// Moments of all flights that are compared with each other.
const MOMENTS_MAX: usize = 1500;

/// Part of the variance of a horizontal force in the world that the force at the same place at
/// other times predicts, 0 to 1: moving air forgets a place, and what is fixed to one does not.
///
/// * `force` - body x and y, a number a moment
pub(super) fn place_share(moments: &[Moment], force: [&[f64]; 2]) -> f64 {
    let ned: Vec<Vector3<f64>> = moments
        .iter()
        .zip(force[0].iter().zip(force[1]))
        .map(|(m, (x, y))| {
            let turned = m.ned_from_body * Vector3::new(*x, *y, 0.0);
            Vector3::new(turned.x, turned.y, 0.0)
        })
        .collect();
    let (mut error, mut total) = (0.0, 0.0);
    // Long flights come to a place often enough in every so-manieth moment.
    let every = moments.len().div_ceil(MOMENTS_MAX).max(1);
    for (own, force) in moments.iter().zip(&ned).step_by(every) {
        let (mut sum, mut weight) = (Vector3::zeros(), 1.0);
        for (other, theirs) in moments.iter().zip(&ned).step_by(every) {
            if own.flight != other.flight || (own.time_s - other.time_s).abs() > AWAY_S {
                let w = (-0.5 * (own.position - other.position).norm_squared()
                    / (PLACE_M * PLACE_M))
                    .exp();
                sum += theirs * w;
                weight += w;
            }
        }
        error += (force - sum / weight).norm_squared();
        total += force.norm_squared();
    }
    if total > 0.0 { (1.0 - error / total).clamp(0.0, 1.0) } else { 0.0 }
}

/// Part of the power of a horizontal force along the axis on which most of it lies, of the body or
/// of the world, 0.5 to 1.
///
/// * `force` - body x and y, a number a moment
pub(super) fn one_way(moments: &[Moment], force: [&[f64]; 2]) -> f64 {
    let (mut body, mut world) = (Matrix2::zeros(), Matrix2::zeros());
    for (moment, (x, y)) in moments.iter().zip(force[0].iter().zip(force[1])) {
        let own = Vector2::new(*x, *y);
        let turned = moment.ned_from_body * Vector3::new(*x, *y, 0.0);
        body += own * own.transpose();
        world += turned.xy() * turned.xy().transpose();
    }
    let largest = |power: Matrix2<f64>| {
        let total = power.trace();
        if total > 0.0 { power.symmetric_eigenvalues().max() / total } else { 0.5 }
    };
    largest(body).max(largest(world))
}

/// Part of the variance of `y` that a family predicts in blocks that were left out, 0 to 1: what
/// lasts goes with nothing.
pub(super) fn predicted_share(family: &Family, y: &[f64]) -> f64 {
    let n = y.len();
    let k = family.rows.first().map_or(0, Vec::len) + 1;
    if n < 4 * k || n < 4 * FOLDS {
        return 0.0;
    }
    // Features in units of their spread, with a constant; a column a moment.
    let mut x = DMatrix::from_element(k, n, 1.0);
    for column in 1..k {
        let values: Vec<f64> = family.rows.iter().map(|row| row[column - 1]).collect();
        let mean = values.iter().sum::<f64>() / n as f64;
        let spread = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n as f64).sqrt();
        for (row, value) in values.iter().enumerate() {
            x[(column, row)] = if spread > 1e-9 { (value - mean) / spread } else { 0.0 };
        }
    }
    let (mut error, mut total) = (0.0, 0.0);
    let size = n.div_ceil(FOLDS);
    let block = |fold: usize| (fold * size).min(n)..((fold + 1) * size).min(n);
    let products: Vec<_> = (0..FOLDS)
        .map(|fold| {
            let (mut gram, mut right) = (DMatrix::zeros(k, k), DVector::zeros(k));
            for row in block(fold) {
                right.axpy(y[row], &x.column(row), 1.0);
                gram.syger(1.0, &x.column(row), &x.column(row), 1.0);
            }
            (gram, right)
        })
        .collect();
    for fold in 0..FOLDS {
        let held = block(fold);
        let mut gram = DMatrix::identity(k, k) * (0.01 * n as f64);
        gram[(0, 0)] = 1e-6;
        let mut right = DVector::zeros(k);
        for (_, (others, theirs)) in products.iter().enumerate().filter(|(other, _)| *other != fold)
        {
            gram += others;
            right += theirs;
        }
        let Some(factor) = gram.cholesky() else { return 0.0 };
        let theta = factor.solve(&right);
        let mean =
            (y.iter().sum::<f64>() - y[held.clone()].iter().sum::<f64>()) / (n - held.len()) as f64;
        for row in held {
            let predicted: f64 = x.column(row).dot(&theta);
            error += (y[row] - predicted).powi(2);
            total += (y[row] - mean).powi(2);
        }
    }
    if total > 0.0 { (1.0 - error / total).clamp(0.0, 1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A vehicle that turns once while a force comes from one side of it, or of the world, or from
    /// all.
    #[test]
    fn a_force_along_one_axis_of_body_or_world_is_told_from_gusts() {
        let moments: Vec<Moment> =
            (0..400).map(|i| turned(f64::from(i) * std::f64::consts::TAU / 400.0)).collect();
        let blow = |i: usize| (0.7 * i as f64).sin();
        let along = |force: &dyn Fn(usize, &Moment) -> Vector3<f64>| {
            let body: Vec<Vector3<f64>> =
                moments.iter().enumerate().map(|(i, m)| force(i, m)).collect();
            let [x, y] = [0, 1].map(|axis| body.iter().map(|f| f[axis]).collect::<Vec<_>>());
            one_way(&moments, [&x, &y])
        };
        assert!(along(&|i, _| Vector3::new(0.6, 0.8, 0.0) * blow(i)) > 0.99);
        assert!(
            along(&|i, m| m.ned_from_body.tr_mul(&Vector3::new(0.6, 0.8, 0.0)) * blow(i)) > 0.99
        );
        assert!(along(&|i, _| Vector3::new(blow(i), blow(3 * i + 1), 0.0)) < 0.6);
    }

    /// A constant is predicted by any family that has one, and goes with none.
    #[test]
    fn what_lasts_goes_with_nothing() {
        let wave = |i: usize| (0.3 * i as f64).sin();
        let family = Family { name: "wave", rows: (0..400).map(|i| vec![wave(i)]).collect() };
        let share = |of: f64| {
            // Without a rhythm, so that no block knows of another.
            let y: Vec<f64> =
                (0..400).map(|i| 5.0 + (37.7 * (i * i) as f64).sin() + of * wave(i)).collect();
            predicted_share(&family, &y)
        };
        assert!(share(0.0) < 0.02 && share(10.0) > 0.95, "{} {}", share(0.0), share(10.0));
    }

    fn turned(heading_rad: f64) -> Moment {
        let turn = nalgebra::Rotation3::from_euler_angles(0.0, 0.0, heading_rad);
        Moment {
            flight: 0,
            time_s: 0.0,
            duration_s: 1.0,
            position: Vector3::zeros(),
            velocity_body: Vector3::zeros(),
            velocity_ned: Vector3::zeros(),
            omega: Vector3::zeros(),
            heading_rad,
            ned_from_body: turn.into_inner(),
            throttle: 0.5,
            wings: 0.0,
            voltage_v: 16.0,
        }
    }
}
