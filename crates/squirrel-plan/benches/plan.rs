//! One plan past trunks from nothing, with wings and without, of the same tasks in the same run.

#![allow(missing_docs, clippy::unwrap_used, reason = "a bench")]

#[path = "../tests/it/tasks/mod.rs"]
mod tasks;

use criterion::{Criterion, criterion_group, criterion_main};
use squirrel_plan::trajectory::Planner;
use squirrel_plan::wing::WingModel;
use std::hint::black_box;
use tasks::{Draw, craft, random};

/// As many tasks as a mean needs.
const TASKS: usize = 10;

fn plan(c: &mut Criterion) {
    let mut group = c.benchmark_group("ten_plans_past_trunks");
    for (name, wing) in [("with_wings", Some(WingModel::Flat)), ("without", None)] {
        let (craft, mut draw) = (craft(1.5, wing), Draw(1));
        let tasks: Vec<_> = (0..TASKS).map(|_| random(&craft, &mut draw)).collect();
        group.bench_function(name, |b| {
            b.iter(|| {
                for task in &tasks {
                    black_box(Planner::default().plan(&craft, task, None));
                }
            });
        });
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = plan
}
criterion_main!(benches);
