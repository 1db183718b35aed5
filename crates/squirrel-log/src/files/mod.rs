//! The one place where files are opened, written and locked: how much of one is read, that it
//! appears under its name only when it is whole, and which paths are one file.
//!
//! What a file says is not believed: [`Budget`] holds what its content may take in memory.

mod budget;
mod lock;
mod names;
mod place;
mod read;
mod write;

pub use budget::{Budget, TooLarge};
pub use lock::Lock;
pub use names::{acts, spelt_out};
pub use place::FileId;
pub use read::{begin, open, read, read_text};
pub use write::{Growing, append, folder, writable, write_whole};
