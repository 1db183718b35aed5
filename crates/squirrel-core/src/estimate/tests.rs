//! Filters on flights of which everything is known: positions that are sums of sines, thrust along
//! what they accelerate by.
#![allow(
    clippy::unwrap_used,
    clippy::disallowed_methods,
    reason = "tests; no force and no direction here is zero"
)]

use super::altitude::{AltitudeFilter, AltitudeParameters};
use super::eskf::{Eskf, EskfParameters};
use super::mahony::{Mahony, MahonyParameters};
use super::mekf::{Mekf, MekfParameters};
use super::rest::{RestCalibration, RestParameters};
use super::rkf::{Fading, Rkf, RkfParameters};
use super::*;
use crate::math::GRAVITY_M_S2;

pub(crate) const RATE_HZ: u64 = 300;

/// A stream of numbers that look random, with unit variance.
pub(super) struct Noise(pub(super) u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
    pub(super) fn vector(&mut self, size: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.normal()) * size
    }
}

/// A flight that accelerates all the time once it has begun.
struct Flight {
    amplitude_m: Vector3<f64>,
    rate_rad_s: Vector3<f64>,
    phase_rad: Vector3<f64>,
}

#[derive(Debug, Clone, Copy)]
struct Moment {
    position: Vector3<f64>,
    velocity: Vector3<f64>,
    attitude: UnitQuaternion<f64>,
    force_body: Vector3<f64>,
}

impl Flight {
    fn agile(seed: u64) -> Self {
        let mut noise = Noise(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) + 1);
        let mut between = |low: f64, high: f64| low + (high - low) * noise.uniform();
        let rate_rad_s = Vector3::new(between(0.5, 1.3), between(0.5, 1.3), between(0.4, 0.9));
        // Accelerations of 4 to 7 m/s^2 on the flat, 1.5 m/s^2 in height.
        let acceleration = Vector3::new(between(4.0, 7.0), between(4.0, 7.0), 1.5);
        Self {
            amplitude_m: acceleration.component_div(&rate_rad_s.component_mul(&rate_rad_s)),
            rate_rad_s,
            phase_rad: Vector3::new(between(0.0, 6.0), between(0.0, 6.0), between(0.0, 6.0)),
        }
    }

    fn hover() -> Self {
        Self {
            amplitude_m: Vector3::zeros(),
            rate_rad_s: Vector3::repeat(1.0),
            phase_rad: Vector3::zeros(),
        }
    }

    fn at(&self, time_s: f64) -> Moment {
        // Two seconds at rest, and then a start over four.
        let begun = ((time_s - 2.0) / 4.0).clamp(0.0, 1.0);
        let pace = begun * begun * (3.0 - 2.0 * begun);
        let gain_per_s = 6.0 * begun * (1.0 - begun) / 4.0;
        let run_s = 4.0 * begun.powi(3) * (1.0 - 0.5 * begun) + (time_s - 6.0).max(0.0);
        let angle = self.rate_rad_s * run_s + self.phase_rad;
        let (s, c) = (angle.map(f64::sin), angle.map(f64::cos));
        let speed = self.amplitude_m.component_mul(&self.rate_rad_s);
        let position = self.amplitude_m.component_mul(&(s - self.phase_rad.map(f64::sin)));
        let velocity = speed.component_mul(&c) * pace;
        let acceleration = speed.component_mul(&c) * gain_per_s
            - speed.component_mul(&self.rate_rad_s).component_mul(&s) * (pace * pace);
        let force = acceleration - Vector3::new(0.0, 0.0, GRAVITY_M_S2);
        // Body z against the force, heading turning slowly.
        let z = -force.normalize();
        let yaw = 0.2 * time_s;
        let y = z.cross(&Vector3::new(yaw.cos(), yaw.sin(), 0.0)).normalize();
        let rotation = nalgebra::Rotation3::from_basis_unchecked(&[y.cross(&z), y, z]);
        let attitude = UnitQuaternion::from_rotation_matrix(&rotation);
        Moment {
            position,
            velocity,
            attitude,
            force_body: attitude.inverse_transform_vector(&force),
        }
    }
}

/// What is wrong with the sensors.
#[derive(Debug, Clone, Copy)]
struct Wrong {
    gyro_bias: Vector3<f64>,
    latency_s: f64,
    seed: u64,
}

impl Wrong {
    fn nothing(seed: u64) -> Self {
        Self { gyro_bias: Vector3::zeros(), latency_s: 0.0, seed }
    }
    /// 0.4 degrees a second and its like, which nobody calibrated.
    fn uncalibrated(seed: u64) -> Self {
        Self { gyro_bias: Vector3::new(0.4, -0.3, 0.2).map(f64::to_radians), ..Self::nothing(seed) }
    }
}

/// Flies for a time; hands each step's truth to `look` after the filter has heard it.
fn fly(
    flight: &Flight,
    wrong: Wrong,
    seconds: u64,
    filter: &mut impl Estimator,
    mut look: impl FnMut(f64, &Moment, &Estimate),
) {
    let mut noise = Noise(wrong.seed);
    let dt = 1.0 / RATE_HZ as f64;
    for k in 1..=seconds * RATE_HZ {
        let now = k as f64 * dt;
        let (before, moment) = (flight.at(now - dt), flight.at(now));
        let turn = (before.attitude.inverse() * moment.attitude).scaled_axis() / dt;
        let middle = flight.at(now - 0.5 * dt);
        let narrow = |v: Vector3<f64>| v.map(|x| x as f32);
        let imu = Imu {
            omega: In::new(narrow(turn + wrong.gyro_bias + noise.vector(0.0045))),
            specific_force: In::new(narrow(middle.force_body + noise.vector(0.25))),
        };
        let then = flight.at(now - wrong.latency_s);
        let fix = Gnss {
            position: In::new(narrow(then.position + noise.vector(0.05))),
            velocity: In::new(narrow(then.velocity + noise.vector(0.05))),
        };
        let north = moment.attitude.inverse_transform_vector(&Vector3::new(0.5, 0.0, 0.8))
            + noise.vector(0.02);
        let altitude = -moment.position.z + 0.1 * noise.normal();
        let sensed = Sensed {
            dt_s: dt as f32,
            imu,
            gnss: k.is_multiple_of(30).then_some(fix),
            altitude_m: k.is_multiple_of(6).then_some(altitude as f32),
            magnetic: k.is_multiple_of(6).then(|| In::new(narrow(north))),
        };
        filter.step(&sensed);
        look(now, &moment, &filter.estimate());
    }
}

/// Angle between the believed and the true down, deg.
fn inclination_error_deg(moment: &Moment, estimate: &Estimate) -> f64 {
    let believed = down(&estimate.ned_from_body.quaternion).map(f64::from);
    let truth = moment.attitude.inverse_transform_vector(&Vector3::z());
    believed.cross(&truth).norm().atan2(believed.dot(&truth)).to_degrees()
}

/// RMS of the inclination's error after five seconds, deg.
fn inclination_rms_deg(flight: &Flight, wrong: Wrong, mut filter: impl Estimator) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    fly(flight, wrong, 40, &mut filter, |now, moment, estimate| {
        if now > 5.0 {
            sum += inclination_error_deg(moment, estimate).powi(2);
            count += 1.0;
        }
    });
    (sum / count).sqrt()
}

fn start(flight: &Flight) -> Rotation<Ned, Body, f32> {
    Rotation::new(UnitQuaternion::new_unchecked(flight.at(0.0).attitude.into_inner().cast::<f32>()))
}

fn rkf(flight: &Flight, fading: Fading) -> Rkf {
    Rkf::new(RkfParameters { fading, ..RkfParameters::default() }, start(flight), In::zero())
}

fn eskf(flight: &Flight, parameters: EskfParameters) -> Eskf {
    Eskf::new(parameters, start(flight), In::zero())
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let all: Vec<f64> = values.collect();
    all.iter().sum::<f64>() / all.len() as f64
}

/// The paper's claim: with a calibrated gyro, accelerations of a flight do not mislead the filter
/// with multiple factors, and they do mislead the plain one.
#[test]
fn multiple_factors_bear_accelerations_where_the_gyro_is_calibrated() {
    let rms = |fading| {
        mean((0..10).map(|seed| {
            let flight = Flight::agile(seed);
            inclination_rms_deg(&flight, Wrong::nothing(seed), rkf(&flight, fading))
        }))
    };
    let (plain, single, multiple) = (rms(Fading::None), rms(Fading::Single), rms(Fading::Multiple));
    assert!(multiple < 1.2 && single < 2.0, "single {single:.2}, multiple {multiple:.2} deg");
    assert!(plain > 4.0, "plain {plain:.2} deg");
}

#[test]
fn a_gyro_that_nobody_calibrated_drags_the_factors_off_and_rest_cures_it() {
    let flight = Flight::agile(3);
    let wrong = Wrong::uncalibrated(3);
    let dragged = inclination_rms_deg(&flight, wrong, rkf(&flight, Fading::Multiple));

    let (mut rest, mut noise, mut bias) =
        (RestCalibration::new(RestParameters::default()), Noise(9), None);
    for _ in 0..3 * RATE_HZ {
        let omega = wrong.gyro_bias + noise.vector(0.0045);
        let force = Vector3::new(0.0, 0.0, -GRAVITY_M_S2) + noise.vector(0.25);
        bias = rest.hear(&Imu {
            omega: In::new(omega.map(|x| x as f32)),
            specific_force: In::new(force.map(|x| x as f32)),
        });
    }
    let bias = bias.unwrap();
    assert!((bias.vector.map(f64::from) - wrong.gyro_bias).amax() < 0.001, "{:?}", bias.vector);
    let cured = Rkf::new(RkfParameters::default(), start(&flight), bias);
    let cured = inclination_rms_deg(&flight, wrong, cured);
    assert!(cured < 1.2 && dragged > 2.5 * cured, "cured {cured:.2}, dragged {dragged:.2} deg");
}

#[test]
fn what_moves_is_not_rest() {
    let mut rest = RestCalibration::new(RestParameters::default());
    let imu = |rate: f32, weight: f32| Imu {
        omega: In::new(Vector3::new(rate, 0.0, 0.0)),
        specific_force: In::new(Vector3::new(0.0, 0.0, -weight)),
    };
    assert!((0..1000).all(|_| rest.hear(&imu(0.2, 9.8)).is_none()), "turns");
    assert!((0..1000).all(|_| rest.hear(&imu(0.01, 14.0)).is_none()), "accelerates");
    assert!((0..250).all(|_| rest.hear(&imu(0.01, 9.8)).is_none()), "too short");
    assert!(rest.hear(&imu(0.01, 14.0)).is_none(), "and starts anew");
    assert!((0..299).all(|_| rest.hear(&imu(0.01, 9.8)).is_none()));
    assert!((rest.hear(&imu(0.01, 9.8)).unwrap().vector.x - 0.01).abs() < 1e-6);
}

#[test]
fn a_gated_complementary_filter_finds_the_bias_in_hover() {
    let flight = Flight::hover();
    let filter = Mahony::new(MahonyParameters::default(), start(&flight), In::zero());
    let rms = inclination_rms_deg(&flight, Wrong::uncalibrated(1), filter);
    assert!(rms < 1.0, "{rms:.2} deg");
}

#[test]
fn a_filter_that_knows_the_acceleration_beats_one_that_does_not() {
    let of = |seed| {
        let flight = Flight::agile(seed);
        let wrong = Wrong::uncalibrated(seed);
        let mekf = Mekf::new(MekfParameters::default(), start(&flight), In::zero());
        let mahony = Mahony::new(MahonyParameters::default(), start(&flight), In::zero());
        (inclination_rms_deg(&flight, wrong, mekf), inclination_rms_deg(&flight, wrong, mahony))
    };
    let all: Vec<_> = (0..10).map(of).collect();
    let (mekf, mahony) = (mean(all.iter().map(|x| x.0)), mean(all.iter().map(|x| x.1)));
    assert!(mekf < 2.0 && mekf < mahony, "mekf {mekf:.2}, mahony {mahony:.2} deg");
}

#[test]
fn the_default_needs_no_calibration() {
    for latency_s in [0.0, 0.15] {
        let rms = mean((0..10).map(|seed| {
            let flight = Flight::agile(seed);
            let parameters =
                EskfParameters { gnss_latency_s: latency_s as f32, ..EskfParameters::default() };
            inclination_rms_deg(
                &flight,
                Wrong { latency_s, ..Wrong::uncalibrated(seed) },
                eskf(&flight, parameters),
            )
        }));
        assert!(rms < 1.0, "{rms:.2} deg at {latency_s} s");
    }
}

/// Position, velocity and bias are found, and latency that is not corrected shows as an error of
/// position.
#[test]
fn late_fixes_are_compared_with_where_the_filter_was() {
    let flight = Flight::agile(4);
    let wrong = Wrong { latency_s: 0.15, ..Wrong::uncalibrated(4) };
    let error = |assumed_s: f32| {
        let parameters = EskfParameters { gnss_latency_s: assumed_s, ..EskfParameters::default() };
        let mut filter = eskf(&flight, parameters);
        let (mut sum, mut count) = (0.0, 0.0);
        fly(&flight, wrong, 40, &mut filter, |now, moment, estimate| {
            if now > 10.0 {
                let (position, _) = estimate.motion.unwrap();
                sum += (position.vector.map(f64::from) - moment.position).norm_squared();
                count += 1.0;
            }
        });
        let off = filter.estimate().gyro_bias.vector.map(f64::from) - wrong.gyro_bias;
        (f64::sqrt(sum / count), off.norm())
    };
    let ((corrected, bias_off), (uncorrected, _)) = (error(0.15), error(0.0));
    assert!(
        corrected < 0.15 && uncorrected > 4.0 * corrected,
        "{corrected:.3} and {uncorrected:.3} m"
    );
    assert!(bias_off < 0.002, "bias off by {bias_off} rad/s");
}

/// Normalised estimation error squared of position, velocity and turn over 50 seeds, against
/// chi-squared of 9 numbers.
#[test]
fn the_default_errs_as_much_as_it_says() {
    let runs = 50;
    let mut sum = 0.0;
    for seed in 0..runs {
        let flight = Flight::agile(seed);
        let mut filter = eskf(&flight, EskfParameters::default());
        fly(&flight, Wrong::uncalibrated(seed), 20, &mut filter, |_, _, _| {});
        let (moment, estimate) = (flight.at(20.0), filter.estimate());
        let (position, velocity) = estimate.motion.unwrap();
        let mut error = nalgebra::SVector::<f64, 9>::zeros();
        error.fixed_rows_mut::<3>(0).copy_from(&(moment.position - position.vector.map(f64::from)));
        error.fixed_rows_mut::<3>(3).copy_from(&(moment.velocity - velocity.vector.map(f64::from)));
        let believed = UnitQuaternion::new_normalize(
            estimate.ned_from_body.quaternion.into_inner().cast::<f64>(),
        );
        error
            .fixed_rows_mut::<3>(6)
            .copy_from(&(believed.inverse() * moment.attitude).scaled_axis());
        let covariance = filter.covariance().fixed_view::<9, 9>(0, 0).map(f64::from);
        sum += error.dot(&(covariance.try_inverse().unwrap() * error));
    }
    // 95 % of chi-squared of 450 numbers, over 50: 450 +- 1.96 sqrt(900).
    let nees = sum / runs as f64;
    assert!((7.82..10.18).contains(&nees), "{nees:.2}");
}

/// Normalised innovation squared of a fix and an altitude over 50 seeds, against chi-squared of 7
/// numbers.
#[test]
fn innovations_of_the_default_are_as_large_as_it_says() {
    struct Deaf(Eskf);
    impl Estimator for Deaf {
        fn step(&mut self, sensed: &Sensed) {
            // A compass counts for less than it says, because its errors stay.
            self.0.step(&Sensed { magnetic: None, ..*sensed });
        }
        fn estimate(&self) -> Estimate {
            self.0.estimate()
        }
    }
    let runs = 50;
    let mut sum = 0.0;
    for seed in 0..runs {
        let flight = Flight::agile(seed);
        let mut filter = Deaf(eskf(&flight, EskfParameters::default()));
        fly(&flight, Wrong::uncalibrated(seed), 20, &mut filter, |_, _, _| {});
        let (squares, numbers) = filter.0.nis();
        assert_eq!(numbers, 7);
        sum += f64::from(squares);
    }
    let nis = sum / runs as f64;
    // 95 % of chi-squared of 350 numbers, over 50: 350 +- 1.96 sqrt(700).
    assert!((5.96..8.04).contains(&nis), "{nis:.2}");
}

/// One fix in twenty is a hundred metres off.
#[test]
fn outliers_cost_nothing() {
    struct Liar(Eskf, u32);
    impl Estimator for Liar {
        fn step(&mut self, sensed: &Sensed) {
            let mut heard = *sensed;
            if let Some(gnss) = &mut heard.gnss {
                self.1 += 1;
                if self.1.is_multiple_of(20) {
                    gnss.position.vector.x += 100.0;
                }
            }
            self.0.step(&heard);
        }
        fn estimate(&self) -> Estimate {
            self.0.estimate()
        }
    }
    let flight = Flight::agile(5);
    let mut liar = Liar(eskf(&flight, EskfParameters::default()), 0);
    let mut worst: f64 = 0.0;
    fly(&flight, Wrong::uncalibrated(5), 40, &mut liar, |now, moment, estimate| {
        if now > 10.0 {
            let (position, _) = estimate.motion.unwrap();
            worst = worst.max((position.vector.map(f64::from) - moment.position).norm());
        }
    });
    assert!(worst < 0.3, "{worst:.2} m");
    assert_eq!(liar.0.rejections(), 20, "of 400 fixes");
}

/// A barometer of 0.2 m and an accelerometer that is 0.3 m/s^2 off, on a flight that climbs and
/// sinks; and the deviation that it states is that of its errors.
#[test]
fn height_and_climb_are_better_than_the_barometer() {
    let (flight, mut noise) = (Flight::agile(2), Noise(2));
    let mut filter = AltitudeFilter::new(
        AltitudeParameters { accel_noise_m_s2: 0.25, ..AltitudeParameters::default() },
        0.0,
    );
    let (mut height, mut climb, mut count) = (0.0, 0.0, 0.0);
    let dt = 1.0 / RATE_HZ as f64;
    for k in 1..=60 * RATE_HZ {
        let now = k as f64 * dt;
        let (middle, moment) = (flight.at(now - 0.5 * dt), flight.at(now));
        let force = middle.attitude.transform_vector(&(middle.force_body + noise.vector(0.25)));
        let altitude = (-moment.position.z + 0.2 * noise.normal()) as f32;
        let acceleration = (force.z + GRAVITY_M_S2 + 0.3) as f32;
        filter.step(acceleration, k.is_multiple_of(6).then_some(altitude), dt as f32);
        if now > 20.0 {
            height += (f64::from(filter.altitude_m()) + moment.position.z).powi(2);
            climb += (f64::from(filter.climb_m_s()) + moment.velocity.z).powi(2);
            count += 1.0;
        }
    }
    let (height, climb) = (f64::sqrt(height / count), f64::sqrt(climb / count));
    assert!(height < 0.07 && climb < 0.1, "{height:.3} m, {climb:.3} m/s");
    let stated = f64::from(filter.altitude_deviation_m());
    assert!((0.7..1.4).contains(&(height / stated)), "{height:.3} m, stated {stated:.3} m");
}

/// The field's numbers are big and small, steps long and short: nothing is ever not a number.
#[test]
fn estimates_stay_numbers() {
    let mut noise = Noise(11);
    let start = Rotation::identity();
    let mut filters: [&mut dyn Estimator; 4] = [
        &mut Rkf::new(RkfParameters::default(), start, In::zero()),
        &mut Mahony::new(MahonyParameters::default(), start, In::zero()),
        &mut Mekf::new(MekfParameters::default(), start, In::zero()),
        &mut Eskf::new(EskfParameters::default(), start, In::zero()),
    ];
    for k in 0..100_000 {
        let mut size = || 10.0_f64.powf(12.0 * noise.uniform() - 9.0);
        let [rate, force, place, speed] = [size(), size(), size(), size()];
        let some = |v: Vector3<f64>| v.map(|x| x as f32);
        let sensed = Sensed {
            dt_s: if k % 7 == 0 { 0.0 } else { (0.01 * noise.uniform()) as f32 },
            imu: Imu {
                omega: In::new(some(noise.vector(rate))),
                specific_force: In::new(some(noise.vector(force))),
            },
            gnss: (k % 11 == 0).then(|| Gnss {
                position: In::new(some(noise.vector(place))),
                velocity: In::new(some(noise.vector(speed))),
            }),
            altitude_m: (k % 5 == 0).then(|| (place * noise.normal()) as f32),
            magnetic: (k % 3 == 0).then(|| In::new(some(noise.vector(speed)))),
        };
        for (which, filter) in filters.iter_mut().enumerate() {
            filter.step(&sensed);
            let estimate = filter.estimate();
            let q = estimate.ned_from_body.quaternion;
            assert!((q.into_inner().norm() - 1.0).abs() < 1e-3, "filter {which}, step {k}");
            assert!(
                estimate.gyro_bias.vector.iter().all(|x| x.is_finite()),
                "filter {which}, step {k}"
            );
            let motion = estimate.motion.unwrap_or_default();
            assert!(
                motion.0.vector.iter().chain(motion.1.vector.iter()).all(|x| x.is_finite()),
                "step {k}"
            );
        }
    }
}
