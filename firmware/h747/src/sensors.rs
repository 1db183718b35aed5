//! What the sensors said since the last step, as the frame that the flight code takes.
//!
//! A reading goes into one frame; a sensor that is silent is absent from the next, and core's failsafe counts how long. Before the
//! flight begins the fix and the pressure are the origin of what follows, and the attitude is that of a vehicle that stands.

use crate::attitude::Attitude;
use crate::gnss::{Fix, Place};
use squirrel_core::frames::{Body, In};
use squirrel_core::stack::{Gnss, Imu, SensorFrame};

/// Ages beyond which a sensor is not there for arming, us.
const IMU_AGE_US: u64 = 20_000;
const GNSS_AGE_US: u64 = 500_000;
const PRESSURE_AGE_US: u64 = 200_000;
/// A longer gap between samples is not integrated over, s.
const GAP_MAX_S: f32 = 0.02;

/// A reading, when it was made, and whether no frame has carried it.
#[derive(Debug, Clone, Copy)]
struct Reading<T> {
    value: T,
    time_us: u64,
    is_new: bool,
}

impl<T: Copy> Reading<T> {
    fn new(value: T, time_us: u64) -> Self {
        Self { value, time_us, is_new: true }
    }

    fn take(slot: &mut Option<Self>) -> Option<T> {
        let reading = slot.as_mut().filter(|reading| reading.is_new)?;
        reading.is_new = false;
        Some(reading.value)
    }

    fn is_fresh(slot: Option<&Self>, now_us: u64, age_us: u64) -> bool {
        slot.is_some_and(|reading| now_us.saturating_sub(reading.time_us) <= age_us)
    }
}

/// What the sensors said last.
#[derive(Debug)]
pub struct Sensors {
    attitude: Attitude,
    imu: Option<Reading<Imu>>,
    fix: Option<Reading<Fix>>,
    pressure_pa: Option<Reading<f32>>,
    /// Place and pressure where the flight began; `None` before it does.
    origin: Option<(Place, f32)>,
}

impl Sensors {
    /// No reading yet; `heading_rad` is how the vehicle stands at arming, clockwise from north.
    #[must_use]
    pub fn new(heading_rad: f32) -> Self {
        Self { attitude: Attitude::new(heading_rad), imu: None, fix: None, pressure_pa: None, origin: None }
    }

    /// A sample of the inertial unit: rad/s and m/s^2, body. What is not finite is no sample.
    pub fn imu(&mut self, omega: In<Body, f32>, specific_force: In<Body, f32>, time_us: u64) {
        let sample = Imu { omega, specific_force };
        if !omega.vector.iter().chain(specific_force.vector.iter()).all(|x| x.is_finite()) {
            return;
        }
        let dt_us = self.imu.map_or(0, |last| time_us.saturating_sub(last.time_us));
        let dt_s = (dt_us as f32 * 1e-6).min(GAP_MAX_S);
        if self.origin.is_none() {
            self.attitude.on_the_ground(&sample, dt_s);
        } else {
            self.attitude.in_flight(&sample, dt_s);
        }
        self.imu = Some(Reading::new(sample, time_us));
    }

    /// A satellite fix.
    pub fn fix(&mut self, fix: Fix, time_us: u64) {
        self.fix = Some(Reading::new(fix, time_us));
    }

    /// A pressure, Pa. What no barometer can say is no reading.
    pub fn pressure(&mut self, pressure_pa: f32, time_us: u64) {
        if (10_000.0..150_000.0).contains(&pressure_pa) {
            self.pressure_pa = Some(Reading::new(pressure_pa, time_us));
        }
    }

    /// All sensors speak, and the vehicle lies level and still.
    #[must_use]
    pub fn are_ready(&self, now_us: u64) -> bool {
        Reading::is_fresh(self.imu.as_ref(), now_us, IMU_AGE_US)
            && Reading::is_fresh(self.fix.as_ref(), now_us, GNSS_AGE_US)
            && Reading::is_fresh(self.pressure_pa.as_ref(), now_us, PRESSURE_AGE_US)
            && self.imu.is_some_and(|imu| self.attitude.is_level_and_still(&imu.value))
    }

    /// The flight begins here. Without fix or pressure it does not: see [`Self::are_ready`].
    pub fn begin(&mut self) {
        let (Some(fix), Some(pressure)) = (self.fix, self.pressure_pa) else { return };
        self.origin = Some((fix.value.place, pressure.value));
    }

    /// The flight is over.
    pub fn end(&mut self) {
        self.origin = None;
    }

    /// What is new since the last frame; empty before the flight begins.
    ///
    /// * `time_us` - since the flight began
    pub fn frame(&mut self, time_us: u64) -> SensorFrame {
        let mut frame = SensorFrame::empty(time_us);
        let Some((place, pressure_pa)) = self.origin else { return frame };
        if let Some(imu) = Reading::take(&mut self.imu) {
            frame.imu = Some(Imu { omega: In::new(self.attitude.without_bias(&imu)), ..imu });
            frame.attitude = Some(self.attitude.ned_from_body);
        }
        frame.gnss = Reading::take(&mut self.fix)
            .map(|fix| Gnss { position: fix.place.from(&place), velocity: fix.velocity });
        frame.altitude_m = Reading::take(&mut self.pressure_pa).map(|now| altitude_m(now, pressure_pa));
        frame
    }
}

/// Height above where the pressure was `ground_pa`, m, in the standard atmosphere.
fn altitude_m(pressure_pa: f32, ground_pa: f32) -> f32 {
    44_330.77 * (1.0 - libm::powf(pressure_pa / ground_pa, 0.190_263))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use squirrel_core::nalgebra::Vector3;

    const HOME: Place = Place { latitude_rad: 0.8, longitude_rad: 0.2, height_m: 400.0 };

    pub(crate) fn fix() -> Fix {
        Fix { place: HOME, velocity: In::zero() }
    }

    pub(crate) fn rest() -> (In<Body, f32>, In<Body, f32>) {
        (In::zero(), In::new(Vector3::new(0.0, 0.0, -9.80665)))
    }

    /// Everything has spoken for a second.
    fn standing() -> (Sensors, u64) {
        let mut sensors = Sensors::new(0.0);
        for k in 0..300 {
            sensors.imu(rest().0, rest().1, k * 3333);
        }
        let now = 299 * 3333;
        sensors.fix(fix(), now);
        sensors.pressure(97_000.0, now);
        (sensors, now)
    }

    #[test]
    fn a_reading_is_in_one_frame() {
        let (mut sensors, now) = standing();
        assert_eq!(sensors.frame(0), SensorFrame::empty(0), "before the flight nothing is said");
        sensors.begin();
        let first = sensors.frame(10);
        assert!(first.imu.is_some() && first.attitude.is_some());
        assert_eq!(first.gnss.unwrap().position, In::zero());
        assert_eq!(first.altitude_m, Some(0.0));
        assert_eq!(sensors.frame(20), SensorFrame::empty(20));
        sensors.pressure(96_880.0, now + 1);
        let next = sensors.frame(30);
        assert!((next.altitude_m.unwrap() - 10.7).abs() < 0.3, "{next:?}");
        assert_eq!((next.imu, next.gnss), (None, None));
    }

    #[test]
    fn each_sensor_that_is_silent_or_missing_stands_against_arming() {
        let (sensors, now) = standing();
        assert!(sensors.are_ready(now));
        assert!(!sensors.are_ready(now + IMU_AGE_US + 1));
        assert!(!Sensors::new(0.0).are_ready(0));
        for missing in 0..2 {
            let (mut sensors, now) = standing();
            if missing == 0 {
                sensors.fix = None;
            } else {
                sensors.pressure_pa = None;
            }
            assert!(!sensors.are_ready(now));
            sensors.begin();
            assert_eq!(sensors.origin, None, "a flight without an origin does not begin");
        }
        let (mut moving, _) = standing();
        moving.imu(In::new(Vector3::new(0.0, 0.5, 0.0)), rest().1, now + 1);
        assert!(!moving.are_ready(now + 1));
    }

    #[test]
    fn nonsense_is_silence() {
        let (mut sensors, now) = standing();
        sensors.begin();
        sensors.frame(0);
        sensors.imu(In::new(Vector3::new(f32::NAN, 0.0, 0.0)), rest().1, now + 1);
        for pressure in [f32::NAN, 0.0, -1.0, f32::INFINITY] {
            sensors.pressure(pressure, now + 1);
        }
        assert_eq!(sensors.frame(1), SensorFrame::empty(1));
    }
}
