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
/// Way after which it is found out anew which of the near ones may be handed on, m.
const STEP_M: f64 = 1.0;
/// So few are always near.
const FEW: usize = 64;

/// All obstacles, and those near a place.
pub(super) struct Surroundings {
    all: Vec<[f64; 3]>,
    near: Picked,
    /// Of the near ones, those that may be among the [`MAX_OBSTACLES`] nearest within a step.
    nearest: Picked,
}

/// Numbers of obstacles, and where the vehicle was when they were picked.
#[derive(Default)]
struct Picked {
    numbers: Vec<usize>,
    place: Option<Vector2<f64>>,
}

impl Picked {
    /// Not for this place: none picked yet, or picked further away than this.
    fn is_stale(&self, place: Vector2<f64>, way_m: f64) -> bool {
        self.place.is_none_or(|before| !((place - before).norm() < way_m))
    }
}

fn apart(obstacle: &[f64; 3], place: Vector2<f64>) -> f64 {
    (obstacle[0] - place.x).powi(2) + (obstacle[1] - place.y).powi(2)
}

impl Surroundings {
    /// * `all` - north, east, radius, m
    pub(super) fn new(all: Vec<[f64; 3]>) -> Self {
        Self { all, near: Picked::default(), nearest: Picked::default() }
    }

    pub(super) fn all(&self) -> &[[f64; 3]] {
        &self.all
    }

    /// Those within the horizon of a place, and all where there are few, with their numbers.
    pub(super) fn near(&mut self, place: Vector2<f64>) -> impl Iterator<Item = (usize, &[f64; 3])> {
        self.pick_near(place);
        self.near.numbers.iter().map(|i| (*i, &self.all[*i]))
    }

    fn pick_near(&mut self, place: Vector2<f64>) {
        if !self.near.is_stale(place, STALE_M) {
            return;
        }
        let reach_m = HORIZON_M + STALE_M;
        let is_near = |obstacle: &[f64; 3]| {
            self.all.len() <= FEW || apart(obstacle, place) < reach_m * reach_m
        };
        let numbers = (0..self.all.len()).filter(|i| is_near(&self.all[*i])).collect();
        self.near = Picked { numbers, place: Some(place) };
        // Picked out of the near ones of another place, which may lack some of the horizon here.
        self.nearest = Picked::default();
    }

    /// Picks those that may be among the nearest: hundreds are near, and the flight code asks 300
    /// times a second. On a step's way the distance of one grows and that of another shrinks by the
    /// step at most, so that none beyond two steps more than the last handed on comes before it.
    fn pick_nearest(&mut self, place: Vector2<f64>) {
        self.pick_near(place);
        if !self.nearest.is_stale(place, STEP_M) {
            return;
        }
        let mut squares: Vec<(f64, usize)> =
            self.near(place).map(|(i, obstacle)| (apart(obstacle, place), i)).collect();
        if squares.len() > MAX_OBSTACLES {
            let (_, last, _) =
                squares.select_nth_unstable_by(MAX_OBSTACLES - 1, |a, b| a.0.total_cmp(&b.0));
            let reach_m = last.0.sqrt() + 2.0 * STEP_M;
            squares.retain(|(square, _)| !(*square > reach_m * reach_m));
        }
        let numbers = squares.iter().map(|(_, i)| *i).collect();
        self.nearest = Picked { numbers, place: Some(place) };
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
        self.pick_nearest(at.xy());
        let mut near: Vec<(f64, usize)> = self
            .nearest
            .numbers
            .iter()
            .map(|i| (apart(&self.all[*i], at.xy()), *i))
            .filter(|(square, _)| *square < HORIZON_M * HORIZON_M)
            .collect();
        near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        near.truncate(MAX_OBSTACLES);
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

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    /// What is handed on along a way through a dense forest, by whole sorting at each step: over
    /// jumps, standing still, and out to where fewer than are handed on are within the horizon.
    #[test]
    fn seen_are_the_nearest_of_all() {
        let mut draw = Pcg64Mcg::seed_from_u64(21);
        let all: Vec<[f64; 3]> = (0..3000)
            .map(|_| [draw.random_range(-80.0..80.0), draw.random_range(-80.0..80.0), 0.2])
            .collect();
        let mut surroundings = Surroundings::new(all.clone());
        let mut body = State::<f64>::at_rest();
        let mut few = 0;
        for step in 0..20_000 {
            let way_m = if step % 997 == 0 { 15.0 } else { f64::from(step % 4) * 0.02 };
            let towards: f64 = draw.random_range(-1.2..1.8);
            body.position.vector += Vector3::new(towards.cos(), towards.sin(), 0.0) * way_m;
            if body.position.vector.norm() > 140.0 {
                body.position.vector = -body.position.vector;
            }
            let at = body.position.vector.xy();
            let mut nearest: Vec<(f64, usize)> = (0..all.len())
                .map(|i| (apart(&all[i], at), i))
                .filter(|(square, _)| *square < HORIZON_M * HORIZON_M)
                .collect();
            nearest.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let expected: Vec<u32> =
                nearest.iter().take(MAX_OBSTACLES).map(|(_, i)| *i as u32).collect();
            let seen: Vec<u32> =
                surroundings.seen(&body, None).iter().map(|obstacle| obstacle.id).collect();
            few += usize::from(seen.len() < MAX_OBSTACLES);
            assert_eq!(seen, expected, "step {step} at {at}");
        }
        assert!(few > 100, "the way leaves the forest: {few}");
    }
}
