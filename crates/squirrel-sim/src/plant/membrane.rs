//! Reduced-order membrane wing: the simulator's truth about the wings (docs/equations.md D.3), f64.
//!
//! It shares nothing with what a controller may believe: neither the flat plate nor a network. Each side feels its own
//! air, which damps roll, and carries three states: the elastic camber, its creep and the attached fraction of the flow
//! (Goman-Khrabrov).
//!
//! ```text
//! a = |alpha|, s = sign alpha, k = s (kappa_1 + kappa_2)
//! C_att = K_p sin a cos a + K_v sin^2 a + 2 K_p k cos a
//! C_sep = C_D90 sin a / (0.56 + 0.44 sin a) (1 + 1.5 max(k, 0))
//! C_N = X C_att + (1 - X) C_sep                C_T = C_T0 cos a + k_T |k C_N|
//! f = -q A g (C_N s n + C_T e_t)               e_t = v_t / max(|v_t|, 0.05 m/s)
//! X' = (X_0 - X) V / (4 c)                     X_0 = (1 - tanh((a - 2.5 (c / V) s alpha' - alpha*) / Delta)) / 2
//! kappa_1' = (kappa - kappa_1) / tau           kappa_2' = (creep kappa - kappa_2) / tau_creep
//! 8 kappa lambda_0 + (64 / 3) kappa^3 = q s C_N c / (E t)
//! ```
//! Cambers are signed along the load, not along the angle of attack: a membrane takes time to snap through when alpha
//! changes sign. Where `2 (1 + creep) K_p q c > 8 lambda_0 E t` (8.5 m/s with the defaults) a flat membrane is unstable
//! edge on and bulges to either side: that follows from the equations, and slack sails do it. The code carries `s` inside
//! `sin alpha` and `C_N`, which saves most of the sign changes.

mod parameters;
#[cfg(test)]
mod tests;

pub use parameters::MembraneParameters;

use super::fast_math::{Pair, angle, cbrt, tanh};
use squirrel_core::aero::Air;
use squirrel_core::dynamics::VectorSpace;
use squirrel_core::frames::{Body, In, Wrench};
use squirrel_core::math::AIR_DENSITY_KG_M3;
use squirrel_core::nalgebra::Vector3;
use squirrel_core::vehicle::ParameterError;

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

/// Memory of the wings, `[left, right]`; as a rate, the derivative of each number per second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MembraneState {
    /// Elastic camber over chord, positive where the load comes from the belly.
    pub fast_camber: [f64; 2],
    /// Camber by creep over chord, signed likewise.
    pub creep_camber: [f64; 2],
    /// Attached fraction of the flow, 0 to 1.
    pub attached: [f64; 2],
}

impl MembraneState {
    /// Flat, with attached flow.
    pub fn at_rest() -> Self {
        Self { fast_camber: [0.0; 2], creep_camber: [0.0; 2], attached: [1.0; 2] }
    }
}

impl VectorSpace<f64> for MembraneState {
    #[inline(always)]
    fn plus_scaled(&self, h: f64, rate: &Self) -> Self {
        let add = |x: [f64; 2], rate: [f64; 2]| (Pair(x) + h * Pair(rate)).0;
        Self {
            fast_camber: add(self.fast_camber, rate.fast_camber),
            creep_camber: add(self.creep_camber, rate.creep_camber),
            attached: add(self.attached, rate.attached),
        }
    }
}

/// A checked pair of membrane wings with what the loop derives from the parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Membrane {
    parameters: MembraneParameters,
    /// `1/2 rho A g`, force over squared airspeed and coefficient, kg/m.
    force_scale: f64,
    /// `3/128 * 1/2 rho c / (E t)`: argument of [`Self::steady_camber`] over squared airspeed and coefficient, s^2/m^2.
    load_scale: f64,
    /// `lambda_0 / 8` and its powers, of Cardano's formula.
    prestrain_powers: [f64; 3],
    /// `2.5 c`, m.
    lead_m: f64,
    /// `1 / Delta`, 1/rad.
    per_stall_width: f64,
    /// `1 / (4 c)`, 1/m.
    attach_per_m: f64,
    /// `1 / tau`, 1/s.
    camber_rate: f64,
    /// `1 / tau_creep`, 1/s.
    creep_rate: f64,
}

/// The air at the two sides.
struct Flow {
    /// Body-frame velocity relative to the air, m/s.
    velocity: [Pair; 3],
    in_plane_speed: Pair,
    speed: Pair,
    speed_squared: Pair,
    /// `1 / speed`, finite.
    per_speed: Pair,
    /// Of the angle of attack, with its sign.
    sine: Pair,
    cosine: Pair,
}

impl Membrane {
    /// Checks the parameters.
    ///
    /// # Errors
    /// The first field that is not finite or out of range, with its value.
    pub fn new(parameters: MembraneParameters) -> Result<Self, ParameterError> {
        parameters.check()?;
        let p = &parameters;
        let eighth = p.prestrain / 8.0;
        Ok(Self {
            force_scale: 0.5 * AIR_DENSITY_KG_M3 * p.area_per_side_m2 * p.force_gain,
            load_scale: 3.0 / 128.0 * 0.5 * AIR_DENSITY_KG_M3 * p.chord_m / p.tension_n_per_m,
            prestrain_powers: [eighth, eighth * eighth, eighth * eighth * eighth],
            lead_m: 2.5 * p.chord_m,
            per_stall_width: 1.0 / p.stall_width_rad,
            attach_per_m: 0.25 / p.chord_m,
            camber_rate: 1.0 / p.camber_time_constant_s,
            creep_rate: 1.0 / p.creep_time_constant_s,
            parameters,
        })
    }

    /// The parameters as checked.
    pub fn parameters(&self) -> &MembraneParameters {
        &self.parameters
    }

    /// Angle of attack of each side, `[left, right]`, rad, in [-pi/2, pi/2], positive where the air hits the belly; 0 below
    /// 0.3 m/s. Its difference over a step is the rate that [`Self::evaluate`] takes.
    pub fn angle_of_attack(&self, air: &Air<f64>) -> [f64; 2] {
        let flow = self.flow(air);
        let magnitude = angle(flow.sine.abs(), flow.cosine);
        let known = flow.speed.map(|v| if v >= ANGLE_SPEED_M_S { 1.0 } else { 0.0 });
        (known * magnitude.zip(flow.sine, f64::copysign)).0
    }

    /// Wrench of both wings about the centre of mass, and the rates of their state.
    ///
    /// Force and moment scale with deployment; the state evolves as if spread. Finite for any finite state and airspeeds
    /// up to 1e6 m/s; exactly no force without airspeed.
    ///
    /// * `angle_rate_rad_s` - rate of the angle of attack of each side, rad/s, held over a step; limited to 20
    /// * `deployment` - 0 folded to 1 spread, each side
    #[inline(always)]
    pub fn evaluate(
        &self,
        air: &Air<f64>,
        angle_rate_rad_s: [f64; 2],
        deployment: [f64; 2],
        state: &MembraneState,
    ) -> (Wrench<Body, f64>, MembraneState) {
        let p = &self.parameters;
        let flow = self.flow(air);
        let (fast, creep) = (Pair(state.fast_camber), Pair(state.creep_camber));
        let attached = Pair(state.attached);
        let camber = fast + creep;

        let sine = flow.sine.abs();
        let sign = flow.sine.map(|x| 1f64.copysign(x));
        // Both with the sign of the angle of attack.
        let normal_attached =
            p.lift_slope * flow.cosine * (flow.sine + 2.0 * camber) + p.vortex_slope * flow.sine * sine;
        let normal_separated =
            p.normal_drag * flow.sine / (0.56 + 0.44 * sine) * (1.0 + 1.5 * (camber * sign).upper(0.0));
        let normal = normal_separated + attached * (normal_attached - normal_separated);
        let tangential = p.tangential_zero * flow.cosine + p.tangential_camber * (camber * normal).abs();

        // Minus, because the force opposes the motion through the air.
        let pressure = -self.force_scale * flow.speed_squared * Pair(deployment);
        let per_slip = 1.0 / flow.in_plane_speed.upper(SLIP_SPEED_M_S);
        let along = [flow.velocity[0] * per_slip, flow.velocity[1] * per_slip];
        let force = [pressure * tangential * along[0], pressure * tangential * along[1], pressure * normal];
        let ahead_m = 0.25 * p.chord_m * p.pressure_centre_shift * (1.0 - sine);
        let point_m = [ahead_m * along[0], ahead_m * along[1] + self.lateral()];
        let wrench = Wrench {
            force: In::new(Vector3::new(force[0].sum(), force[1].sum(), force[2].sum())),
            moment: In::new(Vector3::new(
                (point_m[1] * force[2]).sum(),
                -(point_m[0] * force[2]).sum(),
                (point_m[0] * force[1] - point_m[1] * force[0]).sum(),
            )),
        };

        let steady_camber = self.steady_camber(self.load_scale * flow.speed_squared * normal);
        let steady_attached = self.steady_attached(&flow, sine, sign, Pair(angle_rate_rad_s));
        let attach_rate = flow.speed.upper(SPEED_FLOOR_M_S) * self.attach_per_m;
        let rates = MembraneState {
            fast_camber: ((steady_camber - fast) * self.camber_rate).0,
            creep_camber: ((p.creep_fraction * steady_camber - creep) * self.creep_rate).0,
            attached: ((steady_attached - attached) * attach_rate).0,
        };
        (wrench, rates)
    }

    /// Each side's distance from the x axis, m.
    #[inline(always)]
    fn lateral(&self) -> Pair {
        Pair([-self.parameters.lateral_arm_m, self.parameters.lateral_arm_m])
    }

    #[inline(always)]
    fn flow(&self, air: &Air<f64>) -> Flow {
        let (v, omega) = (air.velocity.vector, air.omega.vector);
        let y = self.lateral();
        let velocity = [v.x - omega.z * y, Pair::both(v.y), v.z + omega.x * y];
        let in_plane_squared = velocity[0] * velocity[0] + velocity[1] * velocity[1];
        let speed_squared = in_plane_squared + velocity[2] * velocity[2];
        let (in_plane_speed, speed) = (in_plane_squared.sqrt(), speed_squared.sqrt());
        let per_speed = 1.0 / speed.upper(TINY);
        let (sine, cosine) = (velocity[2] * per_speed, in_plane_speed * per_speed);
        Flow { velocity, in_plane_speed, speed, speed_squared, per_speed, sine, cosine }
    }

    /// The attached fraction that the flow tends to; pitching up delays the stall.
    #[inline(always)]
    fn steady_attached(&self, flow: &Flow, sine: Pair, sign: Pair, angle_rate_rad_s: Pair) -> Pair {
        let rate = angle_rate_rad_s.limit(-ANGLE_RATE_MAX_RAD_S, ANGLE_RATE_MAX_RAD_S) * sign;
        let lead = self.lead_m * flow.per_speed.lower(1.0 / SPEED_FLOOR_M_S) * rate;
        let past_stall = angle(sine, flow.cosine) - lead - self.parameters.stall_angle_rad;
        0.5 - 0.5 * tanh(past_stall * self.per_stall_width)
    }

    /// The root of `8 k lambda_0 + (64 / 3) k^3 = (128 / 3) s`.
    ///
    /// Cardano: `k = C - L / C` with `L = lambda_0 / 8`, `C = cbrt(s + sqrt(s^2 + L^3))`. Written as
    /// `k = 2 s / (C^2 + L + (L / C)^2)`, which is exactly 0 at 0, odd, and free of the difference of near equals.
    #[inline(always)]
    fn steady_camber(&self, s: Pair) -> Pair {
        let [l, l2, l3] = self.prestrain_powers;
        let c = cbrt((s.abs() + (s * s + l3).sqrt()).upper(TINY));
        let c2 = c * c;
        2.0 * s * c2 / (c2 * (c2 + l) + l2)
    }
}
