//! Vectors of three lanes, matrices by columns and quaternions `[w, x, y, z]`, as plain arrays.
//!
//! The same sums in the same order as nalgebra's, which would not be compiled for the registers
//! that it is called on: code must end up in the function that was compiled for them, so there are
//! no closures and no iterators in here.

use super::Lane;
use super::functions::{angle, sign, size};
use core::f64::consts::PI;

/// `a - b`.
#[inline(always)]
pub fn minus<L: Lane>(a: &[L; 3], b: &[L; 3]) -> [L; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `a + b`.
#[inline(always)]
pub fn plus<L: Lane>(a: &[L; 3], b: &[L; 3]) -> [L; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// `a` times a number.
#[inline(always)]
pub fn scaled<L: Lane>(a: &[L; 3], by: L) -> [L; 3] {
    [a[0] * by, a[1] * by, a[2] * by]
}

/// Scalar product.
#[inline(always)]
pub fn dot<L: Lane>(a: &[L; 3], b: &[L; 3]) -> L {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Vector product.
#[inline(always)]
pub fn cross<L: Lane>(a: &[L; 3], b: &[L; 3]) -> [L; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Matrix times vector.
#[inline(always)]
pub fn times<L: Lane>(columns: &[[L; 3]; 3], v: &[L; 3]) -> [L; 3] {
    let mut product = *v;
    for row in 0..3 {
        product[row] = columns[0][row] * v[0] + columns[1][row] * v[1] + columns[2][row] * v[2];
    }
    product
}

/// Transposed matrix times vector.
#[inline(always)]
pub fn transposed_times<L: Lane>(columns: &[[L; 3]; 3], v: &[L; 3]) -> [L; 3] {
    [dot(&columns[0], v), dot(&columns[1], v), dot(&columns[2], v)]
}

/// `x + h rate`.
#[inline(always)]
pub fn plus_scaled<L: Lane, const N: usize>(x: &[L; N], h: L, rate: &[L; N]) -> [L; N] {
    let mut sum = *x;
    for n in 0..N {
        sum[n] = x[n] + rate[n] * h;
    }
    sum
}

/// The rotation to the world as a matrix by columns.
#[inline(always)]
pub fn rotation<L: Lane>(attitude: &[L; 4]) -> [[L; 3]; 3] {
    let [w, i, j, k] = *attitude;
    let two = L::of(2.0);
    let (ww, ii, jj, kk) = (w * w, i * i, j * j, k * k);
    let (ij, wk, wj) = (i * j * two, w * k * two, w * j * two);
    let (ik, jk, wi) = (i * k * two, j * k * two, w * i * two);
    [
        [ww + ii - jj - kk, wk + ij, ik - wj],
        [ij - wk, ww - ii + jj - kk, wi + jk],
        [wj + ik, jk - wi, ww - ii - jj + kk],
    ]
}

/// Heading of an attitude, rad, in [-pi, pi]; 0 where the nose points straight up or down.
#[inline(always)]
pub fn heading<L: Lane>(attitude: &[L; 4]) -> L {
    let [w, i, j, k] = *attitude;
    let north = w * w + i * i - j * j - k * k;
    let east = (i * j + w * k) * L::of(2.0);
    let length = (north * north + east * east).root().upper(L::of(1e-12));
    let turned = angle(size(east) / length, size(north) / length);
    let turned = (L::of(0.0) - north).where_positive(L::of(PI) - turned, turned);
    turned * sign(east)
}

/// The quaternion of length one.
#[inline(always)]
pub fn unit<L: Lane>(attitude: &[L; 4]) -> [L; 4] {
    let [w, i, j, k] = *attitude;
    let norm = ((i * i + k * k) + (j * j + w * w)).root();
    let inverse = L::of(1.0) / norm;
    [w * inverse, i * inverse, j * inverse, k * inverse]
}
