//! The heading of a log that has roll and velocity and no yaw, for a vehicle that held one heading
//! all along.
//!
//! ```text
//! g tan(roll) = c + a_E cos(heading) - a_N sin(heading)      a  horizontal acceleration; least squares over the flight
//! ```
//! A vehicle that rolls is pulled to its right. Of one that turned, this is the heading that fits
//! best, and nobody can tell: it does for means over seconds of a flight about one heading, and for
//! nothing quicker.

use super::series::Series;
use nalgebra::{Matrix3, Vector3};
use squirrel_core::math::GRAVITY_M_S2;

/// Blocks of the flight that are left out in turn, s: longer than a manoeuvre.
const BLOCK_S: f64 = 3.0;
/// Fewest blocks that say how sure the heading is.
const BLOCKS_MIN: usize = 4;
/// How sure it must be, rad: at twice that it still tells roll from pitch.
const SURE_RAD: f64 = 0.25;

/// A heading, rad, and its standard deviation by leaving out each block.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Held {
    pub(crate) heading_rad: f64,
    pub(crate) sd_rad: f64,
}

/// The normal equations of some rows.
#[derive(Clone, Copy)]
struct Sums {
    square: Matrix3<f64>,
    with: Vector3<f64>,
}

impl Sums {
    fn nothing() -> Self {
        Self { square: Matrix3::zeros(), with: Vector3::zeros() }
    }

    fn heading_rad(&self) -> Option<f64> {
        let c = self.square.cholesky()?.solve(&self.with);
        Some((-c.y).atan2(c.z))
    }
}

/// The heading that a vehicle held; `None` where roll and acceleration do not tell.
///
/// * `accelerations` - times, s, and NED, m/s^2, three numbers each
pub(super) fn held(roll: &Series, accelerations: &(Vec<f64>, Vec<f64>)) -> Option<Held> {
    let spans = roll.spans();
    let (time_s, values) = accelerations;
    let began_s = *time_s.first()?;
    let mut blocks: Vec<Sums> = Vec::new();
    for (t, a) in time_s.iter().zip(values.chunks_exact(3)) {
        if !spans.iter().any(|span| (span.0..=span.1).contains(t)) {
            continue;
        }
        let block = ((t - began_s) / BLOCK_S) as usize;
        blocks.resize(blocks.len().max(block + 1), Sums::nothing());
        let row = Vector3::new(1.0, a[0], a[1]);
        blocks[block].square += row * row.transpose();
        blocks[block].with += row * (GRAVITY_M_S2 * roll.number(*t).tan());
    }
    blocks.retain(|block| block.square != Matrix3::zeros());
    let count = blocks.len();
    if count < BLOCKS_MIN {
        return None;
    }
    let but = |left_out: Option<usize>| {
        let kept = blocks.iter().enumerate().filter(|(i, _)| Some(*i) != left_out);
        let sum = kept.fold(Sums::nothing(), |sum, (_, block)| Sums {
            square: sum.square + block.square,
            with: sum.with + block.with,
        });
        sum.heading_rad()
    };
    let heading_rad = but(None)?;
    let mut square = 0.0;
    for left_out in 0..count {
        let (sin, cos) = (but(Some(left_out))? - heading_rad).sin_cos();
        square += sin.atan2(cos).powi(2);
    }
    let sd_rad = (square * (count - 1) as f64 / count as f64).sqrt();
    (sd_rad < SURE_RAD).then_some(Held { heading_rad, sd_rad })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A vehicle that shuttles along north and sways, with its nose 0.4 rad to the right of it.
    #[test]
    fn the_heading_is_the_one_that_roll_and_acceleration_share() {
        let heading = 0.4_f64;
        let time_s: Vec<f64> = (0..2000).map(|k| 0.01 * f64::from(k)).collect();
        let sway = |t: f64| 0.5 * (2.1 * t).sin() + 0.2 * (5.3 * t).cos();
        let along = |t: f64| 2.0 * (1.3 * t).sin();
        let roll: Vec<f64> =
            time_s.iter().map(|t| (sway(*t) / GRAVITY_M_S2).atan() + 0.01).collect();
        let (sin, cos) = heading.sin_cos();
        let ned =
            |t: &f64| [along(*t) * cos - sway(*t) * sin, along(*t) * sin + sway(*t) * cos, 0.0];
        let accelerations = (time_s.clone(), time_s.iter().flat_map(ned).collect());
        let series = |values: Vec<f64>| Series::computed("roll", 1, (time_s.clone(), values));
        let found = series(roll).and_then(|roll| held(&roll, &accelerations));
        let found = found.unwrap_or(Held { heading_rad: f64::NAN, sd_rad: f64::NAN });
        assert!((found.heading_rad - heading).abs() < 0.01 && found.sd_rad < 0.02, "{found:?}");

        // A roll that has nothing to do with it tells nothing.
        let other: Vec<f64> = time_s.iter().map(|t| 0.05 * (0.37 * t * t).sin()).collect();
        assert!(series(other).and_then(|roll| held(&roll, &accelerations)).is_none());
    }
}
