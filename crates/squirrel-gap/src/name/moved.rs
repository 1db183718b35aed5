//! What floats beside the named effects and moved with them: numbers of effects hold together with
//! these alone.

use super::point::{Airframe, WING_PLACE};
use super::refine::Scored;
use super::search::{ACTS, Search};
use crate::predictor::LATE;
use crate::verdict::Moved;
use squirrel_core::effects::{Effects, Kind};

impl Search<'_> {
    /// Numbers of the vehicle that an explanation has moved by most of their tolerance, the
    /// farthest first.
    pub(crate) fn moved(&self, set: &Scored) -> Vec<Moved> {
        let (catalogue, point) = (self.catalogue, self.settled(set));
        let mut all: Vec<Moved> = point.base[..catalogue.shared_columns()]
            .iter()
            .enumerate()
            .map(|(column, value)| Moved {
                name: self.floating(column),
                value: *value,
                sd: set.posterior.variance(set.free.len() + column).sqrt(),
                tolerance: match catalogue.parameters.get(column) {
                    Some(parameter) => parameter.tolerance,
                    None => catalogue.other(column).1,
                },
            })
            .filter(|moved| moved.tolerance > 0.0 && moved.far() >= ACTS)
            .collect();
        all.sort_by(|a, b| b.far().total_cmp(&a.far()));
        all
    }

    /// The name of a number that floats: `weak_rotor[2].thrust_loss_fraction`,
    /// `rotor[0].position_body_m[1]`.
    fn floating(&self, column: usize) -> String {
        let Some(parameter) = self.catalogue.parameters.get(column) else {
            return match self.catalogue.airframe[column - self.catalogue.parameters.len()].0 {
                Airframe::Arm { rotor, axis } => format!("rotor[{rotor}].position_body_m[{axis}]"),
                Airframe::Torque { rotor } => format!("rotor[{rotor}].torque_fraction"),
                Airframe::Drag { axis } => format!("drag.linear_n_s_per_m[{axis}]"),
                Airframe::Wing { axis } => WING_PLACE[axis].to_owned(),
                Airframe::DragCentre { axis } => format!("drag.centre_body_m[{axis}]"),
                Airframe::Late { sensor } => LATE[sensor].to_owned(),
            };
        };
        let candidate = &self.catalogue.candidates[parameter.candidate];
        let list = Effects::<f64>::parameters(candidate.effect).unwrap_or_default();
        let choice = candidate.fixed.iter().find_map(|(slot, value)| match list[*slot].kind {
            Kind::Rotor => Some(format!("[{value}]")),
            Kind::OneOf(names) if list[*slot].key != squirrel_core::effects::FORM => {
                Some(format!("[{}]", names[*value as usize]))
            }
            _ => None,
        });
        format!("{}{}.{}", candidate.effect, choice.unwrap_or_default(), parameter.key)
    }
}
