//! Distance to the nearest of many vertical cylinders, cheap enough for every step of a flight
//! through a forest.
//!
//! A uniform grid over the plan view. Each cell lists the cylinders whose square outline overlaps
//! it; the lists lie row by row in one array, so the cells of a row are one slice. The cell edge is
//! at least a cylinder's diameter, so that no cylinder is listed more than four times, and large
//! enough that there are at most about three cells a cylinder.

use super::parameters::Cylinder;
use nalgebra::Vector3;

#[derive(Debug, Clone)]
pub(super) struct Grid {
    corner_m: [f64; 2],
    cells_per_m: f64,
    /// Rows (north) and columns (east).
    cells: [usize; 2],
    /// Where each cell's list starts in `listed`, and the end of the last.
    starts: Vec<u32>,
    listed: Vec<Cylinder>,
}

impl Grid {
    pub(super) fn new(cylinders: &[Cylinder]) -> Self {
        let (mut low, mut high, mut diameter) =
            ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2], 0.0_f64);
        for c in cylinders {
            for (axis, centre) in [c.north_m, c.east_m].into_iter().enumerate() {
                low[axis] = low[axis].min(centre - c.radius_m);
                high[axis] = high[axis].max(centre + c.radius_m);
            }
            diameter = diameter.max(2.0 * c.radius_m);
        }
        if cylinders.is_empty() {
            return Self {
                corner_m: [0.0; 2],
                cells_per_m: 1.0,
                cells: [0; 2],
                starts: vec![0],
                listed: Vec::new(),
            };
        }
        let extent = [high[0] - low[0], high[1] - low[1]];
        let count = cylinders.len() as f64;
        let edge = (extent[0] * extent[1] / count)
            .sqrt()
            .max(extent[0].max(extent[1]) / count)
            .max(diameter);
        let cells = extent.map(|e| (e / edge) as usize + 1);
        let mut grid = Self {
            corner_m: low,
            cells_per_m: 1.0 / edge,
            cells,
            starts: vec![0; cells[0] * cells[1] + 1],
            listed: Vec::new(),
        };
        let overlapped = |grid: &Self, c: &Cylinder| {
            let rows = grid.span(0, c.north_m, c.radius_m);
            let columns = grid.span(1, c.east_m, c.radius_m);
            rows.flat_map(move |row| columns.clone().map(move |column| row * cells[1] + column))
        };
        // Counting sort: lengths, then ends, which filling from the back turns into starts.
        for c in cylinders {
            for cell in overlapped(&grid, c) {
                grid.starts[cell] += 1;
            }
        }
        let mut end = 0;
        for start in &mut grid.starts {
            end += *start;
            *start = end;
        }
        grid.listed = vec![cylinders[0]; end as usize];
        for c in cylinders.iter().rev() {
            for cell in overlapped(&grid, c) {
                grid.starts[cell] -= 1;
                grid.listed[grid.starts[cell] as usize] = *c;
            }
        }
        grid
    }

    /// The rows (axis 0) or columns (axis 1) that `centre - reach ..= centre + reach` overlaps. A
    /// cast to an integer saturates, and one formula for cylinders and queries rounds both alike,
    /// so that no overlap is missed.
    fn span(&self, axis: usize, centre: f64, reach: f64) -> core::ops::Range<usize> {
        let cell = |x: f64| ((x - self.corner_m[axis]) * self.cells_per_m) as usize;
        let end = cell(centre + reach).saturating_add(1).min(self.cells[axis]);
        cell(centre - reach).min(end)..end
    }

    /// Distance from a point to the nearest cylinder, m; 0 inside one; infinite if none is within
    /// `reach_m`.
    pub(super) fn distance_m(&self, point_ned: Vector3<f64>, reach_m: f64) -> f64 {
        let columns = self.span(1, point_ned.y, reach_m);
        let mut nearest = f64::INFINITY;
        if columns.is_empty() {
            return nearest;
        }
        for row in self.span(0, point_ned.x, reach_m) {
            let first = row * self.cells[1];
            let list = self.starts[first + columns.start] as usize
                ..self.starts[first + columns.end] as usize;
            for c in &self.listed[list] {
                nearest = nearest.min(distance_m(c, point_ned));
            }
        }
        if nearest <= reach_m { nearest } else { f64::INFINITY }
    }
}

/// Distance from a point to a cylinder that stands on the plane down = 0, m; 0 inside.
fn distance_m(c: &Cylinder, point_ned: Vector3<f64>) -> f64 {
    let (north, east) = (point_ned.x - c.north_m, point_ned.y - c.east_m);
    let beside = ((north * north + east * east).sqrt() - c.radius_m).max(0.0);
    let beyond = (-c.height_m - point_ned.z).max(point_ned.z).max(0.0);
    (beside * beside + beyond * beyond).sqrt()
}
