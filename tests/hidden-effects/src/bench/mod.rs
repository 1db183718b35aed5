//! The bench: makes cases, asks the program about each, opens the answers afterwards and scores.
//!
//! The program is a process of its own that sees a case's folder and nothing else.

mod ask;
mod bars;
mod checked;
mod score;
mod summary;
mod verdict;

pub use bars::Bar;
pub use checked::{Calibration, Check, Foreseen};
pub use score::Outcome;
pub use summary::{Coverage, Group, Summary, summarise};
pub use verdict::Verdict;

use crate::case::{Answer, Case, CaseError, Set, seeds};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// What to run.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The program under test.
    pub squirrel: PathBuf,
    /// Cases as set and number.
    pub cases: Vec<(Set, usize)>,
    /// All draws follow from it.
    pub seed: u64,
    /// Where cases, answers and results go.
    pub folder: PathBuf,
    /// Whether they stay there.
    pub keep: bool,
    /// Whether the program is asked beforehand what the flights could show.
    pub check: bool,
}

/// Cases that are flown and asked at the same time.
const WORKERS: usize = 2;

/// `cases` spread over all sets in the proportions of a full run, at least one a set.
pub fn spread(cases: usize) -> Vec<(Set, usize)> {
    let full: usize = Set::ALL.iter().map(|(_, count)| count).sum();
    let share = |count: usize| ((cases * count + full / 2) / full).clamp(1, count);
    Set::ALL
        .iter()
        .flat_map(|&(set, count)| (0..share(count)).map(move |index| (set, index)))
        .collect()
}

/// Every case of a full run.
pub fn full() -> Vec<(Set, usize)> {
    Set::ALL.iter().flat_map(|&(set, count)| (0..count).map(move |index| (set, index))).collect()
}

/// Runs a plan. Outcomes are in the plan's order, whoever finished first.
///
/// # Errors
/// A case cannot be made or its answer not be read. What the program does wrong is an outcome, not
/// an error.
pub fn run(plan: &Plan) -> Result<Vec<Outcome>, CaseError> {
    let bar = progress(plan.cases.len() as u64);
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..WORKERS {
            scope.spawn(|| {
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    let Some(&(set, index)) = plan.cases.get(number) else { return };
                    let outcome = one(plan, set, index);
                    let failed = outcome.is_err();
                    done.lock()
                        .unwrap_or_else(std::sync::PoisonError::into_inner)
                        .push((number, outcome));
                    bar.inc(1);
                    if failed {
                        // The others stop after their case.
                        next.store(plan.cases.len(), Ordering::Relaxed);
                    }
                }
            });
        }
    });
    bar.finish_and_clear();
    let mut outcomes = done.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    outcomes.sort_by_key(|(number, _)| *number);
    outcomes.into_iter().map(|(_, outcome)| outcome).collect()
}

/// Scores what an earlier run of a plan kept, without asking again: how cases are scored may
/// change.
///
/// # Errors
/// An answer or the time that a case took cannot be read.
pub fn score_again(plan: &Plan) -> Result<Vec<Outcome>, CaseError> {
    let mut outcomes = Vec::with_capacity(plan.cases.len());
    for &(set, index) in &plan.cases {
        let (answers, results) = (plan.folder.join("answers"), plan.folder.join("results"));
        let mut ids = seeds(plan.seed).map(|seed| Case::draw(set, index, seed).answer.case);
        let file = |id: &String| answers.join(format!("{id}.json"));
        let kept = ids.find(|id| file(id).exists());
        let id = kept.unwrap_or_else(|| Case::draw(set, index, plan.seed).answer.case);
        let answer = read(&file(&id))?;
        let before: Kept = read(&results.join(format!("{id}.score.json")))?;
        let verdict = ask::read(&results.join(&id).join("verdict.json"));
        let mut outcome = score::score(&answer, ask::Asked { verdict, seconds: before.seconds });
        outcome.removable_removed = before.removable_removed;
        let check = results.join(&id).join("check.json");
        if plan.check
            && check.exists()
            && let [effect] = &answer.effects[..]
        {
            outcome.foreseen = Some(read::<Check>(&check)?.foresees(effect));
        }
        outcomes.push(outcome);
    }
    Ok(outcomes)
}

/// What is not in a verdict.
#[derive(serde::Deserialize)]
struct Kept {
    seconds: f64,
    removable_removed: Option<f64>,
}

fn one(plan: &Plan, set: Set, index: usize) -> Result<Outcome, CaseError> {
    let (case, folder) = Case::draw_and_make(set, index, plan.seed, &plan.folder)?;
    let id = &case.answer.case;
    let results = plan.folder.join("results").join(id);
    let asked = ask::ask(&plan.squirrel, &folder, &results);
    let answer = plan.folder.join("answers").join(format!("{id}.json"));
    let patched = asked.verdict.as_ref().ok().and_then(|verdict| verdict.model_patch.clone());
    let hidden = read::<Answer>(&answer)?;
    let mut outcome = score::score(&hidden, asked);
    if plan.check
        && let [effect] = &hidden.effects[..]
    {
        match ask::check(&plan.squirrel, &folder, &results) {
            Ok(check) => outcome.foreseen = Some(check.foresees(effect)),
            Err(why) => outcome.failure = Some(why),
        }
    }
    if let (Some(patched), Some(_)) = (patched, case.answer.misfit) {
        let truth = answer.with_extension("toml");
        match ask::removable_removed(&plan.squirrel, &folder, &truth, Path::new(&patched), &results)
        {
            Ok(share) => outcome.removable_removed = share,
            Err(why) => outcome.failure = Some(why),
        }
    }
    if plan.keep {
        crate::case::write_json(
            &plan.folder.join("results").join(format!("{id}.score.json")),
            &outcome,
        )?;
    } else {
        for path in [&folder, &results] {
            // A program that failed early left no results.
            if path.exists() {
                fs::remove_dir_all(path).map_err(CaseError::io(path))?;
            }
        }
    }
    Ok(outcome)
}

fn read<T: serde::de::DeserializeOwned>(path: &Path) -> Result<T, CaseError> {
    let bytes = fs::read(path).map_err(CaseError::io(path))?;
    serde_json::from_slice(&bytes)
        .map_err(|error| CaseError::Io { file: path.display().to_string(), source: error.into() })
}

fn progress(cases: u64) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(cases), ProgressDrawTarget::stderr());
    if let Ok(style) =
        ProgressStyle::with_template("cases {bar:40} {pos}/{len}  {elapsed} of {duration}")
    {
        bar.set_style(style);
    }
    bar
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_cases_are_spread_over_all_sets() {
        let count = |cases: &[(Set, usize)], set| cases.iter().filter(|(s, _)| *s == set).count();
        let all = Set::ALL.iter().map(|(_, count)| count).sum::<usize>();
        for n in [15, 60, 300] {
            let cases = spread(n);
            assert!(cases.len().abs_diff(n) <= 15, "{} for {n}", cases.len());
            assert!(Set::ALL.iter().all(|&(set, _)| count(&cases, set) >= 1));
        }
        assert_eq!(count(&full(), Set::Single), 290);
        assert_eq!(full().len(), all);
        assert_eq!(spread(1_000_000).len(), all);
    }
}
