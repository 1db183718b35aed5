//! From the two outputs of the paper's network to a force on the wing.
//!
//! The network says by how much the wing's angle of attack seems larger than it is (`alpha_w`) and
//! how much stronger the flow acts (`gamma`). The paper turns the normal `n` by `alpha_w` towards
//! the motion, `n_f = cos(alpha_w) n + sin(alpha_w) e_t`, and takes the flat plate's force along
//! it: `f = -rho A |v|^2 sin(alpha_est) gamma n_f`,
//! `alpha_est = clip(alpha + alpha_w, -90..90 deg)`. Differs from print (docs/equations.md T4, T5):
//! the force opposes the motion; where `alpha_est` is clipped the normal is turned by what is left
//! of `alpha_w`, so that it stays a unit vector; `e_t` fades where there is no flow along the wing.
//!
//! `sin(alpha)` and `cos(alpha)` are ratios of velocities, so neither an arc sine nor the printed
//! inverse of a matrix is needed: clipped means `cos(alpha + alpha_w) < 0`, and then `n_f` lies
//! along the motion. Where `alpha_w = 0` and `gamma = 1` what remains is, bit for bit,
//! [`flat_plate::force`].

use crate::aero::flat_plate;
use crate::frames::{Body, In};
use crate::math::{Real, real, upper};
use nalgebra::Vector3;

/// Below this speed, m/s, the direction of the flow means nothing and the wing has no force.
pub const SPEED_LOWEST_M_S: f64 = 0.3;
/// Beyond this speed, m/s, a number is not a velocity, and its square may not be a number.
const SPEED_HIGHEST_M_S: f64 = 1e6;
/// Below this speed along the wing, m/s, its direction fades.
pub const IN_PLANE_LOWEST_M_S: f64 = 0.05;

/// Motion through the air as the wing sees it: along its normal, and along itself. All zero outside
/// of 0.3 m/s to 1e6 m/s and for what is not a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flow<T> {
    /// `|v|`, m/s.
    pub speed: T,
    /// Along the normal, body z, m/s.
    pub normal: T,
    /// Along the wing, m/s, not negative.
    pub in_plane: T,
    /// Body x and y components of `e_t`, the direction of motion along the wing: a unit vector
    /// where `in_plane` is at least 0.05 m/s, shorter below.
    pub direction: [T; 2],
}

impl<T: Real> Flow<T> {
    /// Of a velocity relative to the air, m/s.
    pub fn new(velocity: In<Body, T>) -> Self {
        let (v, zero) = (velocity.vector, real(0.0));
        let speed = v.norm();
        if !(speed >= real(SPEED_LOWEST_M_S) && speed <= real(SPEED_HIGHEST_M_S)) {
            return Self { speed: zero, normal: zero, in_plane: zero, direction: [zero; 2] };
        }
        let in_plane = (v.x * v.x + v.y * v.y).sqrt();
        let scale = upper(in_plane, real(IN_PLANE_LOWEST_M_S));
        Self { speed, normal: v.z, in_plane, direction: [v.x / scale, v.y / scale] }
    }

    /// `-rho A |v|`, N s/m: times a speed through the plate it is the force of the flat plate.
    ///
    /// * `area_m2` - plate area
    #[inline(always)]
    pub fn impedance(&self, area_m2: T) -> T {
        flat_plate::impedance(area_m2, self.speed)
    }

    /// The body vector with these components along `e_t` and along the normal.
    #[inline(always)]
    pub fn body(&self, along_wing: T, along_normal: T) -> In<Body, T> {
        let [x, y] = self.direction;
        In::new(Vector3::new(along_wing * x, along_wing * y, along_normal))
    }
}

/// What the network has to say about a flow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Correction<T> {
    /// By how much the angle of attack seems larger, rad, within (-pi/2, pi/2).
    pub alpha_w_rad: T,
    /// How much stronger the flow acts than on a flat plate, positive.
    pub gamma: T,
}

impl<T: Real> Correction<T> {
    /// `alpha_w = pi/2 tanh(y0)`, `gamma = softplus(y1)`, so that both stay in their range whatever
    /// the network says.
    pub fn from_outputs([y0, y1]: [T; 2]) -> Self {
        let softplus = upper(y1, real(0.0)) + (-y1.abs()).exp().ln_1p();
        Self { alpha_w_rad: T::frac_pi_2() * y0.activation(), gamma: softplus }
    }
}

/// The wing's normal turned by `alpha_w`, but not beyond the motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurnedNormal<T> {
    /// `|v| sin(alpha_est)`, m/s.
    pub sine_m_s: T,
    /// `|v| cos(alpha_est)`, m/s; 0 where clipped.
    pub cosine_m_s: T,
    /// Components of `n_f` along `e_t` and along the normal.
    pub direction: [T; 2],
    /// `alpha + alpha_w` is beyond 90 deg, so that `alpha_w` no longer matters.
    pub clipped: bool,
}

impl<T: Real> TurnedNormal<T> {
    /// Turns the normal in this flow.
    pub fn new(flow: &Flow<T>, alpha_w_rad: T) -> Self {
        let (sin, cos) = alpha_w_rad.sin_cos();
        let sine = flow.normal * cos + flow.in_plane * sin;
        let cosine = flow.in_plane * cos - flow.normal * sin;
        if cosine < real(0.0) {
            let towards = if sine < real(0.0) { -flow.speed } else { flow.speed };
            Self {
                sine_m_s: towards,
                cosine_m_s: real(0.0),
                direction: [flow.in_plane / towards, flow.normal / towards],
                clipped: true,
            }
        } else {
            Self { sine_m_s: sine, cosine_m_s: cosine, direction: [sin, cos], clipped: false }
        }
    }

    /// `alpha_est`, rad, in [-pi/2, pi/2].
    pub fn alpha_est_rad(&self) -> T {
        self.sine_m_s.atan2(self.cosine_m_s)
    }

    /// `n_f`; a unit vector where the speed along the wing is at least 0.05 m/s, never longer.
    pub fn body(&self, flow: &Flow<T>) -> In<Body, T> {
        flow.body(self.direction[0], self.direction[1])
    }
}

/// Force of the air on the wing, N, by the corrected flat plate.
///
/// * `area_m2` - plate area
pub fn force<T: Real>(flow: &Flow<T>, correction: Correction<T>, area_m2: T) -> In<Body, T> {
    let turned = TurnedNormal::new(flow, correction.alpha_w_rad);
    let size = flow.impedance(area_m2) * turned.sine_m_s * correction.gamma;
    flow.body(size * turned.direction[0], size * turned.direction[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::{FRAC_PI_2, PI};

    const AREA_M2: f64 = 0.04;

    /// Motions in all directions, also along the axes, from far below to far above what flies.
    fn velocities() -> impl Iterator<Item = In<Body, f64>> {
        let speeds = [0.0, 1e-30, 1e-3, 0.299, 0.31, 1.0, 7.0, 30.0, 1e5];
        speeds.into_iter().flat_map(|speed| {
            (-12..=12).flat_map(move |elevation| {
                (0..7).map(move |heading| {
                    let (elevation, heading) =
                        (f64::from(elevation) * PI / 24.0, f64::from(heading));
                    let along = elevation.cos() * speed;
                    In::new(Vector3::new(
                        along * heading.cos(),
                        along * heading.sin(),
                        elevation.sin() * speed,
                    ))
                })
            })
        })
    }

    fn corrections() -> impl Iterator<Item = f64> {
        (-16..=16).map(|k| f64::from(k) / 16.0 * FRAC_PI_2)
    }

    #[test]
    fn without_correction_it_is_the_flat_plate_bit_for_bit() {
        let mut compared = 0;
        for velocity in velocities().filter(|v| v.vector.norm() >= SPEED_LOWEST_M_S) {
            let plate = flat_plate::force(velocity, In::new(Vector3::z()), AREA_M2);
            let none = Correction { alpha_w_rad: 0.0, gamma: 1.0 };
            assert_eq!(force(&Flow::new(velocity), none, AREA_M2), plate, "{velocity:?}");
            let single = In::<Body, f32>::new(velocity.vector.map(|x| x as f32));
            let plate = flat_plate::force(single, In::new(Vector3::z()), AREA_M2 as f32);
            let none = Correction { alpha_w_rad: 0.0, gamma: 1.0 };
            assert_eq!(force(&Flow::new(single), none, AREA_M2 as f32), plate, "{single:?}");
            compared += 1;
        }
        assert!(compared > 700, "{compared}");
    }

    #[test]
    fn the_turned_normal_keeps_its_length_clipped_or_not() {
        let (mut clipped, mut free) = (0, 0);
        for velocity in velocities() {
            let flow = Flow::new(velocity);
            for alpha_w_rad in corrections() {
                let turned = TurnedNormal::new(&flow, alpha_w_rad);
                let length = turned.body(&flow).vector.norm();
                assert!(length <= 1.0 + 1e-14, "{length} for {velocity:?}, {alpha_w_rad}");
                if flow.in_plane >= IN_PLANE_LOWEST_M_S {
                    assert!(
                        (length - 1.0).abs() < 1e-14,
                        "{length} for {velocity:?}, {alpha_w_rad}"
                    );
                    if turned.clipped { clipped += 1 } else { free += 1 }
                }
            }
        }
        assert!(clipped > 1000 && free > 1000, "{clipped} {free}");
    }

    /// The printed `n_f = M^-1 b`: `n_f . v = |v| sin(alpha_est)` and `n_f . n = cos(alpha_w)`, in
    /// the plane of both.
    #[test]
    fn unclipped_it_solves_the_printed_equations() {
        for velocity in velocities().filter(|v| v.vector.xy().norm() > 0.3) {
            let flow = Flow::new(velocity);
            let alpha = (velocity.vector.z / velocity.vector.norm()).asin();
            for alpha_w_rad in corrections().filter(|w| (alpha + w).abs() < FRAC_PI_2 - 1e-9) {
                let turned = TurnedNormal::new(&flow, alpha_w_rad);
                let (n_f, v) = (turned.body(&flow).vector, velocity.vector);
                let speed = v.norm();
                assert!((n_f.dot(&v) - speed * (alpha + alpha_w_rad).sin()).abs() < 1e-13 * speed);
                assert!((n_f.z - alpha_w_rad.cos()).abs() < 1e-14);
                assert!(n_f.dot(&v.cross(&Vector3::z())).abs() < 1e-13 * speed);
                assert!((turned.alpha_est_rad() - (alpha + alpha_w_rad)).abs() < 1e-9);
            }
        }
    }

    /// T4: with the printed sign the wing would push the vehicle along.
    #[test]
    fn the_force_never_does_work_on_the_vehicle() {
        for velocity in velocities() {
            let flow = Flow::new(velocity);
            for alpha_w_rad in corrections() {
                let f = force(&flow, Correction { alpha_w_rad, gamma: 1.7 }, AREA_M2).vector;
                // Close to 90 deg of in-plane motion the product is a rounding of zero.
                let rounding = 1e-12 * f.norm() * velocity.vector.norm();
                assert!(f.dot(&velocity.vector) <= rounding, "{velocity:?}, {alpha_w_rad}");
            }
        }
    }

    #[test]
    fn nothing_makes_nan() {
        let numbers = [0.0, -0.0, 1e-38, 0.2, 3.0, 1e19, f32::MAX, f32::INFINITY, f32::NAN];
        for x in numbers {
            for z in numbers {
                let flow = Flow::new(In::new(Vector3::new(x, -x, z)));
                for y in [f32::NEG_INFINITY, -200.0, -1.0, 0.0, 1.0, 200.0] {
                    let f = force(&flow, Correction::from_outputs([y, y]), 0.04).vector;
                    assert!(f.iter().all(|f| f.is_finite()), "{x} {z} {y}: {f:?}");
                }
            }
        }
    }

    #[test]
    fn outputs_stay_in_range() {
        for y in [-300.0, -2.0, 0.0, 0.54, 2.0, 300.0] {
            let c = Correction::<f64>::from_outputs([y, y]);
            assert!(c.alpha_w_rad.abs() <= FRAC_PI_2 && c.gamma > 0.0, "{c:?}");
        }
        // ln(e - 1) is where softplus is 1.
        let one = Correction::<f64>::from_outputs([0.0, (1f64.exp() - 1.0).ln()]);
        assert!(one.alpha_w_rad == 0.0 && (one.gamma - 1.0).abs() < 1e-15);
    }
}
