//! Courses: what an episode asks for, and what it is worth.
//!
//! - [`CourseKind::Track`]: follow a smooth curve, sums of one sine an axis.
//! - [`CourseKind::Avoid`]: follow the paper's straight run (section V.B) past trunks that stand in
//!   the way and are seen late.
//!
//! The reward of a step is its length times how near the vehicle is to where it should be, from 1
//! to 0, less a little for turning; an episode of ten seconds is worth ten at most. A vehicle that
//! hits a trunk, overturns or strays is lost, which costs five. [`Terms`] are its parts.

use rand::Rng;
use rand_pcg::Pcg64Mcg;
use squirrel_core::control::Reference;
use squirrel_core::dynamics::State;
use squirrel_core::frames::{In, Ned};
use squirrel_core::guidance::sensing::Obstacle;
use squirrel_core::guidance::trajectory::Trajectory;
use squirrel_core::nalgebra::Vector3;
use squirrel_core::policy::RATE_HZ;

/// Radius of a trunk, m: paper, section V.A.
pub const TRUNK_RADIUS_M: f32 = 0.5;
/// From the middle of the vehicle to what touches a trunk first, m.
const REACH_M: f32 = 0.25;
/// Trunks of a course.
const TRUNKS: usize = 6;
/// Height of all courses, m above ground.
const HEIGHT_M: f32 = 30.0;
/// A vehicle that is further from where it should be is lost, m.
const STRAY_M: f32 = 5.0;
/// What it costs to be lost.
const LOST: f32 = 5.0;
/// Cost of turning, per (rad/s)^2 and second.
const TURNING: f32 = 0.005;

/// What to learn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CourseKind {
    /// Past trunks.
    Avoid,
    /// Along a curve.
    Track,
}

/// The course of an episode.
#[derive(Debug, Clone)]
pub enum Course {
    /// A run from rest, or into which the episode starts, with trunks along it.
    Avoid {
        /// What to follow.
        run: Trajectory,
        /// Where on it the episode starts, s.
        ahead_s: f32,
        /// What stands in the way.
        trunks: [Obstacle; TRUNKS],
    },
    /// A curve.
    Track {
        /// What to follow.
        sines: Sines,
        /// The episode starts at rest instead of at the curve's speed.
        at_rest: bool,
    },
}

/// `p(t) = start + a (sin(w t + phase) - sin(phase))` for each axis.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sines {
    /// m.
    pub amplitude_m: [f32; 3],
    /// rad/s.
    pub frequency_rad_s: [f32; 3],
    /// rad.
    pub phase_rad: [f32; 3],
}

/// What a step was worth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Verdict {
    pub(super) reward: f32,
    pub(super) lost: bool,
    pub(super) terms: Terms,
}

/// What the reward of a step is the sum of, but for rounding.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Terms {
    /// How near the vehicle is, times the length of the step; 0 where it is lost.
    pub near: f32,
    /// Less than zero for turning; 0 where it is lost.
    pub turning: f32,
    /// -5 where the vehicle is lost, else 0.
    pub lost: f32,
}

/// Evenly from `[0, 2^64)`.
pub(super) fn draw(rng: &mut Pcg64Mcg) -> u64 {
    rng.next_u64()
}

/// Evenly from `0..below`.
pub(super) fn draw_below(rng: &mut Pcg64Mcg, below: usize) -> usize {
    ((u128::from(draw(rng)) * below as u128) >> 64) as usize
}

/// Evenly from `[low, high)`.
fn between(rng: &mut Pcg64Mcg, low: f32, high: f32) -> f32 {
    low + (high - low) * (draw(rng) >> 40) as f32 / (1 << 24) as f32
}

impl Course {
    pub(super) fn draw(kind: CourseKind, rng: &mut Pcg64Mcg) -> Self {
        match kind {
            CourseKind::Avoid => {
                let speed_m_s = between(rng, 4.0, 8.0);
                let start = In::new(Vector3::new(0.0, 0.0, -HEIGHT_M));
                let run = Trajectory::new(start, 0.0, speed_m_s, 2.0);
                // Half of the episodes start from rest, the others at speed.
                let ahead_s = if draw(rng) & 1 == 0 { 0.0 } else { 2.0 };
                let mut north_m = run.at(ahead_s).position.vector.x;
                let trunks = core::array::from_fn(|id| {
                    north_m += between(rng, 8.0, 16.0);
                    Obstacle { id: id as u32, north_m, east_m: between(rng, -0.7, 0.7) }
                });
                Self::Avoid { run, ahead_s, trunks }
            }
            CourseKind::Track => {
                let mut sines = Sines::default();
                for axis in 0..3 {
                    let size = if axis == 2 { 0.3 } else { 1.0 };
                    let amplitude = size * between(rng, 1.0, 5.0);
                    let speed = size * between(rng, 1.0, 4.0);
                    // At most 4 m/s^2.
                    sines.frequency_rad_s[axis] = (speed / amplitude).min((4.0 / amplitude).sqrt());
                    sines.amplitude_m[axis] = amplitude;
                    sines.phase_rad[axis] = between(rng, 0.0, core::f32::consts::TAU);
                }
                Self::Track { sines, at_rest: draw(rng) & 1 == 0 }
            }
        }
    }

    /// Velocity at the start of the episode.
    pub(super) fn start_velocity(&self) -> In<Ned, f32> {
        match self {
            Self::Track { at_rest: true, .. } => In::zero(),
            _ => self.reference(0.0).velocity,
        }
    }

    /// What to follow at a time since the start of the episode.
    pub(super) fn reference(&self, time_s: f32) -> Reference {
        match self {
            Self::Avoid { run, ahead_s, .. } => run.at(time_s + ahead_s),
            Self::Track { sines, .. } => sines.at(time_s),
        }
    }

    pub(super) fn obstacles(&self) -> &[Obstacle] {
        match self {
            Self::Avoid { trunks, .. } => trunks,
            Self::Track { .. } => &[],
        }
    }

    /// What a step was worth that ended here.
    pub(super) fn judge(&self, state: &State<f32>, reference: &Reference) -> Verdict {
        let away = (reference.position.vector - state.position.vector).norm();
        let hit = self.obstacles().iter().any(|trunk| {
            let (north, east) =
                (trunk.north_m - state.position.vector.x, trunk.east_m - state.position.vector.y);
            north.hypot(east) < TRUNK_RADIUS_M + REACH_M
        });
        let q = &state.attitude;
        let overturned = q.w * q.w + q.k * q.k < q.i * q.i + q.j * q.j;
        // A state that is no number is lost, too.
        let lost = hit || overturned || !(away < STRAY_M);
        let omega = state.omega.vector.norm_squared();
        let near = 1.0 - away / STRAY_M;
        if lost {
            let terms = Terms { lost: -LOST, ..Terms::default() };
            return Verdict { reward: -LOST, lost, terms };
        }
        let (turning, rate_hz) = (TURNING * omega, RATE_HZ as f32);
        let terms = Terms { near: near / rate_hz, turning: -turning / rate_hz, lost: 0.0 };
        Verdict { reward: (near - turning) / rate_hz, lost, terms }
    }
}

impl Sines {
    fn at(&self, time_s: f32) -> Reference {
        let (mut p, mut v, mut a) = (Vector3::zeros(), Vector3::zeros(), Vector3::zeros());
        for axis in 0..3 {
            let (size, rate, phase) =
                (self.amplitude_m[axis], self.frequency_rad_s[axis], self.phase_rad[axis]);
            let (s, c) = (rate * time_s + phase).sin_cos();
            p[axis] = size * (s - phase.sin());
            v[axis] = size * rate * c;
            a[axis] = -size * rate * rate * s;
        }
        p.z -= HEIGHT_M;
        Reference {
            position: In::new(p),
            velocity: In::new(v),
            acceleration: In::new(a),
            yaw_rad: 0.0,
        }
    }
}
