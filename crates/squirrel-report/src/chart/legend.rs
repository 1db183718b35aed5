//! Legends: which mark means what, in as many rows as it takes.

use super::svg::{Anchor, Canvas, text_width};

/// Height of a legend row, px.
pub(super) const ROW: f64 = 18.0;

const KEY: f64 = 20.0;

/// The sample drawn in front of a legend name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Key {
    Line,
    Swatch,
    Dot,
}

/// A legend under construction: the rows are known before anything is drawn, because they push the
/// plot down.
#[derive(Debug)]
pub(super) struct Legend {
    left: f64,
    right: f64,
    x: f64,
    row: usize,
    entries: Vec<(Key, String, String, [f64; 2])>,
}

impl Legend {
    /// An empty legend between `left` and `right`, whose first row begins at `first` (there may be
    /// a title before).
    pub(super) fn new(left: f64, right: f64, first: f64) -> Self {
        Self { left, right, x: first, row: 0, entries: Vec::new() }
    }

    /// Adds a name unless it is empty or already there.
    pub(super) fn add(&mut self, key: Key, class: String, name: &str) {
        if name.is_empty() || self.entries.iter().any(|e| e.1 == class && e.2 == name) {
            return;
        }
        let width = KEY + 6.0 + text_width(name);
        if self.x + width > self.right && self.x > self.left {
            self.x = self.left;
            self.row += 1;
        }
        self.entries.push((key, class, name.to_owned(), [self.x, self.row as f64 * ROW]));
        self.x += width + 12.0;
    }

    /// Whether nothing was added.
    pub(super) fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Height of all rows, px.
    pub(super) fn height(&self) -> f64 {
        (self.row + 1) as f64 * ROW
    }

    /// Draws the legend, the text of its first row on the base line `y`.
    pub(super) fn draw(&self, canvas: &mut Canvas, y: f64) {
        for (key, class, name, [x, row]) in &self.entries {
            let y = y + row;
            match key {
                Key::Line => {
                    canvas.line(&format!("line {class}"), [*x, y - 4.0], [x + KEY, y - 4.0]);
                }
                Key::Swatch => canvas.rect(&format!("fill {class}"), *x, y - 10.0, KEY, 11.0),
                Key::Dot => canvas.circle(&format!("dot {class}"), [x + KEY - 6.0, y - 4.0], 4.0),
            }
            canvas.text("legend", [x + KEY + 6.0, y], Anchor::Start, name);
        }
    }
}
