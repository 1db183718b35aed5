//! Numbers as people read them.

/// A number with so many significant digits: plain where people read it so, with an exponent where
/// it is tiny or huge.
pub fn significant(value: f64, digits: u8) -> String {
    let size = value.abs();
    if size == 0.0 {
        "0".to_owned()
    } else if (1e-4..1e6).contains(&size) {
        let places = (i32::from(digits) - 1 - size.log10().floor() as i32).max(0) as usize;
        format!("{value:.places$}")
    } else {
        format!("{value:.*e}", usize::from(digits.max(1)) - 1)
    }
}
