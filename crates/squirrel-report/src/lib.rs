//! Reports that a flight engineer looks at: one HTML file, no network, the same bytes for the same
//! flights.
//!
//! [`chart`] draws inline SVG, [`page`] puts drawings, tables and captions on a page, [`flight`] is
//! the report of one manoeuvre flown by several controller arms, [`view`] shows flights in three
//! dimensions, [`picture`] sets drawings side by side in one SVG file. Drawings carry classes, not
//! colours: the style sheet of the page holds the colours once, for light, dark and paper.
//!
//! ```
//! use squirrel_report::chart::{Axis, Ink, LineChart, Series};
//! use squirrel_report::picture::picture;
//!
//! let mut chart = LineChart::new("tilt", Axis::new("time", "s"), Axis::new("tilt", "deg"));
//! chart.series.push(Series::line("pc", Ink::Series(0), vec![0.0, 0.1, 0.2], vec![0.0, 12.0, 29.0]));
//! let file = picture("A turn", &["Tilt of one controller."], &[chart.svg()]);
//! assert!(file.starts_with("<svg") && file.contains("A turn"));
//! ```

pub mod chart;
pub mod flight;
pub mod page;
pub mod picture;
pub mod view;
