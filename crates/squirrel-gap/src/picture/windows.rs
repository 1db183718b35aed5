//! The residual in windows of one second, in units of its noise, with what the vehicle did there.
//!
//! Noise of the dynamics is what sensors and the air's own motion leave behind the filters, drawn
//! as for the leftover; where gusts are the answer, theirs belongs to it after. Velocity drifts
//! from strapdown by what sensors add up to, so that its unit is the innovation of the
//! autoregression that the evidence whitens with.

use crate::GapError;
use crate::leftover::floor;
use crate::name::{Naming, Search, TURBULENCE_M_S};
use crate::predictor::{DYNAMIC, Predictor, TURNING};
use crate::report::FlightPanel;

/// Length of a window, s.
const WINDOW_S: f64 = 1.0;
/// Draws of the noise.
const DRAWS: usize = 2;

/// Sums by window.
#[derive(Clone, Default)]
struct Mean {
    sum: f64,
    count: f64,
}

/// Means by window on the clock of one flight.
struct Windows {
    start_s: f64,
    count: usize,
}

impl Windows {
    /// Means of what falls into each window, NaN where less than half as much does as into others.
    fn means(&self, values: impl Iterator<Item = (f64, f64)>) -> Vec<f64> {
        let mut all = vec![Mean::default(); self.count];
        for (time_s, value) in values {
            let window =
                (((time_s - self.start_s) / WINDOW_S).max(0.0) as usize).min(self.count - 1);
            all[window].sum += value;
            all[window].count += 1.0;
        }
        let full = all.iter().map(|m| m.count).fold(0.0, f64::max);
        let mean = |m: &Mean| if 2.0 * m.count > full { m.sum / m.count } else { f64::NAN };
        all.iter().map(mean).collect()
    }
}

/// One panel a flight.
///
/// # Errors
/// What the predictor says.
pub(super) fn panels(search: &Search<'_>, naming: &Naming) -> Result<Vec<FlightPanel>, GapError> {
    let predictor = search.predictor;
    let wind = predictor.wind_columns(&naming.hypothesis)?;
    let calm = noise(predictor, &wind, TURBULENCE_M_S);
    let own = naming.gust_m_s.map(|sigma| noise(predictor, &wind, sigma));
    let before = by_noise(predictor, naming, &naming.nominal, &calm);
    let after = by_noise(predictor, naming, &naming.left, own.as_ref().unwrap_or(&calm));
    let has_answer = naming.gust_m_s.is_some() || !naming.found.best.members.is_empty();
    Ok((0..predictor.names.len())
        .filter_map(|flight| {
            let windows = windows(predictor, flight)?;
            let has_fixes = predictor.has_channel(DYNAMIC);
            let channels = if has_fixes { TURNING } else { DYNAMIC };
            let rows = |all: &[Vec<(f64, f64)>]| -> Vec<Vec<f64>> {
                let row = |channel| {
                    let segments = predictor.segments.iter().zip(all);
                    let own = segments.filter(|(s, _)| s.flight == flight && s.channel == channel);
                    let means = windows.means(own.flat_map(|(_, points)| points.iter().copied()));
                    means.into_iter().map(f64::sqrt).collect()
                };
                (0..channels).map(row).collect()
            };
            let strip = |is_logged: bool, of: &dyn Fn(usize, usize) -> f64| -> Vec<f64> {
                if !is_logged {
                    return Vec::new();
                }
                let tracks =
                    predictor.tracks.iter().enumerate().filter(|(_, t)| t.flight == flight);
                windows.means(tracks.flat_map(|(piece, track)| {
                    let at = move |i| track.edge() + i * track.every;
                    (0..track.measured.len()).map(move |i| (track.time_s[at(i)], of(piece, at(i))))
                }))
            };
            let body = |piece: usize, k: usize| &predictor.plain()[piece].body[k];
            let time_s = |piece: usize, k: usize| predictor.tracks[piece].time_s[k];
            Some(FlightPanel {
                name: predictor.names[flight].to_owned(),
                start_s: windows.start_s,
                window_s: WINDOW_S,
                before: rows(&before),
                after: if has_answer { rows(&after) } else { Vec::new() },
                speed_m_s: strip(predictor.has_motion(), &|p, k| body(p, k).velocity.vector.norm()),
                height_m: strip(predictor.has_height(), &|p, k| -body(p, k).position.vector.z),
                wings: strip(predictor.has_wings(), &|p, k| {
                    predictor.commanded(flight, time_s(p, k)).1
                }),
            })
        })
        .collect())
}

fn windows(predictor: &Predictor, flight: usize) -> Option<Windows> {
    let own = || predictor.segments.iter().filter(|s| s.flight == flight && !s.rows.is_empty());
    let start_s = own().map(|s| s.t0_s).min_by(f64::total_cmp)?;
    let end_s = own().map(|s| s.t0_s + s.rows.len() as f64 * s.step_s).max_by(f64::total_cmp)?;
    let count = ((end_s - start_s) / WINDOW_S).ceil().max(1.0) as usize;
    Some(Windows { start_s, count })
}

/// Mean square of the noise of each segment.
fn noise(predictor: &Predictor, wind: &[Vec<f64>; 3], turbulence_m_s: f64) -> Vec<f64> {
    let draws = floor::draws(predictor, wind, turbulence_m_s, DRAWS);
    let square = |rows: &[f64]| rows.iter().map(|x| x * x).sum::<f64>() / rows.len() as f64;
    let mean =
        |rows: &std::ops::Range<usize>| draws.iter().map(|d| square(&d[rows.clone()])).sum::<f64>();
    predictor.segments.iter().map(|s| mean(&s.rows) / DRAWS as f64).collect()
}

/// By segment: time, s, and squared residual over that of its noise.
fn by_noise(
    predictor: &Predictor,
    naming: &Naming,
    rows: &[f64],
    noise: &[f64],
) -> Vec<Vec<(f64, f64)>> {
    let segments = predictor.segments.iter().zip(noise);
    segments
        .map(|(segment, noise)| {
            let scaled: Vec<f64> = if segment.channel < DYNAMIC {
                rows[segment.rows.clone()].iter().map(|x| x * x / noise).collect()
            } else {
                let white = naming.found.linear.whitener.apply(std::slice::from_ref(segment), rows);
                white.into_iter().map(|x| x * x).collect()
            };
            // Whitening loses the first rows of a segment.
            let lost = segment.rows.len() - scaled.len();
            let time_s = |i: usize| segment.t0_s + (lost + i) as f64 * segment.step_s;
            scaled.into_iter().enumerate().map(|(i, x)| (time_s(i), x)).collect()
        })
        .collect()
}
