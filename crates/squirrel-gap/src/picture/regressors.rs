//! What the residual follows: what a unit of a named effect would do to a channel, or, where no
//! name accounts for it, the quantity of the flight that it goes with.
//!
//! Against its own effect a residual lies on a line whose slope is the effect's size; under the
//! answer on a flat one.

use super::{CHANNELS, unit};
use crate::leftover::{Moment, moment};
use crate::name::{Naming, Search};
use crate::predictor::{DYNAMIC, Predictor};
use crate::report::{Bin, Conditional};

/// Bins of a regressor, and the fewest samples in one that is shown.
const BINS: usize = 20;
const SAMPLES_MIN: usize = 8;
/// Part of the samples at each end that goes into the last bin.
const TAIL: f64 = 0.005;
/// Pictures of each effect, and of a leftover.
const CHANNELS_EACH: usize = 2;
/// Rows that a quantity of the flight is taken over: 0.27 s.
const BLOCK: usize = 8;

/// A quantity of the flight: family of the leftover, name, unit, value.
type Quantity = (&'static str, &'static str, &'static str, fn(&Moment) -> f64);

const QUANTITIES: [Quantity; 14] = [
    ("time in flight", "time in flight", "s", |m| m.time_s),
    ("position", "position north", "m", |m| m.position.x),
    ("position", "position east", "m", |m| m.position.y),
    ("position", "height", "m", |m| -m.position.z),
    ("velocity", "velocity forwards", "m/s", |m| m.velocity_body.x),
    ("velocity", "velocity to the right", "m/s", |m| m.velocity_body.y),
    ("velocity", "velocity down the body", "m/s", |m| m.velocity_body.z),
    ("angular rates", "roll rate", "rad/s", |m| m.omega.x),
    ("angular rates", "pitch rate", "rad/s", |m| m.omega.y),
    ("angular rates", "yaw rate", "rad/s", |m| m.omega.z),
    ("throttle", "throttle", "", |m| m.throttle),
    ("wings", "wings", "", |m| m.wings),
    ("heading", "heading", "rad", |m| m.heading_rad),
    ("battery voltage", "battery voltage", "V", |m| m.voltage_v),
];

/// A regressor and the residual before and after.
#[derive(Clone, Copy)]
struct Sample {
    at: f64,
    before: f64,
    after: f64,
}

/// Pictures of every named effect; of the leftover where it is real or nothing is named.
pub(super) fn conditional(search: &Search<'_>, naming: &Naming) -> Vec<Conditional> {
    let best = &naming.found.best;
    let mut all = Vec::new();
    for (index, member) in best.members.iter().enumerate() {
        let Some(column) = best.free.iter().position(|(member, _)| *member == index) else {
            continue;
        };
        let candidate = &search.catalogue.candidates[member.candidate];
        let slot = best.free[column].1;
        let key = squirrel_core::effects::Effects::<f64>::parameters(candidate.effect)
            .and_then(|list| list.get(slot))
            .map_or("", |parameter| parameter.key);
        all.extend(of_effect(search.predictor, naming, column, candidate.effect, key));
    }
    if all.is_empty() || naming.leftover.is_real() {
        all.extend(of_leftover(search.predictor, naming));
    }
    all
}

/// The channels in which one number of an effect weighs most, against what a unit of it does there.
fn of_effect(
    predictor: &Predictor,
    naming: &Naming,
    column: usize,
    effect: &str,
    key: &str,
) -> Vec<Conditional> {
    let raw = naming.found.best.own_raw[column].piece(0..predictor.rows());
    let mut weight: Vec<(usize, f64)> = (0..CHANNELS.len()).map(|channel| (channel, 0.0)).collect();
    for segment in predictor.segments.iter().filter(|s| s.channel < CHANNELS.len()) {
        let white = naming.found.linear.whitener.apply(std::slice::from_ref(segment), &raw);
        weight[segment.channel].1 += white.iter().map(|x| x * x).sum::<f64>();
    }
    weight.sort_by(|a, b| b.1.total_cmp(&a.1));
    let per = match unit(key) {
        "" => String::new(),
        unit => format!(" per {unit}"),
    };
    weight
        .into_iter()
        .filter(|(_, weight)| *weight > 0.0)
        .take(CHANNELS_EACH)
        .map(|(channel, _)| {
            let rows = predictor
                .segments
                .iter()
                .filter(|s| s.channel == channel)
                .flat_map(|s| s.rows.clone());
            let sample =
                |i: usize| Sample { at: raw[i], before: naming.nominal[i], after: naming.left[i] };
            let (name, unit) = CHANNELS[channel];
            Conditional {
                channel: name.to_owned(),
                unit: unit.to_owned(),
                regressor: format!("effect of {effect}.{key}"),
                regressor_unit: format!("{unit}{per}"),
                bins: bins(&rows.map(sample).collect::<Vec<_>>()),
            }
        })
        .collect()
}

/// The quantities that the leftover follows best, in the channels where it stands out; in all where
/// it does nowhere.
fn of_leftover(predictor: &Predictor, naming: &Naming) -> Vec<Conditional> {
    let leftover = &naming.leftover;
    let mut channels: Vec<usize> = leftover.excess.iter().map(|(channel, _)| *channel).collect();
    if channels.is_empty() {
        channels = (0..DYNAMIC).collect();
    }
    let family = leftover.families.first().map(|(name, _)| *name);
    let mut all: Vec<(f64, Conditional)> = Vec::new();
    for channel in channels {
        let blocks = blocks(predictor, naming, channel);
        for (of, name, unit_of, value) in QUANTITIES {
            if family.is_some_and(|family| family != of) {
                continue;
            }
            let samples: Vec<Sample> = blocks
                .iter()
                .map(|(moment, sample)| Sample { at: value(moment), ..*sample })
                .collect();
            let bins = bins(&samples);
            let (channel, unit) = CHANNELS[channel];
            all.push((
                explained(&samples, &bins),
                Conditional {
                    channel: channel.to_owned(),
                    unit: unit.to_owned(),
                    regressor: name.to_owned(),
                    regressor_unit: unit_of.to_owned(),
                    bins,
                },
            ));
        }
    }
    // Stable: equals keep the order of channels and quantities.
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    all.into_iter()
        .filter(|(_, c)| !c.bins.is_empty())
        .take(CHANNELS_EACH)
        .map(|(_, c)| c)
        .collect()
}

/// Means of one channel over blocks, and where the vehicle was in them.
fn blocks(predictor: &Predictor, naming: &Naming, channel: usize) -> Vec<(Moment, Sample)> {
    let mut all = Vec::new();
    for segment in predictor.segments.iter().filter(|s| s.channel == channel && !s.is_trim()) {
        let (track, motion) = (&predictor.tracks[segment.piece], &predictor.plain()[segment.piece]);
        let before = naming.nominal[segment.rows.clone()].chunks_exact(BLOCK);
        let after = naming.left[segment.rows.clone()].chunks_exact(BLOCK);
        for (i, (before, after)) in before.zip(after).enumerate() {
            let mean = |rows: &[f64]| rows.iter().sum::<f64>() / BLOCK as f64;
            let moment = moment(predictor, track, motion, i * BLOCK, BLOCK);
            all.push((moment, Sample { at: 0.0, before: mean(before), after: mean(after) }));
        }
    }
    all
}

/// Bins of equal width between the tails; empty where the regressor does not vary.
fn bins(samples: &[Sample]) -> Vec<Bin> {
    let mut order: Vec<f64> = samples.iter().map(|s| s.at).filter(|x| x.is_finite()).collect();
    order.sort_unstable_by(f64::total_cmp);
    let Some(last) = order.len().checked_sub(1) else { return Vec::new() };
    let at = |share: f64| order[(share * last as f64) as usize];
    let (low, high) = (at(TAIL), at(1.0 - TAIL));
    if !(high > low) {
        return Vec::new();
    }
    let mut all: Vec<Vec<Sample>> = vec![Vec::new(); BINS];
    for sample in samples.iter().filter(|s| s.at.is_finite()) {
        let bin = ((sample.at - low) / (high - low) * BINS as f64).max(0.0) as usize;
        all[bin.min(BINS - 1)].push(*sample);
    }
    all.into_iter()
        .filter(|bin| bin.len() >= SAMPLES_MIN)
        .map(|bin| {
            let mean = |of: fn(&Sample) -> f64| bin.iter().map(of).sum::<f64>() / bin.len() as f64;
            let sd = |of: fn(&Sample) -> f64| {
                let middle = mean(of);
                (bin.iter().map(|s| (of(s) - middle).powi(2)).sum::<f64>() / bin.len() as f64)
                    .sqrt()
            };
            Bin {
                at: mean(|s| s.at),
                count: bin.len(),
                before_mean: mean(|s| s.before),
                before_sd: sd(|s| s.before),
                after_mean: mean(|s| s.after),
                after_sd: sd(|s| s.after),
            }
        })
        .collect()
}

/// Part of the variance before that the means of the bins hold, 0 to 1.
fn explained(samples: &[Sample], bins: &[Bin]) -> f64 {
    let n = samples.len() as f64;
    let mean = samples.iter().map(|s| s.before).sum::<f64>() / n;
    let total: f64 = samples.iter().map(|s| (s.before - mean).powi(2)).sum();
    let between: f64 = bins.iter().map(|b| b.count as f64 * (b.before_mean - mean).powi(2)).sum();
    if total > 0.0 { between / total } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_seen_and_a_constant_regressor_has_no_bins() {
        let sample =
            |i: usize, at: f64| Sample { at, before: 0.5 * at, after: f64::from(i as u32 % 2) };
        let line: Vec<Sample> = (0..1000).map(|i| sample(i, i as f64)).collect();
        let seen = bins(&line);
        assert_eq!(seen.len(), BINS);
        assert_eq!(seen.iter().map(|b| b.count).sum::<usize>(), 1000);
        assert!(
            seen.iter()
                .all(|b| (b.before_mean - 0.5 * b.at).abs() < 1e-9
                    && (b.after_sd - 0.5).abs() < 0.02)
        );
        assert!(explained(&line, &seen) > 0.99);
        let still: Vec<Sample> = (0..1000).map(|i| sample(i, 3.0)).collect();
        assert!(bins(&still).is_empty() && bins(&[]).is_empty());
        let unknown: Vec<Sample> = (0..1000).map(|i| sample(i, f64::NAN)).collect();
        assert!(bins(&unknown).is_empty());
    }
}
