//! Records: a setup or a frame, each behind its length.

use super::{Reader, Wire, Writer};
use crate::stack::{SensorFrame, Stack};

/// First bytes of a file of vectors.
pub const MAGIC: [u8; 8] = *b"SQRLVECT";
/// Version of everything in this module.
pub const VERSION: u32 = 9;
/// First byte of a record that holds a setup.
pub const SETUP: u8 = 0;
/// First byte of a record that holds a frame.
pub const FRAME: u8 = 1;
/// No record and no output is longer, bytes.
pub const RECORD_MAX: usize = 4096;

/// What a file of vectors starts with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header {
    /// Setups that follow, each with its frames.
    pub sequences: u32,
    /// Frames of all sequences.
    pub frames: u32,
}

impl Header {
    /// Length of a header, bytes.
    pub const LENGTH: usize = 20;
}

/// Magic, version, counts.
impl Wire for Header {
    fn put(&self, to: &mut Writer<'_>) {
        MAGIC.put(to);
        VERSION.put(to);
        self.sequences.put(to);
        self.frames.put(to);
    }
    fn take(from: &mut Reader<'_>) -> Option<Self> {
        if <[u8; 8]>::take(from)? != MAGIC || u32::take(from)? != VERSION {
            return None;
        }
        Some(Self { sequences: Wire::take(from)?, frames: Wire::take(from)? })
    }
}

/// One record. In the stream its length in bytes stands before it, a `u16`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "no heap, and there is one record at a time")]
pub enum Record {
    /// The flight code from here on; the state is a new one.
    Setup(Stack),
    /// The next step, and the hash of all outputs of its sequence up to it; 0 where nobody knows it
    /// yet.
    Frame(SensorFrame, u64),
}

impl Wire for Record {
    fn put(&self, to: &mut Writer<'_>) {
        match self {
            Self::Setup(stack) => {
                SETUP.put(to);
                stack.put(to);
            }
            Self::Frame(frame, hash) => {
                FRAME.put(to);
                frame.put(to);
                hash.put(to);
            }
        }
    }
    fn take(from: &mut Reader<'_>) -> Option<Self> {
        match u8::take(from)? {
            SETUP => Wire::take(from).map(Self::Setup),
            FRAME => Some(Self::Frame(Wire::take(from)?, Wire::take(from)?)),
            _ => None,
        }
    }
}
