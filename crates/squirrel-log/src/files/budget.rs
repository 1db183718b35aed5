//! How much memory the content of one file may take.
//!
//! A packed file can claim any size: 300 kB of zeros are 7 GB. What comes out of a file is at most
//! 100 times as large as the file, or 256 MB where that is more, and 4 GB in all;
//! `SQUIRREL_UNPACKED_MB` in the environment takes the place of all three. Measured: logs of
//! flights are 2 to 20 times as large in memory as in their files.

/// The variable that raises the limit, MB.
const VARIABLE: &str = "SQUIRREL_UNPACKED_MB";
/// How to take more, behind what is refused.
pub(super) const RAISED_BY: &str = "; where it is trusted, SQUIRREL_UNPACKED_MB=N allows N MB";
const MEGABYTE: u64 = 1_000_000;
/// Most that comes out of one file, however large.
const TOTAL_MAX_BYTES: u64 = 4000 * MEGABYTE;
/// Whatever comes out of a file, so much may be.
const ALWAYS_BYTES: u64 = 256 * MEGABYTE;
/// How many times its file a content may be.
const RATIO_MAX: u64 = 100;
/// Most of a text that somebody wrote: 100,000 obstacles are 3 MB. In memory its tables are up to
/// 70 times as large.
pub(super) const TEXT_MAX_BYTES: u64 = 8 * MEGABYTE;

/// What is left of the memory that the content of one file may take.
#[derive(Debug, Clone)]
pub struct Budget {
    most: u64,
    left: u64,
}

/// A file's content is larger than it may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "its content is larger than {}, the most that is taken from a file of this size{RAISED_BY}",
    megabytes(*most)
)]
pub struct TooLarge {
    /// What it may be, bytes.
    pub most: u64,
}

impl Budget {
    /// Of a file of so many bytes.
    pub fn of(file_bytes: u64) -> Self {
        let by_size = Self::by_size(file_bytes);
        let most = asked_bytes().unwrap_or(by_size.most.min(TOTAL_MAX_BYTES));
        Self { most, left: most }
    }

    /// Of a file of so many bytes whose content is not held but looked at as it comes: bounded by the
    /// size of the file alone.
    pub fn by_size(file_bytes: u64) -> Self {
        let by_ratio = file_bytes.saturating_mul(RATIO_MAX).max(ALWAYS_BYTES);
        let most = asked_bytes().unwrap_or(by_ratio);
        Self { most, left: most }
    }

    /// What is left, bytes.
    pub fn left(&self) -> u64 {
        self.left
    }

    /// What is said of more than that.
    pub fn too_large(&self) -> TooLarge {
        TooLarge { most: self.most }
    }

    /// Takes memory that something of the file is about to need.
    ///
    /// # Errors
    /// There is not so much left.
    pub fn take(&mut self, bytes: u64) -> Result<(), TooLarge> {
        self.left = self.left.checked_sub(bytes).ok_or_else(|| self.too_large())?;
        Ok(())
    }

    /// As [`Self::take`], for so many numbers of eight bytes.
    ///
    /// # Errors
    /// There is not so much left.
    pub fn take_numbers(&mut self, count: usize) -> Result<(), TooLarge> {
        self.take((count as u64).saturating_mul(8))
    }
}

/// Most that a file may have.
pub(super) fn content_max_bytes() -> u64 {
    asked_bytes().unwrap_or(TOTAL_MAX_BYTES)
}

/// What the environment asks for.
fn asked_bytes() -> Option<u64> {
    let asked: u64 = std::env::var(VARIABLE).ok()?.trim().parse().ok()?;
    Some(asked.saturating_mul(MEGABYTE))
}

pub(super) fn megabytes(bytes: u64) -> String {
    format!("{} MB", bytes / MEGABYTE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_content_is_held_by_the_size_of_its_file_and_in_total() {
        for (file_bytes, most) in [
            (0, ALWAYS_BYTES),
            (300_000, ALWAYS_BYTES),
            (10 * MEGABYTE, 1000 * MEGABYTE),
            (1000 * MEGABYTE, TOTAL_MAX_BYTES),
            (u64::MAX, TOTAL_MAX_BYTES),
        ] {
            let mut budget = Budget::of(file_bytes);
            assert_eq!(budget.take(most + 1), Err(TooLarge { most }), "{file_bytes}");
            // What was refused is not taken.
            assert_eq!(budget.take(most - 8), Ok(()));
            assert_eq!(budget.take_numbers(1), Ok(()));
            assert_eq!(budget.take(1), Err(TooLarge { most }));
            assert_eq!(budget.take_numbers(usize::MAX), Err(TooLarge { most }));
        }
    }
}
