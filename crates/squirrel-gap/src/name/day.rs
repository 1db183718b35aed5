//! Thrust that differs from one flight to the next: usually by next to nothing, and with brushed
//! motors, worn cells or a new propeller by per cents. One number for all flights then leaves a
//! force along z that is each flight's own.

use super::gusts::explain;
use super::{Catalogue, Naming, Search};
use crate::GapError;
use crate::predictor::{FORCE_Z, Predictor};
use squirrel_core::effects::Declared;

/// Part of the tolerance of thrust by which it may differ among flights of one machine.
const SHARE_OF_TOLERANCE: f64 = 1.0;

/// How much less of the force must be left with a thrust for each flight, as a part of what one
/// thrust leaves.
const MUCH_LESS: f64 = 0.6;

/// The best explanation, of several flights with a thrust of their own if one thrust leaves a force
/// along z and theirs leave much less.
///
/// * `progress` - called after each piece of work
///
/// # Errors
/// What the predictor says.
pub(super) fn explain_thrusts(
    predictor: &Predictor<'_>,
    catalogue: &mut Catalogue,
    progress: &dyn Fn(),
) -> Result<Naming, GapError> {
    let explained =
        |catalogue: &Catalogue| explain(&Search { predictor, catalogue, gust_m_s: None, progress });
    // Over what is allowed; 0 where it is not above that.
    let force_left = |naming: &Naming| {
        let own = naming.leftover.excess.iter().find(|(channel, _)| *channel == FORCE_Z);
        own.map_or(0.0, |(_, ratio)| *ratio)
    };
    let together = explained(catalogue)?;
    let most = SHARE_OF_TOLERANCE * catalogue.tolerance_of(Declared::Thrust);
    let usual = catalogue.day_fraction;
    if predictor.names.len() < 2 || most <= usual || force_left(&together) == 0.0 {
        return Ok(together);
    }
    catalogue.day_fraction = most;
    let apart = explained(catalogue)?;
    if force_left(&apart) > MUCH_LESS * force_left(&together) {
        catalogue.day_fraction = usual;
        return Ok(together);
    }
    Ok(apart)
}
