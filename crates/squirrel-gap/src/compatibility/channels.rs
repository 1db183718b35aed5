//! What each channel of a log is worth by itself: rate, gaps, held samples, and commands at their
//! ends.

use super::held::Repeats;
use crate::checked::ChannelCheck;
use crate::flight::series::Span;
use squirrel_core::vehicle::{CommandKind, Propulsion};
use squirrel_log::FlightLog;

/// Part of the range of a rotor's speed that counts as its end.
const END: f64 = 1e-3;

/// Every channel of some sources, by name.
pub(crate) fn channels(log: &FlightLog, sources: &[&str]) -> Vec<ChannelCheck> {
    let mut all = Vec::new();
    for (name, source) in log.sources.iter().filter(|(name, _)| sources.contains(&name.as_str())) {
        let time_s = &source.time_s;
        let mut steps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let largest = (0..steps.len()).max_by(|a, b| steps[*a].total_cmp(&steps[*b]));
        let (gap_s, at_s) = largest.map_or((0.0, 0.0), |i| (steps[i], time_s[i]));
        steps.sort_unstable_by(f64::total_cmp);
        let rate_hz =
            steps.get(steps.len() / 2).filter(|step| **step > 0.0).map_or(0.0, |s| 1.0 / s);
        for (short, channel) in &source.channels {
            let name = format!("{name}.{short}");
            let repeats = Repeats::counted(log, &name, &[(f64::NEG_INFINITY, f64::INFINITY)]);
            let (held, run_s) = repeats
                .filter(|_| time_s.len() > 1)
                .map_or((0.0, 0.0), |found| (1.0 - found.fresh(), found.run.1 - found.run.0));
            let missing = (0..time_s.len()).filter(|i| channel.row(*i).iter().any(|x| x.is_nan()));
            all.push(ChannelCheck {
                channel: name,
                samples: time_s.len(),
                rate_hz,
                largest_gap_s: gap_s,
                largest_gap_at_s: at_s,
                held_share: held,
                longest_held_s: run_s,
                missing_share: missing.count() as f64 / time_s.len().max(1) as f64,
            });
        }
    }
    all
}

/// Part of the commands in some spans of a flight, by rotor, that ask for no speed or for all of it;
/// empty without commands.
pub(crate) fn saturation(
    log: &FlightLog,
    propulsion: &Propulsion<f64>,
    spans: &[Span],
) -> Vec<f64> {
    let Some((time_s, commands)) = log.channel("rotor.command") else { return Vec::new() };
    let most = match propulsion.command {
        CommandKind::ThrustNewton => propulsion.speed_max_rad_s,
        _ => propulsion.target_speed_rad_s(f64::MAX),
    };
    let (mut ends, mut samples) = (vec![0.0_f64; commands.width], 0.0_f64);
    for (i, t) in time_s.iter().enumerate() {
        if !spans.iter().any(|(from, until)| (*from..=*until).contains(t)) {
            continue;
        }
        samples += 1.0;
        for (ends, command) in ends.iter_mut().zip(commands.row(i)) {
            let part = propulsion.target_speed_rad_s(*command) / most;
            *ends += f64::from(u8::from(part <= END || part >= 1.0 - END));
        }
    }
    ends.iter().map(|n| n / samples.max(1.0)).collect()
}
