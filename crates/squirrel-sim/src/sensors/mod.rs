//! Sensors: what the flight code gets to know, and when.
//!
//! Each sensor has a rate, a latency, its errors and its own random streams, so that switching one
//! sensor's noise on changes nothing in another's. A sample is taken at the sensor's rate and
//! handed over when its latency has passed, never before. Effects on sensors (biases that a vehicle
//! file hides from the flight code, more latency) act here. What a sensor reads is in its file; the
//! attitude is as simple as truth, bias and white noise. Those that are logged as they are, of which
//! the flight code hears the voltage, are in `logged`.

mod baro;
mod devices;
mod gnss;
mod imu;
mod line;
pub mod logged;
mod magnetometer;
mod parameters;
mod suite;
mod table;
#[cfg(test)]
mod tests;

pub use logged::BatterySensor;
pub use parameters::{
    AttitudeSensor, BaroSensor, GnssSensor, ImuSensor, MagnetometerSensor, Timing,
};
pub use suite::{SUITES, SensorParameters};

use baro::Barometer;
use gnss::Receiver;
use imu::{Unit, Vibration};
use line::{Line, Stream, fork, noise};
use logged::{LoggedLine, Row, VOLTAGE};
use magnetometer::Compass;
use squirrel_core::effects::Effects;
use squirrel_core::frames::{Body, In, Ned, Rotation};
use squirrel_core::math::GRAVITY_M_S2;
use squirrel_core::nalgebra::{UnitQuaternion, Vector3};
use squirrel_core::stack::SensorFrame;
use squirrel_core::vehicle::{MAX_ROTORS, PerRotor};

/// What the sensors measure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// Position, m.
    pub position: In<Ned, f64>,
    /// Velocity over ground, m/s.
    pub velocity: In<Ned, f64>,
    /// Velocity of the body through the air, m/s.
    pub through_air: In<Body, f64>,
    /// Attitude.
    pub ned_from_body: Rotation<Ned, Body, f64>,
    /// Angular rate, rad/s.
    pub omega: In<Body, f64>,
    /// Specific force, m/s^2.
    pub specific_force: In<Body, f64>,
    /// Speed of each rotor, rad/s.
    pub rotor_speed_rad_s: PerRotor<f64>,
    /// How many rotors there are.
    pub rotor_count: usize,
    /// Power of the rotors over that in hover.
    pub rotor_load: f64,
    /// How far the wings are spread, left and right, 0 to 1.
    pub deployment: [f64; 2],
    /// Battery terminal voltage, V.
    pub voltage_v: f64,
    /// Battery current, A.
    pub current_a: f64,
}

impl Truth {
    /// Level on the ground in still air, rotors standing, nothing switched on.
    ///
    /// * `heading_rad` - from north towards east
    pub fn at_rest(position: In<Ned, f64>, heading_rad: f64) -> Self {
        Self {
            position,
            velocity: In::zero(),
            through_air: In::zero(),
            ned_from_body: Rotation::from_euler(0.0, 0.0, heading_rad),
            omega: In::zero(),
            specific_force: In::new(Vector3::z() * -GRAVITY_M_S2),
            rotor_speed_rad_s: [0.0; MAX_ROTORS],
            rotor_count: 0,
            rotor_load: 0.0,
            deployment: [0.0; 2],
            voltage_v: 0.0,
            current_a: 0.0,
        }
    }
}

/// Samples of the inertial units that make a second at rest.
const SAMPLES_AT_REST: f64 = 300.0;

/// The sensors of one vehicle in one flight.
#[derive(Debug, Clone)]
pub struct Sensors {
    parameters: SensorParameters,
    effects: Effects<f64>,
    imu: Unit,
    imu_2: Option<Unit>,
    vibration: Option<Vibration>,
    attitude: Line<Rotation<Ned, Body, f32>>,
    gnss: Receiver,
    baro: Barometer,
    compass: Option<Compass>,
    logged: Vec<LoggedLine>,
}

impl Sensors {
    /// * `seed` - of the flight; a sensor with its own `seed` does not look at it
    pub fn new(mut parameters: SensorParameters, effects: &Effects<f64>, seed: u64) -> Self {
        parameters.gnss.timing.latency_s += effects.gnss_latency_s();
        let p = &parameters;
        Self {
            effects: *effects,
            imu: Unit::new(&p.imu, seed, [Stream::Imu, Stream::ImuErrors]),
            imu_2: (p.imu.units > 1)
                .then(|| Unit::new(&p.imu, seed, [Stream::Imu2, Stream::Imu2Errors])),
            vibration: Vibration::new(&p.imu, seed),
            attitude: Line::new(p.attitude.timing, seed, Stream::Attitude),
            gnss: Receiver::new(&p.gnss, seed),
            baro: Barometer::new(&p.baro, seed),
            compass: p.magnetometer.map(|p| Compass::new(&p, seed)),
            logged: p.logged.lines(seed),
            parameters,
        }
    }

    /// What has arrived at a time, us, for the flight code, and for the log by its source. Times
    /// must not run backwards.
    pub fn poll(&mut self, time_us: u64, truth: &Truth) -> (SensorFrame, Vec<(&'static str, Row)>) {
        let p = &self.parameters;
        let time_s = time_us as f64 * 1e-6;
        let force_bias = self.effects.specific_force_bias(time_s).vector;
        let heading_bias_rad = self.effects.heading_bias_rad(time_s, truth.rotor_load);
        let heading_bias = Rotation::<Ned, Ned, f64>::from_euler(0.0, 0.0, heading_bias_rad);
        let mut frame = SensorFrame::empty(time_us);
        let mut moved = [truth.omega.vector, truth.specific_force.vector];
        if let Some(vibration) = &mut self.vibration {
            let [rate, force] = vibration.shake(&p.imu, time_us, truth);
            moved = [moved[0] + rate, moved[1] + force];
        }
        let scales = [self.effects.gyro_scale(), self.effects.accel_scale()]
            .map(|s| s.vector.add_scalar(1.0));
        let scaled = [moved[0].component_mul(&scales[0]), moved[1].component_mul(&scales[1])];
        frame.imu = self.imu.poll(&p.imu, time_us, scaled, force_bias);
        if let Some(unit) = &mut self.imu_2 {
            frame.imu_2 = unit.poll(&p.imu, time_us, moved, Vector3::zeros());
        }
        frame.attitude = self.attitude.poll(time_us, |rng| {
            let error = Vector3::from(p.attitude.bias_rad) + noise(rng, p.attitude.noise_rad);
            let estimate = heading_bias.quaternion
                * truth.ned_from_body.quaternion
                * UnitQuaternion::from_scaled_axis(error);
            Some(Rotation::new(UnitQuaternion::new_unchecked(estimate.into_inner().cast::<f32>())))
        });
        frame.gnss = self.gnss.poll(&p.gnss, time_us, truth);
        frame.altitude_m = self.baro.poll(&p.baro, time_us, truth);
        if let (Some(compass), Some(p)) = (&mut self.compass, &p.magnetometer) {
            let measured = Rotation::new(heading_bias.quaternion * truth.ned_from_body.quaternion);
            frame.magnetic = compass.poll(p, time_us, measured, truth);
        }
        let logged: Vec<_> =
            self.logged.iter_mut().filter_map(|line| line.poll(time_us, truth)).collect();
        let heard = logged.iter().flat_map(|(_, row)| row).find(|(name, _)| *name == VOLTAGE);
        frame.battery_v = heard.map(|(_, voltage_v)| *voltage_v as f32);
        (frame, logged)
    }

    /// What these sensors say in a second at rest before the flight, or longer where inertial units
    /// are slow, at their rate: level on the ground, rotors standing. Biases, scales, iron and the
    /// satellite receiver's slow error are the flight's, at its start; white noise is another, as
    /// it would be a second earlier. The flight's own streams are untouched. Ask before the first
    /// [`Self::poll`].
    ///
    /// * `position` - where the mission starts, m
    /// * `heading_rad` - from north towards east
    pub fn at_rest(&self, position: In<Ned, f64>, heading_rad: f64) -> Vec<SensorFrame> {
        let mut copy = self.clone();
        copy.imu.fork();
        if let Some(unit) = &mut copy.imu_2 {
            unit.fork();
        }
        if let Some(compass) = &mut copy.compass {
            compass.fork();
        }
        copy.gnss.fork();
        copy.baro.fork();
        fork(&mut copy.attitude.rng);
        let truth = Truth::at_rest(position, heading_rad);
        let rate_hz = self.parameters.imu.timing.rate_hz;
        // As many as a flight code wants to hear, and those that are still on their way.
        let late = (self.parameters.imu.timing.latency_s * rate_hz).ceil();
        let samples = (f64::max(rate_hz.round(), SAMPLES_AT_REST) + late) as u64;
        (0..samples)
            .map(|k| copy.poll((k as f64 * 1e6 / rate_hz).ceil() as u64, &truth).0)
            .collect()
    }
}
