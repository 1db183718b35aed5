//! What the world is made of, and what is refused.

use crate::scenario::OBSTACLE_RADIUS_MIN_M;
use squirrel_core::vehicle::ParameterError;

/// Most obstacles of a world.
pub const MAX_OBSTACLES: usize = 10_000;

/// Top restitution. Above it the impacts of a fast tumble give back more energy than they took:
/// measured over 300 such flights, 12 % more with 0.8 at a step of 4 ms.
pub const RESTITUTION_MAX: f64 = 0.5;

/// A vertical cylinder that stands on the plane down = 0: a trunk, a pole, a tower.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cylinder {
    /// Axis, north of the origin, m.
    pub north_m: f64,
    /// Axis, east of the origin, m.
    pub east_m: f64,
    /// Radius, m.
    pub radius_m: f64,
    /// Height of the top over the plane down = 0, m.
    pub height_m: f64,
}

/// The world and the vehicle's shape in it, unchecked.
#[derive(Debug, Clone, PartialEq)]
pub struct WorldParameters {
    /// Edges of the box that the airframe fills, along the body axes, m; centred on the centre of
    /// mass.
    pub size_body_m: [f64; 3],
    /// Fixed obstacles. [`super::Contact::obstacle`] is an index into this list.
    pub obstacles: Vec<Cylinder>,
    /// Whether the plane down = 0 is solid ground, 200 km around the origin and 100 m deep.
    pub ground: bool,
    /// Speed after over speed before an impact, along the normal, 0 to [`RESTITUTION_MAX`]; 0 stays
    /// where it lands.
    pub restitution: f64,
    /// Coulomb's coefficient, for sticking and for sliding.
    pub friction: f64,
}

/// A world or a step that cannot be.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum WorldError {
    /// A number of the world, the state, the wrench or the step cannot be used.
    #[error(transparent)]
    Value(#[from] ParameterError),
    /// Every number was finite before the step and one was not after it.
    #[error(
        "the step of {dt_s} s overflowed: speed {speed_m_s} m/s, rate {rate_rad_s} rad/s, \
         force {force_n} N, moment {moment_n_m} N m"
    )]
    Overflow {
        /// Length of the step, s.
        dt_s: f64,
        /// Speed before the step, m/s.
        speed_m_s: f64,
        /// Angular rate before the step, rad/s.
        rate_rad_s: f64,
        /// Force that was held over the step, N.
        force_n: f64,
        /// Moment that was held over the step, N m.
        moment_n_m: f64,
    },
}

/// `value` must lie in `[low, high]`, which NaN does not.
fn within(
    field: &'static str,
    index: Option<usize>,
    value: f64,
    [low, high]: [f64; 2],
    reason: &'static str,
) -> Result<(), ParameterError> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(ParameterError { field, index, value, reason })
}

pub(super) fn check(p: &WorldParameters) -> Result<(), ParameterError> {
    for (i, size) in p.size_body_m.iter().enumerate() {
        within("size_body_m", Some(i), *size, [1e-3, 100.0], "must be 0.001 to 100 m")?;
    }
    within("restitution", None, p.restitution, [0.0, RESTITUTION_MAX], "must be 0 to 0.5")?;
    within("friction", None, p.friction, [0.0, 100.0], "must be 0 to 100")?;
    if p.obstacles.len() > MAX_OBSTACLES {
        return Err(ParameterError {
            field: "obstacles (number of entries)",
            index: None,
            value: p.obstacles.len() as f64,
            reason: "must be at most 10000",
        });
    }
    for (i, c) in p.obstacles.iter().enumerate() {
        let place = "must be finite and within 100 km";
        within("obstacles[].north_m", Some(i), c.north_m, [-1e5, 1e5], place)?;
        within("obstacles[].east_m", Some(i), c.east_m, [-1e5, 1e5], place)?;
        within(
            "obstacles[].radius_m",
            Some(i),
            c.radius_m,
            [OBSTACLE_RADIUS_MIN_M, 1e3],
            "must be 0.001 to 1000 m",
        )?;
        within(
            "obstacles[].height_m",
            Some(i),
            c.height_m,
            [1e-3, 1e3],
            "must be 0.001 to 1000 m",
        )?;
    }
    Ok(())
}

/// Every one of `values` must be finite.
pub(super) fn finite<'a>(
    field: &'static str,
    values: impl IntoIterator<Item = &'a f64>,
) -> Result<(), ParameterError> {
    for (i, value) in values.into_iter().enumerate() {
        if !value.is_finite() {
            return Err(ParameterError {
                field,
                index: Some(i),
                value: *value,
                reason: "must be finite",
            });
        }
    }
    Ok(())
}
