//! What vehicles of a block have on top of the base model: wings, battery, effects, gusts, commands on their way.
//!
//! Late commands, and gusts that ask for the airspeed, change between steps. The steps of a call are therefore cut where the next of
//! them is due, which changes no number: a flight is the same however it is cut.

use super::air::{Airs, Forecast};
use super::battery::Packs;
use super::craft::Fitted;
use super::effects::{Payload, Present, Sizes};
use super::rows::{Block, Row, put, take};
use super::servo::{Deployment, Servo};
use super::simd::{BLOCK, Paths};
use super::wing::{Membrane, Plate, Sides};
use nalgebra::{Vector3, try_convert};
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
    pub(super) clock: u64,
    pub(super) airs: Airs,
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
            airs: Airs::none(),
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
}

impl<S: Paths, const ROTORS: usize> Block<S, ROTORS> {
    /// Does what is due between two steps; steps, at most `left`, until something is due again.
    ///
    /// * `forecast` - filled with the winds of these steps that are not the one now
    pub(super) fn between(&mut self, left: u64, forecast: &mut Forecast<S>) -> u64 {
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
        let Extra { airs, sizes, present, clock, .. } = &mut **extra;
        let (motion, wind) = (&self.motion, self.held.wind);
        let airspeed_m_s = |lane| {
            let through = through_air(&take(&motion.velocity, lane), &take(&wind, lane));
            let [north, east] = sizes.take(lane).wind_at(*present, real::<S>(0.0) - motion.position[2][lane]);
            (through - Vector3::new(north, east, 0.0)).norm()
        };
        until = airs.advance(*clock, until, &mut self.held.wind, forecast, airspeed_m_s);
        let steps = until - extra.clock;
        extra.clock = until;
        steps
    }

    /// Where the block has wings, what the vehicle in column `lane` shows of them: deployment, left and right.
    pub(super) fn deployment(&self, lane: usize) -> [S; 2] {
        self.extra.as_ref().map_or([real(0.0); 2], |extra| take(&extra.deployment.now, lane))
    }
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
