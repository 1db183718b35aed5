//! Numbers as binary logs store them: little endian, of some type, at some place of a record.

/// One number of a record.
#[derive(Debug, PartialEq)]
pub(super) struct Column {
    pub(super) name: String,
    pub(super) offset: usize,
    pub(super) kind: Kind,
    /// From what is stored to the column's unit.
    pub(super) scale: f64,
}

impl Column {
    /// The number in a record; NaN if the record is too short for it.
    pub(super) fn number(&self, record: &[u8]) -> f64 {
        record.get(self.offset..).map_or(f64::NAN, |bytes| {
            let stored = self.kind.number(bytes);
            // Hundredths are divided: 0.01 is no binary number, 100 is, so this rounds once.
            if self.scale < 1.0 { stored / self.scale.recip() } else { stored * self.scale }
        })
    }
}

/// The type of a stored number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F16,
    F32,
    F64,
}

impl Kind {
    /// Bytes of a number.
    pub(super) fn size(self) -> usize {
        match self {
            Kind::I8 | Kind::U8 => 1,
            Kind::I16 | Kind::U16 | Kind::F16 => 2,
            Kind::I32 | Kind::U32 | Kind::F32 => 4,
            Kind::I64 | Kind::U64 | Kind::F64 => 8,
        }
    }

    /// The number at the start of `bytes`; NaN if there are too few.
    pub(super) fn number(self, bytes: &[u8]) -> f64 {
        match self {
            Kind::I8 => bytes.first_chunk().map(|&b| f64::from(i8::from_le_bytes(b))),
            Kind::U8 => bytes.first_chunk().map(|&b| f64::from(u8::from_le_bytes(b))),
            Kind::I16 => bytes.first_chunk().map(|&b| f64::from(i16::from_le_bytes(b))),
            Kind::U16 => bytes.first_chunk().map(|&b| f64::from(u16::from_le_bytes(b))),
            Kind::I32 => bytes.first_chunk().map(|&b| f64::from(i32::from_le_bytes(b))),
            Kind::U32 => bytes.first_chunk().map(|&b| f64::from(u32::from_le_bytes(b))),
            Kind::I64 => bytes.first_chunk().map(|&b| i64::from_le_bytes(b) as f64),
            Kind::U64 => bytes.first_chunk().map(|&b| u64::from_le_bytes(b) as f64),
            Kind::F16 => bytes.first_chunk().map(|&b| half(u16::from_le_bytes(b))),
            Kind::F32 => bytes.first_chunk().map(|&b| f64::from(f32::from_le_bytes(b))),
            Kind::F64 => bytes.first_chunk().map(|&b| f64::from_le_bytes(b)),
        }
        .unwrap_or(f64::NAN)
    }
}

/// An IEEE 754 half: sign, five bits of exponent, ten of the fraction.
fn half(bits: u16) -> f64 {
    let sign = if bits >> 15 == 0 { 1.0 } else { -1.0 };
    let fraction = f64::from(bits & 0x3ff) / 1024.0;
    sign * match i32::from(bits >> 10 & 0x1f) {
        0 => fraction * 2_f64.powi(-14),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        exponent => (1.0 + fraction) * 2_f64.powi(exponent - 15),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_what_the_standard_says() {
        for (bits, number) in [
            (0x0000, 0.0),
            (0x0001, 2_f64.powi(-24)),
            (0x03ff, 2_f64.powi(-14) - 2_f64.powi(-24)),
            (0x0400, 2_f64.powi(-14)),
            (0x3c00, 1.0),
            (0x3555, 1365.0 / 4096.0),
            (0xc000, -2.0),
            (0x7bff, 65504.0),
            (0x7c00, f64::INFINITY),
            (0xfc00, f64::NEG_INFINITY),
        ] {
            assert_eq!(half(bits), number, "{bits:04x}");
        }
        assert!(half(0x7e00).is_nan() && half(0x8000).is_sign_negative());
    }

    #[test]
    fn too_few_bytes_are_no_number() {
        for kind in [Kind::U8, Kind::F16, Kind::I32, Kind::U64, Kind::F64] {
            assert!(kind.number(&vec![0; kind.size() - 1]).is_nan());
            assert_eq!(kind.number(&vec![0; kind.size() + 1]), 0.0);
        }
    }
}
