//! Which effect is missing: evidence under declared tolerances, every hypothesis flown by the simulator's own model.
//!
//! 1. The predictor is linearised in every number of the catalogue ([`linear`]), whitened ([`whiten`]), and everything
//!    floats inside its tolerance ([`parameters`], [`evidence`]).
//! 2. Sets of effects grow, shrink and swap by evidence; each is refined through the simulator ([`search`]), in each of its
//!    published forms ([`forms`]).
//! 3. What is left is held against what noise leaves ([`crate::leftover`]); intervals come from blocks ([`interval`]).

mod evidence;
mod forms;
mod interval;
mod linear;
mod parameters;
mod rivals;
mod search;
mod whiten;

pub(crate) use evidence::BETA;
pub(crate) use linear::{Member, Point, hypothesis};
pub(crate) use parameters::Catalogue;
pub(crate) use search::{Found, NATS_MIN, Scored, Search};

use crate::GapError;
use crate::leftover::{Leftover, leftover};
use crate::predictor::{Hypothesis, Predictor};

/// Deviation of the air's own motion that is no wind worth a name, m/s.
pub(crate) const TURBULENCE_M_S: f64 = 0.12;

/// The best explanation of a set of flights, and what it leaves.
pub(crate) struct Naming {
    pub(crate) found: Found,
    /// The point at which the explanation is best, everything else inside its tolerance, and its hypothesis.
    pub(crate) point: Point,
    pub(crate) hypothesis: Hypothesis,
    /// Rows of the residual: of the vehicle as it is with everything else where it most likely is, and of the explanation.
    pub(crate) nominal: Vec<f64>,
    pub(crate) left: Vec<f64>,
    pub(crate) leftover: Leftover,
    /// Standard deviations of the free numbers.
    pub(crate) deviations: Vec<f64>,
    /// Deviation of gusts, m/s, where there are any.
    pub(crate) gust_m_s: Option<f64>,
}

impl Naming {
    /// What gusts are worth: evidence of the slow horizontal force having the deviation that it has, over the noise's, nats.
    pub(crate) fn gust_nats(&self) -> f64 {
        let horizontal = self.leftover.bands.iter().filter(|b| b.channel < 2);
        horizontal
            .map(|b| {
                let ratio = (b.slow / b.slow_floor).powi(2);
                // Blocks overlap in what they know of a gust that lasts longer than a block.
                0.5 * SLOW_BLOCKS * (ratio - 1.0 - ratio.ln())
            })
            .sum()
    }
}

/// Independent blocks that a flight counts for in the evidence of gusts.
const SLOW_BLOCKS: f64 = 20.0;

/// Finds the best explanation.
///
/// # Errors
/// What the predictor says.
pub(crate) fn explain(search: &Search<'_>) -> Result<Naming, GapError> {
    let found = search.run()?;
    let naming = judge(search, found)?;
    if !naming.leftover.looks_like_gust() {
        return Ok(naming);
    }
    // Gusts look like drag for a while: what is named beside them must be worth it in their noise, too.
    let calm = Search { beta: GUST_BETA, ..*search };
    let mut naming = judge(&calm, calm.run()?)?;
    naming.gust_m_s = gust(search, &naming)?;
    Ok(naming)
}

/// Tempering where gusts blow.
const GUST_BETA: f64 = 0.05;

fn judge(search: &Search<'_>, found: Found) -> Result<Naming, GapError> {
    let (predictor, catalogue) = (search.predictor, search.catalogue);
    let point = search.settled(&found.best);
    let about = hypothesis(predictor, catalogue, &point)?;
    let left = predictor.residual(&about)?;
    let without = Point { members: Vec::new(), base: point.base.clone() };
    let nominal = predictor.residual(&hypothesis(predictor, catalogue, &without)?)?;
    let motions: Vec<_> = (0..predictor.tracks.len()).map(|piece| predictor.motion(piece, &about)).collect();
    let leftover =
        leftover(predictor, &motions, &left, &nominal, &predictor.wind_columns(&about)?, TURBULENCE_M_S);
    let deviations = interval::deviations(predictor, &found.linear, &found.best);
    Ok(Naming { found, point, hypothesis: about, nominal, left, leftover, deviations, gust_m_s: None })
}

/// The deviation of gusts that makes the slow part of the horizontal force, m/s; `None` where the air hardly acts.
fn gust(search: &Search<'_>, naming: &Naming) -> Result<Option<f64>, GapError> {
    let columns = search.predictor.wind_columns(&naming.hypothesis)?;
    let (mut excess, mut slope) = (0.0, 0.0);
    for segment in search.predictor.segments.iter().filter(|s| s.channel < 2) {
        let rows = segment.rows.clone();
        let floor: f64 = naming
            .leftover
            .bands
            .iter()
            .filter(|b| b.channel == segment.channel && b.flight == segment.flight)
            .map(|b| b.whole_floor.powi(2) * rows.len() as f64)
            .sum();
        excess += rows.clone().map(|r| naming.left[r].powi(2)).sum::<f64>() - floor;
        slope += rows.map(|r| columns[0][r].powi(2) + columns[1][r].powi(2)).sum::<f64>();
    }
    let sigma = (excess.max(0.0) / slope + TURBULENCE_M_S.powi(2)).sqrt();
    Ok((sigma.is_finite() && sigma > 0.3).then_some(sigma))
}
