//! The support function for any wing whose force lies in the plane of motion and normal
//! (docs/equations.md F.4).
//!
//! At one angle of attack the normals form a circle around the motion,
//! `n = sin(alpha) v + cos(alpha) m`, and thrust and wings push by
//! `(F_v - U sin(alpha)) d.v + (F_m - U cos(alpha)) d.m`: linear in `m`, so the best point of the
//! circle is its nearest or farthest one, or one on the edge of the tilt set. What is left is a
//! search in one angle. [`Search::largest`] samples and refines; [`Search::bound`] proves: over a
//! band of angles each term has a largest value, and branch and bound narrows the bands.

use super::flat::Largest;
use super::polar::Polar;
use super::tilt::{Circle, Region, across};
use nalgebra::Vector3;

/// Angles that a search begins with.
const SAMPLES: usize = 96;
/// Peaks that are refined.
const PEAKS: usize = 3;
/// Bands that a proof begins with.
const BANDS: usize = 32;
/// Bands after which a proof ends with the bound that it has.
const BANDS_MAX: usize = 20_000;

/// What is to be largest: the part of thrust and wings along a direction.
#[derive(Debug, Clone, Copy)]
pub(super) struct Search<'a> {
    pub(super) region: &'a Region,
    pub(super) polar: &'a Polar,
    pub(super) thrust_n: f64,
    /// Unit vector of the motion.
    pub(super) motion: Vector3<f64>,
    pub(super) d: Vector3<f64>,
}

impl Search<'_> {
    /// Part of `d` across the motion: its direction and length.
    fn aside(&self) -> (Vector3<f64>, f64) {
        let aside = self.d - self.motion * self.motion.dot(&self.d);
        let length = aside.norm();
        (aside.try_normalize(1e-12 * self.d.norm()).unwrap_or_else(|| across(self.motion)), length)
    }

    /// Largest value at an angle of attack, and the normal; nothing where no attitude has it.
    fn at(&self, alpha_rad: f64) -> Option<(f64, Vector3<f64>)> {
        let (s, c) = alpha_rad.sin_cos();
        let (towards, length) = self.aside();
        let circle = Circle::around(self.motion, s, towards);
        let [along, cross] = self.polar.force(alpha_rad);
        let [along, cross] = [along - self.thrust_n * s, (cross - self.thrust_n * c) * length];
        // The nearest point of the circle where it is pulled, the farthest where it is pushed.
        let own = circle.centre + circle.u.scale(if cross >= 0.0 { 1.0 } else { -1.0 });
        let value = |n: Vector3<f64>| {
            let cosine = if c > 1e-9 { (n.dot(&towards) / c).clamp(-1.0, 1.0) } else { 0.0 };
            along * self.motion.dot(&self.d) + cross * cosine
        };
        if self.region.contains(own) {
            return Some((value(own), own));
        }
        let edges = self.region.faces.iter().filter_map(|face| circle.crossings(face)).flatten();
        let inside = edges.map(|t| circle.at(t)).filter(|n| self.region.contains(*n));
        inside.map(|n| (value(n), n)).max_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Angles of attack that the tilt set has.
    fn angles(&self) -> Option<[f64; 2]> {
        let [low, high] = [-1.0, 1.0].map(|sign: f64| self.region.furthest(self.motion * sign));
        Some([low?, high?].map(|n| n.dot(&self.motion).clamp(-1.0, 1.0).asin()))
    }

    /// The largest value that a search finds, N; its bound is not known.
    pub(super) fn largest(&self) -> Option<Largest> {
        let [from, to] = self.angles()?;
        let step = (to - from) / (SAMPLES - 1) as f64;
        let angle = |i: usize| from + step * i as f64;
        let value = |alpha: f64| self.at(alpha).map_or(f64::NEG_INFINITY, |(value, _)| value);
        let samples: Vec<f64> = (0..SAMPLES).map(|i| value(angle(i))).collect();
        let is_peak = |i: &usize| {
            let beside =
                |j: Option<usize>| j.and_then(|j| samples.get(j)).is_none_or(|x| *x <= samples[*i]);
            beside(i.checked_sub(1)) && beside(Some(i + 1))
        };
        let mut peaks: Vec<usize> = (0..SAMPLES).filter(is_peak).collect();
        peaks.sort_by(|a, b| samples[*b].total_cmp(&samples[*a]));
        let refined = peaks.into_iter().take(PEAKS).map(|i| {
            let around = [angle(i.saturating_sub(1)), angle((i + 1).min(SAMPLES - 1))];
            let fine = golden(&value, around);
            if value(fine) > samples[i] { fine } else { angle(i) }
        });
        let found = refined.filter_map(|alpha| self.at(alpha)).max_by(|a, b| a.0.total_cmp(&b.0));
        found.map(|(value, normal)| Largest { value, upper: f64::INFINITY, normal })
    }

    /// [`Self::largest`] with a bound that is no further above it than `gap_n`, N.
    pub(super) fn bound(&self, gap_n: f64) -> Option<Largest> {
        let mut found = self.largest()?;
        let [from, to] = self.angles()?;
        let width = (to - from) / BANDS as f64;
        let mut open: Vec<[f64; 2]> =
            (0..BANDS).map(|i| [i, i + 1].map(|i| from + width * i as f64)).collect();
        let mut upper = found.value;
        let mut seen = 0;
        while let Some(band) = open.pop() {
            let Some(above) = self.above(band) else { continue };
            seen += 1;
            let middle = 0.5 * (band[0] + band[1]);
            if let Some((value, normal)) = self.at(middle)
                && value > found.value
            {
                found = Largest { value, normal, ..found };
            }
            if above <= found.value + gap_n || seen > BANDS_MAX {
                upper = upper.max(above);
            } else {
                open.extend([[band[0], middle], [middle, band[1]]]);
            }
        }
        Some(Largest { upper: upper.max(found.value), ..found })
    }

    /// What no value in a band of angles exceeds; nothing where no attitude is in it.
    fn above(&self, band: [f64; 2]) -> Option<f64> {
        let sines = band.map(f64::sin);
        let part = self.region.band(self.motion, sines);
        let thrust = -self.thrust_n * part.furthest(-self.d)?.dot(&self.d);
        let (towards, length) = self.aside();
        let [low, high] =
            [part.furthest(-towards)?, part.furthest(towards)?].map(|n| n.dot(&towards));
        let cosines = band.map(f64::cos);
        let least = cosines[0].min(cosines[1]);
        let most = if band[0] <= 0.0 && band[1] >= 0.0 { 1.0 } else { cosines[0].max(cosines[1]) };
        // The cosine between `m` and `towards`, from that between `n` and `towards`.
        let low = (if low < 0.0 { low / least.max(1e-12) } else { low / most }).max(-1.0);
        let high = (if high > 0.0 { high / least.max(1e-12) } else { high / most }).min(1.0);
        let [along, cross] = self.polar.range(band);
        let forward = self.motion.dot(&self.d);
        let largest = |along: [f64; 2], cross: [f64; 2]| {
            let corners =
                cross.iter().flat_map(|f| [f * low, f * high]).fold(f64::NEG_INFINITY, f64::max);
            (along[0] * forward).max(along[1] * forward) + length * corners
        };
        // Thrust by itself is the better bound of a wide band; with the wings, of a narrow one,
        // where both want the same `m`.
        let apart = thrust + largest(along, cross);
        let with_thrust = |[low, high]: [f64; 2], [least, most]: [f64; 2]| {
            [low - self.thrust_n * most, high - self.thrust_n * least]
        };
        let together = largest(with_thrust(along, sines), with_thrust(cross, [least, most]));
        Some(apart.min(together))
    }
}

/// Where a function with one peak is largest, by golden section.
pub(super) fn golden(value: &impl Fn(f64) -> f64, [mut from, mut to]: [f64; 2]) -> f64 {
    let share = 0.5 * (5.0_f64.sqrt() - 1.0);
    let [mut a, mut b] = [to - share * (to - from), from + share * (to - from)];
    let [mut at_a, mut at_b] = [value(a), value(b)];
    for _ in 0..36 {
        if at_a > at_b {
            [to, b, at_b] = [b, a, at_a];
            a = to - share * (to - from);
            at_a = value(a);
        } else {
            [from, a, at_a] = [a, b, at_b];
            b = from + share * (to - from);
            at_b = value(b);
        }
    }
    0.5 * (from + to)
}
