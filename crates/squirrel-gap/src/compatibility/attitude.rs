//! Gyroscope against attitude, and attitude against gravity: whose axes, frame, order or direction
//! is wrong.
//!
//! Each way in which a map can misread a quaternion is taken back and held against three things at
//! once: the gyroscope, the weight, which the specific force turned into the world must cancel, and
//! the fixes. A mistake of the attitude mends all three; one of the gyroscope leaves the other two
//! as they are.

use super::Found;
use super::fixes::match_of;
use super::flight::{Flight, Turn};
use super::pairs::{Pairs, axes};
use nalgebra::Quaternion;
use std::f64::consts::FRAC_1_SQRT_2;

const OMEGA: &str = "imu.omega_body_rad_s";
const ATTITUDE: &str = "attitude.q_ned_from_body_wxyz";
/// Slowest rates that say something about axes, rad/s.
const MOVES_RAD_S: f64 = 0.05;
/// Largest mean acceleration of a flight, m/s^2.
const MEAN_MAX_M_S2: f64 = 3.0;
/// What a mean acceleration above it counts for, in correlations.
const FALLS: f64 = 3.0;
/// Where two explanations are as good, that of the attitude must be better by this much.
const MARGIN: f64 = 0.3;
/// What the gyroscope may be of the attitude's rate.
const SCALE: (f64, f64) = (0.6, 1.7);

pub(super) fn rates(flight: &Flight) -> Found {
    if !flight.has_attitude() {
        return None;
    }
    let as_logged = |q: Quaternion<f64>| q;
    let (_, pairs) = flight.rates(&as_logged);
    let misnamed = pairs.misnamed_axes(MOVES_RAD_S);
    let mean = Flight::mean_acceleration(&flight.strapdown(&as_logged));
    if misnamed.is_some() || mean.norm() > MEAN_MAX_M_S2 {
        let now = worth(flight, &as_logged);
        let of_gyro = misnamed.map_or(now, |(fit, _)| now - pairs.own_match(MOVES_RAD_S) + fit);
        // Whoever mixes up columns or frames of a gyroscope gets no other signs than these.
        let is_odd = misnamed.is_some_and(|(_, naming)| {
            !(naming.iter().all(|(_, sign)| *sign > 0.0) || axes(naming) == "(x, -y, -z)")
        });
        // Mistakes are in the order in which they are made most; a later one must be better.
        let mut best: Option<(f64, String)> = None;
        for mistake in mistakes() {
            let worth = worth(flight, &*mistake.turn);
            if best.as_ref().is_none_or(|(before, _)| worth > before + MARGIN) {
                best = Some((worth, mistake.words));
            }
        }
        let least = of_gyro + if is_odd { -MARGIN } else { MARGIN };
        if let Some((_, words)) =
            best.filter(|(worth, _)| *worth > least && *worth > now + 2.0 * MARGIN)
        {
            return Some((ATTITUDE, words));
        }
        if let Some((_, naming)) = misnamed {
            let remedy = if axes(naming) == "(x, -y, -z)" {
                "give its body frame: `body = \"flu\"`, or `\"frd\"` where the map has that"
                    .to_owned()
            } else {
                "put `columns = [...]` into that order".to_owned()
            };
            let words = format!(
                "fits the attitude's rate better with its axes as {}; {remedy}",
                axes(naming)
            );
            return Some((OMEGA, words));
        }
        return Some((
            ATTITUDE,
            format!(
                "turns the specific force into a mean acceleration of ({:.1}, {:.1}, {:.1}) m/s^2; see `world`, `body`, `order` and `direction`",
                mean.x, mean.y, mean.z
            ),
        ));
    }
    let (low, high) = pairs.slope()?;
    (low > SCALE.1 || high < SCALE.0).then(|| {
        let remedy = if low <= 75.0 && high >= 40.0 {
            "it is in deg/s: `scale = 0.017453292519943295`"
        } else {
            "is it in rad/s? see `scale`"
        };
        (OMEGA, format!("is {low:.3} to {high:.3} times the attitude's rate; {remedy}"))
    })
}

/// How well an attitude goes with gyroscope, weight and fixes: sums of correlations.
fn worth(flight: &Flight, turn: Turn) -> f64 {
    let (_, pairs): (_, Pairs) = flight.rates(turn);
    let strapdown = flight.strapdown(turn);
    let falls = Flight::mean_acceleration(&strapdown).norm() > MEAN_MAX_M_S2;
    pairs.own_match(MOVES_RAD_S) + match_of(flight, &strapdown).0 - if falls { FALLS } else { 0.0 }
}

/// A way to misread a quaternion.
struct Mistake {
    words: String,
    turn: Box<dyn Fn(Quaternion<f64>) -> Quaternion<f64>>,
}

/// Name of a frame, and the rotation that takes it in.
type Frame = (&'static str, Quaternion<f64>);

/// The frames that maps know, as in the import: NED from the world, and the body from FRD.
fn frames() -> ([Frame; 3], [Frame; 2]) {
    let half = Quaternion::new(0.0, 1.0, 0.0, 0.0);
    let enu = Quaternion::new(0.0, FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0);
    let none = Quaternion::identity();
    ([("ned", none), ("nwu", half), ("enu", enu)], [("frd", none), ("flu", half)])
}

fn mistakes() -> Vec<Mistake> {
    let (worlds, bodies) = frames();
    let mut all = Vec::new();
    let mut push = |words: String, turn: Box<dyn Fn(Quaternion<f64>) -> Quaternion<f64>>| {
        all.push(Mistake { words, turn });
    };
    for (has, w) in worlds {
        for (is, v) in worlds.iter().copied().filter(|(is, _)| *is != has) {
            let words = format!(
                "is in another world frame: `world = \"{is}\"` where the map has \"{has}\""
            );
            push(words, Box::new(move |q| v * w.conjugate() * q));
        }
    }
    let [(_, frd), (_, flu)] = bodies;
    let body = "is of another body frame: `body = \"flu\"` where the map has \"frd\", or the other way round";
    push(body.to_owned(), Box::new(move |q| q * frd * flu));
    for (has, w) in worlds {
        for (is, v) in worlds.iter().copied().filter(|(is, _)| *is != has) {
            let words = format!(
                "is in other frames: `world = \"{is}\"` where the map has \"{has}\", and `body = \"flu\"` for \"frd\" or the other way round"
            );
            push(words, Box::new(move |q| v * w.conjugate() * q * flu));
        }
    }
    let in_file =
        |change: fn(Quaternion<f64>) -> Quaternion<f64>, w: Quaternion<f64>, b: Quaternion<f64>| {
            Box::new(move |q: Quaternion<f64>| w * change(w.conjugate() * q * b.conjugate()) * b)
        };
    let direction =
        "turns the other way: change `direction` (`world_from_body` or `body_from_world`)";
    let order = "has its numbers in another order: change `order` (`wxyz` or `xyzw`)";
    // What the file had is not known any more, so the frames of the map are tried, too.
    for (_, w) in worlds {
        for (_, b) in bodies {
            push(direction.to_owned(), in_file(|q| q.conjugate(), w, b));
        }
    }
    let orders: [fn(Quaternion<f64>) -> Quaternion<f64>; 4] = [
        |q| Quaternion::new(q.k, q.w, q.i, q.j),
        |q| Quaternion::new(q.i, q.j, q.k, q.w),
        // The same where the map turns the file's quaternion round.
        |q| Quaternion::new(q.k, q.w, -q.i, -q.j),
        |q| Quaternion::new(-q.i, q.j, q.k, -q.w),
    ];
    for change in orders {
        for (_, w) in worlds {
            for (_, b) in bodies {
                push(order.to_owned(), in_file(change, w, b));
            }
        }
    }
    all
}
