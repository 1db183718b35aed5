//! Obstacles of a flight: a forest has thousands of which a few are near, and who is asked three
//! hundred times a second looks at those.

use squirrel_core::dynamics::State;
use squirrel_core::estimate::navigator::NavigationTerms;
use squirrel_core::guidance::sensing::Obstacle;
use squirrel_core::nalgebra::{Vector2, Vector3};
use squirrel_core::stack::MAX_OBSTACLES;

/// Obstacles further than this are not handed to the flight code, m.
const HORIZON_M: f64 = 50.0;
/// Way after which it is found out anew which are near, m.
const STALE_M: f64 = 10.0;
/// So few are always near.
const FEW: usize = 64;

/// All obstacles, and those near a place.
pub(super) struct Surroundings {
    all: Vec<[f64; 3]>,
    near: Vec<usize>,
    place: Option<Vector2<f64>>,
}

fn apart(obstacle: &[f64; 3], place: Vector2<f64>) -> f64 {
    (obstacle[0] - place.x).powi(2) + (obstacle[1] - place.y).powi(2)
}

impl Surroundings {
    /// * `all` - north, east, radius, m
    pub(super) fn new(all: Vec<[f64; 3]>) -> Self {
        Self { all, near: Vec::new(), place: None }
    }

    pub(super) fn all(&self) -> &[[f64; 3]] {
        &self.all
    }

    /// Those within the horizon of a place, and all where there are few, with their numbers.
    pub(super) fn near(&mut self, place: Vector2<f64>) -> impl Iterator<Item = (usize, &[f64; 3])> {
        if self.place.is_none_or(|before| !((place - before).norm() < STALE_M)) {
            let reach_m = HORIZON_M + STALE_M;
            let is_near = |obstacle: &[f64; 3]| {
                self.all.len() <= FEW || apart(obstacle, place) < reach_m * reach_m
            };
            self.near = (0..self.all.len()).filter(|i| is_near(&self.all[*i])).collect();
            self.place = Some(place);
        }
        self.near.iter().map(|i| (*i, &self.all[*i]))
    }

    /// The nearest ones where the flight code takes them to be: it sees them from where it is, and
    /// knows that as well as it knows its own place.
    pub(super) fn seen(
        &mut self,
        body: &State<f64>,
        believed: Option<&NavigationTerms>,
    ) -> Vec<Obstacle> {
        let at = body.position.vector;
        let off =
            believed.map_or(Vector3::zeros(), |terms| terms.position.vector.cast::<f64>() - at);
        let mut near: Vec<(f64, usize)> = self
            .near(at.xy())
            .map(|(i, obstacle)| (apart(obstacle, at.xy()), i))
            .filter(|(square, _)| *square < HORIZON_M * HORIZON_M)
            .collect();
        let order = |a: &(f64, usize), b: &(f64, usize)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        // Hundreds are within the horizon, 300 times a second: only those that are handed on are put
        // in order.
        if near.len() > MAX_OBSTACLES {
            near.select_nth_unstable_by(MAX_OBSTACLES, order);
            near.truncate(MAX_OBSTACLES);
        }
        near.sort_unstable_by(order);
        near.iter()
            .map(|(_, i)| {
                let [north, east, _] = self.all[*i];
                Obstacle {
                    id: *i as u32,
                    north_m: (north + off.x) as f32,
                    east_m: (east + off.y) as f32,
                }
            })
            .collect()
    }
}
