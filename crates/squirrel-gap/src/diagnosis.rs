//! What the workflow found out, and what its pictures are made of.

use crate::proof::HeldOut;
use crate::report::{Conditional, FlightPanel, Whiteness};
use crate::verdict::Verdict;
use squirrel_sim::vehicle_file::VehicleFile;

/// Everything that the workflow found out.
#[derive(Debug)]
pub struct Diagnosis {
    /// The answer.
    pub verdict: Verdict,
    /// What the flights covered: name, low, high, unit.
    pub domain: Vec<Covered>,
    /// The vehicle with its numbers where good flights of the machine have them, if flights are
    /// compared with such.
    pub(crate) before: Option<Own>,
    /// The same where these flights have them.
    pub(crate) now: Option<Own>,
    /// For the report.
    pub(crate) details: Option<Details>,
}

/// A machine as flights have it.
#[derive(Debug)]
pub(crate) struct Own {
    pub(crate) vehicle: VehicleFile,
    /// Where its numbers come from, as vehicle files say it.
    pub(crate) source: String,
}

/// A range of flight conditions that the flights covered, 2nd to 98th percentile.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Covered {
    /// What: speed, height, tilt, voltage.
    pub name: &'static str,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Unit of both.
    pub unit: &'static str,
}

/// What the pictures are made of.
#[derive(Debug)]
pub(crate) struct Details {
    pub(crate) evidence: Vec<(&'static str, f64)>,
    pub(crate) confusability: (Vec<&'static str>, Vec<Vec<f64>>),
    pub(crate) held_out: Option<HeldOut>,
    pub(crate) seen: Seen,
}

/// What only the predictor and the search know.
#[derive(Debug)]
pub(crate) struct Seen {
    pub(crate) flights: Vec<FlightPanel>,
    pub(crate) conditional: Vec<Conditional>,
    pub(crate) whiteness: Vec<Whiteness>,
    /// Refined sets by name with their evidence over none, nats; the answer first, if there is one.
    pub(crate) sets: Vec<(String, f64)>,
    pub(crate) has_answer: bool,
    pub(crate) rival: String,
    /// Effect, key and declared tolerance of the numbers of the answer.
    pub(crate) tolerances: Vec<(&'static str, &'static str, f64)>,
}
