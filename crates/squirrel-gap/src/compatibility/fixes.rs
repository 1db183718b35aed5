//! Fixes against accelerometer and attitude, and positions against velocities.

use super::Found;
use super::flight::{Flight, Strapdown};
use super::pairs::{Pairs, axes};
use nalgebra::{Quaternion, Vector3};

const FORCE: &str = "imu.specific_force_body_m_s2";
const VELOCITY: &str = "gnss.velocity_ned_m_s";
const POSITION: &str = "gnss.position_ned_m";
/// Time shifts of GNSS that effects can explain, and the longest that are looked for, s.
const SHIFT_S: (f64, f64) = (-0.08, 0.5);
const SHIFT_MAX_S: (f64, f64) = (-0.5, 1.0);
const SHIFT_STEP_S: f64 = 0.05;
/// How much better a shift that no effect explains must fit, in sums of three correlations.
const FAR_MARGIN: f64 = 0.3;
/// Smallest acceleration, m/s^2, and speed, m/s, that say something about axes.
const MOVES_M_S2: f64 = 0.1;
const MOVES_M_S: f64 = 0.5;
/// Correlation from which on a time shift is believed.
const MATCH: f64 = 0.6;
/// How much better the accelerometer must go with axes by position for the velocity to be wrong, in
/// correlations.
const POSITION_RIGHT: f64 = 0.3;
/// What one source may be of the other.
const SCALE: (f64, f64) = (0.5, 2.0);
/// Part of the misfit in the body frame that the world frame must leave at most, and how well its
/// axes must fit.
const WORLD_MOVES_M_S2: f64 = 0.2;
const WORLD_MISFIT: f64 = 0.25;
const WORLD_MATCH: f64 = 0.7;

/// How well fixes go with a strapdown, by the names of their axes and however late up to what
/// effects explain: the sum of correlations, and the shift, s.
pub(super) fn match_of(flight: &Flight, strapdown: &[Strapdown]) -> (f64, f64) {
    best(flight, strapdown, SHIFT_S, |pairs| pairs.own_match(MOVES_M_S2))
}

/// The best fit of a kind over shifts in time, and its shift, s.
fn best(
    flight: &Flight,
    strapdown: &[Strapdown],
    range_s: (f64, f64),
    fit: impl Fn(&Pairs) -> f64,
) -> (f64, f64) {
    let [first, last] = [range_s.0, range_s.1].map(|s| (s / SHIFT_STEP_S).round() as i32);
    let at = |i: i32| {
        let shift_s = f64::from(i) * SHIFT_STEP_S;
        (fit(&flight.accelerations(strapdown, shift_s).1), shift_s)
    };
    (first..=last).map(at).max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, 0.0))
}

/// Axes and frames of velocity and specific force.
pub(super) fn frames(flight: &Flight) -> Found {
    if !flight.has_attitude() {
        return None;
    }
    let strapdown = flight.strapdown(&|q| q);
    let (own, shift_s) = match_of(flight, &strapdown);
    let pairs = flight.accelerations(&strapdown, shift_s).1;
    if let Some(found) = world_frame(flight, &pairs, shift_s) {
        return Some(found);
    }
    // A quarter of a period of a circle looks like other axes: each naming has the shift that is
    // best for it.
    let named = |pairs: &Pairs| pairs.misnamed_beside(MOVES_M_S2, own).map_or(0.0, |(fit, _)| fit);
    let (_, shift_s) = best(flight, &strapdown, SHIFT_S, named);
    let (_, naming) =
        flight.accelerations(&strapdown, shift_s).1.misnamed_beside(MOVES_M_S2, own)?;
    let remedy = remedy_of(naming.map(|(axis, sign)| (axis, sign > 0.0)));
    let words =
        format!("fits the accelerometer better with its axes as {}; {remedy}", axes(naming));
    Some((VELOCITY, words))
}

/// Stamps and unit of velocity.
pub(super) fn velocities(flight: &Flight) -> Found {
    if !flight.has_attitude() {
        return None;
    }
    let strapdown = flight.strapdown(&|q| q);
    let (near, near_s) = match_of(flight, &strapdown);
    let (far, far_s) = best(flight, &strapdown, SHIFT_MAX_S, |pairs| pairs.own_match(MOVES_M_S2));
    let moving = flight.accelerations(&strapdown, far_s).1.moving(MOVES_M_S2).max(1) as f64;
    if far > MATCH * moving && far > near + FAR_MARGIN {
        let words = format!(
            "fits the accelerometer best {:.2} s later than stamped; see `offset_s` in `time` of its source",
            -far_s
        );
        return Some((VELOCITY, words));
    }
    let (low, high) = flight.accelerations(&strapdown, near_s).1.slope()?;
    (low > SCALE.1 || high < SCALE.0).then(|| {
        let remedy = scale_remedy(low, "m/s");
        (VELOCITY, format!("is {low:.3} to {high:.3} times what the accelerometer gives; {remedy}"))
    })
}

pub(super) fn positions(flight: &Flight) -> Found {
    let moved = flight.moved();
    if let Some((_, naming)) = moved.misnamed_axes(MOVES_M_S) {
        let remedy = remedy_of(naming.map(|(axis, sign)| (axis, sign > 0.0)));
        // Whoever goes with the accelerometer is right.
        let by_position = |v: &Vector3<f64>| Vector3::from_fn(|i, _| naming[i].1 * v[naming[i].0]);
        let strapdown = flight.strapdown(&|q| q);
        let fits = |turned: bool| {
            let turn = |own: &Vector3<f64>| if turned { by_position(own) } else { *own };
            let fit =
                |pairs: &Pairs| pairs.map(|own, other| (turn(own), *other)).own_match(MOVES_M_S2);
            best(flight, &strapdown, SHIFT_S, fit).0
        };
        let (channel, other) = if flight.has_attitude() && fits(true) > fits(false) + POSITION_RIGHT
        {
            (VELOCITY, "position")
        } else {
            (POSITION, "velocity")
        };
        return Some((
            channel,
            format!(
                "its axes are not those of the {other}, which fits better with them as {}; {remedy}",
                axes(naming)
            ),
        ));
    }
    let (low, high) = moved.slope()?;
    (low > SCALE.1 || high < SCALE.0).then(|| {
        let remedy = scale_remedy(low, "m");
        (
            POSITION,
            format!("moves {low:.3} to {high:.3} times as fast as the velocity says; {remedy}"),
        )
    })
}

/// Accelerations that are given in the world frame although they should be in the body's: they fit
/// without the attitude.
fn world_frame(flight: &Flight, body: &Pairs, shift_s: f64) -> Found {
    // Without an attitude the strapdown is the sum of the logged numbers themselves.
    let level = flight.strapdown(&|_| Quaternion::identity());
    let world = flight.accelerations(&level, shift_s).1;
    let flat = |v: &Vector3<f64>| Vector3::new(v.x, v.y, 0.0);
    // Forward-left-up numbers of an ENU or NWU world come with other names and signs.
    let named = world.map(|own, other| (flat(own), flat(other)));
    let r = named.significant(WORLD_MOVES_M_S2);
    let straight = r[0][0].abs() + r[1][1].abs();
    let crossed = r[0][1].abs() + r[1][0].abs();
    let swaps = crossed > straight;
    let moving = (0..2).filter(|i| r[*i][0] != 0.0 || r[*i][1] != 0.0).count();
    let fit = straight.max(crossed) / moving.max(1) as f64;
    let sign = |i: usize, j: usize| if r[i][j] < 0.0 { -1.0 } else { 1.0 };
    let world = named.map(|own, other| {
        let turned = if swaps {
            Vector3::new(sign(0, 1) * other.y, sign(1, 0) * other.x, 0.0)
        } else {
            Vector3::new(sign(0, 0) * other.x, sign(1, 1) * other.y, 0.0)
        };
        (*own, turned)
    });
    let body = body.map(|own, other| (flat(own), flat(other)));
    let is_world = fit > WORLD_MATCH && world.misfit() < WORLD_MISFIT * body.misfit();
    is_world.then(|| {
        let words = "is the acceleration in the world frame, not what the accelerometer felt in the body: it fits the fixes without the attitude; import the body's `columns = [...]`";
        (FORCE, words.to_owned())
    })
}

fn remedy_of(naming: [(usize, bool); 3]) -> String {
    let frame = match naming {
        [(1, true), (0, true), (2, false)] => {
            "`world = \"enu\"`, or \"ned\" where the map has that"
        }
        [(0, true), (1, false), (2, false)] => {
            "`world = \"nwu\"`, or \"ned\" where the map has that"
        }
        [(1, _), (0, _), (2, true)] => {
            "`world = \"enu\"` for \"nwu\" or the other way round, here or of the attitude, or the order of `columns = [...]`"
        }
        _ => "see `world`, and the order of `columns = [...]`",
    };
    frame.to_owned()
}

fn scale_remedy(times: f64, unit: &str) -> String {
    let of = |factor: f64| (0.5..2.0).contains(&(times / factor));
    if of(100.0) {
        format!("it is in hundredths of {unit}: `scale = 0.01`")
    } else if of(1000.0) {
        format!("it is in thousandths of {unit}: `scale = 0.001`")
    } else {
        format!("is it in {unit}? see `scale`")
    }
}
