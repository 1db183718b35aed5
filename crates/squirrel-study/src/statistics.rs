//! Means and intervals.

/// A figure with its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Estimate {
    /// Point estimate.
    pub value: f64,
    /// Lower end of the 95 % interval.
    pub low: f64,
    /// Upper end of the 95 % interval.
    pub high: f64,
}

/// Resamples of a bootstrap.
const RESAMPLES: usize = 2000;

/// Arithmetic mean; NaN for none.
pub fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len() as f64
}

/// `statistic` of paired samples with a percentile bootstrap over the pairs. The draw is fixed, so
/// that the same data give the same interval.
///
/// * `a`, `b` - paired by index, same length
pub fn paired(a: &[f64], b: &[f64], statistic: impl Fn(&[f64], &[f64]) -> f64) -> Estimate {
    let n = a.len().min(b.len());
    let mut state = 0x853C_49E6_748F_EA9B_u64;
    let mut draw = || {
        // SplitMix64: equidistributed and tiny; what matters here is only that draws repeat.
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) % n.max(1) as u64) as usize
    };
    let mut values: Vec<f64> = (0..RESAMPLES)
        .map(|_| {
            let chosen: Vec<usize> = (0..n).map(|_| draw()).collect();
            let pick = |x: &[f64]| chosen.iter().map(|&i| x[i]).collect::<Vec<f64>>();
            statistic(&pick(a), &pick(b))
        })
        .collect();
    values.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| values[(share * (RESAMPLES - 1) as f64).round() as usize];
    Estimate { value: statistic(&a[..n], &b[..n]), low: at(0.025), high: at(0.975) }
}

/// With fewer trials than this nothing is concluded: a bootstrap of so few says no more than they
/// do.
pub const FEW: u32 = 5;

/// Difference of two shares of the same trials, with an interval from Wilson's intervals of both
/// and their correlation (after Newcombe 1998): unlike a bootstrap it has a width where no pair
/// differs.
///
/// * `a`, `b` - outcomes paired by index
pub fn paired_shares(a: &[bool], b: &[bool]) -> Estimate {
    let [one, other] = [a, b].map(|outcomes| Share::of(outcomes.iter().copied()).share);
    let count =
        |x: bool, y: bool| a.iter().zip(b).filter(|(a, b)| **a == x && **b == y).count() as f64;
    let [both, first, second, none] =
        [count(true, true), count(true, false), count(false, true), count(false, false)];
    let sides = (both + first) * (second + none) * (both + second) * (first + none);
    let together = if sides > 0.0 { (both * none - first * second) / sides.sqrt() } else { 0.0 };
    let reach = |x: f64, y: f64| (x * x - 2.0 * together * x * y + y * y).max(0.0).sqrt();
    let value = one.value - other.value;
    Estimate {
        value,
        low: value - reach(one.value - one.low, other.high - other.value),
        high: value + reach(one.high - one.value, other.value - other.low),
    }
}

/// A share of trials with Wilson's 95 % interval, which holds for few trials and for shares near 0
/// and 1 too.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Share {
    /// How many.
    pub count: u32,
    /// Of how many.
    pub of: u32,
    /// The share with its interval.
    pub share: Estimate,
}

impl Share {
    /// Of outcomes.
    pub fn of(outcomes: impl IntoIterator<Item = bool>) -> Self {
        let (mut count, mut of) = (0, 0);
        for outcome in outcomes {
            (count, of) = (count + u32::from(outcome), of + 1);
        }
        // The normal quantile of 97.5 %.
        let (z, n) = (1.959_963_985, f64::from(of));
        let p = f64::from(count) / n;
        let centre = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
        let half = z / (1.0 + z * z / n) * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
        Self { count, of, share: Estimate { value: p, low: centre - half, high: centre + half } }
    }
}

/// The paper's gain: `mean(reference) / mean(x) - 1`.
pub fn gain(reference: &[f64], x: &[f64]) -> f64 {
    mean(reference) / mean(x) - 1.0
}
