//! Scales: from any two numbers to an axis with ticks at 1, 2 or 5 times a power of ten.
//!
//! A diverged flight may hold 1e300 or a constant: a scale always has a positive, finite span and
//! few ticks.

/// Magnitude above which a number is not drawn, as if it were NaN: spans and products stay finite.
pub const LARGEST: f64 = 1e100;

/// Whether a number can be drawn: finite and not above [`LARGEST`].
pub fn drawable(value: f64) -> bool {
    value.abs() <= LARGEST
}

/// The range of an axis and its ticks, in the unit of the data.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    lo: f64,
    hi: f64,
    ticks: Vec<f64>,
    /// The step is `mantissa * 10^exponent`.
    mantissa: f64,
    exponent: i32,
}

impl Scale {
    /// A scale that covers `lo` to `hi` and begins and ends at a tick, with about `intervals` tick
    /// intervals.
    ///
    /// Equal, swapped and undrawable ends are accepted: the scale is then widened, swapped or 0 to
    /// 1.
    pub fn nice(lo: f64, hi: f64, intervals: usize) -> Self {
        let (lo, hi) = sane(lo, hi);
        let mut scale = Self::with_step(lo, hi, intervals);
        let (first, last) = (scale.below(lo), scale.above(hi));
        scale.fill(first, last);
        (scale.lo, scale.hi) = (scale.tick(first), scale.tick(last));
        scale
    }

    /// A scale from `lo` to `hi` exactly, with ticks inside it.
    ///
    /// Takes the same liberties as [`Scale::nice`] when the ends are no range.
    pub fn exact(lo: f64, hi: f64, intervals: usize) -> Self {
        let (lo, hi) = sane(lo, hi);
        let mut scale = Self::with_step(lo, hi, intervals);
        let (first, last) = (-scale.below(-lo), -scale.above(-hi));
        scale.fill(first, last);
        scale
    }

    /// Low end.
    pub fn lo(&self) -> f64 {
        self.lo
    }

    /// High end, above the low end.
    pub fn hi(&self) -> f64 {
        self.hi
    }

    /// Distance between two ticks.
    pub fn step(&self) -> f64 {
        scaled(self.mantissa, self.exponent)
    }

    /// The ticks, rising, inside the range.
    pub fn ticks(&self) -> &[f64] {
        &self.ticks
    }

    /// Where a value lies: 0 at the low end, 1 at the high end.
    pub fn fraction(&self, value: f64) -> f64 {
        (value - self.lo) / (self.hi - self.lo)
    }

    /// The text of a tick, with as many digits as the step needs.
    pub fn label(&self, tick: f64) -> String {
        let size = self.lo.abs().max(self.hi.abs());
        let text = if tick == 0.0 {
            "0".to_owned()
        } else if size < 1e6 && self.exponent >= -4 {
            format!("{tick:.*}", (-self.exponent).max(0) as usize)
        } else {
            let digits = tick.abs().log10().floor() as i32 - self.exponent;
            format!("{tick:.*e}", digits.clamp(0, 9) as usize)
        };
        text.replace('-', "\u{2212}")
    }

    fn with_step(lo: f64, hi: f64, intervals: usize) -> Self {
        let raw = (hi - lo) / intervals.max(1) as f64;
        let mut exponent = raw.log10().floor() as i32;
        let ratio = raw / scaled(1.0, exponent);
        // The margin keeps 0 to 10 in five intervals at a step of 2, whatever the last bit of the
        // ratio says.
        let mantissa =
            [1.0, 2.0, 5.0].into_iter().find(|m| ratio <= m * (1.0 + 1e-9)).unwrap_or_else(|| {
                exponent += 1;
                1.0
            });
        Self { lo, hi, ticks: Vec::new(), mantissa, exponent }
    }

    /// Number of the last tick not above `value`; a value within rounding of a tick is that tick.
    fn below(&self, value: f64) -> i64 {
        (value / self.step() + 1e-6).floor() as i64
    }

    /// Number of the first tick not below `value`.
    fn above(&self, value: f64) -> i64 {
        -self.below(-value)
    }

    /// Tick number `i`; one rounding only, so that 3 steps of 0.1 are the number 0.3.
    fn tick(&self, i: i64) -> f64 {
        scaled(i as f64 * self.mantissa, self.exponent)
    }

    fn fill(&mut self, first: i64, last: i64) {
        self.ticks = (first..=last).map(|i| self.tick(i)).collect();
    }
}

/// `mantissa * 10^exponent`; divides for negative exponents because a power of ten is exact, its
/// inverse is not.
fn scaled(mantissa: f64, exponent: i32) -> f64 {
    if exponent < 0 { mantissa / 10f64.powi(-exponent) } else { mantissa * 10f64.powi(exponent) }
}

/// A rising range with a span that arithmetic can resolve.
fn sane(lo: f64, hi: f64) -> (f64, f64) {
    let clamp =
        |v: f64, otherwise: f64| if v.is_nan() { otherwise } else { v.clamp(-LARGEST, LARGEST) };
    let (a, b) = (clamp(lo, 0.0), clamp(hi, 1.0));
    let (lo, hi) = (a.min(b), a.max(b));
    let size = lo.abs().max(hi.abs());
    if hi - lo > (1e-9 * size).max(1e-12) {
        return (lo, hi);
    }
    let middle = f64::midpoint(lo, hi);
    let half = (1e-3 * size).max(0.5);
    (middle - half, middle + half)
}
