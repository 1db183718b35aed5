//! A study's rows, for people and for machines: the same columns as a table and as CSV.

use crate::statistics::Estimate;
use std::fmt::Write as _;

/// A column of a row: its heading in the table, its name in the CSV, and what is in it.
pub type Column<'a> = (&'a str, &'a str, Cell<'a>);

/// Rows with one set of columns.
#[derive(Debug, Default)]
pub struct Sheet {
    pub(crate) rows: Vec<Vec<String>>,
    pub(crate) csv: String,
}

/// What is in one cell. An interval is one cell of the table and two columns of the CSV, `low` and
/// `high`.
#[derive(Debug, Clone, Copy)]
pub enum Cell<'a> {
    /// A word.
    Text(&'a str),
    /// A word in the table, another in the CSV.
    Named(&'a str, &'a str),
    /// A number, with so many digits in the table.
    Number(f64, usize),
    /// As [`Cell::Number`], in percent and with its sign in the table.
    Percent(f64, usize),
    /// An interval; absent where there is none.
    Interval(Option<Estimate>, usize),
    /// As [`Cell::Interval`], in percent and with signs in the table.
    PercentInterval(Option<Estimate>, usize),
}

impl Sheet {
    /// Adds a row; the first one says what the columns are.
    pub fn row(&mut self, columns: &[Column<'_>]) {
        if self.rows.is_empty() {
            self.rows.push(columns.iter().map(|(heading, ..)| (*heading).to_owned()).collect());
            self.csv =
                columns.iter().map(|(_, name, _)| *name).collect::<Vec<_>>().join(",") + "\n";
        }
        let mut shown = Vec::new();
        for (i, (_, _, cell)) in columns.iter().enumerate() {
            let gap = if i == 0 { "" } else { "," };
            let numbers = |e: &Option<Estimate>| {
                e.map_or(",".to_owned(), |e| format!("{},{}", e.low, e.high))
            };
            let (text, raw) = match cell {
                Cell::Text(text) => ((*text).to_owned(), (*text).to_owned()),
                Cell::Named(text, raw) => ((*text).to_owned(), (*raw).to_owned()),
                Cell::Number(x, digits) => (format!("{x:.digits$}"), x.to_string()),
                Cell::Percent(x, digits) => (format!("{:+.digits$}", 100.0 * x), x.to_string()),
                Cell::Interval(e, digits) => (
                    e.map_or("-".to_owned(), |e| {
                        format!("{:.digits$} to {:.digits$}", e.low, e.high)
                    }),
                    numbers(e),
                ),
                Cell::PercentInterval(e, digits) => {
                    let percent = |e: Estimate| {
                        format!("{:+.digits$} to {:+.digits$}", 100.0 * e.low, 100.0 * e.high)
                    };
                    (e.map_or("-".to_owned(), percent), numbers(e))
                }
            };
            let _ = write!(self.csv, "{gap}{raw}");
            shown.push(text);
        }
        self.csv.push('\n');
        self.rows.push(shown);
    }
}
