//! Sensors whose samples go into the log as they are, late like any other's; of them the flight code
//! hears the voltage alone.
//!
//! Each is one file, with the keys of its table in `[sensors]`, its devices and what it reads
//! (`Reads`), and a line of [`Logged`].

mod battery;
mod range_finder;

pub use battery::BatterySensor;
pub(super) use battery::VOLTAGE;
pub use range_finder::RangeFinderSensor;

use super::Truth;
use super::line::Line;
use super::parameters::Timing;
use super::table::Table;
use rand_pcg::Pcg64Mcg;
use std::sync::Arc;

/// Channels of a sample with their numbers.
pub type Row = Vec<(&'static str, f64)>;

/// What a sensor reads.
trait Reads: std::fmt::Debug + Send + Sync {
    /// A sample; `None` where it has nothing to say.
    fn read(&self, truth: &Truth, rng: &mut Pcg64Mcg) -> Option<Row>;
}

/// The sensors: name of the table, which is that of the source in the log, numbers, those that a
/// vehicle has if its file says nothing, and the random stream, whose number never changes its
/// meaning (`line.rs` has the others).
macro_rules! logged {
    ($($(#[$doc:meta])* $name:ident: $kind:ty = $default:expr, stream $stream:literal;)*) => {
        /// Those of a vehicle, each where there is one.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct Logged {
            $($(#[$doc])* pub $name: Option<$kind>,)*
        }

        impl Default for Logged {
            fn default() -> Self {
                Self { $($name: $default,)* }
            }
        }

        impl Logged {
            /// Names of all.
            pub(super) const NAMES: &[&str] = &[$(stringify!($name)),*];

            /// One by its name; one that is not there is added.
            pub(super) fn table(&mut self, name: &str) -> Option<&mut dyn Table> {
                match name {
                    $(stringify!($name) => Some(self.$name.get_or_insert_default()),)*
                    _ => None,
                }
            }

            /// Those that are there, ready to fly.
            pub(super) fn lines(&self, seed: u64) -> Vec<LoggedLine> {
                let all = [$(self.$name.map(|s| LoggedLine::new(stringify!($name), s.timing, s, seed, $stream)),)*];
                all.into_iter().flatten().collect()
            }
        }
    };
}

logged! {
    /// Battery monitor.
    battery: BatterySensor = Some(BatterySensor::default()), stream 5;
    /// Range finder.
    range_finder: RangeFinderSensor = None, stream 16;
}

/// One sensor in one flight.
#[derive(Debug, Clone)]
pub(super) struct LoggedLine {
    source: &'static str,
    sensor: Arc<dyn Reads>,
    line: Line<Row>,
}

impl LoggedLine {
    fn new(
        source: &'static str,
        timing: Timing,
        sensor: impl Reads + 'static,
        seed: u64,
        stream: u64,
    ) -> Self {
        Self { source, sensor: Arc::new(sensor), line: Line::numbered(timing, seed, stream) }
    }

    /// The source, and what has arrived of it.
    pub(super) fn poll(&mut self, time_us: u64, truth: &Truth) -> Option<(&'static str, Row)> {
        let row = self.line.poll(time_us, |rng| self.sensor.read(truth, rng))?;
        Some((self.source, row))
    }
}
