//! What floats beside the named effects and moved with them: numbers of effects hold together with these alone.

use super::evidence::BETA;
use super::parameters::Parameter;
use super::point::Airframe;
use super::refine::Scored;
use super::search::{ACTS, Search, WEAK_ROTOR};
use crate::decide::INTERVAL;
use crate::verdict::{Moved, RotorHealth, Value};
use squirrel_core::effects::{Effects, Kind};

impl Search<'_> {
    /// Numbers of the vehicle that an explanation has moved by most of their tolerance, the farthest first.
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

    /// How each rotor is against what the vehicle file has, if every one may be off; none where the flights do not show it.
    pub(crate) fn rotors(&self, null: &Scored) -> Vec<RotorHealth> {
        let catalogue = self.catalogue;
        let effect = |p: &Parameter| catalogue.candidates[p.candidate].effect;
        let own: Vec<usize> = (0..catalogue.parameters.len())
            .filter(|c| effect(&catalogue.parameters[*c]) == WEAK_ROTOR)
            .collect();
        let mut prior = null.prior.clone();
        for column in &own {
            prior[*column] = catalogue.parameters[*column].slab;
        }
        let Some(posterior) = null.gram.posterior(&prior, BETA) else { return Vec::new() };
        let health = |(i, column): (usize, usize)| {
            let (value, sd) = (posterior.mean[column], posterior.variance(column).sqrt());
            let (low, high) = (value - INTERVAL * sd, value + INTERVAL * sd);
            let usual = catalogue.parameters[column].tolerance;
            RotorHealth { rotor: i + 1, thrust_loss_fraction: Value::Number { value, low, high }, usual }
        };
        own.into_iter().enumerate().map(health).collect()
    }

    /// The name of a number that floats: `weak_rotor[2].thrust_loss_fraction`, `rotor[0].position_body_m[1]`.
    fn floating(&self, column: usize) -> String {
        let Some(parameter) = self.catalogue.parameters.get(column) else {
            return match self.catalogue.airframe[column - self.catalogue.parameters.len()].0 {
                Airframe::Arm { rotor, axis } => format!("rotor[{rotor}].position_body_m[{axis}]"),
                Airframe::Torque { rotor } => format!("rotor[{rotor}].torque_fraction"),
                Airframe::Drag { axis } => format!("drag.linear_n_s_per_m[{axis}]"),
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
