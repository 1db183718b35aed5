//! Magnetometer.
//!
//! The earth's field is `B = F (cos I, 0, sin I)` in north, east, down: north of the mission is
//! magnetic north, so there is no declination. Reading: `m = (1 + S) R^T B + h + k i + n`, with
//! soft iron `S` (symmetric, every entry drawn), hard iron `h` (drawn), the field of the supply
//! wires `k i` at battery current `i`, and white noise; then range and steps of the converter. Form
//! and symbols after Vasconcelos et al., IEEE Trans. AES 47 (2011) 1293. The effect `heading_bias`
//! turns the field as it turns the measured attitude, so that a heading worked out of it has the
//! same error.

use super::Truth;
use super::line::{Line, Stream, fork, noise, quantised};
use super::parameters::MagnetometerSensor;
use squirrel_core::frames::{Body, In, Ned, Rotation};
use squirrel_core::nalgebra::{Matrix3, Vector3};

/// The magnetometer in one flight.
#[derive(Debug, Clone)]
pub(super) struct Compass {
    line: Line<In<Body, f32>>,
    hard_ut: Vector3<f64>,
    soft: Matrix3<f64>,
}

impl Compass {
    pub(super) fn new(p: &MagnetometerSensor, seed: u64) -> Self {
        let mut rng = Stream::Iron.start(&p.timing, seed);
        let hard_ut = noise(&mut rng, p.hard_iron_sd_ut);
        let [diagonal, rest] = [noise(&mut rng, p.soft_iron_sd), noise(&mut rng, p.soft_iron_sd)];
        let soft = Matrix3::new(
            diagonal.x, rest.x, rest.y, //
            rest.x, diagonal.y, rest.z, //
            rest.y, rest.z, diagonal.z,
        );
        Self { line: Line::new(p.timing, seed, Stream::Magnetometer), hard_ut, soft }
    }

    /// * `ned_from_body` - attitude as measured: with what effects do to the heading
    pub(super) fn poll(
        &mut self,
        p: &MagnetometerSensor,
        time_us: u64,
        ned_from_body: Rotation<Ned, Body, f64>,
        truth: &Truth,
    ) -> Option<In<Body, f32>> {
        let Self { line, hard_ut, soft } = self;
        line.poll(time_us, |rng| {
            let (sin, cos) = p.inclination_rad.sin_cos();
            let earth = ned_from_body.inverse() * In::new(Vector3::new(cos, 0.0, sin) * p.field_ut);
            let reading = earth.vector
                + *soft * earth.vector
                + *hard_ut
                + Vector3::from(p.current_ut_per_a) * truth.current_a
                + noise(rng, p.noise_ut);
            let range = p.range_ut;
            let steps = reading.map(|x| quantised(x.clamp(-range, range), p.resolution_ut) as f32);
            Some(In::new(steps))
        })
    }

    pub(super) fn fork(&mut self) {
        fork(&mut self.line.rng);
    }
}
