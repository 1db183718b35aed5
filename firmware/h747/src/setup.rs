//! The flight code's setup (vehicle, gains, mission, weights), kept apart from the image.
//!
//! `squirrel export-vectors flight.mcap --out DIR` writes `DIR/setup-0.bin`, a file of vectors
//! without frames: a header with magic and version, then one setup behind its length. It is flashed
//! to a sector of its own, so that another vehicle is no other image.

use squirrel_core::stack::Stack;
use squirrel_core::stack::wire::{Header, Reader, Record, Wire};

/// The setup at the start of these bytes; what follows it, as erased flash, is not looked at.
/// `None` where it is none of this version.
#[must_use]
pub fn read(bytes: &[u8]) -> Option<Stack> {
    let (header, rest) = bytes.split_at_checked(Header::LENGTH)?;
    if Header::take(&mut Reader::new(header))? != (Header { sequences: 1, frames: 0 }) {
        return None;
    }
    let (length, rest) = rest.split_first_chunk()?;
    let record = rest.get(..usize::from(u16::from_le_bytes(*length)))?;
    let mut reader = Reader::new(record);
    match Record::take(&mut reader)? {
        Record::Setup(stack) if reader.is_empty() => Some(stack),
        _ => None,
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use squirrel_core::stack::wire::Writer;

    /// What `export-vectors` wrote of a hover.
    pub(crate) const SETUP: &[u8] = include_bytes!("../testdata/setup.bin");

    #[test]
    fn a_setup_is_read_whatever_follows_it() {
        let stack = read(SETUP).unwrap();
        assert_eq!(stack.vehicle().rotors().len(), crate::outputs::ROTORS);
        let flash = [SETUP, &[0xFF; 100]].concat();
        assert_eq!(read(&flash), Some(stack));
    }

    #[test]
    fn erased_flash_another_version_or_a_broken_off_file_is_none() {
        assert_eq!(read(&[0xFF; 4096]), None);
        assert_eq!(read(&[]), None);
        for length in 0..SETUP.len() {
            assert_eq!(read(&SETUP[..length]), None, "{length}");
        }
        let mut other = SETUP.to_vec();
        other[8] += 1;
        assert_eq!(read(&other), None);
        let mut header = [0; Header::LENGTH];
        Header { sequences: 1, frames: 1 }.put(&mut Writer::new(&mut header));
        assert_eq!(
            read(&[&header[..], &SETUP[Header::LENGTH..]].concat()),
            None,
            "a flight is no setup"
        );
    }
}
