//! Names beside a force or moment that each flight has for itself and that changes slowly, as of a
//! pack that warms up: not whatever is left of a channel is another effect.
//!
//! ```text
//! y = X theta + Z zeta + e      Z: 1, s, (3 s^2 - 1) / 2 along each flight, s = -1 .. 1, of each channel that is left with something
//! ```
//! A name stands if the flights ask for it beside `Z`, which takes from it whatever is as slow, and
//! if the two together leave nothing.

use super::column::Column;
use super::evidence::inner;
use super::linear::Linear;
use super::point::Member;
use super::refine::Scored;
use super::search::{Found, Search};
use super::{Naming, judge};
use crate::GapError;
use crate::predictor::{DYNAMIC, Predictor};
use std::rc::Rc;

/// Numbers of a flight and channel.
const TERMS: usize = 3;
/// How much larger than the rms of what is left each may be, one standard deviation.
const SIZE_TIMES: f64 = 2.0;

/// Whether flights ask for every name of an explanation beside what is slow, and nothing else is
/// left.
///
/// # Errors
/// What the predictor says.
pub(super) fn leaves_nothing_else(search: &Search<'_>, naming: &Naming) -> Result<bool, GapError> {
    let linear = Rc::new(with_slow(search.predictor, naming));
    let best = search.score(&linear, &naming.found.best.members)?;
    let without = search.without(&linear, &best)?;
    let is_asked_for = |(member, rest): (&Member, &Scored)| {
        best.log_evidence >= rest.log_evidence + search.needed(member)
    };
    if !(best.members.iter().zip(&without).all(is_asked_for) && search.is_off(&best)) {
        return Ok(false);
    }
    let null = Rc::clone(&naming.found.null);
    let beside = judge(search, Found { linear, null, best, without, beaten: None })?;
    Ok(!beside.leftover.is_real())
}

/// The linear model of an explanation with what is slow in the channels that are left with
/// something.
fn with_slow(predictor: &Predictor<'_>, naming: &Naming) -> Linear {
    let mut linear = (*naming.found.linear).clone();
    for (channel, _) in naming.leftover.excess.iter().filter(|(channel, _)| *channel < DYNAMIC) {
        for flight in 0..predictor.names.len() {
            for term in 0..TERMS {
                let (column, sd) = slow(predictor, flight, *channel, term, &naming.left);
                let column = Column::of(column);
                linear.columns.push(linear.whitener.apply_to(&predictor.segments, &column));
                linear.raw.push(column);
                linear.tolerance.push(sd);
                linear.point.base.push(0.0);
            }
        }
    }
    linear.gram = inner(&linear.columns.iter().collect::<Vec<_>>());
    linear
}

/// One slow term along one channel of one flight, and how large it may be, one standard deviation.
fn slow(
    predictor: &Predictor<'_>,
    flight: usize,
    channel: usize,
    term: usize,
    left: &[f64],
) -> (Vec<f64>, f64) {
    let mut column = vec![0.0; predictor.rows()];
    let own = || predictor.segments.iter().filter(|s| s.flight == flight && s.channel == channel);
    let end_s = |s: &crate::predictor::Segment| s.t0_s + s.rows.len() as f64 * s.step_s;
    let from_s = own().map(|s| s.t0_s).fold(f64::INFINITY, f64::min);
    let until_s = own().map(end_s).fold(f64::NEG_INFINITY, f64::max);
    let (mut sum, mut n) = (0.0, 0.0_f64);
    for segment in own() {
        for (i, row) in segment.rows.clone().enumerate() {
            let at_s = segment.t0_s + i as f64 * segment.step_s;
            let s = 2.0 * (at_s - from_s) / (until_s - from_s) - 1.0;
            column[row] = match term {
                0 => 1.0,
                1 => s,
                _ => 0.5 * (3.0 * s * s - 1.0),
            };
            sum += left[row] * left[row];
            n += 1.0;
        }
    }
    (column, SIZE_TIMES * (sum / n.max(1.0)).sqrt())
}
