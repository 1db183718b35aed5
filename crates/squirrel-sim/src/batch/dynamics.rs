//! The equations of `squirrel_core::dynamics` on registers of vehicles.
//!
//! Written out, operation by operation in the order of the core, so that a vehicle in a batch has the numbers of a vehicle
//! alone. No closures and no iterators in here: code must end up in the function that was compiled for the registers.

use super::Scheme;
use super::rows::{Airframe, Block, Held, Motion};
use super::simd::{BLOCK, Kernel, Lanes, Paths};
use squirrel_core::math::{GRAVITY_M_S2, real};

/// Some steps of some blocks. Each block takes all of its steps before the next one takes its first.
pub(super) struct Advance<'a, S, const ROTORS: usize> {
    pub(super) blocks: &'a mut [Block<S, ROTORS>],
    pub(super) scheme: Scheme,
    pub(super) dt_s: S,
    pub(super) steps: usize,
}

impl<S: Paths, const ROTORS: usize> Kernel<S> for Advance<'_, S, ROTORS> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Weight = S>>(self) {
        let dt = self.dt_s;
        let zero = real(0.0);
        match self.scheme {
            Scheme::Euler => advance::<L, ROTORS, 1>(self.blocks, self.steps, [[zero, dt]]),
            Scheme::Rk4 => {
                let (half, sixth, third) = (dt * real(0.5), dt * real(1.0 / 6.0), dt * real(1.0 / 3.0));
                let stages = [[half, sixth], [half, third], [dt, third], [zero, sixth]];
                advance::<L, ROTORS, 4>(self.blocks, self.steps, stages);
            }
        }
    }
}

/// * `stages` - for each rate that is taken: time ahead to where the next one is, and weight in the step, both s
#[inline(always)]
fn advance<L: Lanes, const ROTORS: usize, const STAGES: usize>(
    blocks: &mut [Block<L::Weight, ROTORS>],
    steps: usize,
    stages: [[L::Weight; 2]; STAGES],
) {
    for block in blocks {
        let lagless = block.lagless;
        for group in 0..BLOCK / L::WIDTH {
            let start = group * L::WIDTH;
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

    let square = state.rotor_speed[0] * state.rotor_speed[0];
    let mut thrust = square * airframe.thrust;
    let mut moment = [square * airframe.roll[0], square * airframe.pitch[0], square * airframe.yaw[0]];
    for i in 1..ROTORS {
        let square = state.rotor_speed[i] * state.rotor_speed[i];
        thrust = thrust + square * airframe.thrust;
        moment[0] = moment[0] + square * airframe.roll[i];
        moment[1] = moment[1] + square * airframe.pitch[i];
        moment[2] = moment[2] + square * airframe.yaw[i];
    }

    let quadratic = airframe.quadratic_drag * speed;
    let mut specific_force = [L::zero(), L::zero(), L::zero() - thrust];
    for i in 0..3 {
        let drag = airframe.linear_drag[i] * air[i] + air[i] * quadratic;
        specific_force[i] = (specific_force[i] - drag) * airframe.inverse_mass;
    }
    let mut acceleration = times(&columns, &specific_force);
    acceleration[2] = L::splat(real(GRAVITY_M_S2)) + acceleration[2];

    let gyroscopic = cross(&state.omega, &times(&airframe.inertia, &state.omega));
    let omega_rate = times(&airframe.inertia_inverse, &minus(&moment, &gyroscopic));

    let mut rotor_rate = state.rotor_speed;
    for i in 0..ROTORS {
        let gap = held.target_speed[i] - state.rotor_speed[i];
        rotor_rate[i] = gap * gap.where_positive(airframe.speeding_up, airframe.slowing_down);
    }
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
fn cross<L: Lanes>(a: &[L; 3], b: &[L; 3]) -> [L; 3] {
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
