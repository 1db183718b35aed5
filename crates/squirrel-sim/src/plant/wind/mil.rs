//! Turbulence near the ground after MIL-F-8785C, 3.7: Dryden spectra with the lengths and strengths
//! of the low-altitude model, and the rotation of the air over a wing span.
//!
//! With `h` the height in feet, from 10 to 1000, `W` the wind at 20 ft (6 m) and `b` the span:
//! ```text
//! L_w = h                 L_u = L_v = h / (0.177 + 0.000823 h)^1.2          (ft)
//! sigma_w = 0.1 W         sigma_u = sigma_v = sigma_w / (0.177 + 0.000823 h)^0.4
//! H_u = sigma_u sqrt(2 L_u / (pi V)) / (1 + L_u s / V)
//! H_v = sigma_v sqrt(L_v / (pi V)) (1 + sqrt(3) L_v s / V) / (1 + L_v s / V)^2, H_w likewise
//! H_p = sigma_w sqrt(0.8 / V) (pi / (4 b))^(1/6) / (L_w^(1/3) (1 + 4 b s / (pi V)))
//! H_q = -(s / V) / (1 + 4 b s / (pi V)) H_w      H_r = (s / V) / (1 + 3 b s / (pi V)) H_v
//! ```
//! Spectra are one-sided in rad/s: their integral over positive frequencies is the variance. `u` is
//! along the horizontal flight through the air, `v` to the right, `w` down, `p q r` about them. Air
//! that turns with `omega` moves with `omega x r`, so that `p = dw/dy`, `q = -dw/dx` and `r =
//! dv/dx`; through a frozen field `d/dx` is `(1/V) d/dt`.
//!
//! The processes are kept north, east and down with strength one, which their equal horizontal
//! lengths allow. A vehicle that turns therefore meets the air that was there: only which part of
//! it counts as `u` changes, and neither gust nor roll rate jumps where it flies back.

use super::dryden;
use crate::tape::Tape;
use squirrel_core::frames::{In, Ned};
use squirrel_core::lane::functions::{cbrt, exp, ln};
use squirrel_core::nalgebra::{Vector2, Vector3};
use std::f64::consts::PI;

const FOOT_M: f64 = 0.3048;
/// Heights of the low-altitude model, ft; the ends hold beyond.
const HEIGHT_FT: [f64; 2] = [10.0, 1000.0];
/// A slower flight meets the field at this speed, and has no direction of its own, m/s.
pub(super) const SLOWEST_M_S: f64 = 1.0;

/// How a vehicle meets the air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Meeting {
    /// Velocity through the air, m/s.
    pub through_air: In<Ned, f64>,
    /// Above the ground, m.
    pub height_m: f64,
}

/// Lengths and strengths at one height: horizontal and vertical.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Turbulence {
    length_m: [f64; 2],
    sigma_m_s: [f64; 2],
}

impl Turbulence {
    fn at(height_m: f64, wind_6m_m_s: f64) -> Self {
        let feet = (height_m / FOOT_M).clamp(HEIGHT_FT[0], HEIGHT_FT[1]);
        let log = ln(0.177 + 0.000_823 * feet);
        let vertical = 0.1 * wind_6m_m_s;
        Self {
            length_m: [feet * exp(-1.2 * log) * FOOT_M, feet * FOOT_M],
            sigma_m_s: [vertical * exp(-0.4 * log), vertical],
        }
    }

    /// Standard deviation of the roll rate over a span, rad/s: the integral of its spectrum.
    fn roll_rad_s(&self, span_m: f64) -> f64 {
        let length = self.length_m[1];
        let over = cbrt(PI * length / (4.0 * span_m));
        self.sigma_m_s[1] * (0.1 * PI * PI * over / (span_m * length)).sqrt()
    }
}

/// The turbulence about one vehicle.
#[derive(Debug, Clone)]
pub(super) struct Mil {
    wind_6m_m_s: f64,
    span_m: f64,
    /// Along which a vehicle without a direction of its own meets the air: against the mean wind,
    /// as one that hovers in it does; north in calm air.
    without_way: Vector2<f64>,
    along: Vector2<f64>,
    here: Turbulence,
    /// First stage of the gusts, of variance 1/2, and its lag.
    first: Vector3<f64>,
    second: Vector3<f64>,
    /// Lag of the gusts over the span.
    lagged: Vector3<f64>,
    /// Roll rates about north and east.
    roll: Vector2<f64>,
}

impl Mil {
    /// In its stationary distribution but for pitch and yaw rates, which begin at rest and forget
    /// it within a few spans; near the ground until the vehicle says where it is.
    ///
    /// * `mean` - wind, m/s
    /// * `noise` - standard normal numbers
    pub(super) fn new(
        wind_6m_m_s: f64,
        mean: Vector3<f64>,
        span_m: f64,
        mut noise: impl FnMut() -> f64,
    ) -> Self {
        let without_way = (-mean.xy()).try_normalize(0.0).unwrap_or_else(Vector2::x);
        let first = Vector3::from_fn(|_, _| noise() * 0.5_f64.sqrt());
        // Its variance is 1/4, and so is what it shares with the first stage.
        let second = first.map(|first| 0.5 * first + noise() * 0.125_f64.sqrt());
        let mut air = Self {
            wind_6m_m_s,
            span_m,
            without_way,
            along: without_way,
            here: Turbulence::at(0.0, wind_6m_m_s),
            first,
            second,
            lagged: Vector3::zeros(),
            roll: Vector2::from_fn(|_, _| noise()),
        };
        air.lagged = air.shaped();
        air
    }

    /// All that it is.
    pub(super) fn keep(&mut self, tape: &mut Tape<'_>) -> Option<()> {
        tape.doubles([&mut self.wind_6m_m_s, &mut self.span_m])?;
        tape.doubles(
            [&mut self.without_way, &mut self.along].into_iter().flat_map(|v| v.iter_mut()),
        )?;
        tape.doubles(self.here.length_m.iter_mut().chain(&mut self.here.sigma_m_s))?;
        tape.doubles(
            [&mut self.first, &mut self.second, &mut self.lagged]
                .into_iter()
                .flat_map(|v| v.iter_mut()),
        )?;
        tape.doubles(self.roll.iter_mut())
    }

    /// Lateral and vertical gusts of strength one; along the flight another shape holds.
    fn shaped(&self) -> Vector3<f64> {
        dryden::across(&self.first, &self.second)
    }

    /// To the right of the flight.
    fn right(&self) -> Vector2<f64> {
        Vector2::new(-self.along.y, self.along.x)
    }

    /// Velocity of the gusts, m/s.
    pub(super) fn velocity(&self) -> Vector3<f64> {
        let [horizontal, vertical] = self.here.sigma_m_s;
        let shaped = self.shaped();
        let longitudinal = dryden::along(self.along.dot(&self.first.xy()));
        let gust = self.along * longitudinal + self.right() * self.right().dot(&shaped.xy());
        Vector3::new(gust.x * horizontal, gust.y * horizontal, shaped.z * vertical)
    }

    /// Angular velocity of the air, rad/s.
    pub(super) fn angular_velocity(&self) -> Vector3<f64> {
        let [horizontal, vertical] = self.here.sigma_m_s;
        let fresh = self.shaped() - self.lagged;
        let per_span = PI / self.span_m;
        let p = self.here.roll_rad_s(self.span_m) * self.along.dot(&self.roll);
        let q = -per_span / 4.0 * vertical * fresh.z;
        let r = per_span / 3.0 * horizontal * self.right().dot(&fresh.xy());
        let turning = self.along * p + self.right() * q;
        Vector3::new(turning.x, turning.y, r)
    }

    /// Moves the air on by `dt_s`.
    pub(super) fn advance(&mut self, dt_s: f64, meeting: &Meeting, mut noise: impl FnMut() -> f64) {
        let through = meeting.through_air.vector;
        let way = through.xy();
        let speed = way.norm();
        self.along = if speed >= SLOWEST_M_S { way / speed } else { self.without_way };
        self.here = Turbulence::at(meeting.height_m, self.wind_6m_m_s);
        if !(dt_s > 0.0) {
            return;
        }
        let way_m = dt_s * through.norm().max(SLOWEST_M_S);
        let [horizontal_m, vertical_m] = self.here.length_m;
        let before = self.shaped();
        for (axis, length_m) in [horizontal_m, horizontal_m, vertical_m].into_iter().enumerate() {
            let keep = exp(-way_m / length_m);
            dryden::advance([&mut self.first[axis], &mut self.second[axis]], keep, noise());
        }
        let now = self.shaped();
        for (axis, spans) in [3.0, 3.0, 4.0].into_iter().enumerate() {
            let stage = Stage::new(way_m, spans * self.span_m / PI);
            self.lagged[axis] = stage.lag(self.lagged[axis], before[axis], now[axis]);
        }
        let stage = Stage::new(way_m, 4.0 * self.span_m / PI);
        self.roll = self.roll.map(|roll| roll * stage.keep + noise() * stage.fresh);
    }
}

/// A lag of first order over a step.
#[derive(Debug, Clone, Copy)]
struct Stage {
    /// Part that stays.
    keep: f64,
    /// Standard deviation of what comes from noise, for one of all.
    fresh: f64,
    /// Step over the lag.
    steps: f64,
}

impl Stage {
    fn new(way_m: f64, length_m: f64) -> Self {
        let steps = way_m / length_m;
        let keep = exp(-steps);
        Self { keep, fresh: (1.0 - keep * keep).sqrt(), steps }
    }

    /// What follows an input that goes straight from one value to another: exact, so that the
    /// difference of the two has the size of the input's rate.
    fn lag(&self, state: f64, before: f64, now: f64) -> f64 {
        let mean = (1.0 - self.keep) / self.steps;
        state * self.keep + before * (mean - self.keep) + now * (1.0 - mean)
    }
}

#[cfg(test)]
mod tests;
