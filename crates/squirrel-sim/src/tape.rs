//! Numbers that go onto a tape of bytes, or come back from one: what remembers lists its numbers
//! once, and is written and read in that order. Little endian, without padding.

use nalgebra::{convert, try_convert};
use squirrel_core::lane::{BLOCK, Row};
use squirrel_core::math::Real;

/// A tape that is written or read. What is read is `None` where the tape ends too soon or says
/// something that cannot be.
#[derive(Debug)]
pub enum Tape<'a> {
    /// What is written.
    Write(&'a mut Vec<u8>),
    /// What is left.
    Read(&'a [u8]),
}

impl Tape<'_> {
    /// Whether it is read.
    pub fn is_read(&self) -> bool {
        matches!(self, Self::Read(_))
    }

    /// Nothing is left to read.
    pub fn is_over(&self) -> bool {
        matches!(self, Self::Read([]))
    }

    fn raw<const N: usize>(&mut self, own: &mut [u8; N]) -> Option<()> {
        match self {
            Self::Write(bytes) => bytes.extend_from_slice(own),
            Self::Read(left) => (*own, *left) = left.split_first_chunk().map(|(a, b)| (*a, b))?,
        }
        Some(())
    }

    /// A whole number.
    pub fn word(&mut self, x: &mut u64) -> Option<()> {
        let mut bytes = x.to_le_bytes();
        self.raw(&mut bytes)?;
        *x = u64::from_le_bytes(bytes);
        Some(())
    }

    /// A long whole number.
    pub fn long(&mut self, x: &mut u128) -> Option<()> {
        let mut bytes = x.to_le_bytes();
        self.raw(&mut bytes)?;
        *x = u128::from_le_bytes(bytes);
        Some(())
    }

    /// A number of things.
    pub fn count(&mut self, x: usize) -> Option<usize> {
        let mut word = x as u64;
        self.word(&mut word)?;
        usize::try_from(word).ok()
    }

    /// What must be the same on both sides.
    pub fn same(&mut self, x: usize) -> Option<()> {
        (self.count(x)? == x).then_some(())
    }

    /// Yes or no.
    pub fn flag(&mut self, x: &mut bool) -> Option<()> {
        let mut byte = [u8::from(*x)];
        self.raw(&mut byte)?;
        *x = byte[0] == 1;
        (byte[0] <= 1).then_some(())
    }

    /// A number in 8 bytes.
    pub fn double(&mut self, x: &mut f64) -> Option<()> {
        let mut bytes = x.to_le_bytes();
        self.raw(&mut bytes)?;
        *x = f64::from_le_bytes(bytes);
        Some(())
    }

    /// Numbers in 8 bytes each.
    pub fn doubles<'x>(&mut self, all: impl IntoIterator<Item = &'x mut f64>) -> Option<()> {
        all.into_iter().try_for_each(|x| self.double(x))
    }

    /// A number in 4 bytes.
    pub fn single(&mut self, x: &mut f32) -> Option<()> {
        let mut bytes = x.to_le_bytes();
        self.raw(&mut bytes)?;
        *x = f32::from_le_bytes(bytes);
        Some(())
    }

    /// A number of either scalar, in its own width.
    pub fn real<S: Real>(&mut self, x: &mut S) -> Option<()> {
        let mut wide = try_convert::<S, f64>(*x).unwrap_or(f64::NAN);
        if size_of::<S>() == size_of::<f32>() {
            let mut narrow = wide as f32;
            self.single(&mut narrow)?;
            wide = f64::from(narrow);
        } else {
            self.double(&mut wide)?;
        }
        if self.is_read() {
            *x = convert(wide);
        }
        Some(())
    }

    /// Numbers of either scalar.
    pub fn reals<S: Real>(&mut self, all: &mut [S]) -> Option<()> {
        all.iter_mut().try_for_each(|x| self.real(x))
    }

    /// Rows of a block of a batch.
    pub fn rows<S: Real>(&mut self, rows: &mut [Row<S>]) -> Option<()> {
        rows.iter_mut().try_for_each(|row: &mut [S; BLOCK]| self.reals(row))
    }
}

/// The rows of a structure of `squirrel_core::numbers`.
#[doc(hidden)]
#[macro_export]
macro_rules! on_tape {
    ($tape:expr, $place:expr) => {{
        let (tape, fine) = (std::cell::RefCell::new(&mut *$tape), std::cell::Cell::new(true));
        $place = $place.map(|mut row| {
            fine.set(fine.get() && tape.borrow_mut().reals(&mut row).is_some());
            row
        });
        fine.get().then_some(())
    }};
}
#[doc(hidden)]
pub use on_tape;

#[cfg(test)]
mod tests {
    use super::*;

    fn all(tape: &mut Tape<'_>, numbers: &mut (u64, u128, bool, f64, f32, [f32; 2])) -> Option<()> {
        tape.word(&mut numbers.0)?;
        tape.long(&mut numbers.1)?;
        tape.flag(&mut numbers.2)?;
        tape.double(&mut numbers.3)?;
        tape.single(&mut numbers.4)?;
        tape.reals(&mut numbers.5)
    }

    #[test]
    fn what_was_written_is_read_and_nothing_else() {
        let mut own = (7, u128::MAX - 5, true, 0.1, -0.0, [f32::MIN_POSITIVE / 4.0, f32::INFINITY]);
        let mut bytes = Vec::new();
        all(&mut Tape::Write(&mut bytes), &mut own).unwrap();
        assert_eq!(bytes.len(), 8 + 16 + 1 + 8 + 4 + 8);
        let mut other = (0, 0, false, 0.0, 0.0, [0.0; 2]);
        let mut tape = Tape::Read(&bytes);
        all(&mut tape, &mut other).unwrap();
        assert!(tape.is_over());
        assert_eq!(format!("{other:?}"), format!("{own:?}"));
        for end in 0..bytes.len() {
            assert_eq!(all(&mut Tape::Read(&bytes[..end]), &mut other), None);
        }
        bytes[24] = 2;
        assert_eq!(all(&mut Tape::Read(&bytes), &mut other), None, "no flag");
    }
}
