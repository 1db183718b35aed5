//! The wings of `crate::plant` on registers: flat plate and membrane, operation by operation as there.
//!
//! The equations and their reasons are in `crate::plant::Membrane`; a pair of sides is an array of two registers here.

use super::maths::{all, angle, cbrt, limit, sign, size, tanh};
use super::rows::rows;
use super::simd::{Lanes, Paths};
use crate::plant::MembraneParameters;
use squirrel_core::math::{AIR_DENSITY_KG_M3, real};
use squirrel_core::vehicle::Wing;

/// No wing.
pub(super) const NONE: u8 = 0;
/// Flat plate.
pub(super) const FLAT: u8 = 1;
/// Membrane.
pub(super) const MEMBRANE: u8 = 2;

const TINY: f64 = 1e-30;
const SLIP_SPEED_M_S: f64 = 0.05;
const SPEED_FLOOR_M_S: f64 = 1.0;
const ANGLE_SPEED_M_S: f64 = 0.3;
const ANGLE_RATE_MAX_RAD_S: f64 = 20.0;

rows! {
    /// A flat plate on each side.
    Plate {
        /// `1/2 rho S c_N`; 0 for no wing.
        per_speed, arm
    }
}

rows! {
    /// What does not change of a membrane, as `crate::plant::Membrane` derives it.
    Membrane {
        force_scale, load_scale, prestrain_powers [3], lead_m, per_stall_width, attach_per_m, camber_rate, creep_rate,
        arm, lift_slope, vortex_slope, normal_drag, tangential_zero, tangential_camber, creep_fraction, stall_angle,
        ahead_m
    }
}

rows! {
    /// What changes, left and right; as a rate, the derivative of each.
    Sides { fast_camber [2], creep_camber [2], attached [2] }
}

/// Motion through the air, body frame.
#[derive(Clone, Copy)]
pub(super) struct Air<L> {
    pub(super) velocity: [L; 3],
    pub(super) speed: L,
    pub(super) omega: [L; 3],
}

/// Force and moment, body frame.
#[derive(Clone, Copy)]
pub(super) struct Wrench<L> {
    pub(super) force: [L; 3],
    pub(super) moment: [L; 3],
}

impl<S: Paths> Plate<S> {
    pub(super) fn new(wing: Option<Wing<f64>>) -> Self {
        let [area, slope, arm] = wing
            .map_or([0.0; 3], |w| [w.area_per_side_m2, w.normal_force_slope, w.lateral_arm_m])
            .map(real::<S>);
        Self { per_speed: real::<S>(0.5 * AIR_DENSITY_KG_M3) * area * slope, arm }
    }
}

impl<S: Paths> Membrane<S> {
    /// * `gain` - on force and moment; 0 for a vehicle without wings
    pub(super) fn new(p: &MembraneParameters, gain: f64) -> Self {
        let eighth = p.prestrain / 8.0;
        let force = 0.5 * AIR_DENSITY_KG_M3 * p.area_per_side_m2 * p.force_gain;
        Self {
            force_scale: real(force * gain),
            load_scale: real(3.0 / 128.0 * 0.5 * AIR_DENSITY_KG_M3 * p.chord_m / p.tension_n_per_m),
            prestrain_powers: [real(eighth), real(eighth * eighth), real(eighth * eighth * eighth)],
            lead_m: real(2.5 * p.chord_m),
            per_stall_width: real(1.0 / p.stall_width_rad),
            attach_per_m: real(0.25 / p.chord_m),
            camber_rate: real(1.0 / p.camber_time_constant_s),
            creep_rate: real(1.0 / p.creep_time_constant_s),
            arm: real(p.lateral_arm_m),
            lift_slope: real(p.lift_slope),
            vortex_slope: real(p.vortex_slope),
            normal_drag: real(p.normal_drag),
            tangential_zero: real(p.tangential_zero),
            tangential_camber: real(p.tangential_camber),
            creep_fraction: real(p.creep_fraction),
            stall_angle: real(p.stall_angle_rad),
            ahead_m: real(0.25 * p.chord_m * p.pressure_centre_shift),
        }
    }
}

impl<S: Paths> Sides<S> {
    /// Flat, with attached flow.
    pub(super) fn at_rest() -> Self {
        let (none, one) = (real(0.0), real(1.0));
        Self { fast_camber: [none; 2], creep_camber: [none; 2], attached: [one; 2] }
    }
}

impl<L: Lanes> Plate<L> {
    /// Forces along -z, left and right.
    #[inline(always)]
    pub(super) fn normal_forces(&self, air: &Air<L>, deployment: &[L; 2]) -> [L; 2] {
        let slope = self.per_speed * air.speed;
        let roll_down = air.omega[0] * self.arm;
        [
            slope * (air.velocity[2] - roll_down) * deployment[0],
            slope * (air.velocity[2] + roll_down) * deployment[1],
        ]
    }

    /// Wrench of forces along -z, left and right.
    #[inline(always)]
    pub(super) fn wrench(&self, [left, right]: [L; 2]) -> Wrench<L> {
        let none = L::zero();
        Wrench { force: [none, none, none - (left + right)], moment: [(left - right) * self.arm, none, none] }
    }
}

/// The air at one side.
#[derive(Clone, Copy)]
struct Flow<L> {
    velocity: [L; 3],
    in_plane_speed: L,
    speed: L,
    speed_squared: L,
    per_speed: L,
    sine: L,
    cosine: L,
}

#[inline(always)]
fn flow<L: Lanes>(air: &Air<L>, y: L) -> Flow<L> {
    let [u, v, w] = air.velocity;
    let velocity = [u - air.omega[2] * y, v, w + air.omega[0] * y];
    let in_plane_squared = velocity[0] * velocity[0] + velocity[1] * velocity[1];
    let speed_squared = in_plane_squared + velocity[2] * velocity[2];
    let (in_plane_speed, speed) = (in_plane_squared.root(), speed_squared.root());
    let per_speed = all::<L>(1.0) / speed.upper(all(TINY));
    Flow {
        velocity,
        in_plane_speed,
        speed,
        speed_squared,
        per_speed,
        sine: velocity[2] * per_speed,
        cosine: in_plane_speed * per_speed,
    }
}

impl<L: Lanes> Membrane<L> {
    #[inline(always)]
    fn lateral(&self) -> [L; 2] {
        [L::zero() - self.arm, self.arm]
    }

    /// Angle of attack of each side, rad.
    #[inline(always)]
    pub(super) fn angle_of_attack(&self, air: &Air<L>) -> [L; 2] {
        let mut angles = [L::zero(); 2];
        for side in 0..2 {
            let flow = flow(air, self.lateral()[side]);
            let magnitude = angle(size(flow.sine), flow.cosine) * sign(flow.sine);
            angles[side] = (all::<L>(ANGLE_SPEED_M_S) - flow.speed).where_positive(L::zero(), magnitude);
        }
        angles
    }

    /// Wrench of both sides, and the rates of their state.
    #[inline(always)]
    pub(super) fn evaluate(
        &self,
        air: &Air<L>,
        angle_rate: &[L; 2],
        deployment: &[L; 2],
        state: &Sides<L>,
    ) -> (Wrench<L>, Sides<L>) {
        let (none, one) = (L::zero(), all::<L>(1.0));
        let mut forces = [[none; 3]; 2];
        let mut moments = [[none; 3]; 2];
        let mut rates = *state;
        for side in 0..2 {
            let y = self.lateral()[side];
            let flow = flow(air, y);
            let (fast, creep, attached) =
                (state.fast_camber[side], state.creep_camber[side], state.attached[side]);
            let camber = fast + creep;
            let sine = size(flow.sine);
            let sign = sign(flow.sine);
            let normal_attached = self.lift_slope * flow.cosine * (flow.sine + all::<L>(2.0) * camber)
                + self.vortex_slope * flow.sine * sine;
            let normal_separated = self.normal_drag * flow.sine / (all::<L>(0.56) + all::<L>(0.44) * sine)
                * (one + all::<L>(1.5) * (camber * sign).upper(none));
            let normal = normal_separated + attached * (normal_attached - normal_separated);
            let tangential =
                self.tangential_zero * flow.cosine + self.tangential_camber * size(camber * normal);

            let pressure = (none - self.force_scale) * flow.speed_squared * deployment[side];
            let per_slip = one / flow.in_plane_speed.upper(all(SLIP_SPEED_M_S));
            let along = [flow.velocity[0] * per_slip, flow.velocity[1] * per_slip];
            let force =
                [pressure * tangential * along[0], pressure * tangential * along[1], pressure * normal];
            let ahead_m = self.ahead_m * (one - sine);
            let point = [ahead_m * along[0], ahead_m * along[1] + y];
            forces[side] = force;
            moments[side] =
                [point[1] * force[2], point[0] * force[2], point[0] * force[1] - point[1] * force[0]];

            let steady = self.steady_camber(self.load_scale * flow.speed_squared * normal);
            let attach_rate = flow.speed.upper(all(SPEED_FLOOR_M_S)) * self.attach_per_m;
            let steady_attached = self.steady_attached(&flow, sine, sign, angle_rate[side]);
            rates.fast_camber[side] = (steady - fast) * self.camber_rate;
            rates.creep_camber[side] = (self.creep_fraction * steady - creep) * self.creep_rate;
            rates.attached[side] = (steady_attached - attached) * attach_rate;
        }
        let [f, g] = forces;
        let [m, n] = moments;
        let wrench = Wrench {
            force: [f[0] + g[0], f[1] + g[1], f[2] + g[2]],
            moment: [m[0] + n[0], none - (m[1] + n[1]), m[2] + n[2]],
        };
        (wrench, rates)
    }

    #[inline(always)]
    fn steady_attached(&self, flow: &Flow<L>, sine: L, sign: L, angle_rate: L) -> L {
        let most = all::<L>(ANGLE_RATE_MAX_RAD_S);
        let rate = limit(angle_rate, L::zero() - most, most) * sign;
        let lead = self.lead_m * flow.per_speed.lower(all(1.0 / SPEED_FLOOR_M_S)) * rate;
        let past_stall = angle(sine, flow.cosine) - lead - self.stall_angle;
        all::<L>(0.5) - all::<L>(0.5) * tanh(past_stall * self.per_stall_width)
    }

    #[inline(always)]
    fn steady_camber(&self, s: L) -> L {
        let [l, l2, l3] = self.prestrain_powers;
        let c = cbrt((size(s) + (s * s + l3).root()).upper(all(TINY)));
        let c2 = c * c;
        all::<L>(2.0) * s * c2 / (c2 * (c2 + l) + l2)
    }
}

impl<L: Lanes> Sides<L> {
    #[inline(always)]
    pub(super) fn plus_scaled(&self, h: L, rate: &Self) -> Self {
        let mut sum = *self;
        for side in 0..2 {
            sum.fast_camber[side] = self.fast_camber[side] + h * rate.fast_camber[side];
            sum.creep_camber[side] = self.creep_camber[side] + h * rate.creep_camber[side];
            sum.attached[side] = self.attached[side] + h * rate.attached[side];
        }
        sum
    }
}
