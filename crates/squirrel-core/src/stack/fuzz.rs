//! Sensors that say anything: every filter in the stack, frames that are noise, nonsense, late,
//! repeated or missing.
//!
//! Ten million frames in a release build, two hundred thousand in another; `FUZZ_FRAMES=n` flies n.

use super::tests::{level, stack_with};
use super::*;
use crate::estimate::eskf::EskfParameters;
use crate::estimate::mahony::MahonyParameters;
use crate::estimate::mekf::MekfParameters;
use crate::estimate::navigator::Filter;
use crate::estimate::rkf::RkfParameters;

/// A stream of numbers that look random.
struct Draw(u64);

impl Draw {
    fn bits(&mut self) -> u64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.0 ^ (self.0 >> 29)
    }

    fn one_in(&mut self, n: u64) -> bool {
        self.bits().is_multiple_of(n)
    }

    /// Of a size that makes sense, or any float there is.
    fn number(&mut self, size: f32) -> f32 {
        if self.one_in(60) {
            return f32::from_bits((self.bits() >> 20) as u32);
        }
        if self.one_in(60) {
            return [
                f32::NAN,
                f32::INFINITY,
                f32::NEG_INFINITY,
                f32::MAX,
                -f32::MAX,
                f32::MIN_POSITIVE,
                -0.0,
            ][(self.bits() >> 13) as usize % 7];
        }
        size * ((self.bits() >> 40) as f32 / (1u64 << 23) as f32 - 1.0)
    }

    fn vector(&mut self, size: f32) -> Vector3<f32> {
        // Most vectors are whole, so that some get through.
        if self.one_in(20) {
            return Vector3::from_fn(|_, _| self.number(size));
        }
        Vector3::from_fn(|_, _| size * ((self.bits() >> 40) as f32 / (1u64 << 23) as f32 - 1.0))
    }

    fn imu(&mut self) -> Imu {
        let wild = if self.one_in(50) { 1000.0 } else { 1.0 };
        Imu {
            omega: In::new(self.vector(wild)),
            specific_force: In::new(self.vector(3.0 * wild) - Vector3::z() * 9.8),
        }
    }

    fn frame(&mut self, time_us: u64, last: &SensorFrame) -> SensorFrame {
        let mut frame = SensorFrame::empty(time_us);
        frame.imu = if self.one_in(10) { last.imu } else { Some(self.imu()) };
        frame.imu_2 = if self.one_in(3) { last.imu_2 } else { Some(self.imu()) };
        let far = if self.one_in(100) { 1e7 } else { 5.0 };
        frame.gnss = self.one_in(30).then(|| {
            let (position, velocity) = (In::new(self.vector(far)), In::new(self.vector(far)));
            Gnss { position, velocity }
        });
        frame.altitude_m = self.one_in(6).then(|| self.number(far));
        frame.magnetic =
            self.one_in(6).then(|| In::new(self.vector(if far > 10.0 { far } else { 50.0 })));
        if self.one_in(40) {
            (frame.imu, frame.imu_2) = (None, None);
        }
        frame
    }
}

#[test]
fn fuzzed_sensors_never_reach_the_rotors() {
    let frames: u64 = std::env::var("FUZZ_FRAMES")
        .ok()
        .and_then(|n| n.parse().ok())
        .unwrap_or(if cfg!(debug_assertions) { 200_000 } else { 10_000_000 });
    let filters = [
        Filter::Eskf(EskfParameters::default()),
        Filter::Eskf(EskfParameters { gnss_latency_s: 0.3, ..EskfParameters::default() }),
        Filter::Mekf(MekfParameters::default()),
        Filter::Mahony(MahonyParameters::default()),
        Filter::Rkf(RkfParameters::default()),
    ];
    for (which, filter) in filters.into_iter().enumerate() {
        let stack = stack_with(Navigation { filter, ..Navigation::external() });
        let (mut state, mut draw) = (StackState::default(), Draw(which as u64 + 7));
        let (mut time_us, mut last, mut believed) = (0u64, SensorFrame::empty(0), 0u64);
        for k in 0..frames / filters.len() as u64 {
            // Mostly the rate of flight; now and then time stands, jumps or runs backwards.
            time_us = match draw.bits() % 500 {
                0 => time_us,
                1 => time_us.saturating_add(draw.bits() % 3_000_000),
                2 => time_us.saturating_sub(draw.bits() % 100_000),
                _ => time_us + 3333,
            };
            let frame = draw.frame(time_us, &last);
            let output = stack.step(&mut state, &frame);
            for command in &output.rotor_command[..4] {
                assert!(
                    (0.0..=1.0).contains(command),
                    "filter {which}, frame {k}: {frame:?}: {output:?}"
                );
            }
            assert!(
                output.wing_command.iter().all(|w| (0.0..=1.0).contains(w)),
                "{which}, {k}: {output:?}"
            );
            if let Some(terms) = &output.navigation {
                let length = terms.ned_from_body.quaternion.into_inner().norm();
                let numbers = [terms.position, terms.velocity].map(|v| v.vector);
                assert!((length - 1.0).abs() < 1e-3, "{which}, {k}: {terms:?}");
                assert!(numbers.iter().all(crate::math::all_finite), "{which}, {k}: {terms:?}");
                assert!(
                    crate::math::all_finite(&terms.gyro_bias.vector),
                    "{which}, {k}: {terms:?}"
                );
                believed += 1;
            }
            last = frame;
        }
        assert!(believed > frames / 10, "filter {which} estimated in {believed} frames");
        if !matches!(filter, Filter::Eskf(_)) {
            // The others have no gates, and no way back from every nonsense.
            continue;
        }
        // Sensors that are well again are heard: a minute later it stands level where the fixes
        // say.
        for k in 0..18_000u64 {
            time_us += 3333;
            let mut frame = level(time_us);
            let wobble = 0.01 * ((k % 7) as f32 - 3.0);
            for imu in [&mut frame.imu, &mut frame.imu_2] {
                let omega = In::new(Vector3::new(wobble, -wobble, 0.5 * wobble));
                *imu = Some(Imu {
                    omega,
                    specific_force: In::new(Vector3::new(wobble, wobble, -9.806_65)),
                });
            }
            let fix =
                Gnss { position: In::new(Vector3::new(wobble, 0.0, 0.0)), velocity: In::zero() };
            frame.gnss = k.is_multiple_of(30).then_some(fix);
            frame.altitude_m = k.is_multiple_of(6).then_some(wobble);
            frame.magnetic = k.is_multiple_of(6).then(|| In::new(Vector3::new(20.0, wobble, 43.0)));
            let output = stack.step(&mut state, &frame);
            if k == 17_999 {
                let terms =
                    output.navigation.unwrap_or_else(|| panic!("filter {which} never came back"));
                let down = terms.ned_from_body.quaternion.inverse_transform_vector(&Vector3::z());
                assert!(down.z > 0.99, "filter {which}: {terms:?}");
                assert!(terms.velocity.vector.norm() < 0.5, "filter {which}: {terms:?}");
            }
        }
    }
}
