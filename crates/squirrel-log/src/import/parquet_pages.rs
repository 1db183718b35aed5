//! The pages of a column chunk of a Parquet file, and what its decoders take for granted of them.

use parquet::basic::{Encoding, Type};
use parquet::column::page::{Page, PageMetadata, PageReader};
use parquet::errors::ParquetError;
use parquet::schema::types::ColumnDescriptor;

/// Bytes of a length before the levels of a page of version 1.
const LENGTH_BYTES: usize = 4;

/// A page that needs a dictionary comes only after one; a page that is split by bytes has as many
/// as its values need; its levels lie inside it.
pub(super) struct Pages {
    inner: Box<dyn PageReader>,
    has_dictionary: bool,
    /// Level of a value that is there; 0 where none may be missing.
    level: i16,
    /// Bytes of a value.
    size: usize,
}

impl Pages {
    pub(super) fn new(inner: Box<dyn PageReader>, column: &ColumnDescriptor) -> Self {
        let size = if matches!(column.physical_type(), Type::FLOAT | Type::INT32) { 4 } else { 8 };
        Self { inner, has_dictionary: false, level: column.max_def_level(), size }
    }

    fn check(&mut self, page: &Page) -> Result<(), &'static str> {
        let encoding = page.encoding();
        self.has_dictionary |= page.is_dictionary_page();
        let needs = matches!(encoding, Encoding::PLAIN_DICTIONARY | Encoding::RLE_DICTIONARY);
        if needs && !self.has_dictionary {
            return Err("a page refers to a dictionary that is not there");
        }
        if encoding != Encoding::BYTE_STREAM_SPLIT {
            return Ok(());
        }
        let (levels, values) = self.parts(page).ok_or("the levels of a page lie outside of it")?;
        let all = page.num_values() as usize;
        let present = if self.level == 0 {
            Some(all)
        } else {
            count(levels, self.level.cast_unsigned(), all)
        };
        let bytes = present.and_then(|present| present.checked_mul(self.size));
        if bytes == Some(values.len()) {
            Ok(())
        } else {
            Err("a page has other bytes than its values need")
        }
    }

    /// The levels and the values of a data page.
    fn parts<'p>(&self, page: &'p Page) -> Option<(&'p [u8], &'p [u8])> {
        match page {
            Page::DataPage { buf, def_level_encoding, .. } => {
                if self.level == 0 {
                    return Some((&[], buf));
                }
                let rest = buf.get(LENGTH_BYTES..)?;
                let length = u32::from_le_bytes(*buf.first_chunk()?) as usize;
                rest.split_at_checked(length).filter(|_| *def_level_encoding == Encoding::RLE)
            }
            Page::DataPageV2 { buf, def_levels_byte_len, rep_levels_byte_len, .. } => {
                let rest = buf.get(*rep_levels_byte_len as usize..)?;
                rest.split_at_checked(*def_levels_byte_len as usize)
            }
            Page::DictionaryPage { .. } => None,
        }
    }
}

/// How many of the first `all` levels are `level`: runs of one level, and groups of eight packed
/// ones, as Parquet mixes them. `None` if there are fewer.
fn count(mut levels: &[u8], level: u16, all: usize) -> Option<usize> {
    let bits = (u16::BITS - level.leading_zeros()) as usize;
    let bytes = bits.div_ceil(8);
    let (mut seen, mut present) = (0, 0);
    while seen < all {
        let head = varint(&mut levels)?;
        let left = all - seen;
        if head & 1 == 0 {
            let (value, rest) = levels.split_at_checked(bytes)?;
            let value = value.iter().rev().fold(0, |value, &byte| value << 8 | u16::from(byte));
            let run = usize::try_from(head >> 1).ok()?.min(left);
            if run == 0 {
                return None;
            }
            (seen, levels) = (seen + run, rest);
            present += if value == level { run } else { 0 };
        } else {
            let groups = usize::try_from(head >> 1).ok()?;
            let (packed, rest) = levels.split_at_checked(groups.checked_mul(bits)?)?;
            let count = (groups * 8).min(left);
            if count == 0 {
                return None;
            }
            let bit = |at: usize| u16::from(packed[at / 8] >> (at % 8) & 1);
            let value = |i: usize| (0..bits).fold(0, |value, k| value | bit(i * bits + k) << k);
            present += (0..count).filter(|&i| value(i) == level).count();
            (seen, levels) = (seen + count, rest);
        }
    }
    Some(present)
}

/// A number of seven bits a byte, the lowest first.
fn varint(bytes: &mut &[u8]) -> Option<u64> {
    let mut number = 0;
    for shift in (0..63).step_by(7) {
        let (&byte, rest) = bytes.split_first()?;
        *bytes = rest;
        number |= u64::from(byte & 0x7f) << shift;
        if byte & 0x80 == 0 {
            return Some(number);
        }
    }
    None
}

impl Iterator for Pages {
    type Item = Result<Page, ParquetError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.get_next_page().transpose()
    }
}

impl PageReader for Pages {
    fn get_next_page(&mut self) -> Result<Option<Page>, ParquetError> {
        let page = self.inner.get_next_page()?;
        if let Some(page) = &page {
            self.check(page).map_err(|problem| ParquetError::General(problem.to_owned()))?;
        }
        Ok(page)
    }

    fn peek_next_page(&mut self) -> Result<Option<PageMetadata>, ParquetError> {
        self.inner.peek_next_page()
    }

    fn skip_next_page(&mut self) -> Result<(), ParquetError> {
        self.inner.skip_next_page()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_counted_as_parquet_packs_them() {
        // A run of five ones; a run of three zeros; a group of eight, of which 0, 2 and 7 are ones.
        let levels = [5 << 1, 1, 3 << 1, 0, 1 << 1 | 1, 0b1000_0101];
        assert_eq!(count(&levels, 1, 5), Some(5));
        assert_eq!(count(&levels, 1, 8), Some(5));
        assert_eq!(count(&levels, 1, 11), Some(7));
        assert_eq!(count(&levels, 1, 16), Some(8));
        assert_eq!(count(&levels, 1, 17), None);
        // Two bits a level: 3, 1, 2, 3, and four zeros.
        assert_eq!(count(&[3, 0b1110_0111, 0], 3, 8), Some(2));
        assert_eq!(count(&[0x80, 0x80], 1, 1), None);
    }
}
