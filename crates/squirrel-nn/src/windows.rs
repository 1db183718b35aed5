//! What models learn from: windows of what the network sees, with the force that was there at their
//! end, flight by flight.
//!
//! Neighbouring windows of a flight share nine of ten rows, so a split by window would let a model
//! look up its test set. Sets are therefore split by flight only.

use crate::error::NnError;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use squirrel_core::rnn::parnn::{INPUTS, WINDOW};
use std::ops::Range;

/// One window and the force at its last row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// [`features`](squirrel_core::rnn::parnn::features) at 10 Hz, oldest first.
    pub rows: [[f32; INPUTS]; WINDOW],
    /// Velocity at the last row, m/s, relative to what `rows` were made with.
    pub velocity_body_m_s: [f32; 3],
    /// Attitude at the last row, Hamilton, body to NED.
    pub q_ned_from_body_wxyz: [f32; 4],
    /// Force of the air on the wings by the flight log, N.
    pub label_body_n: [f32; 3],
    /// The same without noise where a simulator knows it, N.
    pub truth_body_n: Option<[f32; 3]>,
}

impl Window {
    /// Why nothing can be learned from it: field, numbers, reason.
    fn problem(&self) -> Option<(&'static str, Vec<f32>, &'static str)> {
        let fields: [(_, &[f32]); 5] = [
            ("rows", self.rows.as_flattened()),
            ("velocity_body_m_s", &self.velocity_body_m_s),
            ("q_ned_from_body_wxyz", &self.q_ned_from_body_wxyz),
            ("label_body_n", &self.label_body_n),
            ("truth_body_n", self.truth_body_n.as_ref().map_or(&[], |truth| truth)),
        ];
        let not_finite =
            fields.into_iter().find(|(_, numbers)| numbers.iter().any(|x| !x.is_finite()));
        if let Some((field, numbers)) = not_finite {
            return Some((field, numbers.to_vec(), "must be finite"));
        }
        let q = self.q_ned_from_body_wxyz;
        let square: f32 = q.iter().map(|x| x * x).sum();
        // 1 % off in length.
        (!((square - 1.0).abs() < 0.02))
            .then(|| ("q_ned_from_body_wxyz", q.to_vec(), "must have norm 1"))
    }

    pub(crate) fn ned_from_body(&self) -> UnitQuaternion<f32> {
        let [w, x, y, z] = self.q_ned_from_body_wxyz;
        UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z))
    }

    /// The label as the paper has it, `m a - m g e3 + U n` in NED, N (docs/equations.md T21): that
    /// of the body frame turned by the measured attitude, whose error comes with it. The paper's
    /// rival of paRNN learns it, nothing else needs it.
    pub fn label_ned_n(&self) -> [f32; 3] {
        (self.ned_from_body() * Vector3::from(self.label_body_n)).into()
    }
}

/// A flight's part of the windows.
#[derive(Debug, Clone, PartialEq)]
struct Flight {
    name: String,
    range: Range<usize>,
}

/// Windows of several flights, checked.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Windows {
    windows: Vec<Window>,
    flights: Vec<Flight>,
}

impl Windows {
    /// No flights yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a flight's windows in the order of time.
    ///
    /// # Errors
    /// A flight of this name is there already, or a window has a number that is not finite or an
    /// attitude that is no rotation.
    pub fn push(&mut self, flight: &str, windows: &[Window]) -> Result<(), NnError> {
        if self.flights.iter().any(|known| known.name == flight) {
            return Err(NnError::SameName { flight: flight.to_owned() });
        }
        for (window, w) in windows.iter().enumerate() {
            if let Some((field, value, reason)) = w.problem() {
                return Err(NnError::Window {
                    flight: flight.to_owned(),
                    window,
                    field,
                    value,
                    reason,
                });
            }
        }
        let start = self.windows.len();
        self.windows.extend_from_slice(windows);
        self.flights.push(Flight { name: flight.to_owned(), range: start..self.windows.len() });
        Ok(())
    }

    /// All windows, flight by flight.
    pub fn all(&self) -> &[Window] {
        &self.windows
    }

    /// Names of the flights and their windows, as they were added.
    pub fn flights(&self) -> impl Iterator<Item = (&str, &[Window])> {
        self.flights
            .iter()
            .map(|flight| (flight.name.as_str(), &self.windows[flight.range.clone()]))
    }

    /// The other flights, and those that are held out.
    ///
    /// # Errors
    /// A name that no flight has.
    pub fn split(&self, held_out: &[&str]) -> Result<(Self, Self), NnError> {
        if let Some(flight) =
            held_out.iter().find(|name| self.flights.iter().all(|f| f.name != **name))
        {
            return Err(NnError::NoFlight { flight: (*flight).to_owned() });
        }
        let (mut kept, mut out) = (Self::new(), Self::new());
        for (name, windows) in self.flights() {
            let set = if held_out.contains(&name) { &mut out } else { &mut kept };
            set.push(name, windows)?;
        }
        Ok((kept, out))
    }

    /// Of all that a model can learn from, in order, and of the flights' names; tells in a weights
    /// file which data it was trained on. FNV-1a.
    pub fn hash(&self) -> u64 {
        let mut hash = Fnv::new();
        for (name, windows) in self.flights() {
            hash.bytes(name.as_bytes());
            hash.bytes(&(windows.len() as u64).to_le_bytes());
            for window in windows {
                hash.numbers(window.rows.as_flattened());
                hash.numbers(&window.velocity_body_m_s);
                hash.numbers(&window.q_ned_from_body_wxyz);
                hash.numbers(&window.label_body_n);
            }
        }
        hash.0
    }
}

/// Fowler, Noll and Vo's hash: a dozen lines that give the same number everywhere; nobody attacks
/// it here.
struct Fnv(u64);

impl Fnv {
    fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
    fn bytes(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
    fn numbers(&mut self, numbers: &[f32]) {
        for number in numbers {
            self.bytes(&number.to_bits().to_le_bytes());
        }
    }
}
