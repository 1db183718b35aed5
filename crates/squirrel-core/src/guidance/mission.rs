//! Missions: which reference to follow, and what to do about an obstacle.
//!
//! An avoidance mission flies straight at a target speed. When [`super::sensing`] reports an
//! obstacle, a new [`Trajectory`] starts at the measured position, at rest, turned by a steering
//! angle (paper, section V.B and V.C; docs/equations.md T20). Its height stays the mission's
//! height, so that lost height counts as error.

use super::excite::{Excitation, Programme};
use super::sensing::{Obstacle, Sensing, offset};
use super::trajectory::Trajectory;
use crate::command::Reference;
use crate::frames::{In, Ned};
use crate::math::{whole, wrap_angle};
use crate::vehicle::{ParameterError, Vehicle};
use nalgebra::Vector3;

/// What to do.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(
    clippy::large_enum_variant,
    reason = "flight code has no heap, and there is one mission a flight"
)]
pub enum Mission {
    /// Hold a position, m.
    Hover {
        /// The position, m.
        position: In<Ned, f32>,
    },
    /// Fly straight and steer away from obstacles.
    Avoid {
        /// The first run.
        run: Trajectory,
        /// What is seen.
        sensing: Sensing,
        /// How far to turn.
        steering: Steering,
    },
    /// Circle around a centre at constant speed, heading north.
    Circle {
        /// Centre, m.
        centre: In<Ned, f32>,
        /// Radius, m.
        radius_m: f32,
        /// Speed along the circle, m/s.
        speed_m_s: f32,
    },
    /// Manoeuvres for identification.
    Excite(Programme),
}

/// Steering angles, drawn anew for each encounter from the seed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Steering {
    /// Smallest turn, rad; positive is to the right.
    pub min_rad: f32,
    /// Largest turn, rad.
    pub max_rad: f32,
    /// Time to reach the target speed after the turn, s.
    pub ramp_s: f32,
    /// To which side.
    pub side: TurnSide,
    /// Seed of the draw.
    pub seed: u32,
}

/// To which side a mission turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TurnSide {
    /// The angle's own.
    Angle,
    /// Either, drawn from the seed too, wherever the obstacle is.
    Drawn,
    /// Away from the obstacle's axis; drawn where it is straight ahead.
    Away,
}

/// Most obstacles that are remembered as being avoided; of more, the first is forgotten.
pub const MAX_HANDLED: usize = 4;

/// What guidance remembers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MissionState {
    /// The run after the last encounter, if any, and when it started, us.
    pub turned: Option<(Trajectory, u64)>,
    /// Obstacles that are being avoided.
    pub handled: [Option<Obstacle>; MAX_HANDLED],
    /// Encounters so far.
    pub encounters: u32,
}

impl Mission {
    /// # Errors
    /// A number out of range, by its name in a scenario.
    pub fn check(&self) -> Result<(), ParameterError> {
        use crate::vehicle::positive;
        let finite =
            |field, place: &In<Ned, f32>| match place.vector.iter().find(|x| !x.is_finite()) {
                Some(x) => Err(ParameterError::of(field, *x, "must be finite")),
                None => Ok(()),
            };
        match self {
            Self::Hover { position } => finite("position", position),
            Self::Avoid { run, sensing, steering } => {
                finite("start", &run.start)?;
                if !(run.course_rad().abs() <= core::f32::consts::TAU) {
                    return Err(ParameterError::of(
                        "course_rad",
                        run.course_rad(),
                        "must be within one turn",
                    ));
                }
                positive("speed_m_s", run.speed_m_s)?;
                positive("ramp_s", run.ramp_s)?;
                positive("turn_ramp_s", steering.ramp_s)?;
                sensing.check()?;
                for (field, angle) in
                    [("steering_min_rad", steering.min_rad), ("steering_max_rad", steering.max_rad)]
                {
                    if !(angle.abs() <= core::f32::consts::PI) {
                        return Err(ParameterError::of(field, angle, "must be within half a turn"));
                    }
                }
                if steering.min_rad > steering.max_rad {
                    return Err(ParameterError::of(
                        "steering_min_rad",
                        steering.min_rad,
                        "must be <= steering_max_rad",
                    ));
                }
                Ok(())
            }
            Self::Circle { centre, radius_m, speed_m_s } => {
                finite("centre", centre)?;
                positive("radius_m", *radius_m)?;
                positive("speed_m_s", *speed_m_s)
            }
            // A programme is checked when it is made.
            Self::Excite(_) => Ok(()),
        }
    }

    /// Looks for an obstacle and turns away from it. Called at the outer rate.
    pub fn sense(
        &self,
        state: &mut MissionState,
        time_us: u64,
        position: In<Ned, f32>,
        velocity: In<Ned, f32>,
        obstacles: &[Obstacle],
    ) {
        let Self::Avoid { run, sensing, steering } = self else { return };
        // Debounce: an obstacle is forgotten once it is out of range.
        for handled in &mut state.handled {
            if handled.is_some_and(|o| offset(position, &o).norm() > sensing.range_m) {
                *handled = None;
            }
        }
        let known = |id: u32| state.handled.iter().flatten().any(|o| o.id == id);
        let Some(seen) = sensing.nearest(position, velocity, obstacles, known) else { return };
        let course = libm::atan2f(velocity.vector.y, velocity.vector.x);
        let start = In::new(Vector3::new(position.vector.x, position.vector.y, run.start.vector.z));
        let ahead = offset(position, &seen);
        let right_m2_s = velocity.vector.x * ahead.y - velocity.vector.y * ahead.x;
        let course_rad = wrap_angle(course + steering.angle(state.encounters, right_m2_s));
        let turned = Trajectory::new(start, course_rad, run.speed_m_s, steering.ramp_s);
        state.turned = Some((turned, time_us));
        let free = state.handled.iter().position(Option::is_none).unwrap_or(0);
        state.handled[free] = Some(seen);
        state.encounters = state.encounters.wrapping_add(1);
    }

    /// The reference at a time since the start of the mission.
    pub fn reference(&self, state: &MissionState, time_us: u64) -> Reference {
        let since = |start_us: u64| whole(time_us.saturating_sub(start_us)) as f32 * 1e-6;
        match self {
            Self::Hover { position } => Reference {
                position: *position,
                velocity: In::zero(),
                acceleration: In::zero(),
                yaw_rad: 0.0,
            },
            Self::Avoid { run, .. } => match &state.turned {
                Some((turned, start_us)) => turned.at(since(*start_us)),
                None => run.at(since(0)),
            },
            Self::Circle { centre, radius_m, speed_m_s } => {
                let rate = speed_m_s / radius_m;
                let angle = wrap_angle(rate * since(0));
                let (s, c) = libm::sincosf(angle);
                let radius = Vector3::new(c, s, 0.0) * *radius_m;
                Reference {
                    position: *centre + In::new(radius),
                    velocity: In::new(Vector3::new(-s, c, 0.0) * *speed_m_s),
                    acceleration: In::new(-radius * (rate * rate)),
                    yaw_rad: 0.0,
                }
            }
            Self::Excite(programme) => programme.reference(time_us),
        }
    }

    /// Where the reference's sink at a time will have ended, m down; `None` where it never sinks.
    pub fn rest_down_m(&self, time_us: u64) -> Option<f32> {
        match self {
            Self::Excite(programme) => Some(programme.rest_down_m(time_us)),
            _ => None,
        }
    }

    /// Wing command that the mission forces whatever the controller wants, 0 folded to 1 spread.
    pub fn wing_command(&self, time_us: u64) -> Option<f32> {
        match self {
            Self::Excite(programme) => Some(programme.wing_command(time_us)),
            _ => None,
        }
    }

    /// What the mission adds to attitude and thrust commands.
    pub fn excitation(&self, time_us: u64) -> Option<Excitation> {
        match self {
            Self::Excite(programme) => programme.excitation(time_us),
            _ => None,
        }
    }

    /// What [`Self::excitation`] takes of a vehicle's largest thrust, N.
    pub(crate) fn excitation_thrust_n(&self, vehicle: &Vehicle<f32>) -> f32 {
        match self {
            Self::Excite(programme) => programme.multisine().thrust_taken_n(vehicle),
            _ => 0.0,
        }
    }

    /// Roll and pitch that [`Self::excitation`] may add, rad: the outer loop leaves them free.
    pub fn excitation_tilt_rad(&self) -> f32 {
        match self {
            Self::Excite(programme) => programme.multisine().tilt_max_rad(),
            _ => 0.0,
        }
    }
}

impl Steering {
    /// The turn at encounter `n`, rad.
    ///
    /// * `right` - positive where the obstacle is to the right of the course
    fn angle(&self, n: u32, right: f32) -> f32 {
        let bits = scramble(self.seed.wrapping_add((n.wrapping_add(1)).wrapping_mul(0x9E37_79B9)));
        let share = (bits >> 8) as f32 / (1u32 << 24) as f32;
        let angle = self.min_rad + (self.max_rad - self.min_rad) * share;
        let drawn = if bits & 1 == 1 { -angle } else { angle };
        match self.side {
            TurnSide::Angle => angle,
            TurnSide::Away if right > 0.0 => -angle.abs(),
            TurnSide::Away if right < 0.0 => angle.abs(),
            TurnSide::Drawn | TurnSide::Away => drawn,
        }
    }
}

/// A well mixed 32-bit function (the finaliser of MurmurHash3): flight code needs a draw, not a
/// generator with state.
pub fn scramble(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x85EB_CA6B);
    x ^= x >> 13;
    x = x.wrapping_mul(0xC2B2_AE35);
    x ^ (x >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn avoid() -> Mission {
        Mission::Avoid {
            run: Trajectory::new(In::new(Vector3::new(0.0, 0.0, -10.0)), 0.0, 7.0, 2.0),
            sensing: Sensing { range_m: 5.0, half_view_rad: 0.2618, speed_min_m_s: 1.0 },
            steering: Steering {
                min_rad: 1.92,
                max_rad: 2.27,
                ramp_s: 2.0,
                side: TurnSide::Angle,
                seed: 3,
            },
        }
    }

    #[test]
    fn an_obstacle_turns_the_reference_once() {
        let (mission, mut state) = (avoid(), MissionState::default());
        let velocity = In::new(Vector3::new(7.0, 0.0, 0.0));
        let trunk = [Obstacle { id: 1, north_m: 24.0, east_m: 0.0 }];
        mission.sense(&mut state, 0, In::new(Vector3::new(18.0, 0.0, -10.0)), velocity, &trunk);
        assert_eq!(state.encounters, 0, "6 m away is out of range");
        let here = In::new(Vector3::new(19.5, 0.3, -9.0));
        mission.sense(&mut state, 3_000_000, here, velocity, &trunk);
        mission.sense(&mut state, 3_100_000, here, velocity, &trunk);
        assert_eq!(state.encounters, 1, "the same obstacle does not trigger twice");
        let start = mission.reference(&state, 3_000_000);
        assert_eq!(
            start.position.vector,
            Vector3::new(19.5, 0.3, -10.0),
            "starts here, at the mission's height"
        );
        assert_eq!(start.velocity.vector.norm(), 0.0);
        let later = mission.reference(&state, 8_000_000).velocity.vector;
        let turn = libm::atan2f(later.y, later.x);
        assert!((1.92..=2.27).contains(&turn), "turned by {turn}");
    }

    #[test]
    fn of_two_near_obstacles_neither_triggers_twice() {
        let (mission, mut state) = (avoid(), MissionState::default());
        let velocity = In::new(Vector3::new(7.0, 0.0, 0.0));
        let two = [3.0, 4.0].map(|x| Obstacle { id: x as u32, north_m: x, east_m: 0.0 });
        for tick in 0..6 {
            mission.sense(&mut state, tick * 100_000, In::zero(), velocity, &two);
        }
        assert_eq!(state.encounters, 2);
    }

    /// Flying east, a trunk to the left is to the north.
    #[test]
    fn who_turns_away_turns_to_the_side_without_the_obstacle() {
        let Mission::Avoid { run, sensing, steering } = avoid() else { unreachable!() };
        let steering = Steering { side: TurnSide::Away, ..steering };
        let mission = Mission::Avoid { run, sensing, steering };
        let velocity = In::new(Vector3::new(0.0, 7.0, 0.0));
        for (north_m, side) in [(0.5, 1.0), (-0.5, -1.0)] {
            let mut state = MissionState::default();
            let trunk = [Obstacle { id: 1, north_m, east_m: 4.5 }];
            mission.sense(&mut state, 0, In::zero(), velocity, &trunk);
            let turned =
                wrap_angle(state.turned.unwrap().0.course_rad() - core::f32::consts::FRAC_PI_2);
            assert!((1.92..=2.27).contains(&(side * turned)), "{north_m}: {turned}");
        }
        let mut state = MissionState::default();
        let ahead = [Obstacle { id: 1, north_m: 0.0, east_m: 4.5 }];
        mission.sense(&mut state, 0, In::zero(), velocity, &ahead);
        assert!(state.turned.is_some(), "straight ahead, a side is drawn");
    }

    #[test]
    fn numbers_that_are_none_are_refused_by_name() {
        let Mission::Avoid { run, sensing, steering } = avoid() else { unreachable!() };
        let broken = Mission::Avoid {
            run: Trajectory::new(run.start, f32::NAN, 7.0, 2.0),
            sensing,
            steering,
        };
        assert!(broken.check().unwrap_err().to_string().starts_with("course_rad = NaN"));
        let hover = Mission::Hover { position: In::new(Vector3::new(0.0, f32::INFINITY, 0.0)) };
        assert!(hover.check().is_err());
    }

    #[test]
    fn steering_angles_fill_their_range_and_both_sides() {
        let steering =
            Steering { min_rad: 1.0, max_rad: 2.0, ramp_s: 2.0, side: TurnSide::Drawn, seed: 1 };
        let angles: Vec<f32> = (0..1000).map(|n| steering.angle(n, 1.0)).collect();
        assert!(angles.iter().all(|a| (1.0..=2.0).contains(&a.abs())));
        let right = angles.iter().filter(|a| **a > 0.0).count();
        let far = angles.iter().filter(|a| a.abs() > 1.5).count();
        assert!((400..600).contains(&right) && (400..600).contains(&far), "{right} {far}");
    }

    #[test]
    fn the_circle_closes_and_its_velocity_is_tangential() {
        let circle = Mission::Circle { centre: In::zero(), radius_m: 2.0, speed_m_s: 3.0 };
        let state = MissionState::default();
        for k in 0..20u64 {
            let r = circle.reference(&state, k * 100_000);
            assert!(r.position.vector.dot(&r.velocity.vector).abs() < 1e-4);
            assert!((r.position.vector.norm() - 2.0).abs() < 1e-5);
        }
    }
}
