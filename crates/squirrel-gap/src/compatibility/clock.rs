//! A clock that jumps within a flight: one shift in time explains what two sources say before,
//! another one after.
//!
//! ```text
//! R^2(d) = (sum_k x(t_k) y(t_k - d(t_k)))^2 / (sum x^2 sum y^2)      d(t): a line, or a step between two constants
//! F = n_eff (R^2_step - R^2_line) / (1 - R^2_step)
//! ```
//! The line is what effects do: a latency, and a clock that runs off.

use super::Found;
use super::flight::Flight;
use nalgebra::Vector3;
use std::ops::Range;

/// Shifts that are tried: so many either way, and apart, s.
const SHIFTS: i32 = 75;
const SHIFT_STEP_S: f64 = 0.02;
const SLOTS: usize = 2 * SHIFTS as usize + 1;
/// What changes within this time is quick, s.
const QUICK_S: f64 = 0.1;
/// Blocks between which a step is looked for, s, and the fewest on each side of it.
const BLOCK_S: f64 = 2.0;
const BLOCKS_MAX: f64 = 100.0;
const SIDE_MIN: usize = 2;
/// Clocks that run off, ppm: up to, and apart.
const SKEW_MAX_PPM: i32 = 2000;
const SKEW_STEP_PPM: i32 = 250;
/// What a step must show to be believed: F, the correlation on each side, its size, s, and either
/// the most that it may leave of what the line leaves, or how many times what the line explains it
/// must explain.
struct Bar {
    f: f64,
    fit: f64,
    by_s: f64,
    left: f64,
    explains: f64,
    /// Whether what is quick must have the step, too.
    quick: bool,
}

const ATTITUDE: Bar =
    Bar { f: 25.0, fit: 0.6, by_s: 0.07, left: 0.85, explains: f64::INFINITY, quick: false };
const FIXES: Bar =
    Bar { f: 25.0, fit: 0.6, by_s: 0.12, left: 0.8, explains: f64::INFINITY, quick: false };
/// What commands do not explain is mostly noise of the rates' derivative, which has no time.
const COMMANDS: Bar = Bar { f: 12.0, fit: 0.15, by_s: 0.07, left: 0.7, explains: 1.2, quick: true };
/// How many times what one shift explains of what is quick a step must.
const QUICK_EXPLAINS: f64 = 1.4;
/// On one side of it the clock is right: shifts that effects explain, s.
const RIGHT_S: (f64, f64) = (-0.1, 0.5);
/// Steps of two sources this close are one, s.
const ALIKE_S: f64 = 0.1;
/// Samples of these sources that count as one.
const SAMPLES_ALIKE: f64 = 3.0;

/// A step of the time between two sources, s, and when it happens, s.
struct Step {
    by_s: f64,
    at_s: f64,
}

/// Steps of attitude, fixes or commands against the inertial unit.
pub(super) fn steps(flight: &Flight, residual: &[f64]) -> Found {
    let mut found: Vec<(&'static str, Step)> = Vec::new();
    if flight.has_attitude() {
        let (time_s, pairs) = flight.rates(&|q| q);
        let (gyro, attitude) = pairs.split();
        let by = step(&time_s, &attitude, &gyro, &ATTITUDE);
        found.extend(by.map(|step| ("attitude.q_ned_from_body_wxyz", step)));
        let (time_s, pairs) = flight.accelerations(&flight.strapdown(&|q| q), 0.0);
        let (fixes, strapdown) = pairs.split();
        let by = step(&time_s, &fixes, &strapdown, &FIXES);
        found.extend(by.map(|step| ("gnss.velocity_ned_m_s", step)));
    }
    // Roll and pitch by their commands, and thrust, each in its standard deviations.
    let (forces, moments) = (flight.predicted(residual, 0), flight.predicted(residual, 3));
    let (f, a) = (forces.split(), moments.split());
    let joined = |a: &[Vector3<f64>], f: &[Vector3<f64>]| {
        let all: Vec<_> = a.iter().zip(f).map(|(a, f)| Vector3::new(a.x, a.y, f.z)).collect();
        in_deviations(&all)
    };
    // What is done later after what was asked has stamps of commands that are early.
    let by = step(&flight.residual_time_s(), &joined(&a.0, &f.0), &joined(&a.1, &f.1), &COMMANDS);
    found.extend(by.map(|s| ("rotor.command", Step { by_s: -s.by_s, ..s })));
    // A unit whose own clock steps does so against all others.
    let others: Vec<f64> = found
        .iter()
        .filter(|(channel, _)| *channel != "gnss.velocity_ned_m_s")
        .map(|(_, s)| s.by_s)
        .collect();
    let is_unit = matches!(others[..], [a, b] if (a - b).abs() < ALIKE_S);
    let (channel, step) = found.first()?;
    let (channel, by_s) =
        if is_unit { ("imu.omega_body_rad_s", -step.by_s) } else { (*channel, step.by_s) };
    let words = format!(
        "its clock steps by {by_s:+.2} s against the other sources at about {:.0} s; mend `time` of its source, or cut the flight there",
        step.at_s
    );
    Some((channel, words))
}

/// The step of the first against the second, if there is one: how much later the first comes after
/// it.
fn step(time_s: &[f64], own: &[Vector3<f64>], other: &[Vector3<f64>], bar: &Bar) -> Option<Step> {
    let all = Blocks::new(time_s, own, other)?;
    let blocks = all.count;
    let mut line = 0.0_f64;
    for ppm in (-SKEW_MAX_PPM..=SKEW_MAX_PPM).step_by(SKEW_STEP_PPM as usize) {
        let slope = f64::from(ppm) * 1e-6 * all.block_s / SHIFT_STEP_S;
        let run = |block: usize| (slope * (block as f64 - 0.5 * blocks as f64)).round() as i32;
        for shift in -SHIFTS..=SHIFTS {
            line = line.max(all.fit(0..blocks, &|block| shift + run(block)));
        }
    }
    let best_shift = |range: Range<usize>| {
        let fits = (-SHIFTS..=SHIFTS).map(|shift| (all.fit(range.clone(), &|_| shift), shift));
        fits.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, 0))
    };
    let (mut stepped, mut found) = (0.0, None);
    for cut in SIDE_MIN..=blocks - SIDE_MIN {
        let ((before, s0), (after, s1)) = (best_shift(0..cut), best_shift(cut..blocks));
        let both = all.fit(0..blocks, &|block| if block < cut { s0 } else { s1 });
        if both > stepped {
            stepped = both;
            found = Some((before.min(after), s0, s1, cut));
        }
    }
    let (sides, s0, s1, cut) = found?;
    let by_s = f64::from(s1 - s0) * SHIFT_STEP_S;
    let is_right =
        |shift: i32| (RIGHT_S.0..=RIGHT_S.1).contains(&(f64::from(shift) * SHIFT_STEP_S));
    let f = time_s.len() as f64 / SAMPLES_ALIKE * (stepped - line) / (1.0 - stepped).max(1e-6);
    let is_real = f > bar.f
        && (is_right(s0) || is_right(s1))
        && sides > bar.fit * bar.fit
        && by_s.abs() > bar.by_s
        && (1.0 - stepped <= bar.left * (1.0 - line) || stepped >= bar.explains * line);
    // What is slow and comes back looks alike at other times, too, and a force that is missing moves
    // it.
    let is_quick = || {
        let quick = Blocks::new(time_s, &changes(time_s, own), &changes(time_s, other))?;
        let at = |shift: &dyn Fn(usize) -> i32| quick.fit(0..blocks, shift);
        let one = at(&|_| s0).max(at(&|_| s1));
        Some(at(&|block| if block < cut { s0 } else { s1 }) > QUICK_EXPLAINS * one)
    };
    let step = || Step { by_s, at_s: time_s[0] + cut as f64 * all.block_s };
    (is_real && (!bar.quick || is_quick()?)).then(step)
}

/// What two sources have in common, by block of the flight and by how much later the first is
/// taken.
struct Blocks {
    block_s: f64,
    count: usize,
    /// Of each block and shift: sums of own^2, other^2 and their product.
    sums: Vec<[f64; 3]>,
}

impl Blocks {
    /// None where the flight is too short, or a source has no value at some time.
    fn new(time_s: &[f64], own: &[Vector3<f64>], other: &[Vector3<f64>]) -> Option<Self> {
        let (own, other) = (centred(own), centred(other));
        // Where a model has no finite answer, times are not known.
        if own.len() != time_s.len() || other.len() != time_s.len() {
            return None;
        }
        let (start_s, end_s) = (*time_s.first()?, *time_s.last()?);
        let block_s = BLOCK_S.max((end_s - start_s) / BLOCKS_MAX);
        let count = ((end_s - start_s) / block_s) as usize;
        if count < 2 * SIDE_MIN {
            return None;
        }
        let mut sums = vec![[0.0; 3]; count * SLOTS];
        let usual_s = (end_s - start_s) / time_s.len() as f64;
        for (slot, shift) in (-SHIFTS..=SHIFTS).enumerate() {
            let shift_s = f64::from(shift) * SHIFT_STEP_S;
            let mut j = 0;
            for (t, x) in time_s.iter().zip(&own) {
                let at = t - shift_s;
                while j + 1 < time_s.len() && time_s[j + 1] <= at {
                    j += 1;
                }
                if j + 1 >= time_s.len() || time_s[j] > at {
                    continue;
                }
                let width_s = time_s[j + 1] - time_s[j];
                if width_s > 3.0 * usual_s {
                    continue;
                }
                let y = other[j] + (other[j + 1] - other[j]) * ((at - time_s[j]) / width_s);
                let block = (((t - start_s) / block_s) as usize).min(count - 1);
                let sum = &mut sums[block * SLOTS + slot];
                sum[0] += x.norm_squared();
                sum[1] += y.norm_squared();
                sum[2] += x.dot(&y);
            }
        }
        Some(Self { block_s, count, sums })
    }

    /// R^2 over some blocks, each at its shift; 0 where the two go against each other.
    fn fit(&self, blocks: Range<usize>, shift: &dyn Fn(usize) -> i32) -> f64 {
        let mut s = [0.0; 3];
        for block in blocks {
            let slot = (shift(block) + SHIFTS).clamp(0, 2 * SHIFTS) as usize;
            s.iter_mut().zip(self.sums[block * SLOTS + slot]).for_each(|(s, own)| *s += own);
        }
        if s[2] > 0.0 { s[2] * s[2] / (s[0] * s[1]).max(f64::MIN_POSITIVE) } else { 0.0 }
    }
}

/// By how much each value differs from the one a tenth of a second before; the first ones by
/// nothing.
fn changes(time_s: &[f64], values: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let mut before = 0;
    let change = |(t, value): (&f64, &Vector3<f64>)| {
        while t - time_s[before] > QUICK_S {
            before += 1;
        }
        value - values[before]
    };
    time_s.iter().zip(values).map(change).collect()
}

/// About the mean.
fn centred(values: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let mean = values.iter().sum::<Vector3<f64>>() / values.len().max(1) as f64;
    values.iter().map(|v| v - mean).collect()
}

/// Each axis about its mean and in its standard deviations, so that axes count alike whatever their
/// units.
fn in_deviations(values: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let values = centred(values);
    let square = values.iter().map(|v| v.component_mul(v)).sum::<Vector3<f64>>()
        / values.len().max(1) as f64;
    let scale = square.map(|s| if s > 0.0 { s.sqrt().recip() } else { 0.0 });
    values.iter().map(|v| v.component_mul(&scale)).collect()
}
