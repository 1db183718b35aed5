//! The gap report: where simulation and flights disagree, what explains it, and how far that can be
//! trusted.
//!
//! One HTML file without network, the same bytes for the same data. The answers come first; each
//! panel below answers one question and says in words when nothing was given for it. [`ReportData`]
//! is everything that the page shows.
//!
//! | panel | question |
//! |---|---|
//! | `answers` | what is missing, how sure, how much better it predicts, what remains, what to fly next: the first screen |
//! | `check-flights`, `check-effects` | what are the flights worth, before any verdict; where they were asked that |
//! | `panel-h` | what is the answer, where does it hold, what changes in the vehicle file |
//! | `panel-a` | when and where do simulation and flight disagree, before and after |
//! | `panel-b` | how much better is the answer than its rivals |
//! | `panel-c` | does the residual follow the quantity that is said to explain it |
//! | `panel-d` | does the answer predict flights that it has not seen |
//! | `panel-e` | is what is left noise |
//! | `panel-f` | are the numbers plausible |
//! | `panel-g` | which effects could these flights not tell apart, and what to fly |

mod answer;
mod check;
mod data;
mod first;
mod proof;
mod residual;

pub use data::{
    Answer, Bin, Conditional, Confusability, DomainRow, Errors, Evidence, FlightPanel, FlyNext,
    HeldOut, HeldOutChannel, Horizon, InputCorrelation, ParameterRow, ReportData, RotorRow,
    Whiteness,
};

pub use check::render_check;

use crate::number::significant;
use squirrel_report::chart::drawable;
use squirrel_report::page::Page;

/// Identifiers of the panels in the order of the page.
pub const PANELS: [&str; 9] = [
    "answers", "panel-h", "panel-a", "panel-b", "panel-c", "panel-d", "panel-e", "panel-f",
    "panel-g",
];

/// Width of drawings that span the page, px: narrower than the page, so that their text can still
/// be read on a small screen.
const WIDTH: f64 = 900.0;

/// The report as one HTML file.
pub fn render(data: &ReportData) -> String {
    let mut page = Page::new(&data.title, "");
    first::screen(&mut page, data);
    if let Some(check) = &data.check {
        check::panels(&mut page, check);
    }
    answer::verdict(&mut page, data);
    residual::over_time(&mut page, data);
    answer::evidence(&mut page, data);
    residual::against_regressors(&mut page, data);
    proof::held_out(&mut page, data);
    proof::whiteness(&mut page, data);
    answer::parameters(&mut page, data);
    answer::confusability(&mut page, data);
    page.html()
}

/// Says why a panel is empty: what it lacks, or what kept everything from being computed.
fn lacking(page: &mut Page, data: &ReportData, words: &str) {
    page.missing(if data.stopped.is_empty() { words } else { &data.stopped });
}

/// A number with three significant digits, a dash for one that is unknown.
fn figure(value: f64) -> String {
    if !drawable(value) {
        return "\u{2013}".to_owned();
    }
    significant(value, 3).replace('-', "\u{2212}")
}

/// A number with its unit.
fn quantity(value: f64, unit: &str) -> String {
    if unit.is_empty() { figure(value) } else { format!("{} {unit}", figure(value)) }
}
