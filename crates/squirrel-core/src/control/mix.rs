//! The mixer's rule on lanes: what each rotor gives for a thrust and a torque, within its limits.
//!
//! Priority is roll and pitch over thrust over yaw, exactly; [`mixer`](super::mixer) derives it.
//! Along `T^+` the rotor thrusts are `f_i = s a_i + u b_i + y c_i`, with `b_i > 0`; the code works
//! with `f_i / b_i`. A weighted sum of them lies between what the negative weights take at the
//! thrust limit and what the positive ones give. Weights that take `u` and `y` out of the sum bound
//! `s`, and weights that take `y` out bound `u`. The shortest such sums are enough, because all
//! others are sums of these with positive factors: for `s` three rotors, or two with the same
//! `c_i / b_i`; for `u` two, or one without yaw. No iteration; for four rotors at most six sums
//! each.
//!
//! Elements of a register select; work that none of them needs is left out, which changes no
//! element.

use crate::lane::Lane;
use crate::lane::functions::{limit, size};
use crate::math::{Real, real};
use crate::numbers;

/// Slopes below this count as zero; all slopes are of order one by scaling.
pub(super) const FLAT: f32 = 1e-4;
/// What rounding may leave of an interval that holds one number, N.
const SLACK: f64 = 1e-5;
/// Below this, nothing bounds an interval.
const NOWHERE: f64 = -3e38;

numbers! {
    /// The numbers of one layout.
    Table<ROTORS> {
        /// 1, or 0 for a place without a rotor; there all other numbers are 0.
        is_there [ROTORS],
        /// Columns of `T^+`: thrust per newton of collective, per newton metre of roll, pitch, and
        /// of scaled yaw.
        collective [ROTORS],
        /// See `collective`.
        roll [ROTORS],
        /// See `collective`.
        pitch [ROTORS],
        /// See `collective`.
        yaw [ROTORS],
        /// Scaled yaw over the rotor's part of the collective.
        yaw_share [ROTORS],
        /// Thrust limit over the rotor's part of the collective, N.
        full_share_n [ROTORS],
        /// Limit of each rotor, N.
        thrust_max_n,
        /// Newton metres of yaw torque per unit of the scaled yaw variable; 0 for a layout without
        /// yaw.
        yaw_unit_n_m,
        /// 1 where three rotors differ in `yaw_share`: not where all turn one way or the other with
        /// equal strength.
        three_kinds,
    }
}

impl<const PLACES: usize> Table<f32, PLACES> {
    /// The first rotors alone, in another scalar.
    pub fn first<S: Real, const ROTORS: usize>(&self) -> Table<S, ROTORS> {
        const { assert!(ROTORS <= PLACES) };
        let single = |x: f32| real(f64::from(x));
        let first = |all: &[f32; PLACES]| core::array::from_fn(|i| single(all[i]));
        Table {
            is_there: first(&self.is_there),
            collective: first(&self.collective),
            roll: first(&self.roll),
            pitch: first(&self.pitch),
            yaw: first(&self.yaw),
            yaw_share: first(&self.yaw_share),
            full_share_n: first(&self.full_share_n),
            thrust_max_n: single(self.thrust_max_n),
            yaw_unit_n_m: single(self.yaw_unit_n_m),
            three_kinds: single(self.three_kinds),
        }
    }
}

/// What rotors give.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mixed<L, const ROTORS: usize> {
    /// Thrust of each, N, within its limits.
    pub rotor_thrust_n: [L; ROTORS],
    /// Share of the roll and pitch demand that is met, 0..1.
    pub roll_pitch_share: L,
    /// 1 where some part of the demand is not met, else 0.
    pub saturated: L,
}

/// A closed interval; empty where `low > high`.
#[derive(Clone, Copy)]
struct Interval<L> {
    low: L,
    high: L,
}

impl<L: Lane> Interval<L> {
    #[inline(always)]
    fn all() -> Self {
        Self { low: L::of(f64::NEG_INFINITY), high: L::of(f64::INFINITY) }
    }
    /// Keeps the part where `low <= slope * x <= high`, unless the slope is flat.
    #[inline(always)]
    fn keep(&mut self, slope: L, low: L, high: L) {
        let steep = steep(slope);
        if steep.any_positive() {
            let (a, b) = (low / slope, high / slope);
            self.low = steep.where_positive(self.low.upper(a.lower(b)), self.low);
            self.high = steep.where_positive(self.high.lower(a.upper(b)), self.high);
        }
    }
}

/// Above zero where a slope does not count as zero.
#[inline(always)]
fn steep<L: Lane>(slope: L) -> L {
    size(slope) - L::of(f64::from(FLAT))
}

/// `x`, or 0 where it is not finite.
#[allow(clippy::eq_op, reason = "zero for a number, NaN for what is none")]
#[inline(always)]
fn finite<L: Lane>(x: L) -> L {
    (L::of(1.0) - (x - x)).where_positive(x, L::of(0.0))
}

impl<L: Lane, const ROTORS: usize> Table<L, ROTORS> {
    /// Rotor thrusts for a demand. Total: non-finite demands count as zero.
    ///
    /// * `count` - places in front of which all rotors are
    #[inline(always)]
    pub fn mix(&self, count: usize, thrust_n: L, torque_n_m: [L; 3]) -> Mixed<L, ROTORS> {
        let (none, one, count) = (L::of(0.0), L::of(1.0), count.min(ROTORS));
        let thrust = finite(thrust_n).upper(none);
        let [roll, pitch, yaw] =
            [finite(torque_n_m[0]), finite(torque_n_m[1]), finite(torque_n_m[2])];
        let yaw = self.yaw_unit_n_m.where_positive(yaw / self.yaw_unit_n_m, none);
        let mut tilt = [none; ROTORS];
        let mut beyond = none - one;
        for i in 0..count {
            tilt[i] = self.roll[i] * roll + self.pitch[i] * pitch;
            let f = self.rotor_thrust(&tilt, i, one, thrust, yaw);
            beyond = beyond.upper(none - f).upper(f - self.thrust_max_n);
        }
        let (mut s, mut u, mut y) = (one, thrust, yaw);
        if beyond.any_positive() {
            let mut range = self.yaw_interval(count, &tilt, s, u);
            let empty = (range.low - (range.high + L::of(SLACK))).lower(beyond);
            if empty.any_positive() {
                let (share, collective) = self.share_and_thrust(count, &tilt, thrust);
                (s, u) = (empty.where_positive(share, s), empty.where_positive(collective, u));
                let again = self.yaw_interval(count, &tilt, s, u);
                range.low = empty.where_positive(again.low, range.low);
                range.high = empty.where_positive(again.high, range.high);
            }
            y = beyond.where_positive(limit(yaw, range.low, range.high), yaw);
        }
        let mut rotor_thrust_n = [none; ROTORS];
        for i in 0..count {
            rotor_thrust_n[i] =
                limit(self.rotor_thrust(&tilt, i, s, u, y), none, self.thrust_max_n);
        }
        Mixed { rotor_thrust_n, roll_pitch_share: s, saturated: beyond.where_positive(one, none) }
    }

    #[inline(always)]
    fn rotor_thrust(&self, tilt: &[L; ROTORS], i: usize, s: L, u: L, y: L) -> L {
        s * tilt[i] + u * self.collective[i] + y * self.yaw[i]
    }

    /// Yaw values that keep every rotor within its limits at a given share and thrust.
    #[inline(always)]
    fn yaw_interval(&self, count: usize, tilt: &[L; ROTORS], s: L, u: L) -> Interval<L> {
        let (none, slack) = (L::of(0.0), L::of(SLACK));
        let mut range = Interval::all();
        for i in 0..count {
            let rest = self.rotor_thrust(tilt, i, s, u, none);
            range.keep(self.yaw[i], none - rest, self.thrust_max_n - rest);
            // A rotor that yaw does not change, beyond its limits: no yaw helps.
            let out = (none - slack - rest).upper(rest - (self.thrust_max_n + slack));
            let out = steep(self.yaw[i]).where_positive(none, out);
            range.low = out.where_positive(L::of(f64::INFINITY), range.low);
            range.high = out.where_positive(L::of(f64::NEG_INFINITY), range.high);
        }
        let anywhere = L::of(NOWHERE) - range.low;
        range.high = anywhere.where_positive(none, range.high);
        range.low = anywhere.where_positive(none, range.low);
        range
    }

    /// The largest share, then the nearest thrust.
    #[inline(always)]
    fn share_and_thrust(&self, count: usize, tilt: &[L; ROTORS], thrust: L) -> (L, L) {
        let mut tilt_share = [L::of(0.0); ROTORS];
        for i in 0..count {
            tilt_share[i] =
                self.is_there[i].where_positive(tilt[i] / self.collective[i], L::of(0.0));
        }
        let share = self.largest_share(count, &tilt_share);
        let range = self.thrust_interval(count, &tilt_share, share);
        (share, limit(thrust, range.low, range.low.upper(range.high)))
    }

    /// The largest `s` in [0, 1] that some thrust and yaw allow: sums of rotors that neither of
    /// them changes limit it.
    #[inline(always)]
    fn largest_share(&self, count: usize, a: &[L; ROTORS]) -> L {
        let (c, max, there) = (&self.yaw_share, &self.full_share_n, &self.is_there);
        let none = L::of(0.0);
        let mut share = L::of(1.0);
        for i in 0..count {
            for j in i + 1..count {
                let w_k = c[i] - c[j];
                let both = there[i] * there[j];
                let alike = steep(w_k).where_positive(none, both);
                share = cut(share, (a[i] - a[j]) * alike, max[i], max[j]);
                if !self.three_kinds.any_positive() {
                    continue;
                }
                for k in j + 1..count {
                    let (w_i, w_j) = (c[j] - c[k], c[k] - c[i]);
                    // Else two of them make a shorter sum, which has its turn.
                    let differ = steep(w_i).lower(steep(w_j)).lower(steep(w_k));
                    let counts = differ.where_positive(both * there[k] * self.three_kinds, none);
                    let [above, below] = sums([w_i * max[i], w_j * max[j], w_k * max[k]]);
                    share =
                        cut(share, (w_i * a[i] + w_j * a[j] + w_k * a[k]) * counts, above, below);
                }
            }
        }
        share
    }

    /// Thrusts that some yaw allows at a given share: single rotors without yaw, and pairs whose
    /// sum yaw does not change.
    #[inline(always)]
    fn thrust_interval(&self, count: usize, a: &[L; ROTORS], s: L) -> Interval<L> {
        let (c, max, there) = (&self.yaw_share, &self.full_share_n, &self.is_there);
        let none = L::of(0.0);
        let mut range = Interval::all();
        for i in 0..count {
            let alone = steep(c[i]).where_positive(none, there[i]);
            range.keep(alone, none - s * a[i], max[i] - s * a[i]);
            for j in i + 1..count {
                let both = steep(c[i]).lower(steep(c[j])).where_positive(there[i] * there[j], none);
                let [above, below] = sums([c[j] * max[i], none - c[i] * max[j]]);
                let rest = s * (c[j] * a[i] - c[i] * a[j]);
                range.keep((c[j] - c[i]) * both, none - below - rest, above - rest);
            }
        }
        range
    }
}

/// A share that keeps `slope * share` between `-below` and `above`.
#[inline(always)]
fn cut<L: Lane>(share: L, slope: L, above: L, below: L) -> L {
    let (bound, steepness) = (slope.where_positive(above, below), size(slope));
    let binds = steepness * share - bound;
    // No division where it would not bind.
    if binds.any_positive() { binds.where_positive(bound / steepness, share) } else { share }
}

/// Sum of the positive terms, and of the negative ones without their sign.
#[inline(always)]
fn sums<L: Lane, const N: usize>(terms: [L; N]) -> [L; 2] {
    let (mut sum, mut sizes) = (L::of(0.0), L::of(0.0));
    for term in terms {
        sum = sum + term;
        sizes = sizes + size(term);
    }
    let half = L::of(0.5);
    [half * (sizes + sum), half * (sizes - sum)]
}
