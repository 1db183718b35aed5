//! What is flown after the programme where the hidden effect does not show in that: one flies what
//! the words of the effect ask for.
//!
//! Flights that hide nothing of the kind end with the programme and are what they always were.

use crate::airframe::Airframe;

/// Legs after the programme.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Further {
    /// Two straight descents from high above: the speeds of the reference, m/s.
    pub descents_m_s: Option<[f64; 2]>,
    /// Wings opened in hover, in a climb and a descent of 2.5 m/s, and in dashes of 5 m/s.
    pub opens_wings: bool,
}

/// Effects that the programme does not show.
const SINKING: &str = "vortex_ring";
pub(crate) const BLOWN: &str = "rotor_wash";

/// Where the ring is strong: descents over the speed of the air through the rotors in hover. The
/// vehicle overshoots.
const OF_HOVER: [f64; 2] = [1.0, 1.3];
const DESCENTS_M_S: [f64; 2] = [4.0, 10.0];
/// Time for each kind of legs, whoever flies them, s.
const DESCENTS_S: f64 = 25.0;
const WINGS_S: f64 = 16.5;

impl Further {
    /// What these effects ask for, flown by this vehicle.
    pub fn of<'a>(effects: &(impl Iterator<Item = &'a str> + Clone), nominal: &Airframe) -> Self {
        let hides = |name: &str| effects.clone().any(|hidden| hidden == name);
        let speed = |part: f64| {
            (part * nominal.hover_induced_m_s()).clamp(DESCENTS_M_S[0], DESCENTS_M_S[1])
        };
        Self {
            descents_m_s: hides(SINKING).then(|| OF_HOVER.map(speed)),
            opens_wings: hides(BLOWN),
        }
    }

    /// Time that it takes, s.
    pub fn duration_s(&self) -> f64 {
        let wings = if self.opens_wings { WINGS_S } else { 0.0 };
        wings + if self.descents_m_s.is_some() { DESCENTS_S } else { 0.0 }
    }

    /// What is flown, in words.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if self.opens_wings {
            notes.push(
                "after the programme: wings opened in hover, in a climb and a descent, in slow dashes"
                    .to_owned(),
            );
        }
        if let Some([first, second]) = self.descents_m_s {
            notes.push(format!(
                "after the programme: straight descents of {first:.1} and {second:.1} m/s from high above"
            ));
        }
        notes
    }
}
