//! The gap on flights that the fit never saw: the plant re-simulated in open loop under the logged
//! commands.
//!
//! Every half second the plant is put where the vehicle was measured to be and flown for a second,
//! and every fourth time for two, under the logged commands at the measured voltage. What the
//! sensors should then have read, under the hypothesis, is compared with what they read, in bins of
//! 0.1 s: velocity, attitude, angular rate and specific force, three channels each.
//!
//! ```text
//! J = mean over channels of MSE(model) / MSE(floor), over the first second      1: nothing but noise
//! removed = 1 - (J_after - 1) / (J_before - 1)
//! ```
//! The floor is the best model against itself, started and read with the noise of these sensors in
//! turbulent air of the declared tolerance. One flight's noise is not the mean flight's: where the
//! best model is inside two standard deviations of what noise leaves from flight to flight, the
//! floor of these flights is taken to be where it is. All models share the numbers that float
//! inside their tolerances, so that the gap is that of the effect. Where moments are left out of
//! what is explained, the attitude is the measured one and only velocity and specific force are
//! compared; what a log without an IMU does not measure is not compared either.

mod errors;
mod segments;

pub(crate) use errors::{BINS, CHANNELS, Errors12, Floor};
pub(crate) use segments::BIN_S;

use crate::GapError;
use crate::predictor::{Hypothesis, Predictor};
use errors::{COUNTED, Errors, squares};
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use segments::{Bin, Noise, Segments, compared};

/// Flights of noise that the floor is the mean of, each of every other segment: half of what one
/// says its neighbours say, too.
const DRAWS: usize = 3;

/// A hypothesis on flights, flown without noise: its errors and its floor are both told from that.
pub(crate) struct Flown<'a> {
    pieces: Vec<(Segments<'a>, Vec<Bin>)>,
}

impl<'a> Flown<'a> {
    /// Flies the pieces that have attitude and velocity.
    ///
    /// # Errors
    /// A hypothesis that the plant cannot be stepped with.
    pub(crate) fn new(
        predictor: &'a Predictor<'a>,
        hypothesis: &'a Hypothesis,
    ) -> Result<Self, GapError> {
        let mut pieces = Vec::new();
        for (piece, track) in predictor.tracks.iter().enumerate() {
            if track.attitude().is_none() || track.velocity().is_empty() {
                continue;
            }
            let segments = Segments::new(predictor, hypothesis, piece)?;
            let mut bins = Vec::new();
            segments.fly(0..segments.starts.len(), None, |bin| bins.push(bin));
            pieces.push((segments, bins));
        }
        Ok(Self { pieces })
    }

    /// Errors of the hypothesis; `None` where no flight has attitude and velocity.
    pub(crate) fn errors(&self) -> Option<Errors12> {
        let mut all = Errors12::new();
        for (segments, bins) in &self.pieces {
            for bin in bins {
                segments.compare(bin, &mut all);
            }
        }
        (all.count[0] > 0.0).then_some(all)
    }

    /// Errors that the hypothesis would have if it were true: started, read and blown about with
    /// noise.
    pub(crate) fn floor(&self, turbulence_m_s: f64) -> Floor {
        let mut all = Errors12::new();
        // Mean errors of each segment over the first second.
        let mut segments: Vec<Errors> = Vec::new();
        for (own, clean) in &self.pieces {
            let (predictor, piece, track) = (own.predictor, own.piece as u64, own.track());
            let [force_noise, rate_noise] = track.imu_noise;
            let velocity_noise = track.velocity_noise();
            let attitude_noise = track.attitude_noise();
            let white = (BIN_S / track.period_s).max(1.0).sqrt();
            for draw in 0..DRAWS {
                let which = (draw % 2..own.starts.len()).step_by(2);
                let mut rng = Pcg64Mcg::seed_from_u64(1000 * draw as u64 + piece + 11);
                let mut noise = Pcg64Mcg::seed_from_u64(1000 * draw as u64 + piece + 29);
                let mut draw = || -> Vector3<f64> {
                    Vector3::from_fn(|_, _| StandardNormal.sample(&mut noise))
                };
                let noise = Noise {
                    starts: starts(which.len(), &mut rng).into_iter(),
                    turbulence_m_s,
                    velocity_m_s: velocity_noise * track.velocity_smoothing(),
                    attitude_rad: attitude_noise,
                    rng: &mut rng,
                };
                let mut still = clean.iter();
                own.fly(which, Some(noise), |blown| {
                    let Some(still) = still.find(|still| still.place() == blown.place()) else {
                        return;
                    };
                    let (own, other) = (&still.read, &blown.read);
                    let velocity = other.velocity_ned - own.velocity_ned
                        + draw().component_mul(&velocity_noise);
                    let rotation = (own.attitude.inverse() * other.attitude).scaled_axis()
                        + draw().component_mul(&attitude_noise);
                    let rate = other.omega - own.omega + draw().component_mul(&rate_noise) / white;
                    let force = other.specific_force - own.specific_force
                        + draw().component_mul(&force_noise) / white;
                    let parts = compared(predictor, [velocity, rotation, rate, force]);
                    if blown.number == 0 {
                        segments.push(Errors::zeros());
                    }
                    if let Some(segment) = segments.last_mut().filter(|_| blown.number < COUNTED) {
                        *segment += squares(&parts) / COUNTED as f64;
                    }
                    all.add(blown.number, parts);
                });
            }
        }
        let n = segments.len().max(1) as f64;
        let mean = segments.iter().sum::<Errors>() / n;
        let square: Errors =
            segments.iter().map(|s| (s - mean).component_mul(&(s - mean))).sum::<Errors>() / n;
        // Segments overlap by half: each counts for half in the mean of one flight.
        let flown: usize = self.pieces.iter().map(|(own, _)| own.starts.len()).sum();
        let deviation = (square * (2.0 / flown.max(1) as f64)).map(f64::sqrt);
        Floor { mean: all, deviation }
    }
}

/// What so many segments start with. Each number has the mean square of as many as one likes, so
/// that the mean error of a few is that of many.
fn starts(count: usize, rng: &mut Pcg64Mcg) -> Vec<[Vector3<f64>; 4]> {
    let mut all: Vec<[Vector3<f64>; 4]> = (0..count)
        .map(|_| [(); 4].map(|()| Vector3::from_fn(|_, _| StandardNormal.sample(rng))))
        .collect();
    for part in 0..4 {
        let square: Vector3<f64> = all.iter().map(|start| start[part].map(|x| x * x)).sum();
        let deviation = (square / count.max(1) as f64).map(f64::sqrt);
        for start in &mut all {
            start[part].component_div_assign(&deviation);
        }
    }
    all
}
