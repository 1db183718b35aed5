//! On which side to pass what stands in the way: the choice that a convex problem cannot make.
//!
//! Obstacles that leave no gap between them are passed together. Both sides of the nearest groups
//! are offered, as paths about which obstacles are linearised; who plans takes the best.

use super::task::{KeepOut, Task};
use nalgebra::Vector2;

/// Groups of which both sides are offered.
const GROUPS: usize = 2;

/// Paths that pass what the base path runs into; the base path alone where there is nothing.
pub(super) fn guesses(task: &Task, base: &[Vector2<f64>]) -> Vec<Vec<Vector2<f64>>> {
    let Some(begin) = base.first() else { return vec![Vec::new()] };
    let blocks =
        |keep: &KeepOut| base.iter().any(|place| (place - keep.centre).norm() < keep.radius_m);
    let near = |group: &Vec<KeepOut>| {
        group.iter().map(|keep| (keep.centre - begin).norm()).fold(f64::INFINITY, f64::min)
    };
    let mut blocking = groups(task.keep_out());
    blocking.retain(|group| group.iter().any(blocks));
    blocking.sort_by(|a, b| near(a).total_cmp(&near(b)));
    blocking.truncate(GROUPS);
    let mut all = vec![base.to_vec()];
    for group in &blocking {
        let both = |path: &Vec<Vector2<f64>>| [-1.0, 1.0].map(|side| past(group, side, path));
        all = all.iter().flat_map(both).collect();
    }
    all
}

/// Obstacles that touch, directly or by others, in one group each.
fn groups(keep_out: &[KeepOut]) -> Vec<Vec<KeepOut>> {
    let mut groups: Vec<Vec<KeepOut>> = Vec::new();
    for keep in keep_out {
        let touches =
            |other: &KeepOut| (other.centre - keep.centre).norm() < other.radius_m + keep.radius_m;
        let (touching, apart) =
            groups.into_iter().partition(|group: &Vec<KeepOut>| group.iter().any(touches));
        groups = apart;
        let mut joined: Vec<KeepOut> = touching.into_iter().flatten().collect();
        joined.push(*keep);
        groups.push(joined);
    }
    groups
}

/// A path, moved to one side of a group where it is beside it: -1 left, 1 right of the way.
fn past(group: &[KeepOut], side: f64, path: &[Vector2<f64>]) -> Vec<Vector2<f64>> {
    let (Some(first), Some(last)) = (path.first(), path.last()) else { return Vec::new() };
    let way = (last - first).try_normalize(1e-9).unwrap_or_else(Vector2::x);
    let across = Vector2::new(-way.y, way.x) * side;
    let move_out = |place: &Vector2<f64>| {
        let edge = |keep: &KeepOut| {
            let (along, off) =
                ((place - keep.centre).dot(&way), (place - keep.centre).dot(&across));
            let width = keep.radius_m * keep.radius_m - along * along;
            if width > 0.0 { width.sqrt() - off } else { 0.0 }
        };
        place + across * group.iter().map(edge).fold(0.0, f64::max)
    };
    path.iter().map(move_out).collect()
}

#[cfg(test)]
mod tests {
    use super::super::task::{Begin, Wanted};
    use super::*;
    use nalgebra::Vector3;

    fn task(trunks: &[[f64; 3]]) -> (Task, Vec<Vector2<f64>>) {
        let wanted: Vec<Wanted> = (0..=20)
            .map(|k| Wanted {
                position: Vector3::new(0.7 * f64::from(k), 0.0, -5.0),
                velocity: Vector3::new(7.0, 0.0, 0.0),
            })
            .collect();
        let begin = Begin {
            position: wanted[0].position,
            velocity: wanted[0].velocity,
            thrust: Vector3::new(0.0, 0.0, -5.0),
            spread: 0.0,
        };
        let base = wanted.iter().map(|node| node.position.xy()).collect();
        let keep = |[x, y, r]: &[f64; 3]| KeepOut { centre: Vector2::new(*x, *y), radius_m: *r };
        (Task::new(begin, wanted, trunks.iter().map(keep).collect(), 0.1, 9.0).unwrap(), base)
    }

    /// Every guess is outside of every obstacle that was in the way.
    #[test]
    fn guesses_pass_what_is_in_the_way() {
        for (trunks, count) in [
            (vec![[7.0, 0.3, 1.0]], 2),
            (vec![[7.0, 3.0, 1.0]], 1),
            (vec![[5.0, 0.3, 1.0], [10.0, -0.2, 1.0]], 4),
            // A wall is passed at one of its ends, not in the middle of it.
            (vec![[7.0, 0.6, 1.0], [7.2, -1.0, 1.0], [7.1, -2.5, 0.8]], 2),
        ] {
            let (task, base) = task(&trunks);
            let guesses = guesses(&task, &base);
            assert_eq!(guesses.len(), count, "{trunks:?}");
            for [x, y, r] in &trunks {
                let centre = Vector2::new(*x, *y);
                let inside = |place: &Vector2<f64>| (place - centre).norm() < r - 1e-9;
                assert!(!guesses.iter().flatten().any(inside), "{trunks:?}");
            }
        }
    }
}
