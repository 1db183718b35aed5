//! Lead on the torque that the attitude law asks for: while it changes, rotors are asked for more,
//! so that they answer as rotors of a shorter lag would.
//!
//! ```text
//! D(s) = (tau s + 1) / (tau / a s + 1)
//! ```
//! `tau` is the rotors' time constant, `a` the ratio of zero to pole: 1 changes nothing, 3 leaves
//! a third of the lag. Not in the paper. The lag is what bounds the gains of the attitude loop, so a
//! loop with lead can be as much stiffer at the same margins (docs/equations.md B.5).

use crate::lane::Lane;
use crate::vehicle::Propulsion;

/// The filter of a vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lead<L> {
    /// `a - 1`.
    pub gain: L,
    /// `tau / a`, s.
    pub lag_s: L,
}

impl Lead<f32> {
    /// * `ratio` - `a`, 1 or more
    pub fn new(ratio: f32, propulsion: &Propulsion<f32>) -> Self {
        let lag_s = propulsion.time_constant_s();
        // Rotors without a lag need none; a step of no time divides by no lag.
        if lag_s > 0.0 {
            Self { gain: ratio - 1.0, lag_s: lag_s / ratio }
        } else {
            Self { gain: 0.0, lag_s: 1.0 }
        }
    }
}

impl<L: Lane> Lead<L> {
    /// The torque to ask for.
    ///
    /// * `followed` - what a rotor of the lag `tau / a` makes of what was wanted, moved on, N m
    /// * `wanted` - torque of the attitude law, N m
    /// * `dt_s` - since the last step
    #[inline(always)]
    pub fn step(&self, followed: &mut [L; 3], wanted: &[L; 3], dt_s: L) -> [L; 3] {
        let share = dt_s / (dt_s + self.lag_s);
        let mut asked = *wanted;
        for i in 0..3 {
            followed[i] = followed[i] + (wanted[i] - followed[i]) * share;
            asked[i] = wanted[i] + (wanted[i] - followed[i]) * self.gain;
        }
        asked
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP_S: f64 = 1.0 / 300.0;

    /// Largest distance of a rotor's torque, behind a lead, from that of a quicker rotor.
    fn off_a_quicker_rotor(ratio: f64, lag_s: f64) -> f64 {
        let lead = Lead { gain: ratio - 1.0, lag_s: lag_s / ratio };
        let (mut followed, mut slow, mut quick, mut off) = ([0.0; 3], 0.0, 0.0, 0.0_f64);
        for k in 0..900 {
            let wanted = (20.0 * f64::from(k) * STEP_S).sin();
            let [asked, ..] = lead.step(&mut followed, &[wanted; 3], STEP_S);
            slow += (asked - slow) * STEP_S / (STEP_S + lag_s);
            quick += (wanted - quick) * STEP_S / (STEP_S + lag_s / ratio);
            off = off.max((slow - quick).abs());
        }
        off
    }

    #[test]
    fn a_rotor_behind_it_answers_as_a_quicker_one() {
        for ratio in [1.0, 2.0, 3.0] {
            assert!(off_a_quicker_rotor(ratio, 0.05) < 0.02, "{ratio}");
        }
    }

    #[test]
    fn a_ratio_of_one_changes_no_bit() {
        let lead = Lead { gain: 0.0_f32, lag_s: 0.04 };
        let mut followed = [0.0; 3];
        for k in 0..100_u8 {
            let wanted = [0.1 * f32::from(k), -0.03, 1e-9];
            assert_eq!(lead.step(&mut followed, &wanted, 1.0 / 300.0), wanted);
        }
    }
}
