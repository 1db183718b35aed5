//! The equations of `squirrel_core::dynamics` on registers of vehicles.
//!
//! Written out, operation by operation in the order of the core, so that a vehicle in a batch has the numbers of a vehicle
//! alone. No closures and no iterators in here: code must end up in the function that was compiled for the registers.

use super::Scheme;
use super::air::Forecast;
use super::battery::{Charge, Pack};
use super::effects::{Payload, Present, Situation, Sizes};
use super::rows::{Airframe, Block, Held, Motion, Row, load, store};
use super::servo::{Deployment, Servo};
use super::simd::{Kernel, Lanes, Paths};
use super::wing::{Air, FLAT, MEMBRANE, Membrane, NONE, Plate, Sides, Wrench};
use squirrel_core::math::{GRAVITY_M_S2, real};

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
    fn run<L: Lanes<Weight = S>>(self) {
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
    fn run<L: Lanes<Weight = S>>(self) {
        let dt = self.0.dt_s;
        match self.0.scheme {
            Scheme::Euler => self.with::<L, 1>([[real(0.0), dt]]),
            Scheme::Rk4 => self.with::<L, 4>(runge_kutta(dt)),
        }
    }
}

impl<S: Paths, const ROTORS: usize> AdvanceWhole<'_, S, ROTORS> {
    #[inline(always)]
    fn with<L: Lanes<Weight = S>, const STAGES: usize>(self, stages: [[S; 2]; STAGES]) {
        let Advance { blocks, dt_s: dt, steps, .. } = self.0;
        let mut forecast = Forecast::empty();
        for block in blocks {
            let Some(kind) = block.extra.as_ref().map(|extra| (extra.wing, extra.present.any_in_steps()))
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
fn plain<L: Lanes, const ROTORS: usize, const STAGES: usize>(
    block: &mut Block<L::Weight, ROTORS>,
    steps: u64,
    stages: [[L::Weight; 2]; STAGES],
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
struct Whole<L, const ROTORS: usize> {
    airframe: Airframe<L, ROTORS>,
    held: Held<L, ROTORS>,
    plate: Plate<L>,
    membrane: Membrane<L>,
    present: Present,
    sizes: Sizes<L>,
    spin: [L; ROTORS],
    load: Payload<L>,
    /// Mean over the step.
    deployment: [L; 2],
    angle_rate: [L; 2],
}

/// Steps of blocks that have more than the base model, in the order of `crate::plant::Plant::step`.
///
/// * `winds` - that come, see `Forecast`
#[inline(always)]
fn fitted<L: Lanes, const ROTORS: usize, const STAGES: usize, const WING: u8, const EFFECTS: bool>(
    block: &mut Block<L::Weight, ROTORS>,
    steps: u64,
    winds: &[(u64, [Row<L::Weight>; 3])],
    stages: [[L::Weight; 2]; STAGES],
    dt_s: L::Weight,
) {
    let starts = block.starts::<L>();
    let Some(extra) = &mut block.extra else { return };
    let (lagless, dt) = (block.lagless, L::splat(dt_s));
    let per_step = L::splat(real::<L::Weight>(1.0) / dt_s);
    for start in starts {
        let held = Held::<L, ROTORS>::load(&block.held, start);
        let asked = held.target_speed;
        let mut whole = Whole {
            airframe: Airframe::load(&block.airframe, start),
            held,
            plate: Plate::load(&extra.plate, start),
            membrane: Membrane::load(&extra.membrane, start),
            present: extra.present,
            sizes: Sizes::load(&extra.sizes, start),
            spin: load(&extra.spin, start),
            load: Payload::load(&extra.load, start),
            deployment: [L::zero(); 2],
            angle_rate: [L::zero(); 2],
        };
        let servo = Servo::<L>::load(&extra.servo, start);
        let mut deployment = Deployment::<L>::load(&extra.deployment, start);
        let mut angle = load(&extra.wing_angle, start);
        let mut sides = Sides::<L>::load(&extra.sides, start);
        let mut charge = extra.packs.as_ref().map(|packs| Charge::<L>::load(&packs.charge, start));
        let mut state = Motion::<L, ROTORS>::load(&block.motion, start);
        let mut blown = 0;
        for step in 0..steps {
            if blown < winds.len() && winds[blown].0 == step {
                whole.held.wind = load(&winds[blown].1, start);
                blown += 1;
            }
            if EFFECTS
                && whole.present.battery_sag
                && let Some(charge) = &charge
            {
                whole.held.target_speed = whole.sizes.sag(&asked, charge.voltage_v);
            }
            if lagless {
                settle(&whole.airframe, &whole.held, &mut state);
            }
            if WING != NONE {
                whole.deployment = servo.lead(&mut deployment, dt);
            }
            if WING == MEMBRANE {
                let columns = rotation_columns(&state.attitude);
                let air = air::<L, ROTORS, EFFECTS>(&whole, &state, &columns);
                let now = whole.membrane.angle_of_attack(&air);
                for side in 0..2 {
                    whole.angle_rate[side] = (now[side] - angle[side]) * per_step;
                }
                angle = now;
            }
            let (mut stage, mut next, mut sides_stage, mut sides_next) = (state, state, sides, sides);
            for k in 0..STAGES {
                let (rate, sides_rate) =
                    whole_derivative::<L, ROTORS, WING, EFFECTS>(&whole, &stage, &sides_stage);
                let [ahead, weight] = stages[k];
                if k + 1 < STAGES {
                    stage = plus_scaled(&state, L::splat(ahead), &rate);
                    if WING == MEMBRANE {
                        sides_stage = sides.plus_scaled(L::splat(ahead), &sides_rate);
                    }
                }
                next = plus_scaled(&next, L::splat(weight), &rate);
                if WING == MEMBRANE {
                    sides_next = sides_next.plus_scaled(L::splat(weight), &sides_rate);
                }
            }
            next.attitude = unit(&next.attitude);
            sides = sides_next;
            if let (Some(packs), Some(charge)) = (&extra.packs, &mut charge) {
                let pack = Pack::load(&packs.pack, start);
                pack.step(charge, &packs.table, start, &state.rotor_speed, dt);
            }
            if EFFECTS && whole.present.payload_swing {
                let gained = minus(&next.velocity, &state.velocity);
                whole.sizes.swing(&mut whole.load, [gained[0] * per_step, gained[1] * per_step]);
            }
            state = next;
        }
        state.store(&mut block.motion, start);
        store(&whole.held.wind, &mut block.held.wind, start);
        whole.load.store(&mut extra.load, start);
        deployment.store(&mut extra.deployment, start);
        store(&angle, &mut extra.wing_angle, start);
        sides.store(&mut extra.sides, start);
        if let (Some(packs), Some(charge)) = (&mut extra.packs, &charge) {
            charge.store(&mut packs.charge, start);
        }
    }
}

/// Motion through the air.
#[inline(always)]
fn air<L: Lanes, const ROTORS: usize, const EFFECTS: bool>(
    whole: &Whole<L, ROTORS>,
    state: &Motion<L, ROTORS>,
    columns: &[[L; 3]; 3],
) -> Air<L> {
    let mut wind = whole.held.wind;
    if EFFECTS && whole.present.constant_wind {
        let [north, east] = whole.sizes.wind(whole.present, L::zero() - state.position[2]);
        (wind[0], wind[1]) = (wind[0] + north, wind[1] + east);
    }
    let relative = minus(&state.velocity, &wind);
    Air {
        velocity: [dot(&columns[0], &relative), dot(&columns[1], &relative), dot(&columns[2], &relative)],
        speed: dot(&relative, &relative).root(),
        omega: state.omega,
    }
}

/// `squirrel_core::dynamics::derivative` with wings and effects.
#[inline(always)]
fn whole_derivative<L: Lanes, const ROTORS: usize, const WING: u8, const EFFECTS: bool>(
    whole: &Whole<L, ROTORS>,
    state: &Motion<L, ROTORS>,
    sides: &Sides<L>,
) -> (Motion<L, ROTORS>, Sides<L>) {
    let none = L::zero();
    let columns = rotation_columns(&state.attitude);
    let air = air::<L, ROTORS, EFFECTS>(whole, state, &columns);
    let airframe = &whole.airframe;
    let (thrust, torque) = rotors(airframe, &state.rotor_speed);
    let rotors = Wrench { force: [none, none, none - thrust], moment: torque };

    let mut sides_rate = *sides;
    let mut rest = Wrench { force: [none; 3], moment: [none; 3] };
    if WING == FLAT {
        rest = whole.plate.wrench(whole.plate.normal_forces(&air, &whole.deployment));
    }
    if WING == MEMBRANE {
        (rest, sides_rate) = whole.membrane.evaluate(&air, &whole.angle_rate, &whole.deployment, sides);
    }
    let quadratic = airframe.quadratic_drag * air.speed;
    for i in 0..3 {
        let drag = airframe.linear_drag[i] * air.velocity[i] + air.velocity[i] * quadratic;
        rest.force[i] = rest.force[i] - drag;
    }
    let rotor_rate = rotor_rates(airframe, &whole.held, &state.rotor_speed);
    let mut sum = Wrench {
        force: [rest.force[0], rest.force[1], rotors.force[2] + rest.force[2]],
        moment: [torque[0] + rest.moment[0], torque[1] + rest.moment[1], torque[2] + rest.moment[2]],
    };
    if EFFECTS {
        let mut spin = [none; 2];
        if whole.present.rotor_gyro_torque {
            for i in 0..ROTORS {
                spin =
                    [spin[0] + whole.spin[i] * state.rotor_speed[i], spin[1] + whole.spin[i] * rotor_rate[i]];
            }
        }
        let at = Situation {
            air: &air,
            columns: &columns,
            height: none - state.position[2],
            inverse_mass: airframe.inverse_mass,
            spin,
            plate: &whole.plate,
            deployment: &whole.deployment,
            load: &whole.load,
        };
        sum = whole.sizes.act(whole.present, &rotors, &rest, &at);
    }
    let rate = body_rate(airframe, state, &columns, sum.force, &sum.moment, rotor_rate);
    (rate, sides_rate)
}

/// A rotor without lag is at its target at once.
#[inline(always)]
fn settle<L: Lanes, const ROTORS: usize>(
    airframe: &Airframe<L, ROTORS>,
    held: &Held<L, ROTORS>,
    state: &mut Motion<L, ROTORS>,
) {
    for i in 0..ROTORS {
        let (speed, target) = (state.rotor_speed[i], held.target_speed[i]);
        let inverse = (target - speed).where_positive(airframe.speeding_up, airframe.slowing_down);
        state.rotor_speed[i] = inverse.where_positive(speed, target);
    }
}

/// `squirrel_core::dynamics::derivative` without surfaces and effects.
#[inline(always)]
fn derivative<L: Lanes, const ROTORS: usize>(
    airframe: &Airframe<L, ROTORS>,
    held: &Held<L, ROTORS>,
    state: &Motion<L, ROTORS>,
) -> Motion<L, ROTORS> {
    let columns = rotation_columns(&state.attitude);
    let relative = minus(&state.velocity, &held.wind);
    let speed = dot(&relative, &relative).root();
    let air = [dot(&columns[0], &relative), dot(&columns[1], &relative), dot(&columns[2], &relative)];

    let (thrust, moment) = rotors(airframe, &state.rotor_speed);
    let quadratic = airframe.quadratic_drag * speed;
    let mut force = [L::zero(), L::zero(), L::zero() - thrust];
    for i in 0..3 {
        let drag = airframe.linear_drag[i] * air[i] + air[i] * quadratic;
        force[i] = force[i] - drag;
    }
    let rotor_rate = rotor_rates(airframe, held, &state.rotor_speed);
    body_rate(airframe, state, &columns, force, &moment, rotor_rate)
}

/// Thrust and moment of all rotors.
#[inline(always)]
fn rotors<L: Lanes, const ROTORS: usize>(airframe: &Airframe<L, ROTORS>, speed: &[L; ROTORS]) -> (L, [L; 3]) {
    let square = speed[0] * speed[0];
    let mut thrust = square * airframe.thrust[0];
    let mut moment = [square * airframe.roll[0], square * airframe.pitch[0], square * airframe.yaw[0]];
    for i in 1..ROTORS {
        let square = speed[i] * speed[i];
        thrust = thrust + square * airframe.thrust[i];
        moment[0] = moment[0] + square * airframe.roll[i];
        moment[1] = moment[1] + square * airframe.pitch[i];
        moment[2] = moment[2] + square * airframe.yaw[i];
    }
    (thrust, moment)
}

#[inline(always)]
fn rotor_rates<L: Lanes, const ROTORS: usize>(
    airframe: &Airframe<L, ROTORS>,
    held: &Held<L, ROTORS>,
    speed: &[L; ROTORS],
) -> [L; ROTORS] {
    let mut rate = *speed;
    for i in 0..ROTORS {
        let gap = held.target_speed[i] - speed[i];
        rate[i] = gap * gap.where_positive(airframe.speeding_up, airframe.slowing_down);
    }
    rate
}

/// What force and moment, body frame, make of the motion.
#[inline(always)]
fn body_rate<L: Lanes, const ROTORS: usize>(
    airframe: &Airframe<L, ROTORS>,
    state: &Motion<L, ROTORS>,
    columns: &[[L; 3]; 3],
    force: [L; 3],
    moment: &[L; 3],
    rotor_rate: [L; ROTORS],
) -> Motion<L, ROTORS> {
    let mut specific_force = force;
    for i in 0..3 {
        specific_force[i] = force[i] * airframe.inverse_mass;
    }
    let mut acceleration = times(columns, &specific_force);
    acceleration[2] = L::splat(real(GRAVITY_M_S2)) + acceleration[2];

    let gyroscopic = cross(&state.omega, &times(&airframe.inertia, &state.omega));
    let omega_rate = times(&airframe.inertia_inverse, &minus(moment, &gyroscopic));
    Motion {
        position: state.velocity,
        velocity: acceleration,
        attitude: attitude_rate(&state.attitude, &state.omega),
        omega: omega_rate,
        rotor_speed: rotor_rate,
    }
}

/// The rotation to NED as a matrix by columns, from `[w, x, y, z]`.
#[inline(always)]
fn rotation_columns<L: Lanes>(attitude: &[L; 4]) -> [[L; 3]; 3] {
    let [w, i, j, k] = *attitude;
    let two = L::splat(real(2.0));
    let (ww, ii, jj, kk) = (w * w, i * i, j * j, k * k);
    let (ij, wk, wj) = (i * j * two, w * k * two, w * j * two);
    let (ik, jk, wi) = (i * k * two, j * k * two, w * i * two);
    [
        [ww + ii - jj - kk, wk + ij, ik - wj],
        [ij - wk, ww - ii + jj - kk, wi + jk],
        [wj + ik, jk - wi, ww - ii - jj + kk],
    ]
}

/// `1/2 q (0, omega)`, `[w, x, y, z]`.
#[inline(always)]
fn attitude_rate<L: Lanes>(attitude: &[L; 4], omega: &[L; 3]) -> [L; 4] {
    let half = L::splat(real(0.5));
    let [w, i, j, k] = *attitude;
    let (p, q, r) = (omega[0] * half, omega[1] * half, omega[2] * half);
    [L::zero() - i * p - j * q - k * r, w * p + j * r - k * q, w * q - i * r + k * p, w * r + i * q - j * p]
}

/// The quaternion of length one.
#[inline(always)]
fn unit<L: Lanes>(attitude: &[L; 4]) -> [L; 4] {
    let [w, i, j, k] = *attitude;
    let norm = ((i * i + k * k) + (j * j + w * w)).root();
    let inverse = L::splat(real(1.0)) / norm;
    [w * inverse, i * inverse, j * inverse, k * inverse]
}

#[inline(always)]
fn minus<L: Lanes>(a: &[L; 3], b: &[L; 3]) -> [L; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn dot<L: Lanes>(a: &[L; 3], b: &[L; 3]) -> L {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub(super) fn cross<L: Lanes>(a: &[L; 3], b: &[L; 3]) -> [L; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Matrix times vector.
#[inline(always)]
fn times<L: Lanes>(columns: &[[L; 3]; 3], v: &[L; 3]) -> [L; 3] {
    let mut product = *v;
    for row in 0..3 {
        product[row] = columns[0][row] * v[0] + columns[1][row] * v[1] + columns[2][row] * v[2];
    }
    product
}

#[inline(always)]
fn plus_scaled<L: Lanes, const ROTORS: usize>(
    state: &Motion<L, ROTORS>,
    h: L,
    rate: &Motion<L, ROTORS>,
) -> Motion<L, ROTORS> {
    Motion {
        position: each_plus(&state.position, h, &rate.position),
        velocity: each_plus(&state.velocity, h, &rate.velocity),
        attitude: each_plus(&state.attitude, h, &rate.attitude),
        omega: each_plus(&state.omega, h, &rate.omega),
        rotor_speed: each_plus(&state.rotor_speed, h, &rate.rotor_speed),
    }
}

#[inline(always)]
fn each_plus<L: Lanes, const N: usize>(x: &[L; N], h: L, rate: &[L; N]) -> [L; N] {
    let mut sum = *x;
    for n in 0..N {
        sum[n] = x[n] + rate[n] * h;
    }
    sum
}
