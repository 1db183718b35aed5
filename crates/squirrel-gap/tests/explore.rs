#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]
mod support;
use support::*;
#[test]
fn explore() {
    let Some(dir) = shared("gap-practice/cases") else { return };
    let only = std::env::var("CASE").ok();
    let mut cases: Vec<_> = std::fs::read_dir(&dir).unwrap().map(|e| e.unwrap().path()).collect();
    cases.sort();
    let answers: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(dir.join("../answers.json")).unwrap()).unwrap();
    for case in cases {
        let id = case.file_name().unwrap().to_str().unwrap().to_owned();
        if only.as_ref().is_some_and(|o| !id.starts_with(o.as_str())) { continue; }
        let flights: Vec<_> = ["flight00", "flight01"].iter().map(|f| ((*f).to_owned(), imported("practice.toml", &case.join("train").join(f)))).collect();
        let held: Vec<_> = ["flight00"].iter().map(|f| (format!("held-{f}"), imported("practice.toml", &case.join("holdout").join(f)))).collect();
        println!("{id} {}", answers[&id]);
        let t0 = std::time::Instant::now();
        let last = std::cell::Cell::new(0.0);
        let d = squirrel_gap::diagnose(&vehicle("practice.toml"), &flights, &held, &|what| { let t = t0.elapsed().as_secs_f64(); if t - last.get() > 0.3 || what != "naming" { println!("    {t:.2} {what}"); last.set(t);} }).unwrap();
        println!("  {:.2} s {:?} {}", t0.elapsed().as_secs_f64(), d.verdict.verdict, d.verdict.words);
        println!("  {:?}", d.verdict.alternatives);
        println!("  {:?}", d.verdict.gap);
        println!("  {}", d.debug());
    }
}
#[test]
fn scan() {
    let dir = shared("gap-practice/cases").unwrap();
    let case = dir.join(std::env::var("CASE").unwrap());
    let flights: Vec<_> = ["flight00", "flight01"].iter().map(|f| ((*f).to_owned(), imported("practice.toml", &case.join("train").join(f)))).collect();
    for e in ["motor_lag", "actuation_latency"] { eprintln!("{e}");
    squirrel_gap::scan(&vehicle("practice.toml"), &flights, e, 0, &[-0.01, -0.006, -0.004, -0.002, -0.001, 0.0, 0.001, 0.002, 0.004, 0.006, 0.01]); }
}
