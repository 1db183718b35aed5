//! Thrust that differs from one flight to the next: usually by next to nothing, and with brushed motors, worn cells or a new
//! propeller by per cents. One number for all flights then leaves a force along z that is each flight's own.

use super::{Catalogue, Naming, Search, explain};
use crate::GapError;
use crate::predictor::Predictor;

/// The channel that shows it.
const FORCE_Z: usize = 2;
/// Part of the tolerance of thrust by which it may differ among flights of one machine.
const SHARE_OF_TOLERANCE: f64 = 0.5;

/// The best explanation, of several flights with a thrust of their own if one thrust leaves a force along z and theirs do not.
///
/// * `progress` - called after each piece of work
///
/// # Errors
/// What the predictor says.
pub(crate) fn explain_flights(
    predictor: &Predictor<'_>,
    catalogue: &mut Catalogue,
    progress: &dyn Fn(),
) -> Result<Naming, GapError> {
    let explained =
        |catalogue: &Catalogue| explain(&Search { predictor, catalogue, gust_m_s: None, progress });
    let leaves_force =
        |naming: &Naming| naming.leftover.excess.iter().any(|(channel, _)| *channel == FORCE_Z);
    let together = explained(catalogue)?;
    let most = SHARE_OF_TOLERANCE * catalogue.tolerance_of("thrust_fraction");
    let usual = catalogue.day_fraction;
    if predictor.names.len() < 2 || most <= usual || !leaves_force(&together) {
        return Ok(together);
    }
    catalogue.day_fraction = most;
    let apart = explained(catalogue)?;
    if leaves_force(&apart) {
        catalogue.day_fraction = usual;
        return Ok(together);
    }
    Ok(apart)
}
