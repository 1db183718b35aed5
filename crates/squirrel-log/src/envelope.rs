//! The frame of an MCAP file around its content: magic bytes, record lengths, the CRCs of data and
//! summary section.
//!
//! mcap's readers check these only on request, do not say where a record stands, and do not tell a
//! file that was cut from one that was changed; it is two loops to do all that on the raw bytes.

use mcap::MAGIC;
use mcap::records::op;

/// Opcode and length.
const HEAD: usize = 1 + 8;

/// One record of a file.
#[derive(Clone, Copy)]
pub(super) struct Frame<'a> {
    pub(super) opcode: u8,
    /// First byte in the file.
    pub(super) start: usize,
    /// The record with its head.
    pub(super) bytes: &'a [u8],
}

impl<'a> Frame<'a> {
    /// The record that starts at byte `start`; `None` if it does not end inside the file.
    fn at(file: &'a [u8], start: usize) -> Option<Self> {
        let rest = &file[start..];
        let (&opcode, tail) = rest.split_first()?;
        let length = u64::from_le_bytes(*tail.first_chunk()?);
        let end = usize::try_from(length).ok()?.checked_add(HEAD)?;
        // There is no record 0: what follows was never written.
        (opcode != 0).then_some(Self { opcode, start, bytes: rest.get(..end)? })
    }

    pub(super) fn body(&self) -> &'a [u8] {
        &self.bytes[HEAD..]
    }

    /// First byte after the record.
    pub(super) fn end(&self) -> usize {
        self.start + self.bytes.len()
    }
}

/// The records of a file, up to the footer or to the first one that is not whole.
pub(super) fn frames(file: &[u8]) -> impl Iterator<Item = Frame<'_>> {
    let first = (file.len() >= MAGIC.len()).then(|| Frame::at(file, MAGIC.len())).flatten();
    std::iter::successors(first, |frame| {
        if frame.opcode == op::FOOTER { None } else { Frame::at(file, frame.end()) }
    })
}

/// Whether the texts of a record end inside it. mcap's parser makes room for what a length says
/// before it looks whether as much is there.
pub(super) fn lengths_fit(opcode: u8, body: &[u8]) -> bool {
    let mut rest = Rest(body);
    let fits = match opcode {
        op::HEADER => rest.texts(2),
        op::SCHEMA => rest.skip(2).and_then(|()| rest.texts(3)),
        op::CHANNEL => rest.skip(4).and_then(|()| rest.texts(2)).and_then(|()| rest.map()),
        op::METADATA => rest.texts(1).and_then(|()| rest.map()),
        // Times, size and CRC before the name of its compression.
        op::CHUNK => rest.skip(28).and_then(|()| rest.texts(1)),
        _ => Some(()),
    };
    fits.is_some()
}

/// What is left of a record.
struct Rest<'a>(&'a [u8]);

impl<'a> Rest<'a> {
    fn take(&mut self, length: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        Some(taken)
    }

    fn skip(&mut self, length: usize) -> Option<()> {
        self.take(length).map(|_| ())
    }

    /// Bytes behind their length.
    fn sized(&mut self) -> Option<&'a [u8]> {
        let length = self.take(4)?.first_chunk()?;
        self.take(usize::try_from(u32::from_le_bytes(*length)).ok()?)
    }

    fn texts(&mut self, count: usize) -> Option<()> {
        (0..count).try_for_each(|_| self.sized().map(|_| ()))
    }

    fn map(&mut self) -> Option<()> {
        let mut entries = Rest(self.sized()?);
        while !entries.0.is_empty() {
            entries.texts(2)?;
        }
        Some(())
    }
}

/// What is wrong with the frame of a file.
#[derive(Debug)]
pub(super) enum Damage {
    /// The end is missing.
    Cut,
    /// Bytes have changed.
    Corrupt(String),
}

/// Checks a file that starts with the magic bytes, or is too short for them.
///
/// A CRC of 0 means by MCAP's rules that the program which wrote the file took none.
pub(super) fn check(file: &[u8]) -> Result<(), Damage> {
    let corrupt = |what: String| Err(Damage::Corrupt(what));
    let mut data_end = None;
    let mut end = MAGIC.len().min(file.len());
    let mut footer = false;
    for frame in frames(file) {
        end = frame.end();
        match frame.opcode {
            op::DATA_END => {
                check_crc("data section", &file[..frame.start], frame)?;
                data_end = Some(end);
            }
            op::FOOTER => {
                let Some(summary) = data_end else {
                    return corrupt("there is a footer but no end of the data section".to_owned());
                };
                check_crc("summary section", &file[summary..end.saturating_sub(4)], frame)?;
                footer = true;
            }
            _ => {}
        }
    }
    let rest = &file[end..];
    match (footer, rest) {
        (true, rest) if rest == MAGIC => Ok(()),
        (true, rest) if !MAGIC.starts_with(rest) => corrupt(format!(
            "{} bytes after the footer are not those that end an MCAP file",
            rest.len()
        )),
        (false, rest) if rest.ends_with(MAGIC) => {
            corrupt(format!("the record at byte {end} runs past the end of the file"))
        }
        _ => Err(Damage::Cut),
    }
}

/// Compares the CRC32 of `bytes` with the last four bytes of a record.
fn check_crc(section: &str, bytes: &[u8], frame: Frame) -> Result<(), Damage> {
    let Some(&saved) = frame.body().last_chunk() else {
        return Err(Damage::Corrupt(format!("the record at byte {} has no CRC32", frame.start)));
    };
    let (saved, found) = (u32::from_le_bytes(saved), crc32fast::hash(bytes));
    if saved != 0 && saved != found {
        return Err(Damage::Corrupt(format!(
            "the {section} has CRC32 {found:08x}, not {saved:08x} as written"
        )));
    }
    Ok(())
}
