//! When wings opened: the instants that one wants to look at.

use super::track::{Clock, Track};
use serde::Serialize;

/// An instant worth a look.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Moment {
    /// `folded`, `opening` or `open`.
    pub what: &'static str,
    /// s of the log.
    pub time_s: f64,
    /// Mean deployment of both wings then.
    pub deployment: f64,
}

const FOLDED: f64 = 0.02;
const OPEN: f64 = 0.95;

/// The last instant at which wings were folded, the one at which they were nearest to half open,
/// and the first at which they were open, for each time that they opened.
pub(super) fn moments(deployment: &Track, clock: Clock) -> Vec<Moment> {
    let rows = deployment.rows();
    let mean: Vec<f64> =
        rows.iter().map(|row| row.iter().sum::<f64>() / row.len() as f64).collect();
    let moment = |what, k: usize| Moment { what, time_s: clock.time_s(k), deployment: mean[k] };
    let (mut found, mut folded, mut open) = (Vec::new(), None, false);
    for (k, share) in mean.iter().enumerate() {
        if *share <= FOLDED {
            (folded, open) = (Some(k), false);
        } else if *share >= OPEN && !open {
            open = true;
            if let Some(folded) = folded.take() {
                let off = |k: &usize| (mean[*k] - 0.5).abs();
                let half = (folded + 1..k).min_by(|a, b| off(a).total_cmp(&off(b)));
                found.push(moment("folded", folded));
                found.extend(half.map(|half| moment("opening", half)));
                found.push(moment("open", k));
            } else if found.is_empty() {
                // Open from the first instant on.
                found.push(moment("open", k));
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::track::{Between, Kind};

    fn of(shares: &[f64]) -> Vec<(&'static str, f64)> {
        let clock = Clock { begin_s: 10.0, rate_hz: 10.0, count: shares.len() };
        let times: Vec<f64> = (0..shares.len()).map(|k| clock.time_s(k)).collect();
        let kind = Kind { width: None, step: 1e-3, between: Between::Line };
        let row = |i: usize| vec![shares[i]; 2];
        let track = Track::from_rows("wing.deployment", &times, row, 2, (kind, clock)).unwrap();
        moments(&track, clock).iter().map(|m| (m.what, m.time_s)).collect()
    }

    #[test]
    fn each_opening_has_its_three_instants() {
        let twice = of(&[0.0, 0.0, 0.2, 0.6, 1.0, 1.0, 0.5, 0.0, 0.96]);
        let first = [("folded", 10.1), ("opening", 10.3), ("open", 10.4)];
        assert_eq!(twice[..3], first);
        assert_eq!(twice[3..], [("folded", 10.7), ("open", 10.8)], "nothing between two instants");
    }

    #[test]
    fn wings_that_never_open_or_never_fold_have_no_three() {
        assert_eq!(of(&[0.0, 0.4, 0.0]), []);
        assert_eq!(of(&[1.0, 1.0]), [("open", 10.0)]);
        assert_eq!(of(&[0.5, 1.0, 0.5, 1.0]), [("open", 10.1)], "not folded in between");
    }
}
