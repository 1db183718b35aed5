//! Errors of a flown hypothesis by bin and channel, and the floor that noise leaves of them.

use nalgebra::{SVector, Vector3};

/// Channels of the comparison.
pub(crate) const CHANNELS: [&str; 12] = [
    "velocity_north_m_s",
    "velocity_east_m_s",
    "velocity_down_m_s",
    "attitude_x_rad",
    "attitude_y_rad",
    "attitude_z_rad",
    "omega_body_x_rad_s",
    "omega_body_y_rad_s",
    "omega_body_z_rad_s",
    "specific_force_body_x_m_s2",
    "specific_force_body_y_m_s2",
    "specific_force_body_z_m_s2",
];

/// Bins of a segment, and how many of them count for the gap.
pub(crate) const BINS: usize = 20;
pub(super) const COUNTED: usize = 10;

/// One number a channel.
pub(crate) type Errors = SVector<f64, 12>;

/// Standard deviations of the scatter of a flight's noise that still are noise, and the least part
/// of the mean that a lucky flight has.
const SCATTER: f64 = 2.0;
const LUCK: f64 = 0.5;

/// Mean squared errors by bin.
#[derive(Debug, Clone)]
pub(crate) struct Errors12 {
    pub(crate) squared: [Errors; BINS],
    pub(crate) count: [f64; BINS],
}

impl Errors12 {
    pub(super) fn new() -> Self {
        Self { squared: [Errors::zeros(); BINS], count: [0.0; BINS] }
    }
    /// Adds one comparison, if it is one: a plant that has run away has none.
    pub(super) fn add(&mut self, bin: usize, parts: [Vector3<f64>; 4]) {
        if parts.iter().flatten().all(|x| x.is_finite()) {
            self.squared[bin] += squares(&parts);
            self.count[bin] += 1.0;
        }
    }
    /// Root mean square error of a channel at a horizon.
    pub(crate) fn rms(&self, channel: usize, bin: usize) -> f64 {
        (self.squared[bin][channel] / self.count[bin].max(1.0)).sqrt()
    }
    /// Mean squared error by channel over the first second.
    pub(crate) fn mse(&self) -> Errors {
        let n: f64 = self.count[..COUNTED].iter().sum();
        self.squared[..COUNTED].iter().sum::<Errors>() / n.max(1.0)
    }
    /// Mean over channels of the error over a floor; 1 is nothing but noise, and less is no better.
    pub(crate) fn over(&self, floor: &Errors) -> f64 {
        let own = self.mse();
        let ratios: Vec<f64> =
            own.iter().zip(floor.iter()).filter(|(_, f)| **f > 0.0).map(|(m, f)| m / f).collect();
        (ratios.iter().sum::<f64>() / ratios.len().max(1) as f64).max(1.0)
    }
}

/// What noise leaves: errors of the mean flight, and by how much those of one flight scatter.
#[derive(Debug, Clone)]
pub(crate) struct Floor {
    pub(crate) mean: Errors12,
    /// Standard deviation of [`Errors12::mse`].
    pub(super) deviation: Errors,
}

impl Floor {
    /// The floor of these very flights, by channel: a flight is lucky or not, and what a model
    /// leaves inside the scatter of noise is noise.
    pub(crate) fn of(&self, model: &Errors12) -> Errors {
        let reach = self.deviation * SCATTER;
        let mean = self.mean.mse();
        let lucky = mean * LUCK;
        model
            .mse()
            .zip_zip_map(&mean, &reach, |own, mean, reach| {
                own.clamp((mean - reach).max(0.0), mean + reach)
            })
            .sup(&lucky)
    }
}

/// Squares of the parts of a comparison, channel by channel.
pub(super) fn squares(parts: &[Vector3<f64>; 4]) -> Errors {
    let error = Errors::from_iterator(parts.iter().flat_map(|part| part.iter().copied()));
    error.component_mul(&error)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flight(square: f64) -> Errors12 {
        let mut errors = Errors12::new();
        errors.squared[..COUNTED].fill(Errors::repeat(4.0 * square));
        errors.count[..COUNTED].fill(4.0);
        errors
    }

    #[test]
    fn a_lucky_or_unlucky_flight_is_at_the_floor_and_a_wrong_model_is_not() {
        let floor = Floor { mean: flight(1.0), deviation: Errors::repeat(0.1) };
        for inside in [0.85, 1.0, 1.15] {
            assert!((flight(inside).over(&floor.of(&flight(inside))) - 1.0).abs() < 1e-12);
        }
        let wrong = flight(3.0);
        assert!((wrong.over(&floor.of(&wrong)) - 3.0 / 1.2).abs() < 1e-12);
        // Another model is held against the floor of the best one, and nothing is below it.
        assert!((wrong.over(&floor.of(&flight(0.9))) - 3.0 / 0.9).abs() < 1e-12);
        assert_eq!(flight(0.1).over(&floor.of(&flight(1.0))), 1.0);
    }
}
