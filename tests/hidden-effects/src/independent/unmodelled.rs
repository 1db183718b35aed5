//! What every model of a real vehicle leaves: coloured forces and moments without an equation.
//!
//! Each of the six channels is a random smooth function of velocity through the air, rates,
//! throttle and height, beside a first-order process:
//!
//! ```text
//! x_c = a_c [ sqrt(s) (g_c - mean g_c) / sd g_c + sqrt(1 - s) n_c ]      g_c = sum_k sin(w_k . features + phase_k)
//! a_c = share * sd of the measured channel                                n_c: variance 1
//! ```
//! Measured is what an inertial unit would say: mass times specific force, and inertia times the
//! rate of the rates. The sizes come from the case's first flight, flown without all this.

use super::extras::Extras;
use super::features::{self, FEATURES};
use super::physics::{Input, World};
use super::state::State;
use super::unknown::Motion;
use super::{Order, STEPS, simulate};
use crate::draw::{Draw, mix};
use serde::{Deserialize, Serialize};

/// How much of it there is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Misfit {
    /// Root mean square over the standard deviation of the measured force and moment, channel by
    /// channel.
    pub share: f64,
    /// Part of its mean square that is a function of motion and commands.
    pub smooth_share: f64,
    /// Correlation time of the rest, s.
    pub time_constant_s: f64,
    /// The function's numbers follow from it.
    pub seed: u64,
    /// Which channels have it.
    pub channels: [bool; 6],
}

/// Shares of the measured variation, within the tenth to quarter that models of real vehicles
/// leave, so that a flight may vary more or less than the first and still be inside.
const SHARE: [f64; 2] = [0.13, 0.21];
/// Size of an effect in its strongest channel, over what is unmodelled there: less is no finding.
const EFFECT_MIN: f64 = 0.5;
const SINES: usize = 3;
/// Length of the weights: the function bends within the usual range, and does not flutter.
const BEND: f64 = 1.2;

impl Misfit {
    pub(crate) fn draw(draw: &mut Draw) -> Self {
        Self {
            share: draw.uniform(SHARE[0], SHARE[1]),
            smooth_share: draw.uniform(0.4, 0.8),
            time_constant_s: draw.uniform(0.3, 1.5),
            seed: mix(draw.index(1 << 30) as u64, 0),
            channels: [true; 6],
        }
    }

    /// The same in one place alone: horizontal force, vertical force, or moments.
    pub(crate) fn apart(self, number: usize) -> Self {
        let places = [0..2, 2..3, 3..6];
        let place = &places[number % places.len()];
        Self { channels: std::array::from_fn(|channel| place.contains(&channel)), ..self }
    }
}

/// A sum of sines, then shifted and scaled.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Smooth {
    weights: [[f64; FEATURES]; SINES],
    phase: [f64; SINES],
    mean: f64,
    gain: f64,
}

impl Smooth {
    fn draw(draw: &mut Draw) -> Self {
        Self {
            weights: std::array::from_fn(|_| features::weights(BEND, draw)),
            phase: std::array::from_fn(|_| draw.angle()),
            mean: 0.0,
            gain: 1.0,
        }
    }
    fn at(&self, x: &[f64; FEATURES]) -> f64 {
        let sines = self
            .weights
            .iter()
            .zip(self.phase)
            .map(|(w, phase)| (features::dot(w, x) + phase).sin());
        (sines.sum::<f64>() - self.mean) * self.gain
    }
}

/// The unmodelled force, N, and moment, N m, of one vehicle.
#[derive(Debug, Clone, PartialEq)]
pub struct Unmodelled {
    smooth: [Smooth; 6],
    noise_sd: [f64; 6],
    time_constant_s: f64,
}

impl Unmodelled {
    pub(super) fn at(&self, motion: &Motion<'_>) -> [f64; 6] {
        self.of_features(&features::of(motion))
    }
    pub(super) fn of_features(&self, x: &[f64; FEATURES]) -> [f64; 6] {
        std::array::from_fn(|c| self.smooth[c].at(x))
    }
}

/// The processes of one flight.
#[derive(Debug)]
pub(super) struct Noise {
    unit: [f64; 6],
    draw: Draw,
}

impl Noise {
    pub(super) fn new(mut draw: Draw) -> Self {
        Self { unit: std::array::from_fn(|_| draw.normal(1.0)), draw }
    }
    pub(super) fn step(&mut self, dt_s: f64, of: &Unmodelled) -> [f64; 6] {
        let keep = (-dt_s / of.time_constant_s).exp();
        let fresh = (1.0 - keep * keep).sqrt();
        self.unit.iter_mut().for_each(|x| *x = *x * keep + self.draw.normal(fresh));
        std::array::from_fn(|c| of.noise_sd[c] * self.unit[c])
    }
}

/// Mean and mean square of six channels.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Sums {
    sum: [f64; 6],
    squared: [f64; 6],
    n: f64,
}

impl Sums {
    fn add(&mut self, x: [f64; 6]) {
        self.n += 1.0;
        for (c, x) in x.into_iter().enumerate() {
            self.sum[c] += x;
            self.squared[c] += x * x;
        }
    }
    fn mean(&self, c: usize) -> f64 {
        self.sum[c] / self.n
    }
    pub(super) fn rms(&self, c: usize) -> f64 {
        (self.squared[c] / self.n).sqrt()
    }
    pub(super) fn sd(&self, c: usize) -> f64 {
        (self.squared[c] / self.n - self.mean(c).powi(2)).max(0.0).sqrt()
    }
}

/// A flight as it is watched: what is measured, what the hidden effects make of it, and what is
/// unmodelled.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Watched {
    pub(super) measured: Sums,
    pub(super) effects: Sums,
    pub(super) unmodelled: Sums,
    smooth: Sums,
}

/// Force and moment as an inertial unit sees them.
fn measured(
    world: &World,
    nominal: &crate::airframe::Airframe,
    state: &State,
    input: &Input,
) -> [f64; 6] {
    let rates = world.rates(state, input, 0.0);
    let force = nominal.mass_kg * rates.specific_force;
    let inertia = nominal.inertia_kg_m2;
    let moment = inertia.component_mul(&rates.state.omega)
        + state.omega.cross(&inertia.component_mul(&state.omega));
    [force.x, force.y, force.z, moment.x, moment.y, moment.z]
}

/// Flies an order and watches it.
///
/// * `shape` - functions that are evaluated on the way
fn watched_with(order: &Order<'_>, shape: Option<&[Smooth; 6]>) -> Result<Watched, String> {
    let world = World {
        airframe: order.real.clone(),
        extras: Extras::new(order.effects),
        outside: order.outside,
        unmodelled: order.unmodelled.cloned(),
    };
    // The same vehicle without what is hidden, whose rotors and wings follow the same commands
    // along the same way.
    let plain = World { extras: Extras::new(&[]), ..world.clone() };
    let (mut watched, mut shadow) = (Watched::default(), None::<State>);
    let dt_s = 1.0 / (super::IMU_HZ * STEPS as f64);
    simulate(
        order,
        &world,
        |salt| Draw::new(mix(order.seed, salt)),
        |state, input, sent| {
            let own = Input { rotor: sent.rotor, wing: sent.wing, ..*input };
            let before = shadow.unwrap_or(*state);
            let after = before.heun(dt_s, |s, ahead| plain.rates(s, &own, ahead).state);
            let along = State { rotors: after.rotors, deployment: after.deployment, ..*state };
            shadow = Some(along);
            let is = measured(&world, order.nominal, state, input);
            let would_be = measured(&plain, order.nominal, &along, &own);
            watched.measured.add(is);
            watched.effects.add(std::array::from_fn(|c| is[c] - would_be[c]));
            watched.unmodelled.add(world.unmodelled_at(state, input));
            if let Some(shape) = shape {
                let x = world.features_at(state, input);
                watched.smooth.add(std::array::from_fn(|c| shape[c].at(&x)));
            }
        },
    )?;
    Ok(watched)
}

/// Flies an order and watches it.
#[cfg(test)]
pub(crate) fn watched(order: &Order<'_>) -> Result<Watched, String> {
    watched_with(order, None)
}

/// What is unmodelled of the vehicle of a case, in the size that suits its first flight.
///
/// # Errors
/// The vehicle fell, or what is hidden is too small beside it.
pub fn unmodelled(first: &Order<'_>, misfit: Misfit) -> Result<Unmodelled, String> {
    let mut draw = Draw::new(misfit.seed);
    let mut smooth: [Smooth; 6] = std::array::from_fn(|_| Smooth::draw(&mut draw));
    let seen = watched_with(first, Some(&smooth))?;
    let share = |c: usize| seen.effects.rms(c) / (misfit.share * seen.measured.sd(c));
    let most = (0..6).map(share).fold(0.0, f64::max);
    if most < EFFECT_MIN {
        return Err(format!(
            "what is hidden is {most:.2} of what is unmodelled, less than {EFFECT_MIN}"
        ));
    }
    let mut noise_sd = [0.0; 6];
    for (c, smooth) in smooth.iter_mut().enumerate() {
        let is_there = f64::from(u8::from(misfit.channels[c]));
        let size = is_there * misfit.share * seen.measured.sd(c);
        smooth.mean = seen.smooth.mean(c);
        smooth.gain = misfit.smooth_share.sqrt() * size / seen.smooth.sd(c);
        noise_sd[c] = (1.0 - misfit.smooth_share).sqrt() * size;
    }
    Ok(Unmodelled { smooth, noise_sd, time_constant_s: misfit.time_constant_s })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;
    use crate::set::Set;

    /// All flights, not the first alone, have the share that was asked for; and the effect is no
    /// smaller than half of it.
    #[test]
    fn shares_are_those_of_real_models_and_effects_can_be_seen_beside_them() {
        for index in [0, 4, 6, 10, 17] {
            // A vehicle whose effect is too small beside the rest is drawn again, as the bench does
            // it.
            let case = crate::case::seeds(1)
                .map(|seed| Case::draw(Set::Misfit, index, seed))
                .find(|case| case.watched(0).is_ok())
                .unwrap();
            for number in [0, 2] {
                let seen = case.watched(number).unwrap();
                let shares: Vec<f64> =
                    (0..6).map(|c| seen.unmodelled.rms(c) / seen.measured.sd(c)).collect();
                // Channel by channel another flight varies in another way; all of them together are
                // inside.
                let all = (shares.iter().map(|share| share * share).sum::<f64>() / 6.0).sqrt();
                assert!((0.1..0.25).contains(&all), "{index}, {number}: {shares:.3?}");
                assert!(
                    shares.iter().all(|share| (0.06..0.3).contains(share)),
                    "{index}, {number}: {shares:.3?}"
                );
                let most = (0..6)
                    .map(|c| seen.effects.rms(c) / seen.unmodelled.rms(c))
                    .fold(0.0, f64::max);
                assert!(most > 0.8 * EFFECT_MIN, "{index}, {number}: {most}");
            }
        }
    }

    #[test]
    fn noise_keeps_its_size_and_its_colour() {
        let of = Unmodelled {
            smooth: std::array::from_fn(|_| Smooth::draw(&mut Draw::new(1))),
            noise_sd: [2.0; 6],
            time_constant_s: 0.5,
        };
        let mut noise = Noise::new(Draw::new(3));
        let x: Vec<f64> = (0..200_000).map(|_| noise.step(0.05, &of)[2]).collect();
        let mean = |y: &dyn Fn(usize) -> f64| (0..190_000).map(y).sum::<f64>() / 190_000.0;
        let square = mean(&|k| x[k] * x[k]);
        assert!((square.sqrt() / 2.0 - 1.0).abs() < 0.03, "{square}");
        assert!((mean(&|k| x[k] * x[k + 10]) / square - (-1.0_f64).exp()).abs() < 0.03);
    }
}
