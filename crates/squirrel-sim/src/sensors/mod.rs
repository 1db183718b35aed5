//! Sensors: what the flight code gets to know, and when.
//!
//! Each sensor has a rate, a latency, white noise, a constant bias and its own random stream, so that switching one sensor's
//! noise on changes nothing in another's. A sample is taken at the sensor's rate and handed over when its latency has
//! passed, never before. Effects on sensors (biases that a vehicle file hides from the flight code, more latency) act here.

mod parameters;

pub use parameters::{
    AttitudeSensor, BaroSensor, BatterySensor, GnssSensor, ImuSensor, SensorParameters, Timing,
};

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use squirrel_core::effects::Effects;
use squirrel_core::frames::{Body, In, Ned, Rotation};
use squirrel_core::nalgebra::{UnitQuaternion, Vector3};
use squirrel_core::stack::{Gnss, Imu, SensorFrame};
use std::collections::VecDeque;

/// What the sensors measure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// Position, m.
    pub position: In<Ned, f64>,
    /// Velocity over ground, m/s.
    pub velocity: In<Ned, f64>,
    /// Attitude.
    pub ned_from_body: Rotation<Ned, Body, f64>,
    /// Angular rate, rad/s.
    pub omega: In<Body, f64>,
    /// Specific force, m/s^2.
    pub specific_force: In<Body, f64>,
    /// Battery terminal voltage, V.
    pub voltage_v: f64,
    /// Battery current, A.
    pub current_a: f64,
}

/// Reading of the battery monitor; for the log, the flight code does not use it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BatteryReading {
    /// Voltage, V.
    pub voltage_v: f64,
    /// Current, A.
    pub current_a: f64,
}

/// Samples on their way, with the time at which they arrive.
#[derive(Debug, Clone)]
struct Line<S> {
    timing: Timing,
    rng: Pcg64Mcg,
    taken: u64,
    waiting: VecDeque<(u64, S)>,
}

impl<S> Line<S> {
    fn new(timing: Timing, seed: u64, stream: u64) -> Self {
        // Streams are apart by a large odd number; the seeding itself mixes the bits.
        let own =
            timing.seed.unwrap_or_else(|| seed.wrapping_add(stream.wrapping_mul(0x9E37_79B9_7F4A_7C15)));
        Self { timing, rng: Pcg64Mcg::seed_from_u64(own), taken: 0, waiting: VecDeque::new() }
    }

    /// Takes a sample if one is due, and returns the newest that has arrived.
    fn poll(&mut self, time_us: u64, sample: impl FnOnce(&mut Pcg64Mcg) -> S) -> Option<S> {
        let due = (self.taken as f64 * 1e6 / self.timing.rate_hz).floor() as u64;
        if time_us >= due {
            let value = sample(&mut self.rng);
            let late = (self.timing.latency_s * 1e6).round() as u64;
            self.waiting.push_back((time_us.saturating_add(late), value));
            // Periods shorter than the polling interval do not pile up.
            self.taken = (self.taken + 1).max((time_us as f64 * 1e-6 * self.timing.rate_hz) as u64 + 1);
        }
        let mut newest = None;
        while self.waiting.front().is_some_and(|(arrival, _)| *arrival <= time_us) {
            newest = self.waiting.pop_front().map(|(_, value)| value);
        }
        newest
    }
}

/// The sensors of one vehicle in one flight.
#[derive(Debug, Clone)]
pub struct Sensors {
    parameters: SensorParameters,
    effects: Effects<f64>,
    imu: Line<Imu>,
    attitude: Line<Rotation<Ned, Body, f32>>,
    gnss: Line<Gnss>,
    baro: Line<f32>,
    battery: Line<BatteryReading>,
}

fn noise(rng: &mut Pcg64Mcg, sd: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| { let x: f64 = StandardNormal.sample(rng); x } * sd)
}

impl Sensors {
    /// * `seed` - of the flight; a sensor with its own `seed` does not look at it
    pub fn new(mut parameters: SensorParameters, effects: &Effects<f64>, seed: u64) -> Self {
        parameters.gnss.timing.latency_s += effects.gnss_latency_s();
        Self {
            parameters,
            effects: *effects,
            imu: Line::new(parameters.imu.timing, seed, 1),
            attitude: Line::new(parameters.attitude.timing, seed, 2),
            gnss: Line::new(parameters.gnss.timing, seed, 3),
            baro: Line::new(parameters.baro.timing, seed, 4),
            battery: Line::new(parameters.battery.timing, seed, 5),
        }
    }

    /// What has arrived at a time, us. Times must not run backwards.
    pub fn poll(&mut self, time_us: u64, truth: &Truth) -> (SensorFrame, Option<BatteryReading>) {
        let p = &self.parameters;
        let time_s = time_us as f64 * 1e-6;
        let force_bias = self.effects.specific_force_bias(time_s);
        let heading_bias =
            Rotation::<Ned, Ned, f64>::from_euler(0.0, 0.0, self.effects.heading_bias_rad(time_s));
        let mut frame = SensorFrame::empty(time_us);
        frame.imu = self.imu.poll(time_us, |rng| Imu {
            omega: In::new(
                (truth.omega.vector
                    + Vector3::from(p.imu.gyro_bias_rad_s)
                    + noise(rng, p.imu.gyro_noise_rad_s))
                .map(|x| x as f32),
            ),
            specific_force: In::new(
                (truth.specific_force.vector
                    + force_bias.vector
                    + Vector3::from(p.imu.accel_bias_m_s2)
                    + noise(rng, p.imu.accel_noise_m_s2))
                .map(|x| x as f32),
            ),
        });
        frame.attitude = self.attitude.poll(time_us, |rng| {
            let error = Vector3::from(p.attitude.bias_rad) + noise(rng, p.attitude.noise_rad);
            let estimate = heading_bias.quaternion
                * truth.ned_from_body.quaternion
                * UnitQuaternion::from_scaled_axis(error);
            Rotation::new(UnitQuaternion::new_unchecked(estimate.into_inner().cast::<f32>()))
        });
        frame.gnss = self.gnss.poll(time_us, |rng| Gnss {
            position: In::new(
                (truth.position.vector
                    + Vector3::from(p.gnss.position_bias_m)
                    + noise(rng, p.gnss.position_noise_m))
                .map(|x| x as f32),
            ),
            velocity: In::new(
                (truth.velocity.vector
                    + Vector3::from(p.gnss.velocity_bias_m_s)
                    + noise(rng, p.gnss.velocity_noise_m_s))
                .map(|x| x as f32),
            ),
        });
        frame.altitude_m = self.baro.poll(time_us, |rng| {
            (-truth.position.vector.z + p.baro.bias_m + noise(rng, p.baro.noise_m).x) as f32
        });
        let battery = self.battery.poll(time_us, |rng| BatteryReading {
            voltage_v: truth.voltage_v + p.battery.voltage_bias_v + noise(rng, p.battery.voltage_noise_v).x,
            current_a: truth.current_a + p.battery.current_bias_a + noise(rng, p.battery.current_noise_a).x,
        });
        (frame, battery)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn truth() -> Truth {
        Truth {
            position: In::new(Vector3::new(1.0, 2.0, -3.0)),
            velocity: In::new(Vector3::new(4.0, 5.0, 6.0)),
            ned_from_body: Rotation::identity(),
            omega: In::new(Vector3::new(0.1, 0.2, 0.3)),
            specific_force: In::new(Vector3::new(0.0, 0.0, -9.8)),
            voltage_v: 15.0,
            current_a: 10.0,
        }
    }

    #[test]
    fn each_sensor_speaks_at_its_rate_and_after_its_latency() {
        let mut p = SensorParameters::ideal();
        p.gnss.timing = Timing { rate_hz: 10.0, latency_s: 0.15, seed: None };
        let mut sensors = Sensors::new(p, &Effects::none(), 1);
        let (mut imu, mut fixes) = (0_i32, Vec::new());
        for k in 0..3000u64 {
            let time_us = k * 1000 / 3;
            let mut now = truth();
            now.position = In::new(Vector3::new(time_us as f64 * 1e-6, 0.0, 0.0));
            let (frame, _) = sensors.poll(time_us, &now);
            imu += i32::from(frame.imu.is_some());
            if let Some(gnss) = frame.gnss {
                fixes.push((time_us, gnss.position.vector.x));
            }
        }
        assert!((imu - 300).abs() <= 1, "{imu} samples in a second at 300 Hz");
        assert_eq!(fixes.len(), 9);
        for (time_us, north) in fixes {
            let age = time_us as f64 * 1e-6 - f64::from(north);
            assert!((age - 0.15).abs() < 1e-3, "a fix is as old as its latency");
        }
    }

    #[test]
    fn ideal_sensors_tell_the_truth() {
        let (frame, battery) = Sensors::new(SensorParameters::ideal(), &Effects::none(), 1).poll(0, &truth());
        assert_eq!(frame.gnss.unwrap().velocity.vector, Vector3::new(4.0, 5.0, 6.0));
        assert_eq!(frame.altitude_m, Some(3.0));
        assert_eq!(frame.imu.unwrap().omega.vector, Vector3::new(0.1, 0.2, 0.3));
        assert_eq!(battery.unwrap().voltage_v, 15.0);
    }

    #[test]
    fn noise_has_its_size_and_bias_its_place() {
        let mut p = SensorParameters::ideal();
        p.baro.noise_m = 0.2;
        p.baro.bias_m = 1.0;
        p.baro.timing.rate_hz = 1000.0;
        let mut sensors = Sensors::new(p, &Effects::none(), 3);
        let n = 20_000u32;
        let errors: Vec<f64> = (0..n)
            .filter_map(|k| sensors.poll(u64::from(k) * 1000, &truth()).0.altitude_m)
            .map(|a| f64::from(a) - 3.0)
            .collect();
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        let sd = (errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / errors.len() as f64).sqrt();
        assert!((mean - 1.0).abs() < 0.01 && (sd - 0.2).abs() < 0.005, "{mean} {sd}");
    }

    /// One sensor's noise does not shift another's stream.
    #[test]
    fn streams_are_independent() {
        let gyro = |baro_noise: f64| {
            let mut p = SensorParameters::default();
            p.baro.noise_m = baro_noise;
            let mut sensors = Sensors::new(p, &Effects::none(), 5);
            (0..100u64)
                .filter_map(|k| sensors.poll(k * 3334, &truth()).0.imu)
                .map(|i| i.omega.vector.x)
                .last()
        };
        assert_eq!(gyro(0.0), gyro(1.0));
    }

    /// Hashes of what the sensors say: old seeds fly old flights.
    #[test]
    fn readings_of_old_flights_keep_their_bits() {
        let mut p = SensorParameters::default();
        p.imu.timing.seed = Some(9);
        p.imu.gyro_bias_rad_s = [0.01, -0.02, 0.03];
        p.baro.bias_m = 0.4;
        p.gnss.timing.latency_s = 0.15;
        let mut effects = Effects::none();
        effects.insert("heading_bias").unwrap().values[0] = 0.1;
        effects.insert("accel_bias").unwrap().values[..3].copy_from_slice(&[0.1, 0.2, 0.3]);
        let cases = [
            (SensorParameters::default(), Effects::none(), 42, 0xcceb_c0b3_0a7d_8b53),
            (p, effects, 7, 0x648e_2c35_8725_251a),
        ];
        for (p, effects, seed, before) in cases {
            let mut sensors = Sensors::new(p, &effects, seed);
            let mut hash = 0xcbf2_9ce4_8422_2325_u64;
            let mut eat = |bits: u64| hash = (hash ^ bits).wrapping_mul(0x0100_0000_01b3);
            for k in 0..900_u64 {
                let (frame, battery) = sensors.poll(k * 10_000 / 3, &truth());
                let mut single = Vec::new();
                if let Some(imu) = frame.imu {
                    single.extend(imu.omega.vector.iter().chain(&imu.specific_force.vector));
                }
                if let Some(q) = frame.attitude {
                    single.extend(q.wxyz());
                }
                if let Some(fix) = frame.gnss {
                    single.extend(fix.position.vector.iter().chain(&fix.velocity.vector));
                }
                single.extend(frame.altitude_m);
                for x in single {
                    eat(x.to_bits().into());
                }
                if let Some(b) = battery {
                    eat(b.voltage_v.to_bits());
                    eat(b.current_a.to_bits());
                }
            }
            assert_eq!(hash, before, "seed {seed}");
        }
    }
}
