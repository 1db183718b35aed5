//! Whether the logs agree with themselves, before anything is said about forces.
//!
//! Each pair of sources that measure one motion is compared: gyroscope and attitude, accelerometer and GNSS, commands and
//! what the vehicle did. An axis that fits better under another sign or another name, a scale that is off by a unit, a time
//! shift that no latency explains, or a flight given twice is a problem of the data. Bounds lie far outside what any effect
//! of the catalogue does.

mod pairs;

use crate::GapError;
use crate::predictor::{Predictor, Segment, Track};
use nalgebra::{UnitQuaternion, Vector3};
use pairs::Pairs;
use squirrel_core::math::GRAVITY_M_S2;
use squirrel_sim::log::FlightLog;
use std::collections::HashSet;

/// What is wrong with a set of logs.
pub(crate) struct Problem {
    pub(crate) flight: String,
    pub(crate) channel: &'static str,
    /// One sentence.
    pub(crate) words: String,
}

/// Windows over which rates of attitude and of GNSS velocity are taken, s.
const ATTITUDE_WINDOW_S: f64 = 0.1;
const GNSS_WINDOW_S: f64 = 0.3;
/// Time shifts of commands and of GNSS that effects can explain, s.
const COMMAND_SHIFT_S: (f64, f64) = (-0.015, 0.13);
const GNSS_SHIFT_S: (f64, f64) = (-0.08, 0.5);
/// Shorter pieces of a flight than this are not checked by themselves, s.
const PIECE_S: f64 = 5.0;
/// Longest shift that is looked for, s.
const SHIFT_MAX_S: f64 = 1.0;

/// The first problem of the flights, if there is one.
///
/// * `nominal` - residual of `predictor`'s flights against the vehicle as it is
///
/// # Errors
/// What the predictor says.
pub(crate) fn problem(
    predictor: &Predictor,
    nominal: &[f64],
    unseen: Option<&Predictor>,
    flights: &[(String, FlightLog)],
    held_out: &[(String, FlightLog)],
) -> Result<Option<Problem>, GapError> {
    if let Some(problem) = repeated(flights, held_out) {
        return Ok(Some(problem));
    }
    let of_unseen = unseen.map(|unseen| unseen.residual(&unseen.nominal())).transpose()?;
    let others = unseen.zip(of_unseen.as_deref());
    for (predictor, residual) in std::iter::once((predictor, nominal)).chain(others) {
        for (piece, track) in predictor.tracks.iter().enumerate().filter(|(_, t)| is_long(predictor, t)) {
            let found = voltage(predictor, track)
                .or_else(|| force_unit(track))
                .or_else(|| rates(track))
                .or_else(|| track.has_accelerometer().then(|| fixes(track)).flatten())
                .or_else(|| model(predictor, piece, residual));
            if let Some((channel, words)) = found {
                let flight = predictor.names[track.flight].to_owned();
                let words = format!("{flight}: {channel}: {words}");
                return Ok(Some(Problem { flight, channel, words }));
            }
        }
    }
    Ok(None)
}

type Found = Option<(&'static str, String)>;

/// Whether a piece says something about a flight's data: a dash between two gaps is no mean of anything.
fn is_long(predictor: &Predictor, track: &Track) -> bool {
    let duration_s = |t: &Track| t.period_s * t.time_s.len() as f64;
    let others = predictor.tracks.iter().filter(|t| t.flight == track.flight);
    duration_s(track) >= PIECE_S.min(others.map(duration_s).fold(0.0, f64::max))
}

/// A flight that is given twice, whole or in part.
fn repeated(flights: &[(String, FlightLog)], held_out: &[(String, FlightLog)]) -> Option<Problem> {
    const CHANNEL: &str = "imu.specific_force_body_m_s2";
    let rows = |log: &FlightLog| -> Vec<[u64; 6]> {
        let Some((_, forces)) = log.channel(CHANNEL) else { return Vec::new() };
        let Some((_, rates)) = log.channel("imu.omega_body_rad_s") else { return Vec::new() };
        let pairs = forces.values.chunks_exact(3).zip(rates.values.chunks_exact(3));
        let rows = pairs.map(|(f, w)| [f[0], f[1], f[2], w[0], w[1], w[2]]);
        rows.filter(|row| row.iter().all(|x| x.is_finite())).map(|row| row.map(f64::to_bits)).collect()
    };
    let all: Vec<_> = flights.iter().chain(held_out).map(|(name, log)| (name, rows(log))).collect();
    for (index, (name, own)) in all.iter().enumerate() {
        let rows: HashSet<&[u64; 6]> = own.iter().collect();
        for (other, theirs) in &all[index + 1..] {
            let same = theirs.iter().filter(|row| rows.contains(*row)).count();
            // The shorter flight may lie in the longer one, whichever is given first.
            let least = own.len().min(theirs.len());
            if 2 * same > least {
                let share = 100.0 * same as f64 / theirs.len() as f64;
                return Some(Problem {
                    flight: (*other).clone(),
                    channel: CHANNEL,
                    words: format!(
                        "{other}: {CHANNEL}: {share:.0} % of its samples are those of {name}; a flight proves nothing about itself"
                    ),
                });
            }
        }
    }
    None
}

fn voltage(predictor: &Predictor, track: &Track) -> Found {
    let reference = predictor.vehicle.vehicle.parameters().propulsion.reference_voltage_v;
    let mean = track.voltage_v.iter().sum::<f64>() / track.voltage_v.len() as f64;
    let ratio = mean / reference;
    (!(0.5..1.6).contains(&ratio)).then(|| {
        (
            "battery.voltage_v",
            format!(
                "its mean is {mean:.3} V where the vehicle's reference is {reference} V; is it in volts?"
            ),
        )
    })
}

/// A flying vehicle feels its weight along -z on average.
fn force_unit(track: &Track) -> Found {
    let f = track.specific_force();
    let mean = f.iter().sum::<Vector3<f64>>() / f.len() as f64;
    let size = f.iter().map(Vector3::norm).sum::<f64>() / f.len() as f64;
    let channel = "imu.specific_force_body_m_s2";
    if !(0.5..2.0).contains(&(size / GRAVITY_M_S2)) {
        return Some((
            channel,
            format!("its mean size is {size:.3} m/s^2, must be near 9.81 in flight; is it in m/s^2?"),
        ));
    }
    if mean.z > -0.5 * size {
        return Some((
            channel,
            format!(
                "its mean is ({:.2}, {:.2}, {:.2}) m/s^2 where thrust points along -z; is it in the body frame, forward-right-down?",
                mean.x, mean.y, mean.z
            ),
        ));
    }
    None
}

/// Gyroscope against the rate of the attitude.
fn rates(track: &Track) -> Found {
    let attitude = track.attitude()?;
    let step = (ATTITUDE_WINDOW_S / track.period_s).round().max(1.0) as usize;
    let mut pairs = Pairs::default();
    for start in (0..attitude.len().saturating_sub(step)).step_by(step) {
        let [a, b] = [start, start + step].map(|k| UnitQuaternion::new_unchecked(attitude[k]));
        let turned = (a.inverse() * b).scaled_axis() / (step as f64 * track.period_s);
        let gyro = track.omega()[start..start + step].iter().sum::<Vector3<f64>>() / step as f64;
        pairs.push(gyro, turned);
    }
    let channel = "imu.omega_body_rad_s";
    if let Some(axes) = pairs.misnamed_axes(0.05) {
        return Some((channel, format!("fits the attitude's rate better with its axes as {axes}")));
    }
    let scale = pairs.scale()?;
    (!(0.6..1.7).contains(&scale))
        .then(|| (channel, format!("is {scale:.3e} times the attitude's rate; is it in rad/s?")))
}

/// Fixes against the accelerometer, and positions against velocities.
fn fixes(track: &Track) -> Found {
    let attitude = track.attitude()?;
    let channel = "gnss.velocity_ned_m_s";
    let velocity = track.velocity();
    let gravity = Vector3::new(0.0, 0.0, GRAVITY_M_S2);
    // Strapdown velocity, to be asked at any time.
    let mut strapdown = vec![Vector3::zeros()];
    for k in 1..attitude.len() {
        let a = UnitQuaternion::new_unchecked(attitude[k]) * track.specific_force()[k] + gravity;
        strapdown.push(strapdown[k - 1] + a * track.period_s);
    }
    let at = |t: f64| {
        let k = (t - track.time_s[0]) / track.period_s;
        (k >= 0.0 && (k as usize) + 1 < strapdown.len()).then(|| {
            let i = k as usize;
            strapdown[i] + (strapdown[i + 1] - strapdown[i]) * (k - i as f64)
        })
    };
    let mean = strapdown[strapdown.len() - 1] / (strapdown.len() as f64 * track.period_s);
    if mean.norm() > 3.0 {
        return Some((
            "attitude.q_ned_from_body_wxyz",
            format!(
                "turns the specific force into a mean acceleration of ({:.1}, {:.1}, {:.1}) m/s^2; is it body to NED?",
                mean.x, mean.y, mean.z
            ),
        ));
    }
    let pairs_at = |shift_s: f64| {
        let mut pairs = Pairs::default();
        let mut i = 0;
        for j in 0..velocity.len() {
            while velocity[j].0 - velocity[i].0 > GNSS_WINDOW_S + 1e-6 {
                i += 1;
            }
            let ((t0, v0), (t1, v1)) = (velocity[i], velocity[j]);
            if t1 - t0 > 0.5 * GNSS_WINDOW_S
                && let (Some(s0), Some(s1)) = (at(t0 - shift_s), at(t1 - shift_s))
            {
                pairs.push((v1 - v0) / (t1 - t0), (s1 - s0) / (t1 - t0));
            }
        }
        pairs
    };
    let shifts: Vec<f64> = (-10..=20).map(|i| f64::from(i) * 0.05).filter(|s| *s <= SHIFT_MAX_S).collect();
    let fit: Vec<f64> = shifts.iter().map(|s| pairs_at(*s).best_match(0.3)).collect();
    let best = (0..shifts.len()).max_by(|a, b| fit[*a].total_cmp(&fit[*b]))?;
    let pairs = pairs_at(shifts[best]);
    if let Some(axes) = pairs.misnamed_axes(0.3) {
        return Some((channel, format!("fits the accelerometer better with its axes as {axes}")));
    }
    if fit[best] > 0.6 && !(GNSS_SHIFT_S.0..=GNSS_SHIFT_S.1).contains(&shifts[best]) {
        return Some((
            channel,
            format!("fits the accelerometer best {:.2} s later than stamped", -shifts[best]),
        ));
    }
    if let Some(scale) = pairs.scale_if(0.6)
        && !(0.5..2.0).contains(&scale)
    {
        return Some((channel, format!("is {scale:.3e} times what the accelerometer gives; is it in m/s?")));
    }
    let mut moved = Pairs::default();
    let positions = track.position();
    for (a, b) in positions.iter().zip(positions.iter().skip(10)) {
        let from = velocity.partition_point(|(t, _)| *t < a.0);
        let until = velocity.partition_point(|(t, _)| *t <= b.0);
        if until > from && b.0 > a.0 {
            let mean =
                velocity[from..until].iter().map(|(_, v)| v).sum::<Vector3<f64>>() / (until - from) as f64;
            moved.push((b.1 - a.1) / (b.0 - a.0), mean);
        }
    }
    let channel = "gnss.position_ned_m";
    if let Some(axes) = moved.misnamed_axes(0.5) {
        return Some((channel, format!("fits the velocity better with its axes as {axes}")));
    }
    let scale = moved.scale_if(0.6)?;
    (!(0.5..2.0).contains(&scale))
        .then(|| (channel, format!("moves {scale:.3e} times as fast as the velocity says; is it in m?")))
}

/// What the vehicle did against what its commands ask for.
fn model(predictor: &Predictor, piece: usize, residual: &[f64]) -> Found {
    let track = &predictor.tracks[piece];
    let n = track.measured.len();
    let (forces, moments) =
        (pairs_of(predictor, piece, residual, 0), pairs_of(predictor, piece, residual, 3));
    let ratio = forces.mean_ratio_z();
    if !(0.4..2.5).contains(&ratio) {
        return Some((
            "rotor.command",
            format!(
                "asks for {:.3e} times the thrust that was felt; are its unit and the vehicle's `propulsion.command` the same?",
                1.0 / ratio
            ),
        ));
    }
    // A clock that runs off is late by more and more; what is late from the start is something else.
    let step_s = track.every as f64 * track.period_s;
    let outside =
        |(shift_s, fit): (f64, f64)| fit > 0.4 && !(COMMAND_SHIFT_S.0..=COMMAND_SHIFT_S.1).contains(&shift_s);
    let (shift_s, fit) = moments.best_shift(step_s, SHIFT_MAX_S);
    // Air that damps the rates makes moments look early; rates alone never make them look so.
    let undamped = moments.with_damping(&rates_of(track));
    if outside((shift_s, fit))
        && outside(moments.first((n / 4).max((10.0 / step_s) as usize)).best_shift(step_s, SHIFT_MAX_S))
        && (shift_s > 0.0 || outside(undamped.best_shift(step_s, SHIFT_MAX_S)))
    {
        let words = if shift_s < 0.0 {
            format!("acts {:.0} ms before it is given", -1e3 * shift_s)
        } else {
            format!("acts {:.0} ms after it is given, more than rotors and a link can be late", 1e3 * shift_s)
        };
        return Some(("rotor.command", words));
    }
    // Rotors may be late: each naming of the axes is taken where it fits best.
    if let Some(axes) = moments.misnamed_axes_late(0.5, (COMMAND_SHIFT_S.1 / step_s) as i64) {
        return Some((
            "rotor.command",
            format!(
                "explains the moments better with their axes as {axes}; is the order of rotors that of the vehicle file?"
            ),
        ));
    }
    let axes = forces.misnamed_axes(0.15)?;
    Some(("imu.specific_force_body_m_s2", format!("fits the model better with its axes as {axes}")))
}

/// Angular rates at the rows of the residual, rad/s.
fn rates_of(track: &Track) -> Vec<Vector3<f64>> {
    (0..track.measured.len()).map(|i| track.omega()[track.edge() + i * track.every]).collect()
}

/// Measured and predicted force or moment of a piece.
fn pairs_of(predictor: &Predictor, piece: usize, residual: &[f64], first: usize) -> Pairs {
    let mut pairs = Pairs::default();
    let segments: Vec<_> = predictor
        .segments
        .iter()
        .filter(|s| s.piece == piece && (first..first + 3).contains(&s.channel))
        .collect();
    let [x, y, z] = segments[..] else { return pairs };
    for (i, m) in predictor.tracks[piece].measured.iter().enumerate() {
        let measured = Vector3::from_fn(|axis, _| m[first + axis]);
        let left = |s: &Segment| residual[s.rows.start + i];
        let left = Vector3::new(left(x), left(y), left(z));
        pairs.push(measured, measured - left);
    }
    pairs
}

/// Correlation of roll and pitch with their commands, however late, below which the model says nothing about moments.
const MOMENT_FIT: f64 = 0.75;

/// Whether the vehicle file's moments have to do with the measured ones; where they do not, nothing is named from them.
pub(crate) fn moments_fit(predictor: &Predictor, residual: &[f64]) -> bool {
    let fits: Vec<f64> = predictor
        .tracks
        .iter()
        .enumerate()
        .filter(|(_, track)| track.measured.len() > 100)
        .map(|(piece, track)| {
            let step_s = track.every as f64 * track.period_s;
            let moments = pairs_of(predictor, piece, residual, 3);
            let undamped = moments.with_damping(&rates_of(track));
            moments.best_shift(step_s, 0.2).1.max(undamped.best_shift(step_s, 0.2).1)
        })
        .collect();
    fits.is_empty() || fits.iter().sum::<f64>() / fits.len() as f64 >= MOMENT_FIT
}
