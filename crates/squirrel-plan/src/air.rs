//! The air that a plan is made for, estimated from how the vehicle moves.
//!
//! ```text
//! v+ = v + dt (a(v - wind, T, w) + b)     wind+ = wind exp(-dt / tau_wind)     b+ = b exp(-dt / tau_b)     measured: v
//! ```
//! An extended Kalman filter over velocity `v`, wind, and an acceleration `b` that the model has
//! not, such as of rotors that give less than they are told. Wings that push less than is believed
//! look like a tail wind, and are planned for as well by it. Wings at speed tell wind from `b`;
//! with folded wings only drag does, and what is thought of each beforehand decides. Both are drawn
//! to zero, so that what is not seen any more is forgotten. A velocity that jumps, where fixes come
//! back or something is touched, is taken over and says nothing about the air. That the flight code
//! may not fly what it is told, after a loss of all fixes, is not known here.

use crate::trajectory::{Air, Craft};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Wind beforehand: how large north, east and down, m/s, and how long it lasts, s.
const WIND: ([f64; 3], f64) = ([3.0, 3.0, 0.5], 30.0);
/// The same of the acceleration that the model has not, m/s^2 and s.
const OFFSET: ([f64; 3], f64) = ([0.3; 3], 10.0);
/// Accelerations that do not last, of gusts, and of rotors and attitude on the way, m/s^2 over a
/// root of 1 Hz.
const UNREST: f64 = 0.4;
/// Of a measured velocity, m/s.
const VELOCITY: f64 = 0.05;
/// Jump of a measured velocity, squared, in its expected errors: beyond it is no air's doing.
const JUMP: f64 = 25.0;
/// Bounds of wind, m/s, and offset, m/s^2: no estimate beyond helps a plan.
const MOST: [f64; 2] = [30.0, 5.0];
/// Where velocity, wind and offset begin in the state.
const V: usize = 0;
const W: usize = 3;
const B: usize = 6;

type Square = SMatrix<f64, 9, 9>;

/// A craft, and the air that it seems to fly in.
#[derive(Debug, Clone, PartialEq)]
pub struct AirEstimate {
    craft: Craft,
    /// Once it was measured.
    velocity: Option<Vector3<f64>>,
    covariance: Square,
}

/// Variances of wind and offset that last.
fn beforehand() -> SVector<f64, 9> {
    let [(wind, _), (offset, _)] = [WIND, OFFSET];
    SVector::from_fn(|row, _| match row {
        W..B => wind[row - W].powi(2),
        B.. => offset[row - B].powi(2),
        _ => VELOCITY.powi(2),
    })
}

impl AirEstimate {
    /// Nothing is known yet: the craft's air is what is thought beforehand.
    pub fn new(craft: Craft) -> Self {
        Self { craft, velocity: None, covariance: Square::from_diagonal(&beforehand()) }
    }

    /// The craft in the air that it seems to fly in.
    pub fn craft(&self) -> &Craft {
        &self.craft
    }

    /// Time passes.
    ///
    /// * `thrust` - `U n`, N
    /// * `spread` - deployment of the wings, 0 to 1
    pub fn predict(&mut self, thrust: &Vector3<f64>, spread: f64, dt_s: f64) {
        let Some(velocity) = &mut self.velocity else { return };
        let by_velocity = self.craft.slopes(velocity, thrust, spread).by_velocity * dt_s;
        *velocity += self.craft.acceleration(velocity, thrust, spread) * dt_s;
        let [wind_kept, offset_kept] = [WIND.1, OFFSET.1].map(|time_s| (-dt_s / time_s).exp());
        self.craft.air.wind *= wind_kept;
        self.craft.air.offset *= offset_kept;
        let identity = Matrix3::identity();
        let mut step = Square::zeros();
        for (row, column, block) in [
            (V, V, identity + by_velocity),
            (V, W, -by_velocity),
            (V, B, identity * dt_s),
            (W, W, identity * wind_kept),
            (B, B, identity * offset_kept),
        ] {
            step.fixed_view_mut::<3, 3>(row, column).copy_from(&block);
        }
        let lasting = beforehand();
        let noise = SVector::<f64, 9>::from_fn(|row, _| match row {
            W..B => lasting[row] * (1.0 - wind_kept * wind_kept),
            B.. => lasting[row] * (1.0 - offset_kept * offset_kept),
            _ => UNREST * UNREST * dt_s,
        });
        self.covariance = step * self.covariance * step.transpose() + Square::from_diagonal(&noise);
    }

    /// A velocity was measured, NED, m/s.
    pub fn measure(&mut self, measured: &Vector3<f64>) {
        let Some(velocity) = &mut self.velocity else {
            self.velocity = Some(*measured);
            return;
        };
        let seen: SMatrix<f64, 9, 3> = self.covariance.fixed_columns::<3>(V).into();
        let spread =
            self.covariance.fixed_view::<3, 3>(V, V) + Matrix3::identity() * VELOCITY.powi(2);
        let error = measured - *velocity;
        let Some(inverse) = spread.try_inverse() else { return };
        let jump = error.dot(&(inverse * error));
        if !jump.is_finite() {
            *self = Self {
                velocity: Some(*measured),
                ..Self::new(Craft { air: Air::calm(), ..self.craft.clone() })
            };
            return;
        }
        if jump > JUMP {
            *velocity = *measured;
            self.covariance.fixed_rows_mut::<3>(V).fill(0.0);
            self.covariance.fixed_columns_mut::<3>(V).fill(0.0);
            self.covariance.fixed_view_mut::<3, 3>(V, V).fill_diagonal(VELOCITY.powi(2));
            return;
        }
        let gain = seen * inverse;
        let change = gain * error;
        *velocity += change.fixed_rows::<3>(V);
        let air = &mut self.craft.air;
        air.wind = (air.wind + change.fixed_rows::<3>(W)).cap_magnitude(MOST[0]);
        air.offset = (air.offset + change.fixed_rows::<3>(B)).cap_magnitude(MOST[1]);
        let less = self.covariance - gain * seen.transpose();
        self.covariance = (less + less.transpose()) * 0.5;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trajectory::RESERVE;
    use crate::wing::WingModel;
    use squirrel_sim::vehicle_file::VehicleFile;

    /// The shipped squirrel as a plan knows it.
    fn squirrel() -> Craft {
        let vehicle = VehicleFile::squirrel();
        Craft::of(&vehicle, 1.5 * vehicle.vehicle.weight_n(), Some(WingModel::Flat), RESERVE)
            .unwrap()
    }

    fn believed(air: Air, opens: bool) -> Air {
        flown(&Craft { air, ..squirrel() }, opens, 0.0)
    }

    /// What is believed after twenty seconds of weaving and changes of speed, the wings open for a
    /// second of every three if at all.
    ///
    /// * `noise_m_s` - of each measured velocity, to one side and the other
    fn flown(real: &Craft, opens: bool, noise_m_s: f64) -> Air {
        let mut estimate = AirEstimate::new(squirrel());
        let mut velocity = Vector3::new(6.0, 0.0, 0.0);
        for step in 0..1000 {
            let time_s = f64::from(step) * 0.02;
            let sides = Vector3::new(1.0, if step % 2 == 0 { 1.0 } else { -1.0 }, -1.0);
            estimate.measure(
                &(velocity + sides * if step % 3 == 0 { noise_m_s } else { -0.5 * noise_m_s }),
            );
            // What keeps height, and about the speed.
            let still = real.acceleration(&velocity, &real.hover(), 0.0);
            let wanted = Vector3::new(
                6.0 - velocity.x + 3.0 * (1.3 * time_s).sin(),
                4.0 * (2.0 * time_s).sin(),
                -velocity.z,
            ) - still;
            let thrust = real.hover() - wanted * real.mass_kg;
            let spread = if opens && time_s % 3.0 < 1.0 { 1.0 } else { 0.0 };
            velocity += real.acceleration(&velocity, &thrust, spread) * 0.02;
            estimate.predict(&thrust, spread, 0.02);
        }
        estimate.craft().air
    }

    /// Most of a wind is found, and of a weak rotor, and neither is taken for the other.
    #[test]
    fn wings_tell_wind_from_a_weak_rotor() {
        for wind in [Vector3::new(3.0, 0.0, 0.0), Vector3::new(-2.0, 1.5, 0.0)] {
            let air = believed(Air { wind, ..Air::calm() }, true);
            assert!(
                (air.wind - wind).norm() < 0.4 * wind.norm() && air.offset.norm() < 0.1,
                "{wind} {air:?}"
            );
        }
        let offset = Vector3::new(0.0, 0.0, 0.6);
        let air = believed(Air { offset, ..Air::calm() }, true);
        assert!(
            (air.offset - offset).norm() < 0.4 * offset.norm() && air.wind.norm() < 0.6,
            "{air:?}"
        );
    }

    /// With folded wings a wind is drag and little else: what it does to the motion is found all
    /// the same.
    #[test]
    fn what_is_believed_explains_the_motion() {
        let wind = Vector3::new(4.0, -1.0, 0.0);
        let found = believed(Air { wind, ..Air::calm() }, false);
        let vehicle = VehicleFile::squirrel();
        let calm = Craft::of(&vehicle, 8.0, None, RESERVE).unwrap();
        let pushed = |air: Air| {
            let craft = Craft { air, ..calm.clone() };
            craft.acceleration(&Vector3::new(6.0, 0.5, 0.0), &craft.hover(), 0.0)
        };
        let real = pushed(Air { wind, ..Air::calm() });
        let (missed, unknown) =
            ((pushed(found) - real).norm(), (pushed(Air::calm()) - real).norm());
        assert!(missed < 0.4 * unknown, "{missed} of {unknown}, {found:?}");
    }

    /// A wing of less area than is believed brakes less: that is a tail wind's doing, too.
    #[test]
    fn a_lesser_wing_passes_for_a_tail_wind() {
        let wing = Some(crate::wing::WingForce::Flat { area_m2: 0.7 * 0.04 });
        let air = flown(&Craft { wing, ..squirrel() }, true, 0.0);
        assert!((0.2..3.0).contains(&air.wind.x) && air.wind.yz().norm() < air.wind.x, "{air:?}");
    }

    /// Neither noise nor a velocity out of all proportion is believed to be wind.
    #[test]
    fn nonsense_is_no_wind() {
        let air = flown(&squirrel(), true, 0.05);
        assert!(air.wind.norm() < 0.6 && air.offset.norm() < 0.2, "{air:?}");
        for wild in
            [Vector3::new(500.0, 0.0, 0.0), Vector3::new(-3.0, 2.0, 1.0), Vector3::repeat(1e200)]
        {
            let mut estimate = AirEstimate::new(squirrel());
            for step in 0..200 {
                let velocity = if step == 100 { wild } else { Vector3::zeros() };
                estimate.measure(&velocity);
                estimate.predict(&estimate.craft().hover(), 1.0, 0.02);
            }
            let air = estimate.craft().air;
            assert!(air.wind.norm() < 0.1 && air.offset.norm() < 0.1, "{wild}: {air:?}");
        }
    }

    #[test]
    fn calm_air_is_calm() {
        let air = believed(Air::calm(), true);
        assert!(air.wind.norm() < 1e-3 && air.offset.norm() < 1e-3, "{air:?}");
    }
}
