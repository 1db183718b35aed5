//! The paper's forest (section V.C): trunks at regular intervals, drawn from the scenario's seed,
//! and a way to fly through them.
//!
//! Rows lie one after the other northwards, trunks of a row one after the other eastwards, each
//! interval drawn anew. The flight begins in the middle, where there is a gap, and ends with the
//! first contact or after its way.

use super::OBSTACLE_RADIUS_MIN_M;
use crate::setting::SettingError;
use squirrel_core::guidance::mission::scramble;

use serde::{Deserialize, Serialize};

/// No trunk is nearer to the start, m: it is not on the first metres that a controller shows what
/// it can.
const GAP_M: f64 = 6.0;

/// Trunks around the start of a flight that is over when it has touched one, or come through.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ForestTable {
    /// Edge of the square with trunks.
    pub size_m: f64,
    /// Shortest and longest interval between trunks.
    pub spacing_m: [f64; 2],
    /// Radius of a trunk.
    pub radius_m: f64,
    /// Length of the horizontal path after which a flight has come through.
    pub path_m: f64,
}

impl ForestTable {
    /// That of the paper, but 400 m in every direction: in a square of 400 m some flights come to
    /// its edge, and are through without having met what they should.
    pub(super) fn built_in() -> Self {
        Self { size_m: 820.0, spacing_m: [10.5, 13.5], radius_m: 0.5, path_m: 400.0 }
    }

    pub(super) fn check(&self) -> Result<(), SettingError> {
        let [low, high] = self.spacing_m;
        for (field, x, most) in [("size_m", self.size_m, 1e3), ("path_m", self.path_m, 1e5)] {
            if !(x > 0.0 && x <= most) {
                return Err(SettingError::value(field, x, format!("must be > 0 and <= {most}")));
            }
        }
        let (radius_m, least, most) = (self.radius_m, OBSTACLE_RADIUS_MIN_M, 0.25 * low);
        if !(least..=most).contains(&radius_m) {
            let must = format!("must be {least} to {most}");
            return Err(SettingError::value("radius_m", radius_m, must));
        }
        if !(low >= 1.0 && low <= high && high.is_finite()) {
            let value = format!("[{low}, {high}]");
            return Err(SettingError::value(
                "spacing_m",
                value,
                "must be 1 or more, the shortest first",
            ));
        }
        Ok(())
    }

    /// The trunks: north, east, radius, m.
    pub(super) fn trunks(&self, seed: u64) -> Vec<[f64; 3]> {
        let mut state = scramble((seed ^ (seed >> 32)) as u32 ^ 0xF0_4E57);
        let mut interval = |share: f64| {
            state = scramble(state.wrapping_add(0x9E37_79B9));
            let [low, high] = self.spacing_m;
            share * (low + (high - low) * f64::from(state) / f64::from(u32::MAX))
        };
        let edge = 0.5 * self.size_m;
        let mut trunks = Vec::new();
        // A first interval is cut short anywhere, so that the start does not know where rows are.
        let mut north = -edge + interval(0.5);
        while north < edge {
            let mut east = -edge + interval(0.5) + 0.5 * (interval(1.0) - interval(1.0));
            while east < edge {
                if north.hypot(east) > GAP_M {
                    trunks.push([north, east, self.radius_m]);
                }
                east += interval(1.0);
            }
            north += interval(1.0);
        }
        trunks
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A trunk on 144 m^2, no two nearer than the shortest interval in a row, none at the start,
    /// others for another seed.
    #[test]
    fn trunks_stand_as_in_the_paper() {
        let table = ForestTable::built_in();
        table.check().unwrap();
        let trunks = table.trunks(7);
        assert!((4400..4950).contains(&trunks.len()), "{}", trunks.len());
        for pair in trunks.windows(2) {
            let [a, b] = [pair[0], pair[1]];
            let apart = b[1] - a[1];
            assert!(a[0] != b[0] || (10.5..=27.0).contains(&apart), "{a:?} {b:?}");
        }
        assert!(trunks.iter().all(|[north, east, _]| north.hypot(*east) > GAP_M));
        assert!(trunks.iter().all(|[north, east, _]| north.abs() <= 410.0 && east.abs() <= 410.0));
        assert_ne!(trunks, table.trunks(8));
        assert_eq!(trunks, table.trunks(7));
    }

    #[test]
    fn a_number_that_cannot_be_is_named() {
        let bad = ForestTable { spacing_m: [13.5, 10.5], ..ForestTable::built_in() };
        assert!(bad.check().unwrap_err().to_string().starts_with("spacing_m = [13.5, 10.5]"));
        let bad = ForestTable { path_m: f64::NAN, ..ForestTable::built_in() };
        assert!(bad.check().unwrap_err().to_string().starts_with("path_m = NaN"));
    }
}
