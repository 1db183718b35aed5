//! At which lengths a slung load is worth looking for: where loads that swing along the flights pull
//! as the horizontal force residual does.
//!
//! Over a flight of 40 s two swings 0.03 Hz apart have nothing in common, so that a hypothesis must
//! start near the right length; and one that swings far swings slower, so that a line of the
//! residual is not its length. What a load pulls over its mass needs nothing but the vehicle's
//! measured acceleration.

use crate::predictor::{DYNAMIC, Predictor};
use nalgebra::Vector3;
use squirrel_core::effects::{Pendulum, PendulumState};

/// Lengths of a tether, m, and how far apart they are looked at.
const LENGTHS_M: (f64, f64) = (0.22, 1.1);
const STEP: f64 = 0.015;
/// Damping of its swing, 1/s.
const DAMPING_PER_S: f64 = 0.1;
/// Lengths closer than this part are one.
const APART: f64 = 0.06;
/// Lengths to look at.
const LINES: usize = 3;
/// Time between two accelerations at least, s.
const STEP_S: f64 = 0.007;

/// A piece of a flight: the vehicle's accelerations, time between them, and the horizontal residual
/// with the acceleration that it is at; world frame, m/s^2.
struct Piece {
    accelerations: Vec<Vector3<f64>>,
    step_s: f64,
    residual: Vec<(usize, [f64; 2])>,
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
    let mut chosen: Vec<f64> = Vec::new();
    for (_, length_m) in all {
        if chosen.len() < LINES && chosen.iter().all(|m| (m / length_m).ln().abs() >= APART) {
            chosen.push(length_m);
        }
    }
    chosen
}

/// What a load of a length explains of the residual, (m/s^2)^2.
fn likeness(pieces: &[Piece], length_m: f64) -> f64 {
    let load = Pendulum { mass_kg: 1.0, length_m, damping_per_s: DAMPING_PER_S };
    let (mut along, mut square) = (0.0, 0.0);
    for piece in pieces {
        let swing = load.over(piece.step_s);
        let mut state = PendulumState::at_rest();
        let mut residual = piece.residual.iter().peekable();
        // Mean of the pull, of the residual, of both and of the pull's square, by axis.
        let mut sums = [[0.0; 4]; 2];
        for (k, acceleration) in piece.accelerations.iter().enumerate() {
            let acceleration = [acceleration.x, acceleration.y, acceleration.z];
            swing.lead(&mut state, acceleration);
            let Some((_, left)) = residual.next_if(|(at, _)| *at == k) else { continue };
            let tether = swing.tether(&state);
            let tension = tether.tension_m_s2(&acceleration);
            for axis in 0..2 {
                let (pull, left) = (tension * tether.along[axis], left[axis]);
                let [p, r, both, own] = &mut sums[axis];
                (*p, *r, *both, *own) =
                    (*p + pull, *r + left, *both + pull * left, *own + pull * pull);
            }
        }
        let n = piece.residual.len() as f64;
        for [p, r, both, own] in sums {
            along += both - p * r / n;
            square += own - p * p / n;
        }
    }
    // A load pulls to where it hangs.
    if along > 0.0 && square > 0.0 { along * along / square } else { 0.0 }
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
        is_long.then_some(Self { accelerations, step_s, residual })
    }
}
