//! Log records for a serial line: those of core's wire format, so framed that a byte that is lost costs one record.
//!
//! A flight is its setup and its frames, each frame with the hash of all outputs so far. The outputs are not sent: the flight code is
//! a function of these, so the host computes every term of every step again, and the hash says that they are the same to the bit.
//!
//! Framing is consistent overhead byte stuffing (COBS, Cheshire and Baker 1999): zeros end records and are nowhere else.

use squirrel_core::stack::wire::RECORD_MAX;

/// Room that any record takes on the line, bytes.
pub const LINE_MAX: usize = RECORD_MAX + RECORD_MAX / 254 + 2;

/// Writes a record as it goes over the line, the zero behind it included; `None` where the buffer is too small.
///
/// Each run of bytes without zero goes behind its length plus one; a length of 255 has no zero after it.
#[must_use]
pub fn stuff<'a>(record: &[u8], line: &'a mut [u8]) -> Option<&'a [u8]> {
    let (mut head, mut at) = (0, 1);
    for byte in record {
        if *byte != 0 {
            *line.get_mut(at)? = *byte;
            at += 1;
        }
        if *byte == 0 || at - head == 0xFF {
            *line.get_mut(head)? = (at - head) as u8;
            (head, at) = (at, at + 1);
        }
    }
    *line.get_mut(head)? = (at - head) as u8;
    *line.get_mut(at)? = 0;
    line.get(..=at)
}

/// Finds records in what comes over the line.
#[derive(Debug)]
pub struct Unstuff {
    record: [u8; RECORD_MAX + 1],
    length: usize,
    /// Bytes until the next length.
    run: u8,
    /// The run that ends has a zero after it.
    zero_follows: bool,
    is_broken: bool,
}

impl Default for Unstuff {
    fn default() -> Self {
        Self { record: [0; RECORD_MAX + 1], length: 0, run: 0, zero_follows: false, is_broken: false }
    }
}

impl Unstuff {
    /// One byte more: at the end of a record that record, `None` in between. One that cannot be whole is left out.
    pub fn push(&mut self, byte: u8) -> Option<&[u8]> {
        if byte == 0 {
            let whole = self.run == 0 && !self.is_broken && self.length > 0;
            let length = core::mem::take(&mut self.length);
            (self.run, self.zero_follows, self.is_broken) = (0, false, false);
            return self.record.get(..length).filter(|_| whole);
        }
        if self.run == 0 {
            if self.zero_follows {
                self.keep(0);
            }
            self.run = byte - 1;
            self.zero_follows = byte != 0xFF;
        } else {
            self.keep(byte);
            self.run -= 1;
        }
        None
    }

    fn keep(&mut self, byte: u8) {
        match self.record.get_mut(self.length) {
            Some(place) => {
                *place = byte;
                self.length += 1;
            }
            None => self.is_broken = true,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn over_the_line(line: &[u8]) -> Vec<Vec<u8>> {
        let mut unstuff = Unstuff::default();
        line.iter().filter_map(|byte| unstuff.push(*byte).map(<[u8]>::to_vec)).collect()
    }

    fn stuffed(record: &[u8]) -> Vec<u8> {
        stuff(record, &mut [0; LINE_MAX]).unwrap().to_vec()
    }

    /// Runs around the length at which a run is cut, and everything a byte can be.
    #[test]
    fn records_of_any_kind_come_back() {
        let mut records = vec![
            vec![0],
            vec![0, 0, 0],
            (0..=255).collect::<Vec<u8>>(),
            vec![0; RECORD_MAX],
            vec![7; RECORD_MAX],
        ];
        for length in [1, 253, 254, 255, 508, 509, 4096] {
            records.push(vec![1; length]);
            let mut ends = vec![1; length];
            *ends.last_mut().unwrap() = 0;
            records.push(ends);
        }
        let line: Vec<u8> = records.iter().flat_map(|record| stuffed(record)).collect();
        assert_eq!(line.split(|byte| *byte == 0).count(), records.len() + 1, "zeros only end records");
        assert_eq!(over_the_line(&line), records);
        // Also where the listener comes late.
        assert_eq!(over_the_line(&line[1..]).last(), records.last());
    }

    #[test]
    fn a_lost_byte_costs_one_record() {
        let line: Vec<u8> = (1..=5u8).flat_map(|k| stuffed(&[k, 0, k, k, 0, 9])).collect();
        let one = line.len() / 5;
        for lost in one..2 * one {
            let mut cut = line.clone();
            cut.remove(lost);
            let heard = over_the_line(&cut);
            let good = heard.iter().filter(|r| r.len() == 6 && r[1] == 0 && r[5] == 9).count();
            // Without the zero between them two records are one that is none.
            assert!(good >= 3 + usize::from(lost + 1 < 2 * one), "{lost}: {heard:?}");
        }
    }

    #[test]
    fn what_is_too_long_or_does_not_fit_is_left_out() {
        let mut line = stuffed(&vec![1; RECORD_MAX]);
        line.pop();
        line.extend([255; 600]);
        line.push(0);
        line.extend(stuffed(&[5]));
        assert_eq!(over_the_line(&line), [vec![5]]);
        assert_eq!(stuff(&[1, 2, 3], &mut [0; 4]), None);
        assert_eq!(stuff(&[1, 2, 3], &mut [0; 5]), Some(&[4, 1, 2, 3, 0][..]));
    }
}
