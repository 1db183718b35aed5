//! Margins of the attitude loop, from a vehicle's numbers and gains, and gains from margins.
//!
//! About hover each axis of both backstepping laws is a PID loop about an integrator of torque
//! (docs/equations.md B.4), rotors lag and everything that is late is one delay:
//!
//! ```text
//! L(s) = (k_p + k_i / s + k_d s) / s^2  D(s)  exp(-s T) / (tau s + 1)
//! D(s) = (tau_0 s + 1) / (tau_0 / a s + 1)
//! k_p = c1 c2 + lambda + r    k_i = c2 lambda    k_d = c1 + c2    r = 1 (Euler), J_max / J (quaternion)
//! ```
//! `D` is the lead of the flight code (docs/equations.md B.5), which knows the lag as it is stated.
//! `T` is the latency of gyro and of commands, and half a step, for which a command is held in the
//! mean. Phase margin: at the highest frequency at which `|L| = 1`. `M_s`: the largest
//! `|1 / (1 + L)|`. A measured response in the plant agrees within 3 deg (`tests/it/margins.rs`).

use super::VehicleFile;
use serde::Serialize;
use squirrel_core::control::backstepping::AttitudeForm;
use squirrel_core::nalgebra::{Complex, ComplexField};

/// Step of the flight code's inner loop, s.
pub(super) const STEP_S: f64 = 1.0 / 300.0;
/// Phase margin that a loop shall have, with the rotors' lag as stated and twice as long, rad.
pub const PHASE_MARGIN_RAD: [f64; 2] = [45.0 * DEG, 30.0 * DEG];
/// Largest sensitivity peak that a loop shall have with the lag as stated.
pub const SENSITIVITY_PEAK: f64 = 1.7;
/// Phase margin below which a loop is warned of, rad.
pub const WARN_BELOW_RAD: f64 = 35.0 * DEG;
/// Frequencies at which sensitivity is looked at, rad/s: first, last, number.
const SWEEP: (f64, f64, usize) = (0.1, 1000.0, 800);
/// Gains that are tried: how many, and each over the one before.
const SCAN: (i32, f64) = (120, 0.96);
const DEG: f64 = std::f64::consts::PI / 180.0;

/// One axis of the attitude loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisLoop {
    /// `k_p`, `k_i`, `k_d`: angular acceleration of an angle, its integral and its rate.
    pub gains: [f64; 3],
    /// Time constant of the rotors, s.
    pub lag_s: f64,
    /// Lead of the torque demand: the lag that it knows, s, and the ratio of zero to pole.
    pub lead: [f64; 2],
    /// Everything that is late, s.
    pub delay_s: f64,
}

/// How far a loop is from oscillating.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Margins {
    /// Highest frequency at which the loop has a gain of 1, rad/s.
    pub crossover_rad_s: f64,
    /// Phase margin there, rad; negative where the loop oscillates.
    pub phase_margin_rad: f64,
    /// Additional delay that the loop bears, s.
    pub delay_margin_s: f64,
    /// `M_s`.
    pub sensitivity_peak: f64,
}

/// Margins of one axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AxisMargins {
    /// `roll`, `pitch` or `yaw`.
    pub axis: &'static str,
    /// With the vehicle's numbers.
    pub nominal: Margins,
    /// With rotors that lag twice as long.
    pub twice_the_lag: Margins,
}

impl AxisLoop {
    /// `L(j w)`.
    pub fn open_loop(&self, omega_rad_s: f64) -> Complex<f64> {
        let s = Complex::new(0.0, omega_rad_s);
        let [k_p, k_i, k_d] = self.gains;
        // As functions: `Complex` has methods of these names only where `std` is built in.
        let [known_s, ratio] = self.lead;
        let lead = (s * known_s + 1.0) / (s * (known_s / ratio) + 1.0);
        let late = lead * ComplexField::exp(s * -self.delay_s) / (s * self.lag_s + 1.0);
        (s * k_d + k_p + Complex::from(k_i) / s) / (s * s) * late
    }

    /// `|L(j w)|`.
    fn gain(&self, omega_rad_s: f64) -> f64 {
        self.open_loop(omega_rad_s).modulus()
    }

    /// Phase of `L` less `-180 deg`, not wrapped, rad.
    fn phase_above_rad(&self, omega_rad_s: f64) -> f64 {
        let [k_p, k_i, k_d] = self.gains;
        let [known_s, ratio] = self.lead;
        (k_d * omega_rad_s - k_i / omega_rad_s).atan2(k_p) + (known_s * omega_rad_s).atan()
            - (known_s / ratio * omega_rad_s).atan()
            - (self.lag_s * omega_rad_s).atan()
            - self.delay_s * omega_rad_s
    }

    /// Its margins.
    pub fn margins(&self) -> Margins {
        // The gain falls beyond the highest crossover, for good.
        let (mut low, mut high) = (SWEEP.0, SWEEP.1);
        while self.gain(high) > 1.0 {
            (low, high) = (high, 2.0 * high);
        }
        let ratio = (high / low).powf(1.0 / SWEEP.2 as f64);
        let mut at = high;
        while at > low && self.gain(at / ratio) < 1.0 {
            at /= ratio;
        }
        let [mut below, mut above] = [at / ratio, at];
        for _ in 0..60 {
            let middle = 0.5 * (below + above);
            let is_below = self.gain(middle) > 1.0;
            *(if is_below { &mut below } else { &mut above }) = middle;
        }
        let phase_margin_rad = self.phase_above_rad(above);
        let sweep = (0..SWEEP.2).map(|k| {
            let omega = SWEEP.0 * (SWEEP.1 / SWEEP.0).powf(k as f64 / (SWEEP.2 - 1) as f64);
            1.0 / (self.open_loop(omega) + 1.0).modulus()
        });
        Margins {
            crossover_rad_s: above,
            phase_margin_rad,
            delay_margin_s: phase_margin_rad / above,
            sensitivity_peak: sweep.fold(0.0, f64::max),
        }
    }

    /// The same with rotors that lag twice as long.
    #[must_use]
    pub fn with_twice_the_lag(self) -> Self {
        Self { lag_s: 2.0 * self.lag_s, ..self }
    }

    fn holds(&self) -> bool {
        let (now, late) = (self.margins(), self.with_twice_the_lag().margins());
        now.phase_margin_rad >= PHASE_MARGIN_RAD[0]
            && late.phase_margin_rad >= PHASE_MARGIN_RAD[1]
            && now.sensitivity_peak <= SENSITIVITY_PEAK
    }
}

/// Gains of an axis of backstepping: `c1` and `c2`, 1/s, and `lambda`, 1/s^2.
pub type AxisGains = [f64; 3];

/// `k_p`, `k_i` and `k_d` of an axis.
///
/// * `restoring` - `r`: see the module
pub fn loop_gains([c1, c2, lambda]: AxisGains, restoring: f64) -> [f64; 3] {
    [c1 * c2 + lambda + restoring, c2 * lambda, c1 + c2]
}

/// The fastest gains that have the stated margins with a lag, a lead and a delay, and at most
/// `c1_max`; where none has them, those with most phase margin at twice the lag.
///
/// Of one family: `c2 = 1.5 c1`, `lambda = c1^2 / 12`. That leaves the integral slow beside the
/// rest.
///
/// * `restoring` - `r`: see the module
pub fn gains_for_margins(
    lag_s: f64,
    rotor_lead: f64,
    delay_s: f64,
    restoring: f64,
    c1_max: f64,
) -> AxisGains {
    let family = |c1: f64| [c1, 1.5 * c1, c1 * c1 / 12.0];
    let lead = [lag_s, rotor_lead];
    let of = |c1: f64| AxisLoop { gains: loop_gains(family(c1), restoring), lag_s, lead, delay_s };
    // From the fast end: the slowest loops, of which `r` is all, are no better damped.
    let scan = (0..SCAN.0).map(|k| c1_max * SCAN.1.powi(k));
    let Some(found) = scan.clone().find(|c1| of(*c1).holds()) else {
        let late = |c1: &f64| of(*c1).with_twice_the_lag().margins().phase_margin_rad;
        let best = scan.max_by(|a, b| late(a).total_cmp(&late(b)));
        return family(best.unwrap_or(c1_max));
    };
    let (mut good, mut bad) = (found, (found / SCAN.1).min(c1_max));
    for _ in 0..20 {
        let middle = 0.5 * (good + bad);
        *(if of(middle).holds() { &mut good } else { &mut bad }) = middle;
    }
    family(good)
}

impl VehicleFile {
    /// Roll, pitch and yaw loops about hover; `None` without gains.
    pub fn attitude_loops(&self) -> Option<[AxisLoop; 3]> {
        let gains = &self.control?.attitude;
        let p = self.vehicle.parameters();
        let inertia = p.inertia_kg_m2.diagonal();
        let delay_s =
            0.5 * STEP_S + self.sensors.imu.timing.latency_s + self.effects.command_latency_s();
        let lag_s = p.propulsion.time_constant_s();
        let lead = [lag_s, f64::from(gains.rotor_lead)];
        Some(std::array::from_fn(|i| {
            let restoring = match gains.form {
                AttitudeForm::Euler => 1.0,
                AttitudeForm::Quaternion => inertia.max() / inertia[i],
            };
            let of = [gains.c1_per_s[i], gains.c2_per_s[i], gains.lambda_per_s2[i]];
            AxisLoop { gains: loop_gains(of.map(f64::from), restoring), lag_s, lead, delay_s }
        }))
    }

    /// Margins of roll, pitch and yaw about hover; `None` without gains.
    pub fn margins(&self) -> Option<[AxisMargins; 3]> {
        let loops = self.attitude_loops()?;
        Some(std::array::from_fn(|i| AxisMargins {
            axis: ["roll", "pitch", "yaw"][i],
            nominal: loops[i].margins(),
            twice_the_lag: loops[i].with_twice_the_lag().margins(),
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use squirrel_core::control::backstepping::quaternion::{Law, Target};
    use squirrel_core::lane::Dual;

    /// The law itself, with its derivatives by angle, rate and integral.
    #[test]
    fn a_laws_derivatives_are_the_loops_gains() {
        let inertia = [3.22e-3, 4.68e-3, 7.72e-3];
        let number = Dual::<3>::constant;
        let none = [number(0.0); 3];
        for axis in 0..3 {
            let (c1, c2, lambda) = (9.0, 14.0, 8.0);
            let columns = std::array::from_fn(|i| {
                std::array::from_fn(|j| number(if i == j { inertia[i] } else { 0.0 }))
            });
            let law = Law::from_euler_gains(
                &[number(c1); 3],
                &[number(c2); 3],
                &[number(lambda); 3],
                &columns,
            );
            let along = |variable: Dual<3>| {
                std::array::from_fn(|i| if i == axis { variable } else { number(0.0) })
            };
            // Half an angle, and half its integral.
            let half = |index: usize| Dual::variable(0.0, index) * number(0.5);
            let [x, y, z] = along(half(0));
            let omega = along(Dual::variable(0.0, 1));
            let target = Target::from_euler(&none, &none, &none);
            let answer =
                law.torque(&[number(1.0), x, y, z], &omega, &target, &along(half(2)), number(1.0));
            let [angle, rate, integral] = answer.torque[axis].by.map(|by| -by / inertia[axis]);
            let [k_p, k_i, k_d] = loop_gains([c1, c2, lambda], 7.72e-3 / inertia[axis]);
            for (by_dual, gain) in [(angle, k_p), (integral, k_i), (rate, k_d)] {
                assert!((by_dual / gain - 1.0).abs() < 1e-9, "axis {axis}: {by_dual}, {gain}");
            }
        }
    }

    /// A double integrator with a rate and an angle gain: textbook, phase `atan(w k_d / k_p)`.
    #[test]
    fn margins_of_a_loop_by_hand() {
        let simple =
            AxisLoop { gains: [1.0, 0.0, 2.0], lag_s: 0.0, lead: [0.0, 1.0], delay_s: 0.0 };
        let m = simple.margins();
        // |2 j w + 1| = w^2.
        let crossover = (2.0 + 5.0_f64.sqrt()).sqrt();
        assert!((m.crossover_rad_s - crossover).abs() < 1e-9, "{m:?}");
        assert!((m.phase_margin_rad - (2.0 * crossover).atan()).abs() < 1e-9, "{m:?}");
        let late = AxisLoop { delay_s: m.delay_margin_s, ..simple }.margins();
        assert!(late.phase_margin_rad.abs() < 1e-9 && late.sensitivity_peak > 30.0, "{late:?}");
    }

    #[test]
    fn gains_by_rule_have_the_margins_and_no_more_than_needed() {
        for (lag_s, ratio, delay_s, restoring) in [
            (0.04, 1.0, 0.002, 2.4),
            (0.04, 3.0, 0.002, 2.4),
            (0.02, 1.0, 0.006, 1.0),
            (0.1, 2.0, 0.02, 1.6),
        ] {
            let gains = gains_for_margins(lag_s, ratio, delay_s, restoring, 100.0);
            let lead = [lag_s, ratio];
            let of = |gains| AxisLoop { gains: loop_gains(gains, restoring), lag_s, lead, delay_s };
            assert!(of(gains).holds(), "{gains:?}");
            assert!(!of([1.02 * gains[0], 1.02 * gains[1], 1.0404 * gains[2]]).holds());
        }
        assert_eq!(
            gains_for_margins(0.001, 1.0, 0.0, 1.0, 5.0)[0],
            5.0,
            "no faster than asked for"
        );
    }
}
