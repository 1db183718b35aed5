//! A logged flight as the gap workflow sees it: channels as series, a uniform grid, and what was
//! flown where.

mod density;
pub(crate) mod filter;
mod ground;
pub(crate) mod heading;
pub(crate) mod inertial;
pub(crate) mod recording;
pub(crate) mod series;
pub(crate) mod smoother;
mod wings;
