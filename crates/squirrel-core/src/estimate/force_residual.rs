//! Force along body z that nobody commanded: what the inertial unit feels beside the thrust that
//! the mixer promised and, with wings spread, beside the flat plate (incremental inversion: Smeur,
//! Chu and de Croon, JGCD 39(3), 2016; docs/equations.md E.6).
//!
//! ```text
//! all       f_0  = R (m f + T)                                    mean over 0.1 s
//! folded    s    = f_0,z / cos(tilt)                              mean over 0.3 s
//!           r_z  = m f_z + T                                      mean over 0.3 s
//! spread    w_z  = (m f_z + T - r_z) / d - N_z                    mean over 0.05 s
//! ```
//! `d` is how far they are spread. `s` is thrust that is short (sag, inflow, load), where drag is
//! horizontal: along body z a tilted vehicle feels a part of its drag, which more thrust would not
//! answer but with a climb. Both rest while wings are not folded. `w_z` is what spread wings do
//! beside the plate in still air: wind, the rotors' wash, a wing that is weaker. It is kept after
//! they fold and forgotten slowly, so that wings that harmed open again no sooner than that.

use crate::aero::flat_plate;
use crate::control::position::ForceResidual;
use crate::frames::{Body, In, Ned, Rotation};
use crate::math::{all_finite, limit, limit_norm, lower, upper};

/// Time constant of what is felt with wings folded, s.
const FOLDED_MEAN_S: f32 = 0.3;
/// Time constant of all that acts, s: an outer step, so that it is news and not noise.
const BESIDE_MEAN_S: f32 = 0.1;
/// Time constant of what spread wings do, s: no longer than they may harm.
const SPREAD_MEAN_S: f32 = 0.05;
/// From the command to spread until they are, s, at an even rate.
const SPREADING_S: f32 = 0.2;
/// Deployment from which what wings do can be told.
const SPREAD_ENOUGH: f32 = 0.5;
/// From the command to fold until they are and the means can be believed, s.
const FOLDING_S: f32 = 0.4;
/// With which what spread wings do is forgotten, s.
const MEMORY_S: f32 = 10.0;
/// Weights that may be short, and that may be too much: on the ground the ground carries.
const SHORT_MAX: f32 = 0.5;
const SPARE_MAX: f32 = 0.2;
/// Cosine of the tilt from which on height says little about thrust.
const UPRIGHT_MIN: f32 = 0.5;

/// What is remembered.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Felt {
    pub(crate) residual: ForceResidual,
    /// `r_z`, N.
    pub(crate) along_n: f32,
    /// Since the wings were commanded to spread, s; 0 while they are not.
    pub(crate) spread_s: f32,
}

/// What a step brings.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step<'a> {
    /// `m f + T`, N.
    pub force: In<Body, f32>,
    pub ned_from_body: &'a Rotation<Ned, Body, f32>,
    /// Through the air, as far as that is known, m/s.
    pub velocity: In<Ned, f32>,
    /// Of the flat plate, m^2.
    pub wing_area_m2: f32,
    /// Known push of the rotors on spread wings, N.
    pub download_n: f32,
    pub weight_n: f32,
    /// Largest of the wings' commands, 0..1.
    pub wings: f32,
    /// Since they were last commanded to be anything but folded, s.
    pub spread_ago_s: f32,
    pub dt_s: f32,
}

impl Felt {
    pub(super) fn residual(&self) -> ForceResidual {
        self.residual
    }

    /// Looks at a step; thrust that is short at this instant, N.
    pub(super) fn look(&mut self, step: &Step<'_>) -> f32 {
        let Step { ned_from_body, weight_n, dt_s, .. } = *step;
        let force_n = step.force.vector.z;
        self.spread_s =
            if step.wings > 0.0 { lower(self.spread_s + dt_s, SPREADING_S) } else { 0.0 };
        let r = &mut self.residual;
        let follow = |mean_s: f32| dt_s / (dt_s + mean_s);
        let beside = (*ned_from_body * step.force).vector;
        r.beside.vector += (beside - r.beside.vector) * follow(BESIDE_MEAN_S);
        let short_n = beside.z / upper(super::down(&ned_from_body.quaternion).z, UPRIGHT_MIN);
        if step.spread_ago_s >= FOLDING_S {
            r.short_n += (short_n - r.short_n) * follow(FOLDED_MEAN_S);
            self.along_n += (force_n - self.along_n) * follow(FOLDED_MEAN_S);
        }
        let spread = step.wings * self.spread_s / SPREADING_S;
        if spread >= SPREAD_ENOUGH {
            let velocity = (ned_from_body.inverse() * step.velocity).vector;
            let down = [0.0, 0.0, 1.0];
            let plate_n = flat_plate::plate(&velocity.into(), &down, step.wing_area_m2)[2];
            let wings_n = (force_n - self.along_n) / spread - plate_n - step.download_n;
            r.wings_n += (wings_n - r.wings_n) * follow(SPREAD_MEAN_S);
        } else if step.wings <= 0.0 {
            r.wings_n -= r.wings_n * follow(MEMORY_S);
        }
        if !(self.along_n.is_finite()
            && r.short_n.is_finite()
            && r.wings_n.is_finite()
            && all_finite(&r.beside.vector))
        {
            // Before the limits, which make a number of what is none.
            (*r, self.along_n) = (ForceResidual::default(), 0.0);
        }
        for short_n in [&mut r.short_n, &mut self.along_n] {
            *short_n = limit(*short_n, -SPARE_MAX * weight_n, SHORT_MAX * weight_n);
        }
        r.wings_n = limit(r.wings_n, -weight_n, weight_n);
        r.beside.vector = limit_norm(r.beside.vector, SHORT_MAX * weight_n);
        short_n
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    const WEIGHT_N: f32 = 5.4;
    const AREA_M2: f32 = 0.04;

    /// A step at rest.
    fn step(
        force: In<Body, f32>,
        ned_from_body: &Rotation<Ned, Body, f32>,
        wings: f32,
    ) -> Step<'_> {
        Step {
            force,
            ned_from_body,
            velocity: In::zero(),
            wing_area_m2: AREA_M2,
            download_n: 0.0,
            weight_n: WEIGHT_N,
            wings,
            spread_ago_s: if wings > 0.0 { 0.0 } else { FOLDING_S },
            dt_s: 1.0 / 300.0,
        }
    }

    /// What is felt of a force on a level body, for a while.
    fn feels(felt: &mut Felt, force_n: f32, velocity: [f32; 3], wings: f32, seconds: f32) {
        let force = In::new(Vector3::new(0.2, -0.1, force_n));
        let level = Rotation::identity();
        let step = Step { velocity: In::new(velocity.into()), ..step(force, &level, wings) };
        for _ in 0..(seconds * 300.0) as u32 {
            felt.look(&step);
        }
    }

    #[test]
    fn thrust_that_is_short_is_felt_within_a_second() {
        let mut felt = Felt::default();
        feels(&mut felt, 0.8, [5.0, 0.0, 0.0], 0.0, 1.5);
        let r = felt.residual();
        assert!((r.short_n - 0.8).abs() < 0.02 && r.wings_n == 0.0, "{r:?}");
        // Wings that open do not make thrust short.
        feels(&mut felt, 2.8, [5.0, 0.0, 0.0], 1.0, 1.0);
        assert!((felt.residual().short_n - 0.8).abs() < 0.02, "{:?}", felt.residual());
    }

    /// A wash of 1.5 N on wings that nobody expects: known before the wings have been spread for a
    /// tenth of a second, kept while they are folded, forgotten in a minute.
    #[test]
    fn wings_that_are_pushed_down_are_felt_and_remembered() {
        let mut felt = Felt::default();
        feels(&mut felt, 1.5, [0.0; 3], 1.0, SPREADING_S + 0.1);
        assert!((felt.residual().wings_n - 1.5).abs() < 0.3, "{:?}", felt.residual());
        feels(&mut felt, 0.0, [0.0; 3], 0.0, 2.0);
        assert!(felt.residual().wings_n > 1.0, "{:?}", felt.residual());
        feels(&mut felt, 0.0, [0.0; 3], 0.0, 60.0);
        assert!(felt.residual().wings_n < 0.02, "{:?}", felt.residual());
    }

    /// Drag of a vehicle that leans into the wind to stay where it is: no thrust is short, and more
    /// of it would climb.
    #[test]
    fn drag_is_no_thrust_that_is_short() {
        let mut felt = Felt::default();
        let ned_from_body = Rotation::from_euler(0.0, -0.4, 0.0);
        let drag: In<Ned, f32> = In::new(Vector3::new(-2.0, 0.0, 0.0));
        let force = ned_from_body.inverse() * drag;
        assert!(force.vector.z > 0.7, "{force:?}");
        let step = step(force, &ned_from_body, 0.0);
        for _ in 0..600 {
            felt.look(&step);
        }
        let r = felt.residual();
        assert!(r.short_n.abs() < 0.01 && (r.beside.vector.x + 2.0).abs() < 0.01, "{r:?}");
    }

    /// Falling at 4 m/s on a plate: -rho A v^2, which is expected.
    #[test]
    fn the_plate_itself_is_no_residual() {
        let mut felt = Felt::default();
        let plate_n = -1.225 * AREA_M2 * 16.0;
        feels(&mut felt, plate_n, [0.0, 0.0, 4.0], 1.0, 1.0);
        assert!(felt.residual().wings_n.abs() < 0.02, "{:?}", felt.residual());
    }

    /// On the ground the ground carries: not a sign that rotors push twice as hard.
    #[test]
    fn what_is_felt_is_bounded_and_finite() {
        let mut felt = Felt::default();
        feels(&mut felt, -WEIGHT_N, [0.0; 3], 0.0, 2.0);
        let r = felt.residual();
        assert_eq!(r.short_n, -SPARE_MAX * WEIGHT_N);
        feels(&mut felt, f32::NAN, [0.0; 3], 1.0, 0.3);
        assert_eq!(felt.residual(), ForceResidual::default());
    }
}
