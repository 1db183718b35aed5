//! Flights that are given twice, whole or in part: a flight proves nothing about itself.

use crate::verdict::SetAside;
use squirrel_log::FlightLog;
use std::collections::HashMap;

const CHANNEL: &str = "imu.specific_force_body_m_s2";

/// What a flight is known again by: its name, and its samples to the bit.
pub(crate) type Known = (String, Vec<[u64; 6]>);

/// What flights are known again by.
pub(crate) fn known<'a>(flights: impl Iterator<Item = &'a (String, FlightLog)>) -> Vec<Known> {
    flights.map(|(name, log)| (name.clone(), rows(log))).collect()
}

/// The flights that repeat an earlier one of their list, or one of those of before.
pub(super) fn repeated<'a>(
    before: &[Known],
    flights: impl Iterator<Item = &'a (String, FlightLog)>,
) -> Vec<SetAside> {
    let flights = known(flights);
    let all: Vec<&Known> = before.iter().chain(&flights).collect();
    // The flights in which a row was until now.
    let mut holders: HashMap<&[u64; 6], Vec<usize>> = HashMap::new();
    let mut found: Vec<SetAside> = Vec::new();
    for (index, (name, own)) in all.iter().enumerate() {
        let mut same = vec![0; index];
        for row in own {
            for other in holders.get(row).into_iter().flatten() {
                same[*other] += 1;
            }
        }
        for row in own {
            let flights = holders.entry(row).or_default();
            if flights.last() != Some(&index) {
                flights.push(index);
            }
        }
        if index < before.len() {
            continue;
        }
        let earlier = (0..index).filter(|i| found.iter().all(|aside| aside.flight != all[*i].0));
        for (other, same) in earlier.map(|i| (i, same[i])).collect::<Vec<_>>() {
            // The shorter flight may lie in the longer one, whichever is given first.
            if 2 * same > own.len().min(all[other].1.len()) {
                let share = 100.0 * same as f64 / own.len() as f64;
                found.push(SetAside {
                    flight: name.clone(),
                    channel: CHANNEL,
                    words: format!(
                        "{name}: {CHANNEL}: {share:.0} % of its samples are those of {}; a flight proves nothing about itself",
                        all[other].0
                    ),
                });
                break;
            }
        }
    }
    found
}

/// What the inertial unit said, to the bit; without one, where the vehicle was and how it lay.
fn rows(log: &FlightLog) -> Vec<[u64; 6]> {
    let both = |first: &str, second: &str| Some((log.channel(first)?.1, log.channel(second)?.1));
    let poses = || both("gnss.position_ned_m", "gnss.velocity_ned_m_s");
    let Some((forces, rates)) = both(CHANNEL, "imu.omega_body_rad_s").or_else(poses) else {
        return Vec::new();
    };
    let pairs = forces.values.chunks_exact(3).zip(rates.values.chunks_exact(3));
    let rows = pairs.map(|(f, w)| [f[0], f[1], f[2], w[0], w[1], w[2]]);
    rows.filter(|row| row.iter().all(|x| x.is_finite())).map(|row| row.map(f64::to_bits)).collect()
}
