//! One flight of a predictor: its long pieces, and what its sources say of one motion at the same
//! times.

use super::pairs::Pairs;
use crate::flight::series::Span;
use crate::predictor::{Predictor, Segment, Track};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use squirrel_core::math::GRAVITY_M_S2;
use squirrel_core::vehicle::{PerRotor, Vehicle};

/// Windows over which rates of attitude and of GNSS velocity are taken, s.
const ATTITUDE_WINDOW_S: f64 = 0.1;
const GNSS_WINDOW_S: f64 = 0.3;
/// Shorter pieces of a flight than this are not checked, unless all are, s: a dash between two gaps
/// is no mean of anything.
const PIECE_S: f64 = 5.0;

/// What an attitude of the log would be without a mistake.
pub(super) type Turn<'a> = &'a dyn Fn(Quaternion<f64>) -> Quaternion<f64>;

pub(super) struct Flight<'p> {
    predictor: &'p Predictor<'p>,
    index: usize,
    pieces: Vec<usize>,
}

impl<'p> Flight<'p> {
    pub(super) fn new(predictor: &'p Predictor<'p>, index: usize) -> Self {
        let duration_s = |piece: usize| {
            let track = &predictor.tracks[piece];
            track.period_s * track.time_s.len() as f64
        };
        let own: Vec<usize> = (0..predictor.tracks.len())
            .filter(|piece| predictor.tracks[*piece].flight == index)
            .collect();
        let longest_s = own.iter().map(|piece| duration_s(*piece)).fold(0.0, f64::max);
        let pieces =
            own.into_iter().filter(|piece| duration_s(*piece) >= PIECE_S.min(longest_s)).collect();
        Self { predictor, index, pieces }
    }

    /// One piece of a flight, however short.
    pub(super) fn piece(predictor: &'p Predictor<'p>, piece: usize) -> Self {
        Self { predictor, index: predictor.tracks[piece].flight, pieces: vec![piece] }
    }

    pub(super) fn name(&self) -> &'p str {
        self.predictor.names[self.index]
    }

    pub(super) fn vehicle(&self) -> &'p Vehicle<f64> {
        &self.predictor.vehicle.vehicle
    }

    /// By how much the effects of the vehicle file make rotors late, s: lag and latency beside
    /// those of its propulsion.
    pub(super) fn stated_delay_s(&self) -> f64 {
        let effects = &self.predictor.vehicle.effects;
        let [up, down] = effects.rotor_extra_time_constant_s();
        up.max(down) + effects.command_latency_s()
    }

    pub(super) fn tracks(&self) -> impl Iterator<Item = &'p Track> + '_ {
        self.pieces.iter().map(|piece| &self.predictor.tracks[*piece])
    }

    /// Commands with their times, s.
    pub(super) fn commands(&self) -> &'p [(f64, PerRotor<f64>)] {
        self.predictor.rotor_commands(self.index)
    }

    pub(super) fn spans(&self) -> Vec<Span> {
        self.tracks().map(|track| (track.time_s[0], track.time_s[track.time_s.len() - 1])).collect()
    }

    pub(super) fn has_attitude(&self) -> bool {
        !self.pieces.is_empty() && self.tracks().all(|track| track.attitude().is_some())
    }

    pub(super) fn has_gyroscope(&self) -> bool {
        self.predictor.has_gyroscope()
    }

    /// Gyroscope and rate of the attitude, with the times of the middle, s.
    pub(super) fn rates(&self, turn: Turn) -> (Vec<f64>, Pairs) {
        let (mut time_s, mut pairs) = (Vec::new(), Pairs::default());
        for track in self.tracks() {
            let Some(attitude) = track.attitude() else { continue };
            let step = (ATTITUDE_WINDOW_S / track.period_s).round().max(1.0) as usize;
            for start in (0..attitude.len().saturating_sub(step)).step_by(step) {
                let [a, b] = [start, start + step]
                    .map(|k| UnitQuaternion::new_normalize(turn(attitude[k].into_inner())));
                let turned = (a.inverse() * b).scaled_axis() / (step as f64 * track.period_s);
                let gyro =
                    track.omega()[start..start + step].iter().sum::<Vector3<f64>>() / step as f64;
                time_s.push(track.time_s[start] + 0.5 * step as f64 * track.period_s);
                pairs.push(gyro, turned);
            }
        }
        (time_s, pairs)
    }

    /// Velocity from specific force and attitude in each piece, to be asked at any time.
    pub(super) fn strapdown(&self, turn: Turn) -> Vec<Strapdown> {
        let gravity = Vector3::new(0.0, 0.0, GRAVITY_M_S2);
        let all = self.tracks().filter_map(|track| {
            let attitude = track.attitude()?;
            let mut velocity = vec![Vector3::zeros()];
            for k in 1..attitude.len() {
                let a = UnitQuaternion::new_normalize(turn(attitude[k].into_inner()))
                    * track.specific_force()[k]
                    + gravity;
                velocity.push(velocity[k - 1] + a * track.period_s);
            }
            Some(Strapdown { start_s: track.time_s[0], period_s: track.period_s, velocity })
        });
        all.collect()
    }

    /// Changes of velocity of fixes and of strapdown so much earlier, m/s^2, with the times of the
    /// middle, s.
    pub(super) fn accelerations(&self, strapdown: &[Strapdown], shift_s: f64) -> (Vec<f64>, Pairs) {
        let (mut time_s, mut pairs) = (Vec::new(), Pairs::default());
        for (track, own) in self.tracks().filter(|t| t.attitude().is_some()).zip(strapdown) {
            let velocity = track.velocity();
            let mut i = 0;
            for j in 0..velocity.len() {
                while velocity[j].0 - velocity[i].0 > GNSS_WINDOW_S + 1e-6 {
                    i += 1;
                }
                let ((t0, v0), (t1, v1)) = (velocity[i], velocity[j]);
                // Fixes at a high rate say nothing new within a tenth of a second.
                let is_new = time_s.last().is_none_or(|last| 0.5 * (t0 + t1) - last > 0.09);
                if t1 - t0 > 0.5 * GNSS_WINDOW_S
                    && is_new
                    && let (Some(s0), Some(s1)) = (own.at(t0 - shift_s), own.at(t1 - shift_s))
                {
                    time_s.push(0.5 * (t0 + t1));
                    pairs.push((v1 - v0) / (t1 - t0), (s1 - s0) / (t1 - t0));
                }
            }
        }
        (time_s, pairs)
    }

    /// Mean acceleration that specific force and attitude give, m/s^2.
    pub(super) fn mean_acceleration(strapdown: &[Strapdown]) -> Vector3<f64> {
        let duration_s: f64 = strapdown.iter().map(|s| s.period_s * s.velocity.len() as f64).sum();
        strapdown.iter().map(|s| s.velocity[s.velocity.len() - 1]).sum::<Vector3<f64>>()
            / duration_s
    }

    /// Speed by positions and velocity, m/s.
    pub(super) fn moved(&self) -> Pairs {
        let mut moved = Pairs::default();
        for track in self.tracks() {
            let (positions, velocity) = (track.position(), track.velocity());
            for (a, b) in positions.iter().zip(positions.iter().skip(10)) {
                let from = velocity.partition_point(|(t, _)| *t < a.0);
                let until = velocity.partition_point(|(t, _)| *t <= b.0);
                if until > from && b.0 > a.0 {
                    let mean = velocity[from..until].iter().map(|(_, v)| v).sum::<Vector3<f64>>()
                        / (until - from) as f64;
                    moved.push((b.1 - a.1) / (b.0 - a.0), mean);
                }
            }
        }
        moved
    }

    /// Time between rows of the residual, s.
    pub(super) fn step_s(&self) -> f64 {
        self.tracks().next().map_or(1.0, |track| track.every as f64 * track.period_s)
    }

    /// Angular rates at the rows of the residual, rad/s.
    pub(super) fn omega(&self) -> Vec<Vector3<f64>> {
        let of = |track: &'p Track| {
            (0..track.measured.len()).map(|i| track.omega()[track.edge() + i * track.every])
        };
        self.tracks().flat_map(of).collect()
    }

    /// Times of the rows of the residual, s.
    pub(super) fn residual_time_s(&self) -> Vec<f64> {
        let of = |track: &'p Track| (0..track.measured.len()).map(|i| track.residual_time_s(i));
        self.tracks().flat_map(of).collect()
    }

    /// Measured and predicted specific force, or angular acceleration with `first` 3.
    pub(super) fn predicted(&self, residual: &[f64], first: usize) -> Pairs {
        let mut pairs = Pairs::default();
        for piece in &self.pieces {
            let segments: Vec<&Segment> = self
                .predictor
                .segments
                .iter()
                .filter(|s| s.piece == *piece && (first..first + 3).contains(&s.channel))
                .collect();
            let [x, y, z] = segments[..] else { continue };
            for (i, m) in self.predictor.tracks[*piece].measured.iter().enumerate() {
                let measured = Vector3::from_fn(|axis, _| m[first + axis]);
                let left = |s: &Segment| residual[s.rows.start + i];
                pairs.push(measured, measured - Vector3::new(left(x), left(y), left(z)));
            }
        }
        pairs
    }
}

/// Velocity by strapdown over one piece, from 0.
pub(super) struct Strapdown {
    start_s: f64,
    period_s: f64,
    velocity: Vec<Vector3<f64>>,
}

impl Strapdown {
    fn at(&self, time_s: f64) -> Option<Vector3<f64>> {
        let k = (time_s - self.start_s) / self.period_s;
        (k >= 0.0 && (k as usize) + 1 < self.velocity.len()).then(|| {
            let i = k as usize;
            self.velocity[i] + (self.velocity[i + 1] - self.velocity[i]) * (k - i as f64)
        })
    }
}
