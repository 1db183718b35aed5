//! Colours by meaning. A drawing names a class; the style sheet of the page holds the colour.

use super::axis::Axis;
use super::scale::Scale;
use super::svg::{Anchor, Canvas, text_width};

/// Distinct series colours; later series repeat them with another dash pattern.
const SERIES_COLOURS: usize = 8;

/// Steps of the colour map for values.
pub const BINS: usize = 12;

/// What a mark stands for, which decides its colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ink {
    /// The n-th series, from 0: the same number is the same colour in every chart of a page.
    Series(usize),
    /// What should have happened.
    Reference,
    /// A bound that should not be crossed.
    Limit,
    /// Something quiet in the background.
    Muted,
    /// A state that is on.
    Highlight,
}

impl Ink {
    /// The class list for a stroke or fill of this ink.
    pub(crate) fn class(self) -> String {
        match self {
            Self::Series(i) => match i / SERIES_COLOURS {
                0 => format!("s{i}"),
                round => format!("s{} dash{}", i % SERIES_COLOURS, 1 + (round - 1) % 2),
            },
            Self::Reference => "ref".to_owned(),
            Self::Limit => "limit".to_owned(),
            Self::Muted => "muted".to_owned(),
            Self::Highlight => "high".to_owned(),
        }
    }
}

/// Which colours a bar shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ramp {
    /// From colour to colour, for lines.
    Track,
    /// From nothing to one colour, for areas.
    Heat,
}

/// What colour measures in a chart: a label, a unit and the range shared by all charts that are
/// compared.
#[derive(Debug, Clone, PartialEq)]
pub struct Values {
    title: String,
    scale: Scale,
}

impl Values {
    /// The colour scale of an axis for this data; undrawable data is ignored.
    pub fn new(axis: &Axis, data: impl Iterator<Item = f64>) -> Self {
        Self { title: axis.title(), scale: axis.scale(data, 4) }
    }

    /// Step of the colour map of a value, 0 to [`BINS`] - 1; `None` for NaN.
    pub(super) fn bin(&self, value: f64) -> Option<usize> {
        let place = self.scale.fraction(value) * BINS as f64;
        (!place.is_nan()).then(|| (place.max(0.0) as usize).min(BINS - 1))
    }

    /// Draws the colour bar, its right end at `right`: title left of it, numbers below.
    pub(super) fn bar(&self, canvas: &mut Canvas, ramp: Ramp, right: f64, y: f64, width: f64) {
        let left = right - width;
        let prefix = match ramp {
            Ramp::Track => "v",
            Ramp::Heat => "h",
        };
        for bin in 0..BINS {
            let step = width / BINS as f64;
            // Neighbours overlap by half a pixel: no hairline between them when the page is scaled.
            // Where colours are transparent, an overlap would show.
            let overlap = if bin + 1 < BINS && ramp == Ramp::Track { 0.5 } else { 0.0 };
            canvas.rect(
                &format!("fill {prefix}{bin}"),
                left + step * bin as f64,
                y,
                step + overlap,
                9.0,
            );
        }
        for &tick in self.scale.ticks() {
            let x = left + width * self.scale.fraction(tick);
            canvas.text("tick", [x, y + 24.0], Anchor::Middle, &self.scale.label(tick));
        }
        canvas.text("axis", [left - 10.0, y + 9.0], Anchor::End, &self.title);
    }

    /// Pixels that [`Values::bar`] needs left of the bar itself.
    pub(super) fn bar_title_width(&self) -> f64 {
        text_width(&self.title) + 10.0
    }
}
