//! Where the residual is: windows of one second, channel by channel, in units of what noise alone
//! would leave there.

use super::Place;
use crate::GapError;
use crate::leftover::{Moment, floor, moment};
use crate::predictor::{CHANNELS, DYNAMIC, Predictor};
use std::fmt::Write;

/// Places to report.
const PLACES: usize = 20;
/// Length of a window, s.
const WINDOW_S: f64 = 1.0;

/// The windows in which a residual stands out most above its noise, the worst first.
///
/// * `rows` - residual of the predictor's flights
///
/// # Errors
/// What the predictor says.
pub(crate) fn places(predictor: &Predictor, rows: &[f64]) -> Result<Vec<Place>, GapError> {
    let wind = predictor.wind_columns(&predictor.nominal())?;
    let draws = floor::draws(predictor, &wind, crate::predictor::TURBULENCE_M_S, 2);
    let mut total = [0.0; DYNAMIC];
    let mut all: Vec<(f64, Place)> = Vec::new();
    for segment in predictor.segments.iter().filter(|s| s.channel < DYNAMIC) {
        let x = &rows[segment.rows.clone()];
        let noise = draws.iter().map(|d| square(&d[segment.rows.clone()])).sum::<f64>()
            / draws.len() as f64;
        let noise = noise / x.len().max(1) as f64;
        let track = &predictor.tracks[segment.piece];
        let motion = &predictor.plain()[segment.piece];
        let size = (WINDOW_S / segment.step_s).round().max(1.0) as usize;
        for (i, window) in x.chunks(size).enumerate().filter(|(_, w)| 2 * w.len() > size) {
            let sum = square(window);
            total[segment.channel] += sum;
            let t0_s = segment.t0_s + (i * size) as f64 * segment.step_s;
            let at = moment(predictor, track, motion, i * size, window.len());
            let times = (sum / window.len() as f64 / noise.max(f64::MIN_POSITIVE)).sqrt();
            all.push((
                times,
                Place {
                    flight: predictor.names[segment.flight].to_owned(),
                    t0_s,
                    t1_s: t0_s + window.len() as f64 * segment.step_s,
                    channel: CHANNELS[segment.channel],
                    condition: condition(predictor, &at),
                    share: sum,
                    noise: times,
                },
            ));
        }
    }
    // The sort is stable: equals keep the order of flight, channel and time.
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let share = |mut place: Place| {
        let channel = CHANNELS.iter().position(|c| *c == place.channel).unwrap_or(0);
        place.share /= total[channel].max(f64::MIN_POSITIVE);
        place
    };
    Ok(all.into_iter().take(PLACES).map(|(_, place)| share(place)).collect())
}

fn square(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum()
}

/// How the vehicle flew: `speed 1.2 m/s, climb 0.0 m/s, tilt 4 deg, ...`, as far as it is logged.
fn condition(predictor: &Predictor, at: &Moment) -> String {
    let mut text = format!("throttle {:.2}", at.throttle);
    // Adding zero turns -0.0 into 0.0.
    let mut part = |is_logged: bool, name: &str, value: f64, digits: usize, unit: &str| {
        if is_logged {
            let scale = 10_f64.powf(digits as f64);
            let _ =
                write!(text, ", {name}{:.digits$}{unit}", (value * scale).round() / scale + 0.0);
        }
    };
    let moves = predictor.has_motion();
    part(moves, "speed ", at.velocity_ned.norm(), 1, " m/s");
    part(moves, "climb ", -at.velocity_ned.z, 1, " m/s");
    part(moves, "tilt ", at.ned_from_body[(2, 2)].clamp(-1.0, 1.0).acos().to_degrees(), 0, " deg");
    part(predictor.has_height(), "height ", -at.position.z, 1, " m");
    part(true, "yaw rate ", at.omega.z.to_degrees(), 0, " deg/s");
    part(predictor.has_wings(), "wings ", at.wings, 2, "");
    part(predictor.has_voltage(), "", at.voltage_v, 2, " V");
    text
}
