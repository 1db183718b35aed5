//! Mixer: collective thrust and torque to rotor thrusts, within what each rotor can give.
//!
//! Paper, eq. 1 and 2: `F = T^-1 U` with the rows of `T` the thrust, roll, pitch and yaw that one
//! newton of each rotor gives. Here `T` comes from the vehicle's geometry, for any layout: rotor i
//! gives `(1, -y_i, x_i, s_i k_m / k_f)`, and `F = T^+ U` has the smallest norm where there are
//! more than four rotors. (The printed `T` has `d_fr` in the pitch row; it must be `d_fp`:
//! docs/equations.md T2.)
//!
//! Where a rotor would leave `[0, F_max]`, priority is roll and pitch over thrust over yaw,
//! exactly, in this order:
//! 1. the largest share `s <= 1` of the roll and pitch torque, direction kept, that some thrust and
//!    yaw allow;
//! 2. the thrust nearest to the demand that some yaw allows at that `s`;
//! 3. the yaw torque nearest to the demand at both.
//!
//! `F_max` is the vehicle's limit at the reference voltage; [`Mixer::allocate_within`] takes
//! what the battery leaves of it.
//!
//! The rule itself is [`mix`](super::mix), on lanes: flight and batches have the same.

use super::mix::{FLAT, Table};
use crate::math::upper;
use crate::vehicle::{MAX_ROTORS, ParameterError, PerRotor, Vehicle};
use nalgebra::{Matrix4, SMatrix, Vector3};

/// Collective thrust and torque.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThrustTorque {
    /// Collective thrust, N, >= 0.
    pub thrust_n: f32,
    /// Torque about the body axes, N m.
    pub torque_n_m: Vector3<f32>,
}

impl ThrustTorque {
    fn scaled(&self, by: f32) -> Self {
        Self { thrust_n: self.thrust_n * by, torque_n_m: self.torque_n_m * by }
    }
}

/// Rotor thrusts and what they achieve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MixerTerms {
    /// Thrust of each rotor, N, within `[0, F_max]`.
    pub rotor_thrust_n: PerRotor<f32>,
    /// What these thrusts amount to.
    pub achieved: ThrustTorque,
    /// Share of the roll and pitch demand that is met, 0..1.
    pub roll_pitch_share: f32,
    /// Some part of the demand is not met.
    pub saturated: bool,
}

/// The allocation of one vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mixer {
    count: usize,
    table: Table<f32, MAX_ROTORS>,
    /// Thrust, roll, pitch and yaw torque of one newton of each rotor.
    effectiveness: [[f32; 4]; MAX_ROTORS],
}

impl Mixer {
    /// # Errors
    /// A layout that cannot hover or cannot roll and pitch, with the field of the vehicle file.
    pub fn new(vehicle: &Vehicle<f32>) -> Result<Self, ParameterError> {
        let count = vehicle.rotors().len();
        let propulsion = &vehicle.parameters().propulsion;
        let torque_per_thrust =
            propulsion.torque_coefficient_n_m_s2 / propulsion.thrust_coefficient_n_s2;
        let mut t = SMatrix::<f32, 4, MAX_ROTORS>::zeros();
        for (i, rotor) in vehicle.rotors().iter().enumerate() {
            let r = rotor.position.vector;
            t.set_column(
                i,
                &nalgebra::Vector4::new(1.0, -r.y, r.x, rotor.yaw_sign * torque_per_thrust),
            );
        }
        let inverse = pseudo_inverse(&t)?;
        let reached = t * inverse;
        for axis in 0..3 {
            if !((reached[(axis, axis)] - 1.0).abs() < 1e-3) {
                return Err(ParameterError::at(
                    "rotor[].position_body_m",
                    axis,
                    reached[(axis, axis)],
                    "the layout cannot produce thrust (0), roll (1) or pitch (2) on its own",
                ));
            }
        }
        let column = |k: usize| {
            let mut out = [0.0; MAX_ROTORS];
            for (i, x) in out.iter_mut().enumerate() {
                *x = inverse[(i, k)];
            }
            out
        };
        let collective = column(0);
        for (i, b) in collective[..count].iter().enumerate() {
            if !(*b > 1e-3) {
                return Err(ParameterError::at(
                    "rotor[].position_body_m",
                    i,
                    *b,
                    "in hover this rotor would carry no thrust (share must be > 0.001)",
                ));
            }
        }
        // The yaw column is scaled to the size of the thrust column, so that all slopes below are
        // of order one.
        let yaw_raw = column(3);
        let largest = |c: &PerRotor<f32>| c.iter().fold(0.0, |m, x| upper(m, x.abs()));
        let (yaw_size, collective_size) = (largest(&yaw_raw), largest(&collective));
        let yaw_unit_n_m = if yaw_size > 0.0 { collective_size / yaw_size } else { 0.0 };
        let mut effectiveness = [[0.0; 4]; MAX_ROTORS];
        for (i, rotor) in effectiveness.iter_mut().enumerate() {
            for (k, x) in rotor.iter_mut().enumerate() {
                *x = t[(k, i)];
            }
        }
        let yaw = yaw_raw.map(|c| c * yaw_unit_n_m);
        let thrust_max_n = vehicle.rotor_thrust_max_n();
        let none = [0.0; MAX_ROTORS];
        let (mut is_there, mut yaw_share, mut full_share_n) = (none, none, none);
        for (i, b) in collective[..count].iter().enumerate() {
            (is_there[i], yaw_share[i], full_share_n[i]) = (1.0, yaw[i] / b, thrust_max_n / b);
        }
        let differ = |i: usize, j: usize| (yaw_share[i] - yaw_share[j]).abs() > FLAT;
        let has_three_kinds = (0..count)
            .any(|i| (0..i).any(|j| differ(i, j) && (0..j).any(|k| differ(i, k) && differ(j, k))));
        let table = Table {
            is_there,
            collective,
            roll: column(1),
            pitch: column(2),
            yaw,
            yaw_share,
            full_share_n,
            thrust_max_n,
            yaw_unit_n_m,
            three_kinds: if has_three_kinds { 1.0 } else { 0.0 },
        };
        Ok(Self { count, table, effectiveness })
    }

    /// Thrust of each rotor at its limit, N.
    pub fn rotor_thrust_max_n(&self) -> f32 {
        self.table.thrust_max_n
    }

    /// What the rule takes of this layout.
    pub fn table(&self) -> &Table<f32, MAX_ROTORS> {
        &self.table
    }

    /// Rotor thrusts for a demand. Total: non-finite demands count as zero.
    pub fn allocate(&self, demand: &ThrustTorque) -> MixerTerms {
        let mixed = self.table.mix(self.count, demand.thrust_n, demand.torque_n_m.into());
        let mut sum = [0.0; 4];
        for i in 0..self.rotors() {
            for (total, part) in sum.iter_mut().zip(&self.effectiveness[i]) {
                *total += part * mixed.rotor_thrust_n[i];
            }
        }
        MixerTerms {
            rotor_thrust_n: mixed.rotor_thrust_n,
            achieved: ThrustTorque {
                thrust_n: sum[0],
                torque_n_m: Vector3::new(sum[1], sum[2], sum[3]),
            },
            roll_pitch_share: mixed.roll_pitch_share,
            saturated: mixed.saturated > 0.0,
        }
    }

    /// [`Self::allocate`] with another limit of each rotor's thrust, N, > 0: the rule knows shares
    /// of the limit only.
    pub fn allocate_within(&self, thrust_max_n: f32, demand: &ThrustTorque) -> MixerTerms {
        let larger = thrust_max_n / self.table.thrust_max_n;
        let mut terms = self.allocate(&demand.scaled(1.0 / larger));
        terms.rotor_thrust_n = terms.rotor_thrust_n.map(|thrust_n| thrust_n * larger);
        terms.achieved = terms.achieved.scaled(larger);
        terms
    }

    /// Number of rotors, with the bound that [`Vehicle`] keeps: here the compiler sees that no loop
    /// leaves an array.
    fn rotors(&self) -> usize {
        self.count.min(MAX_ROTORS)
    }
}

/// `T^T (T T^T)^-1`; a yaw row of zeros is left out.
fn pseudo_inverse(
    t: &SMatrix<f32, 4, MAX_ROTORS>,
) -> Result<SMatrix<f32, MAX_ROTORS, 4>, ParameterError> {
    let mut scaled = *t;
    let mut scale = [1.0; 4];
    for (k, s) in scale.iter_mut().enumerate() {
        let size = t.row(k).norm();
        if size > 0.0 {
            *s = 1.0 / size;
        }
        for x in scaled.row_mut(k).iter_mut() {
            *x *= *s;
        }
    }
    let mut gram: Matrix4<f32> = scaled * scaled.transpose();
    if gram[(3, 3)] == 0.0 {
        gram[(3, 3)] = 1.0;
    }
    let inverse = gram.try_inverse().filter(|m| m.amax() < 1e4).ok_or(ParameterError {
        field: "rotor[].position_body_m",
        index: None,
        value: f64::from(gram.determinant()),
        reason: "the layout cannot control thrust, roll, pitch and yaw independently; determinant",
    })?;
    let mut out = scaled.transpose() * inverse;
    for (k, s) in scale.iter().enumerate() {
        for x in out.column_mut(k).iter_mut() {
            *x *= *s;
        }
    }
    Ok(out)
}
