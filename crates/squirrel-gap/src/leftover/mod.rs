//! What the best explanation leaves, against what noise alone would leave: is there something that
//! no name accounts for?
//!
//! The leftover is looked at in blocks of about 0.27 s, which hold what is slower than 2 Hz, and as
//! a whole. Noise is drawn from what the log itself shows and goes through the same filters; a
//! leftover is real where it is well above their mean, by more than a model can be wrong in its
//! last percent and than what floats may be off. What it goes with is the family of features that
//! predicts it best where it was not fitted. A horizontal force that nothing predicts, without a
//! moment, is a gust.

mod features;
pub(crate) mod floor;
mod gusts;

use crate::predictor::{CHANNELS, DYNAMIC, Hypothesis, Motion, Predictor, Segment};
pub(crate) use features::{Moment, moment};
use features::{families, one_way, place_share, predicted_share};
pub(crate) use gusts::gusts;
use gusts::{kurtosis, quiet_half, sizes};
use nalgebra::{Matrix3, Vector3};
use squirrel_core::effects::Acting;
use squirrel_core::math::GRAVITY_M_S2;
use std::ops::Range;

/// Rows of the residual in one block: 0.27 s at 30 Hz.
const BLOCK: usize = 8;
/// Draws of the noise.
const DRAWS: usize = 8;
/// How far above the noise's mean a channel may be, slow and as a whole, in rms.
pub(crate) const SLOW_RATIO: f64 = 1.6;
const WHOLE_RATIO: f64 = 1.25;
/// Part of what the model explains that it may get wrong without an effect being missing.
const MODEL_ERROR: f64 = 0.015;
/// How far a line must stand above its neighbours, in power.
const LINE_CONTRAST: f64 = 6.0;
/// Part of the power that a line in the spectrum must have.
const LINE_SHARE: f64 = 0.35;
/// Part of the variance that a family must predict for a leftover to go with it.
const SHARE_MIN: f64 = 0.25;

/// The leftover of one channel of one flight.
#[derive(Debug, Clone)]
pub(crate) struct Band {
    pub(crate) channel: usize,
    /// Rms of what is slow and of the whole, in the unit of the channel.
    pub(crate) slow: f64,
    pub(crate) whole: f64,
    /// The same of the noise.
    pub(crate) slow_floor: f64,
    /// The slow part of the vehicle as it was.
    pub(crate) slow_nominal: f64,
    pub(crate) whole_floor: f64,
    /// The slow part of what was measured, about its mean.
    pub(crate) slow_measured: f64,
}

/// What is left.
#[derive(Debug, Clone)]
pub(crate) struct Leftover {
    pub(crate) bands: Vec<Band>,
    /// Channels that stand out, worst first: channel and ratio to what is allowed.
    pub(crate) excess: Vec<(usize, f64)>,
    /// Families by the share of the variance they predict in the worst channel.
    pub(crate) families: Vec<(&'static str, f64)>,
    /// Part of the variance of the horizontal force that its place predicts.
    pub(crate) place_share: f64,
    /// Part of the horizontal force along one axis of the body or of the world, 0.5 to 1: gusts
    /// blow along both.
    pub(crate) one_way: f64,
    /// Fourth moment of the slow part of the horizontal force, in units of its size by noise, over
    /// the square of its second: 3 for a normal distribution.
    pub(crate) kurtosis: f64,
    /// What is slow in a force at moments at which gusts would leave least, over what is allowed
    /// there: the most of the three axes. 0 where gusts are not in question.
    pub(crate) between_gusts: f64,
    /// A line in the spectrum of the worst channel: frequency, Hz, and its part of the power above
    /// 0.5 Hz.
    pub(crate) line: Option<(f64, f64)>,
    /// Whether the model misses a little everywhere, as models of real vehicles do, and not one
    /// thing: in force, or where most is left. It may, inside its tolerances.
    pub(crate) is_everywhere: bool,
    /// Whether it does so in every channel of force and moment that is looked at.
    pub(crate) is_in_all: bool,
}

impl Leftover {
    /// Whether something is there that no name accounts for.
    pub(crate) fn is_real(&self) -> bool {
        !self.excess.is_empty()
    }

    /// Mean square over all flights of something of a channel.
    pub(crate) fn power(&self, channel: usize, of: fn(&Band) -> f64) -> f64 {
        let own = self.bands.iter().filter(|band| band.channel == channel);
        let (sum, n) = own.fold((0.0, 0.0_f64), |(sum, n), b| (sum + of(b).powi(2), n + 1.0));
        sum / n.max(1.0)
    }

    /// The largest ratio to what is allowed; 0 where nothing stands out.
    pub(crate) fn worst(&self) -> f64 {
        self.worst_from(0)
    }

    /// The same of the channels from one on.
    pub(crate) fn worst_from(&self, channel: usize) -> f64 {
        let own = self.excess.iter().find(|(other, _)| *other >= channel);
        own.map_or(0.0, |(_, ratio)| *ratio)
    }

    /// What the leftover goes with, in words; `None` where nothing predicts it.
    pub(crate) fn goes_with(&self) -> Option<String> {
        let (channel, _) = self.excess.first()?;
        let channel = CHANNELS[*channel];
        match (self.families.first(), self.line) {
            (_, Some((hz, share))) if share > LINE_SHARE => {
                Some(format!("a line at {hz:.2} Hz in {channel}"))
            }
            (Some((name, share)), _) if *share >= SHARE_MIN => {
                Some(format!("{name} ({:.0} % of {channel})", 100.0 * share))
            }
            _ => None,
        }
    }

    /// Whether it goes with something that no form of any effect goes with: time, a place, a line
    /// in the spectrum.
    pub(crate) fn is_foreign(&self) -> bool {
        let strange = |(name, share): &(&str, f64)| {
            ["time in flight", "position"].contains(name) && *share > 0.5
        };
        self.families.first().is_some_and(strange)
            || self.line.is_some_and(|(_, share)| share > LINE_SHARE)
    }

    /// The channels that stand out, in words.
    pub(crate) fn channels(&self) -> String {
        let names: Vec<&str> = self.excess.iter().map(|(channel, _)| CHANNELS[*channel]).collect();
        format!("nothing that was tried; it stands out in {}", names.join(", "))
    }
}

/// What sensor noise and turbulence leave, often enough for a mean.
pub(crate) fn noise(
    predictor: &Predictor,
    wind_columns: &[Vec<f64>; 3],
    turbulence_m_s: f64,
) -> Vec<Vec<f64>> {
    floor::draws(predictor, wind_columns, turbulence_m_s, DRAWS)
}

/// The slow part of some channels that draws leave, by channel and piece, rms.
pub(crate) fn slow_parts(
    predictor: &Predictor,
    draws: &[Vec<f64>],
    channels: Range<usize>,
) -> Vec<f64> {
    let own = predictor.segments.iter().filter(|s| is_judged(s) && channels.contains(&s.channel));
    own.map(|segment| {
        let squares = draws.iter().map(|draw| rms_of_means(&draw[segment.rows.clone()]).powi(2));
        (squares.sum::<f64>() / draws.len() as f64).sqrt()
    })
    .collect()
}

/// Compares a leftover with what noise alone leaves.
///
/// * `left`, `nominal` - rows of the residual of the best explanation, and of the vehicle as it is
/// * `about` - the best explanation
/// * `draws` - what noise alone leaves, of [`noise`]
/// * `gusts` - what gusts would leave, of [`gusts`], where they are in question: bursts and places
///   are looked for in units of their size at each moment, as spread wings feel many times the gust
///   that folded ones do
/// * `slack` - tolerances that no column of the model stands for
pub(crate) fn leftover(
    predictor: &Predictor,
    about: &Hypothesis,
    left: &[f64],
    nominal: &[f64],
    draws: &[Vec<f64>],
    gusts: Option<&[Vec<f64>]>,
    slack: Slack,
) -> Leftover {
    let mut bands = Vec::new();
    let mut worst = [0.0_f64; DYNAMIC];
    // What a model may get wrong in a channel, whatever noise there is.
    let mut apart = [0.0_f64; DYNAMIC];
    for segment in predictor.segments.iter().filter(|s| is_judged(s)) {
        let rows = |all: &[f64]| all[segment.rows.clone()].to_vec();
        let own = rows(left);
        // What the model says in all: the measurement about its mean, and what the named effects
        // add.
        let track = &predictor.tracks[segment.piece];
        let measured = track.measured.iter().map(|m| m[segment.channel]);
        let mean = measured.clone().sum::<f64>() / own.len() as f64;
        let about_mean: Vec<f64> = measured.clone().map(|m| m - mean).collect();
        let explained: Vec<f64> = measured
            .zip(rows(nominal).iter().zip(&own))
            .map(|(m, (n, l))| (m - mean).abs().max((n - l).abs()))
            .collect();
        let noise: Vec<Vec<f64>> = draws.iter().map(|d| rows(d)).collect();
        let mean = |f: fn(&[f64]) -> f64| {
            (noise.iter().map(|n| f(n).powi(2)).sum::<f64>() / noise.len() as f64).sqrt()
        };
        let band = Band {
            channel: segment.channel,
            slow: rms_of_means(&own),
            whole: rms(&own),
            slow_floor: mean(rms_of_means),
            slow_nominal: rms_of_means(&rows(nominal)),
            whole_floor: mean(rms),
            slow_measured: rms_of_means(&about_mean),
        };
        let within =
            within_tolerance(predictor, &predictor.motion(segment.piece, about), segment, slack);
        let [slow_usual, whole_usual] = slack.usual[segment.channel];
        let model_error = MODEL_ERROR * rms_of_means(&explained);
        let allowed = |floor: f64, ratio: f64, usual: f64| {
            ((floor.max(usual) * ratio).powi(2) + model_error.powi(2) + within.powi(2)).sqrt()
        };
        let ratio = (band.slow / allowed(band.slow_floor, SLOW_RATIO, slow_usual))
            .max(band.whole / allowed(band.whole_floor, WHOLE_RATIO, whole_usual));
        worst[segment.channel] = worst[segment.channel].max(ratio);
        apart[segment.channel] = apart[segment.channel].max(model_error.hypot(within));
        bands.push(band);
    }
    let mut excess: Vec<(usize, f64)> =
        worst.iter().copied().enumerate().filter(|(_, ratio)| *ratio > 1.0).collect();
    excess.sort_by(|a, b| b.1.total_cmp(&a.1));
    // Of all draws at each moment: dear, and asked for where gusts or a leftover are in question.
    let sizes_of = |channels: Range<usize>| -> Vec<Vec<f64>> {
        channels.map(|channel| sizes(predictor, gusts.unwrap_or(draws), channel)).collect()
    };
    let of_forces = match (gusts, excess.is_empty()) {
        (Some(_), _) => sizes_of(0..3),
        (None, false) => sizes_of(0..2),
        (None, true) => Vec::new(),
    };
    let mut out = Leftover {
        bands,
        excess,
        families: Vec::new(),
        place_share: 0.0,
        one_way: 0.5,
        kurtosis: 3.0,
        between_gusts: gusts.map_or(0.0, |_| {
            let ratios = of_forces.iter().enumerate().map(|(channel, sizes)| {
                let [usual, _] = slack.usual[channel];
                quiet_half(&means(predictor, left, channel), sizes, |size| {
                    (size.max(usual) * SLOW_RATIO).hypot(apart[channel])
                })
            });
            ratios.fold(0.0, f64::max)
        }),
        line: None,
        is_everywhere: false,
        is_in_all: false,
    };
    if let Some(&(channel, _)) = out.excess.first() {
        let y = means(predictor, left, channel);
        let moments = moments_of(predictor, about, channel);
        out.families =
            families(&moments).iter().map(|f| (f.name, predicted_share(f, &y))).collect();
        let [x, y] = [0, 1].map(|channel| -> Vec<f64> {
            let own = means(predictor, left, channel);
            own.iter().zip(&of_forces[channel]).map(|(force, size)| force / size).collect()
        });
        let horizontal = moments_of(predictor, about, 0);
        out.place_share = place_share(&horizontal, [&x, &y]);
        out.one_way = one_way(&horizontal, [&x, &y]);
        if channel < 2 {
            out.families.push(("position", out.place_share));
        }
        out.families.sort_by(|a, b| b.1.total_cmp(&a.1));
        out.kurtosis = kurtosis(&x).max(kurtosis(&y));
        out.line = line(predictor, left, channel);
    }
    let group = out.excess.first().map_or(0, |(channel, _)| channel / 3);
    out.is_everywhere = is_everywhere(predictor, left, &out, group);
    out.is_in_all = (0..DYNAMIC).all(|channel| {
        let is_judged = out.bands.iter().any(|b| b.channel == channel);
        !is_judged || misses_in(&out, channel)
    });
    out
}

/// Tolerances, one standard deviation, of what the catalogue has no single number for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Slack {
    /// Where forces act, m.
    pub(crate) lever_m: f64,
    /// Drag along one axis, N s/m.
    pub(crate) drag_n_s_per_m: f64,
    /// Thrust over a flight, as a fraction.
    pub(crate) thrust_fraction: f64,
    /// When commands act, s.
    pub(crate) timing_s: f64,
    /// What the model usually leaves of this machine's flights, slow and as a whole, by channel and
    /// in its unit.
    pub(crate) usual: Usual,
}

/// Rms of what a model leaves of a flight, by channel of the dynamics: of its slow part and of the
/// whole.
pub(crate) type Usual = [[f64; 2]; DYNAMIC];

/// The largest of what is left of any flight.
pub(crate) fn usual(predictor: &Predictor, left: &[f64]) -> Usual {
    let mut most = Usual::default();
    for segment in predictor.segments.iter().filter(|s| is_judged(s)) {
        let own = &left[segment.rows.clone()];
        let [slow, whole] = &mut most[segment.channel];
        (*slow, *whole) = (slow.max(rms_of_means(own)), whole.max(rms(own)));
    }
    most
}

/// Whether a leftover is looked for in a segment.
fn is_judged(segment: &Segment) -> bool {
    segment.channel < DYNAMIC && !segment.is_trim() && segment.rows.len() >= 4 * BLOCK
}

/// What such tolerances leave in a channel, in its unit: forces that act a little beside their
/// place are moments, and no drag is a straight line.
fn within_tolerance(
    predictor: &Predictor,
    motion: &Motion,
    segment: &Segment,
    slack: Slack,
) -> f64 {
    let p = predictor.vehicle.vehicle.parameters();
    let slow = |channel: usize| {
        let measured = &predictor.tracks[segment.piece].measured;
        let mean = measured.iter().map(|m| m[channel]).sum::<f64>() / measured.len().max(1) as f64;
        let force: Vec<f64> = measured.iter().map(|m| m[channel] - mean).collect();
        rms_of_means(&force) * p.mass_kg
    };
    match segment.channel {
        0..=2 => {
            let n = motion.body.len().max(1) as f64;
            let speed =
                motion.body.iter().map(|b| b.velocity.vector.norm_squared()).sum::<f64>() / n;
            let thrust =
                if segment.channel == 2 { slack.thrust_fraction * GRAVITY_M_S2 } else { 0.0 };
            thrust.hypot(slack.drag_n_s_per_m * speed.sqrt() / p.mass_kg)
        }
        axis @ (3 | 4) => {
            // Commands that were logged on another clock are off by up to a sample.
            let measured = &predictor.tracks[segment.piece].measured;
            let change =
                measured.windows(2).map(|w| (w[1][axis] - w[0][axis]).powi(2)).sum::<f64>();
            let rate = (change / measured.len().max(1) as f64).sqrt() / segment.step_s;
            let beside = slack.lever_m * slow(2) / p.inertia_kg_m2[(axis - 3, axis - 3)];
            beside.hypot(slack.timing_s * rate)
        }
        _ => slack.lever_m * slow(0).hypot(slow(1)) / p.inertia_kg_m2[(2, 2)],
    }
}

/// How far above noise an axis is that a model misses something on.
const MISSED: f64 = 2.0;
/// Part of the variance of three axes, each in units of its own size, that one cause behind all has
/// at least.
const ONE_CAUSE: f64 = 0.8;

fn centred(x: &[f64]) -> Vec<f64> {
    let mean = x.iter().sum::<f64>() / x.len().max(1) as f64;
    x.iter().map(|x| x - mean).collect()
}

/// Whether a model misses something in a channel: it stands out, or is well above noise.
fn misses_in(found: &Leftover, channel: usize) -> bool {
    let rms_of = |of: fn(&Band) -> f64| found.power(channel, of).sqrt();
    let floor = rms_of(|b| b.slow_floor);
    let stands_out = found.excess.iter().any(|(other, _)| *other == channel);
    stands_out || (floor > 0.0 && rms_of(|b| b.slow) > MISSED * floor)
}

/// Whether all three axes of force or moment are left with something, and not the same thing: one
/// missing effect leaves the others at their noise, or moves all as one.
fn is_everywhere(predictor: &Predictor, left: &[f64], found: &Leftover, group: usize) -> bool {
    let axes = [0, 1, 2].map(|axis| 3 * group + axis);
    if !axes.iter().all(|channel| misses_in(found, *channel)) {
        return false;
    }
    // What lasts in each axis has nothing to do with the others for that.
    let all = axes.map(|channel| centred(&means(predictor, left, channel)));
    let size = all.each_ref().map(|x| rms(x));
    let correlation = Matrix3::from_fn(|i, j| {
        let sum: f64 = all[i].iter().zip(&all[j]).map(|(a, b)| a * b).sum();
        sum / (all[i].len().max(1) as f64 * size[i] * size[j])
    });
    correlation.symmetric_eigenvalues().max() < 3.0 * ONE_CAUSE
}

/// The moments of the blocks of one channel, in the air that an explanation has: what pushes a
/// vehicle goes with its motion through that.
fn moments_of(predictor: &Predictor, about: &Hypothesis, channel: usize) -> Vec<Moment> {
    let acting = Acting::new(&about.effects, &about.vehicle);
    let mut moments = Vec::new();
    for segment in predictor.segments.iter().filter(|s| s.channel == channel) {
        let (track, motion) =
            (&predictor.tracks[segment.piece], predictor.motion(segment.piece, about));
        for i in 0..segment.rows.len() / BLOCK {
            let mut moment = moment(predictor, track, &motion, i * BLOCK, BLOCK);
            let [north, east] = acting.numbers().wind(acting.present(), -moment.position.z);
            moment.velocity_body -= moment.ned_from_body.tr_mul(&Vector3::new(north, east, 0.0));
            moments.push(moment);
        }
    }
    moments
}

/// Block means of one channel.
fn means(predictor: &Predictor, rows: &[f64], channel: usize) -> Vec<f64> {
    let own = predictor.segments.iter().filter(|s| s.channel == channel);
    own.flat_map(|s| rows[s.rows.clone()].chunks_exact(BLOCK))
        .map(|block| block.iter().sum::<f64>() / BLOCK as f64)
        .collect()
}

fn rms(x: &[f64]) -> f64 {
    (x.iter().map(|v| v * v).sum::<f64>() / x.len() as f64).sqrt()
}

fn rms_of_means(x: &[f64]) -> f64 {
    let means: Vec<f64> =
        x.chunks_exact(BLOCK).map(|b| b.iter().sum::<f64>() / BLOCK as f64).collect();
    rms(&means)
}

/// Bins on each side of a line that it stands above.
const SIDES: usize = 8;

/// The strongest line between 0.5 and 12 Hz, and its part of the power there, in the longest
/// segment of a channel.
fn line(predictor: &Predictor, left: &[f64], channel: usize) -> Option<(f64, f64)> {
    let segment =
        predictor.segments.iter().filter(|s| s.channel == channel).max_by_key(|s| s.rows.len())?;
    let x = &left[segment.rows.clone()];
    let n = x.len();
    let duration_s = n as f64 * segment.step_s;
    // Where slow noise begins to fall is no line: what is below the band is looked at as its
    // neighbour.
    let below = SIDES.min((0.5 * duration_s) as usize);
    let bins = (0.5 * duration_s) as usize - below
        ..(12.0_f64.min(0.45 / segment.step_s) * duration_s) as usize;
    let power: Vec<f64> = bins
        .clone()
        .map(|bin| {
            // Goertzel: one line of the spectrum by a recursion.
            let w = std::f64::consts::TAU * bin as f64 / n as f64;
            let (mut a, mut b) = (0.0, 0.0);
            for value in x {
                (a, b) = (value + 2.0 * w.cos() * a - b, a);
            }
            a * a + b * b - 2.0 * w.cos() * a * b
        })
        .collect();
    let total: f64 = power.iter().skip(below).sum();
    let (at, _) = power.iter().enumerate().skip(below).max_by(|a, b| a.1.total_cmp(b.1))?;
    // A line that wanders a little spreads over neighbours, and stands above those further off:
    // slow noise does not.
    let around = |reach: usize| at.saturating_sub(reach)..(at + reach + 1).min(power.len());
    let own: f64 = power[around(2)].iter().sum();
    let sides: f64 = power[around(SIDES)].iter().sum::<f64>() - own;
    let (own_bins, side_bins) =
        (around(2).len() as f64, (around(SIDES).len() - around(2).len()).max(1) as f64);
    if own / own_bins < LINE_CONTRAST * sides / side_bins {
        return None;
    }
    (total > 0.0).then(|| ((bins.start + at) as f64 / duration_s, own / total))
}
