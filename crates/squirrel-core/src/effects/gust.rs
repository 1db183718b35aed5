//! Gusts: the air also moves at random, with the standard deviation `sigma` along each axis.
//!
//! Form `gauss_markov`: correlation time 1.5 s. Form `dryden`: Dryden spectra (MIL-F-8785C) with a
//! scale length of 6 m, which are that long at 4 m/s. The random process itself is the simulator's;
//! a model cannot predict it.

use super::{Effect, EffectParameter, Fitted, Response, Shown, Words, is};
use crate::math::Real;

/// Correlation time of Gauss-Markov gusts, s.
pub const GUST_TIME_CONSTANT_S: f64 = 1.5;
/// Scale length of Dryden gusts, m.
pub const GUST_SCALE_LENGTH_M: f64 = 6.0;
const DRYDEN: usize = 1;

/// What kind of gusts, and their standard deviation per axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum GustSpectrum<T> {
    /// First order, with [`GUST_TIME_CONSTANT_S`].
    GaussMarkov {
        /// Standard deviation per axis, m/s.
        sigma_m_s: T,
    },
    /// Dryden, with [`GUST_SCALE_LENGTH_M`].
    Dryden {
        /// Standard deviation per axis, m/s.
        sigma_m_s: T,
    },
}

/// Size of the gusts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gust<T>(pub(super) [T; 2]);

impl<T: Real> Effect<T> for Gust<T> {
    const NAME: &'static str = "gust";
    const ACTS_BETWEEN_STEPS: bool = true;
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::size("sigma_m_s", 0.8, 2.5),
        EffectParameter::form(&["gauss_markov", "dryden"]),
    ];
    const WORDS: Words = Words {
        what: "gusts",
        more: "Gusts",
        less: "Gusts",
        fly: "the same flight again on another day",
    };
    const SHOWN: Shown = Shown::NOTHING;
    const RESPONSE: Response = Response::Random;
    const FITTED: Fitted = Fitted::Never;

    fn gust(&self) -> Option<GustSpectrum<T>> {
        let [sigma_m_s, form] = self.0;
        Some(if is(form, DRYDEN) {
            GustSpectrum::Dryden { sigma_m_s }
        } else {
            GustSpectrum::GaussMarkov { sigma_m_s }
        })
    }
}
