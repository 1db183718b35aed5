//! Pages of the encoding `BYTE_STREAM_SPLIT`: its decoder takes for granted that a page has the bytes
//! of as many values as its levels say.

use parquet::basic::Encoding;
use parquet::column::page::Page;
use parquet::errors::ParquetError;

/// Whether a page has the bytes of its values, if it is of this encoding.
///
/// * `value_bytes` - of one value
/// * `level` - the definition level of a value that is there
///
/// # Errors
/// What does not fit.
pub(super) fn check(page: &Page, value_bytes: usize, level: i16) -> Result<(), ParquetError> {
    let (count, levels, values) = match page {
        Page::DataPage { buf, num_values, encoding, def_level_encoding, .. }
            if *encoding == Encoding::BYTE_STREAM_SPLIT =>
        {
            let (levels, values) = if level == 0 {
                (&buf[..0], &buf[..])
            } else if *def_level_encoding == Encoding::RLE {
                let (length, rest) = buf.split_first_chunk().ok_or_else(short)?;
                rest.split_at_checked(u32::from_le_bytes(*length) as usize).ok_or_else(short)?
            } else {
                return Err(ParquetError::General(format!(
                    "a page has levels of encoding {def_level_encoding} beside BYTE_STREAM_SPLIT"
                )));
            };
            (*num_values, levels, values)
        }
        Page::DataPageV2 {
            buf,
            num_values,
            encoding,
            def_levels_byte_len,
            rep_levels_byte_len,
            ..
        } if *encoding == Encoding::BYTE_STREAM_SPLIT => {
            let behind = buf.get(*rep_levels_byte_len as usize..).ok_or_else(short)?;
            let (levels, values) =
                behind.split_at_checked(*def_levels_byte_len as usize).ok_or_else(short)?;
            (*num_values, levels, values)
        }
        _ => return Ok(()),
    };
    let count = count as usize;
    let there = if level == 0 { Some(count) } else { there(levels, count, level) };
    if there.is_some_and(|there| there <= values.len() / value_bytes.max(1)) {
        Ok(())
    } else {
        Err(short())
    }
}

fn short() -> ParquetError {
    ParquetError::General("a page is shorter than its values".to_owned())
}

/// How many of so many levels are `level`: runs and groups of eight, as Parquet packs small numbers.
fn there(mut levels: &[u8], count: usize, level: i16) -> Option<usize> {
    let bits = 16 - level.leading_zeros();
    let (mut seen, mut there) = (0, 0);
    while seen < count {
        let mut header = 0_usize;
        for shift in (0..).step_by(7) {
            let (byte, rest) = levels.split_first()?;
            levels = rest;
            header |= usize::from(byte & 0x7F).checked_shl(shift).filter(|_| shift < 35)?;
            if byte & 0x80 == 0 {
                break;
            }
        }
        let left = count - seen;
        if header & 1 == 0 {
            let (value, rest) = levels.split_at_checked(bits.div_ceil(8) as usize)?;
            levels = rest;
            let value = value.iter().rev().fold(0, |sum, byte| sum << 8 | i32::from(*byte));
            let run = (header >> 1).min(left);
            there += if value == i32::from(level) { run } else { 0 };
            // A run of nothing leads nowhere.
            seen += if run == 0 { return None } else { run };
        } else {
            let bytes = (header >> 1).checked_mul(bits as usize)?;
            let (packed, rest) = levels.split_at(bytes.min(levels.len()));
            levels = rest;
            let group = (packed.len() * 8 / bits as usize).min(left);
            for at in (0..group).map(|i| i * bits as usize) {
                let bit = |k: usize| i32::from(packed[(at + k) / 8] >> ((at + k) % 8) & 1) << k;
                there += usize::from((0..bits as usize).map(bit).sum::<i32>() == i32::from(level));
            }
            seen += if group == 0 { return None } else { group };
        }
    }
    Some(there)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_counted_in_runs_and_groups() {
        // Five times 1, three times 0.
        let runs = [5 << 1, 1, 3 << 1, 0];
        assert_eq!(there(&runs, 8, 1), Some(5));
        assert_eq!(there(&runs, 6, 1), Some(5));
        assert_eq!(there(&runs, 9, 1), None, "fewer than the page has");
        // A group of eight, of which a page has six.
        let group = [1 << 1 | 1, 0b1110_0101];
        assert_eq!((there(&group, 8, 1), there(&group, 6, 1)), (Some(5), Some(3)));
        // Levels of two bits: 2, 1, 2, 0, and four more.
        let wide = [1 << 1 | 1, 0b0010_0110, 0b1010_1010];
        assert_eq!(there(&wide, 8, 2), Some(6));
        // A header of two bytes: 200 times 1.
        assert_eq!(there(&[0x90, 0x03, 1], 200, 1), Some(200));
        for bad in [&[][..], &[0, 0], &[1], &[0xFF; 9], &[8]] {
            assert_eq!(there(bad, 3, 1), None, "{bad:?}");
        }
    }
}
