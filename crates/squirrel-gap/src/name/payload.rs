//! At which lengths a slung load is worth looking for: where loads that swing along the flights pull
//! as the horizontal force residual does.
//!
//! Over a flight of 40 s two swings 0.03 Hz apart have nothing in common, so that a hypothesis must
//! start near the right length; and one that swings far swings slower, so that a line of the
//! residual is not its length. What a load pulls over its mass needs nothing but the vehicle's
//! measured acceleration. Where none explains much of the residual, the lines are looked at after
//! all, `f = sqrt(g / l) / 2 pi`: it may be one thing of several, or nothing.

use crate::predictor::{DYNAMIC, Predictor};
use nalgebra::Vector3;
use squirrel_core::effects::{Pendulum, PendulumState};
use squirrel_core::math::GRAVITY_M_S2;
use std::f64::consts::TAU;

/// Lengths of a tether, m, and how far apart they are looked at.
const LENGTHS_M: (f64, f64) = (0.22, 1.1);
const STEP: f64 = 0.015;
/// Damping of its swing, 1/s.
const DAMPING_PER_S: f64 = 0.1;
/// Lengths closer than this part are one.
const APART: f64 = 0.06;
/// Part of the residual that a load must explain.
const MUCH: f64 = 0.15;
/// Lines of the residual, Hz: how far apart they are looked at, and closer than what they are one.
const STEP_HZ: f64 = 0.005;
const APART_HZ: f64 = 0.03;
/// Lengths to look at.
const LINES: usize = 3;
/// Time between two accelerations at least, s.
const STEP_S: f64 = 0.007;

/// A piece of a flight: the vehicle's accelerations, and the horizontal residual with the
/// acceleration that it is at; world frame, m/s^2, with the times between them, s.
struct Piece {
    accelerations: Vec<Vector3<f64>>,
    step_s: f64,
    residual: Vec<(usize, [f64; 2])>,
    residual_step_s: f64,
}

/// Lengths, m, of loads that pull as the horizontal residual does, the likest first; of a vehicle
/// file that has a load, its length alone.
///
/// * `rows` - residual of the vehicle as it is
pub(crate) fn payload_lengths_m(predictor: &Predictor, rows: &[f64]) -> Vec<f64> {
    if let Some(stated) = predictor.vehicle.effects.pendulum() {
        return vec![stated.length_m];
    }
    let pieces: Vec<Piece> = (0..predictor.tracks.len())
        .filter_map(|piece| Piece::new(predictor, piece, rows))
        .collect();
    let (least, most) = LENGTHS_M;
    let count = ((most / least).ln() / STEP) as usize;
    let mut all: Vec<(f64, f64)> = (0..=count)
        .map(|i| least * (STEP * i as f64).exp())
        .map(|length_m| (likeness(&pieces, length_m), length_m))
        .collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    if all.first().is_none_or(|(share, _)| *share < MUCH) {
        let hz = |length_m: f64| (GRAVITY_M_S2 / length_m).sqrt() / TAU;
        let lines = lines_hz(&pieces, hz(most), hz(least));
        return lines.iter().map(|f| GRAVITY_M_S2 / (TAU * f).powi(2)).collect();
    }
    let mut chosen: Vec<f64> = Vec::new();
    for (_, length_m) in all {
        if chosen.len() < LINES && chosen.iter().all(|m| (m / length_m).ln().abs() >= APART) {
            chosen.push(length_m);
        }
    }
    chosen
}

/// The strongest lines of the residual between two frequencies, Hz, the strongest first.
fn lines_hz(pieces: &[Piece], least_hz: f64, most_hz: f64) -> Vec<f64> {
    let count = ((most_hz - least_hz) / STEP_HZ) as usize;
    let frequency_hz = |i: usize| least_hz + i as f64 * STEP_HZ;
    let mut power = vec![0.0; count];
    for piece in pieces {
        for axis in 0..2 {
            for (i, power) in power.iter_mut().enumerate() {
                let w = TAU * frequency_hz(i) * piece.residual_step_s;
                let (mut a, mut b) = (0.0, 0.0);
                for (_, value) in &piece.residual {
                    (a, b) = (value[axis] + 2.0 * w.cos() * a - b, a);
                }
                *power += a * a + b * b - 2.0 * w.cos() * a * b;
            }
        }
    }
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|a, b| power[*b].total_cmp(&power[*a]));
    let mut chosen: Vec<f64> = Vec::new();
    for i in order {
        if chosen.len() < LINES && chosen.iter().all(|f| (f - frequency_hz(i)).abs() >= APART_HZ) {
            chosen.push(frequency_hz(i));
        }
    }
    chosen
}

/// Part of the residual that a load of a length explains.
fn likeness(pieces: &[Piece], length_m: f64) -> f64 {
    let load = Pendulum { mass_kg: 1.0, length_m, damping_per_s: DAMPING_PER_S };
    let (mut along, mut square, mut whole) = (0.0, 0.0, 0.0);
    for piece in pieces {
        let swing = load.over(piece.step_s);
        let mut state = PendulumState::at_rest();
        let mut residual = piece.residual.iter().peekable();
        // Sums of the pull, the residual, both, and the squares of either, by axis.
        let mut sums = [[0.0; 5]; 2];
        for (k, acceleration) in piece.accelerations.iter().enumerate() {
            let acceleration = [acceleration.x, acceleration.y, acceleration.z];
            swing.lead(&mut state, acceleration);
            let Some((_, left)) = residual.next_if(|(at, _)| *at == k) else { continue };
            let tether = swing.tether(&state);
            let tension = tether.tension_m_s2(&acceleration);
            for axis in 0..2 {
                // What a load that is fixed to the vehicle pulls is a matter of mass.
                let (pull, left) = (tension * tether.along[axis] + acceleration[axis], left[axis]);
                let [p, r, both, own, other] = &mut sums[axis];
                (*p, *r, *both) = (*p + pull, *r + left, *both + pull * left);
                (*own, *other) = (*own + pull * pull, *other + left * left);
            }
        }
        let n = piece.residual.len() as f64;
        for [p, r, both, own, other] in sums {
            along += both - p * r / n;
            square += own - p * p / n;
            whole += other - r * r / n;
        }
    }
    // A load pulls to where it hangs.
    if along > 0.0 && square * whole > 0.0 { along * along / (square * whole) } else { 0.0 }
}

impl Piece {
    /// `None` without a horizontal force, or of a few samples.
    fn new(predictor: &Predictor, piece: usize, rows: &[f64]) -> Option<Self> {
        let track = &predictor.tracks[piece];
        let segments: Vec<_> = predictor
            .segments
            .iter()
            .filter(|s| s.piece == piece && s.channel < DYNAMIC.min(3))
            .collect();
        let [x, y, z] = segments[..] else { return None };
        let body = &predictor.plain()[piece].body;
        let stride = (STEP_S / track.period_s).ceil().max(1.0) as usize;
        let step_s = stride as f64 * track.period_s;
        let at: Vec<usize> = (0..body.len()).step_by(stride).collect();
        let accelerations: Vec<Vector3<f64>> = at
            .windows(2)
            .map(|at| (body[at[1]].velocity - body[at[0]].velocity).vector / step_s)
            .collect();
        // A load swings along directions of the world, whatever the vehicle's heading.
        let residual = (0..x.rows.len())
            .map(|i| {
                let sample = track.edge() + i * track.every;
                let left = |s: &crate::predictor::Segment| rows[s.rows.start + i];
                let left = Vector3::new(left(x), left(y), left(z));
                let ned = body[sample].ned_from_body().quaternion * left;
                ((sample / stride).saturating_sub(1), [ned.x, ned.y])
            })
            .collect::<Vec<_>>();
        let is_long = residual.len() > 30 && accelerations.len() > 30;
        is_long.then_some(Self { accelerations, step_s, residual, residual_step_s: x.step_s })
    }
}
