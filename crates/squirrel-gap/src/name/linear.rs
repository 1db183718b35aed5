//! The predictor linearised about a set of effects: one column a number, by difference of two
//! predictions.
//!
//! A column without rows is one of zeros: heights, where no effect of height acts.

use super::column::Column;
use super::evidence::{BETA, Gram, inner};
use super::parameters::Catalogue;
use super::point::{Member, Other, Point, hypothesis};
use super::search::LEAST;
use super::whiten::Whitener;
use crate::GapError;
use crate::leftover::noise;
use crate::predictor::{DYNAMIC, FORCE_Z, HEIGHT_KNOTS, Predictor};
use nalgebra::{DMatrix, DVector};

/// The predictor as a linear model about a point.
#[derive(Clone)]
pub(crate) struct Linear {
    pub(crate) point: Point,
    pub(crate) whitener: Whitener,
    /// Columns as they are, in the units of the rows: as in [`Point::base`], and then what no
    /// hypothesis has ([`super::slow`]).
    pub(crate) raw: Vec<Column>,
    /// The same, whitened.
    pub(crate) columns: Vec<Column>,
    /// Tolerances of the columns, one standard deviation.
    pub(crate) tolerance: Vec<f64>,
    /// Inner products of the whitened columns.
    pub(crate) gram: DMatrix<f64>,
    /// Columns are slopes at the point, and not secants from nothing to sizes that are typical.
    near: bool,
}

impl Linear {
    /// Predicts every number once about a point, fits the whitening to what the fullest model
    /// leaves, and whitens.
    ///
    /// * `before` - the same predictor about another point: what floats beside the catalogue is
    ///   its, and with the same members columns that hardly bend
    /// * `gust_m_s` - deviation of gusts that blow: the noise is then theirs, by simulation
    ///
    /// # Errors
    /// What the predictor says.
    pub(crate) fn about(
        predictor: &Predictor,
        catalogue: &Catalogue,
        point: &Point,
        before: Option<Self>,
        gust_m_s: Option<f64>,
    ) -> Result<Self, GapError> {
        let alike = before.as_ref().is_some_and(|before| before.is_about(&point.members));
        let mut before = before.map(|before| before.raw);
        let about = hypothesis(predictor, catalogue, point)?;
        let residual = predictor.residual(&about)?;
        let first = point.base.iter().all(|x| *x == 0.0) && point.members.is_empty();
        let (mut raw, mut tolerance, mut widest) = (Vec::new(), Vec::new(), Vec::new());
        // A column is the change of the residual for a step, of one flight or of all.
        let difference = |moved: &Point, step: f64, flight| -> Result<Vec<f64>, GapError> {
            predictor.slope(&residual, &hypothesis(predictor, catalogue, moved)?, step, flight)
        };
        for (column, parameter) in catalogue.parameters.iter().enumerate() {
            let mut moved = point.clone();
            let member = moved.members.iter_mut().find(|m| m.candidate == parameter.candidate);
            let is_named = member.is_some();
            // At first anything may be large; about a point that explains the flights, only what
            // has a name.
            widest.push(if first || is_named { parameter.slab } else { 3.0 * parameter.tolerance });
            tolerance.push(parameter.tolerance);
            // From nothing, a secant to a typical size: it ranks large effects well, and some have
            // no slope there. Once what is large has a name, a step of the tolerance: what is left
            // stays inside it.
            let step = if let Some(member) = member {
                member.values[parameter.slot] += 0.1 * parameter.smallest;
                0.1 * parameter.smallest
            } else {
                let far = first || catalogue.starts_flat(parameter.candidate);
                let near = parameter.tolerance.max(0.1 * parameter.smallest);
                let step = if far { (parameter.smallest * parameter.largest).sqrt() } else { near };
                moved.base[column] += step;
                step
            };
            // What has a slope of its own below what the file has: lags and delays, and what starts
            // flat, of which a file may have too much.
            let own = catalogue.absent(predictor, parameter.candidate).values[parameter.slot];
            let is_flat = catalogue.starts_flat(parameter.candidate);
            let down = if is_named {
                None
            } else if is_flat && own >= parameter.smallest {
                Some(own - LEAST * parameter.smallest)
            } else {
                (first && parameter.signed && catalogue.bends(parameter.candidate)).then_some(step)
            };
            let keeps = alike && !is_named && !catalogue.bends(parameter.candidate);
            raw.push(match &mut before {
                Some(before) if keeps => std::mem::take(&mut before[column]),
                _ => {
                    let ahead = difference(&moved, step, None)?;
                    Column::of(if let Some(down) = down {
                        // Far from nothing, the two sides are not alike: the one that explains
                        // more.
                        moved.base[column] -= step + down;
                        let back = difference(&moved, -down, None)?;
                        let left = |c: &[f64], x: f64| -> f64 {
                            residual.iter().zip(c).map(|(r, c)| (r - c * x).powi(2)).sum()
                        };
                        if left(&ahead, step) <= left(&back, -down) { ahead } else { back }
                    } else {
                        ahead
                    })
                }
            });
        }
        for column in raw.len()..catalogue.columns(predictor) {
            let (other, sd) = catalogue.other(column);
            widest.push(sd);
            tolerance.push(sd);
            raw.push(match (other, &mut before) {
                (Other::Height { .. }, _) => Column::default(),
                // What cannot be off needs no column.
                _ if sd == 0.0 => Column::default(),
                (_, Some(before)) if !catalogue.goes_with_members(column) => {
                    std::mem::take(&mut before[column])
                }
                (other, _) => {
                    let mut moved = point.clone();
                    moved.base[column] += sd;
                    let flight =
                        if let Other::Flight { flight, .. } = other { Some(flight) } else { None };
                    Column::of(difference(&moved, sd, flight)?)
                }
            });
        }
        for (column, height) in height_columns(predictor, catalogue, point, &residual)? {
            raw[column] = height;
        }
        let mut whitener = whitener(predictor, &raw, &widest, &residual);
        if let Some(sigma) = gust_m_s {
            let draws = noise(predictor, &predictor.wind_columns(&about)?, sigma);
            whitener.refit(&predictor.segments, &draws, DYNAMIC);
        }
        let columns: Vec<Column> =
            raw.iter().map(|c| whitener.apply_to(&predictor.segments, c)).collect();
        let gram = inner(&columns.iter().collect::<Vec<_>>());
        Ok(Self { point: point.clone(), whitener, raw, columns, tolerance, gram, near: !first })
    }

    /// The same model of fewer channels.
    ///
    /// * `channels` - those that say nothing any more
    pub(super) fn without(predictor: &Predictor, of: &Self, channels: &[usize]) -> Self {
        let mut whitener = of.whitener.clone();
        whitener.leave_out(channels);
        let columns: Vec<Column> =
            of.raw.iter().map(|c| whitener.apply_to(&predictor.segments, c)).collect();
        let gram = inner(&columns.iter().collect::<Vec<_>>());
        Self { whitener, columns, gram, ..of.clone() }
    }

    fn is_about(&self, members: &[Member]) -> bool {
        members.iter().map(|m| m.candidate).eq(self.point.members.iter().map(|m| m.candidate))
    }

    /// Whether slopes beside a set are known, even of what bends.
    pub(super) fn knows(&self, members: &[Member]) -> bool {
        self.near && self.is_about(members)
    }
}

/// Columns of the heights, by index, where an effect of height acts.
///
/// # Errors
/// What the predictor says.
pub(super) fn height_columns(
    predictor: &Predictor,
    catalogue: &Catalogue,
    point: &Point,
    residual: &[f64],
) -> Result<Vec<(usize, Column)>, GapError> {
    let mut all = Vec::new();
    if !catalogue.feels_height(&point.members) {
        return Ok(all);
    }
    let mut first = catalogue.shared_columns();
    for flight in 0..predictor.names.len() {
        let heights: Vec<usize> = (first..catalogue.columns(predictor))
            .filter(|column| matches!(catalogue.other(*column).0, Other::Height { flight: f } if f == flight))
            .collect();
        let [lowest, ..] = heights[..] else { continue };
        first = lowest + HEIGHT_KNOTS;
        // The force feels the height of its own time alone: one change of the whole flight's height
        // is shared out by time. Upwards: a vehicle that a barometer has near or below the ground
        // feels no slope there.
        let step = -0.5 * catalogue.other(lowest).1;
        let mut moved = point.clone();
        for column in &heights {
            moved.base[*column] += step;
        }
        let change = predictor.slope(
            residual,
            &hypothesis(predictor, catalogue, &moved)?,
            1.0,
            Some(flight),
        )?;
        for (knot, column) in heights.into_iter().enumerate() {
            let mut slope = vec![0.0; residual.len()];
            for segment in predictor.segments.iter().filter(|s| s.flight == flight) {
                let track = &predictor.tracks[segment.piece];
                for (i, row) in segment.rows.clone().enumerate() {
                    let share = track.height_share(knot, segment.t0_s + i as f64 * segment.step_s);
                    slope[row] = share * change[row] / step;
                }
            }
            all.push((column, Column::of(slope)));
        }
    }
    Ok(all)
}

/// Standard deviations that a number may be off by in a flight that nothing was fitted to.
const INSIDE: f64 = 3.0;
/// Steps towards the heights of flights.
const HEIGHT_STEPS: usize = 5;

/// Puts what the sensors and the thrust of flights were off by where it fits best inside its
/// tolerance: of flights that nothing was fitted to, this is not known from others.
///
/// Sensors as evidence has it, thrust by the plain error of its force: to noise that is known to be
/// slow, a thrust that is off for a whole flight is next to nothing.
///
/// * `thrust_fraction` - by how much thrust may differ from that of the flights that were fitted
///
/// # Errors
/// What the predictor says.
pub(crate) fn settle_flights(
    predictor: &Predictor,
    catalogue: &Catalogue,
    whitener: &Whitener,
    thrust_fraction: f64,
    point: &mut Point,
) -> Result<(), GapError> {
    let segments = &predictor.segments;
    let residual = predictor.residual(&hypothesis(predictor, catalogue, point)?)?;
    let mut of_flights: Vec<(usize, f64, Column)> = Vec::new();
    let mut thrusts: Vec<(usize, f64, Vec<f64>)> = Vec::new();
    for column in catalogue.shared_columns()..catalogue.columns(predictor) {
        let (Other::Flight { flight, is_thrust }, sd) = catalogue.other(column) else { continue };
        let sd = if is_thrust { thrust_fraction.max(sd) } else { sd };
        let mut moved = point.clone();
        moved.base[column] += sd;
        let slope = predictor.slope(
            &residual,
            &hypothesis(predictor, catalogue, &moved)?,
            sd,
            Some(flight),
        )?;
        if is_thrust {
            thrusts.push((column, sd, slope.clone()));
        }
        of_flights.push((column, sd, whitener.apply_to(segments, &Column::of(slope))));
    }
    for _ in 0..HEIGHT_STEPS {
        let residual = predictor.residual(&hypothesis(predictor, catalogue, point)?)?;
        let heights = height_columns(predictor, catalogue, point, &residual)?;
        let is_last = heights.is_empty();
        let (mut index, mut sd, mut white) = (Vec::new(), Vec::new(), Vec::new());
        for (column, own_sd, own) in &of_flights {
            index.push(*column);
            sd.push(*own_sd);
            white.push(own.clone());
        }
        for (column, slope) in heights {
            index.push(column);
            sd.push(catalogue.other(column).1);
            white.push(whitener.apply_to(segments, &slope));
        }
        let mut y = whitener.apply(segments, &residual);
        for (column, c) in index.iter().zip(&white) {
            c.add_scaled_to(&mut y, point.base[*column]);
        }
        let Some(posterior) = Gram::new(&white, &Column::of(y)).posterior(&sd, BETA) else { break };
        for ((column, x), sd) in index.iter().zip(posterior.mean.iter()).zip(&sd) {
            point.base[*column] = x.clamp(-INSIDE * sd, INSIDE * sd);
        }
        if is_last {
            break;
        }
    }
    let residual = predictor.residual(&hypothesis(predictor, catalogue, point)?)?;
    let of_thrust = segments.iter().filter(|s| s.channel == FORCE_Z).map(|s| s.rows.clone());
    for (column, sd, slope) in thrusts {
        let [along, square] =
            of_thrust.clone().flatten().fold([0.0, 0.0], |[along, square], row| {
                [along + residual[row] * slope[row], square + slope[row] * slope[row]]
            });
        if square > 0.0 {
            let x = point.base[column] + along / square;
            point.base[column] = x.clamp(-INSIDE * sd, INSIDE * sd);
        }
    }
    Ok(())
}

/// The whitening of what the fullest model leaves: each pass fits every column, then the
/// autoregression to the rest.
fn whitener(
    predictor: &Predictor,
    columns: &[Column],
    widest: &[f64],
    residual: &[f64],
) -> Whitener {
    // A first whitening by what changes from row to row: one fitted to the whole residual would
    // take whatever is slow in it for noise and never give it back.
    let doubt = predictor.doubt();
    let mut whitener = Whitener::white(&predictor.segments, residual);
    for _ in 0..3 {
        let white: Vec<Column> =
            columns.iter().map(|c| whitener.apply_to(&predictor.segments, c)).collect();
        let y = Column::of(whitener.apply(&predictor.segments, residual));
        let gram = Gram::new(&white, &y);
        let Some(posterior) = gram.posterior(widest, 1.0) else { break };
        let left = subtract(residual, columns, &posterior.mean);
        whitener = Whitener::fit(&predictor.segments, &left, &doubt);
    }
    whitener
}

/// `y - X theta`.
fn subtract(y: &[f64], columns: &[Column], theta: &DVector<f64>) -> Vec<f64> {
    let mut left = y.to_vec();
    for (column, x) in columns.iter().zip(theta.iter()) {
        column.take_scaled_from(&mut left, *x);
    }
    left
}
