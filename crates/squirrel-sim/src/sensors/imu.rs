//! Inertial units, and the vibration that shakes them.
//!
//! A unit reads `y = q(clip(M (x + v) + b0 + b + w + n))` for the rate and for the specific force:
//! `x` the truth, `v` the vibration, `M = diag(1 + s) R(e)` scale errors and the small rotation by
//! which the unit sits askew, `b0` the constant bias, `b` a bias drawn when the unit is switched
//! on, `w` its random walk (variance `K^2 t`), `n` white noise, then range and steps of the
//! converter. Terms after IEEE Std 952 (rate random walk, bias, scale factor, misalignment,
//! quantisation). The constant bias is of the vehicle and the same in both units; what is drawn is
//! each unit's own. The effects `accel_bias`, `accel_scale` and `gyro_scale` are on the first unit.
//!
//! Each rotor is a little out of balance: a force that turns with it, of size `m e W^2`. So every
//! axis sees `a (W / W0)^2 sin(phase + shift)`, the phase the integral of the rotor's speed, the
//! shift drawn for each rotor and axis. The device's filter, of second order and critically damped,
//! weakens it by `1 + (f / f_c)^2`; what is faster than half the rate then appears at its alias.
//! (Motion is slow beside the filter, which delays nothing here.) The airframe is stiff: both units
//! feel the same.

use super::Truth;
use super::line::{Line, Stopwatch, Stream, fork, noise, quantised, uniform};
use super::parameters::ImuSensor;
use rand_pcg::Pcg64Mcg;
use squirrel_core::frames::In;
use squirrel_core::nalgebra::{Matrix3, UnitQuaternion, Vector3};
use squirrel_core::stack::Imu;
use squirrel_core::vehicle::{MAX_ROTORS, PerRotor};
use std::f64::consts::TAU;

impl ImuSensor {
    /// Share of a vibration of this angular frequency, rad/s, that the device's filter lets
    /// through.
    fn passed(&self, speed_rad_s: f64) -> f64 {
        1.0 / (1.0 + (speed_rad_s / (TAU * self.bandwidth_hz)).powi(2))
    }

    /// Deviation on an axis of the specific force that four rotors shake up at
    /// `vibration_speed_rad_s`, m/s^2.
    pub(crate) fn shaken_m_s2(&self) -> f64 {
        // Four sines, each with a deviation of its amplitude over root two.
        2.0_f64.sqrt() * self.vibration_accel_m_s2 * self.passed(self.vibration_speed_rad_s)
    }
}

/// One unit.
#[derive(Debug, Clone)]
pub(super) struct Unit {
    line: Line<Imu>,
    rng: Pcg64Mcg,
    gyro: Channel,
    accel: Channel,
    watch: Stopwatch,
}

/// Gyroscope or accelerometer of a unit: what goes wrong slowly.
#[derive(Debug, Clone)]
struct Channel {
    /// Nothing where the unit is true and straight, so that its readings keep their bits.
    matrix: Option<Matrix3<f64>>,
    bias: Vector3<f64>,
}

/// Numbers of a channel for one sample.
struct Numbers {
    noise: f64,
    range: f64,
    resolution: f64,
}

impl Channel {
    fn draw(
        rng: &mut Pcg64Mcg,
        constant: [f64; 3],
        turn_on: f64,
        scale: f64,
        askew: Vector3<f64>,
    ) -> Self {
        let bias = Vector3::from(constant) + noise(rng, turn_on);
        let scales = noise(rng, scale);
        let straight = scales == Vector3::zeros() && askew == Vector3::zeros();
        let rotation = UnitQuaternion::from_scaled_axis(askew).to_rotation_matrix();
        let matrix = Matrix3::from_diagonal(&scales.add_scalar(1.0)) * rotation.matrix();
        Self { matrix: (!straight).then_some(matrix), bias }
    }

    /// * `shift` - on top of the bias
    fn read(
        &self,
        x: Vector3<f64>,
        shift: Vector3<f64>,
        rng: &mut Pcg64Mcg,
        n: &Numbers,
    ) -> Vector3<f32> {
        let seen = self.matrix.map_or(x, |matrix| matrix * x);
        let sum = seen + shift + self.bias + noise(rng, n.noise);
        sum.map(|x| quantised(x.clamp(-n.range, n.range), n.resolution) as f32)
    }
}

impl Unit {
    pub(super) fn new(p: &ImuSensor, seed: u64, [white, errors]: [Stream; 2]) -> Self {
        let mut rng = errors.start(&p.timing, seed);
        let askew = noise(&mut rng, p.misalignment_sd_rad);
        let gyro = Channel::draw(
            &mut rng,
            p.gyro_bias_rad_s,
            p.gyro_bias_sd_rad_s,
            p.gyro_scale_sd,
            askew,
        );
        let accel = Channel::draw(
            &mut rng,
            p.accel_bias_m_s2,
            p.accel_bias_sd_m_s2,
            p.accel_scale_sd,
            askew,
        );
        Self {
            line: Line::new(p.timing, seed, white),
            rng,
            gyro,
            accel,
            watch: Stopwatch::default(),
        }
    }

    /// * `omega`, `force` - rate and specific force where the unit is, with vibration
    /// * `force_bias` - of effects, m/s^2
    pub(super) fn poll(
        &mut self,
        p: &ImuSensor,
        time_us: u64,
        [omega, force]: [Vector3<f64>; 2],
        force_bias: Vector3<f64>,
    ) -> Option<Imu> {
        let Self { line, rng, gyro, accel, watch } = self;
        line.poll(time_us, |white| {
            let root_s = watch.lap_s(time_us).sqrt();
            if p.gyro_walk_rad_s_root_s > 0.0 || p.accel_walk_m_s2_root_s > 0.0 {
                gyro.bias += noise(rng, p.gyro_walk_rad_s_root_s * root_s);
                accel.bias += noise(rng, p.accel_walk_m_s2_root_s * root_s);
            }
            let of_gyro = Numbers {
                noise: p.gyro_noise_rad_s,
                range: p.gyro_range_rad_s,
                resolution: p.gyro_resolution_rad_s,
            };
            let of_accel = Numbers {
                noise: p.accel_noise_m_s2,
                range: p.accel_range_m_s2,
                resolution: p.accel_resolution_m_s2,
            };
            Some(Imu {
                omega: In::new(gyro.read(omega, Vector3::zeros(), white, &of_gyro)),
                specific_force: In::new(accel.read(force, force_bias, white, &of_accel)),
            })
        })
    }

    pub(super) fn fork(&mut self) {
        fork(&mut self.line.rng);
        fork(&mut self.rng);
    }
}

/// What the rotors do to the airframe.
#[derive(Debug, Clone)]
pub(super) struct Vibration {
    phase_rad: PerRotor<f64>,
    speed_rad_s: PerRotor<f64>,
    /// Of each rotor on the three rates and the three forces, rad.
    shift_rad: PerRotor<[f64; 6]>,
    watch: Stopwatch,
}

impl Vibration {
    /// Nothing where no rotor is out of balance.
    pub(super) fn new(p: &ImuSensor, seed: u64) -> Option<Self> {
        (p.vibration_gyro_rad_s > 0.0 || p.vibration_accel_m_s2 > 0.0).then(|| {
            let mut rng = Stream::Vibration.start(&p.timing, seed);
            Self {
                phase_rad: [0.0; MAX_ROTORS],
                speed_rad_s: [0.0; MAX_ROTORS],
                shift_rad: std::array::from_fn(|_| {
                    std::array::from_fn(|_| uniform(&mut rng) * TAU)
                }),
                watch: Stopwatch::default(),
            }
        })
    }

    /// Rate, rad/s, and specific force, m/s^2, of the shaking at a time. The speed is linear
    /// between calls.
    pub(super) fn shake(
        &mut self,
        p: &ImuSensor,
        time_us: u64,
        truth: &Truth,
    ) -> [Vector3<f64>; 2] {
        let elapsed_s = self.watch.lap_s(time_us);
        let mut sum = [0.0; 6];
        for rotor in 0..truth.rotor_count.min(MAX_ROTORS) {
            let speed = truth.rotor_speed_rad_s[rotor];
            let turned = 0.5 * (self.speed_rad_s[rotor] + speed) * elapsed_s;
            self.phase_rad[rotor] = (self.phase_rad[rotor] + turned) % TAU;
            self.speed_rad_s[rotor] = speed;
            let size = (speed / p.vibration_speed_rad_s).powi(2) * p.passed(speed);
            for (axis, shift) in sum.iter_mut().zip(self.shift_rad[rotor]) {
                *axis += size * (self.phase_rad[rotor] + shift).sin();
            }
        }
        let [rate, force] =
            [Vector3::from_row_slice(&sum[..3]), Vector3::from_row_slice(&sum[3..])];
        [rate * p.vibration_gyro_rad_s, force * p.vibration_accel_m_s2]
    }
}
