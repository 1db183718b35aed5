//! Which parts of long flights are looked at: a model that is wrong by a hundredth is not known
//! better from an hour than from some minutes, but an hour costs an hour's time.
//!
//! Half of the time is spread evenly, so that slow things show, half goes to where the vehicle
//! moves most, where most shows.

use crate::flight::recording::Recording;
use crate::flight::series::Span;
use nalgebra::Vector3;

/// Length of a window, s.
const WINDOW_S: f64 = 20.0;

/// The spans of a flight that are looked at, in order, at most about a time in all.
pub(super) fn spread(recording: &Recording<'_>, limit_s: f64) -> Vec<Span> {
    let total_s: f64 = recording.pieces.iter().map(|(start, end)| end - start).sum();
    if total_s <= limit_s {
        return recording.pieces.clone();
    }
    let windows: Vec<Span> = recording.pieces.iter().flat_map(|piece| cut(*piece)).collect();
    let moves: Vec<f64> = windows.iter().map(|window| movement(recording, *window)).collect();
    let wanted = ((limit_s / WINDOW_S).round() as usize).clamp(1, windows.len());
    let even = wanted.div_ceil(2);
    let mut chosen = vec![false; windows.len()];
    for i in 0..even {
        chosen[(2 * i + 1) * windows.len() / (2 * even)] = true;
    }
    let mut rest: Vec<usize> = (0..windows.len()).filter(|i| !chosen[*i]).collect();
    rest.sort_by(|a, b| moves[*b].total_cmp(&moves[*a]));
    for i in rest.into_iter().take(wanted - even) {
        chosen[i] = true;
    }
    let mut spans: Vec<Span> = Vec::new();
    for (window, _) in windows.iter().zip(chosen).filter(|(_, chosen)| *chosen) {
        match spans.last_mut() {
            Some(last) if last.1 == window.0 => last.1 = window.1,
            _ => spans.push(*window),
        }
    }
    spans
}

/// A piece in windows of about one length.
fn cut((start_s, end_s): Span) -> impl Iterator<Item = Span> {
    let n = ((end_s - start_s) / WINDOW_S).round().max(1.0);
    let at = move |i: usize| {
        if i as f64 == n { end_s } else { start_s + (end_s - start_s) * i as f64 / n }
    };
    (0..n as usize).map(move |i| (at(i), at(i + 1)))
}

/// How much the vehicle moves in a window: variances of specific force and angular rate, each over
/// its noise's.
fn movement(recording: &Recording<'_>, (start_s, end_s): Span) -> f64 {
    /// Often enough for how much, s.
    const STEP_S: f64 = 0.05;
    let [force_noise, rate_noise] =
        recording.imu_noise.map(|noise| noise.norm_squared().max(1e-12));
    let n = ((end_s - start_s) / STEP_S).max(1.0) as usize;
    let samples = (0..n).map(|i| recording.sample(start_s + i as f64 * STEP_S));
    let (force, rate): (Vec<_>, Vec<_>) =
        samples.map(|sample| (sample.specific_force, sample.body.omega.vector)).unzip();
    variance(&force) / force_noise + variance(&rate) / rate_noise
}

fn variance(x: &[Vector3<f64>]) -> f64 {
    let mean = x.iter().sum::<Vector3<f64>>() / x.len() as f64;
    x.iter().map(|x| (x - mean).norm_squared()).sum::<f64>() / x.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_tile_a_piece() {
        let windows: Vec<Span> = cut((3.0, 112.0)).collect();
        assert_eq!(windows.len(), 5);
        assert_eq!((windows[0].0, windows[4].1), (3.0, 112.0));
        assert!(windows.windows(2).all(|pair| pair[0].1 == pair[1].0));
        assert_eq!(cut((0.0, 4.0)).collect::<Vec<_>>(), [(0.0, 4.0)]);
    }
}
