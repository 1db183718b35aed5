//! A small chart toolkit: numbers in, inline SVG out.
//!
//! [`LineChart`] draws curves over a shared axis, [`TrackChart`] a track whose colour is a value,
//! [`Scene`] the same track in three dimensions, [`RowChart`] bars, intervals and dots beside
//! names, [`HeatMap`] numbers as colour over time, [`Matrix`] numbers between names, [`Wheel`]
//! closed lines over spokes. NaN breaks a line. Curves are thinned to what the pixels can show, so
//! a long flight does not make a large file.
//!
//! ```
//! use squirrel_report::chart::{Axis, Ink, LineChart, Range, Series};
//!
//! let mut chart = LineChart::new("tilt", Axis::new("time", "s"), Axis::new("tilt", "deg"));
//! chart.y.range = Range::Including(0.0, 30.0);
//! chart.series.push(Series::line("twcc", Ink::Series(0), vec![0.0, 0.1, 0.2], vec![0.0, 12.0, 29.0]));
//! assert!(chart.svg().as_str().starts_with("<svg"));
//! ```
mod axis;
mod colour;
mod heat;
mod legend;
mod line;
mod plot;
mod rows;
mod scale;
mod scene;
mod svg;
mod thin;
mod track;
mod wheel;

pub(super) use axis::extent;
pub use axis::{Axis, Range};
pub use colour::{BINS, Ink, Values};
pub use heat::{HeatGroup, HeatMap, Level, Matrix, Strip};
pub use line::{Lane, Limit, LineChart, Series, Span};
pub use rows::{ChartRow, Dot, Extent, RowChart};
pub use scale::{LARGEST, Scale, drawable};
pub use scene::{Cylinder, Scene, SceneTrack};
pub use svg::{Svg, escape};
pub use track::{Note, Obstacle, Track, TrackChart};
pub use wheel::{Wheel, WheelLine};
