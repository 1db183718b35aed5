//! What each set is asked for, beside what it has.

use super::summary::Group;
use serde::Serialize;
use std::collections::BTreeMap;

/// One figure of a set against its bar.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Bar {
    /// The set, or the half of it.
    pub set: &'static str,
    /// What is counted.
    pub measure: &'static str,
    /// The bar, 0 to 1.
    pub bar: f64,
    /// Whether the figure must not be above it, instead of not below.
    pub at_most: bool,
    /// The figure; `None` where no case has one.
    pub is: Option<f64>,
    /// Whether it holds.
    pub holds: bool,
}

/// How a figure is taken from a group.
type Figure = fn(&Group) -> Option<f64>;

const FIRST: (&str, Figure) = ("first right", |g| Some(g.first_right));
const EXACT: (&str, Figure) = ("exact", |g| Some(g.exact));
const RIGHT: (&str, Figure) = ("right", |g| Some(g.right));
const SILENT: (&str, Figure) = ("silent wrong", |g| Some(g.silent_wrong));
const PATCH: (&str, Figure) = ("patch written", |g| Some(g.patched));
const GAP: (&str, Figure) = ("gap removed, median", |g| g.gap_removed_median);
const REMOVABLE: (&str, Figure) = ("removable removed, median", |g| g.removable_removed_median);

/// Set, figure, bar; a share of silent errors is one that must not be above it.
const BARS: [(&str, (&str, Figure), f64); 23] = [
    ("single", FIRST, 0.99),
    ("single", EXACT, 0.985),
    ("single", GAP, 0.999),
    ("two", EXACT, 0.97),
    ("none", RIGHT, 0.99),
    ("outside", RIGHT, 0.97),
    ("outside", SILENT, 0.01),
    ("estimates", EXACT, 0.95),
    ("estimates_none", RIGHT, 0.98),
    ("sensors", RIGHT, 0.97),
    ("capture", FIRST, 0.9),
    ("capture_none", RIGHT, 0.98),
    ("inertial", FIRST, 0.9),
    ("inertial_none", RIGHT, 0.98),
    ("overstated", RIGHT, 0.97),
    ("misfit", FIRST, 0.95),
    ("misfit", PATCH, 0.9),
    ("misfit", SILENT, 0.01),
    ("misfit", REMOVABLE, 0.95),
    ("misfit_apart", FIRST, 0.85),
    ("misfit_apart", RIGHT, 0.97),
    ("misfit_apart", SILENT, 0.03),
    ("baseline_none", RIGHT, 0.98),
];

pub(super) fn of(sets: &BTreeMap<&'static str, Group>) -> Vec<Bar> {
    let bars = BARS.iter().filter_map(|&(set, (measure, figure), bar)| {
        let is = figure(sets.get(set)?);
        let at_most = measure == SILENT.0;
        let holds = is.is_some_and(|is| if at_most { is <= bar } else { is >= bar });
        Some(Bar { set, measure, bar, at_most, is, holds })
    });
    bars.collect()
}

impl Bar {
    pub(super) fn line(&self) -> String {
        let is = self.is.map_or_else(|| "-".to_owned(), |is| format!("{:.1}", 100.0 * is));
        let sign = if self.at_most { "<=" } else { ">=" };
        let word = if self.holds { "" } else { "  missed" };
        format!(
            "{:<24} {:<26} {is:>6} {sign} {:.1}{word}\n",
            self.set,
            self.measure,
            100.0 * self.bar
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::set::Set;
    use std::collections::BTreeSet;

    #[test]
    fn every_bar_is_of_a_set() {
        let mut groups: BTreeSet<&str> = Set::ALL.iter().map(|(set, _)| set.name()).collect();
        groups.extend(Set::ALL.iter().map(|(set, _)| set.group(true)));
        assert!(BARS.iter().all(|(set, _, _)| groups.contains(set)));
    }

    #[test]
    fn bars_hold_on_their_own_side() {
        let bar = |at_most, is, holds| Bar { set: "a", measure: "b", bar: 0.5, at_most, is, holds };
        assert!(bar(false, Some(0.6), true).line().contains("60.0 >= 50.0\n"));
        assert!(bar(true, None, false).line().contains("- <= 50.0  missed\n"));
    }
}
