//! The frame of an MCAP file around its content: magic bytes, record lengths, the CRCs of data and
//! summary section.
//!
//! mcap's readers check these only on request, do not say where a record stands, and do not tell a
//! file that was cut from one that was changed; it is two loops to do all that on the raw bytes.

use mcap::MAGIC;
use mcap::records::op;
use mcap::sans_io::LinearReader;
use std::io::{ErrorKind, Read, Result, Seek, SeekFrom};

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

/// The head of a record.
#[derive(Clone, Copy)]
pub(super) struct Head {
    pub(super) opcode: u8,
    /// First byte in the file.
    pub(super) start: u64,
    /// Length of what is behind the head.
    pub(super) body_bytes: u64,
}

impl Head {
    /// `None` if the record does not end inside the file.
    ///
    /// * `left` - bytes from its start to the end of the file
    fn new(bytes: [u8; HEAD], start: u64, left: u64) -> Option<Self> {
        let [opcode, length @ ..] = bytes;
        let body_bytes = u64::from_le_bytes(length);
        let fits = body_bytes.checked_add(HEAD as u64).is_some_and(|bytes| bytes <= left);
        // There is no record 0: what follows was never written.
        (opcode != 0 && fits).then_some(Self { opcode, start, body_bytes })
    }

    fn end(self) -> u64 {
        self.start + HEAD as u64 + self.body_bytes
    }

    /// The record, whose bytes are at hand.
    pub(super) fn frame(self, bytes: &[u8]) -> Frame<'_> {
        let start = usize::try_from(self.start).unwrap_or(usize::MAX);
        Frame { opcode: self.opcode, start, bytes }
    }
}

impl<'a> Frame<'a> {
    /// The record that starts at byte `start`; `None` if it does not end inside the file.
    fn at(file: &'a [u8], start: usize) -> Option<Self> {
        let rest = &file[start..];
        let head = Head::new(*rest.first_chunk()?, start as u64, rest.len() as u64)?;
        let bytes = rest.get(..usize::try_from(head.body_bytes).ok()? + HEAD)?;
        Some(head.frame(bytes))
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

/// The records of a file that is not held, as [`frames`].
pub(super) struct Walk<R> {
    file: R,
    /// Length of the file.
    bytes: u64,
    /// Start of the next record, of which the head may have been read.
    next: u64,
    head: Option<Head>,
    is_over: bool,
}

impl<R: Read + Seek> Walk<R> {
    /// * `bytes` - length of the file
    pub(super) fn new(file: R, bytes: u64) -> Self {
        Self { file, bytes, next: MAGIC.len() as u64, head: None, is_over: false }
    }

    /// The next record's head, the same until it is read or skipped.
    pub(super) fn head(&mut self) -> Result<Option<Head>> {
        if self.head.is_none() && !self.is_over {
            let left = self.bytes.saturating_sub(self.next);
            if left >= HEAD as u64 {
                self.file.seek(SeekFrom::Start(self.next))?;
                let mut head = [0; HEAD];
                self.file.read_exact(&mut head)?;
                self.head = Head::new(head, self.next, left);
            }
        }
        Ok(self.head)
    }

    pub(super) fn skip(&mut self, head: Head) {
        self.next = head.end();
        self.is_over = head.opcode == op::FOOTER;
        self.head = None;
    }

    /// Reads the record with its head.
    pub(super) fn record(&mut self, head: Head, into: &mut Vec<u8>) -> Result<()> {
        into.clear();
        self.file.seek(SeekFrom::Start(head.start))?;
        let bytes = HEAD as u64 + head.body_bytes;
        if self.file.by_ref().take(bytes).read_to_end(into)? as u64 != bytes {
            return Err(ErrorKind::UnexpectedEof.into());
        }
        self.skip(head);
        Ok(())
    }
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

/// Bytes that a chunk unpacks to by its own word; `None` if its content cannot be so much. mcap's
/// reader makes room for what it is told.
pub(super) fn unpacked_bytes(chunk: &[u8]) -> Option<u64> {
    let mut rest = Rest(chunk);
    // Behind two times; before the content stand its CRC, packing and length.
    rest.skip(16)?;
    let told = u64::from_le_bytes(*rest.take(8)?.first_chunk()?);
    rest.skip(4)?;
    let packing = rest.sized()?;
    let length = u64::from_le_bytes(*rest.take(8)?.first_chunk()?);
    let content = rest.take(usize::try_from(length).ok()?)?;
    let most = match packing {
        b"zstd" => zstd::zstd_safe::decompress_bound(content).ok()?,
        b"" => length,
        // Nothing that is read here.
        _ => u64::MAX,
    };
    (told <= most).then_some(told)
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
    /// What the disk said.
    Io(std::io::Error),
}

impl From<std::io::Error> for Damage {
    fn from(error: std::io::Error) -> Self {
        Self::Io(error)
    }
}

/// Checks a file that starts with the magic bytes, or is too short for them.
///
/// A CRC of 0 means by MCAP's rules that the program which wrote the file took none.
///
/// * `bytes` - length of the file
pub(super) fn check(file: &mut dyn Read, bytes: u64) -> std::result::Result<(), Damage> {
    let corrupt = |what: String| Err(Damage::Corrupt(what));
    let mut sum = Sum { file, crc: crc32fast::Hasher::new(), last: [0; 8] };
    let mut end = bytes.min(MAGIC.len() as u64);
    let (mut has_data_end, mut footer) = (false, false);
    sum.pass(end)?;
    let mut rest = bytes - end;
    while rest >= HEAD as u64 && !footer {
        let before = sum.crc.clone();
        let head = Head::new(sum.head()?, end, rest);
        rest -= HEAD as u64;
        let Some(head) = head else { break };
        match head.opcode {
            op::DATA_END => {
                sum.pass(head.body_bytes)?;
                check_crc("data section", before, head, sum.saved())?;
                (sum.crc, has_data_end) = (crc32fast::Hasher::new(), true);
            }
            op::FOOTER => {
                if !has_data_end {
                    return corrupt("there is a footer but no end of the data section".to_owned());
                }
                sum.pass(head.body_bytes.saturating_sub(4))?;
                let summary = sum.crc.clone();
                sum.pass(head.body_bytes.min(4))?;
                check_crc("summary section", summary, head, sum.saved())?;
                footer = true;
            }
            _ => sum.pass(head.body_bytes)?,
        }
        rest -= head.body_bytes;
        end = head.end();
    }
    sum.pass(rest)?;
    let after = bytes - end;
    let last = &sum.last[8 - after.min(8) as usize..];
    match footer {
        true if after == MAGIC.len() as u64 && last == MAGIC => Ok(()),
        true if after >= MAGIC.len() as u64 || !MAGIC.starts_with(last) => {
            corrupt(format!("{after} bytes after the footer are not those that end an MCAP file"))
        }
        false if after >= MAGIC.len() as u64 && last == MAGIC => {
            corrupt(format!("the record at byte {end} runs past the end of the file"))
        }
        _ => Err(Damage::Cut),
    }
}

/// Reads a file once, from its begin to its end, and sums it up.
struct Sum<'a> {
    file: &'a mut dyn Read,
    crc: crc32fast::Hasher,
    /// The last bytes that were read.
    last: [u8; 8],
}

impl Sum<'_> {
    fn head(&mut self) -> Result<[u8; HEAD]> {
        let mut head = [0; HEAD];
        self.file.read_exact(&mut head)?;
        self.see(&head);
        Ok(head)
    }

    /// Reads so many bytes.
    fn pass(&mut self, mut bytes: u64) -> Result<()> {
        let mut part = [0; 16 << 10];
        while bytes > 0 {
            let now = bytes.min(part.len() as u64) as usize;
            self.file.read_exact(&mut part[..now])?;
            self.see(&part[..now]);
            bytes -= now as u64;
        }
        Ok(())
    }

    fn see(&mut self, bytes: &[u8]) {
        self.crc.update(bytes);
        let kept = bytes.len().min(8);
        self.last.rotate_left(kept);
        self.last[8 - kept..].copy_from_slice(&bytes[bytes.len() - kept..]);
    }

    /// The last four bytes, where a record has its checksum.
    fn saved(&self) -> u32 {
        let [.., a, b, c, d] = self.last;
        u32::from_le_bytes([a, b, c, d])
    }
}

/// Compares a CRC32 with the one that a record has in its last four bytes.
fn check_crc(
    section: &str,
    found: crc32fast::Hasher,
    head: Head,
    saved: u32,
) -> std::result::Result<(), Damage> {
    if head.body_bytes < 4 {
        return Err(Damage::Corrupt(format!("the record at byte {} has no CRC32", head.start)));
    }
    let found = found.finalize();
    if saved != 0 && saved != found {
        return Err(Damage::Corrupt(format!(
            "the {section} has CRC32 {found:08x}, not {saved:08x} as written"
        )));
    }
    Ok(())
}

/// Gives a reader the bytes that it asks for, as far as there are any.
pub(super) fn feed(reader: &mut LinearReader, rest: &mut &[u8], need: usize) {
    let (now, later) = rest.split_at(need.min(rest.len()));
    reader.insert(now.len()).copy_from_slice(now);
    reader.notify_read(now.len());
    *rest = later;
}
