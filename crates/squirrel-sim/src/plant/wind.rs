//! Moving air: a steady part and gusts.
//!
//! Gusts are a Gauss-Markov process per axis (`u' = -u / tau + noise`, discretised exactly), or the
//! Dryden spectra with their scale length: longitudinal first order, lateral and vertical second
//! order (MIL-F-8785C form), with the longitudinal axis along north. Both have the stated standard
//! deviation whatever the step.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use squirrel_core::effects::{Effects, GUST_SCALE_LENGTH_M, GUST_TIME_CONSTANT_S, GustSpectrum};
use squirrel_core::frames::{In, Ned};
use squirrel_core::lane::functions::exp;
use squirrel_core::nalgebra::Vector3;

/// Shape of the gusts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum GustModel {
    /// Gauss-Markov with a correlation time, s.
    GaussMarkov {
        /// Correlation time, s.
        time_constant_s: f64,
    },
    /// Dryden with a scale length, m.
    Dryden {
        /// Scale length, m.
        scale_length_m: f64,
    },
}

/// Numbers of the moving air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WindParameters {
    /// Steady wind, m/s.
    pub mean_ned_m_s: [f64; 3],
    /// Standard deviation of the gusts per axis, m/s.
    pub gust_sigma_m_s: f64,
    /// Shape of the gusts.
    pub gust: GustModel,
}

impl WindParameters {
    /// Air that does not move.
    pub fn calm() -> Self {
        let gust = GustModel::GaussMarkov { time_constant_s: GUST_TIME_CONSTANT_S };
        Self { mean_ned_m_s: [0.0; 3], gust_sigma_m_s: 0.0, gust }
    }

    /// Gusts of an effect alone.
    pub fn of_gusts(spectrum: GustSpectrum<f64>) -> Self {
        let (gust_sigma_m_s, gust) = match spectrum {
            GustSpectrum::GaussMarkov { sigma_m_s } => {
                (sigma_m_s, GustModel::GaussMarkov { time_constant_s: GUST_TIME_CONSTANT_S })
            }
            GustSpectrum::Dryden { sigma_m_s } => {
                (sigma_m_s, GustModel::Dryden { scale_length_m: GUST_SCALE_LENGTH_M })
            }
        };
        Self { mean_ned_m_s: [0.0; 3], gust_sigma_m_s, gust }
    }
}

/// The air at one place, moving in time.
#[derive(Debug, Clone)]
pub struct Wind {
    parameters: WindParameters,
    rng: Pcg64Mcg,
    first: Vector3<f64>,
    second: Vector3<f64>,
    /// Of the last two lengths of steps: a clock whose ticks are cut to whole numbers has two.
    decays: [Decay; 2],
}

/// What a step does to Gauss-Markov gusts.
#[derive(Debug, Clone, Copy)]
struct Decay {
    dt_s: f64,
    /// Part that stays.
    keep: f64,
    /// Standard deviation of what comes.
    fresh: f64,
}

impl Decay {
    fn new(dt_s: f64, time_constant_s: f64) -> Self {
        let keep = (-dt_s / time_constant_s).exp();
        Self { dt_s, keep, fresh: (1.0 - keep * keep).sqrt() }
    }
}

impl Wind {
    /// Gusts start in their stationary distribution.
    pub fn new(parameters: WindParameters, seed: u64) -> Self {
        let mut wind = Self {
            parameters,
            rng: Pcg64Mcg::seed_from_u64(seed),
            first: Vector3::zeros(),
            second: Vector3::zeros(),
            decays: [Decay::new(0.0, 1.0); 2],
        };
        match parameters.gust {
            GustModel::GaussMarkov { .. } => wind.first = wind.noise(),
            // The second-order axes forget their start within a few of these steps.
            GustModel::Dryden { scale_length_m } if parameters.gust_sigma_m_s > 0.0 => {
                for _ in 0..400 {
                    wind.advance(0.02 * scale_length_m, || 1.0);
                }
            }
            GustModel::Dryden { .. } => {}
        }
        wind
    }

    /// All winds of a flight: the steady one with its gusts, and those of the `gust` effect. Each
    /// has a stream of its own, which the flight's seed starts.
    pub fn of_flight(wind: WindParameters, effects: &Effects<f64>, seed: u64) -> Vec<Self> {
        const STEADY: u64 = 0x5851_F42D_4C95_7F2D;
        const GUST_EFFECT: u64 = 0x9E6C_63D0_876A_3F1B;
        let gusts = effects
            .gust()
            .map(|gusts| Self::new(WindParameters::of_gusts(gusts), seed ^ GUST_EFFECT));
        [Self::new(wind, seed ^ STEADY)].into_iter().chain(gusts).collect()
    }

    /// Velocity of the air now, m/s.
    pub fn velocity(&self) -> In<Ned, f64> {
        let mean = Vector3::from(self.parameters.mean_ned_m_s);
        let gust = match self.parameters.gust {
            GustModel::GaussMarkov { .. } => self.first,
            GustModel::Dryden { .. } => {
                let root3 = 3.0_f64.sqrt();
                let shaped = self.second * (1.0 - root3) + self.first * root3;
                Vector3::new(self.first.x * std::f64::consts::SQRT_2, shaped.y, shaped.z)
            }
        };
        In::new(mean + gust * self.parameters.gust_sigma_m_s)
    }

    /// Whether gusts come as fast as a vehicle meets them.
    pub(crate) fn asks_for_airspeed(&self) -> bool {
        self.parameters.gust_sigma_m_s != 0.0
            && matches!(self.parameters.gust, GustModel::Dryden { .. })
    }

    /// Moves the air on by `dt_s`.
    ///
    /// * `airspeed_m_s` - of the vehicle, which meets the Dryden field at that speed, not below 1
    ///   m/s; not asked for other gusts
    pub fn advance(&mut self, dt_s: f64, airspeed_m_s: impl FnOnce() -> f64) {
        if self.parameters.gust_sigma_m_s == 0.0 {
            return;
        }
        match self.parameters.gust {
            GustModel::GaussMarkov { time_constant_s } => {
                if self.decays[0].dt_s != dt_s {
                    self.decays.swap(0, 1);
                }
                if self.decays[0].dt_s != dt_s {
                    self.decays[0] = Decay::new(dt_s, time_constant_s);
                }
                let Decay { keep, fresh, .. } = self.decays[0];
                self.first = self.first * keep + self.noise() * fresh;
            }
            GustModel::Dryden { scale_length_m } => {
                let keep = exp(-dt_s * airspeed_m_s().max(1.0) / scale_length_m);
                // With unit noise the first stage has variance 1/2, so that the shaped output has
                // variance 1.
                let before = self.first;
                self.first = self.first * keep + self.noise() * ((1.0 - keep * keep) * 0.5).sqrt();
                self.second = self.second * keep + (before + self.first) * (0.5 * (1.0 - keep));
            }
        }
    }

    fn noise(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| StandardNormal.sample(&mut self.rng))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spread(gust: GustModel, dt_s: f64) -> [f64; 3] {
        let mut wind = Wind::new(
            WindParameters { mean_ned_m_s: [2.0, 0.0, 0.0], gust_sigma_m_s: 1.5, gust },
            1,
        );
        let n = 400_000;
        let mut square = Vector3::zeros();
        for _ in 0..n {
            wind.advance(dt_s, || 5.0);
            let gust = wind.velocity().vector - Vector3::new(2.0, 0.0, 0.0);
            square += gust.component_mul(&gust);
        }
        (square / f64::from(n)).map(f64::sqrt).into()
    }

    #[test]
    fn gusts_have_the_stated_size_whatever_the_step() {
        for dt_s in [0.003, 0.05] {
            for gust in [
                GustModel::GaussMarkov { time_constant_s: 0.5 },
                GustModel::Dryden { scale_length_m: 2.0 },
            ] {
                for sigma in spread(gust, dt_s) {
                    assert!((sigma / 1.5 - 1.0).abs() < 0.06, "{gust:?} at {dt_s} s: {sigma}");
                }
            }
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_air() {
        let parameters = WindParameters {
            mean_ned_m_s: [0.0; 3],
            gust_sigma_m_s: 1.0,
            gust: GustModel::GaussMarkov { time_constant_s: 1.5 },
        };
        let run = |seed| {
            let mut wind = Wind::new(parameters, seed);
            (0..100).for_each(|_| wind.advance(0.01, || 5.0));
            wind.velocity().vector
        };
        assert_eq!(run(7), run(7));
        assert_ne!(run(7), run(8));
    }
}
