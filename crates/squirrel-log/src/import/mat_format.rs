//! MATLAB's MAT-files, level 5 (`save -v6` and `-v7`): which arrays of numbers are in them, and
//! where.
//!
//! After a header of 128 bytes come data elements: a type and a size of 4 bytes each (or both in 4,
//! with up to 4 bytes of data), the data, padding to 8. A variable is an element of type `matrix`,
//! or one packed by zlib. Numbers stand column by column, in whichever type holds them.

use std::ops::Range;

use miniz_oxide::inflate::{TINFLStatus, decompress_to_vec_zlib_with_limit};

use super::array_file::{ARRAYS_MAX, Array, Arrays, DEPTH_MAX, Numbers};
use super::number::Kind;
use crate::files::Budget;

/// Text, an offset that is not used here, version and byte order.
const HEADER_BYTES: usize = 128;

const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
const COMPLEX: u32 = 0x0800;

/// The arrays of a MAT-file of level 5.
#[derive(Debug, Default)]
pub(super) struct Level5 {
    all: Vec<Array>,
    /// Of each array: which buffer, and where in it.
    places: Vec<(usize, Range<usize>)>,
    big_endian: bool,
    /// The file, and what was packed in it.
    buffers: Vec<Vec<u8>>,
}

impl Arrays for Level5 {
    fn all(&self) -> &[Array] {
        &self.all
    }

    /// All was unpacked when the arrays were found.
    fn bytes(&mut self, index: usize, _: &mut Budget) -> Result<&[u8], String> {
        let (buffer, bytes) = &self.places[index];
        Ok(&self.buffers[*buffer][bytes.clone()])
    }
}

impl Level5 {
    /// Finds the arrays of a file.
    ///
    /// * `budget` - of all packed variables together: a few hundred bytes can unpack to gigabytes
    ///
    /// # Errors
    /// Says what is wrong, and at which byte.
    pub(super) fn read(bytes: Vec<u8>, budget: &mut Budget) -> Result<Self, String> {
        let version = match bytes.get(124..HEADER_BYTES) {
            Some([0, 1, b'I', b'M']) => false,
            Some([1, 0, b'M', b'I']) => true,
            Some(_) => {
                return Err("no MAT-file of level 5; in MATLAB, `save -v7` writes one".to_owned());
            }
            None => return Err(format!("ends inside the header, after {} bytes", bytes.len())),
        };
        let mut arrays = Self { big_endian: version, ..Self::default() };
        let (mut at, mut found) = (HEADER_BYTES, Vec::new());
        while at < bytes.len() {
            let element = element(&bytes, at, bytes.len(), arrays.big_endian)?;
            at = element.end;
            if element.kind == COMPRESSED {
                let packed = &bytes[element.data.clone()];
                let most = usize::try_from(budget.left()).unwrap_or(usize::MAX);
                let unpacked =
                    decompress_to_vec_zlib_with_limit(packed, most).map_err(|error| {
                        if error.status == TINFLStatus::HasMoreOutput {
                            return budget.too_large().to_string();
                        }
                        let at = element.data.start;
                        format!("the packed variable at byte {at} cannot be unpacked: {error}")
                    })?;
                budget.take(unpacked.len() as u64).map_err(|error| error.to_string())?;
                // The file itself is the first buffer.
                arrays.buffers.push(unpacked);
                found.push((arrays.buffers.len(), 0));
            } else if element.kind == MATRIX {
                found.push((0, element.start));
            }
        }
        arrays.buffers.insert(0, bytes);
        for (buffer, start) in found {
            let end = arrays.buffers[buffer].len();
            let element = element(&arrays.buffers[buffer], start, end, arrays.big_endian)?;
            if element.kind == MATRIX {
                arrays.matrix(buffer, element.data, None, 0)?;
            }
        }
        Ok(arrays)
    }

    /// Adds the arrays of a matrix.
    ///
    /// * `path` - of a field or an element; a variable has its own name
    fn matrix(
        &mut self,
        buffer: usize,
        data: Range<usize>,
        path: Option<String>,
        depth: usize,
    ) -> Result<(), String> {
        if depth == DEPTH_MAX {
            return Err(format!("a variable is nested more than {DEPTH_MAX} deep"));
        }
        if data.is_empty() {
            return Ok(()); // an empty field
        }
        let (bytes, big_endian) = (&self.buffers[buffer], self.big_endian);
        let next = |at: usize| element(bytes, at, data.end, big_endian);
        let flags = next(data.start)?;
        let sizes = next(flags.end)?;
        let name = next(sizes.end)?;
        let flags = word(bytes, flags.data.start, flags.data.end, big_endian)?;
        let class = flags & 0xff;
        let sizes: Vec<usize> = bytes[sizes.data.clone()]
            .chunks_exact(4)
            .map(|size| word(size, 0, 4, big_endian).map(|size| size as usize))
            .collect::<Result<_, _>>()?;
        let count = sizes.iter().try_fold(1_usize, |product, size| product.checked_mul(*size));
        let count =
            count.ok_or_else(|| format!("the array at byte {} is too large", data.start))?;
        let path = match path {
            Some(path) => path,
            None => String::from_utf8_lossy(&bytes[name.data.clone()]).into_owned(),
        };
        let sizes: Vec<usize> = sizes.into_iter().filter(|size| *size != 1).collect();
        match class {
            2 => self.structure(buffer, name.end..data.end, &path, count, depth),
            6..=15 if flags & COMPLEX == 0 => {
                let numbers = next(name.end)?;
                let kind = numeric(numbers.kind).ok_or_else(|| {
                    format!("`{path}` holds data of the unknown type {}", numbers.kind)
                })?;
                if count.checked_mul(kind.size()) != Some(numbers.data.len()) {
                    return Err(format!(
                        "`{path}` has {} bytes for {count} numbers of {}",
                        numbers.data.len(),
                        kind.size()
                    ));
                }
                if self.all.len() == ARRAYS_MAX {
                    return Err(format!("more than {ARRAYS_MAX} arrays"));
                }
                let stored = Numbers::dense(kind, big_endian);
                self.all.push(Array { path, sizes, numbers: stored });
                self.places.push((buffer, numbers.data));
                Ok(())
            }
            // Cells, text, sparse and complex numbers, objects: none of them are columns.
            _ => Ok(()),
        }
    }

    /// Adds the arrays in the fields of a structure, or of a list of them.
    fn structure(
        &mut self,
        buffer: usize,
        data: Range<usize>,
        path: &str,
        count: usize,
        depth: usize,
    ) -> Result<(), String> {
        let (bytes, big_endian) = (&self.buffers[buffer], self.big_endian);
        let length = element(bytes, data.start, data.end, big_endian)?;
        let names = element(bytes, length.end, data.end, big_endian)?;
        let length = word(bytes, length.data.start, length.data.end, big_endian)? as usize;
        if length == 0 {
            return Err(format!("`{path}` has fields without names"));
        }
        let names: Vec<String> = bytes[names.data.clone()]
            .chunks_exact(length)
            .map(|name| {
                String::from_utf8_lossy(name.split(|byte| *byte == 0).next().unwrap_or_default())
                    .into_owned()
            })
            .collect();
        let mut at = element(bytes, data.start, data.end, big_endian)?.end;
        at = element(bytes, at, data.end, big_endian)?.end;
        if names.is_empty() {
            return Ok(());
        }
        for i in 0..count {
            for name in &names {
                let field = element(&self.buffers[buffer], at, data.end, big_endian)?;
                at = field.end;
                let index = if count == 1 { String::new() } else { format!("[{i}]") };
                if field.kind == MATRIX {
                    let path = format!("{path}{index}.{name}");
                    self.matrix(buffer, field.data, Some(path), depth + 1)?;
                }
            }
        }
        Ok(())
    }
}

/// A data element.
struct Element {
    kind: u32,
    start: usize,
    data: Range<usize>,
    /// Where the next one starts.
    end: usize,
}

/// The element at a byte; all of it is before `end`.
fn element(bytes: &[u8], at: usize, end: usize, big_endian: bool) -> Result<Element, String> {
    let first = word(bytes, at, end, big_endian)?;
    let (kind, start, size) = if first >> 16 == 0 {
        (first, at + 8, word(bytes, at + 4, end, big_endian)? as usize)
    } else {
        (first & 0xffff, at + 4, (first >> 16) as usize)
    };
    let left = end.saturating_sub(start);
    if size > left {
        return Err(format!("ends inside the element at byte {at}: {left} of {size} bytes"));
    }
    let data = start..start + size;
    // Packed ones are not padded.
    let padded = if kind == COMPRESSED {
        data.end
    } else {
        at + 8 + data.end.saturating_sub(at + 8).next_multiple_of(8)
    };
    Ok(Element { kind, start: at, data, end: padded.min(end) })
}

fn word(bytes: &[u8], at: usize, end: usize, big_endian: bool) -> Result<u32, String> {
    let word = bytes.get(at..end).and_then(<[u8]>::first_chunk).copied();
    let word = word.ok_or_else(|| format!("ends inside the element at byte {at}"))?;
    Ok(if big_endian { u32::from_be_bytes(word) } else { u32::from_le_bytes(word) })
}

/// The types of stored numbers; `None` for text and the like.
fn numeric(kind: u32) -> Option<Kind> {
    Some(match kind {
        1 => Kind::I8,
        2 => Kind::U8,
        3 => Kind::I16,
        4 => Kind::U16,
        5 => Kind::I32,
        6 => Kind::U32,
        7 => Kind::F32,
        9 => Kind::F64,
        12 => Kind::I64,
        13 => Kind::U64,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packed_variables_together_have_a_largest_size() {
        let packed = std::fs::read("tests/data/mat/packed.mat").unwrap();
        let whole = Budget::of(packed.len() as u64);
        let mut left = whole.clone();
        let arrays = Level5::read(packed.clone(), &mut left).unwrap();
        let unpacked: usize = arrays.buffers[1..].iter().map(Vec::len).sum();
        assert_eq!(whole.left() - left.left(), unpacked as u64);
        let mut less = whole.clone();
        less.take(whole.left() - unpacked as u64 + 1).unwrap();
        let error = Level5::read(packed, &mut less).unwrap_err();
        assert!(error.starts_with("its content is larger than 256 MB"), "{error}");
    }
}
