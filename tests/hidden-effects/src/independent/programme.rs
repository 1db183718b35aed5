//! What is flown: manoeuvres in an order drawn from the flight's seed, as a reference at 300 Hz.
//!
//! `rich` has a multisine of 0.3 to 6 Hz on all axes, dashes to 9 m/s (three with both wing edges
//! above 5 m/s, one folded), climbs and descents of 3 m/s, a full turn with hover at four headings,
//! and a ladder of hover heights down to 0.2 m. `normal` is that without the multisine at half the
//! speeds and half the turn. `calm` stays below 2 m/s at one heading with the wings folded. What
//! [`Further`] asks for comes after that.

use crate::draw::Draw;
use crate::further::Further;
use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// How much a flight excites.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Excitation {
    /// Everything.
    Rich,
    /// Half of it, without the multisine.
    Normal,
    /// Below 2 m/s.
    Calm,
}

/// What the autopilot is to do now.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reference {
    pub(super) position: Vector3<f64>,
    pub(super) velocity: Vector3<f64>,
    pub(super) acceleration: Vector3<f64>,
    pub(super) yaw: f64,
    pub(super) yaw_rate: f64,
    pub(super) wing: Vector2<f64>,
    /// Multisine: angular acceleration, and thrust over mass.
    pub(super) angular_rad_s2: Vector3<f64>,
    pub(super) heave_m_s2: f64,
}

/// How a load is flown, and at what pace: else it swings up to the horizontal, where nobody flies
/// one and nothing of its swing can be foreseen.
pub(super) const WITH_A_LOAD: (Excitation, f64) = (Excitation::Normal, 0.5);

impl Reference {
    /// The same way at another pace.
    pub(super) fn slower(self, pace: f64) -> Self {
        Self {
            velocity: self.velocity * pace,
            acceleration: self.acceleration * (pace * pace),
            yaw_rate: self.yaw_rate * pace,
            ..self
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Manoeuvre {
    Hover {
        for_s: f64,
    },
    Dash {
        course: f64,
        speed: f64,
        wings: bool,
    },
    Heave {
        speed: f64,
        wings: bool,
    },
    /// Hover in which the wings open and close.
    Open,
    /// Straight up, or down where it is negative.
    Rise {
        by_m: f64,
        speed: f64,
        rate: f64,
    },
    Turn {
        sign: f64,
        step: f64,
    },
    Ladder,
}

/// Length of a flight, s.
pub(crate) const DURATION_S: f64 = 40.0;
const HEIGHT_M: f64 = 3.0;
const DASH_M_S2: f64 = 5.5;
const CRUISE_S: f64 = 0.7;
const SETTLE_S: f64 = 0.6;
const HEAVE_M_S2: f64 = 4.0;
const HEAVE_S: f64 = 0.5;
/// With open wings.
const HEAVE_OPEN_S: f64 = 1.0;
const OPEN_S: [f64; 3] = [0.2, 1.2, 2.2];
const SLOW_DASH_M_S: f64 = 5.0;
const RISE_M_S: f64 = 6.0;
const RISE_M_S2: f64 = 4.0;
const SINK_M_S2: f64 = 5.0;
/// Above [`HEIGHT_M`], and how far down from there.
const HIGH_M: f64 = 25.0;
const SINK_M: f64 = 22.0;
const RECOVERY_S: f64 = 1.0;
const TURN_S: f64 = 1.4;
const TURN_HOLD_S: f64 = 0.45;
const LADDER_M: [f64; 5] = [1.5, 0.8, 0.4, 0.2, HEIGHT_M];
const LADDER_S: [f64; 5] = [1.3, 1.1, 1.1, 1.4, 1.9];
/// Shares of a dash's speed at which wings open and close: the vehicle is slower than the reference
/// at first, faster later.
const EDGE_SHARE: [f64; 2] = [0.85, 0.7];
/// Speeds of the reference, m/s; the vehicle overshoots to 9 and 3 m/s.
const DASH_M_S: [f64; 2] = [8.2, 8.8];
const HEAVE_M_S: f64 = 2.5;

impl Manoeuvre {
    fn duration_s(self) -> f64 {
        match self {
            Self::Hover { for_s } => for_s,
            Self::Dash { speed, .. } => 2.0 * speed / DASH_M_S2 + CRUISE_S + SETTLE_S,
            Self::Heave { speed, wings } => {
                4.0 * speed / HEAVE_M_S2 + 2.0 * heave_hold_s(wings) + SETTLE_S
            }
            Self::Open => OPEN_S[2],
            Self::Rise { by_m, speed, rate } => by_m.abs() / speed + speed / rate + RECOVERY_S,
            Self::Turn { .. } => 4.0 * (TURN_S + TURN_HOLD_S),
            Self::Ladder => LADDER_S.iter().sum(),
        }
    }
}

fn heave_hold_s(wings: bool) -> f64 {
    if wings { HEAVE_OPEN_S } else { HEAVE_S }
}

/// Speed and acceleration of a ramp up, a hold and a ramp down.
fn trapezoid(t: f64, speed: f64, rate: f64, hold_s: f64) -> (f64, f64) {
    let ramp = speed / rate;
    if t < ramp {
        (rate * t, rate)
    } else if t < ramp + hold_s {
        (speed, 0.0)
    } else if t < 2.0 * ramp + hold_s {
        (speed - rate * (t - ramp - hold_s), -rate)
    } else {
        (0.0, 0.0)
    }
}

fn manoeuvres(excitation: Excitation, draw: &mut Draw) -> Vec<Manoeuvre> {
    let course = draw.angle();
    let mut list = Vec::new();
    let amplitude = match excitation {
        Excitation::Rich => 1.0,
        Excitation::Normal => 0.5,
        Excitation::Calm => {
            for k in 0..8 {
                let course = course + PI * f64::from(k) + draw.uniform(-0.6, 0.6);
                list.push(Manoeuvre::Dash { course, speed: draw.uniform(0.9, 1.6), wings: false });
                list.push(Manoeuvre::Hover { for_s: draw.uniform(0.5, 2.0) });
            }
            list.push(Manoeuvre::Heave { speed: 0.3, wings: false });
            list.push(Manoeuvre::Hover { for_s: DURATION_S });
            return list;
        }
    };
    let mut dashes = Vec::new();
    for k in 0..4 {
        // Out, back, out on another course, back: the flight stays near its start.
        let course = course + PI * f64::from(k) + if k < 2 { 0.0 } else { draw.uniform(0.8, 2.2) };
        dashes.push(Manoeuvre::Dash {
            course,
            speed: amplitude * draw.uniform(DASH_M_S[0], DASH_M_S[1]),
            wings: true,
        });
    }
    let folded = draw.index(4);
    if let Manoeuvre::Dash { wings, .. } = &mut dashes[folded] {
        *wings = false;
    }
    list.push(Manoeuvre::Heave { speed: HEAVE_M_S * amplitude, wings: false });
    list.push(Manoeuvre::Turn { sign: draw.sign(), step: 0.5 * PI * amplitude });
    list.push(Manoeuvre::Ladder);
    draw.shuffle(&mut list);
    // The pairs of dashes go between the others.
    list.splice(1..1, [dashes[0], dashes[1]]);
    list.splice(4..4, [dashes[2], dashes[3]]);
    list.insert(0, Manoeuvre::Hover { for_s: 1.2 });
    list.push(Manoeuvre::Hover { for_s: DURATION_S });
    list
}

/// What follows, after which the flight hovers.
fn further(further: Further, draw: &mut Draw) -> Vec<Manoeuvre> {
    let mut list = Vec::new();
    if further.opens_wings {
        let course = draw.angle();
        list.extend([Manoeuvre::Open; 2]);
        list.push(Manoeuvre::Heave { speed: HEAVE_M_S, wings: true });
        let dash = |course| Manoeuvre::Dash { course, speed: SLOW_DASH_M_S, wings: true };
        list.extend([dash(course), dash(course + PI)]);
    }
    let mut by_m = HIGH_M;
    for speed in further.descents_m_s.into_iter().flatten() {
        list.push(Manoeuvre::Rise { by_m, speed: RISE_M_S, rate: RISE_M_S2 });
        list.push(Manoeuvre::Rise { by_m: -SINK_M, speed, rate: SINK_M_S2 });
        by_m = SINK_M;
    }
    list
}

/// Sines of one axis.
#[derive(Debug, Clone)]
struct Multisine(Vec<[f64; 2]>);

impl Multisine {
    /// Twelve frequencies; `axis` of four interleaves them, so that no two axes share one.
    fn new(axis: usize, draw: &mut Draw) -> Self {
        let frequency = |k: usize| 0.3 * 20.0_f64.powf((4 * k + axis) as f64 / 47.0);
        Self((0..12).map(|k| [frequency(k), draw.angle()]).collect())
    }
    /// Root mean square 1.
    fn at(&self, t: f64) -> f64 {
        let sum: f64 =
            self.0.iter().map(|[frequency, phase]| (TAU * frequency * t + phase).sin()).sum();
        sum * (2.0 / self.0.len() as f64).sqrt()
    }
}

/// Angular acceleration of the multisine, rms rad/s^2, and its thrust, rms m/s^2.
const MULTISINE: [f64; 4] = [5.0, 5.0, 1.2, 0.7];
/// Share of it near the ground and while the rotors are busy turning the vehicle.
const QUIET: f64 = 0.35;

/// The reference of one flight, moved on step by step.
#[derive(Debug, Clone)]
pub(super) struct Programme {
    left: std::vec::IntoIter<Manoeuvre>,
    now: Manoeuvre,
    begun_s: f64,
    start: Reference,
    multisine: Option<[Multisine; 4]>,
    reference: Reference,
}

impl Programme {
    pub(super) fn new(excitation: Excitation, more: Further, draw: &mut Draw) -> Self {
        let mut list = manoeuvres(excitation, draw);
        let reference = Reference {
            position: Vector3::new(0.0, 0.0, -HEIGHT_M),
            velocity: Vector3::zeros(),
            acceleration: Vector3::zeros(),
            yaw: if excitation == Excitation::Calm { 0.0 } else { draw.uniform(-0.5, 0.5) },
            yaw_rate: 0.0,
            wing: Vector2::zeros(),
            angular_rad_s2: Vector3::zeros(),
            heave_m_s2: 0.0,
        };
        let multisine = (excitation == Excitation::Rich)
            .then(|| std::array::from_fn(|axis| Multisine::new(axis, draw)));
        let more = further(more, draw);
        if let Some(Manoeuvre::Hover { for_s }) = list.last_mut().filter(|_| !more.is_empty()) {
            *for_s = SETTLE_S;
            list.extend(more);
            list.push(Manoeuvre::Hover { for_s: DURATION_S });
        }
        let mut left = list.into_iter();
        let now = left.next().unwrap_or(Manoeuvre::Hover { for_s: DURATION_S });
        Self { left, now, begun_s: 0.0, start: reference, multisine, reference }
    }

    /// The reference at a time, `dt_s` after the one before.
    pub(super) fn step(&mut self, time_s: f64, dt_s: f64) -> Reference {
        while time_s - self.begun_s >= self.now.duration_s() {
            let Some(next) = self.left.next() else { break };
            self.begun_s += self.now.duration_s();
            self.start = self.reference;
            self.now = next;
        }
        let t = time_s - self.begun_s;
        let start = self.start;
        let r = &mut self.reference;
        (r.acceleration, r.yaw_rate, r.wing) = (Vector3::zeros(), 0.0, Vector2::zeros());
        let mut velocity = Vector3::zeros();
        let mut share = 1.0;
        match self.now {
            Manoeuvre::Hover { .. } => {}
            Manoeuvre::Open => {
                if t > OPEN_S[0] && t < OPEN_S[1] {
                    r.wing = Vector2::repeat(1.0);
                }
            }
            Manoeuvre::Rise { by_m, speed, rate } => {
                let (v, a) = trapezoid(t, speed, rate, by_m.abs() / speed - speed / rate);
                velocity.z = -v * by_m.signum();
                r.acceleration.z = -a * by_m.signum();
            }
            Manoeuvre::Dash { course, speed, wings } => {
                let (v, a) = trapezoid(t, speed, DASH_M_S2, CRUISE_S);
                let direction = Vector3::new(course.cos(), course.sin(), 0.0);
                velocity = v * direction;
                r.acceleration = a * direction;
                let share = EDGE_SHARE[usize::from(t > speed / DASH_M_S2)];
                if wings && v > share * speed {
                    r.wing = Vector2::repeat(1.0);
                }
            }
            Manoeuvre::Heave { speed, wings } => {
                let hold_s = heave_hold_s(wings);
                let half = 2.0 * speed / HEAVE_M_S2 + hold_s;
                let (up, t) = if t < half { (-1.0, t) } else { (1.0, t - half) };
                let (v, a) = trapezoid(t, speed, HEAVE_M_S2, hold_s);
                if wings && v > EDGE_SHARE[0] * speed {
                    r.wing = Vector2::repeat(1.0);
                }
                velocity.z = up * v;
                r.acceleration.z = up * a;
            }
            Manoeuvre::Turn { sign, step } => {
                let quarter = (t / (TURN_S + TURN_HOLD_S)).floor().min(3.0);
                let within = ((t - quarter * (TURN_S + TURN_HOLD_S)) / TURN_S).min(1.0);
                r.yaw = start.yaw + sign * step * (quarter + 0.5 - 0.5 * (PI * within).cos());
                r.yaw_rate = sign * step * 0.5 * PI / TURN_S * (PI * within).sin();
                share = QUIET;
            }
            Manoeuvre::Ladder => {
                let (mut from, mut begun) = (-start.position.z, 0.0);
                for (rung, (height, duration)) in LADDER_M.iter().zip(LADDER_S).enumerate() {
                    if t < begun + duration || rung + 1 == LADDER_M.len() {
                        // A smooth move in three fifths of the rung, hover in the rest.
                        let move_s = 0.6 * duration;
                        let x = ((t - begun) / move_s).clamp(0.0, 1.0);
                        let change = from - height;
                        velocity.z = change * 0.5 * PI / move_s * (PI * x).sin();
                        r.acceleration.z = change * 0.5 * (PI / move_s).powi(2) * (PI * x).cos();
                        if x >= 1.0 {
                            r.acceleration.z = 0.0;
                        }
                        break;
                    }
                    (from, begun) = (*height, begun + duration);
                }
                share = QUIET;
            }
        }
        r.position += velocity * dt_s;
        r.velocity = velocity;
        if let Some(sines) = &self.multisine {
            let wave: [f64; 4] =
                std::array::from_fn(|axis| share * MULTISINE[axis] * sines[axis].at(time_s));
            r.angular_rad_s2 = Vector3::new(wave[0], wave[1], wave[2]);
            r.heave_m_s2 = wave[3];
        }
        *r
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fly(excitation: Excitation, seed: u64) -> Vec<Reference> {
        fly_further(excitation, Further::default(), seed)
    }
    fn fly_further(excitation: Excitation, further: Further, seed: u64) -> Vec<Reference> {
        let mut programme = Programme::new(excitation, further, &mut Draw::new(seed));
        let ticks = (300.0 * (DURATION_S + further.duration_s())) as usize;
        (0..ticks).map(|k| programme.step(k as f64 / 300.0, 1.0 / 300.0)).collect()
    }

    #[test]
    fn rich_flights_hold_what_they_promise() {
        for seed in 0..30 {
            let flight = fly(Excitation::Rich, seed);
            let most =
                |f: &dyn Fn(&Reference) -> f64| flight.iter().map(f).fold(f64::MIN, f64::max);
            assert!(most(&|r| r.velocity.xy().norm()) > 8.1);
            assert!(most(&|r| r.velocity.z) > 2.4 && most(&|r| -r.velocity.z) > 2.4, "{seed}");
            let lowest = most(&|r| r.position.z);
            assert!((-0.25..-0.15).contains(&lowest), "{seed}: {lowest}");
            let turned = most(&|r| r.yaw) - flight.iter().map(|r| r.yaw).fold(f64::MAX, f64::min);
            assert!((turned - TAU).abs() < 0.01, "{seed}: {turned}");
            let fast_edges =
                flight.windows(2).filter(|w| w[0].wing != w[1].wing && w[0].velocity.norm() > 5.5);
            assert_eq!(fast_edges.count(), 6, "{seed}");
        }
    }

    /// The programme is the same to its last manoeuvre, and all that follows ends before the log.
    #[test]
    fn further_legs_come_after_the_programme() {
        for seed in 0..10 {
            let plain = fly(Excitation::Rich, seed);
            for (descents_m_s, opens_wings) in
                [(None, true), (Some([6.5, 9.5]), false), (Some([4.0, 10.0]), true)]
            {
                let further = Further { descents_m_s, opens_wings };
                let flight = fly_further(Excitation::Rich, further, seed);
                assert!(flight[..10_800].iter().zip(&plain).all(|(a, b)| a.position == b.position));
                let rest = &flight[11_000..];
                let edges = rest.windows(2).filter(|w| w[0].wing != w[1].wing).count();
                assert_eq!(edges, if opens_wings { 12 } else { 0 });
                let fastest = rest.iter().map(|r| r.velocity.z).fold(0.0, f64::max);
                assert!(
                    (fastest - descents_m_s.map_or(if opens_wings { 2.5 } else { 0.0 }, |v| v[1]))
                        .abs()
                        < 0.1
                );
                let lowest = rest.iter().map(|r| r.position.z).fold(f64::MIN, f64::max);
                assert!(lowest < -2.9, "{lowest}");
                assert_eq!(rest[rest.len() - 60].velocity.norm(), 0.0, "{seed} {further:?}");
            }
        }
    }

    #[test]
    fn calm_flights_are_calm() {
        for r in fly(Excitation::Calm, 3) {
            assert!(
                r.velocity.norm() < 2.0
                    && r.wing.norm() == 0.0
                    && r.yaw == 0.0
                    && r.heave_m_s2 == 0.0
            );
        }
    }

    #[test]
    fn velocity_is_the_rate_of_position_and_orders_differ() {
        let flight = fly(Excitation::Normal, 5);
        for w in flight.windows(2) {
            assert!((w[1].position - w[0].position - w[1].velocity / 300.0).norm() < 1e-9);
        }
        assert!((0..8).any(|seed| fly(Excitation::Normal, seed)[3000].wing.x > 0.0));
        let at = |seed| fly(Excitation::Rich, seed)[6000].position;
        assert_ne!(at(1), at(2));
    }
}
