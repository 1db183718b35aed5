//! The simulator's wings: a checked pair of membranes, whose equations are
//! [`squirrel_core::aero::membrane`].
//!
//! Left and right are evaluated as one register, so that they share each instruction.

#[cfg(test)]
mod measured;
mod parameters;
#[cfg(test)]
mod tests;

pub use parameters::MembraneParameters;

use squirrel_core::aero::membrane::{self, Side};
use squirrel_core::aero::{Air, Airflow};
use squirrel_core::dynamics::VectorSpace;
use squirrel_core::frames::{Body, In, Wrench};
use squirrel_core::lane::{Lane, Portable};
use squirrel_core::math::AIR_DENSITY_KG_M3;
use squirrel_core::nalgebra::Vector3;
use squirrel_core::vehicle::ParameterError;

/// Left and right.
type Pair = Portable<f64, 2>;

/// Memory of the wings, `[left, right]`; as a rate, the derivative of each number per second. See
/// [`Side`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MembraneState {
    /// Elastic camber over chord, positive where the load comes from the belly.
    pub fast_camber: [f64; 2],
    /// Camber by creep over chord, signed likewise.
    pub creep_camber: [f64; 2],
    /// Attached fraction of the flow, 0 to 1.
    pub attached: [f64; 2],
}

/// A checked pair of membrane wings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Membrane {
    parameters: MembraneParameters,
    numbers: membrane::Membrane<Pair>,
}

impl MembraneState {
    /// Flat, with attached flow.
    pub fn at_rest() -> Self {
        Side::at_rest().into()
    }
    /// One side, 0 the left and 1 the right.
    pub(super) fn side(&self, side: usize) -> Side<f64> {
        Side {
            fast_camber: self.fast_camber[side],
            creep_camber: self.creep_camber[side],
            attached: self.attached[side],
        }
    }
    #[inline(always)]
    fn sides(&self) -> Side<Pair> {
        Side {
            fast_camber: Portable(self.fast_camber),
            creep_camber: Portable(self.creep_camber),
            attached: Portable(self.attached),
        }
    }
}

impl From<Side<Pair>> for MembraneState {
    #[inline(always)]
    fn from(sides: Side<Pair>) -> Self {
        Self {
            fast_camber: sides.fast_camber.0,
            creep_camber: sides.creep_camber.0,
            attached: sides.attached.0,
        }
    }
}

impl VectorSpace<f64> for MembraneState {
    #[inline(always)]
    fn plus_scaled(&self, h: f64, rate: &Self) -> Self {
        self.sides().plus_scaled(Pair::splat(h), &rate.sides()).into()
    }
}

impl Membrane {
    /// Checks the parameters.
    ///
    /// # Errors
    /// The first field that is not finite or out of range, with its value.
    pub fn new(parameters: MembraneParameters) -> Result<Self, ParameterError> {
        parameters.check()?;
        Ok(Self { numbers: parameters.numbers().map(Pair::splat), parameters })
    }

    /// The parameters as checked.
    pub fn parameters(&self) -> &MembraneParameters {
        &self.parameters
    }

    /// Angle of attack of each side, `[left, right]`, rad, in [-pi/2, pi/2], positive where the air
    /// hits the belly; 0 below 0.3 m/s. Its difference over a step is the rate that
    /// [`Self::evaluate`] takes.
    pub fn angle_of_attack(&self, air: &Air<f64>) -> [f64; 2] {
        self.numbers.angle_of_attack(&both(air), self.lateral()).0
    }

    /// Wrench of both wings about the centre of mass, and the rates of their state.
    ///
    /// Force, moment and the camber that the state tends to scale with deployment. Finite for any
    /// finite state and airspeeds up to 1e6 m/s; exactly no force without airspeed.
    ///
    /// * `angle_rate_rad_s` - rate of the angle of attack of each side, rad/s, held over a step;
    ///   limited to 20
    /// * `deployment` - 0 folded to 1 spread, each side
    #[inline(always)]
    pub fn evaluate(
        &self,
        air: &Air<f64>,
        angle_rate_rad_s: [f64; 2],
        deployment: [f64; 2],
        state: &MembraneState,
    ) -> (Wrench<Body, f64>, MembraneState) {
        let (rate, deployment) = (Portable(angle_rate_rad_s), Portable(deployment));
        let ([force, moment], rates) =
            self.numbers.evaluate(&both(air), self.lateral(), rate, deployment, &state.sides());
        let sum =
            |[x, y, z]: [Pair; 3]| In::new(Vector3::new(x, y, z).map(|Portable([l, r])| l + r));
        (Wrench { force: sum(force), moment: sum(moment) }, rates.into())
    }

    /// Each side's distance from the x axis, m.
    #[inline(always)]
    fn lateral(&self) -> Pair {
        Portable([-self.parameters.lateral_arm_m, self.parameters.lateral_arm_m])
    }
}

/// The same air at both sides.
#[inline(always)]
fn both(air: &Air<f64>) -> Airflow<Pair> {
    let Airflow { velocity, speed, omega } = Airflow::from(air);
    Airflow {
        velocity: velocity.map(Pair::splat),
        speed: Pair::splat(speed),
        omega: omega.map(Pair::splat),
    }
}

impl MembraneParameters {
    /// What the equations take of these.
    pub fn numbers(&self) -> membrane::Membrane<f64> {
        let eighth = self.prestrain / 8.0;
        membrane::Membrane {
            force_scale: 0.5 * AIR_DENSITY_KG_M3 * self.area_per_side_m2 * self.force_gain,
            load_scale: 3.0 / 128.0 * 0.5 * AIR_DENSITY_KG_M3 * self.chord_m / self.tension_n_per_m,
            prestrain_powers: [eighth, eighth * eighth, eighth * eighth * eighth],
            lead_m: 2.5 * self.chord_m,
            per_stall_width: 1.0 / self.stall_width_rad,
            attach_per_m: 0.25 / self.chord_m,
            camber_rate: 1.0 / self.camber_time_constant_s,
            creep_rate: 1.0 / self.creep_time_constant_s,
            arm_m: self.lateral_arm_m,
            place_m: [self.longitudinal_arm_m, self.vertical_arm_m],
            lift_slope: self.lift_slope,
            vortex_slope: self.vortex_slope,
            normal_drag: self.normal_drag,
            tangential_zero: self.tangential_zero,
            tangential_camber: self.tangential_camber,
            creep_fraction: self.creep_fraction,
            stall_angle_rad: self.stall_angle_rad,
            ahead_m: 0.25 * self.chord_m * self.pressure_centre_shift,
        }
    }
}
