//! What the sensors said since the last step, as the frame that the flight code takes: raw, for
//! that estimates by itself.
//!
//! A reading goes into one frame; a sensor that is silent is absent from the next, and core's
//! failsafe counts how long. On the ground frames go to core's [`Preflight`], which finds attitude,
//! gyro bias and what fix and barometer are off by; they are relative to the first fix and pressure
//! since the vehicle was set down. What moves it begins that anew.

use crate::gnss::{Fix, Place};
use squirrel_core::estimate::navigator::Start;
use squirrel_core::estimate::rest::{Preflight, RestParameters};
use squirrel_core::frames::{Body, In, Ned, Rotation};
use squirrel_core::math::GRAVITY_M_S2;
use squirrel_core::stack::{Gnss, Imu, SensorFrame};

/// Ages beyond which a sensor is not there for arming, us.
const IMU_AGE_US: u64 = 20_000;
const GNSS_AGE_US: u64 = 500_000;
const PRESSURE_AGE_US: u64 = 200_000;
/// Slower is still, rad/s, the bias taken off.
const STILL_RAD_S: f32 = 0.05;
/// Less tilt is level, rad.
const LEVEL_RAD: f32 = 0.2;

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

/// What the sensors said last, and what came of it before the flight.
#[derive(Debug)]
pub struct Sensors {
    heading_rad: f32,
    imu: Option<Reading<Imu>>,
    fix: Option<Reading<Fix>>,
    pressure_pa: Option<Reading<f32>>,
    /// What frames count from: the first of each since the vehicle was set down.
    place: Option<Place>,
    ground_pa: Option<f32>,
    preflight: Preflight,
}

impl Sensors {
    /// No reading yet; `heading_rad` is how the vehicle stands at arming, clockwise from north.
    #[must_use]
    pub fn new(heading_rad: f32) -> Self {
        Self {
            heading_rad,
            imu: None,
            fix: None,
            pressure_pa: None,
            place: None,
            ground_pa: None,
            preflight: Preflight::default(),
        }
    }

    /// A sample of the inertial unit: rad/s and m/s^2, body. What is not finite is no sample.
    pub fn imu(&mut self, omega: In<Body, f32>, specific_force: In<Body, f32>, time_us: u64) {
        if omega.vector.iter().chain(specific_force.vector.iter()).all(|x| x.is_finite()) {
            self.imu = Some(Reading::new(Imu { omega, specific_force }, time_us));
        }
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

    /// On the ground: what is new since the last call tells where a flight would begin.
    pub fn listen(&mut self, now_us: u64) {
        let frame = self.frame(now_us);
        if frame.imu.as_ref().is_some_and(is_moved) {
            self.forget();
        } else {
            self.preflight.hear(&frame);
        }
    }

    /// The vehicle is put somewhere: what was heard there counts, nothing from before.
    pub fn forget(&mut self) {
        (self.place, self.ground_pa, self.preflight) = (None, None, Preflight::default());
    }

    /// Where a flight would begin now: here, in the middle of the mission's frame. `None` before a
    /// second at rest, in which fix and barometer have spoken, too.
    #[must_use]
    pub fn start(&self) -> Option<Start> {
        let (Some(_), Some(_)) = (self.place, self.ground_pa) else { return None };
        let start = self.preflight.start(In::zero())?;
        // Nothing on this board measures a heading, so that the start looks north.
        let heading = Rotation::<Ned, Ned, f32>::from_euler(0.0, 0.0, self.heading_rad);
        let ned_from_body = Rotation::new(heading.quaternion * start.ned_from_body.quaternion);
        Some(Start { ned_from_body, ..start })
    }

    /// All sensors speak, it is known where a flight would begin, and the vehicle stands level and
    /// still.
    #[must_use]
    pub fn are_ready(&self, now_us: u64) -> bool {
        let speak = Reading::is_fresh(self.imu.as_ref(), now_us, IMU_AGE_US)
            && Reading::is_fresh(self.fix.as_ref(), now_us, GNSS_AGE_US)
            && Reading::is_fresh(self.pressure_pa.as_ref(), now_us, PRESSURE_AGE_US);
        let (true, Some(imu), Some(start)) = (speak, &self.imu, self.start()) else { return false };
        let (roll, pitch, _) = start.ned_from_body.euler();
        let rate = imu.value.omega.vector - start.gyro_bias.vector;
        roll.abs() < LEVEL_RAD && pitch.abs() < LEVEL_RAD && rate.norm() < STILL_RAD_S
    }

    /// What is new since the last frame.
    ///
    /// * `time_us` - since the flight began
    pub fn frame(&mut self, time_us: u64) -> SensorFrame {
        let mut frame = SensorFrame::empty(time_us);
        frame.imu = Reading::take(&mut self.imu);
        frame.gnss = Reading::take(&mut self.fix).map(|fix| {
            let place = self.place.get_or_insert(fix.place);
            Gnss { position: fix.place.from(place), velocity: fix.velocity }
        });
        frame.altitude_m = Reading::take(&mut self.pressure_pa)
            .map(|now| altitude_m(now, *self.ground_pa.get_or_insert(now)));
        frame
    }
}

/// It turns or is pushed, by what [`Preflight`] calls so.
fn is_moved(sample: &Imu) -> bool {
    let rest = RestParameters::default();
    let push_m_s2 = (sample.specific_force.vector.norm() - GRAVITY_M_S2 as f32).abs();
    sample.omega.vector.norm() >= rest.rate_max_rad_s || push_m_s2 >= rest.force_change_max_m_s2
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

    /// A second and a bit at rest, as the board lives it; the sensors, and the time.
    fn standing() -> (Sensors, u64) {
        let (mut sensors, mut now) = (Sensors::new(1.2), 0);
        stand(&mut sensors, &mut now, 330, In::new(Vector3::new(0.01, -0.02, 0.0)));
        (sensors, now)
    }

    fn stand(sensors: &mut Sensors, now: &mut u64, steps: u64, omega: In<Body, f32>) {
        for k in 0..steps {
            *now += 3333;
            sensors.imu(omega, rest().1, *now);
            if k % 30 == 0 {
                sensors.fix(fix(), *now);
            }
            if k % 6 == 0 {
                sensors.pressure(97_000.0, *now);
            }
            sensors.listen(*now);
        }
    }

    #[test]
    fn a_reading_is_in_one_frame_and_raw() {
        let (mut sensors, now) = standing();
        assert_eq!(sensors.frame(0), SensorFrame::empty(0), "what the ground has heard is not new");
        sensors.imu(In::new(Vector3::new(0.01, 0.0, 0.0)), rest().1, now + 1);
        sensors.fix(fix(), now + 1);
        sensors.pressure(96_880.0, now + 1);
        let next = sensors.frame(20);
        assert_eq!(next.imu.unwrap().omega.vector, Vector3::new(0.01, 0.0, 0.0));
        assert_eq!(next.attitude, None, "the flight code estimates");
        assert_eq!(next.gnss.unwrap().position, In::zero());
        assert!((next.altitude_m.unwrap() - 10.7).abs() < 0.3, "{next:?}");
        assert_eq!(sensors.frame(30), SensorFrame::empty(30));
    }

    #[test]
    fn a_second_at_rest_says_where_the_flight_begins() {
        let (mut sensors, mut now) = (Sensors::new(1.2), 0);
        stand(&mut sensors, &mut now, 280, In::zero());
        assert_eq!(sensors.start(), None, "it is no second yet");
        let (mut sensors, mut now) = standing();
        let start = sensors.start().unwrap();
        assert!((start.gyro_bias.vector - Vector3::new(0.01, -0.02, 0.0)).norm() < 1e-5);
        let truth = Rotation::<Ned, Body, f32>::from_euler(0.0, 0.0, 1.2);
        assert!(start.ned_from_body.quaternion.angle_to(&truth.quaternion) < 1e-3);
        assert_eq!((start.position, start.fix_offset), (In::zero(), In::zero()));
        // Moved and put down elsewhere, where the first fix says.
        stand(&mut sensors, &mut now, 1, In::new(Vector3::new(0.0, 0.5, 0.0)));
        assert_eq!((sensors.start(), sensors.place), (None, None));
        stand(&mut sensors, &mut now, 330, In::zero());
        assert!(sensors.start().is_some_and(|start| start.gyro_bias == In::zero()));
    }

    #[test]
    fn each_sensor_that_is_silent_or_missing_stands_against_arming() {
        let (sensors, now) = standing();
        assert!(sensors.are_ready(now));
        assert!(!sensors.are_ready(now + IMU_AGE_US + 1));
        assert!(!Sensors::new(0.0).are_ready(0));
        for missing in 0..3 {
            let (mut sensors, now) = standing();
            match missing {
                0 => sensors.fix = None,
                1 => sensors.pressure_pa = None,
                _ => sensors.place = None,
            }
            assert!(!sensors.are_ready(now), "{missing}");
        }
        let (mut moving, _) = standing();
        moving.imu(In::new(Vector3::new(0.0, 0.5, 0.0)), rest().1, now + 1);
        assert!(!moving.are_ready(now + 1));
    }

    #[test]
    fn tilted_it_is_not_ready() {
        let (mut sensors, mut now) = standing();
        for _ in 0..2000 {
            now += 3333;
            let tilted = Rotation::<Ned, Body, f32>::from_euler(0.25, 0.0, 0.0).inverse()
                * In::new(rest().1.vector);
            sensors.imu(In::zero(), tilted, now);
            sensors.fix(fix(), now);
            sensors.pressure(97_000.0, now);
            sensors.listen(now);
        }
        assert!(sensors.start().is_some() && !sensors.are_ready(now));
    }

    #[test]
    fn nonsense_is_silence() {
        let (mut sensors, now) = standing();
        sensors.imu(In::new(Vector3::new(f32::NAN, 0.0, 0.0)), rest().1, now + 1);
        for pressure in [f32::NAN, 0.0, -1.0, f32::INFINITY] {
            sensors.pressure(pressure, now + 1);
        }
        assert_eq!(sensors.frame(1), SensorFrame::empty(1));
    }
}
