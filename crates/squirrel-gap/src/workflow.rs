//! The workflow as a whole: flights to a diagnosis, and what follows from it: the vehicle file with
//! what was found, held-out flights flown again with that, and the report. The command line and
//! Python call it; they differ in where they write.

use crate::GapError;
use crate::add::{add_effect, patched};
use crate::baseline::Baseline;
use crate::checked::Check;
use crate::closed_loop::closed_loop;
use crate::diagnose::{diagnose, diagnose_since};
use crate::diagnosis::Diagnosis;
use crate::picture::picture;
use crate::report;
use squirrel_log::FlightLog;
use squirrel_sim::vehicle_file::VehicleFile;

/// Flights with their names.
pub type Flights = Vec<(String, FlightLog)>;

/// A diagnosis with the vehicle and the flights that it is of.
#[derive(Debug)]
pub struct Workflow {
    /// What was found out.
    pub diagnosis: Diagnosis,
    /// What the flights are worth before any verdict, for the report; none until somebody looks, see
    /// [`check`](crate::check()).
    pub check: Option<Check>,
    vehicle: VehicleFile,
    flights: Vec<String>,
    held_out: Flights,
}

/// A vehicle file with what was found.
#[derive(Debug, Clone)]
pub struct Patched {
    /// Its text, with the comments and the order of the file before.
    pub text: String,
    /// The same, read.
    pub vehicle: VehicleFile,
}

impl Workflow {
    /// Finds out what a vehicle lacks, see [`diagnose`](crate::diagnose()). Flights that are set
    /// aside take no part in what follows.
    ///
    /// * `baseline` - good flights of the same machine; none for a vehicle that is taken as its
    ///   file has it
    ///
    /// # Errors
    /// As [`Baseline::fit`] and [`diagnose_since`].
    pub fn diagnose(
        vehicle: VehicleFile,
        baseline: &[(String, FlightLog)],
        flights: Flights,
        held_out: Flights,
        progress: &dyn Fn(&str),
    ) -> Result<Self, GapError> {
        if !baseline.is_empty() {
            let own = Baseline::fit(&vehicle, baseline, progress)?;
            return Self::diagnose_since(&own, flights, held_out, progress);
        }
        let diagnosis = diagnose(&vehicle, &flights, &held_out, progress)?;
        Ok(Self::of(diagnosis, vehicle, flights, held_out))
    }

    /// Finds out what has changed since the flights of a baseline: for those who have asked it
    /// before, as [`check_since`](crate::check_since) does, and fit it once.
    ///
    /// # Errors
    /// As [`diagnose_since`].
    pub fn diagnose_since(
        baseline: &Baseline,
        flights: Flights,
        held_out: Flights,
        progress: &dyn Fn(&str),
    ) -> Result<Self, GapError> {
        let diagnosis = diagnose_since(baseline, &flights, &held_out, progress)?;
        Ok(Self::of(diagnosis, baseline.declared.clone(), flights, held_out))
    }

    fn of(
        diagnosis: Diagnosis,
        vehicle: VehicleFile,
        flights: Flights,
        mut held_out: Flights,
    ) -> Self {
        let looked_at = |flight: &str| diagnosis.verdict.has_looked_at(flight);
        held_out.retain(|(name, _)| looked_at(name));
        let flights =
            flights.into_iter().map(|(name, _)| name).filter(|name| looked_at(name)).collect();
        Self { diagnosis, check: None, vehicle, flights, held_out }
    }

    /// The vehicle file as it was given.
    pub fn vehicle(&self) -> &VehicleFile {
        &self.vehicle
    }

    /// The vehicle file with what the verdict names, or why it names nothing that a file can take.
    ///
    /// * `fit` - whether the file gets its numbers as these flights have them, too
    ///
    /// # Errors
    /// As [`add`](crate::add()).
    pub fn patched(&self, fit: bool) -> Result<Result<Patched, String>, String> {
        match patched(&self.vehicle, &self.diagnosis, &self.flights, fit)? {
            Ok(text) => self.read(text).map(Ok),
            Err(why) => Ok(Err(why)),
        }
    }

    /// The vehicle file with one effect of an answer that is several.
    ///
    /// # Errors
    /// As [`add_effect`].
    pub fn with_effect(&self, effect: &str) -> Result<Patched, String> {
        self.read(add_effect(&self.vehicle, &self.diagnosis, effect, &self.flights)?)
    }

    fn read(&self, text: String) -> Result<Patched, String> {
        let weights = self.vehicle.weights.clone();
        let vehicle = VehicleFile::parse_with(&text, &self.vehicle.name, weights)
            .map_err(|e| e.to_string())?;
        Ok(Patched { text, vehicle })
    }

    /// Flies held-out flights again in closed loop, as the vehicle was and with what was found; the
    /// verdict then has both.
    ///
    /// # Errors
    /// As [`closed_loop`].
    pub fn fly_again(&mut self, patched: &Patched) -> Result<(), GapError> {
        let (flown, notes) = closed_loop(&self.vehicle, &patched.vehicle, &self.held_out)?;
        self.diagnosis.verdict.closed_loop = flown;
        self.diagnosis.verdict.notes.extend(notes);
        Ok(())
    }

    /// The report, a page of HTML.
    pub fn report(&self, patched: Option<&Patched>) -> String {
        let held_out: Vec<String> = self.held_out.iter().map(|(name, _)| name.clone()).collect();
        let text = patched.map(|patched| patched.text.as_str());
        let mut data = picture(&self.vehicle, &self.diagnosis, &self.flights, &held_out, text);
        data.check.clone_from(&self.check);
        report::render(&data)
    }
}
