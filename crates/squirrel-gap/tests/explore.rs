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
        println!("{id} {}", answers[&id]);
        println!("{}", squirrel_gap::name::explore(&vehicle("practice.toml"), &flights));
    }
}
