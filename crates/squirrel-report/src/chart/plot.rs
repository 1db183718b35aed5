//! The plot area: two scales over a rectangle of pixels, with grid and tick labels.

use super::scale::{Scale, drawable};
use super::svg::{Anchor, Canvas};

/// Two scales and the rectangle that they span, y down.
#[derive(Debug)]
pub(super) struct Plot {
    pub(super) x: Scale,
    pub(super) y: Scale,
    pub(super) left: f64,
    pub(super) right: f64,
    pub(super) top: f64,
    pub(super) bottom: f64,
}

impl Plot {
    pub(super) fn x_px(&self, x: f64) -> f64 {
        self.left + (self.right - self.left) * self.x.fraction(x)
    }

    pub(super) fn y_px(&self, y: f64) -> f64 {
        self.bottom - (self.bottom - self.top) * self.y.fraction(y)
    }

    /// A point in pixels, NaN when it cannot be drawn.
    pub(super) fn point(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        if drawable(x) && drawable(y) { [self.x_px(x), self.y_px(y)] } else { [f64::NAN; 2] }
    }

    /// Grid lines, tick labels left of the plot and below `labels_top`, which lies under the plot
    /// if lanes are between.
    pub(super) fn grid(&self, canvas: &mut Canvas, labels_top: f64) {
        for &tick in self.y.ticks() {
            let y = self.y_px(tick);
            canvas.line(if tick == 0.0 { "zero" } else { "grid" }, [self.left, y], [self.right, y]);
            canvas.text("tick", [self.left - 7.0, y + 4.0], Anchor::End, &self.y.label(tick));
        }
        for &tick in self.x.ticks() {
            let x = self.x_px(tick);
            canvas.line("grid", [x, self.top], [x, labels_top]);
            canvas.text("tick", [x, labels_top + 16.0], Anchor::Middle, &self.x.label(tick));
        }
    }
}
