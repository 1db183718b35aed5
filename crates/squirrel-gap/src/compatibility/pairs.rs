//! Two measurements of one vector over time: do they agree axis by axis, in size and in time?

use nalgebra::Vector3;

/// How much better another naming of the axes must fit, in sums of three correlations.
const MARGIN: f64 = 0.8;

/// How well it must fit at all.
const MATCH: f64 = 1.0;

/// Pairs of what one source and another say.
#[derive(Default)]
pub(super) struct Pairs(Vec<(Vector3<f64>, Vector3<f64>)>);

impl Pairs {
    pub(super) fn push(&mut self, own: Vector3<f64>, other: Vector3<f64>) {
        if own.iter().chain(other.iter()).all(|x| x.is_finite()) {
            self.0.push((own, other));
        }
    }

    /// Each first with the second of so many pairs before.
    pub(super) fn later_by(&self, shift: i64) -> Self {
        let n = i64::try_from(self.0.len()).unwrap_or(i64::MAX);
        let pairs = (shift.max(0)..(n + shift.min(0)))
            .map(|i| (self.0[i as usize].0, self.0[(i - shift) as usize].1));
        Self(pairs.collect())
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
        Self(pairs.map(|((own, other), rate)| (own + damping.component_mul(rate), *other)).collect())
    }

    fn means(&self) -> (Vector3<f64>, Vector3<f64>) {
        let n = self.0.len().max(1) as f64;
        self.0.iter().fold((Vector3::zeros(), Vector3::zeros()), |(a, b), (x, y)| (a + x / n, b + y / n))
    }

    /// Correlations of axis `i` of the first with axis `j` of the second; 0 for an axis that moves less than `least`.
    fn correlations(&self, least: f64) -> [[f64; 3]; 3] {
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

    /// Sum of the correlations of the best naming of the axes, over the number of axes that move.
    pub(super) fn best_match(&self, least: f64) -> f64 {
        let r = self.correlations(least);
        let moving = r.iter().filter(|row| row.iter().any(|x| *x != 0.0)).count();
        best_naming(&r).0 / moving.max(1) as f64
    }

    /// The axes of the first as the second would call them, if that fits much better than their names.
    pub(super) fn misnamed_axes(&self, least: f64) -> Option<String> {
        let r = self.correlations(least);
        let (best, naming) = best_naming(&r);
        let own = r[0][0] + r[1][1] + r[2][2];
        (best > own + MARGIN && best > MATCH).then(|| {
            let names = naming.map(|(axis, sign)| {
                format!("{}{}", if sign < 0.0 { "-" } else { "" }, ["x", "y", "z"][axis])
            });
            format!("({})", names.join(", "))
        })
    }

    /// As [`Self::misnamed_axes`], each naming at the shift of up to `most` pairs at which it fits best.
    pub(super) fn misnamed_axes_late(&self, least: f64, most: i64) -> Option<String> {
        let shifted: Vec<Self> = (0..=most).map(|shift| self.later_by(shift)).collect();
        let own = shifted
            .iter()
            .map(|pairs| {
                let r = pairs.correlations(least);
                r[0][0] + r[1][1] + r[2][2]
            })
            .fold(f64::NEG_INFINITY, f64::max);
        shifted.iter().find_map(|pairs| {
            let (best, _) = best_naming(&pairs.correlations(least));
            if best > own + MARGIN { pairs.misnamed_axes(least) } else { None }
        })
    }

    /// The first over the second, from all axes together about their means.
    pub(super) fn scale(&self) -> Option<f64> {
        let (a, b) = self.means();
        let (mut aa, mut bb) = (0.0, 0.0);
        for (x, y) in &self.0 {
            aa += (x - a).norm_squared();
            bb += (y - b).norm_squared();
        }
        (aa > 0.0 && bb > 0.0).then(|| (aa / bb).sqrt())
    }

    /// As [`Self::scale`] along what the two have in common, where their axes agree at least so well.
    pub(super) fn scale_if(&self, correlation: f64) -> Option<f64> {
        let (a, b) = self.means();
        let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
        for (x, y) in &self.0 {
            let (x, y) = (x - a, y - b);
            ab += x.dot(&y);
            aa += x.norm_squared();
            bb += y.norm_squared();
        }
        (ab > correlation * (aa * bb).sqrt() && bb > 0.0).then(|| ab / bb)
    }

    /// Mean of the first over mean of the second along z.
    pub(super) fn mean_ratio_z(&self) -> f64 {
        let (a, b) = self.means();
        a.z / b.z
    }

    /// By how much the first is later than the second, s, and how well they then correlate; pairs are `step_s` apart.
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
            (0..2).map(|i| sum[i] / (own[i] * other[i]).sqrt().max(f64::MIN_POSITIVE)).sum::<f64>() / 2.0
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

/// The naming of axes, each once and with either sign, with the largest sum of correlations.
fn best_naming(r: &[[f64; 3]; 3]) -> (f64, [(usize, f64); 3]) {
    let orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let mut best = (f64::NEG_INFINITY, [(0, 1.0), (1, 1.0), (2, 1.0)]);
    for order in orders {
        let sum: f64 = (0..3).map(|i| r[i][order[i]].abs()).sum();
        if sum > best.0 {
            best = (sum, [0, 1, 2].map(|i| (order[i], if r[i][order[i]] < 0.0 { -1.0 } else { 1.0 })));
        }
    }
    best
}
