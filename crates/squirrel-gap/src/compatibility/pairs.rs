//! Two measurements of one vector over time: do they agree axis by axis, in size and in time?
//!
//! ```text
//! own = s other      S_oo / S_xo >= s >= S_xo / S_xx     x: other, o: own; sums about the means, over a block
//! n_eff = n / (1 + 2 sum_k r_own(k) r_other(k))          Bartlett (1935)
//! ```
//! Noise of either source takes one of the two regressions below the true slope and the other above
//! it, so the slope lies between them whatever the noise is (Frisch, Statistical Confluence
//! Analysis, 1934). The medians over blocks keep a burst of bad samples out. A correlation counts
//! only where it is beyond what as many independent samples show by chance.

use nalgebra::Vector3;
use std::ops::AddAssign;

/// How much better another naming of the axes must fit, in sums of three correlations.
const MARGIN: f64 = 0.8;
/// How well it must fit at all.
const MATCH: f64 = 0.8;
/// A correlation below so many of its standard deviations is none, unless it is as large as this.
const SIGNIFICANT: f64 = 4.0;
const SURE: f64 = 0.9;
/// Blocks of a slope, at most, and pairs in each, at least.
const BLOCKS: usize = 8;
const BLOCK_MIN: usize = 40;
/// Lags that enter the effective number of samples, pairs.
const LAGS: usize = 30;

/// Pairs of what one source and another say.
#[derive(Default, Clone)]
pub(super) struct Pairs(Vec<(Vector3<f64>, Vector3<f64>)>);

/// An axis of another source and its sign, for each axis of the own one.
pub(super) type Naming = [(usize, f64); 3];

/// Sums over the first two axes of squares of own and other and of their products, about the means.
#[derive(Default, Clone, Copy)]
pub(super) struct Products {
    own: f64,
    other: f64,
    both: f64,
}

impl Products {
    /// What the first is times the second, whatever noise the first has.
    pub(super) fn slope(self) -> f64 {
        self.both / self.other
    }

    pub(super) fn correlation(self) -> f64 {
        self.both / (self.own * self.other).sqrt()
    }
}

impl AddAssign for Products {
    fn add_assign(&mut self, more: Self) {
        self.own += more.own;
        self.other += more.other;
        self.both += more.both;
    }
}

impl Pairs {
    pub(super) fn push(&mut self, own: Vector3<f64>, other: Vector3<f64>) {
        if own.iter().chain(other.iter()).all(|x| x.is_finite()) {
            self.0.push((own, other));
        }
    }

    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    /// The pairs with each vector of the second changed.
    pub(super) fn map(
        &self,
        change: impl Fn(&Vector3<f64>, &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>),
    ) -> Self {
        Self(self.0.iter().map(|(own, other)| change(own, other)).collect())
    }

    /// The first and the second of all.
    pub(super) fn split(&self) -> (Vec<Vector3<f64>>, Vec<Vector3<f64>>) {
        self.0.iter().copied().unzip()
    }

    /// The first `n` pairs.
    pub(super) fn first(&self, n: usize) -> Self {
        Self(self.0[..n.min(self.0.len())].to_vec())
    }

    /// The same with as much damping taken from each axis of the first as the second lacks.
    ///
    /// * `rates` - of the same times
    pub(super) fn with_damping(&self, rates: &[Vector3<f64>]) -> Self {
        let mut damping = Vector3::<f64>::zeros();
        for axis in 0..3 {
            let (mut lost, mut square) = (0.0, f64::MIN_POSITIVE);
            for ((own, other), rate) in self.0.iter().zip(rates) {
                lost += (other[axis] - own[axis]) * rate[axis];
                square += rate[axis] * rate[axis];
            }
            // What would drive the rates is no damping.
            damping[axis] = (lost / square).max(0.0);
        }
        let pairs = self.0.iter().zip(rates);
        Self(
            pairs.map(|((own, other), rate)| (own + damping.component_mul(rate), *other)).collect(),
        )
    }

    /// What changes from one row to the next: what is quick.
    pub(super) fn changes(&self) -> Self {
        Self(self.0.windows(2).map(|w| (w[1].0 - w[0].0, w[1].1 - w[0].1)).collect())
    }

    fn means(&self) -> (Vector3<f64>, Vector3<f64>) {
        let n = self.0.len().max(1) as f64;
        self.0
            .iter()
            .fold((Vector3::zeros(), Vector3::zeros()), |(a, b), (x, y)| (a + x / n, b + y / n))
    }

    /// Sum over all axes of the squares of the first and the second and of their products, about
    /// the means.
    fn sums(&self) -> (f64, f64, f64) {
        let (a, b) = self.means();
        self.0.iter().fold((0.0, 0.0, 0.0), |(aa, bb, ab), (x, y)| {
            let (x, y) = (x - a, y - b);
            (aa + x.norm_squared(), bb + y.norm_squared(), ab + x.dot(&y))
        })
    }

    /// Mean square of the first less the second, about the means.
    pub(super) fn misfit(&self) -> f64 {
        let (aa, bb, ab) = self.sums();
        (aa + bb - 2.0 * ab) / self.0.len().max(1) as f64
    }

    /// Autocorrelations of an axis of the first or second up to [`LAGS`].
    fn memory(&self, of_own: bool, axis: usize) -> Vec<f64> {
        let (a, b) = self.means();
        let x: Vec<f64> = self
            .0
            .iter()
            .map(|p| if of_own { p.0[axis] - a[axis] } else { p.1[axis] - b[axis] })
            .collect();
        let square: f64 = x.iter().map(|x| x * x).sum::<f64>().max(f64::MIN_POSITIVE);
        (1..=LAGS.min(x.len() / 4))
            .map(|lag| x.iter().zip(&x[lag..]).map(|(a, b)| a * b).sum::<f64>() / square)
            .collect()
    }

    /// Correlations of axis `i` of the first with axis `j` of the second; 0 for an axis that moves
    /// less than `least`.
    pub(super) fn correlations(&self, least: f64) -> [[f64; 3]; 3] {
        let (a, b) = self.means();
        let (mut aa, mut bb, mut ab) = ([0.0; 3], [0.0; 3], [[0.0; 3]; 3]);
        for (x, y) in &self.0 {
            let (x, y) = (x - a, y - b);
            for i in 0..3 {
                aa[i] += x[i] * x[i];
                bb[i] += y[i] * y[i];
                for j in 0..3 {
                    ab[i][j] += x[i] * y[j];
                }
            }
        }
        let n = self.0.len().max(1) as f64;
        let moves = |sum: f64| (sum / n).sqrt() > least;
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                if moves(aa[i]) && moves(bb[j]) { ab[i][j] / (aa[i] * bb[j]).sqrt() } else { 0.0 }
            })
        })
    }

    /// As [`Self::correlations`], 0 where one may be chance.
    pub(super) fn significant(&self, least: f64) -> [[f64; 3]; 3] {
        let r = self.correlations(least);
        let n = self.0.len().max(1) as f64;
        let [own, other] =
            [true, false].map(|of_own| [0, 1, 2].map(|axis| self.memory(of_own, axis)));
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let common: f64 = own[i].iter().zip(&other[j]).map(|(a, b)| a * b).sum();
                let chance = ((1.0 + 2.0 * common).max(1.0) / n).sqrt();
                if r[i][j].abs() > (SIGNIFICANT * chance).min(SURE) { r[i][j] } else { 0.0 }
            })
        })
    }

    /// Sum of the correlations of the axes by their names.
    pub(super) fn own_match(&self, least: f64) -> f64 {
        let r = self.correlations(least);
        r[0][0] + r[1][1] + r[2][2]
    }

    /// Axes by whose names the two go together at all.
    pub(super) fn moving(&self, least: f64) -> usize {
        let r = self.correlations(least);
        (0..3).filter(|i| r[*i][*i] != 0.0).count()
    }

    /// The axes of the first as the second would call them and how well they then fit, if that is
    /// much better than by their names.
    pub(super) fn misnamed_axes(&self, least: f64) -> Option<(f64, Naming)> {
        self.misnamed_beside(least, self.own_match(least))
    }

    /// As [`Self::misnamed_axes`] beside a fit by their names that is found elsewhere.
    pub(super) fn misnamed_beside(&self, least: f64, own: f64) -> Option<(f64, Naming)> {
        let (best, naming) = best_naming(&self.significant(least));
        (best - own > MARGIN && best > MATCH).then_some((best, naming))
    }

    /// Bounds of what the first is times the second, from all axes together, whatever noise either
    /// has.
    pub(super) fn slope(&self) -> Option<(f64, f64)> {
        let blocks = (self.0.len() / BLOCK_MIN).clamp(1, BLOCKS);
        let length = self.0.len() / blocks;
        if length < BLOCK_MIN {
            return None;
        }
        let (mut low, mut high) = (Vec::new(), Vec::new());
        for block in self.0.chunks_exact(length) {
            let (aa, bb, ab) = Self(block.to_vec()).sums();
            if !(aa > 0.0 && bb > 0.0) {
                return None;
            }
            low.push(ab / bb);
            // What does not go together bounds nothing.
            let chance = SIGNIFICANT * (aa * bb / length as f64).sqrt();
            high.push(if ab > 0.5 * chance { aa / ab } else { f64::INFINITY });
        }
        Some((median(low), median(high)))
    }

    /// Mean of the first over mean of the second along z.
    pub(super) fn mean_ratio_z(&self) -> f64 {
        let (a, b) = self.means();
        a.z / b.z
    }

    /// Of the first, so many pairs later, and the second.
    pub(super) fn products(&self, later: i64) -> Products {
        let (a, b) = self.means();
        let n = i64::try_from(self.0.len()).unwrap_or(i64::MAX);
        let mut sums = Products::default();
        for i in later.max(0)..(n + later.min(0)) {
            let (x, y) = (self.0[i as usize].0 - a, self.0[(i - later) as usize].1 - b);
            sums += Products {
                own: x.xy().norm_squared(),
                other: y.xy().norm_squared(),
                both: x.xy().dot(&y.xy()),
            };
        }
        sums
    }

    /// By how much the first is later than the second, s, and how well they then correlate; pairs
    /// are `step_s` apart.
    pub(super) fn best_shift(&self, step_s: f64, most_s: f64) -> (f64, f64) {
        let (a, b) = self.means();
        let most = (most_s / step_s) as i64;
        let n = i64::try_from(self.0.len()).unwrap_or(i64::MAX);
        let square = |v: Vector3<f64>| v.component_mul(&v);
        let own: Vector3<f64> = self.0.iter().map(|p| square(p.0 - a)).sum();
        let other: Vector3<f64> = self.0.iter().map(|p| square(p.1 - b)).sum();
        // Roll and pitch carry the timing; each counts by its own power.
        let at = |shift: i64| {
            let mut sum = Vector3::<f64>::zeros();
            for i in shift.max(0)..(n + shift.min(0)) {
                let (x, y) = (self.0[i as usize].0 - a, self.0[(i - shift) as usize].1 - b);
                sum += x.component_mul(&y);
            }
            (0..2).map(|i| sum[i] / (own[i] * other[i]).sqrt().max(f64::MIN_POSITIVE)).sum::<f64>()
                / 2.0
        };
        if n < 4 * most {
            return (0.0, 0.0);
        }
        let all: Vec<f64> = (-most..=most).map(at).collect();
        let best = (0..all.len()).max_by(|i, j| all[*i].total_cmp(&all[*j])).unwrap_or(0);
        let (before, now, after) =
            (all[best.saturating_sub(1)], all[best], all[(best + 1).min(all.len() - 1)]);
        // The top of the parabola through the three.
        let bend = before - 2.0 * now + after;
        let part = if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 };
        ((best as f64 - most as f64 + part) * step_s, now)
    }
}

/// A naming of axes in words: `(-y, x, z)`.
pub(super) fn axes(naming: Naming) -> String {
    let names = naming.map(|(axis, sign)| {
        format!("{}{}", if sign < 0.0 { "-" } else { "" }, ["x", "y", "z"][axis])
    });
    format!("({})", names.join(", "))
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values[values.len() / 2]
}

/// The naming of axes, each once and with either sign, with the largest sum of correlations.
fn best_naming(r: &[[f64; 3]; 3]) -> (f64, Naming) {
    let orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let mut best = (f64::NEG_INFINITY, [(0, 1.0), (1, 1.0), (2, 1.0)]);
    for order in orders {
        let sum: f64 = (0..3).map(|i| r[i][order[i]].abs()).sum();
        if sum > best.0 {
            best =
                (sum, [0, 1, 2].map(|i| (order[i], if r[i][order[i]] < 0.0 { -1.0 } else { 1.0 })));
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use hidden_effects::draw::Draw;

    /// A motion of size 1 along each axis seen by two sources, the first of a scale, with noise of
    /// a size on each.
    fn seen(scale: f64, own_noise: f64, other_noise: f64) -> Pairs {
        let mut draw = Draw::new(7);
        let mut pairs = Pairs::default();
        for _ in 0..2000 {
            let mut vector = |size: f64| Vector3::from(draw.normal3(size));
            let truth = vector(1.0);
            pairs.push(truth * scale + vector(own_noise * scale), truth + vector(other_noise));
        }
        pairs
    }

    /// Root mean squares alone would say 3.2 and 0.3 times.
    #[test]
    fn the_slope_lies_between_its_bounds_whatever_the_noise() {
        for (own, other) in [(3.0, 0.0), (0.0, 3.0), (1.0, 1.0)] {
            let (low, high) = seen(1.0, own, other).slope().unwrap();
            // Blocks of 250 pairs are off by a tenth themselves.
            assert!(low < 1.2 && high > 0.8, "{own}, {other}: {low} to {high}");
        }
        let (low, high) = seen(57.3, 0.3, 0.3).slope().unwrap();
        assert!(low > 40.0 && high < 80.0, "{low} to {high}");
        let (low, high) = seen(1.0, 100.0, 100.0).slope().unwrap();
        assert!(low.abs() < 0.1 && high > 5.0, "nothing in common bounds nothing: {low} to {high}");
    }

    #[test]
    fn axes_are_misnamed_only_where_another_name_fits_much_better() {
        let pairs = seen(1.0, 0.5, 0.5);
        assert!(pairs.misnamed_axes(0.0).is_none());
        let swapped = pairs.map(|own, other| (Vector3::new(own.y, -own.x, own.z), *other));
        let (_, naming) = swapped.misnamed_axes(0.0).unwrap();
        assert_eq!(axes(naming), "(y, -x, z)");
        assert!(seen(1.0, 100.0, 100.0).misnamed_axes(0.0).is_none(), "noise has no names");
    }
}
