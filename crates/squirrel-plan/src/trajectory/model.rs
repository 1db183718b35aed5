//! The point mass that is planned for: what accelerates it, how that changes, and where it goes.
//!
//! ```text
//! m a = m g e3 - T + w f(u, T/|T|) - (c + 1/2 rho C_D A |u|) u + m b            u = v - wind
//! T = U n: thrust along body z (down)            0 <= w <= 1
//! v+ = v + h (a + a+) / 2             p+ = p + h v + h^2 (2 a + a+) / 6             accelerations are linear between nodes
//! ```
//! docs/equations.md G.1. Differs: `T` is linear between nodes and not constant, because an
//! attitude has no steps; wings fold and spread in parts, at the rate of their servo.

use crate::wing::{WingForce, WingModel};
use nalgebra::{Matrix3, Vector3};
use squirrel_core::aero::flat_plate::plate;
use squirrel_core::aero::{self, Airflow};
use squirrel_core::frames::In;
use squirrel_core::lane::vector::dot;
use squirrel_core::lane::{Dual, Lane};
use squirrel_core::math::GRAVITY_M_S2;
use squirrel_sim::vehicle_file::VehicleFile;

/// Rounds in which the acceleration at the end of a step is found, which depends on the velocity
/// there. Each gains a factor of a hundred.
const ROUNDS: u32 = 4;
/// Step of the derivatives of a wing that has no formula: of the velocity, m/s, and of the normal,
/// 1.
const DIFFERENCE: f64 = 1e-3;

/// The vehicle as a plan knows it.
#[derive(Debug, Clone, PartialEq)]
pub struct Craft {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Smallest vertical part of the thrust, N.
    pub thrust_min_n: f64,
    /// Largest thrust, N.
    pub thrust_max_n: f64,
    /// Limit of |roll| and |pitch|, rad.
    pub tilt_max_rad: f64,
    /// From a command to the attitude that it asks for, s: so long nothing can be changed.
    pub delay_s: f64,
    /// How fast the attitude follows, rad/s.
    pub tilt_rate_max_rad_s: f64,
    /// Thrust that is given up for turning, over the horizontal thrust's second derivative, north
    /// and east at zero yaw, s^2: a rotor at its limit can only turn the vehicle by giving less on
    /// the other side.
    pub turning_s2: [f64; 2],
    /// How fast thrust follows, N/s.
    pub thrust_rate_max_n_s: f64,
    /// Linear drag, N s/m: the mean of the vehicle's forward and right axes.
    pub drag_n_s_m: f64,
    /// `1/2 rho C_D A` of the airframe, N s^2/m^2.
    pub drag_n_s2_m2: f64,
    /// What spread wings do; `None` plans without them.
    pub wing: Option<WingForce>,
    /// How fast they spread, 1/s.
    pub wing_rate_max_per_s: f64,
    /// What it flies in.
    pub air: Air,
}

/// The air, and what the model lacks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Air {
    /// Where it moves to, NED, m/s.
    pub wind: Vector3<f64>,
    /// Acceleration besides the model's, NED, m/s^2.
    pub offset: Vector3<f64>,
}

impl Air {
    /// At rest, and the model is right.
    pub fn calm() -> Self {
        Self { wind: Vector3::zeros(), offset: Vector3::zeros() }
    }
}

/// Part of thrust and tilt that a plan leaves to whoever follows it to its end.
pub const RESERVE: f64 = 0.05;
/// Of a vehicle whose attitude loop is not known.
const DELAY_S: f64 = 0.1;
/// Most of a half turn that the command filter and the attitude loop do in a second.
const TILT_RATE_MAX_RAD_S: f64 = 2.5;
/// Time in which rotors go from nothing to full thrust.
const THRUST_TIME_S: f64 = 0.25;

impl Craft {
    /// Of a vehicle file, in calm air.
    ///
    /// * `thrust_max_n` - of the flight code: the vehicle's limit, or less
    /// * `wing` - what is believed of the wings; `None` plans without them
    /// * `reserve` - part of thrust and tilt that is left to whoever follows the plan, [`RESERVE`]
    ///   or less
    ///
    /// # Errors
    /// One line that names what the vehicle lacks, or what cannot be.
    pub fn of(
        vehicle: &VehicleFile,
        thrust_max_n: f64,
        wing: Option<WingModel>,
        reserve: f64,
    ) -> Result<Self, String> {
        let p = vehicle.vehicle.parameters();
        if !(0.0..=0.5).contains(&reserve) {
            return Err(format!("reserve = {reserve}: must be 0 to 0.5"));
        }
        let weight_n = vehicle.vehicle.weight_n();
        let thrust_max_n = thrust_max_n * (1.0 - reserve);
        if !(thrust_max_n.is_finite() && thrust_max_n > weight_n) {
            return Err(format!(
                "{}: thrust_max_n = {thrust_max_n}, less a reserve of {:.0} %: must be above the weight of {weight_n:.3} N",
                vehicle.name,
                100.0 * reserve
            ));
        }
        let servo_s =
            vehicle.wing.servo().map_or(0.2, |s| 1.0 / s.rate_max_per_s + s.time_constant_s);
        let linear = p.drag.linear_n_s_per_m;
        Ok(Self {
            mass_kg: p.mass_kg,
            thrust_min_n: vehicle
                .control
                .map_or(0.1 * weight_n, |c| f64::from(c.twcc.thrust_min_n)),
            thrust_max_n,
            tilt_max_rad: p.limits.tilt_max_rad * (1.0 - reserve),
            delay_s: vehicle.control.map_or(DELAY_S, |c| f64::from(c.attitude.filter_delay_s())),
            turning_s2: turning_s2(vehicle),
            tilt_rate_max_rad_s: TILT_RATE_MAX_RAD_S,
            thrust_rate_max_n_s: thrust_max_n / THRUST_TIME_S,
            drag_n_s_m: 0.5 * (linear.x + linear.y),
            drag_n_s2_m2: p.drag.per_square(),
            wing: wing.map(|model| WingForce::of(vehicle, model)).transpose()?,
            wing_rate_max_per_s: 1.0 / servo_s,
            air: Air::calm(),
        })
    }

    /// Thrust that carries the weight, N, world axes, along body z.
    pub fn hover(&self) -> Vector3<f64> {
        Vector3::new(0.0, 0.0, self.mass_kg * GRAVITY_M_S2)
    }

    /// Acceleration, m/s^2.
    ///
    /// * `v` - velocity, m/s
    /// * `thrust` - `U n`, N
    /// * `spread` - deployment of the wings, 0 to 1
    pub fn acceleration(
        &self,
        v: &Vector3<f64>,
        thrust: &Vector3<f64>,
        spread: f64,
    ) -> Vector3<f64> {
        let through = v - self.air.wind;
        let mut force = -thrust - Vector3::from(self.drag(&through.into()));
        if spread > 0.0 {
            force += self.wing_force(&through, &unit(thrust)) * spread;
        }
        force / self.mass_kg + Vector3::z() * GRAVITY_M_S2 + self.air.offset
    }

    /// * `v` - through the air, m/s
    fn wing_force(&self, v: &Vector3<f64>, n: &Vector3<f64>) -> Vector3<f64> {
        self.wing
            .as_ref()
            .map_or_else(Vector3::zeros, |wing| wing.force(In::new(*v), In::new(*n)).vector)
    }

    /// How the acceleration changes with velocity, thrust and wings, at a place in that space.
    pub fn slopes(&self, v: &Vector3<f64>, thrust: &Vector3<f64>, spread: f64) -> Slopes {
        let v = v - self.air.wind;
        let through = [0, 1, 2].map(|axis| Dual::<3>::variable(v[axis], axis));
        let mut by_velocity = -jacobian(&self.drag(&through));
        let mut by_thrust = -Matrix3::identity();
        let n = unit(thrust);
        let force = self.wing_force(&v, &n);
        if spread > 0.0 {
            let (wing_by_velocity, wing_by_normal) = self.wing_slopes(&v, &n, &force);
            by_velocity += wing_by_velocity * spread;
            let normal_by_thrust =
                (Matrix3::identity() - n * n.transpose()) / thrust.norm().max(1e-6);
            by_thrust += wing_by_normal * normal_by_thrust * spread;
        }
        Slopes {
            by_velocity: by_velocity / self.mass_kg,
            by_thrust: by_thrust / self.mass_kg,
            by_spread: force / self.mass_kg,
        }
    }

    /// Drag, world axes, against the motion, N: the airframe's is taken for the same along all
    /// axes.
    fn drag<L: Lane<Element = f64>>(&self, through: &[L; 3]) -> [L; 3] {
        let flow = Airflow {
            velocity: *through,
            speed: dot(through, through).root(),
            omega: [L::of(0.0); 3],
        };
        aero::drag(&[L::splat(self.drag_n_s_m); 3], L::splat(self.drag_n_s2_m2), &flow)
    }

    /// Derivatives of the spread wings' force by velocity and by normal.
    fn wing_slopes(
        &self,
        v: &Vector3<f64>,
        n: &Vector3<f64>,
        force: &Vector3<f64>,
    ) -> (Matrix3<f64>, Matrix3<f64>) {
        if let Some(WingForce::Flat { area_m2 }) = self.wing {
            let along = |v: &Vector3<f64>| [0, 1, 2].map(|axis| Dual::<3>::variable(v[axis], axis));
            let fixed = |v: &Vector3<f64>| [0, 1, 2].map(|axis| Dual::<3>::constant(v[axis]));
            let area_m2 = Dual::constant(area_m2);
            let by_velocity = jacobian(&plate(&along(v), &fixed(n), area_m2));
            return (by_velocity, jacobian(&plate(&fixed(v), &along(n), area_m2)));
        }
        let (mut by_velocity, mut by_normal) = (Matrix3::zeros(), Matrix3::zeros());
        for axis in 0..3 {
            let mut step = Vector3::zeros();
            step[axis] = DIFFERENCE;
            by_velocity.set_column(axis, &((self.wing_force(&(v + step), n) - force) / DIFFERENCE));
            // A step off the sphere is one along it, and what is across does nothing to a normal.
            let turned = unit(&(n + step));
            by_normal.set_column(axis, &((self.wing_force(v, &turned) - force) / DIFFERENCE));
        }
        (by_velocity, by_normal)
    }

    /// Where thrusts and wings lead from a position and a velocity.
    ///
    /// * `controls` - `U n`, N, and deployment at each node
    pub fn roll_out(
        &self,
        start: (Vector3<f64>, Vector3<f64>),
        controls: &[(Vector3<f64>, f64)],
        step_s: f64,
    ) -> Vec<Motion> {
        let Some((thrust, spread)) = controls.first() else { return Vec::new() };
        let (position, velocity) = start;
        let acceleration = self.acceleration(&velocity, thrust, *spread);
        let mut path = vec![Motion { position, velocity, acceleration }];
        for (thrust, spread) in &controls[1..] {
            let Some(now) = path.last().copied() else { break };
            let mut next = now.acceleration;
            let mut velocity = now.velocity;
            for _ in 0..ROUNDS {
                velocity = now.velocity + (now.acceleration + next) * (0.5 * step_s);
                next = self.acceleration(&velocity, thrust, *spread);
            }
            let position = now.position
                + now.velocity * step_s
                + (now.acceleration * 2.0 + next) * (step_s * step_s / 6.0);
            path.push(Motion { position, velocity, acceleration: next });
        }
        path
    }
}

/// `J / (d m g)` for pitch and roll: `U <= n F_max - |tau| / d` with rotors at distance `d` from
/// the axis, and `tau = J T'' / U`.
fn turning_s2(vehicle: &VehicleFile) -> [f64; 2] {
    let (p, rotors) = (vehicle.vehicle.parameters(), vehicle.vehicle.rotors());
    let arm_m = |axis: usize| {
        rotors.iter().map(|rotor| rotor.position.vector[axis].abs()).sum::<f64>()
            / rotors.len() as f64
    };
    let inertia = p.inertia_kg_m2;
    [(1, 0), (0, 1)]
        .map(|(about, along)| inertia[(about, about)] / (arm_m(along) * vehicle.vehicle.weight_n()))
}

/// A row each component, a column each variable.
fn jacobian(of: &[Dual<3>; 3]) -> Matrix3<f64> {
    Matrix3::from_fn(|row, column| of[row].by[column])
}

/// Derivatives of the acceleration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slopes {
    /// By velocity, 1/s.
    pub by_velocity: Matrix3<f64>,
    /// By thrust, 1/kg.
    pub by_thrust: Matrix3<f64>,
    /// By deployment, m/s^2.
    pub by_spread: Vector3<f64>,
}

/// Motion at a node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// NED, m.
    pub position: Vector3<f64>,
    /// NED, m/s.
    pub velocity: Vector3<f64>,
    /// NED, m/s^2.
    pub acceleration: Vector3<f64>,
}

fn unit(thrust: &Vector3<f64>) -> Vector3<f64> {
    let norm = thrust.norm();
    if norm > 1e-9 { thrust / norm } else { Vector3::z() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn craft(wing: WingModel) -> Craft {
        let vehicle = VehicleFile::squirrel();
        Craft::of(&vehicle, 2.0 * vehicle.vehicle.weight_n(), Some(wing), RESERVE).unwrap()
    }

    /// Every derivative is the difference quotient, for the wing with a formula and for those
    /// without.
    #[test]
    fn slopes_are_slopes() {
        let v = Vector3::new(6.0, -1.0, 0.8);
        let thrust = Vector3::new(2.0, -0.7, 5.0);
        for (model, tolerance) in
            [(WingModel::Flat, 1e-5), (WingModel::Membrane, 2e-2), (WingModel::Parnn, 2e-2)]
        {
            let craft = craft(model);
            let slopes = craft.slopes(&v, &thrust, 0.7);
            let h = 2e-3;
            for axis in 0..3 {
                let mut e = Vector3::zeros();
                e[axis] = h;
                let by = |plus: Vector3<f64>, minus: Vector3<f64>| (plus - minus) / (2.0 * h);
                let a = |v: Vector3<f64>, t: Vector3<f64>| craft.acceleration(&v, &t, 0.7);
                let by_velocity = by(a(v + e, thrust), a(v - e, thrust));
                let by_thrust = by(a(v, thrust + e), a(v, thrust - e));
                assert!(
                    (slopes.by_velocity.column(axis) - by_velocity).norm() < tolerance,
                    "{model:?}"
                );
                assert!(
                    (slopes.by_thrust.column(axis) - by_thrust).norm() < tolerance,
                    "{model:?}"
                );
            }
            let by_spread =
                craft.acceleration(&v, &thrust, 1.0) - craft.acceleration(&v, &thrust, 0.0);
            assert!((slopes.by_spread - by_spread).norm() < 1e-9);
        }
    }

    /// A roll-out of tenths of a second is the motion that thousandths give.
    #[test]
    fn a_roll_out_is_the_motion() {
        let craft = craft(WingModel::Flat);
        let start = (Vector3::zeros(), Vector3::new(7.0, 0.0, 0.0));
        let control = |t: f64| {
            let tilt = 0.4 * (2.0 * t).sin();
            (Vector3::new(tilt.sin(), 0.1 * t, tilt.cos()) * 6.0, (2.0 * t).min(1.0))
        };
        let run = |step_s: f64, steps: usize| {
            let controls: Vec<_> = (0..=steps).map(|k| control(k as f64 * step_s)).collect();
            craft.roll_out(start, &controls, step_s)
        };
        let (coarse, fine) = (run(0.1, 20), run(1e-3, 2000));
        let (a, b) = (coarse.last().unwrap(), fine.last().unwrap());
        assert!((a.position - b.position).norm() < 0.02, "{a:?} {b:?}");
        assert!((a.velocity - b.velocity).norm() < 0.02);
    }

    #[test]
    fn a_vehicle_that_cannot_hover_is_refused() {
        let vehicle = VehicleFile::squirrel();
        let error =
            Craft::of(&vehicle, 1.02 * vehicle.vehicle.weight_n(), None, RESERVE).unwrap_err();
        assert!(error.contains("thrust_max_n"), "{error}");
        assert!(Craft::of(&vehicle, f64::NAN, None, RESERVE).is_err());
        assert_eq!(
            Craft::of(&vehicle, 9.0, None, 0.9).unwrap_err(),
            "reserve = 0.9: must be 0 to 0.5"
        );
    }
}
