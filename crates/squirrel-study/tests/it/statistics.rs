//! Means, gains and their intervals, and the paper's own figures recomputed.

use squirrel_study::statistics::{gain, mean, paired, paired_shares};

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
    let rows =
        [(0.4821, 0.4209), (0.9375, 0.6965), (0.6977, 0.4094), (0.9672, 0.6019), (0.3133, 0.2518)];
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
        let noise =
            |k: u64| (((trial * 97 + k * 31) * (trial + 7 * k + 3)) % 1009) as f64 / 1009.0 - 0.5;
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
