//! Shares with their intervals, by set, generator and effect; as JSON and as a table.

use super::bars::{self, Bar};
use super::checked::{self, Calibration};
use super::score::Outcome;
use super::verdict::Word;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Part of the cases.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Group {
    /// Cases.
    pub n: usize,
    /// Share whose name of highest evidence is hidden (none, outside: share of the right verdict).
    pub first_right: f64,
    /// Wilson's 95 % interval of it.
    pub first_right_interval: [f64; 2],
    /// Share with exactly the hidden names.
    pub exact: f64,
    /// Its interval.
    pub exact_interval: [f64; 2],
    /// Share that says openly that there is no single answer, and holds the truth where it lists
    /// names.
    pub flagged: f64,
    /// Its interval.
    pub flagged_interval: [f64; 2],
    /// Share with a name that is not hidden, said without a doubt.
    pub silent_wrong: f64,
    /// Its interval.
    pub silent_wrong_interval: [f64; 2],
    /// Share of cases that are as the set asks.
    pub right: f64,
    /// Its interval.
    pub right_interval: [f64; 2],
    /// Share with a patched vehicle file.
    pub patched: f64,
    /// Median, over cases with a patch, of what it removes of the removable held-out residual.
    pub removable_removed_median: Option<f64>,
    /// Of the held-out gap; over cases that state it.
    pub gap_removed_median: Option<f64>,
    /// One case in ten is below.
    pub gap_removed_p10: Option<f64>,
    /// Of one process.
    pub seconds_median: f64,
    /// Of the sizes of rightly named effects with one size.
    pub parameter_error_median: Option<f64>,
    /// Share of their 95 % intervals that hold the size.
    pub interval_coverage: Option<f64>,
    /// Cases by verdict.
    pub verdicts: BTreeMap<Word, usize>,
}

/// A whole run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// All draws follow from it.
    pub seed: u64,
    /// By set.
    pub sets: BTreeMap<&'static str, Group>,
    /// What the sets are asked for, and whether they have it.
    pub bars: Vec<Bar>,
    /// By generator, then by set.
    pub generators: BTreeMap<String, BTreeMap<&'static str, Group>>,
    /// By effect, over all sets: sizes whose 95 % interval is stated, and the share of intervals
    /// that hold the size.
    pub coverage: BTreeMap<String, Coverage>,
    /// By what is hidden, of the sets with one hidden thing at standard noise and rich excitation.
    pub hidden: BTreeMap<String, Group>,
    /// What was foreseen against what was named, where that was asked; see [`Calibration`].
    pub check: Calibration,
    /// Case by case.
    pub cases: Vec<Outcome>,
}

/// Intervals of one effect.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Coverage {
    /// How many there are.
    pub n: usize,
    /// Share that holds the size.
    pub covered: f64,
}

/// From so many intervals of an effect on, a share outside of these bounds is told.
const COVERAGE_N: usize = 20;
const COVERAGE: [f64; 2] = [0.88, 0.99];

fn coverage(cases: &[Outcome]) -> BTreeMap<String, Coverage> {
    let mut effects: BTreeMap<String, Coverage> = BTreeMap::new();
    for (effect, inside) in cases.iter().flat_map(|case| &case.parameter_covered) {
        let own = effects.entry(effect.clone()).or_default();
        own.covered =
            (own.covered * own.n as f64 + f64::from(u8::from(*inside))) / (own.n + 1) as f64;
        own.n += 1;
    }
    effects
}

/// Wilson's 95 % interval of a share.
fn wilson(count: usize, n: usize) -> [f64; 2] {
    let (z, n) = (1.959_963_985, n as f64);
    let p = count as f64 / n;
    let middle = p + z * z / (2.0 * n);
    let half = z * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
    let scale = 1.0 + z * z / n;
    [((middle - half) / scale).max(0.0), ((middle + half) / scale).min(1.0)]
}

/// The value below which this share of the values lies; by rank, lower of two.
fn quantile(mut values: Vec<f64>, share: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    Some(values[(share * last as f64) as usize])
}

impl Group {
    /// * `cases` - at least one
    fn new(cases: &[&Outcome]) -> Self {
        let n = cases.len();
        let share = |is: fn(&Outcome) -> bool| {
            let count = cases.iter().filter(|case| is(case)).count();
            (count as f64 / n as f64, wilson(count, n))
        };
        let (first_right, first_right_interval) = share(|c| c.first_right);
        let (exact, exact_interval) = share(|c| c.exact);
        let (flagged, flagged_interval) = share(|c| c.flagged);
        let (silent_wrong, silent_wrong_interval) = share(|c| c.silent_wrong);
        let (right, right_interval) = share(|c| c.right);
        let (patched, _) = share(|c| c.patched);
        let removable = cases.iter().filter_map(|c| c.removable_removed).collect();
        let gaps: Vec<f64> = cases.iter().filter_map(|c| c.gap_removed).collect();
        let errors = cases.iter().flat_map(|c| c.parameter_errors.values().copied()).collect();
        let covered: Vec<bool> =
            cases.iter().flat_map(|c| c.parameter_covered.values().copied()).collect();
        let inside = covered.iter().filter(|inside| **inside).count();
        let mut verdicts = BTreeMap::new();
        for case in cases {
            *verdicts.entry(case.verdict).or_default() += 1;
        }
        Self {
            n,
            first_right,
            first_right_interval,
            exact,
            exact_interval,
            flagged,
            flagged_interval,
            silent_wrong,
            silent_wrong_interval,
            right,
            right_interval,
            patched,
            removable_removed_median: quantile(removable, 0.5),
            gap_removed_median: quantile(gaps.clone(), 0.5),
            gap_removed_p10: quantile(gaps, 0.1),
            seconds_median: quantile(cases.iter().map(|c| c.seconds).collect(), 0.5).unwrap_or(0.0),
            parameter_error_median: quantile(errors, 0.5),
            interval_coverage: (!covered.is_empty()).then(|| inside as f64 / covered.len() as f64),
            verdicts,
        }
    }
}

fn grouped<K: Ord>(cases: &[Outcome], key: impl Fn(&Outcome) -> Option<K>) -> BTreeMap<K, Group> {
    let mut groups: BTreeMap<K, Vec<&Outcome>> = BTreeMap::new();
    for case in cases {
        if let Some(key) = key(case) {
            groups.entry(key).or_default().push(case);
        }
    }
    groups.into_iter().map(|(key, cases)| (key, Group::new(&cases))).collect()
}

/// Sums up a run.
pub fn summarise(seed: u64, cases: Vec<Outcome>) -> Summary {
    let mut generators = BTreeMap::new();
    for case in &cases {
        let name = format!("{:?}", case.generator).to_lowercase();
        generators.entry(name).or_insert_with(|| {
            let own = |other: &Outcome| other.generator == case.generator;
            grouped(&cases, |other| own(other).then_some(other.group))
        });
    }
    let hidden = grouped(&cases, |case| {
        let plain = matches!(case.set.name(), "single" | "outside");
        case.hidden.first().filter(|_| plain).cloned()
    });
    let sets = grouped(&cases, |case| Some(case.group));
    let bars = bars::of(&sets);
    let check = checked::calibration(&cases);
    Summary { seed, bars, coverage: coverage(&cases), sets, generators, hidden, check, cases }
}

impl Summary {
    /// The table for people.
    pub fn table(&self) -> String {
        let mut text = String::new();
        let _ = writeln!(
            text,
            "{:<24} {:>4}  {:<19} {:>6} {:>7} {:>7} {:>6} {:>6}  {:>6} {:>6} {:>6}  {:>6} {:>6}  {:>6}",
            "set",
            "n",
            "first right %",
            "exact",
            "flagged",
            "silent",
            "right",
            "patch",
            "gap",
            "p10",
            "remov",
            "error",
            "cover",
            "s"
        );
        for (name, group) in &self.sets {
            row(&mut text, name, group);
        }
        for (generator, sets) in self.generators.iter().filter(|_| self.generators.len() > 1) {
            for (name, group) in sets {
                row(&mut text, &format!("{generator}: {name}"), group);
            }
        }
        if !self.check.is_empty() {
            text += &checked::table(&self.check);
        }
        if !self.bars.is_empty() {
            text.push_str("\nbars\n");
            self.bars.iter().for_each(|bar| text += &bar.line());
        }
        for (effect, intervals) in &self.coverage {
            if intervals.n >= COVERAGE_N
                && !(COVERAGE[0]..=COVERAGE[1]).contains(&intervals.covered)
            {
                let covered = 100.0 * intervals.covered;
                let _ = writeln!(
                    text,
                    "{effect}: {covered:.1} % of {} intervals hold the size",
                    intervals.n
                );
            }
        }
        let imperfect = self.hidden.iter().filter(|(_, group)| group.exact < 1.0);
        for (number, (name, group)) in imperfect.enumerate() {
            if number == 0 {
                text.push_str("\nhidden, not all exact\n");
            }
            row(&mut text, name, group);
        }
        text
    }
}

fn row(text: &mut String, name: &str, g: &Group) {
    let percent = |x: f64| format!("{:.1}", 100.0 * x);
    let or_dash = |x: Option<f64>| x.map_or_else(|| "-".to_owned(), percent);
    let [low, high] = g.first_right_interval.map(percent);
    let _ = writeln!(
        text,
        "{name:<24} {:>4}  {:<19} {:>6} {:>7} {:>7} {:>6} {:>6}  {:>6} {:>6} {:>6}  {:>6} {:>6}  {:>6.2}",
        g.n,
        format!("{:>5} ({low} to {high})", percent(g.first_right)),
        percent(g.exact),
        percent(g.flagged),
        percent(g.silent_wrong),
        percent(g.right),
        percent(g.patched),
        or_dash(g.gap_removed_median),
        or_dash(g.gap_removed_p10),
        or_dash(g.removable_removed_median),
        or_dash(g.parameter_error_median),
        or_dash(g.interval_coverage),
        g.seconds_median
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Generator, Set};

    fn outcome(set: Set, right: bool, gap_removed: f64) -> Outcome {
        Outcome {
            case: "0".to_owned(),
            set,
            group: set.name(),
            generator: Generator::Independent,
            hidden: vec!["motor_lag".to_owned()],
            verdict: if right { Word::Named } else { Word::None },
            named: Vec::new(),
            failure: None,
            first_right: right,
            exact: right,
            flagged: false,
            silent_wrong: false,
            right,
            patched: right,
            removable_removed: right.then_some(0.97),
            gap_removed: Some(gap_removed),
            seconds: 0.5,
            foreseen: None,
            parameter_errors: [("motor_lag".to_owned(), 0.02)].into(),
            parameter_covered: [("motor_lag".to_owned(), right)].into(),
        }
    }

    #[test]
    fn wilson_by_hand() {
        // 8 of 10: 0.490 to 0.943, a textbook value.
        let [low, high] = wilson(8, 10);
        assert!((low - 0.490).abs() < 1e-3 && (high - 0.943).abs() < 1e-3, "{low} {high}");
        assert_eq!(wilson(0, 5)[0], 0.0);
        assert!(wilson(300, 300)[1] > 0.999 && wilson(300, 300)[0] > 0.98);
    }

    #[test]
    fn groups_count_their_own_cases() {
        let mut cases: Vec<Outcome> =
            (0..10).map(|k| outcome(Set::Single, k != 0, f64::from(90 + k) / 100.0)).collect();
        cases.push(outcome(Set::Calm, false, 0.1));
        let summary = summarise(4, cases);
        let single = &summary.sets["single"];
        assert_eq!((single.n, single.first_right, single.interval_coverage), (10, 0.9, Some(0.9)));
        assert_eq!(single.gap_removed_p10, Some(0.9));
        assert_eq!(single.gap_removed_median, Some(0.94));
        assert_eq!(single.verdicts[&Word::None], 1);
        assert_eq!(
            (single.right, single.patched, single.removable_removed_median),
            (0.9, 0.9, Some(0.97))
        );
        assert_eq!(summary.sets["calm"].first_right, 0.0);
        assert_eq!(summary.coverage["motor_lag"].n, 11);
        assert!((summary.coverage["motor_lag"].covered - 9.0 / 11.0).abs() < 1e-9);
        assert_eq!(
            summary.hidden["motor_lag"].n, 10,
            "calm flights do not count against an effect"
        );
        assert!(summary.table().contains("single") && summary.table().contains("90.0"));
        let json = serde_json::to_value(&summary).unwrap();
        assert_eq!(json["sets"]["single"]["verdicts"]["named"], 9);
    }
}
