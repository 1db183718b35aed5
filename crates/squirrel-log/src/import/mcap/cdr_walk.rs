//! The way through a CDR message: what to take and what to step over.

use std::collections::BTreeMap;

use super::ros_schema::{Struct, Type};
use crate::import::number::Kind;

/// Bytes before the message that say how it is written.
const ENCAPSULATION_BYTES: usize = 4;
/// Middlewares pad a message to whole words.
const PADDING_MAX_BYTES: usize = 7;

/// Columns that are wanted, as a tree of their paths.
#[derive(Debug, Default)]
pub(super) struct Pick {
    /// Where the number goes in the row, if the path ends here.
    slot: Option<usize>,
    /// By the name of a field or the number of an element.
    inside: BTreeMap<String, Pick>,
}

impl Pick {
    /// Adds a column, whose number goes to `slot`.
    pub(super) fn add(&mut self, column: &str, slot: usize) {
        let mut at = self;
        for part in column.split(['.', '[']).filter(|part| !part.is_empty()) {
            at = at.inside.entry(part.trim_end_matches(']').to_owned()).or_default();
        }
        at.slot = Some(slot);
    }
}

/// One step through a message.
pub(super) enum Step {
    /// Takes a number to a slot.
    Number(Kind, usize),
    /// Steps over so many numbers.
    Skip(Kind, usize),
    /// Text of at most so many bytes.
    Text(usize),
    /// Seconds and nanoseconds: the time in ns, and the two numbers, to the slots that there are.
    Time { second: Kind, nanosecond: Kind, slots: [Option<usize>; 3] },
    /// A list: those of the first elements that have steps of their own by these, the others by
    /// those of `other`.
    List { count: Count, first: Vec<Option<Vec<Step>>>, other: Vec<Step> },
}

/// How many elements a list has.
#[derive(Clone, Copy)]
pub(super) enum Count {
    Fixed(usize),
    Written { bound: usize, id: usize },
}

/// The steps through a message.
pub(super) fn steps(message: &Struct, pick: &Pick) -> Vec<Step> {
    let mut steps = Vec::new();
    add_struct(message, Some(pick), &mut steps);
    steps
}

fn add_struct(message: &Struct, pick: Option<&Pick>, steps: &mut Vec<Step>) {
    let inside = |name: &str| pick.and_then(|pick| pick.inside.get(name));
    if let (true, Some(pick), [(sec, Type::Number(second)), (nano, Type::Number(nanosecond))]) =
        (message.is_time, pick, message.fields.as_slice())
    {
        let slot = |name: &str| inside(name).and_then(|pick| pick.slot);
        let slots = [pick.slot, slot(sec), slot(nano)];
        steps.push(Step::Time { second: *second, nanosecond: *nanosecond, slots });
        return;
    }
    for (name, kind) in &message.fields {
        add_field(kind, inside(name), steps);
    }
}

fn add_field(kind: &Type, pick: Option<&Pick>, steps: &mut Vec<Step>) {
    let (element, count) = match kind {
        Type::Number(kind) => {
            match (pick.and_then(|pick| pick.slot), steps.last_mut()) {
                (Some(slot), _) => steps.push(Step::Number(*kind, slot)),
                (None, Some(Step::Skip(last, count))) if last == kind => *count += 1,
                (None, _) => steps.push(Step::Skip(*kind, 1)),
            }
            return;
        }
        Type::Text(bound) => return steps.push(Step::Text(*bound)),
        Type::Struct(inner) => return add_struct(inner, pick, steps),
        Type::Array(element, count) => (element, Count::Fixed(*count)),
        Type::Sequence { element, bound, id } => {
            (element, Count::Written { bound: *bound, id: *id })
        }
    };
    let inside = pick.map(|pick| &pick.inside);
    let picked = inside.iter().flat_map(|inside| inside.keys());
    let last = picked.filter_map(|index| index.parse::<usize>().ok()).max();
    let first = (0..last.map_or(0, |last| last + 1)).map(|i| {
        let pick = inside.and_then(|inside| inside.get(&i.to_string()))?;
        let mut steps = Vec::new();
        add_field(element, Some(pick), &mut steps);
        Some(steps)
    });
    let first = first.collect();
    let mut other = Vec::new();
    add_field(element, None, &mut other);
    steps.push(Step::List { count, first, other });
}

/// Walks through a message.
///
/// * `row` - gets the numbers at the slots of the steps
/// * `lengths` - gets the longest of each sequence, by its id; may be empty
///
/// # Errors
/// Says what of the message contradicts its schema, and at which byte.
pub(super) fn walk(
    bytes: &[u8],
    steps: &[Step],
    row: &mut [f64],
    lengths: &mut [usize],
) -> Result<(), String> {
    let Some((&[_, kind, ..], body)) = bytes.split_first_chunk::<ENCAPSULATION_BYTES>() else {
        return Err(format!("has {} bytes, too few for a CDR header", bytes.len()));
    };
    let big_endian = match kind {
        0 => true,
        1 => false,
        2 | 3 => return Err("is in PL_CDR (a parameter list); import reads plain CDR".to_owned()),
        6..=11 => {
            let name = ["CDR2", "D_CDR2", "PL_CDR2"][usize::from((kind - 6) / 2)];
            return Err(format!("is in {name} (XCDR2); import reads XCDR1, which ROS 2 records"));
        }
        kind => return Err(format!("has the unknown CDR encapsulation {kind:#04x}")),
    };
    let mut walker = Walker { body, at: 0, big_endian, row, lengths };
    walker.all(steps)?;
    let left = body.len() - walker.at;
    if left > PADDING_MAX_BYTES {
        let size = bytes.len();
        return Err(format!("has {size} bytes, {left} more than its schema says"));
    }
    Ok(())
}

struct Walker<'a> {
    /// The message behind its header, to whose start numbers are aligned.
    body: &'a [u8],
    at: usize,
    big_endian: bool,
    row: &'a mut [f64],
    lengths: &'a mut [usize],
}

impl<'a> Walker<'a> {
    fn all(&mut self, steps: &[Step]) -> Result<(), String> {
        for step in steps {
            match step {
                Step::Number(kind, slot) => self.row[*slot] = self.number(*kind)?,
                Step::Skip(kind, count) => {
                    self.take(*kind, *count)?;
                }
                Step::Text(bound) => self.text(*bound)?,
                Step::Time { second, nanosecond, slots } => {
                    let (second, nanosecond) = (self.number(*second)?, self.number(*nanosecond)?);
                    // Both are whole, so the sum rounds once, as MCAP's own times do.
                    let ns = (second as i64)
                        .saturating_mul(1_000_000_000)
                        .saturating_add(nanosecond as i64);
                    for (slot, number) in slots.iter().zip([ns as f64, second, nanosecond]) {
                        if let Some(slot) = slot {
                            self.row[*slot] = number;
                        }
                    }
                }
                Step::List { count, first, other } => {
                    let count = match *count {
                        Count::Fixed(count) => count,
                        Count::Written { bound, id } => self.count(bound, id)?,
                    };
                    let first = &first[..first.len().min(count)];
                    for steps in first {
                        self.all(steps.as_ref().unwrap_or(other))?;
                    }
                    match other.as_slice() {
                        [Step::Skip(kind, 1)] => {
                            self.take(*kind, count - first.len())?;
                        }
                        other => {
                            for _ in first.len()..count {
                                self.all(other)?;
                            }
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// The bytes of so many numbers, after their padding. No numbers have no padding.
    fn take(&mut self, kind: Kind, count: usize) -> Result<&'a [u8], String> {
        let size = kind.size();
        if count == 0 {
            return Ok(&[]);
        }
        let start = self.at.next_multiple_of(size);
        let end = size.checked_mul(count).and_then(|bytes| start.checked_add(bytes));
        match end.and_then(|end| self.body.get(start..end)) {
            Some(bytes) => {
                self.at = start + bytes.len();
                Ok(bytes)
            }
            None => Err(self.short(format_args!("{count} numbers of {size} bytes"))),
        }
    }

    fn number(&mut self, kind: Kind) -> Result<f64, String> {
        let bytes = self.take(kind, 1)?;
        if !self.big_endian {
            return Ok(kind.number(bytes));
        }
        let mut swapped = [0; 8];
        for (to, from) in swapped.iter_mut().zip(bytes.iter().rev()) {
            *to = *from;
        }
        Ok(kind.number(&swapped))
    }

    /// A length, of a sequence or a text.
    fn length(&mut self) -> Result<usize, String> {
        Ok(self.number(Kind::U32)? as usize)
    }

    fn text(&mut self, bound: usize) -> Result<(), String> {
        // The length counts the 0 at the end.
        let length = self.length()?;
        if length > bound.saturating_add(1) {
            return Err(format!("has a text of {length} bytes where its schema allows {bound}"));
        }
        if length > self.body.len() - self.at {
            return Err(self.short(format_args!("a text of {length} bytes")));
        }
        self.at += length;
        Ok(())
    }

    fn count(&mut self, bound: usize, id: usize) -> Result<usize, String> {
        let count = self.length()?;
        if count > bound {
            return Err(format!("has a list of {count} where its schema allows {bound}"));
        }
        // An element has a byte at least.
        if count > self.body.len() - self.at {
            return Err(self.short(format_args!("a list of {count}")));
        }
        if let Some(length) = self.lengths.get_mut(id) {
            *length = count.max(*length);
        }
        Ok(count)
    }

    fn short(&self, what: std::fmt::Arguments<'_>) -> String {
        let (at, left) = (self.at + ENCAPSULATION_BYTES, self.body.len() - self.at);
        format!("ends too early for its schema: {what} at byte {at}, {left} bytes are left")
    }
}
