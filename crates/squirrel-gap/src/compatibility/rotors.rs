//! What the vehicle did against what its commands ask for: thrust, timing, and the order of rotors.
//!
//! ```text
//! a_axis = sum_i B_axis,i T_i      B = J^-1 [-y_i, x_i, s_i k_m / k_f],  T_i: thrust of a command behind the rotor's lag
//! ```
//! An order of rotors only permutes the columns of `B`, so all orders follow from one set of
//! covariances.

use super::Found;
use super::flight::Flight;
use super::pairs::axes;
use nalgebra::{Matrix3, Vector3, Vector6};
use squirrel_core::vehicle::MAX_ROTORS;

const COMMAND: &str = "rotor.command";
const FORCE: &str = "imu.specific_force_body_m_s2";
/// Thrust that was felt over thrust that was asked for: a data sheet and an empty battery make 2 of
/// 1.
const THRUST: (f64, f64) = (0.33, 3.0);
/// The same of their changes.
const THRUST_CHANGE: (f64, f64) = (0.2, 5.0);
/// Time shifts of commands that effects can explain, and the longest that is looked for, s.
const SHIFT_S: (f64, f64) = (-0.015, 0.13);
const SHIFT_MAX_S: f64 = 1.0;
/// Correlation from which on a time shift is believed.
const MATCH: f64 = 0.4;
/// The same of what is quick, which is mostly noise of the gyroscope.
const QUICK_MATCH: f64 = 0.25;
/// Smallest changes of specific force that say something about axes, m/s^2.
const MOVES_M_S2: f64 = 0.15;
/// An order of rotors is wrong where another one fits better by so many standard deviations of what
/// chance does, and where its own fits at most by this part as well.
const ORDER_SD: f64 = 4.0;
const ORDER_SHARE: f64 = 0.75;
/// The first of what is quick: 10 to 20 in measured flights with two motors swapped, up to 5 in calm
/// flights of a machine whose file lacks a large moment.
const QUICK_ORDER_SD: f64 = 7.0;

/// Sum of three correlations from which on the attitude says that the gyroscope's axes are right.
const GYRO_MATCH: f64 = 1.5;

pub(super) fn model(flight: &Flight, residual: &[f64]) -> Found {
    let (forces, moments) = (flight.predicted(residual, 0), flight.predicted(residual, 3));
    let n = moments.len();
    let ratio = forces.mean_ratio_z();
    if !(THRUST.0..THRUST.1).contains(&ratio) {
        return Some((
            COMMAND,
            format!(
                "asks for {:.3e} times the thrust that was felt; see `scale` in the map and `propulsion.command` of the vehicle",
                1.0 / ratio
            ),
        ));
    }
    let step_s = flight.step_s();
    // A file may say more of a lag than there is: what acts before its model does may still act
    // after it is given.
    let earliest_s = SHIFT_S.0 - flight.stated_delay_s();
    // A clock that runs off is late by more and more; what is late from the start is something
    // else.
    let outside =
        |(shift_s, fit): (f64, f64)| fit > MATCH && !(earliest_s..=SHIFT_S.1).contains(&shift_s);
    let (shift_s, fit) = moments.best_shift(step_s, SHIFT_MAX_S);
    // Air that damps the rates makes moments look early; rates alone never make them look so.
    let undamped = moments.with_damping(&flight.omega());
    // Beside a large moment that the file lacks, what is slow goes with itself at other times.
    let quick_is_right = || {
        let (shift_s, fit) = moments.changes().best_shift(step_s, SHIFT_MAX_S);
        fit >= QUICK_MATCH && (earliest_s..=SHIFT_S.1).contains(&shift_s)
    };
    if outside((shift_s, fit))
        && outside(
            moments.first((n / 4).max((10.0 / step_s) as usize)).best_shift(step_s, SHIFT_MAX_S),
        )
        && (shift_s > 0.0 || outside(undamped.best_shift(step_s, SHIFT_MAX_S)))
        && !quick_is_right()
    {
        let words = if shift_s < 0.0 {
            format!(
                "acts {:.0} ms before it is given; see `offset_s` in `time` of its source",
                -1e3 * shift_s
            )
        } else {
            format!(
                "acts {:.0} ms after it is given, more than rotors and a link can be late; see `offset_s` in `time` of its source",
                1e3 * shift_s
            )
        };
        return Some((COMMAND, words));
    }
    if let Some(found) = order(flight) {
        return Some(found);
    }
    if let Some((_, naming)) = forces.misnamed_axes(MOVES_M_S2) {
        let words = format!(
            "fits the model better with its axes as {}; see `columns` and `body`",
            axes(naming)
        );
        return Some((FORCE, words));
    }
    let along_z =
        forces.map(|own, other| (Vector3::new(0.0, 0.0, own.z), Vector3::new(0.0, 0.0, other.z)));
    let (low, high) = along_z.slope()?;
    (low > THRUST_CHANGE.1 || high < THRUST_CHANGE.0).then(|| {
        let words = format!(
            "changes thrust by {:.2e} to {:.2e} of what is felt; see `scale` and `offset` in the map and `propulsion.command` of the vehicle",
            1.0 / high,
            1.0 / low
        );
        (COMMAND, words)
    })
}

/// Another order of rotors that explains the angular acceleration much better.
fn order(flight: &Flight) -> Found {
    let count = flight.vehicle().parameters().rotor_count;
    let sums = Sums::new(flight, false)?;
    let most = (SHIFT_S.1 / flight.step_s()) as usize;
    let levers = levers(flight);
    let score = |sums: &Sums, order: &[usize]| -> f64 {
        (0..=most).map(|late| sums.score(late, &levers, order)).fold(f64::NEG_INFINITY, f64::max)
    };
    let as_given: Vec<usize> = (0..count).collect();
    let is_wrong = |sums: &Sums, best: f64, sd: f64| {
        let own = score(sums, &as_given);
        best - own >= sd * sums.chance && own <= ORDER_SHARE * best
    };
    let (best, order) = orders(count)
        .into_iter()
        .map(|order| (score(&sums, &order), order))
        .max_by(|a, b| a.0.total_cmp(&b.0))?;
    if !is_wrong(&sums, best, ORDER_SD) {
        return None;
    }
    // Beside a weak rotor, what the others give for it swings with the thrust, and an order that
    // turns that into yaw fits better. What is quick must tell more plainly.
    let changes = Sums::new(flight, true)?;
    if !is_wrong(&changes, score(&changes, &order), QUICK_ORDER_SD) {
        return None;
    }
    // Slot `order[j]` of the log is rotor `j` of the vehicle; a map says which rotor each slot is.
    let mut rotors = vec![0; count];
    for (rotor, slot) in order.iter().enumerate() {
        rotors[*slot] = rotor + 1;
    }
    let gyro = if flight.has_attitude() && flight.rates(&|q| q).1.own_match(0.0) > GYRO_MATCH {
        ""
    } else {
        "; or the axes of imu.omega_body_rad_s are others, see its `columns` and `body`: no attitude tells"
    };
    Some((
        COMMAND,
        format!(
            "explains the moments better in another order: `rotors = {rotors:?}` where the map has 1 to {count} in order{gyro}"
        ),
    ))
}

/// Angular acceleration by the thrust of each rotor, and by its reaction.
fn levers(flight: &Flight) -> Vec<Vector3<f64>> {
    let p = flight.vehicle().parameters();
    let inverse = p.inertia_kg_m2.try_inverse().unwrap_or_else(Matrix3::identity);
    let reaction = p.propulsion.torque_coefficient_n_m_s2 / p.propulsion.thrust_coefficient_n_s2;
    let lever = |r: &squirrel_core::vehicle::Rotor<f64>| {
        let at = r.position.vector;
        inverse * Vector3::new(-at.y, at.x, r.yaw_sign * reaction)
    };
    flight.vehicle().rotors().iter().map(lever).collect()
}

/// All orders of up to four rotors; of more, each pair swapped and each turn of all.
fn orders(count: usize) -> Vec<Vec<usize>> {
    let given: Vec<usize> = (0..count).collect();
    if count <= 4 {
        let mut all = vec![Vec::new()];
        for _ in 0..count {
            let longer = |order: &Vec<usize>| {
                let left: Vec<usize> =
                    given.iter().copied().filter(|i| !order.contains(i)).collect();
                left.into_iter().map(|i| [order.clone(), vec![i]].concat()).collect::<Vec<_>>()
            };
            all = all.iter().flat_map(longer).collect();
        }
        return all;
    }
    let mut all = Vec::new();
    for a in 0..count {
        for b in a + 1..count {
            let mut order = given.clone();
            order.swap(a, b);
            all.push(order);
        }
        let mut order = given.clone();
        order.rotate_left(a);
        all.push(order.clone());
        order.reverse();
        all.push(order);
    }
    all
}

/// Products of angular acceleration and thrusts, about the means.
struct Sums {
    /// Of each lag in rows: of the acceleration about each axis with each thrust.
    cross: Vec<[[f64; MAX_ROTORS]; 3]>,
    square: [[f64; MAX_ROTORS]; MAX_ROTORS],
    own: [f64; 3],
    /// Standard deviation of the sum of three correlations of unrelated things.
    chance: f64,
}

/// Longest lag of [`Sums`], rows.
const LAGS: usize = 8;

impl Sums {
    /// * `changes` - of what changes from row to row instead
    fn new(flight: &Flight, changes: bool) -> Option<Self> {
        let count = flight.vehicle().parameters().rotor_count;
        let mut sums = Self {
            cross: vec![[[0.0; MAX_ROTORS]; 3]; LAGS + 1],
            square: [[0.0; MAX_ROTORS]; MAX_ROTORS],
            own: [0.0; 3],
            chance: 0.0,
        };
        let (mut rows, mut memory) = (0.0, 0.0);
        for track in flight.tracks() {
            let mut thrust = thrusts(flight, track);
            let mut measured: Vec<Vector3<f64>> =
                track.measured.iter().map(|m| Vector3::new(m[3], m[4], m[5])).collect();
            if changes {
                measured = measured.windows(2).map(|w| w[1] - w[0]).collect();
                let change = |w: &[[f64; MAX_ROTORS]]| std::array::from_fn(|i| w[1][i] - w[0][i]);
                thrust = thrust.windows(2).map(change).collect();
            }
            let n = measured.len().min(thrust.len());
            if n <= 2 * LAGS {
                continue;
            }
            let mean = measured[..n].iter().sum::<Vector3<f64>>() / n as f64;
            let level: [f64; MAX_ROTORS] =
                std::array::from_fn(|i| thrust[..n].iter().map(|t| t[i]).sum::<f64>() / n as f64);
            for k in LAGS..n {
                let a = measured[k] - mean;
                for axis in 0..3 {
                    sums.own[axis] += a[axis] * a[axis];
                    for (late, cross) in sums.cross.iter_mut().enumerate() {
                        for i in 0..count {
                            cross[axis][i] += a[axis] * (thrust[k - late][i] - level[i]);
                        }
                    }
                }
                for i in 0..count {
                    for j in 0..count {
                        sums.square[i][j] += (thrust[k][i] - level[i]) * (thrust[k][j] - level[j]);
                    }
                }
                let before = measured[k - 1] - mean;
                memory += a.dot(&before)
                    / a.norm_squared().max(f64::MIN_POSITIVE).sqrt()
                    / before.norm_squared().max(f64::MIN_POSITIVE).sqrt();
                rows += 1.0;
            }
        }
        // As if both went on as a first-order process does.
        let memory: f64 = (memory / rows).clamp(0.0, 0.95);
        let independent = rows * (1.0 - memory * memory) / (1.0 + memory * memory);
        sums.chance = (3.0 / independent).sqrt();
        (rows > 0.0).then_some(sums)
    }

    /// Sum of the correlations about the axes, with each rotor's thrust from a slot of the command.
    fn score(&self, late: usize, levers: &[Vector3<f64>], order: &[usize]) -> f64 {
        (0..3)
            .map(|axis| {
                let (mut cross, mut square) = (0.0, 0.0);
                for (lever, slot) in levers.iter().zip(order) {
                    cross += lever[axis] * self.cross[late][axis][*slot];
                    for (other, theirs) in levers.iter().zip(order) {
                        square += lever[axis] * other[axis] * self.square[*slot][*theirs];
                    }
                }
                if square > 0.0 && self.own[axis] > 0.0 {
                    cross / (square * self.own[axis]).sqrt()
                } else {
                    0.0
                }
            })
            .sum()
    }
}

/// Thrust of each rotor at the rows of the residual, N: behind its lag, through the filter that the
/// residual came through.
fn thrusts(flight: &Flight, track: &crate::predictor::Track) -> Vec<[f64; MAX_ROTORS]> {
    let p = flight.vehicle().parameters();
    let keeps = |tau_s: f64| if tau_s > 0.0 { (-track.period_s / tau_s).exp() } else { 0.0 };
    let (up, down) =
        (keeps(p.propulsion.time_constant_up_s), keeps(p.propulsion.time_constant_down_s));
    let commands = flight.commands();
    let mut next = commands.partition_point(|(t, _)| *t <= track.time_s[0]);
    let mut speed: Option<[f64; MAX_ROTORS]> = None;
    let (mut first, mut second) = (Vec::new(), Vec::new());
    for t in &track.time_s {
        while commands.get(next).is_some_and(|(stamp, _)| stamp <= t) {
            next += 1;
        }
        let command = &commands[next.saturating_sub(1)].1;
        let target: [f64; MAX_ROTORS] = std::array::from_fn(|i| {
            if i < p.rotor_count { p.propulsion.target_speed_rad_s(command[i]) } else { 0.0 }
        });
        let mut now = speed.unwrap_or(target);
        for (now, target) in now.iter_mut().zip(target) {
            let keeps = if target > *now { up } else { down };
            *now = target + (*now - target) * keeps;
        }
        speed = Some(now);
        let thrust = now.map(|w| p.propulsion.thrust_coefficient_n_s2 * w * w);
        first.push(Vector6::from_fn(|i, _| thrust[i]));
        second.push(Vector6::new(thrust[6], thrust[7], 0.0, 0.0, 0.0, 0.0));
    }
    let [first, second] =
        [first, second].map(|raw| track.filter.apply(&raw, track.edge(), track.every));
    let all = first.iter().zip(&second);
    all.map(|(a, b)| std::array::from_fn(|i| if i < 6 { a[i] } else { b[i - 6] })).collect()
}
