//! The equations of `squirrel_core::dynamics` on registers of vehicles.
//!
//! Written out, operation by operation in the order of the core, so that a vehicle in a batch has the numbers of a vehicle
//! alone. No closures and no iterators in here: code must end up in the function that was compiled for the registers.

use super::Scheme;
use super::air::Forecast;
use super::craft::{FLAT, MEMBRANE, NONE};
use super::rows::{Airframe, Block, Held, Motion};
use super::simd::{Kernel, Paths, Register};
use squirrel_core::aero::flat_plate;
use squirrel_core::aero::membrane::{Membrane, Side, angle_of_attack};
use squirrel_core::aero::{Airflow, BodyWrench, drag};
use squirrel_core::dynamics::battery::Charge;
use squirrel_core::dynamics::rotors::{lag_rate, lag_start, spin, thrust_and_moment};
use squirrel_core::dynamics::servo::{Servo, ServoState};
use squirrel_core::dynamics::{Surroundings, body, with_effects};
use squirrel_core::effects::{PendulumState, Prepared, Present, Swing};
use squirrel_core::lane::vector::{self, minus, rotation, transposed_times, unit};
use squirrel_core::lane::{Row, load, store};
use squirrel_core::math::real;

/// Some steps of some blocks. Each block takes all of its steps before the next one takes its first.
pub(super) struct Advance<'a, S: Copy, const ROTORS: usize> {
    pub(super) blocks: &'a mut [Block<S, ROTORS>],
    pub(super) scheme: Scheme,
    pub(super) dt_s: S,
    pub(super) steps: usize,
}

/// [`Advance`] of blocks that have more than the base model: a kernel of its own, because one function with all variants has
/// a frame that overflows the stack where the compiler does not optimise.
pub(super) struct AdvanceWhole<'a, S: Copy, const ROTORS: usize>(pub(super) Advance<'a, S, ROTORS>);

/// For each rate that is taken: time ahead to where the next one is, and weight in the step, both s.
#[inline(always)]
fn runge_kutta<S: Paths>(dt: S) -> [[S; 2]; 4] {
    let (half, sixth, third) = (dt * real(0.5), dt * real(1.0 / 6.0), dt * real(1.0 / 3.0));
    [[half, sixth], [half, third], [dt, third], [real(0.0), sixth]]
}

impl<S: Paths, const ROTORS: usize> Kernel<S> for Advance<'_, S, ROTORS> {
    type Output = ();

    #[inline(always)]
    fn run<L: Register<Element = S>>(self) {
        for block in self.blocks {
            match self.scheme {
                Scheme::Euler => plain::<L, ROTORS, 1>(block, self.steps as u64, [[real(0.0), self.dt_s]]),
                Scheme::Rk4 => plain::<L, ROTORS, 4>(block, self.steps as u64, runge_kutta(self.dt_s)),
            }
        }
    }
}

impl<S: Paths, const ROTORS: usize> Kernel<S> for AdvanceWhole<'_, S, ROTORS> {
    type Output = ();

    #[inline(always)]
    fn run<L: Register<Element = S>>(self) {
        let dt = self.0.dt_s;
        match self.0.scheme {
            Scheme::Euler => self.with::<L, 1>([[real(0.0), dt]]),
            Scheme::Rk4 => self.with::<L, 4>(runge_kutta(dt)),
        }
    }
}

impl<S: Paths, const ROTORS: usize> AdvanceWhole<'_, S, ROTORS> {
    #[inline(always)]
    fn with<L: Register<Element = S>, const STAGES: usize>(self, stages: [[S; 2]; STAGES]) {
        let Advance { blocks, dt_s: dt, steps, .. } = self.0;
        let mut forecast = Forecast::empty();
        for block in blocks {
            let Some(kind) = block
                .extra
                .as_ref()
                .map(|extra| (extra.wing, extra.present.act_in_steps() || extra.present.has_load()))
            else {
                continue;
            };
            let mut left = steps as u64;
            while left > 0 {
                let steps = block.between(left, &mut forecast);
                let winds = forecast.winds();
                left -= steps;
                match kind {
                    (NONE, _) => fitted::<L, ROTORS, STAGES, NONE, true>(block, steps, winds, stages, dt),
                    (FLAT, _) => fitted::<L, ROTORS, STAGES, FLAT, true>(block, steps, winds, stages, dt),
                    (_, false) => {
                        fitted::<L, ROTORS, STAGES, MEMBRANE, false>(block, steps, winds, stages, dt);
                    }
                    (_, true) => fitted::<L, ROTORS, STAGES, MEMBRANE, true>(block, steps, winds, stages, dt),
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

/// What the derivative looks at of a vehicle that has more than the base model.
struct Whole<L: Register, const ROTORS: usize> {
    airframe: Airframe<L, ROTORS>,
    held: Held<L, ROTORS>,
    plate: flat_plate::Pair<L>,
    membrane: Membrane<L>,
    present: Present,
    effects: Prepared<L>,
    spin: [L; ROTORS],
    swing: Swing<L>,
    load: PendulumState<L>,
    /// Mean over the step.
    deployment: [L; 2],
    angle_rate: [L; 2],
}

/// Steps of blocks that have more than the base model, in the order of `crate::plant::Plant::step`.
///
/// * `winds` - that come, see `Forecast`
#[inline(always)]
fn fitted<L: Register, const ROTORS: usize, const STAGES: usize, const WING: u8, const EFFECTS: bool>(
    block: &mut Block<L::Element, ROTORS>,
    steps: u64,
    winds: &[(u64, [Row<L::Element>; 3])],
    stages: [[L::Element; 2]; STAGES],
    dt_s: L::Element,
) {
    let starts = block.starts::<L>();
    let Some(extra) = &mut block.extra else { return };
    let (lagless, dt) = (block.lagless, L::splat(dt_s));
    let per_step = L::splat(real::<L::Element>(1.0) / dt_s);
    for start in starts {
        let held = Held::<L, ROTORS>::load(&block.held, start);
        let asked = held.target_speed;
        let mut whole = Whole {
            airframe: Airframe::load(&block.airframe, start),
            held,
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
                whole.held.wind = load(&winds[blown].1, start);
                blown += 1;
            }
            if EFFECTS && let Some(charge) = &charge {
                whole.held.target_speed = asked;
                whole.effects.rotor_targets(whole.present, &mut whole.held.target_speed, charge.voltage_v);
            }
            if lagless {
                settle(&whole.airframe, &whole.held, &mut state);
            }
            if WING != NONE {
                for side in 0..2 {
                    whole.deployment[side] = servo.lead(&mut deployment[side], dt);
                }
            }
            if WING == MEMBRANE {
                let columns = rotation(&state.attitude);
                let air = air::<L, ROTORS, EFFECTS>(&whole, &state, &columns);
                let lateral = lateral(whole.membrane.arm_m);
                for side in 0..2 {
                    let now = angle_of_attack(&air, lateral[side]);
                    whole.angle_rate[side] = (now - angle[side]) * per_step;
                    angle[side] = now;
                }
            }
            let (mut stage, mut next, mut sides_stage, mut sides_next) = (state, state, sides, sides);
            for k in 0..STAGES {
                let (rate, sides_rate) =
                    whole_derivative::<L, ROTORS, WING, EFFECTS>(&whole, &stage, &sides_stage);
                let [ahead, weight] = stages[k];
                if k + 1 < STAGES {
                    stage = plus_scaled(&state, L::splat(ahead), &rate);
                    if WING == MEMBRANE {
                        sides_stage = moved(&sides, L::splat(ahead), &sides_rate);
                    }
                }
                next = plus_scaled(&next, L::splat(weight), &rate);
                if WING == MEMBRANE {
                    sides_next = moved(&sides_next, L::splat(weight), &sides_rate);
                }
            }
            next.attitude = unit(&next.attitude);
            sides = sides_next;
            if let (Some(packs), Some(charge)) = (&extra.packs, &mut charge) {
                packs.step(charge, start, &state.rotor_speed, dt);
            }
            if EFFECTS && whole.present.has_load() {
                let gained = minus(&next.velocity, &state.velocity);
                whole.swing.lead(&mut whole.load, [gained[0] * per_step, gained[1] * per_step]);
            }
            state = next;
        }
        state.store(&mut block.motion, start);
        store(&whole.held.wind, &mut block.held.wind, start);
        whole.load.store(&mut extra.load, start);
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

/// Each side's distance from the x axis, m.
#[inline(always)]
fn lateral<L: Register>(arm_m: L) -> [L; 2] {
    [L::of(0.0) - arm_m, arm_m]
}

#[inline(always)]
fn moved<L: Register>(sides: &[Side<L>; 2], h: L, rate: &[Side<L>; 2]) -> [Side<L>; 2] {
    [sides[0].plus_scaled(h, &rate[0]), sides[1].plus_scaled(h, &rate[1])]
}

/// Motion through the air.
#[inline(always)]
fn air<L: Register, const ROTORS: usize, const EFFECTS: bool>(
    whole: &Whole<L, ROTORS>,
    state: &Motion<L, ROTORS>,
    columns: &[[L; 3]; 3],
) -> Airflow<L> {
    let mut wind = whole.held.wind;
    if EFFECTS {
        let [north, east] = whole.effects.wind(whole.present, L::of(0.0) - state.position[2]);
        (wind[0], wind[1]) = (wind[0] + north, wind[1] + east);
    }
    airflow(state, &wind, columns)
}

/// Motion through air that moves with `wind`.
#[inline(always)]
fn airflow<L: Register, const ROTORS: usize>(
    state: &Motion<L, ROTORS>,
    wind: &[L; 3],
    columns: &[[L; 3]; 3],
) -> Airflow<L> {
    let relative = minus(&state.velocity, wind);
    Airflow {
        velocity: transposed_times(columns, &relative),
        speed: vector::dot(&relative, &relative).root(),
        omega: state.omega,
    }
}

/// `squirrel_core::dynamics::derivative` with wings and effects.
#[inline(always)]
fn whole_derivative<L: Register, const ROTORS: usize, const WING: u8, const EFFECTS: bool>(
    whole: &Whole<L, ROTORS>,
    state: &Motion<L, ROTORS>,
    sides: &[Side<L>; 2],
) -> (Motion<L, ROTORS>, [Side<L>; 2]) {
    let none = L::of(0.0);
    let columns = rotation(&state.attitude);
    let air = air::<L, ROTORS, EFFECTS>(whole, state, &columns);
    let airframe = &whole.airframe;
    let rotors = rotors(airframe, &state.rotor_speed);

    let mut sides_rate = *sides;
    let mut rest = BodyWrench::zero();
    if WING == FLAT {
        rest = whole.plate.wrench(whole.plate.normal_forces(&air, &whole.deployment));
    }
    if WING == MEMBRANE {
        let y = lateral(whole.membrane.arm_m);
        let (rate, open) = (&whole.angle_rate, &whole.deployment);
        let ([f, m], left) = whole.membrane.evaluate(&air, y[0], rate[0], open[0], &sides[0]);
        let ([g, n], right) = whole.membrane.evaluate(&air, y[1], rate[1], open[1], &sides[1]);
        rest = BodyWrench { force: vector::plus(&f, &g), moment: vector::plus(&m, &n) };
        sides_rate = [left, right];
    }
    rest.force = minus(&rest.force, &drag(&airframe.linear_drag, airframe.quadratic_drag, &air));
    let rotor_rate = rotor_rates(airframe, &whole.held, &state.rotor_speed);
    let sum = if EFFECTS {
        let mut rotor_spin = [none; 2];
        if Prepared::<L>::feel_rotor_spin(whole.present) {
            rotor_spin = [spin(&whole.spin, &state.rotor_speed), spin(&whole.spin, &rotor_rate)];
        }
        let at = Surroundings {
            flow: &air,
            ned_from_body: &columns,
            height_m: none - state.position[2],
            inverse_mass: airframe.inverse_mass,
            rotor_spin,
            wings: &whole.plate,
            deployment: whole.deployment,
            tether_force: if whole.present.has_load() { Some(whole.swing.force(&whole.load)) } else { None },
        };
        with_effects(&whole.effects, whole.present, [&rotors, &rest], &at)
    } else {
        rotors.plus(&rest)
    };
    (body_rate(airframe, state, &columns, &sum, rotor_rate), sides_rate)
}

/// A rotor without lag is at its target at once.
#[inline(always)]
fn settle<L: Register, const ROTORS: usize>(
    airframe: &Airframe<L, ROTORS>,
    held: &Held<L, ROTORS>,
    state: &mut Motion<L, ROTORS>,
) {
    for i in 0..ROTORS {
        state.rotor_speed[i] = lag_start(held.target_speed[i], state.rotor_speed[i], airframe.inverse_lag);
    }
}

/// `squirrel_core::dynamics::derivative` without surfaces and effects.
#[inline(always)]
fn derivative<L: Register, const ROTORS: usize>(
    airframe: &Airframe<L, ROTORS>,
    held: &Held<L, ROTORS>,
    state: &Motion<L, ROTORS>,
) -> Motion<L, ROTORS> {
    let columns = rotation(&state.attitude);
    let air = airflow(state, &held.wind, &columns);
    let mut sum = rotors(airframe, &state.rotor_speed);
    sum.force = minus(&sum.force, &drag(&airframe.linear_drag, airframe.quadratic_drag, &air));
    let rotor_rate = rotor_rates(airframe, held, &state.rotor_speed);
    body_rate(airframe, state, &columns, &sum, rotor_rate)
}

/// Thrust and moment of all rotors.
#[inline(always)]
fn rotors<L: Register, const ROTORS: usize>(
    airframe: &Airframe<L, ROTORS>,
    speed: &[L; ROTORS],
) -> BodyWrench<L> {
    let none = L::of(0.0);
    let per_square = [&airframe.thrust, &airframe.roll, &airframe.pitch, &airframe.yaw];
    let (thrust, moment) = thrust_and_moment(per_square, speed);
    BodyWrench { force: [none, none, none - thrust], moment }
}

#[inline(always)]
fn rotor_rates<L: Register, const ROTORS: usize>(
    airframe: &Airframe<L, ROTORS>,
    held: &Held<L, ROTORS>,
    speed: &[L; ROTORS],
) -> [L; ROTORS] {
    let mut rate = *speed;
    for i in 0..ROTORS {
        rate[i] = lag_rate(held.target_speed[i], speed[i], airframe.inverse_lag);
    }
    rate
}

/// What force and moment, body frame, make of the motion.
#[inline(always)]
fn body_rate<L: Register, const ROTORS: usize>(
    airframe: &Airframe<L, ROTORS>,
    state: &Motion<L, ROTORS>,
    columns: &[[L; 3]; 3],
    wrench: &BodyWrench<L>,
    rotor_rate: [L; ROTORS],
) -> Motion<L, ROTORS> {
    let inertia = [&airframe.inertia, &airframe.inertia_inverse];
    Motion {
        position: state.velocity,
        velocity: body::acceleration(columns, &wrench.force, airframe.inverse_mass),
        attitude: body::attitude_rate(&state.attitude, &state.omega),
        omega: body::angular_acceleration(inertia, &state.omega, &wrench.moment),
        rotor_speed: rotor_rate,
    }
}

#[inline(always)]
fn plus_scaled<L: Register, const ROTORS: usize>(
    state: &Motion<L, ROTORS>,
    h: L,
    rate: &Motion<L, ROTORS>,
) -> Motion<L, ROTORS> {
    use vector::plus_scaled;
    Motion {
        position: plus_scaled(&state.position, h, &rate.position),
        velocity: plus_scaled(&state.velocity, h, &rate.velocity),
        attitude: plus_scaled(&state.attitude, h, &rate.attitude),
        omega: plus_scaled(&state.omega, h, &rate.omega),
        rotor_speed: plus_scaled(&state.rotor_speed, h, &rate.rotor_speed),
    }
}
