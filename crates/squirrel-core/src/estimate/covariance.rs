//! Arithmetic of the error-state filter's covariance, in place and without a product of large
//! matrices.
//!
//! Sums are in the order in which such products have them, so that the bits are theirs. No index
//! here can leave a panic in the code.

use nalgebra::{Matrix3, SMatrix, SVector};

/// Numbers of the error's state: position, velocity, turn, bias of the accelerometer, bias of the
/// gyro.
pub const STATES: usize = 15;
pub(super) const POSITION: usize = 0;
pub(super) const VELOCITY: usize = 3;
pub(super) const TURN: usize = 6;
pub(super) const ACCEL_BIAS: usize = 9;
pub(super) const GYRO_BIAS: usize = 12;

/// Covariance of the error.
pub type Covariance = SMatrix<f32, STATES, STATES>;
/// The Jacobian of a measured number, or a correction of the state.
pub(super) type StateVector = SVector<f32, STATES>;

/// How a step carries an error on: what F differs from the identity by.
pub(super) struct Carry {
    pub(super) of_turn: Matrix3<f32>,
    pub(super) of_bias: Matrix3<f32>,
    pub(super) turning: Matrix3<f32>,
    pub(super) dt_s: f32,
}

impl Carry {
    /// `F P F'`: columns, then rows.
    pub(super) fn on(&self, covariance: &mut Covariance) {
        let columns = &mut covariance.data.0;
        for column in columns.iter_mut() {
            self.step(column);
        }
        for i in 0..STATES {
            let mut row = [0.0; STATES];
            for (x, column) in row.iter_mut().zip(columns.iter()) {
                *x = column[i];
            }
            self.step(&mut row);
            for (x, column) in row.iter().zip(columns.iter_mut()) {
                column[i] = *x;
            }
        }
    }

    /// Position, velocity, turn, in this order: each takes what the next was before.
    fn step(&self, error: &mut [f32; STATES]) {
        let [px, py, pz, vx, vy, vz, tx, ty, tz, ax, ay, az, gx, gy, gz] = error;
        let dt_s = self.dt_s;
        for (p, v) in [(px, &*vx), (py, &*vy), (pz, &*vz)] {
            *p += *v * dt_s;
        }
        let by_turn = times(&self.of_turn, [*tx, *ty, *tz]);
        let by_bias = times(&self.of_bias, [*ax, *ay, *az]);
        for (i, v) in [vx, vy, vz].into_iter().enumerate() {
            *v = *v + by_turn[i] + by_bias[i];
        }
        let turned = times(&self.turning, [*tx, *ty, *tz]);
        for (i, (t, g)) in [(tx, gx), (ty, gy), (tz, gz)].into_iter().enumerate() {
            *t = turned[i] - *g * dt_s;
        }
    }
}

/// A product that is spelled out: a loop over nine numbers is most of its own work.
#[inline(always)]
fn times(m: &Matrix3<f32>, [x, y, z]: [f32; 3]) -> [f32; 3] {
    [
        m.m11 * x + m.m12 * y + m.m13 * z,
        m.m21 * x + m.m22 * y + m.m23 * z,
        m.m31 * x + m.m32 * y + m.m33 * z,
    ]
}

/// `P H'`: the covariance of the state and a measured number, whose Jacobian is zero for most of
/// the state.
pub(super) fn cross_covariance(covariance: &Covariance, row: &StateVector) -> StateVector {
    let mut cross_covariance = StateVector::zeros();
    for (column, share) in covariance.column_iter().zip(row.iter()) {
        if *share != 0.0 {
            cross_covariance.axpy(*share, &column, 1.0);
        }
    }
    cross_covariance
}

/// What rounding made of a symmetric covariance, symmetric again.
pub(super) fn symmetrise(covariance: &mut Covariance) {
    let columns = &mut covariance.data.0;
    for i in 1..STATES {
        let (before, after) = columns.split_at_mut(i);
        let Some(column) = after.first_mut() else { return };
        for (j, other) in before.iter_mut().enumerate() {
            let mean = (other[i] + column[j]) * 0.5;
            (other[i], column[j]) = (mean, mean);
        }
    }
}

/// One number of a row.
pub(super) fn set(row: &mut StateVector, at: usize, value: f32) {
    if let Some(x) = row.get_mut(at) {
        *x = value;
    }
}

/// Changes three numbers of the diagonal. An index that is only a loop's would leave a panic in the
/// code.
pub(super) fn on_diagonal(covariance: &mut Covariance, part: usize, change: impl Fn(f32) -> f32) {
    for i in part..part + 3 {
        if let Some(x) = covariance.get_mut((i, i)) {
            *x = change(*x);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers without a pattern.
    fn number(i: usize, j: usize) -> f32 {
        ((i * 7 + j * 13) % 11) as f32 * 0.1 - 0.5
    }

    #[test]
    fn carrying_on_is_the_product_with_the_transition() {
        let [of_turn, of_bias, turning] =
            [1, 2, 3].map(|k| Matrix3::from_fn(|i, j| number(i + k, j)));
        let carry = Carry { of_turn, of_bias, turning, dt_s: 0.25 };
        let mut f = Covariance::identity();
        f.fixed_view_mut::<3, 3>(POSITION, VELOCITY).fill_diagonal(0.25);
        f.fixed_view_mut::<3, 3>(VELOCITY, TURN).copy_from(&of_turn);
        f.fixed_view_mut::<3, 3>(VELOCITY, ACCEL_BIAS).copy_from(&of_bias);
        f.fixed_view_mut::<3, 3>(TURN, TURN).copy_from(&turning);
        f.fixed_view_mut::<3, 3>(TURN, GYRO_BIAS).fill_diagonal(-0.25);
        let before = Covariance::from_fn(number);
        let mut carried = before;
        carry.on(&mut carried);
        assert!((carried - f * before * f.transpose()).amax() < 1e-5);
    }

    #[test]
    fn products_and_means_are_those_of_matrices() {
        let mut covariance = Covariance::from_fn(number);
        let mut row = StateVector::zeros();
        set(&mut row, TURN, 0.5);
        set(&mut row, POSITION, -2.0);
        set(&mut row, STATES, 1.0);
        assert_eq!(cross_covariance(&covariance, &row), covariance * row);
        let mean = (covariance + covariance.transpose()) * 0.5;
        symmetrise(&mut covariance);
        assert_eq!(covariance, mean);
        on_diagonal(&mut covariance, GYRO_BIAS, |_| 9.0);
        assert_eq!(covariance.diagonal().iter().filter(|x| **x > 8.0).count(), 3);
    }
}
