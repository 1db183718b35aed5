//! The paper's propulsion fit: rotor thrust as a cubic of the voltage that a duty cycle applies,
//! and its inverse.
//!
//! `F = a0 + a1 V + a2 V^2 + a3 V^3`, `V = duty * V_battery` (paper, section II.B). The paper gives
//! no coefficients. A cubic has no inverse unless it rises, so construction proves that it does on
//! `[0, V_ref]`; the inverse is then a bisection to a bracket and Newton steps inside it, with a
//! fixed count.

use super::ParameterError;
use crate::math::{Real, limit, real};

const FIELD: &str = "propulsion.pwm_to_thrust_n";

/// A cubic thrust curve that rises on its whole range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThrustCurve<T> {
    a: [T; 4],
    voltage_max_v: T,
}

impl<T: Real> ThrustCurve<T> {
    /// * `coefficients` - `[a0, a1, a2, a3]`, N, N/V, N/V^2, N/V^3
    /// * `voltage_max_v` - top of the fitted range, V
    ///
    /// # Errors
    /// A coefficient is not finite, or the slope is not positive somewhere in `(0, voltage_max_v]`.
    pub fn new(coefficients: [T; 4], voltage_max_v: T) -> Result<Self, ParameterError> {
        for (i, a) in coefficients.iter().enumerate() {
            if !a.is_finite() {
                return Err(ParameterError::at(FIELD, i, *a, "must be finite"));
            }
        }
        let curve = Self { a: coefficients, voltage_max_v };
        // The slope is a parabola: its smallest value lies at an end or at the vertex.
        let [_, _, a2, a3] = coefficients;
        let vertex = if a3 == T::zero() { T::zero() } else { -a2 / (real::<T>(3.0) * a3) };
        for v in
            [voltage_max_v * real(1e-3), limit(vertex, T::zero(), voltage_max_v), voltage_max_v]
        {
            let slope = curve.slope(v);
            if v > T::zero() && (slope.is_nan_or_negative() || slope == T::zero()) {
                return Err(ParameterError::of(
                    FIELD,
                    slope,
                    "the curve's slope (N/V) must be > 0 up to the reference voltage",
                ));
            }
        }
        if coefficients[1].is_nan_or_negative() {
            return Err(ParameterError::at(
                FIELD,
                1,
                coefficients[1],
                "must be >= 0: the curve must rise from 0 V",
            ));
        }
        Ok(curve)
    }

    /// `[a0, a1, a2, a3]`.
    pub fn coefficients(&self) -> [T; 4] {
        self.a
    }

    /// Top of the fitted range, V.
    pub fn voltage_max_v(&self) -> T {
        self.voltage_max_v
    }

    /// Thrust at an applied voltage, N, not below 0.
    pub fn thrust_n(&self, voltage_v: T) -> T {
        crate::math::upper(self.raw(voltage_v), T::zero())
    }

    /// Applied voltage for a thrust, V, limited to the fitted range.
    pub fn voltage_v(&self, thrust_n: T) -> T {
        let (mut low, mut high) = (T::zero(), self.voltage_max_v);
        let half: T = real(0.5);
        for _ in 0..8 {
            let middle = (low + high) * half;
            if self.raw(middle) < thrust_n {
                low = middle;
            } else {
                high = middle;
            }
        }
        let mut v = (low + high) * half;
        for _ in 0..3 {
            let slope = self.slope(v);
            if slope > T::zero() {
                v = limit(v - (self.raw(v) - thrust_n) / slope, low, high);
            }
        }
        v
    }

    fn raw(&self, v: T) -> T {
        let [a0, a1, a2, a3] = self.a;
        a0 + v * (a1 + v * (a2 + v * a3))
    }
    fn slope(&self, v: T) -> T {
        let [_, a1, a2, a3] = self.a;
        a1 + v * (real::<T>(2.0) * a2 + real::<T>(3.0) * a3 * v)
    }
}

trait Sign {
    fn is_nan_or_negative(&self) -> bool;
}
impl<T: Real> Sign for T {
    fn is_nan_or_negative(&self) -> bool {
        !(*self >= T::zero())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_curve_that_turns_back_is_refused() {
        let error = ThrustCurve::<f64>::new([0.0, 0.1, 0.05, -0.005], 14.8).unwrap_err();
        assert!(error.to_string().contains("pwm_to_thrust_n"), "{error}");
        assert!(ThrustCurve::<f64>::new([0.0, -0.1, 0.05, 0.0], 14.8).is_err());
        let nan = ThrustCurve::<f64>::new([0.0, f64::NAN, 0.0, 0.0], 14.8).unwrap_err();
        assert!(nan.to_string().contains("pwm_to_thrust_n[1] = NaN"), "{nan}");
    }

    proptest! {
        #[test]
        fn the_inverse_finds_the_voltage(a1 in 0.01..0.1f64, a2 in 0.0..0.03f64, bend in 0.0..0.9f64, u in 0.01..0.99) {
            // The steepest downward bend that still rises, times `bend`.
            let top = 14.8_f64;
            let a3 = -bend * (a1 + 2.0 * a2 * top) / (3.0 * top * top);
            let curve = ThrustCurve::new([0.0, a1, a2, a3], top).unwrap();
            let v = u * top;
            prop_assert!((curve.voltage_v(curve.thrust_n(v)) - v).abs() < 1e-6);
        }
    }
}
