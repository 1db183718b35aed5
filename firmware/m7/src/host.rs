//! Files of the host, and records in them, by semihosting.
//!
//! The debugger, here QEMU, opens and reads files for the program. Standard input and output of
//! QEMU are files too (`/dev/stdin`), so that one program reads from a file or from a pipe alike.

use core::fmt;
use cortex_m_semihosting::{debug, nr, syscall};
use squirrel_core::stack::wire::RECORD_MAX;

const OPEN_READ_BINARY: usize = 1;
const OPEN_WRITE_BINARY: usize = 5;

/// A file of the host.
#[derive(Debug)]
pub struct File {
    handle: usize,
}

impl File {
    /// Opens for reading; `None` where the host refuses. `path` ends with a zero.
    #[must_use]
    pub fn open(path: &[u8]) -> Option<Self> {
        Self::with_mode(path, OPEN_READ_BINARY)
    }

    /// Opens for writing from the begin; `None` where the host refuses. `path` ends with a zero.
    #[must_use]
    pub fn create(path: &[u8]) -> Option<Self> {
        Self::with_mode(path, OPEN_WRITE_BINARY)
    }

    fn with_mode(path: &[u8], mode: usize) -> Option<Self> {
        let length = path.len().checked_sub(1)?;
        // SAFETY: the host reads `length` bytes and the zero behind them, all of which are in
        // `path`.
        let handle = unsafe { syscall!(OPEN, path.as_ptr(), mode, length) };
        (handle != usize::MAX).then_some(Self { handle })
    }

    /// Fills the buffer; `false` where the file ends before.
    pub fn read(&mut self, buffer: &mut [u8]) -> bool {
        let mut at = 0;
        while let Some(rest) = buffer.get_mut(at..).filter(|rest| !rest.is_empty()) {
            // SAFETY: the host writes at most `rest.len()` bytes, into `rest`.
            let missing = unsafe { syscall!(READ, self.handle, rest.as_mut_ptr(), rest.len()) };
            let got = rest.len().saturating_sub(missing);
            if got == 0 {
                return false;
            }
            at += got;
        }
        true
    }

    /// Writes everything; `false` where the host refuses.
    pub fn write(&mut self, mut bytes: &[u8]) -> bool {
        while !bytes.is_empty() {
            // SAFETY: the host reads `bytes.len()` bytes of `bytes`.
            let missing = unsafe { syscall!(WRITE, self.handle, bytes.as_ptr(), bytes.len()) };
            let written = bytes.len().saturating_sub(missing);
            if written == 0 {
                return false;
            }
            bytes = bytes.get(written..).unwrap_or(&[]);
        }
        true
    }

    /// The next record without its length; `None` at the end, or where a length is none.
    pub fn record<'a>(&mut self, buffer: &'a mut [u8; RECORD_MAX]) -> Option<&'a mut [u8]> {
        let mut length = [0; 2];
        if !self.read(&mut length) {
            return None;
        }
        let record = buffer.get_mut(..usize::from(u16::from_le_bytes(length)))?;
        self.read(record).then_some(record)
    }
}

impl fmt::Write for File {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        if self.write(text.as_bytes()) { Ok(()) } else { Err(fmt::Error) }
    }
}

/// The first argument after the program's name, with a zero behind it; `None` where there is none
/// or it is too long.
pub fn argument(buffer: &mut [u8; 256]) -> Option<&[u8]> {
    let mut block = [buffer.as_mut_ptr() as usize, buffer.len()];
    // SAFETY: the host writes at most as many bytes as the block says, into `buffer`, and the
    // length into the block.
    let failed =
        unsafe { cortex_m_semihosting::syscall1(nr::GET_CMDLINE, block.as_mut_ptr() as usize) };
    let length = block[1];
    let line = buffer.get_mut(..length.checked_add(1)?).filter(|_| failed == 0)?;
    *line.last_mut()? = 0;
    let space = line.iter().position(|byte| *byte == b' ')?;
    line.get(space + 1..)
}

/// Ends the emulation; the exit code of QEMU says whether all went well.
pub fn exit(well: bool) -> ! {
    let code = if well { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE };
    loop {
        debug::exit(code);
    }
}
