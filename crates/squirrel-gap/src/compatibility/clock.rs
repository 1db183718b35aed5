//! A clock that jumps within a flight: one shift in time explains what two sources say before, another one after.
//!
//! ```text
//! R^2(d) = (sum_k x(t_k) y(t_k - d(t_k)))^2 / (sum x^2 sum y^2)      d(t): a line, or a step between two constants
//! F = n_eff (R^2_step - R^2_line) / (1 - R^2_step)
//! ```
//! The line is what effects do: a latency, and a clock that runs off.

use super::Found;
use super::flight::Flight;
use nalgebra::Vector3;

/// Shifts that are tried: up to, and apart, s.
const SHIFT_MAX_S: f64 = 1.5;
const SHIFT_STEP_S: f64 = 0.02;
/// Blocks between which a step is looked for, s, and the fewest on each side of it.
const BLOCK_S: f64 = 2.0;
const BLOCKS_MAX: f64 = 100.0;
const SIDE_MIN: usize = 2;
/// Clocks that run off, ppm: up to, and apart.
const SKEW_MAX_PPM: i32 = 2000;
const SKEW_STEP_PPM: i32 = 250;
/// How much a step must explain: F, and the part of what the line leaves that the step may leave.
const F_MIN: f64 = 40.0;
const LEFT_MAX: f64 = 0.8;
/// How well the two must go together on each side of it.
const MATCH: f64 = 0.6;
/// On one side of it the clock is right: shifts that effects explain, s.
const RIGHT_S: (f64, f64) = (-0.1, 0.5);
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
    let mut look = |channel, step: Option<Step>, least_s: f64| {
        found.extend(step.filter(|s| s.by_s.abs() > least_s).map(|step| (channel, step)));
    };
    if flight.has_attitude() {
        let (time_s, pairs) = flight.rates(&|q| q);
        let (gyro, attitude) = pairs.split();
        look("attitude.q_ned_from_body_wxyz", step(&time_s, &attitude, &gyro, false), 0.05);
        let (time_s, pairs) = flight.accelerations(&flight.strapdown(&|q| q), 0.0);
        let (fixes, strapdown) = pairs.split();
        look("gnss.velocity_ned_m_s", step(&time_s, &fixes, &strapdown, false), 0.12);
    }
    // Roll and pitch by their commands, and thrust.
    let (forces, moments) = (flight.predicted(residual, 0), flight.predicted(residual, 3));
    let (f, a) = (forces.split(), moments.split());
    let joined = |a: &[Vector3<f64>], f: &[Vector3<f64>]| -> Vec<Vector3<f64>> {
        a.iter().zip(f).map(|(a, f)| Vector3::new(a.x, a.y, f.z)).collect()
    };
    let time_s = flight.residual_time_s();
    let (did, asked) = (joined(&a.0, &f.0), joined(&a.1, &f.1));
    // What comes later in time than asked has stamps of commands that are early: the sign is that of the commands' clock.
    let of_commands = step(&time_s, &did, &asked, true).map(|s| Step { by_s: -s.by_s, ..s });
    look("rotor.command", of_commands, 0.05);
    // A unit whose own clock steps does so against all others.
    let same = found.windows(2).all(|w| (w[0].1.by_s - w[1].1.by_s).abs() < 0.1);
    let others = found.iter().filter(|(channel, _)| *channel != "gnss.velocity_ned_m_s").count();
    let (channel, step) = found.first()?;
    let channel = if others >= 2 && same { "imu.omega_body_rad_s" } else { channel };
    let by_s = if others >= 2 && same { -step.by_s } else { step.by_s };
    let words = format!(
        "its clock steps by {by_s:+.2} s against the other sources at about {:.0} s; mend `time` of its source, or cut the flight there",
        step.at_s
    );
    Some((channel, words))
}

/// The step of the first against the second, if there is one: how much later the first comes after it.
///
/// * `balanced` - each axis counts alike, whatever its unit
fn step(time_s: &[f64], own: &[Vector3<f64>], other: &[Vector3<f64>], balanced: bool) -> Option<Step> {
    let (own, other) = (centred(own, balanced), centred(other, balanced));
    // Where a model has no finite answer, times are not known.
    if own.len() != time_s.len() || other.len() != time_s.len() {
        return None;
    }
    let (start_s, end_s) = (*time_s.first()?, *time_s.last()?);
    let block_s = BLOCK_S.max((end_s - start_s) / BLOCKS_MAX);
    let blocks = ((end_s - start_s) / block_s) as usize;
    if blocks < 2 * SIDE_MIN {
        return None;
    }
    let most = (SHIFT_MAX_S / SHIFT_STEP_S) as i32;
    let shifts = (2 * most + 1) as usize;
    // Of each block and shift: sums of own^2, other^2 and their product.
    let mut sums = vec![[0.0; 3]; blocks * shifts];
    let usual_s = (end_s - start_s) / time_s.len() as f64;
    for (slot, shift) in (-most..=most).enumerate() {
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
            let block = (((t - start_s) / block_s) as usize).min(blocks - 1);
            let sum = &mut sums[block * shifts + slot];
            sum[0] += x.norm_squared();
            sum[1] += y.norm_squared();
            sum[2] += x.dot(&y);
        }
    }
    let of = |blocks: std::ops::Range<usize>, slot: &dyn Fn(usize) -> i32| -> [f64; 3] {
        let mut total = [0.0; 3];
        for block in blocks {
            let place = (slot(block) + most).clamp(0, 2 * most) as usize;
            total.iter_mut().zip(sums[block * shifts + place]).for_each(|(total, sum)| *total += sum);
        }
        total
    };
    let fit = |s: [f64; 3]| if s[2] > 0.0 { s[2] * s[2] / (s[0] * s[1]).max(f64::MIN_POSITIVE) } else { 0.0 };
    let mut line = 0.0_f64;
    for ppm in (-SKEW_MAX_PPM..=SKEW_MAX_PPM).step_by(SKEW_STEP_PPM as usize) {
        let slope = f64::from(ppm) * 1e-6 * block_s / SHIFT_STEP_S;
        let run = |block: usize| (slope * (block as f64 - 0.5 * blocks as f64)).round() as i32;
        for shift in -most..=most {
            line = line.max(fit(of(0..blocks, &|block| shift + run(block))));
        }
    }
    let best_shift = |range: std::ops::Range<usize>| {
        let all = (-most..=most).map(|shift| (fit(of(range.clone(), &|_| shift)), shift));
        all.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, 0))
    };
    let (mut stepped, mut found) = (0.0, None);
    for cut in SIDE_MIN..=blocks - SIDE_MIN {
        let ((before, s0), (after, s1)) = (best_shift(0..cut), best_shift(cut..blocks));
        let both = fit(of(0..blocks, &|block| if block < cut { s0 } else { s1 }));
        if both > stepped {
            stepped = both;
            let sides = before.min(after);
            let is_right = |shift: i32| (RIGHT_S.0..=RIGHT_S.1).contains(&(f64::from(shift) * SHIFT_STEP_S));
            let sides = if is_right(s0) || is_right(s1) { sides } else { 0.0 };
            found = Some((sides, f64::from(s1 - s0) * SHIFT_STEP_S, start_s + cut as f64 * block_s));
        }
    }
    let (sides, by_s, at_s) = found?;
    let f = time_s.len() as f64 / SAMPLES_ALIKE * (stepped - line) / (1.0 - stepped).max(1e-6);
    let is_real = sides > MATCH * MATCH && f > F_MIN && 1.0 - stepped < LEFT_MAX * (1.0 - line);
    is_real.then_some(Step { by_s, at_s })
}

/// About the mean, in standard deviations of each axis or as it is.
fn centred(values: &[Vector3<f64>], balanced: bool) -> Vec<Vector3<f64>> {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<Vector3<f64>>() / n;
    let square = values.iter().map(|v| (v - mean).component_mul(&(v - mean))).sum::<Vector3<f64>>() / n;
    let scale = if balanced {
        square.map(|s| if s > 0.0 { s.sqrt().recip() } else { 0.0 })
    } else {
        Vector3::repeat(1.0)
    };
    values.iter().map(|v| (v - mean).component_mul(&scale)).collect()
}
