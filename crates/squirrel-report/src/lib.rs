//! Reports that a flight engineer looks at: one HTML file, no network, the same bytes for the same
//! flights.
//!
//! [`chart`] draws inline SVG, [`page`] puts drawings, tables and captions on a page, [`flight`] is
//! the report of one manoeuvre flown by several controller arms, [`view`] shows flights in three
//! dimensions, [`picture`] sets drawings side by side in one SVG file. Drawings carry classes, not
//! colours: the style sheet of the page holds the colours once, for light, dark and paper.

pub mod chart;
pub mod flight;
pub mod page;
pub mod picture;
pub mod view;
