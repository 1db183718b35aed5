//! What vehicles of a block have on top of the base model: wings, battery, effects, gusts, commands on their way.
//!
//! Gusts and late commands change between steps. The steps of a call are therefore cut where the next of them is due, which
//! changes no number: a flight is the same however it is cut.

use super::battery::Packs;
use super::craft::Fitted;
use super::effects::{Payload, Present, Sizes};
use super::rows::{Block, Row, put, take};
use super::servo::{Deployment, Servo};
use super::simd::{BLOCK, Paths};
use super::wing::{Membrane, Plate, Sides};
use crate::flight::CONTROL_RATE_HZ;
use crate::plant::Wind;
use nalgebra::{Vector3, try_convert};
use squirrel_core::frames::{In, Ned};
use squirrel_core::math::real;
use std::collections::VecDeque;

/// A command for one vehicle.
#[derive(Debug, Clone, Copy)]
pub(super) enum Command<S, const ROTORS: usize> {
    /// Steady rotor speeds, rad/s.
    Rotors([S; ROTORS]),
    /// Left and right wing, 0..1.
    Wings([S; 2]),
}

/// A command on its way.
#[derive(Debug, Clone)]
struct Late<S, const ROTORS: usize> {
    due: u64,
    lane: usize,
    command: Command<S, ROTORS>,
}

/// See the module.
#[derive(Debug, Clone)]
pub(super) struct Extra<S: Copy, const ROTORS: usize> {
    /// `NONE`, `FLAT` or `MEMBRANE` of `wing`, for the whole batch.
    pub(super) wing: u8,
    pub(super) plate: Plate<Row<S>>,
    pub(super) membrane: Membrane<Row<S>>,
    pub(super) sides: Sides<Row<S>>,
    /// Angle of attack of each side at the last step.
    pub(super) wing_angle: [Row<S>; 2],
    pub(super) servo: Servo<Row<S>>,
    pub(super) deployment: Deployment<Row<S>>,
    pub(super) packs: Option<Packs<S>>,
    pub(super) present: Present,
    pub(super) sizes: Sizes<Row<S>>,
    /// Signs of the rotors' spin about +z.
    pub(super) spin: [Row<S>; ROTORS],
    pub(super) load: Payload<Row<S>>,
    pub(super) latency_steps: [u64; BLOCK],
    late: VecDeque<Late<S, ROTORS>>,
    /// Steps that the block has taken.
    clock: u64,
    airs: Vec<Vec<Wind>>,
    /// Gusts moved on so far, and the clock when they last did.
    gust_ticks: u64,
    gust_clock: u64,
}

impl<S: Paths, const ROTORS: usize> Extra<S, ROTORS> {
    pub(super) fn empty(fitted: &Fitted) -> Self {
        let none = [real::<S>(0.0); BLOCK];
        let one = [real::<S>(1.0); BLOCK];
        Self {
            wing: fitted.wing,
            plate: Plate::all(none),
            membrane: Membrane::all(none),
            sides: Sides { attached: [one; 2], ..Sides::all(none) },
            wing_angle: [none; 2],
            servo: Servo { rate_max: one, opening_s: one, closing_s: one, ..Servo::all(none) },
            deployment: Deployment::all(none),
            packs: (fitted.stretches > 0).then(|| Packs::empty(fitted.stretches)),
            present: fitted.present,
            sizes: Sizes {
                per_reference_voltage: one,
                per_speed_max: one,
                ground_floor: one,
                ..Sizes::all(none)
            },
            spin: [none; ROTORS],
            load: Payload::all(none),
            latency_steps: [0; BLOCK],
            late: VecDeque::new(),
            clock: 0,
            airs: vec![Vec::new(); BLOCK],
            gust_ticks: 0,
            gust_clock: 0,
        }
    }

    /// Everything that remembers at rest: wings folded and flat, load hanging, battery rested.
    ///
    /// * `charge` - of the battery, 0..1
    pub(super) fn rest(&mut self, lane: usize, charge: S) {
        self.sides.put(lane, &Sides::at_rest());
        self.deployment.put(lane, &Deployment::at_rest());
        self.load.put(lane, &Payload::all(real(0.0)));
        put(&mut self.wing_angle, lane, [real(0.0); 2]);
        self.late.retain(|late| late.lane != lane);
        if let Some(packs) = &mut self.packs {
            packs.rest(lane, charge);
        }
    }

    /// Sends a command, which arrives when the vehicle's latency has passed.
    pub(super) fn send(&mut self, lane: usize, command: Command<S, ROTORS>) {
        let due = self.clock.saturating_add(self.latency_steps[lane]);
        self.late.push_back(Late { due, lane, command });
    }

    /// Tells the servos of a vehicle where to go; a command that changes within the dead time replaces the one that waits.
    pub(super) fn ask_wings(&mut self, lane: usize, command: [S; 2]) {
        let state = &mut self.deployment;
        for side in 0..2 {
            if command[side] != state.waiting[side][lane] {
                state.waiting[side][lane] = command[side];
                state.wait_s[side][lane] = self.servo.dead_time[lane];
            }
        }
    }

    /// Other air about a vehicle. The first that moves finds the clock of gusts where it were if there had always been some.
    pub(super) fn put_air(&mut self, lane: usize, airs: Vec<Wind>, dt_s: f64) {
        if self.airs.iter().all(Vec::is_empty) && self.clock > 0 {
            let per_step = gusts_per_step(dt_s);
            let mut tick = (self.clock as f64 * per_step + 1e-6) as u64;
            while tick > 0 && gust_due(tick, per_step) >= self.clock {
                tick -= 1;
            }
            self.gust_clock = gust_due(tick, per_step);
            self.gust_ticks = (self.gust_clock as f64 * per_step + 1e-6) as u64 + 1;
        }
        self.airs[lane] = airs;
    }

    /// Velocity of the air about a vehicle that has air of its own, m/s.
    pub(super) fn air(&self, lane: usize) -> Option<In<Ned, S>> {
        let airs = &self.airs[lane];
        let sum = airs.iter().fold(In::<Ned, f64>::zero(), |sum, air| sum + air.velocity());
        (!airs.is_empty()).then(|| In::new(sum.vector.map(real)))
    }
}

impl<S: Paths, const ROTORS: usize> Block<S, ROTORS> {
    /// Does what is due between two steps; steps, at most `left`, until something is due again.
    pub(super) fn between(&mut self, left: u64, dt_s: f64) -> u64 {
        let Some(extra) = &mut self.extra else { return left };
        let mut until = extra.clock.saturating_add(left);
        let mut arrived = Vec::new();
        extra.late.retain(|late| {
            if late.due <= extra.clock {
                arrived.push((late.lane, late.command));
            } else {
                until = until.min(late.due);
            }
            late.due > extra.clock
        });
        for (lane, command) in arrived {
            match command {
                Command::Rotors(targets) => put(&mut self.held.target_speed, lane, targets),
                Command::Wings(wings) => extra.ask_wings(lane, wings),
            }
        }
        if extra.airs.iter().any(|airs| !airs.is_empty()) {
            let per_step = gusts_per_step(dt_s);
            if gust_due(extra.gust_ticks, per_step) <= extra.clock {
                let passed_s = (extra.clock - extra.gust_clock) as f64 * dt_s;
                for lane in 0..BLOCK {
                    if !extra.airs[lane].is_empty() {
                        let through =
                            through_air(&take(&self.motion.velocity, lane), &take(&self.held.wind, lane));
                        let height = real::<S>(0.0) - self.motion.position[2][lane];
                        let [north, east] = extra.sizes.take(lane).wind_at(extra.present, height);
                        let through = through - Vector3::new(north, east, 0.0);
                        for air in &mut extra.airs[lane] {
                            air.advance(passed_s, through.norm());
                        }
                        if let Some(air) = extra.air(lane) {
                            put(&mut self.held.wind, lane, air.vector.into());
                        }
                    }
                }
                extra.gust_ticks = (extra.clock as f64 * per_step + 1e-6) as u64 + 1;
                extra.gust_clock = extra.clock;
            }
            until = until.min(gust_due(extra.gust_ticks, per_step).max(extra.clock + 1));
        }
        let steps = until - extra.clock;
        extra.clock = until;
        steps
    }

    /// Where the block has wings, what the vehicle in column `lane` shows of them: deployment, left and right.
    pub(super) fn deployment(&self, lane: usize) -> [S; 2] {
        self.extra.as_ref().map_or([real(0.0); 2], |extra| take(&extra.deployment.now, lane))
    }
}

/// Gusts move at the rate of the flight code.
fn gusts_per_step(dt_s: f64) -> f64 {
    dt_s * CONTROL_RATE_HZ as f64
}

/// The first step at or after a move of the gusts, as in a flight.
fn gust_due(tick: u64, per_step: f64) -> u64 {
    ((tick as f64 - 1e-6) / per_step).ceil().max(0.0) as u64
}

/// Velocity through the air, m/s.
fn through_air<S: Paths>(velocity: &[S; 3], wind: &[S; 3]) -> Vector3<f64> {
    Vector3::from_fn(|i, _| try_convert::<S, f64>(velocity[i] - wind[i]).unwrap_or(f64::NAN))
}

impl<S: Paths> Sizes<S> {
    /// Wind that the effects of one vehicle add, north and east, m/s.
    fn wind_at(&self, present: Present, height: S) -> [f64; 2] {
        self.wind(present, height).map(|x| try_convert::<S, f64>(x).unwrap_or(f64::NAN))
    }
}
