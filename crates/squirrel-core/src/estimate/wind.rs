//! Wind, from the drag that is felt while wings are folded (docs/equations.md E.9).
//!
//! ```text
//! felt       d   = R (m f + T) - s n            horizontal, n = R e3, s thrust that is short
//! believed   F   = R drag(R^T (v - w))          horizontal, the vehicle file's drag
//! w  <- w + p k / (p k^2 + r) (d - F)           k = |dF/dv|        p <- (1 - ...) p + q dt
//! ```
//! A Kalman filter of two states, north and east, that share one variance, for drag is taken to
//! have no direction. It starts from a calm day that may be [`PRIOR_M_S`] off: a vehicle file
//! without drag leaves it there, which is what is then known. While wings are spread it waits, for
//! they push more than all the rest.

use crate::aero::Air;
use crate::dynamics;
use crate::frames::{Body, In, Ned, Rotation};
use crate::math::{limit, lower, sqrt};
use crate::vehicle::Vehicle;
use nalgebra::{Vector2, Vector3};

/// What a day's wind may be beforehand, m/s, an axis.
pub const PRIOR_M_S: f32 = 3.0;
/// Between looks, s.
const PERIOD_S: f32 = 0.1;
/// How the wind at the vehicle wanders, m/s in the root of a second.
const WALK_M_S_ROOT_S: f32 = 0.3;
/// What tilt, as weights, and thrust, as a share of it, may be wrong by.
const TILT_ERROR: f32 = 0.02;
const THRUST_ERROR: f32 = 0.05;
/// For how long such an error stays what it is, s.
const ERROR_STAYS_S: f32 = 2.0;
/// Standard deviations beyond which a look tells no more.
const GATE: f32 = 3.0;
/// Faster than any wind one flies in, m/s.
const MOST_M_S: f32 = 20.0;

/// The wind as estimated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wind {
    /// Velocity of the air over ground, m/s; no vertical part.
    pub velocity: In<Ned, f32>,
    /// Standard deviation of north and of east, m/s.
    pub deviation_m_s: f32,
    /// Since the last look, s.
    pub(crate) waited_s: f32,
}

impl Default for Wind {
    fn default() -> Self {
        Self { velocity: In::zero(), deviation_m_s: PRIOR_M_S, waited_s: 0.0 }
    }
}

/// What is looked at.
#[derive(Debug, Clone, Copy)]
pub(super) struct Look<'a> {
    pub ned_from_body: &'a Rotation<Ned, Body, f32>,
    /// Over ground, m/s.
    pub velocity: In<Ned, f32>,
    /// Beside thrust and gravity, N, mean over a period.
    pub beside: In<Ned, f32>,
    /// Thrust that is short, N.
    pub short_n: f32,
    /// Whether wings are folded, and the means are of folded wings.
    pub is_folded: bool,
    pub dt_s: f32,
}

impl Wind {
    /// Looks at a step, once a period; whether this one ends it.
    pub(super) fn look(&mut self, vehicle: &Vehicle<f32>, look: &Look<'_>) -> bool {
        self.waited_s += look.dt_s;
        if self.waited_s < PERIOD_S {
            return false;
        }
        let dt_s = core::mem::take(&mut self.waited_s);
        let variance =
            self.deviation_m_s * self.deviation_m_s + WALK_M_S_ROOT_S * WALK_M_S_ROOT_S * dt_s;
        let mut variance = lower(variance, PRIOR_M_S * PRIOR_M_S);
        if look.is_folded {
            let (innovation, slope, error_n) = self.innovation(vehicle, look);
            // Before the limits, which make a number of what is none.
            if !innovation.norm_squared().is_finite() {
                *self = Self::default();
                return true;
            }
            let noise = error_n * error_n * (ERROR_STAYS_S / PERIOD_S);
            let expected = variance * slope * slope + noise;
            let gain = variance * slope / expected;
            let most = GATE * sqrt(expected);
            let wind = self.velocity.vector.xy() + innovation.map(|y| gain * limit(y, -most, most));
            let wind = wind.map(|w| limit(w, -MOST_M_S, MOST_M_S));
            self.velocity = In::new(Vector3::new(wind.x, wind.y, 0.0));
            variance *= 1.0 - gain * slope;
        }
        self.deviation_m_s = sqrt(variance);
        true
    }

    /// Felt less believed drag, N, how it changes with the wind, N s/m, and its error, N.
    fn innovation(&self, vehicle: &Vehicle<f32>, look: &Look<'_>) -> (Vector2<f32>, f32, f32) {
        let through = look.velocity - self.velocity;
        let air = Air {
            velocity: look.ned_from_body.inverse() * through,
            speed: through.vector.norm(),
            omega: In::zero(),
        };
        let down = (*look.ned_from_body * In::<Body, f32>::new(Vector3::z())).vector;
        let felt = look.beside.vector.xy() - down.xy() * look.short_n;
        let believed = (*look.ned_from_body * dynamics::drag(vehicle, &air)).vector.xy();
        let drag = &vehicle.parameters().drag;
        // Along the flow twice what it is across.
        let slope = 0.5 * (drag.linear_n_s_per_m.x + drag.linear_n_s_per_m.y)
            + 1.5 * drag.per_square() * air.speed;
        let sine = down.xy().norm();
        let error_n = vehicle.weight_n()
            * sqrt(TILT_ERROR * TILT_ERROR + THRUST_ERROR * THRUST_ERROR * sine * sine);
        (felt - believed, slope, error_n)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::super::tests::Noise;
    use super::*;
    use crate::vehicle::fixtures::squirrel;

    fn vehicle(linear_n_s_per_m: f32) -> Vehicle<f32> {
        let mut p = squirrel::<f32>();
        p.drag.linear_n_s_per_m = Vector3::new(linear_n_s_per_m, linear_n_s_per_m, 0.0);
        Vehicle::new(p).unwrap()
    }

    /// Looks at what a wind does to a vehicle that leans and flies, for a while.
    ///
    /// * `error_n` - of what is felt, north and east, at every look
    fn looks(
        wind: &mut Wind,
        vehicle: &Vehicle<f32>,
        is: [f32; 2],
        seconds: u32,
        is_folded: bool,
        mut error_n: impl FnMut() -> Vector2<f32>,
    ) {
        let ned_from_body = Rotation::from_euler(0.2, -0.3, 0.7);
        let velocity = In::new(Vector3::new(3.0, 1.0, -0.5));
        let through = velocity - In::new(Vector3::new(is[0], is[1], 0.0));
        let air = Air {
            velocity: ned_from_body.inverse() * through,
            speed: through.vector.norm(),
            omega: In::zero(),
        };
        let drag = (ned_from_body * dynamics::drag(vehicle, &air)).vector;
        let short_n = 0.6;
        let down = (ned_from_body * In::<Body, f32>::new(Vector3::z())).vector;
        for _ in 0..10 * seconds {
            let error = error_n();
            let beside = In::new(drag + down * short_n + Vector3::new(error.x, error.y, 0.0));
            let look = Look {
                ned_from_body: &ned_from_body,
                velocity,
                beside,
                short_n,
                is_folded,
                dt_s: PERIOD_S,
            };
            wind.look(vehicle, &look);
        }
    }

    fn none() -> Vector2<f32> {
        Vector2::zeros()
    }

    #[test]
    fn a_steady_wind_is_found_beside_thrust_that_is_short() {
        let mut wind = Wind::default();
        looks(&mut wind, &vehicle(0.18), [-4.0, 2.5], 30, true, none);
        let off = wind.velocity.vector - Vector3::new(-4.0, 2.5, 0.0);
        assert!(off.norm() < 0.05 && wind.deviation_m_s < 0.8, "{wind:?}");
    }

    /// Spread wings push more than drag does: nothing is learnt, and what is known gets old.
    #[test]
    fn it_waits_while_wings_are_spread() {
        let mut wind = Wind::default();
        looks(&mut wind, &vehicle(0.18), [-4.0, 2.5], 30, true, none);
        let before = wind;
        looks(&mut wind, &vehicle(0.18), [9.0, 9.0], 5, false, none);
        assert_eq!(wind.velocity, before.velocity);
        assert!(wind.deviation_m_s > before.deviation_m_s + 0.2, "{wind:?}");
        looks(&mut wind, &vehicle(0.18), [9.0, 9.0], 900, false, none);
        assert_eq!(wind.deviation_m_s, PRIOR_M_S);
    }

    /// What shows nothing moves nothing.
    #[test]
    fn without_drag_it_knows_what_it_knew() {
        let mut p = squirrel::<f32>();
        p.drag.area_m2 = 0.0;
        let mut wind = Wind::default();
        let mut noise = Noise(5);
        looks(&mut wind, &Vehicle::new(p).unwrap(), [5.0, 0.0], 30, true, || {
            noise.vector(0.2).xy().map(|x| x as f32)
        });
        assert_eq!((wind.velocity, wind.deviation_m_s), (In::zero(), PRIOR_M_S));
    }

    /// Normalised estimation error squared over 200 days of gentle, correlated errors of tilt,
    /// against chi-squared of two numbers: for a wind from the prior, and at its end.
    #[test]
    fn it_errs_as_much_as_it_says() {
        let vehicle = vehicle(0.18);
        let (mut sum, days) = (0.0, 200_u64);
        for day in 0..days {
            let mut noise = Noise(day.wrapping_mul(0x9E37_79B9_7F4A_7C15) + 1);
            let is = noise.vector(f64::from(PRIOR_M_S)).map(|x| x as f32);
            let size = f64::from(vehicle.weight_n() * TILT_ERROR);
            let mut error = noise.vector(size);
            let keep = f64::exp(-f64::from(PERIOD_S / ERROR_STAYS_S));
            let mut wind = Wind::default();
            looks(&mut wind, &vehicle, [is.x, is.y], 20, true, || {
                error = error * keep + noise.vector(size * f64::sqrt(1.0 - keep * keep));
                error.xy().map(|x| x as f32)
            });
            let off = wind.velocity.vector.xy() - is.xy();
            sum += f64::from(off.norm_squared() / (wind.deviation_m_s * wind.deviation_m_s));
        }
        let nees = sum / days as f64;
        assert!((0.5..2.5).contains(&nees), "{nees:.2}");
    }

    /// A blow that no drag explains moves it by no more than its gate, and nothing makes it none.
    #[test]
    fn it_is_bounded_and_finite() {
        let mut wind = Wind::default();
        looks(&mut wind, &vehicle(0.18), [0.0, 0.0], 30, true, none);
        looks(&mut wind, &vehicle(0.18), [0.0, 0.0], 1, true, || Vector2::new(50.0, 0.0));
        assert!(wind.velocity.vector.norm() < 6.0, "{wind:?}");
        looks(&mut wind, &vehicle(0.18), [0.0, 0.0], 60, true, || Vector2::new(50.0, -50.0));
        assert!(wind.velocity.vector.amax() <= MOST_M_S, "{wind:?}");
        looks(&mut wind, &vehicle(0.18), [0.0, 0.0], 1, true, || Vector2::new(f32::NAN, 0.0));
        assert_eq!(wind, Wind::default());
    }
}
