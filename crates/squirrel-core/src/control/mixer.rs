//! Mixer: collective thrust and torque to rotor thrusts, within what each rotor can give.
//!
//! Paper, eq. 1 and 2: `F = T^-1 U` with the rows of `T` the thrust, roll, pitch and yaw that one newton of each rotor
//! gives. Here `T` comes from the vehicle's geometry, for any layout: rotor i gives `(1, -y_i, x_i, s_i k_m / k_f)`, and
//! `F = T^+ U` has the smallest norm where there are more than four rotors. (The printed `T` has `d_fr` in the pitch row;
//! it must be `d_fp`: docs/equations.md T2.)
//!
//! Where a rotor would leave `[0, F_max]`, priority is roll and pitch over thrust over yaw, exactly, in this order:
//! 1. the largest share `s <= 1` of the roll and pitch torque, direction kept, that some thrust and yaw allow;
//! 2. the thrust nearest to the demand that some yaw allows at that `s`;
//! 3. the yaw torque nearest to the demand at both.
//!
//! `F_max` is the vehicle's limit at the reference voltage; it does not follow the measured battery voltage.
//!
//! Along `T^+` the rotor thrusts are `f_i = s a_i + u b_i + y c_i`, with `b_i > 0`; the code works with `f_i / b_i`. A weighted sum
//! of them lies between what the negative weights take at the thrust limit and what the positive ones give. Weights that take
//! `u` and `y` out of the sum bound `s`, and weights that take `y` out bound `u`. The shortest such sums are enough, because all
//! others are sums of these with positive factors: for `s` three rotors, or two with the same `c_i / b_i`; for `u` two, or one
//! without yaw. No iteration; for four rotors at most six sums each.

use crate::math::{limit, lower, upper};
use crate::vehicle::{MAX_ROTORS, ParameterError, PerRotor, Vehicle};
use nalgebra::{Matrix4, SMatrix, Vector3};

/// Slopes below this count as zero; all slopes are of order one by scaling.
const FLAT: f32 = 1e-4;

/// Collective thrust and torque.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThrustTorque {
    /// Collective thrust, N, >= 0.
    pub thrust_n: f32,
    /// Torque about the body axes, N m.
    pub torque_n_m: Vector3<f32>,
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
    thrust_max_n: f32,
    /// Columns of `T^+`: thrust per newton of collective, per newton metre of roll, pitch, and of scaled yaw.
    collective: PerRotor<f32>,
    roll: PerRotor<f32>,
    pitch: PerRotor<f32>,
    yaw: PerRotor<f32>,
    /// Scaled yaw and the thrust limit, each over the rotor's part of the collective.
    yaw_share: PerRotor<f32>,
    full_share_n: PerRotor<f32>,
    /// Three rotors differ in `yaw_share`: not where all turn one way or the other with equal strength.
    has_three_kinds: bool,
    /// Newton metres of yaw torque per unit of the scaled yaw variable.
    yaw_unit_n_m: f32,
    /// Thrust, roll, pitch and yaw torque of one newton of each rotor.
    effectiveness: [[f32; 4]; MAX_ROTORS],
}

/// A closed interval; empty where `low > high`.
#[derive(Clone, Copy)]
struct Interval {
    low: f32,
    high: f32,
}

impl Interval {
    const ALL: Self = Self { low: f32::NEG_INFINITY, high: f32::INFINITY };
    /// Keeps the part where `low <= slope * x <= high`.
    #[inline(always)]
    fn keep(&mut self, slope: f32, low: f32, high: f32) {
        if slope.abs() > FLAT {
            let (a, b) = (low / slope, high / slope);
            self.low = upper(self.low, lower(a, b));
            self.high = lower(self.high, upper(a, b));
        }
    }
    fn is_empty(self) -> bool {
        self.low > self.high + 1e-5
    }
}

impl Mixer {
    /// # Errors
    /// A layout that cannot hover or cannot roll and pitch, with the field of the vehicle file.
    pub fn new(vehicle: &Vehicle<f32>) -> Result<Self, ParameterError> {
        let count = vehicle.rotors().len();
        let propulsion = &vehicle.parameters().propulsion;
        let torque_per_thrust = propulsion.torque_coefficient_n_m_s2 / propulsion.thrust_coefficient_n_s2;
        let mut t = SMatrix::<f32, 4, MAX_ROTORS>::zeros();
        for (i, rotor) in vehicle.rotors().iter().enumerate() {
            let r = rotor.position.vector;
            t.set_column(i, &nalgebra::Vector4::new(1.0, -r.y, r.x, rotor.yaw_sign * torque_per_thrust));
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
        // The yaw column is scaled to the size of the thrust column, so that all slopes below are of order one.
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
        let (mut yaw_share, mut full_share_n) = ([0.0; MAX_ROTORS], [0.0; MAX_ROTORS]);
        for (i, b) in collective[..count].iter().enumerate() {
            (yaw_share[i], full_share_n[i]) = (yaw[i] / b, thrust_max_n / b);
        }
        let differ = |i: usize, j: usize| (yaw_share[i] - yaw_share[j]).abs() > FLAT;
        let has_three_kinds =
            (0..count).any(|i| (0..i).any(|j| differ(i, j) && (0..j).any(|k| differ(i, k) && differ(j, k))));
        Ok(Self {
            count,
            thrust_max_n,
            collective,
            roll: column(1),
            pitch: column(2),
            yaw,
            yaw_share,
            full_share_n,
            has_three_kinds,
            yaw_unit_n_m,
            effectiveness,
        })
    }

    /// Thrust of each rotor at its limit, N.
    pub fn rotor_thrust_max_n(&self) -> f32 {
        self.thrust_max_n
    }

    /// What rotor `i` gives of a demand that no limit is in the way of: per newton of thrust, and per newton metre of roll, pitch
    /// and yaw. Zeros beyond the last rotor.
    pub fn rotor_of_demand(&self, i: usize) -> [f32; 4] {
        let yaw = |y: f32| if self.yaw_unit_n_m > 0.0 { y / self.yaw_unit_n_m } else { 0.0 };
        let at = |column: &PerRotor<f32>| column.get(i).copied().unwrap_or(0.0);
        [at(&self.collective), at(&self.roll), at(&self.pitch), yaw(at(&self.yaw))]
    }

    /// Rotor thrusts for a demand. Total: non-finite demands count as zero.
    pub fn allocate(&self, demand: &ThrustTorque) -> MixerTerms {
        let finite = |x: f32| if x.is_finite() { x } else { 0.0 };
        let thrust = upper(finite(demand.thrust_n), 0.0);
        let torque = demand.torque_n_m.map(finite);
        let yaw = if self.yaw_unit_n_m > 0.0 { torque.z / self.yaw_unit_n_m } else { 0.0 };
        let mut tilt = [0.0; MAX_ROTORS];
        for i in 0..self.rotors() {
            tilt[i] = self.roll[i] * torque.x + self.pitch[i] * torque.y;
        }
        let (mut s, mut u, mut y) = (1.0, thrust, yaw);
        let saturated = !self.fits(&tilt, s, u, y);
        if saturated {
            let mut yaw_range = self.yaw_interval(&tilt, s, u);
            if yaw_range.is_empty() {
                (s, u) = self.share_and_thrust(&tilt, thrust);
                yaw_range = self.yaw_interval(&tilt, s, u);
            }
            y = limit(yaw, yaw_range.low, yaw_range.high);
        }
        self.terms(&tilt, s, u, y, saturated)
    }

    /// Number of rotors, with the bound that [`Vehicle`] keeps: here the compiler sees that no loop leaves an array.
    fn rotors(&self) -> usize {
        self.count.min(MAX_ROTORS)
    }

    fn rotor_thrust(&self, tilt: &PerRotor<f32>, i: usize, s: f32, u: f32, y: f32) -> f32 {
        s * tilt[i] + u * self.collective[i] + y * self.yaw[i]
    }

    fn fits(&self, tilt: &PerRotor<f32>, s: f32, u: f32, y: f32) -> bool {
        (0..self.rotors()).all(|i| {
            let f = self.rotor_thrust(tilt, i, s, u, y);
            f >= 0.0 && f <= self.thrust_max_n
        })
    }

    /// Yaw values that keep every rotor within its limits at a given share and thrust.
    fn yaw_interval(&self, tilt: &PerRotor<f32>, s: f32, u: f32) -> Interval {
        let mut range = Interval::ALL;
        for i in 0..self.rotors() {
            let rest = self.rotor_thrust(tilt, i, s, u, 0.0);
            if self.yaw[i].abs() <= FLAT {
                if rest < -1e-5 || rest > self.thrust_max_n + 1e-5 {
                    return Interval { low: f32::INFINITY, high: f32::NEG_INFINITY };
                }
                continue;
            }
            range.keep(self.yaw[i], -rest, self.thrust_max_n - rest);
        }
        if range.low == f32::NEG_INFINITY { Interval { low: 0.0, high: 0.0 } } else { range }
    }

    /// Steps 1 and 2: the largest share, then the nearest thrust.
    fn share_and_thrust(&self, tilt: &PerRotor<f32>, thrust: f32) -> (f32, f32) {
        let mut tilt_share = [0.0; MAX_ROTORS];
        for i in 0..self.rotors() {
            tilt_share[i] = tilt[i] / self.collective[i];
        }
        let share = self.largest_share(&tilt_share);
        let range = self.thrust_interval(&tilt_share, share);
        (share, limit(thrust, range.low, upper(range.low, range.high)))
    }

    /// The largest `s` in [0, 1] that some thrust and yaw allow: sums of rotors that neither of them changes limit it.
    fn largest_share(&self, tilt_share: &PerRotor<f32>) -> f32 {
        let (n, a, c, max) = (self.rotors(), tilt_share, &self.yaw_share, &self.full_share_n);
        let mut share = 1.0;
        let mut cut = |slope: f32, above: f32, below: f32| {
            let bound = if slope > 0.0 { above } else { below };
            // No division where it would not bind.
            if slope.abs() * share > bound {
                share = bound / slope.abs();
            }
        };
        for i in 0..n {
            for j in i + 1..n {
                let w_k = c[i] - c[j];
                if w_k.abs() <= FLAT {
                    cut(a[i] - a[j], max[i], max[j]);
                    continue;
                }
                if !self.has_three_kinds {
                    continue;
                }
                for k in j + 1..n {
                    let (w_i, w_j) = (c[j] - c[k], c[k] - c[i]);
                    // Else two of them make a shorter sum, which has its turn.
                    if w_i.abs() > FLAT && w_j.abs() > FLAT {
                        let [above, below] = sums([w_i * max[i], w_j * max[j], w_k * max[k]]);
                        cut(w_i * a[i] + w_j * a[j] + w_k * a[k], above, below);
                    }
                }
            }
        }
        share
    }

    /// Thrusts that some yaw allows at a given share: single rotors without yaw, and pairs whose sum yaw does not change.
    fn thrust_interval(&self, tilt_share: &PerRotor<f32>, s: f32) -> Interval {
        let (n, a, c, max) = (self.rotors(), tilt_share, &self.yaw_share, &self.full_share_n);
        let mut range = Interval::ALL;
        for i in 0..n {
            if c[i].abs() <= FLAT {
                range.keep(1.0, -s * a[i], max[i] - s * a[i]);
                continue;
            }
            for j in i + 1..n {
                let slope = c[j] - c[i];
                if c[j].abs() > FLAT && slope.abs() > FLAT {
                    let [above, below] = sums([c[j] * max[i], -c[i] * max[j]]);
                    let rest = s * (c[j] * a[i] - c[i] * a[j]);
                    range.keep(slope, -below - rest, above - rest);
                }
            }
        }
        range
    }

    fn terms(&self, tilt: &PerRotor<f32>, s: f32, u: f32, y: f32, saturated: bool) -> MixerTerms {
        let mut rotor_thrust_n = [0.0; MAX_ROTORS];
        let mut sum = [0.0; 4];
        for i in 0..self.rotors() {
            let f = limit(self.rotor_thrust(tilt, i, s, u, y), 0.0, self.thrust_max_n);
            rotor_thrust_n[i] = f;
            for (total, part) in sum.iter_mut().zip(&self.effectiveness[i]) {
                *total += part * f;
            }
        }
        let achieved = ThrustTorque { thrust_n: sum[0], torque_n_m: Vector3::new(sum[1], sum[2], sum[3]) };
        MixerTerms { rotor_thrust_n, achieved, roll_pitch_share: s, saturated }
    }
}

/// Sum of the positive terms, and of the negative ones without their sign.
#[inline(always)]
fn sums<const N: usize>(terms: [f32; N]) -> [f32; 2] {
    let (mut sum, mut size) = (0.0, 0.0);
    for term in terms {
        sum += term;
        size += term.abs();
    }
    [0.5 * (size + sum), 0.5 * (size - sum)]
}

/// `T^T (T T^T)^-1`; a yaw row of zeros is left out.
fn pseudo_inverse(t: &SMatrix<f32, 4, MAX_ROTORS>) -> Result<SMatrix<f32, MAX_ROTORS, 4>, ParameterError> {
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
