//! Steps of blocks: the equations of `squirrel_core::dynamics` on registers of vehicles.
//!
//! The core's own, so that a vehicle in a batch has the numbers of a vehicle alone. No closures and
//! no iterators in here: code must end up in the function that was compiled for the registers.

use super::Scheme;
use super::air::Forecast;
use super::rows::Block;
use squirrel_core::aero::flat_plate;
use squirrel_core::aero::membrane::{Membrane, Side};
use squirrel_core::dynamics::battery::Charge;
use squirrel_core::dynamics::lanes::{Airframe, Held, Motion, derivative, plus_scaled, settle};
use squirrel_core::dynamics::runge_kutta;
use squirrel_core::dynamics::servo::{Servo, ServoState};
use squirrel_core::dynamics::whole::{self, FLAT, MEMBRANE, NONE, Whole, lateral};
use squirrel_core::effects::{PendulumState, Prepared, Swing};
use squirrel_core::lane::vector::{minus, rotation, scaled, unit};
use squirrel_core::lane::{Row, load, store};
use squirrel_core::math::real;
use squirrel_sim::simd::{Kernel, Paths, Register};

/// Some steps of some blocks. Each block takes all of its steps before the next one takes its
/// first.
pub(super) struct Advance<'a, S: Copy, const ROTORS: usize> {
    pub(super) blocks: &'a mut [Block<S, ROTORS>],
    pub(super) scheme: Scheme,
    pub(super) dt_s: S,
    pub(super) steps: usize,
}

/// [`Advance`] of blocks that have more than the base model: a kernel of its own, because one
/// function with all variants has a frame that overflows the stack where the compiler does not
/// optimise.
pub(super) struct AdvanceWhole<'a, S: Copy, const ROTORS: usize>(pub(super) Advance<'a, S, ROTORS>);

impl<S: Paths, const ROTORS: usize> Kernel<S> for Advance<'_, S, ROTORS> {
    type Output = ();

    #[inline(always)]
    fn run<L: Register<Element = S>>(self) {
        for block in self.blocks {
            match self.scheme {
                Scheme::Euler => {
                    plain::<L, ROTORS, 1>(block, self.steps as u64, [[real(0.0), self.dt_s]]);
                }
                Scheme::Rk4 => {
                    plain::<L, ROTORS, 4>(block, self.steps as u64, runge_kutta(self.dt_s));
                }
            }
        }
    }
}

impl<S: Paths, const ROTORS: usize> Kernel<S> for AdvanceWhole<'_, S, ROTORS> {
    type Output = ();

    #[inline(always)]
    fn run<L: Register<Element = S>>(self) {
        let Advance { blocks, scheme, dt_s, steps } = self.0;
        let dt = L::splat(dt_s);
        let (euler, rk4) = ([[L::of(0.0), dt]], runge_kutta(dt));
        let stages: &[[L; 2]] = match scheme {
            Scheme::Euler => &euler,
            Scheme::Rk4 => &rk4,
        };
        let mut forecast = Forecast::empty();
        for block in blocks {
            let Some(kind) =
                block.extra.as_ref().map(|extra| (extra.wing, extra.present.act_in_steps()))
            else {
                continue;
            };
            let mut left = steps as u64;
            while left > 0 {
                let steps = block.between(left, &mut forecast);
                let winds = forecast.winds();
                left -= steps;
                match kind {
                    (NONE, _) => {
                        fitted::<L, ROTORS, NONE, true>(block, steps, winds, stages, dt);
                    }
                    (FLAT, _) => {
                        fitted::<L, ROTORS, FLAT, true>(block, steps, winds, stages, dt);
                    }
                    (_, false) => {
                        fitted::<L, ROTORS, MEMBRANE, false>(block, steps, winds, stages, dt);
                    }
                    (_, true) => {
                        fitted::<L, ROTORS, MEMBRANE, true>(block, steps, winds, stages, dt);
                    }
                }
            }
        }
    }
}

/// Steps of the base model.
#[inline(always)]
fn plain<L: Register, const ROTORS: usize, const STAGES: usize>(
    block: &mut Block<L::Element, ROTORS>,
    steps: u64,
    stages: [[L::Element; 2]; STAGES],
) {
    let lagless = block.lagless;
    for start in block.starts::<L>() {
        let airframe = Airframe::<L, ROTORS>::load(&block.airframe, start);
        let held = Held::<L, ROTORS>::load(&block.held, start);
        let mut state = Motion::<L, ROTORS>::load(&block.motion, start);
        for _ in 0..steps {
            if lagless {
                settle(&airframe, &held, &mut state);
            }
            let (mut stage, mut next) = (state, state);
            for k in 0..STAGES {
                let rate = derivative(&airframe, &held, &stage);
                let [ahead, weight] = stages[k];
                if k + 1 < STAGES {
                    stage = plus_scaled(&state, L::splat(ahead), &rate);
                }
                next = plus_scaled(&next, L::splat(weight), &rate);
            }
            next.attitude = unit(&next.attitude);
            state = next;
        }
        state.store(&mut block.motion, start);
    }
}

/// Steps of blocks that have more than the base model, in the order of `squirrel_sim::plant::Plant::step`.
///
/// * `winds` - that come, see `Forecast`
#[inline(always)]
fn fitted<L: Register, const ROTORS: usize, const WING: u8, const EFFECTS: bool>(
    block: &mut Block<L::Element, ROTORS>,
    steps: u64,
    winds: &[(u64, [Row<L::Element>; 3])],
    stages: &[[L; 2]],
    dt: L,
) {
    let starts = block.starts::<L>();
    let Some(extra) = &mut block.extra else { return };
    let (lagless, per_step) = (block.lagless, L::of(1.0) / dt);
    for start in starts {
        let held = Held::<L, ROTORS>::load(&block.held, start);
        let asked = held.target_speed;
        let mut vehicle = Whole {
            airframe: Airframe::load(&block.airframe, start),
            held,
            air_omega: if extra.airs.turn() { Some(load(&extra.air_omega, start)) } else { None },
            plate: flat_plate::Pair::load(&extra.plate, start),
            membrane: Membrane::load(&extra.membrane, start),
            present: extra.present,
            effects: Prepared::load(&extra.effects, start),
            spin: load(&extra.spin, start),
            swing: Swing::load(&extra.swing, start),
            load: PendulumState::load(&extra.load, start),
            deployment: [L::of(0.0); 2],
            angle_rate: [L::of(0.0); 2],
        };
        let servo = Servo::<L>::load(&extra.servo, start);
        let [left, right] = &extra.deployment;
        let mut deployment = [ServoState::<L>::load(left, start), ServoState::load(right, start)];
        let mut angle = load(&extra.wing_angle, start);
        let [left, right] = &extra.sides;
        let mut sides = [Side::<L>::load(left, start), Side::load(right, start)];
        let mut charge = extra.packs.as_ref().map(|packs| Charge::<L>::load(&packs.charge, start));
        let mut state = Motion::<L, ROTORS>::load(&block.motion, start);
        let mut blown = 0;
        for step in 0..steps {
            if blown < winds.len() && winds[blown].0 == step {
                vehicle.held.wind = load(&winds[blown].1, start);
                blown += 1;
            }
            if EFFECTS && let Some(charge) = &charge {
                vehicle.held.target_speed = asked;
                vehicle.effects.rotor_targets(
                    vehicle.present,
                    &mut vehicle.held.target_speed,
                    charge.voltage_v,
                );
            }
            if lagless {
                settle(&vehicle.airframe, &vehicle.held, &mut state);
            }
            if WING != NONE {
                for side in 0..2 {
                    vehicle.deployment[side] = servo.lead(&mut deployment[side], dt);
                }
            }
            if WING == MEMBRANE {
                let columns = rotation(&state.attitude);
                let air = whole::air::<L, ROTORS, EFFECTS>(&vehicle, &state, &columns);
                let lateral = lateral(vehicle.membrane.arm_m);
                for side in 0..2 {
                    let now = vehicle.membrane.angle_of_attack(&air, lateral[side]);
                    vehicle.angle_rate[side] = (now - angle[side]) * per_step;
                    angle[side] = now;
                }
            }
            let (next, moved) =
                whole::step::<L, ROTORS, WING, EFFECTS>(&vehicle, stages, &state, &sides);
            sides = moved;
            if let (Some(packs), Some(charge)) = (&extra.packs, &mut charge) {
                packs.step(charge, start, &state.rotor_speed, dt);
            }
            if EFFECTS && vehicle.present.has_load() {
                let gained = minus(&next.velocity, &state.velocity);
                vehicle.swing.lead(&mut vehicle.load, scaled(&gained, per_step));
            }
            state = next;
        }
        state.store(&mut block.motion, start);
        store(&vehicle.held.wind, &mut block.held.wind, start);
        vehicle.load.store(&mut extra.load, start);
        store(&angle, &mut extra.wing_angle, start);
        for side in 0..2 {
            deployment[side].store(&mut extra.deployment[side], start);
            sides[side].store(&mut extra.sides[side], start);
        }
        if let (Some(packs), Some(charge)) = (&mut extra.packs, &charge) {
            charge.store(&mut packs.charge, start);
        }
    }
}
