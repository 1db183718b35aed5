//! What a learned policy sees and what its numbers mean: the same in training, in simulation and in
//! flight.
//!
//! A policy is a function from [`OBSERVATION`] numbers to [`ACTION`] numbers, for example a
//! [`Policy`] network. It follows a reference, knows one obstacle at a time, and answers with
//! attitude, thrust and wings, which the inner loop of the stack flies. All numbers are of order
//! one. Ours; the paper has no learned control.
//!
//! | observation | what | scale |
//! |---|---|---|
//! | 0..3 | reference minus position, NED, limited to 10 m | 2 m |
//! | 3..6 | reference velocity minus velocity, NED, limited to 25 m/s | 5 m/s |
//! | 6..9 | reference velocity, NED, limited to 25 m/s | 5 m/s |
//! | 9..18 | body axes in NED: forward, right, down | 1 |
//! | 18..21 | body rates, limited to 25 rad/s | 5 rad/s |
//! | 21 | 1 where an obstacle is known, else 0, and the next two with it | 1 |
//! | 22..24 | from the vehicle to its axis, north and east | its range |
//! | 24 | wing command that holds | 1 |

pub use crate::command::PilotCommand;
use crate::command::{AttitudeThrust, Reference};
use crate::frames::{Body, In, Ned, Rotation};
use crate::guidance::sensing::{Obstacle, Sensing};
use crate::math::{limit, lower};
use crate::rnn::mlp::Mlp;
use crate::vehicle::{Limits, Vehicle};
use nalgebra::{Vector2, Vector3};

/// Numbers that a policy sees.
pub const OBSERVATION: usize = 25;
/// Numbers that a policy answers with: roll, pitch, thrust, wings.
pub const ACTION: usize = 4;
/// Neurons in each layer of [`Policy`].
pub const HIDDEN: usize = 32;
/// How often a policy is asked, Hz.
pub const RATE_HZ: u64 = 50;

/// A policy that fits a small processor. Its outputs count limited to [-1, 1].
pub type Policy = Mlp<OBSERVATION, HIDDEN, ACTION>;

const POSITION_M: f32 = 2.0;
const VELOCITY_M_S: f32 = 5.0;
const RATE_RAD_S: f32 = 5.0;
/// What is larger than this many scales looks no larger.
const LARGEST: f32 = 5.0;

/// What is known of the vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sight {
    /// m.
    pub position: In<Ned, f32>,
    /// m/s.
    pub velocity: In<Ned, f32>,
    /// Attitude.
    pub ned_from_body: Rotation<Ned, Body, f32>,
    /// rad/s.
    pub omega: In<Body, f32>,
    /// Share of its range that the known obstacle is away, north and east.
    pub obstacle: Option<Vector2<f32>>,
    /// Wing command that holds, 0 folded to 1 spread.
    pub wing: f32,
}

/// The numbers that a policy sees, see the module.
pub fn observe(sight: &Sight, reference: &Reference) -> [f32; OBSERVATION] {
    let scaled = |v: Vector3<f32>, scale: f32| v.map(|x| limit(x / scale, -LARGEST, LARGEST));
    let axis = |v: Vector3<f32>| (sight.ned_from_body * In::<Body, f32>::new(v)).vector;
    let parts = [
        scaled(reference.position.vector - sight.position.vector, POSITION_M),
        scaled(reference.velocity.vector - sight.velocity.vector, VELOCITY_M_S),
        scaled(reference.velocity.vector, VELOCITY_M_S),
        axis(Vector3::x()),
        axis(Vector3::y()),
        axis(Vector3::z()),
        scaled(sight.omega.vector, RATE_RAD_S),
        sight.obstacle.map_or(Vector3::zeros(), |offset| Vector3::new(1.0, offset.x, offset.y)),
    ];
    let mut seen = [0.0; OBSERVATION];
    for (place, number) in seen.iter_mut().zip(parts.iter().flat_map(|part| part.iter())) {
        *place = *number;
    }
    seen[OBSERVATION - 1] = sight.wing;
    seen
}

/// What the numbers of an action span.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// Weight of the vehicle, N: the thrust of an action of 0.
    pub weight_n: f32,
    /// Largest thrust, N.
    pub thrust_max_n: f32,
    /// Roll and pitch of an action of 1, rad.
    pub tilt_max_rad: f32,
}

impl Span {
    /// Of a vehicle.
    pub fn of(vehicle: &Vehicle<f32>) -> Self {
        let Limits { tilt_max_rad, thrust_max_n, .. } = vehicle.parameters().limits;
        Self { weight_n: vehicle.weight_n(), thrust_max_n, tilt_max_rad }
    }

    /// What an action means: roll and pitch as shares of the largest tilt, thrust in weights above
    /// hover, wings from -1 folded to 1 spread. Each number is limited to [-1, 1]; what is no
    /// number counts as -1.
    pub fn command(&self, action: &[f32; ACTION]) -> PilotCommand {
        let [roll, pitch, thrust, wing] = action.map(|x| limit(x, -1.0, 1.0));
        PilotCommand {
            attitude: AttitudeThrust {
                roll_rad: roll * self.tilt_max_rad,
                pitch_rad: pitch * self.tilt_max_rad,
                thrust_n: lower((1.0 + thrust) * self.weight_n, self.thrust_max_n),
            },
            wing: 0.5 * (1.0 + wing),
        }
    }
}

/// Looks out for one obstacle: the nearest that comes into view is known until it is out of range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lookout {
    /// What is seen.
    pub sensing: Sensing,
    /// What is known.
    pub known: Option<Obstacle>,
}

impl Lookout {
    /// Nothing known yet.
    pub fn new(sensing: Sensing) -> Self {
        Self { sensing, known: None }
    }

    /// Looks about; the known obstacle as [`Sight::obstacle`] has it.
    pub fn look(
        &mut self,
        position: In<Ned, f32>,
        velocity: In<Ned, f32>,
        obstacles: &[Obstacle],
    ) -> Option<Vector2<f32>> {
        let range_m = self.sensing.range_m;
        let away = |o: &Obstacle| Vector2::new(o.north_m, o.east_m) - position.vector.xy();
        self.known = self.known.filter(|known| away(known).norm() <= range_m);
        if let Some(nearest) = self.sensing.nearest(position, velocity, obstacles, |_| false) {
            self.known = Some(nearest);
        }
        self.known.map(|known| away(&known) / range_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn still() -> Sight {
        Sight {
            position: In::zero(),
            velocity: In::zero(),
            ned_from_body: Rotation::identity(),
            omega: In::zero(),
            obstacle: None,
            wing: 0.0,
        }
    }

    fn reference(x: f32) -> Reference {
        Reference {
            position: In::new(Vector3::new(x, 0.0, -1.0)),
            velocity: In::new(Vector3::new(7.5, 0.0, 0.0)),
            acceleration: In::zero(),
            yaw_rad: 0.0,
        }
    }

    #[test]
    fn each_number_is_where_the_table_says() {
        let turned = Rotation::from_euler(0.0, 0.0, core::f32::consts::FRAC_PI_2);
        let sight = Sight {
            ned_from_body: turned,
            omega: In::new(Vector3::new(0.0, 0.0, -2.5)),
            obstacle: Some(Vector2::new(0.5, -0.25)),
            wing: 0.75,
            ..still()
        };
        let seen = observe(&sight, &reference(4.0));
        assert_eq!(seen[..9], [2.0, 0.0, -0.5, 1.5, 0.0, 0.0, 1.5, 0.0, 0.0]);
        // Facing east: forward is east, right is south.
        let axes = [0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        assert!(seen[9..18].iter().zip(axes).all(|(a, b)| (a - b).abs() < 1e-6), "{seen:?}");
        assert_eq!(seen[18..], [0.0, 0.0, -0.5, 1.0, 0.5, -0.25, 0.75]);
        assert_eq!(observe(&still(), &reference(1e9))[0], LARGEST);
        assert_eq!(observe(&still(), &reference(4.0))[21..24], [0.0; 3]);
    }

    #[test]
    fn an_action_of_nothing_hovers_and_any_action_stays_inside() {
        let span = Span { weight_n: 5.0, thrust_max_n: 8.0, tilt_max_rad: 0.6 };
        let hover = span.command(&[0.0, 0.0, 0.0, -1.0]);
        assert_eq!(hover.attitude, AttitudeThrust { roll_rad: 0.0, pitch_rad: 0.0, thrust_n: 5.0 });
        assert_eq!(hover.wing, 0.0);
        let most = span.command(&[9.0, -9.0, 9.0, 9.0]);
        assert_eq!(most.attitude, AttitudeThrust { roll_rad: 0.6, pitch_rad: -0.6, thrust_n: 8.0 });
        assert_eq!(most.wing, 1.0);
        let none = span.command(&[f32::NAN; 4]);
        assert_eq!((none.attitude.thrust_n, none.wing), (0.0, 0.0));
    }

    #[test]
    fn an_obstacle_is_known_from_when_it_is_seen_until_it_is_out_of_range() {
        let sensing = Sensing { range_m: 5.0, half_view_rad: 0.2618, speed_min_m_s: 1.0 };
        let (mut lookout, trunk) =
            (Lookout::new(sensing), [Obstacle { id: 3, north_m: 10.0, east_m: 0.0 }]);
        let north = In::new(Vector3::new(7.0, 0.0, 0.0));
        let east = In::new(Vector3::new(0.0, 7.0, 0.0));
        let at = |n: f32, e: f32| In::new(Vector3::new(n, e, -10.0));
        assert_eq!(lookout.look(at(4.0, 0.0), north, &trunk), None, "too far");
        assert_eq!(lookout.look(at(6.0, 0.0), east, &trunk), None, "not ahead");
        assert_eq!(lookout.look(at(6.0, 0.0), north, &trunk), Some(Vector2::new(0.8, 0.0)));
        assert_eq!(
            lookout.look(at(6.0, 2.0), east, &trunk),
            Some(Vector2::new(0.8, -0.4)),
            "still known"
        );
        assert_eq!(lookout.look(at(6.0, 6.0), east, &trunk), None, "out of range");
    }
}
