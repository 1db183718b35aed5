//! The rigid body: what force and moment make of its motion.
//!
//! `r'' = g e3 + R f / m`, `w' = J^-1 (M - w x J w)`, `q' = 1/2 q (0, w)`; matrices by columns,
//! quaternions `[w, x, y, z]`.

use crate::lane::Lane;
use crate::lane::vector::{cross, minus, plus, scaled, times};
use crate::math::GRAVITY_M_S2;

/// Acceleration over ground, world frame, m/s^2.
///
/// * `ned_from_body` - by columns
/// * `force` - body frame, without gravity, N
#[inline(always)]
pub fn acceleration<L: Lane>(
    ned_from_body: &[[L; 3]; 3],
    force: &[L; 3],
    inverse_mass: L,
) -> [L; 3] {
    let mut acceleration = times(ned_from_body, &scaled(force, inverse_mass));
    acceleration[2] = L::of(GRAVITY_M_S2) + acceleration[2];
    acceleration
}

/// Angular acceleration, body frame, rad/s^2.
///
/// * `inertia`, `inertia_inverse` - by columns
/// * `omega` - angular rate, rad/s
/// * `moment` - N m
#[inline(always)]
pub fn angular_acceleration<L: Lane>(
    [inertia, inertia_inverse]: [&[[L; 3]; 3]; 2],
    omega: &[L; 3],
    moment: &[L; 3],
) -> [L; 3] {
    let gyroscopic = cross(omega, &times(inertia, omega));
    times(inertia_inverse, &minus(moment, &gyroscopic))
}

/// Specific force beside the centre of mass, body frame, m/s^2: `f / m + w' x r + w x (w x r)`.
///
/// * `centre` - at it
/// * `omega`, `omega_dot` - rad/s and rad/s^2
/// * `place_m` - from it
#[inline(always)]
pub fn specific_force<L: Lane>(
    centre: &[L; 3],
    [omega, omega_dot]: [&[L; 3]; 2],
    place_m: &[L; 3],
) -> [L; 3] {
    let turning = cross(omega, &cross(omega, place_m));
    plus(centre, &plus(&cross(omega_dot, place_m), &turning))
}

/// Rate of the attitude, 1/s.
///
/// * `omega` - angular rate, rad/s
#[inline(always)]
pub fn attitude_rate<L: Lane>(attitude: &[L; 4], omega: &[L; 3]) -> [L; 4] {
    let half = L::of(0.5);
    let [w, i, j, k] = *attitude;
    let (p, q, r) = (omega[0] * half, omega[1] * half, omega[2] * half);
    [
        L::of(0.0) - i * p - j * q - k * r,
        w * p + j * r - k * q,
        w * q - i * r + k * p,
        w * r + i * q - j * p,
    ]
}
