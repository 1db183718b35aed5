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

#[cfg(test)]
mod tests {
    use super::*;

    fn percent(x: f64) -> f64 {
        (x * 1e4).round() / 1e2
    }

    /// Table III of the paper, three trials an arm: what it calls a gain of 13.1 % is a ratio of
    /// means minus one (C1, C2).
    #[test]
    fn the_papers_tracking_gain() {
        let wingless = [4.7012, 4.4438, 4.8829];
        let flat = [4.6432, 4.3026, 4.5007];
        let parnn = [3.9292, 4.1752, 4.2986];
        assert_eq!(percent(gain(&wingless, &parnn)), 13.1);
        assert_eq!(
            percent(1.0 - mean(&parnn) / mean(&wingless)),
            11.58,
            "the reduction of the error is smaller"
        );
        assert_eq!(percent(gain(&wingless, &flat)), 4.32);
        assert_eq!(percent(gain(&flat, &parnn)), 8.41);
    }

    /// Table II: the abstract's 24.4 to 70.4 % are ratios minus one too (C3).
    #[test]
    fn the_papers_force_errors() {
        let rows = [
            (0.4821, 0.4209),
            (0.9375, 0.6965),
            (0.6977, 0.4094),
            (0.9672, 0.6019),
            (0.3133, 0.2518),
        ];
        let ratios = rows.map(|(vanilla, parnn)| (gain(&[vanilla], &[parnn]) * 1e3).round() / 10.0);
        assert_eq!(ratios, [14.5, 34.6, 70.4, 60.7, 24.4]);
    }

    /// The forest: 19, 4 and 2 of 21 (C4).
    #[test]
    fn the_papers_forest() {
        assert_eq!([19.0, 4.0, 2.0].map(|n: f64| percent(n / 21.0)), [90.48, 19.05, 9.52]);
    }

    #[test]
    fn the_interval_covers_the_truth_about_nineteen_times_in_twenty() {
        let mut inside = 0;
        for trial in 0..200u64 {
            // Pairs whose true ratio is 1.25, with noise from a quadratic residue sequence.
            let noise = |k: u64| {
                (((trial * 97 + k * 31) * (trial + 7 * k + 3)) % 1009) as f64 / 1009.0 - 0.5
            };
            let a: Vec<f64> = (0..24).map(|k| 5.0 + noise(k)).collect();
            let b: Vec<f64> = (0..24).map(|k| 4.0 + noise(k + 500)).collect();
            let e = paired(&a, &b, gain);
            inside += u32::from(e.low <= 0.25 && 0.25 <= e.high);
        }
        assert!((175..=200).contains(&inside), "{inside} of 200");
    }

    #[test]
    fn paired_shares_have_intervals_where_a_bootstrap_has_none() {
        let pairs = |counts: [usize; 4]| -> (Vec<bool>, Vec<bool>) {
            let kinds = [(true, true), (true, false), (false, true), (false, false)];
            kinds.iter().zip(counts).flat_map(|(kind, n)| std::iter::repeat_n(*kind, n)).unzip()
        };
        let (a, b) = pairs([0, 0, 0, 105]);
        let e = paired_shares(&a, &b);
        assert!(e.value == 0.0 && e.low < -0.02 && e.high > 0.02, "{e:?}");
        let (a, b) = pairs([50, 20, 5, 30]);
        let (x, y) = (paired_shares(&a, &b), paired_shares(&b, &a));
        assert!((x.value - 15.0 / 105.0).abs() < 1e-12 && x.low > 0.0, "{x:?}");
        assert!((x.low + y.high).abs() < 1e-12, "turned round: {x:?} {y:?}");
        // Where shares are neither near 0 nor 1 it is about what the normal approximation of pairs
        // says.
        let deviation = ((25.0 - 15.0 * 15.0 / 105.0_f64) / (105.0 * 105.0)).sqrt();
        assert!((x.high - x.value - 1.96 * deviation).abs() < 0.01, "{x:?}, {deviation}");
        // Trials that go together tell more than trials that do not.
        let (a, b) = pairs([40, 30, 15, 20]);
        let apart = paired_shares(&a, &b);
        assert!(apart.high - apart.low > x.high - x.low, "{apart:?}");
    }

    #[test]
    fn intervals_repeat_and_hold_their_estimate() {
        let (a, b) = ([5.0, 6.0, 5.5, 7.0], [4.0, 5.0, 5.0, 5.5]);
        let e = paired(&a, &b, gain);
        assert_eq!(e, paired(&a, &b, gain));
        assert!(e.low <= e.value && e.value <= e.high);
    }
}
