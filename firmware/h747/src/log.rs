//! Log records for a serial line: those of core's wire format, so framed that a byte that is lost
//! costs one record.
//!
//! A flight is its setup and its frames, each frame with the hash of all outputs so far. The
//! outputs are not sent: the flight code is a function of these, so the host computes every term of
//! every step again (`squirrel import --board`), and the hash says that they are the same to the
//! bit.
//!
//! Framing is consistent overhead byte stuffing (COBS, Cheshire and Baker 1999): zeros end records
//! and are nowhere else.

use squirrel_core::stack::wire::RECORD_MAX;

/// Room that any record takes on the line, bytes.
pub const LINE_MAX: usize = cobs::max_encoding_length(RECORD_MAX) + 1;

/// Writes a record as it goes over the line, the zero behind it included; `None` where the buffer
/// is too small.
#[must_use]
pub fn framed<'a>(record: &[u8], line: &'a mut [u8]) -> Option<&'a [u8]> {
    let end = cobs::try_encode(record, line).ok()?;
    *line.get_mut(end)? = 0;
    line.get(..=end)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs around the length at which a run is cut, and everything a byte can be.
    #[test]
    fn records_of_any_kind_come_back() {
        let mut records =
            vec![vec![0], vec![0, 0, 0], (0..=255).collect::<Vec<u8>>(), vec![0; RECORD_MAX]];
        for length in [1, 253, 254, 255, 508, 509, RECORD_MAX] {
            records.push(vec![1; length]);
        }
        for record in &records {
            let mut line = [9; LINE_MAX];
            let (zero, sent) = framed(record, &mut line).unwrap().split_last().unwrap();
            assert!(*zero == 0 && !sent.contains(&0), "zeros only end records");
            assert_eq!(&cobs::decode_vec(sent).unwrap(), record);
        }
    }

    #[test]
    fn what_does_not_fit_is_left_out() {
        assert_eq!(framed(&[1, 2, 3], &mut [9; 4]), None);
        assert_eq!(framed(&[1, 2, 3], &mut [9; 5]), Some(&[4, 1, 2, 3, 0][..]));
    }
}
