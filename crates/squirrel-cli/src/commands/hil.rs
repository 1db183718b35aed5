//! The flight code on an emulated Cortex-M7, the plant here: `squirrel fly --hil qemu`.
//!
//! QEMU runs the image `link` of `firmware/m7`. Records of [`squirrel_core::stack::wire`] go to its
//! standard input, outputs come from its standard output; the two wait for each other, so that wall
//! time means nothing.

use super::export_vectors::record;
use squirrel_core::stack::wire::{Reader, Record, Wire};
use squirrel_core::stack::{SensorFrame, Stack, StackOutput};
use squirrel_sim::flight::{FlightComputer, FlightError};
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

const QEMU: &str = "qemu-system-arm";

/// An emulated flight computer. Its emulator ends with it.
pub(crate) struct EmulatedM7 {
    emulator: Child,
    to: ChildStdin,
    from: ChildStdout,
}

impl EmulatedM7 {
    /// Starts the emulator on an image and sends it the flight code's setup.
    ///
    /// # Errors
    /// One line where image or emulator are missing, or it does not listen.
    pub(crate) fn start(image: &Path, stack: &Stack) -> Result<Self, String> {
        if !image.is_file() {
            return Err(format!(
                "{}: no such image; `cargo xtask firmware` builds it",
                image.display()
            ));
        }
        let mut emulator = Command::new(QEMU)
            .args(["-machine", "mps2-an500", "-cpu", "cortex-m7", "-nographic", "-monitor", "none"])
            .args(["-serial", "none", "-semihosting-config", "enable=on,target=native", "-kernel"])
            .arg(image)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|e| format!("{QEMU}: {e}"))?;
        let (Some(to), Some(from)) = (emulator.stdin.take(), emulator.stdout.take()) else {
            return Err(format!("{QEMU}: no pipes"));
        };
        let mut computer = Self { emulator, to, from };
        computer.send(&Record::Setup(*stack))?;
        Ok(computer)
    }

    fn send(&mut self, what: &Record) -> Result<(), String> {
        self.to.write_all(&record(what)?).map_err(|e| format!("{QEMU}: to it: {e}"))
    }

    fn ask(&mut self, frame: &SensorFrame) -> Result<(StackOutput, u32), String> {
        self.send(&Record::Frame(*frame, 0))?;
        let from = |e: std::io::Error| format!("{QEMU}: from it: {e}");
        let mut length = [0; 2];
        self.from.read_exact(&mut length).map_err(from)?;
        let mut bytes = vec![0; usize::from(u16::from_le_bytes(length))];
        self.from.read_exact(&mut bytes).map_err(from)?;
        let mut reader = Reader::new(&bytes);
        let answer = StackOutput::take(&mut reader).zip(u32::take(&mut reader));
        answer.filter(|_| reader.is_empty()).ok_or_else(|| {
            format!("{QEMU}: {} bytes are no output; is its image of this version?", bytes.len())
        })
    }
}

impl FlightComputer for EmulatedM7 {
    fn step(&mut self, frame: &SensorFrame) -> Result<(StackOutput, u32), FlightError> {
        self.ask(frame)
            .map_err(|e| FlightError(format!("at {:.3} s: {e}", frame.time_us as f64 * 1e-6)))
    }
}

impl Drop for EmulatedM7 {
    fn drop(&mut self) {
        // It has no state worth saving, and one that hangs must not outlive us.
        let _ = self.emulator.kill();
        let _ = self.emulator.wait();
    }
}
