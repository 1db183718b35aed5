//! `squirrel vehicle`: vehicle files.

mod check;
mod diff;
mod export;
mod fit;
mod new;

/// What to do with a vehicle file.
#[derive(Debug, clap::Subcommand)]
pub(crate) enum VehicleCommand {
    /// Check a file and show its numbers with tolerance and source.
    Check(check::Check),
    /// Make a first file from mass, frame and propeller; what nobody gives is guessed, and says so.
    New(Box<new::New>),
    /// Replace numbers of a file by what a thrust stand, a hover or a swing shows.
    Fit(fit::Fit),
    /// Compare two files: the numbers that differ, and what that does in flight.
    Diff(diff::Diff),
    /// Write a file for another simulator; what that cannot express is named with its size.
    Export(export::Export),
}

impl VehicleCommand {
    /// What the arguments lack, which is wrong usage.
    pub(crate) fn lacks(&mut self) -> Option<String> {
        match self {
            Self::New(new) => new.lacks(),
            Self::Fit(fit) => fit.lacks(),
            Self::Check(_) | Self::Diff(_) | Self::Export(_) => None,
        }
    }

    pub(crate) fn run(&self) -> Result<(), String> {
        match self {
            Self::Check(check) => check.run(),
            Self::New(new) => new.run(),
            Self::Fit(fit) => fit.run(),
            Self::Diff(diff) => diff.run(),
            Self::Export(export) => export.run(),
        }
    }
}
