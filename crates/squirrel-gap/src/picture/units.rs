//! Units of keys, and numbers as they are read aloud: 59 ms, 12 %, 4.2 mm.

use crate::number::significant;

/// Ends of keys that are units, the longest first, and how they are read.
const UNITS: [(&str, &str); 19] = [
    ("_n_m_s2_per_rad2", "N m s\u{b2}/rad\u{b2}"),
    ("_n_m_s_per_rad", "N m s/rad"),
    ("_n_m_s_per_m", "N m s/m"),
    ("_n_s_per_m", "N s/m"),
    ("_s2_per_m2", "s\u{b2}/m\u{b2}"),
    ("_rad_per_s", "rad/s"),
    ("_s_per_m", "s/m"),
    ("_per_s", "1/s"),
    ("_kg_m2", "kg m\u{b2}"),
    ("_rad_s", "rad/s"),
    ("_m_s3", "m/s\u{b3}"),
    ("_m_s2", "m/s\u{b2}"),
    ("_m_s", "m/s"),
    ("_rad", "rad"),
    ("_ppm", "ppm"),
    ("_kg", "kg"),
    ("_m2", "m\u{b2}"),
    ("_m", "m"),
    ("_s", "s"),
];

/// The unit that a key ends in; empty for a plain number.
pub(super) fn unit(key: &str) -> &'static str {
    let end = |(end, unit): &(&str, &'static str)| key.ends_with(end).then_some(*unit);
    UNITS.iter().find_map(end).unwrap_or_default()
}

/// A key without its unit.
pub(super) fn without_unit(key: &str) -> &str {
    UNITS.iter().find_map(|(end, _)| key.strip_suffix(end)).unwrap_or(key)
}

/// Below this, seconds, metres and kilograms are read in thousandths.
const THOUSANDTHS: f64 = 0.1;

/// How a number of the vehicle file is read: its name, its unit, and by how much the number is
/// multiplied for that unit.
///
/// * `key` - in the vehicle file
/// * `size` - about as large as the number is, in the unit of the key
pub(super) fn read_as(key: &str, size: f64) -> (String, &'static str, f64) {
    let name = match key {
        "cg_x_m" => "forward",
        "cg_y_m" => "to the right",
        "cg_z_m" => "down",
        _ => without_unit(key),
    };
    if let Some(name) = name.strip_suffix("_fraction") {
        return (name.replace('_', " "), "%", 100.0);
    }
    let small = size.abs() < THOUSANDTHS;
    let (unit, times) = match unit(key) {
        "rad" => ("\u{b0}", 180.0 / std::f64::consts::PI),
        "s" if small => ("ms", 1e3),
        "m" if small => ("mm", 1e3),
        "kg" if small => ("g", 1e3),
        unit => (unit, 1.0),
    };
    (name.replace('_', " "), unit, times)
}

/// A number with three significant digits, a dash for one that is unknown.
pub(super) fn three(value: f64) -> String {
    if value.is_finite() {
        grouped(&significant(value, 3).replace('-', "\u{2212}"))
    } else {
        "\u{2013}".to_owned()
    }
}

/// A number with narrow spaces between thousands, from five digits on.
pub(super) fn grouped(number: &str) -> String {
    let digits = number.chars().take_while(char::is_ascii_digit).count();
    if digits < 5 || digits != number.len() {
        return number.to_owned();
    }
    let mut text = String::new();
    for (i, digit) in number.chars().enumerate() {
        if i > 0 && (digits - i) % 3 == 0 {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

/// A number with its unit; degrees and plain numbers stand close.
pub(super) fn with_unit(number: &str, unit: &str) -> String {
    let space = if unit.is_empty() || unit == "\u{b0}" { "" } else { " " };
    format!("{number}{space}{unit}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_in_a_pilots_units() {
        let read = |key: &str, value: f64| {
            let (name, unit, times) = read_as(key, value);
            format!("{name} {}", with_unit(&three(times * value), unit))
        };
        assert_eq!(read("thrust_loss_fraction", 0.243), "thrust loss 24.3 %");
        assert_eq!(read("extra_time_constant_s", 0.0594), "extra time constant 59.4 ms");
        assert_eq!(read("latency_s", 0.25), "latency 0.250 s");
        assert_eq!(read("cg_x_m", -0.0042), "forward \u{2212}4.20 mm");
        assert_eq!(read("bias_rad", 0.1), "bias 5.73\u{b0}");
        assert_eq!(read("wind_north_m_s", 0.05), "wind north 0.0500 m/s");
        assert_eq!(read("voltage_exponent", 1.08), "voltage exponent 1.08");
        assert_eq!(three(18_507.9), "18\u{202f}508");
        assert_eq!(three(f64::NAN), "\u{2013}");
    }
}
