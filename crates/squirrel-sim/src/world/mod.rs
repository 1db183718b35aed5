//! The world around the vehicle: ground, obstacles and contact, solved by rapier.
//!
//! Free flight belongs to the RK4 of `squirrel_core::dynamics`. Contact needs a solver, so near the
//! ground or an obstacle [`World::step`] takes over; [`World::is_near`] says when. State goes in
//! and comes out at every step, so the two may alternate at will. The only memory between steps is
//! which contacts are old, for those do not bounce again.
//!
//! The price of `step` is order one: rapier's semi-implicit Euler (four substeps a step), and a
//! force and moment that keep their world direction over the step. Error against RK4 after 1 s of a
//! tumbling, thrusting vehicle (`tests/world_free_flight.rs` prints it):
//!
//! ```text
//! step    attitude     position
//! 4 ms    0.109 deg    5.78 mm
//! 2 ms    0.055 deg    2.89 mm
//! 1 ms    0.027 deg    1.44 mm
//! ```
//!
//! Contact is a model too. At rest the box sinks into the ground by 0.16 mm for 25 mm of thickness.
//! Steps should be 1 ms or less near solids: contact keeps its lever arms over the step, and a fast
//! tumble gains up to 0.5 % of its energy in the course of its impacts at 1 ms, 1 % at 4 ms
//! (`tests/world_contact.rs`).

mod convert;
mod grid;
mod parameters;

pub use parameters::{Cylinder, MAX_OBSTACLES, RESTITUTION_MAX, WorldError, WorldParameters};

use grid::Grid;
use nalgebra::{UnitQuaternion, Vector3};
use rapier3d_f64::dynamics::{RigidBodyBuilder, RigidBodyHandle};
use rapier3d_f64::geometry::{ColliderBuilder, ColliderHandle, SharedShape};
use rapier3d_f64::pipeline::PhysicsWorld;
use squirrel_core::dynamics::State;
use squirrel_core::frames::{Body, In, Ned, Wrench};
use squirrel_core::math::GRAVITY_M_S2;
use squirrel_core::vehicle::{ParameterError, Vehicle};

/// The mark of the ground's collider; an obstacle's is its index.
const GROUND: u128 = u128::MAX;

/// What the vehicle pushed against during a step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Contact {
    /// Whether anything pushed back.
    pub touching: bool,
    /// The obstacle that pushed hardest, an index into [`WorldParameters::obstacles`].
    pub obstacle: Option<usize>,
    /// Whether the ground pushed.
    pub ground: bool,
    /// What contact changed of the vehicle's momentum, normal and friction together, N s.
    pub impulse_n_s: f64,
}

/// Ground and obstacles with one vehicle in them.
pub struct World {
    physics: PhysicsWorld,
    body: RigidBodyHandle,
    shape: ColliderHandle,
    grid: Grid,
    ground: bool,
    /// Of the sphere about the centre of mass that holds the vehicle's box, m.
    bounding_radius_m: f64,
    mass_kg: f64,
}

impl World {
    /// Builds the world.
    ///
    /// * `vehicle` - gives mass and inertia
    ///
    /// # Errors
    /// [`WorldError::Value`] names the first parameter that is not finite or out of range.
    pub fn new(vehicle: &Vehicle<f64>, parameters: &WorldParameters) -> Result<Self, WorldError> {
        parameters::check(parameters)?;
        let half = Vector3::from(parameters.size_body_m) * 0.5;
        let mut physics = PhysicsWorld::new();
        physics.gravity = convert::to_vector(Vector3::new(0.0, 0.0, GRAVITY_M_S2));
        let integration = &mut physics.integration_parameters;
        // rapier's tolerances are for things of a metre; an airframe is a few centimetres thick.
        integration.length_unit = parameters.size_body_m.into_iter().fold(f64::INFINITY, f64::min);
        // No cap on speed, which is 400 m/s by default.
        integration.normalized_max_linear_velocity = f64::MAX;
        // Impulses carried over from the step before push on a body that has bounced or turned
        // since: tumbling impacts gained up to 6 % of energy that way, 0.5 % without. More
        // iterations make up for the worse first guess.
        integration.warmstart_coefficient = 0.0;
        integration.num_internal_pgs_iterations = 4;
        integration.num_internal_stabilization_iterations = 4;

        let surface = |shape: SharedShape| {
            ColliderBuilder::new(shape)
                .density(0.0)
                .restitution(parameters.restitution)
                .friction(parameters.friction)
        };
        let p = vehicle.parameters();
        let body = RigidBodyBuilder::dynamic()
            .additional_mass_properties(convert::mass_properties(p.mass_kg, &p.inertia_kg_m2))
            .can_sleep(false)
            .allow_fast_rotation(true)
            // Contacts are looked for along the way of the step, so that impact happens at the
            // surface. What is faster than that meets rapier's sweep of fast bodies, which is on by
            // default and drops the rest of the step.
            .soft_ccd_prediction(half.norm());
        let (body, shape) =
            physics.insert(body, surface(SharedShape::cuboid(half.x, half.y, half.z)));
        if parameters.ground {
            // A slab and not a half-space: rapier does not stop a fast body at the latter.
            let slab = surface(SharedShape::cuboid(2e5, 2e5, 50.0))
                .position(convert::to_pose(
                    Vector3::new(0.0, 0.0, 50.0),
                    UnitQuaternion::identity(),
                ))
                .user_data(GROUND);
            physics.insert_collider(slab, None);
        }
        // rapier's cylinders stand along y.
        let upright =
            UnitQuaternion::from_axis_angle(&Vector3::x_axis(), core::f64::consts::FRAC_PI_2);
        for (i, c) in parameters.obstacles.iter().enumerate() {
            let centre = Vector3::new(c.north_m, c.east_m, -0.5 * c.height_m);
            let trunk = surface(SharedShape::cylinder(0.5 * c.height_m, c.radius_m))
                .position(convert::to_pose(centre, upright))
                .user_data(i as u128);
            physics.insert_collider(trunk, None);
        }
        Ok(Self {
            physics,
            body,
            shape,
            grid: Grid::new(&parameters.obstacles),
            ground: parameters.ground,
            bounding_radius_m: half.norm(),
            mass_kg: p.mass_kg,
        })
    }

    /// Distance from the vehicle's bounding sphere to the nearest solid, m, at most `horizon_m`;
    /// negative where the sphere reaches into one. NaN if an argument is.
    pub fn clearance(&self, position: In<Ned, f64>, horizon_m: f64) -> f64 {
        let p = position.vector;
        if (p.x + p.y + p.z + horizon_m).is_nan() {
            return f64::NAN;
        }
        let reach_m = horizon_m + self.bounding_radius_m;
        let mut distance_m = self.grid.distance_m(p, reach_m);
        if self.ground {
            distance_m = distance_m.min((-p.z).max(0.0));
        }
        (distance_m - self.bounding_radius_m).min(horizon_m)
    }

    /// Whether the next step might touch something and belongs to [`Self::step`]. A state that is
    /// not finite is near, so that `step` names what is wrong with it.
    pub fn is_near(&self, state: &State<f64>, dt_s: f64) -> bool {
        // Twice the way at the present speed and a tenth of the radius: room for what the step
        // itself accelerates.
        let margin_m = 2.0 * state.velocity.vector.norm() * dt_s + 0.1 * self.bounding_radius_m;
        let spare_m = self.clearance(state.position, margin_m) - margin_m;
        spare_m < 0.0 || spare_m.is_nan()
    }

    /// One step of length `dt_s` with contact. Rotor speeds pass through.
    ///
    /// * `wrench` - force and moment without gravity, held over the step
    ///
    /// # Errors
    /// [`WorldError::Value`] names an input that is not finite, or a step that is not positive;
    /// [`WorldError::Overflow`] if the step leaves the finite numbers. The world stays usable after
    /// either.
    pub fn step(
        &mut self,
        state: &State<f64>,
        wrench: &Wrench<Body, f64>,
        dt_s: f64,
    ) -> Result<(State<f64>, Contact), WorldError> {
        check(state, wrench, dt_s)?;
        let ned_from_body = state.normalised().ned_from_body();
        let body = &mut self.physics.bodies[self.body];
        // An overflow in an earlier step has disabled it.
        body.set_enabled(true);
        body.set_position(convert::to_pose(state.position.vector, ned_from_body.quaternion), true);
        body.set_linvel(convert::to_vector(state.velocity.vector), true);
        // rapier's angular velocity is in the world frame.
        body.set_angvel(convert::to_vector((ned_from_body * state.omega).vector), true);
        body.reset_forces(true);
        body.reset_torques(true);
        body.add_force(convert::to_vector((ned_from_body * wrench.force).vector), true);
        body.add_torque(convert::to_vector((ned_from_body * wrench.moment).vector), true);
        self.physics.integration_parameters.dt = dt_s;
        self.physics.step();

        let body = &self.physics.bodies[self.body];
        let (position, rotation) = convert::from_pose(body.position());
        let omega = rotation.inverse() * convert::from_vector(body.angvel());
        let next = State {
            position: In::new(position),
            velocity: In::new(convert::from_vector(body.linvel())),
            attitude: rotation.into_inner(),
            omega: In::new(omega),
            rotor_speed_rad_s: state.rotor_speed_rad_s,
        };
        // rapier takes a body that is no longer finite out of the world and goes on without it.
        if !self.physics.quarantine().is_empty() {
            return Err(WorldError::Overflow {
                dt_s,
                speed_m_s: state.velocity.vector.norm(),
                rate_rad_s: state.omega.vector.norm(),
                force_n: wrench.force.vector.norm(),
                moment_n_m: wrench.moment.vector.norm(),
            });
        }
        let free_m_s2 =
            (ned_from_body * wrench.force).vector / self.mass_kg + Vector3::z() * GRAVITY_M_S2;
        let pushed_m_s = ((next.velocity - state.velocity).vector - free_m_s2 * dt_s).norm();
        let rounding_m_s = 1e-12
            * (state.velocity.vector.norm()
                + next.velocity.vector.norm()
                + free_m_s2.norm() * dt_s);
        let contact = if pushed_m_s > rounding_m_s {
            self.contact(self.mass_kg * pushed_m_s)
        } else {
            Contact::default()
        };
        Ok((next, contact))
    }

    /// Who gave the impulse. How large it was is known better from the balance of momentum:
    /// rapier's reports, which serve to compare the obstacles, count pushes that a later iteration
    /// of the same step undid.
    fn contact(&self, impulse_n_s: f64) -> Contact {
        let mut contact = Contact { impulse_n_s, ..Contact::default() };
        let mut hardest_n_s = 0.0;
        for pair in self.physics.contact_pairs_with(self.shape) {
            let share_n_s = pair.total_impulse_magnitude();
            // A pair within reach that bears no load does not touch yet.
            if !pair.has_any_active_contact() || share_n_s <= 0.0 {
                continue;
            }
            contact.touching = true;
            let other = if pair.collider1 == self.shape { pair.collider2 } else { pair.collider1 };
            let mark = self.physics.colliders[other].user_data;
            if mark == GROUND {
                contact.ground = true;
            } else if share_n_s > hardest_n_s {
                hardest_n_s = share_n_s;
                contact.obstacle = Some(mark as usize);
            }
        }
        contact
    }
}

impl core::fmt::Debug for World {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("World")
            .field("colliders", &self.physics.colliders.len())
            .field("bounding_radius_m", &self.bounding_radius_m)
            .finish_non_exhaustive()
    }
}

/// Longest step, s: a contact that takes longer is no contact any more, and its solver may take for
/// ever.
const STEP_MAX_S: f64 = 1.0;

fn check(state: &State<f64>, wrench: &Wrench<Body, f64>, dt_s: f64) -> Result<(), ParameterError> {
    use parameters::finite;
    finite("state.position_ned_m", &state.position.vector)?;
    finite("state.velocity_ned_m_s", &state.velocity.vector)?;
    let q = state.attitude;
    finite("state.q_ned_from_body_wxyz", &[q.w, q.i, q.j, q.k])?;
    let norm = q.norm();
    if !(0.5..=2.0).contains(&norm) {
        return Err(ParameterError {
            field: "norm of state.q_ned_from_body_wxyz",
            index: None,
            value: norm,
            reason: "must be 1",
        });
    }
    finite("state.omega_body_rad_s", &state.omega.vector)?;
    finite("wrench.force_body_n", &wrench.force.vector)?;
    finite("wrench.moment_body_n_m", &wrench.moment.vector)?;
    if !(dt_s > 0.0 && dt_s <= STEP_MAX_S) {
        return Err(ParameterError {
            field: "dt_s",
            index: None,
            value: dt_s,
            reason: "must be > 0 and <= 1",
        });
    }
    Ok(())
}
