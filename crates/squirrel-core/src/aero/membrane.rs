//! Reduced-order membrane wing (docs/equations.md D.3).
//!
//! It shares nothing with what a controller may believe: neither the flat plate nor a network. Each
//! side feels its own air where it is, which damps roll and pitch, and carries three states: the elastic camber, its
//! creep and the attached fraction of the flow (Goman-Khrabrov).
//!
//! ```text
//! a = |alpha|, s = sign alpha, k = s (kappa_1 + kappa_2), d = deployment
//! C_att = K_p sin a cos a + K_v sin^2 a + C_arc         C_arc = 2 K_p k cos a
//! C_sep = C_D90 / 0.59 sin a (1 / (0.56 + 0.44 sin a) - 0.41) (1 + 1.5 max(k, 0))
//! C_N = X C_att + (1 - X) C_sep                          C_T = (C_T0 + k_T |k C_N|) cos a
//! f = -d q A g (C_N s n + C_T e_t)                       e_t = v_t / max(|v_t|, 0.05 m/s)
//! x = x_0 (1 - sin a) (C_N - X C_arc) / C_N              ahead of the centre, along e_t
//! X' = (X_0 - X) V / (4 c)     X_0 = (1 - tanh((a - 2.5 (c / V) s alpha' - alpha*) / Delta)) / 2
//! kappa_1' = (d kappa - kappa_1) / tau          kappa_2' = (creep d kappa - kappa_2) / tau_creep
//! 8 kappa lambda_0 + (64 / 3) kappa^3 = q s C_N c / (E t)
//! ```
//! `C_att` is Polhamus's for a plate without sweep: its vortices roll up at the side edges alone,
//! so that `K_v` falls with aspect ratio. `C_sep` is Hoerner's for an infinite plate with
//! Lindenburg's term for a short one. At 90 deg nothing is left along the plate and nothing of
//! lift. docs/guide/wing.md holds both to measured plates.
//!
//! The pressure of the angle of attack acts up to a quarter chord ahead of the centre, that of an
//! arc at the centre. Camber folds with the wing: a folded membrane is flat once its lag and its
//! creep are over, and opens flat.
//!
//! Cambers are signed along the load, not along the angle of attack: a membrane takes time to snap
//! through when alpha changes sign. Where `2 (1 + creep) K_p q c > 8 lambda_0 E t` (9.7 m/s with
//! the defaults) a flat membrane is unstable edge on and bulges to either side: that follows from
//! the equations, and slack sails do it. The code carries `s` inside `sin alpha` and `C_N`, which
//! saves most of the sign changes.
//!
//! One side is evaluated at a time, on lanes: a plant takes its two sides as one register, a batch
//! both sides of many vehicles.

use super::{Airflow, flat_plate};
use crate::lane::Lane;
use crate::lane::functions::{angle, cbrt, limit, sign, size, tanh};
use crate::lane::vector::cross;
use crate::numbers;

/// Stands for 0 where a division must stay finite.
const TINY: f64 = 1e-30;
/// In-plane speed below which the tangential force fades with its direction, m/s.
const SLIP_SPEED_M_S: f64 = 0.05;
/// Airspeed below which the flow separates and attaches no slower, m/s.
const SPEED_FLOOR_M_S: f64 = 1.0;
/// Airspeed below which the angle of attack means nothing, m/s, as for the flight code.
const ANGLE_SPEED_M_S: f64 = 0.3;
/// Rates of the angle of attack beyond this are an artefact of low airspeed, rad/s.
const ANGLE_RATE_MAX_RAD_S: f64 = 20.0;

numbers! {
    /// What does not change of a pair of wings.
    Membrane {
        /// `1/2 rho A g`, force over squared airspeed and coefficient, kg/m.
        force_scale,
        /// `3/128 * 1/2 rho c / (E t)`: argument of the camber's cubic over squared airspeed and
        /// coefficient, s^2/m^2.
        load_scale,
        /// `lambda_0 / 8` and its powers, of Cardano's formula.
        prestrain_powers [3],
        /// `2.5 c`, m.
        lead_m,
        /// `1 / Delta`, 1/rad.
        per_stall_width,
        /// `1 / (4 c)`, 1/m.
        attach_per_m,
        /// `1 / tau`, 1/s.
        camber_rate,
        /// `1 / tau_creep`, 1/s.
        creep_rate,
        /// Distance of each side's centre from the x axis, m.
        arm_m,
        /// How far ahead of the centre of mass and below it the centres are, m.
        place_m [2],
        /// `K_p`.
        lift_slope,
        /// `K_v`.
        vortex_slope,
        /// `C_D90`.
        normal_drag,
        /// `C_T0`.
        tangential_zero,
        /// `k_T`.
        tangential_camber,
        /// Camber by creep over elastic camber.
        creep_fraction,
        /// `alpha*`, rad.
        stall_angle_rad,
        /// `x_0`, how far the pressure centre is ahead at small angles, m.
        ahead_m
    }
}

numbers! {
    /// Memory of one side; as a rate, the derivative of each number per second.
    Side {
        /// Elastic camber over chord, positive where the load comes from the belly.
        fast_camber,
        /// Camber by creep over chord, signed likewise.
        creep_camber,
        /// Attached fraction of the flow, 0 to 1.
        attached
    }
}

/// The air at one side.
struct Flow<L> {
    /// Body-frame velocity relative to the air, m/s.
    velocity: [L; 3],
    in_plane_speed: L,
    speed: L,
    speed_squared: L,
    /// `1 / speed`, finite.
    per_speed: L,
    /// Of the angle of attack, with its sign.
    sine: L,
    cosine: L,
}

#[inline(always)]
fn flow<L: Lane>(air: &Airflow<L>, [x, y, z]: [L; 3]) -> Flow<L> {
    let ([u, v, w], [p, q, r]) = (air.velocity, air.omega);
    let velocity = [u - r * y + q * z, v + r * x - p * z, w + p * y - q * x];
    let in_plane_squared = velocity[0] * velocity[0] + velocity[1] * velocity[1];
    let speed_squared = in_plane_squared + velocity[2] * velocity[2];
    let (in_plane_speed, speed) = (in_plane_squared.root(), speed_squared.root());
    let per_speed = L::of(1.0) / speed.upper(L::of(TINY));
    let (sine, cosine) = (velocity[2] * per_speed, in_plane_speed * per_speed);
    Flow { velocity, in_plane_speed, speed, speed_squared, per_speed, sine, cosine }
}

impl<L: Lane> Membrane<L> {
    /// Angle of attack of the side at `y`, m, in rad, in [-pi/2, pi/2], positive where the air hits
    /// the belly; 0 below 0.3 m/s.
    #[inline(always)]
    pub fn angle_of_attack(&self, air: &Airflow<L>, y: L) -> L {
        let flow = flow(air, self.place(y));
        let magnitude = angle(size(flow.sine), flow.cosine) * sign(flow.sine);
        (L::of(ANGLE_SPEED_M_S) - flow.speed).where_positive(L::of(0.0), magnitude)
    }

    /// From the centre of mass.
    #[inline(always)]
    fn place(&self, y: L) -> [L; 3] {
        [self.place_m[0], y, self.place_m[1]]
    }

    /// Force and moment about the centre of mass of the side at `y`, m, and the rates of its state.
    ///
    /// Force, moment and the camber that the state tends to scale with deployment. Finite for any
    /// finite state and airspeeds up to 1e6 m/s; exactly no force without airspeed.
    ///
    /// * `angle_rate` - of the angle of attack, rad/s, held over a step; limited to 20
    /// * `deployment` - 0 folded to 1 spread
    #[inline(always)]
    pub fn evaluate(
        &self,
        air: &Airflow<L>,
        y: L,
        angle_rate: L,
        deployment: L,
        state: &Side<L>,
    ) -> ([[L; 3]; 2], Side<L>) {
        let (none, one) = (L::of(0.0), L::of(1.0));
        let place = self.place(y);
        let flow = flow(air, place);
        let camber = state.fast_camber + state.creep_camber;
        let (sine, sign) = (size(flow.sine), sign(flow.sine));
        // All with the sign of the angle of attack.
        let arched = L::of(2.0) * self.lift_slope * camber * flow.cosine;
        let normal_attached = self.lift_slope * flow.cosine * flow.sine
            + self.vortex_slope * flow.sine * sine
            + arched;
        let normal_separated = self.normal_drag
            * flat_plate::separated(flow.sine)
            * (one + L::of(1.5) * (camber * sign).upper(none));
        let normal = normal_separated + state.attached * (normal_attached - normal_separated);
        let tangential =
            (self.tangential_zero + self.tangential_camber * size(camber * normal)) * flow.cosine;

        // Minus, because the force opposes the motion through the air.
        let pressure = (none - self.force_scale) * flow.speed_squared * deployment;
        let per_slip = one / flow.in_plane_speed.upper(L::of(SLIP_SPEED_M_S));
        let along = [flow.velocity[0] * per_slip, flow.velocity[1] * per_slip];
        let force =
            [pressure * tangential * along[0], pressure * tangential * along[1], pressure * normal];
        let lever = self.ahead_m * (one - sine) * pressure * (normal - state.attached * arched);
        let [roll, pitch, yaw] = cross(&place, &force);
        let moment = [roll + lever * along[1], pitch - lever * along[0], yaw];

        let load = self.load_scale * flow.speed_squared * normal;
        let steady = self.steady_camber(load) * deployment;
        let attach_rate = flow.speed.upper(L::of(SPEED_FLOOR_M_S)) * self.attach_per_m;
        let steady_attached = self.steady_attached(&flow, sine, sign, angle_rate);
        let rates = Side {
            fast_camber: (steady - state.fast_camber) * self.camber_rate,
            creep_camber: (self.creep_fraction * steady - state.creep_camber) * self.creep_rate,
            attached: (steady_attached - state.attached) * attach_rate,
        };
        ([force, moment], rates)
    }

    /// The attached fraction that the flow tends to; pitching up delays the stall.
    #[inline(always)]
    fn steady_attached(&self, flow: &Flow<L>, sine: L, sign: L, angle_rate: L) -> L {
        let most = L::of(ANGLE_RATE_MAX_RAD_S);
        let rate = limit(angle_rate, L::of(0.0) - most, most) * sign;
        let lead = self.lead_m * flow.per_speed.lower(L::of(1.0 / SPEED_FLOOR_M_S)) * rate;
        let past_stall = angle(sine, flow.cosine) - lead - self.stall_angle_rad;
        L::of(0.5) - L::of(0.5) * tanh(past_stall * self.per_stall_width)
    }

    /// The root of `8 k lambda_0 + (64 / 3) k^3 = (128 / 3) s`.
    ///
    /// Cardano: `k = C - L / C` with `L = lambda_0 / 8`, `C = cbrt(s + sqrt(s^2 + L^3))`. Written
    /// as `k = 2 s / (C^2 + L + (L / C)^2)`, which is exactly 0 at 0, odd, and free of the
    /// difference of near equals.
    #[inline(always)]
    pub fn steady_camber(&self, s: L) -> L {
        let [l, l2, l3] = self.prestrain_powers;
        let c = cbrt((size(s) + (s * s + l3).root()).upper(L::of(TINY)));
        let c2 = c * c;
        L::of(2.0) * s * c2 / (c2 * (c2 + l) + l2)
    }
}

impl<L: Lane> Side<L> {
    /// Flat, with attached flow.
    #[inline(always)]
    pub fn at_rest() -> Self {
        Self { fast_camber: L::of(0.0), creep_camber: L::of(0.0), attached: L::of(1.0) }
    }

    /// `self + h rate`.
    #[inline(always)]
    #[must_use]
    pub fn plus_scaled(&self, h: L, rate: &Self) -> Self {
        Self {
            fast_camber: self.fast_camber + h * rate.fast_camber,
            creep_camber: self.creep_camber + h * rate.creep_camber,
            attached: self.attached + h * rate.attached,
        }
    }
}
