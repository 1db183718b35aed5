//! A study's rows, for people and for machines: the same columns as a table and as CSV.

use crate::output::Table;
use squirrel_study::statistics::Estimate;
use std::fmt::Write as _;

/// Rows with one set of columns.
pub(super) struct Sheet {
    table: Table,
    csv: String,
}

/// What is in one cell. An interval is one cell of the table and two columns of the CSV, `low` and `high`.
pub(super) enum Cell<'a> {
    Text(&'a str),
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
    /// * `columns` - heading of the table, name in the CSV
    pub(super) fn new(columns: &[(&str, &str)]) -> Self {
        let headings: Vec<&str> = columns.iter().map(|(heading, _)| *heading).collect();
        let names: Vec<&str> = columns.iter().map(|(_, name)| *name).collect();
        Self { table: Table::new(&headings), csv: names.join(",") + "\n" }
    }

    pub(super) fn row(&mut self, cells: &[Cell<'_>]) {
        let mut shown = Vec::new();
        for (i, cell) in cells.iter().enumerate() {
            let gap = if i == 0 { "" } else { "," };
            let numbers =
                |e: &Option<Estimate>| e.map_or(",".to_owned(), |e| format!("{},{}", e.low, e.high));
            let (text, raw) = match cell {
                Cell::Text(text) => ((*text).to_owned(), (*text).to_owned()),
                Cell::Number(x, digits) => (format!("{x:.digits$}"), x.to_string()),
                Cell::Percent(x, digits) => (format!("{:+.digits$}", 100.0 * x), x.to_string()),
                Cell::Interval(e, digits) => (
                    e.map_or("-".to_owned(), |e| format!("{:.digits$} to {:.digits$}", e.low, e.high)),
                    numbers(e),
                ),
                Cell::PercentInterval(e, digits) => {
                    let percent =
                        |e: Estimate| format!("{:+.digits$} to {:+.digits$}", 100.0 * e.low, 100.0 * e.high);
                    (e.map_or("-".to_owned(), percent), numbers(e))
                }
            };
            let _ = write!(self.csv, "{gap}{raw}");
            shown.push(text);
        }
        self.csv.push('\n');
        self.table.row(shown);
    }

    /// The CSV alone.
    pub(super) fn csv(self) -> String {
        self.csv
    }

    /// Shows the table; the CSV.
    pub(super) fn print(self) -> String {
        self.table.print();
        self.csv
    }
}

/// The columns of a row of [`squirrel_study::tracking`].
pub(super) const TRACKING: [(&str, &str); 11] = [
    ("arm", "arm"),
    ("RMSE 3-D m", "rmse_m"),
    ("horiz. m", "rmse_horizontal_m"),
    ("measured m", "rmse_measured_m"),
    ("gain %", "gain"),
    ("95 % interval", "gain_low,gain_high"),
    ("over phantom", "over_phantom_low,over_phantom_high"),
    ("over pc_plus", "over_pc_plus_low,over_pc_plus_high"),
    ("lost m", "height_lost_m"),
    ("gained m", "height_gained_m"),
    ("wings s", "wings_open_s"),
];

/// Its cells.
pub(super) fn tracking(row: &squirrel_study::tracking::Row) -> [Cell<'_>; 11] {
    [
        Cell::Text(row.arm),
        Cell::Number(row.rmse_m, 2),
        Cell::Number(row.rmse_horizontal_m, 2),
        Cell::Number(row.rmse_measured_m, 2),
        Cell::Percent(row.gain.value, 1),
        Cell::PercentInterval(Some(row.gain), 1),
        Cell::PercentInterval(row.gain_over_phantom, 1),
        Cell::PercentInterval(row.gain_over_pc_plus, 1),
        Cell::Number(row.height_lost_m, 2),
        Cell::Number(row.height_gained_m, 2),
        Cell::Number(row.wings_open_s, 2),
    ]
}
