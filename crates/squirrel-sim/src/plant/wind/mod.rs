//! Moving air: a steady part and gusts.
//!
//! Gusts are a Gauss-Markov process per axis (`u' = -u / tau + noise`, discretised exactly), or the
//! Dryden spectra with their scale length: longitudinal first order, lateral and vertical second
//! order (MIL-F-8785C form), with the longitudinal axis along north. Both have the stated standard
//! deviation whatever the step. Or they are all of MIL-F-8785C near the ground ([`mil`]): by height,
//! along the flight, with a rotation of the air.

mod dryden;
mod mil;

pub use mil::Meeting;

use crate::tape::Tape;
use mil::{Mil, SLOWEST_M_S};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use squirrel_core::effects::{Effects, GUST_SCALE_LENGTH_M, GUST_TIME_CONSTANT_S, GustSpectrum};
use squirrel_core::frames::{In, Ned};
use squirrel_core::lane::functions::exp;
use squirrel_core::nalgebra::Vector3;
use squirrel_core::vehicle::Vehicle;

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
    /// The low-altitude model of MIL-F-8785C, whose lengths and standard deviations depend on the
    /// height.
    Mil {
        /// Wind at 6 m (20 ft), which says how strong the turbulence is, m/s.
        wind_6m_m_s: f64,
    },
}

/// Numbers of the moving air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WindParameters {
    /// Steady wind, m/s.
    pub mean_ned_m_s: [f64; 3],
    /// Standard deviation of the gusts per axis, m/s; not looked at where the model has its own.
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
    /// Where the gusts are those of MIL-F-8785C and there are any.
    mil: Option<Box<Mil>>,
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
    ///
    /// * `span_m` - over which air that turns is felt; for gusts after MIL-F-8785C
    pub fn new(parameters: WindParameters, span_m: f64, seed: u64) -> Self {
        let mut wind = Self {
            parameters,
            rng: Pcg64Mcg::seed_from_u64(seed),
            first: Vector3::zeros(),
            second: Vector3::zeros(),
            decays: [Decay::new(0.0, 1.0); 2],
            mil: None,
        };
        match parameters.gust {
            GustModel::GaussMarkov { .. } => wind.first = wind.noise(),
            // The second-order axes forget their start within a few of these steps.
            GustModel::Dryden { scale_length_m } if parameters.gust_sigma_m_s > 0.0 => {
                for _ in 0..400 {
                    wind.move_dryden(0.02 * scale_length_m, 1.0, scale_length_m);
                }
            }
            GustModel::Mil { wind_6m_m_s } if wind_6m_m_s > 0.0 => {
                let (mean, rng) = (Vector3::from(parameters.mean_ned_m_s), &mut wind.rng);
                let normal = || StandardNormal.sample(rng);
                wind.mil = Some(Box::new(Mil::new(wind_6m_m_s, mean, span_m, normal)));
            }
            GustModel::Dryden { .. } | GustModel::Mil { .. } => {}
        }
        wind
    }

    /// All winds of a flight: the steady one with its gusts, and those of the `gust` effect. Each
    /// has a stream of its own, which the flight's seed starts.
    pub fn of_flight(
        wind: WindParameters,
        vehicle: &Vehicle<f64>,
        effects: &Effects<f64>,
        seed: u64,
    ) -> Vec<Self> {
        const STEADY: u64 = 0x5851_F42D_4C95_7F2D;
        const GUST_EFFECT: u64 = 0x9E6C_63D0_876A_3F1B;
        let span_m = span_m(vehicle);
        let gusts = effects
            .gust()
            .map(|gusts| Self::new(WindParameters::of_gusts(gusts), span_m, seed ^ GUST_EFFECT));
        [Self::new(wind, span_m, seed ^ STEADY)].into_iter().chain(gusts).collect()
    }

    /// Velocity of the air now, m/s.
    pub fn velocity(&self) -> In<Ned, f64> {
        let mean = Vector3::from(self.parameters.mean_ned_m_s);
        if let Some(mil) = &self.mil {
            return In::new(mean + mil.velocity());
        }
        let gust = match self.parameters.gust {
            GustModel::GaussMarkov { .. } | GustModel::Mil { .. } => self.first,
            GustModel::Dryden { .. } => {
                let shaped = dryden::across(&self.first, &self.second);
                Vector3::new(dryden::along(self.first.x), shaped.y, shaped.z)
            }
        };
        In::new(mean + gust * self.parameters.gust_sigma_m_s)
    }

    /// Angular velocity of the air now, rad/s, where it turns.
    pub fn angular_velocity(&self) -> Option<In<Ned, f64>> {
        self.mil.as_ref().map(|mil| In::new(mil.angular_velocity()))
    }

    /// Whether gusts depend on how a vehicle meets them.
    pub fn asks_the_vehicle(&self) -> bool {
        self.mil.is_some()
            || self.parameters.gust_sigma_m_s != 0.0
                && matches!(self.parameters.gust, GustModel::Dryden { .. })
    }

    /// Moves the air on by `dt_s`.
    ///
    /// * `meeting` - with the vehicle, which meets Dryden fields at its airspeed, not below 1 m/s;
    ///   not asked for other gusts
    pub fn advance(&mut self, dt_s: f64, meeting: impl FnOnce() -> Meeting) {
        if let Some(mil) = &mut self.mil {
            let rng = &mut self.rng;
            return mil.advance(dt_s, &meeting(), || StandardNormal.sample(rng));
        }
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
                let airspeed_m_s = meeting().through_air.vector.norm();
                self.move_dryden(dt_s, airspeed_m_s, scale_length_m);
            }
            GustModel::Mil { .. } => {}
        }
    }

    fn move_dryden(&mut self, dt_s: f64, airspeed_m_s: f64, scale_length_m: f64) {
        let keep = exp(-dt_s * airspeed_m_s.max(SLOWEST_M_S) / scale_length_m);
        let noise = self.noise();
        for (axis, noise) in noise.iter().enumerate() {
            dryden::advance([&mut self.first[axis], &mut self.second[axis]], keep, *noise);
        }
    }

    /// Any, to be read from a tape.
    pub fn blank() -> Self {
        Self::new(WindParameters::calm(), 1.0, 0)
    }

    /// All that it is, but for what it has computed before and would again.
    pub fn keep(&mut self, tape: &mut Tape<'_>) -> Option<()> {
        let p = &mut self.parameters;
        tape.doubles(&mut p.mean_ned_m_s)?;
        tape.double(&mut p.gust_sigma_m_s)?;
        let (kind, mut number) = match p.gust {
            GustModel::GaussMarkov { time_constant_s } => (0, time_constant_s),
            GustModel::Dryden { scale_length_m } => (1, scale_length_m),
            GustModel::Mil { wind_6m_m_s } => (2, wind_6m_m_s),
        };
        let kind = tape.count(kind)?;
        tape.double(&mut number)?;
        p.gust = match kind {
            0 => GustModel::GaussMarkov { time_constant_s: number },
            1 => GustModel::Dryden { scale_length_m: number },
            2 => GustModel::Mil { wind_6m_m_s: number },
            _ => return None,
        };
        let mut stream = self.rng.state();
        tape.long(&mut stream)?;
        self.rng = Pcg64Mcg::new(stream);
        tape.doubles(self.first.iter_mut().chain(self.second.iter_mut()))?;
        let mut turns = self.mil.is_some();
        tape.flag(&mut turns)?;
        if tape.is_read() {
            self.decays = [Decay::new(0.0, 1.0); 2];
            let blank = || Box::new(Mil::new(1.0, Vector3::zeros(), 1.0, || 0.0));
            self.mil = turns.then(blank);
        }
        self.mil.as_mut().map_or(Some(()), |mil| mil.keep(tape))
    }

    fn noise(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| StandardNormal.sample(&mut self.rng))
    }
}

/// Width of what the air gets hold of: the wings, from tip to tip, or what the rotors stand apart.
fn span_m(vehicle: &Vehicle<f64>) -> f64 {
    /// Of what is narrower, air is asked no finer.
    const LEAST_M: f64 = 0.05;
    let rotors = vehicle.rotors().iter().map(|rotor| 2.0 * rotor.position.vector.y.abs());
    // The middle of each side is half of its way from the middle to the tip.
    let wings = vehicle.parameters().wing.map(|wing| 4.0 * wing.lateral_arm_m);
    rotors.chain(wings).fold(LEAST_M, f64::max)
}

#[cfg(test)]
mod tests;
