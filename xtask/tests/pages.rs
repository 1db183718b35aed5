//! The pages that a newcomer reads: what they link to is there, and the first one stays short.
#![allow(clippy::unwrap_used, reason = "tests")]

mod repository;

use repository::{files, root};
use std::fs;
use std::path::Path;

/// Longest README, lines.
const README_LINES: usize = 150;

/// Targets of links and pictures outside of code that are no addresses of the network.
fn links(page: &str) -> Vec<&str> {
    let prose = page.split("\n```").step_by(2).flat_map(|text| text.split('`').step_by(2));
    let targets =
        prose.flat_map(|text| text.split("](").skip(1)).filter_map(|rest| rest.split(')').next());
    targets.filter(|target| !target.contains("://")).collect()
}

/// What a heading is called in links to it.
fn anchor(heading: &str) -> String {
    let kept = heading
        .trim_start_matches('#')
        .trim()
        .chars()
        .filter(|c| c.is_alphanumeric() || " -_".contains(*c));
    kept.collect::<String>().to_lowercase().replace(' ', "-")
}

/// Whether what a link of a page says is there: the file or folder, and the heading in it.
fn leads_somewhere(page: &Path, link: &str) -> bool {
    let (file, heading) = link.split_once('#').unwrap_or((link, ""));
    let target = if file.is_empty() { page.to_owned() } else { page.parent().unwrap().join(file) };
    let has =
        |text: String| text.lines().any(|line| line.starts_with('#') && anchor(line) == heading);
    target.exists() && (heading.is_empty() || fs::read_to_string(&target).is_ok_and(has))
}

#[test]
fn every_link_and_picture_of_the_pages_is_there() {
    let mut all = vec![root().join("README.md"), root().join("CONTRIBUTING.md")];
    all.extend(files(&root().join("docs"), &["md"]));
    let (mut count, mut gone) = (0, Vec::new());
    for page in &all {
        let text = fs::read_to_string(page).unwrap();
        count += links(&text).len();
        let wrong = links(&text).into_iter().filter(|link| !leads_somewhere(page, link));
        gone.extend(wrong.map(|link| format!("{}: {link}", page.display())));
    }
    assert!(count > 20, "only {count} links found");
    assert!(gone.is_empty(), "{}", gone.join("\n"));
}

#[test]
fn the_readme_is_short() {
    let lines = fs::read_to_string(root().join("README.md")).unwrap().lines().count();
    assert!(lines <= README_LINES, "{lines} lines; what is longer belongs to docs/guide");
}

/// What the README says of the report that it shows is what the guide's page of the same flights
/// prints, which is compared with the program.
#[test]
fn the_picture_of_the_report_is_of_this_version() {
    let read = |path: &str| fs::read_to_string(root().join(path)).unwrap();
    let (readme, page) = (read("README.md"), read("docs/guide/csv-log.md"));
    let told =
        readme.split("](docs/pictures/gap.png)").next().unwrap().rsplit("![").next().unwrap();
    let number = |text: &str, after: &str| {
        let rest = text.split(after).nth(1).unwrap();
        rest.trim_start().chars().take_while(|c| "0123456789.".contains(*c)).collect::<String>()
    };
    let exponent = number(&page, "(voltage_exponent");
    assert!(told.contains(&format!("exponent {exponent} (")), "{told}: not {exponent}");
    let gain = number(&page, "On held-out flights it removes");
    assert!(told.contains(&format!("{gain} % less error")), "{told}: not {gain}");
}

#[test]
fn links_are_told_from_code_and_from_the_network() {
    let page =
        "[a](b.md) and ![c](d/e.svg), `[f](g)` and [h](https://i.j)\n```sh\n[k](l)\n```\n[m](#n)";
    assert_eq!(links(page), ["b.md", "d/e.svg", "#n"]);
    let readme = root().join("README.md");
    assert!(leads_somewhere(&readme, "docs/claims.md#what-we-claim"));
    assert!(
        !leads_somewhere(&readme, "docs/claims.md#what-we-do-not")
            && !leads_somewhere(&readme, "docs/none.md")
    );
}
