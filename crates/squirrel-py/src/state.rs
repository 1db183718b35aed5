//! Motions as rows of arrays: position, velocity, attitude, angular rate, rotor speeds.

use crate::arguments::{Float, Rows};
use crate::error::value;
use nalgebra::{Quaternion, Vector3};
use pyo3::PyResult;
use squirrel_batch::BODY_NUMBERS;
use squirrel_core::dynamics::State;
use squirrel_core::frames::{Body, In, Ned, Rotation};
use squirrel_core::math::Real;
use squirrel_core::vehicle::MAX_ROTORS;

/// How far from 1 the norm of an attitude may be.
const NORM_SLACK: f64 = 1e-3;

/// The motion in a row.
pub(crate) fn state<T: Real>(row: &[T]) -> State<T> {
    let vector = |at: usize| Vector3::new(row[at], row[at + 1], row[at + 2]);
    let mut rotor_speed_rad_s = [T::zero(); MAX_ROTORS];
    let rotors = &row[BODY_NUMBERS..];
    rotor_speed_rad_s[..rotors.len()].copy_from_slice(rotors);
    State {
        position: In::new(vector(0)),
        velocity: In::new(vector(3)),
        attitude: Quaternion::new(row[6], row[7], row[8], row[9]),
        omega: In::new(vector(10)),
        rotor_speed_rad_s,
    }
}

/// Appends a motion as a row.
pub(crate) fn push<T: Real>(rows: &mut Vec<T>, state: &State<T>, rotors: usize) {
    let q = &state.attitude;
    rows.extend(state.position.vector.iter().chain(state.velocity.vector.iter()));
    rows.extend([q.w, q.i, q.j, q.k]);
    rows.extend(state.omega.vector.iter());
    rows.extend(&state.rotor_speed_rad_s[..rotors]);
}

/// Refuses rows whose attitude is no rotation.
///
/// * `at` - column of the first of its four numbers
pub(crate) fn check_attitudes<T: Float + Real>(
    name: &str,
    numbers: &[T],
    width: usize,
    at: usize,
) -> PyResult<()> {
    for (i, row) in numbers.chunks_exact(width).enumerate() {
        let square: f64 = row[at..at + 4]
            .iter()
            .map(|x| nalgebra::try_convert(*x).unwrap_or(f64::NAN).powi(2))
            .sum();
        if !((square.sqrt() - 1.0).abs() < NORM_SLACK) {
            let norm = square.sqrt();
            return Err(value(format!(
                "{name}[{i}, {at}:{}]: norm {norm}, must be 1 to within {NORM_SLACK}",
                at + 4
            )));
        }
    }
    Ok(())
}

/// The rotations in rows of `w x y z`.
pub(crate) fn rotations(
    name: &str,
    rows: &Rows<'_, f32>,
) -> PyResult<Vec<Rotation<Ned, Body, f32>>> {
    check_attitudes(name, rows.numbers(), 4, 0)?;
    let rotations =
        rows.numbers().chunks_exact(4).map(|q| Rotation::from_wxyz([q[0], q[1], q[2], q[3]]));
    Ok(rotations.map(|rotation| rotation.unwrap_or_else(Rotation::identity)).collect())
}
