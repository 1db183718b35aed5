//! The flight code's setup, frames and outputs as bytes, the same on every target.
//!
//! One byte order (little endian), fields in the order of their declaration, no padding; an
//! enumeration is one byte, an option a byte and, where that is 1, the value. A NaN is written as
//! one NaN, because the sign of a generated NaN differs between targets. So two targets agree to
//! the last bit exactly where their bytes agree, and [`hash`] of the bytes says so.
//!
//! A stream of [`Record`]s plays a flight: a setup, which also clears the state, then frames, each
//! with the hash that its output had where the stream was made. A file starts with a [`Header`]; a
//! live link has none.

mod memory;
mod output;
mod setup;
mod stream;

pub use memory::Outside;
pub use stream::{FRAME, Header, MAGIC, RECORD_MAX, Record, SETUP, VERSION};

use crate::frames::{Frame, In, Rotation};
use nalgebra::{Matrix3, Quaternion, Unit, Vector3};

/// Something that has a place in the byte stream.
pub trait Wire: Sized {
    /// Appends it.
    fn put(&self, to: &mut Writer<'_>);
    /// Reads it; `None` where bytes are missing or mean nothing.
    fn take(from: &mut Reader<'_>) -> Option<Self>;
}

/// Appends bytes to a buffer of the caller. What does not fit is left out, and [`Writer::bytes`] is
/// `None` then.
#[derive(Debug)]
pub struct Writer<'a> {
    buffer: &'a mut [u8],
    length: usize,
}

impl<'a> Writer<'a> {
    /// Starts at the begin of the buffer.
    pub fn new(buffer: &'a mut [u8]) -> Self {
        Self { buffer, length: 0 }
    }

    fn raw(&mut self, bytes: &[u8]) {
        let end = self.length.saturating_add(bytes.len());
        if let Some(place) = self.buffer.get_mut(self.length..end) {
            for (to, from) in place.iter_mut().zip(bytes) {
                *to = *from;
            }
        }
        self.length = end;
    }

    /// What was written; `None` where the buffer was too small.
    pub fn bytes(&self) -> Option<&[u8]> {
        self.buffer.get(..self.length)
    }
}

/// Takes bytes from the front of a slice.
#[derive(Debug)]
pub struct Reader<'a> {
    bytes: &'a [u8],
}

impl<'a> Reader<'a> {
    /// Starts at the begin.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes }
    }

    fn raw<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, rest) = self.bytes.split_first_chunk::<N>()?;
        self.bytes = rest;
        Some(*head)
    }

    /// Nothing is left.
    pub fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }
}

/// FNV-1a over the bytes, going on from `before`; a stream starts at [`HASH_START`].
pub fn hash(before: u64, bytes: &[u8]) -> u64 {
    bytes.iter().fold(before, |h, byte| (h ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01B3))
}

/// What a function makes of a value's bytes; `None` where they do not fit a record.
pub fn written<T>(value: &impl Wire, then: impl FnOnce(&[u8]) -> T) -> Option<T> {
    let mut buffer = [0; RECORD_MAX];
    let mut writer = Writer::new(&mut buffer);
    value.put(&mut writer);
    writer.bytes().map(then)
}

/// The hash of no bytes.
pub const HASH_START: u64 = 0xCBF2_9CE4_8422_2325;

macro_rules! wire_integer {
    ($($integer:ty),*) => {$(
        impl Wire for $integer {
            fn put(&self, to: &mut Writer<'_>) {
                to.raw(&self.to_le_bytes());
            }
            fn take(from: &mut Reader<'_>) -> Option<Self> {
                from.raw().map(Self::from_le_bytes)
            }
        }
    )*};
}
wire_integer!(u8, u16, u32, u64);

impl Wire for f32 {
    fn put(&self, to: &mut Writer<'_>) {
        (if self.is_nan() { 0x7FC0_0000 } else { self.to_bits() }).put(to);
    }
    fn take(from: &mut Reader<'_>) -> Option<Self> {
        u32::take(from).map(Self::from_bits)
    }
}

impl Wire for bool {
    fn put(&self, to: &mut Writer<'_>) {
        u8::from(*self).put(to);
    }
    fn take(from: &mut Reader<'_>) -> Option<Self> {
        match u8::take(from)? {
            0 => Some(false),
            1 => Some(true),
            _ => None,
        }
    }
}

impl<T: Wire> Wire for Option<T> {
    fn put(&self, to: &mut Writer<'_>) {
        self.is_some().put(to);
        if let Some(value) = self {
            value.put(to);
        }
    }
    fn take(from: &mut Reader<'_>) -> Option<Self> {
        if bool::take(from)? { T::take(from).map(Some) } else { Some(None) }
    }
}

impl<T: Wire + Copy, const N: usize> Wire for [T; N] {
    fn put(&self, to: &mut Writer<'_>) {
        for value in self {
            value.put(to);
        }
    }
    fn take(from: &mut Reader<'_>) -> Option<Self> {
        let mut all = [T::take(from)?; N];
        for place in all.iter_mut().skip(1) {
            *place = T::take(from)?;
        }
        Some(all)
    }
}

impl Wire for Vector3<f32> {
    fn put(&self, to: &mut Writer<'_>) {
        [self.x, self.y, self.z].put(to);
    }
    fn take(from: &mut Reader<'_>) -> Option<Self> {
        <[f32; 3]>::take(from).map(Self::from)
    }
}

/// Row by row.
impl Wire for Matrix3<f32> {
    fn put(&self, to: &mut Writer<'_>) {
        for row in 0..3 {
            [self[(row, 0)], self[(row, 1)], self[(row, 2)]].put(to);
        }
    }
    fn take(from: &mut Reader<'_>) -> Option<Self> {
        let [a, b, c] = <[[f32; 3]; 3]>::take(from)?;
        Some(Self::new(a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]))
    }
}

impl<F: Frame> Wire for In<F, f32> {
    fn put(&self, to: &mut Writer<'_>) {
        self.vector.put(to);
    }
    fn take(from: &mut Reader<'_>) -> Option<Self> {
        Vector3::take(from).map(Self::new)
    }
}

/// As it is: the flight code must also see a quaternion that is none.
impl<To: Frame, From: Frame> Wire for Rotation<To, From, f32> {
    fn put(&self, to: &mut Writer<'_>) {
        self.wxyz().put(to);
    }
    fn take(from: &mut Reader<'_>) -> Option<Self> {
        let [w, x, y, z] = <[f32; 4]>::take(from)?;
        Some(Self::new(Unit::new_unchecked(Quaternion::new(w, x, y, z))))
    }
}

/// A plain struct, field by field. It does not compile when a field is added and not named.
macro_rules! wire_struct {
    ($($name:ty { $($field:ident),* $(,)? })*) => {$(
        impl Wire for $name {
            fn put(&self, to: &mut Writer<'_>) {
                let Self { $($field),* } = self;
                $($field.put(to);)*
            }
            fn take(from: &mut Reader<'_>) -> Option<Self> {
                Some(Self { $($field: Wire::take(from)?),* })
            }
        }
    )*};
}

/// An enumeration without data: the number is the place in the list, and a variant that is not
/// listed does not compile.
macro_rules! wire_enum {
    ($($name:ident { $($variant:ident),* $(,)? })*) => {$(
        impl Wire for $name {
            fn put(&self, to: &mut Writer<'_>) {
                const ALL: &[$name] = &[$($name::$variant),*];
                match self { $(Self::$variant => {})* }
                let place = ALL.iter().position(|one| one == self).unwrap_or(0);
                (place as u8).put(to);
            }
            fn take(from: &mut Reader<'_>) -> Option<Self> {
                const ALL: &[$name] = &[$($name::$variant),*];
                ALL.get(usize::from(u8::take(from)?)).copied()
            }
        }
    )*};
}

use {wire_enum, wire_struct};

#[cfg(test)]
mod tests;
