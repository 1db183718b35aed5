//! Arms: who flies. Each pairs a controller with a plant, so that what a gain comes from can be
//! told apart.

use crate::plant::WingPlant;
use crate::vehicle_file::VehicleFile;
use crate::weights::ParnnWeights;
use squirrel_core::control::twcc::{TwccParameters, WingPolicy};
use squirrel_core::control::wing_force::ForceModel;

/// A controller and what it flies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Arm {
    /// The primary controller, wings folded.
    Pc,
    /// The primary controller, wings always open.
    PcWingsOpen,
    /// WIIC's thrust law with a wing force of zero, wings folded.
    WiicNoWings,
    /// The controller of [`Arm::TwccFlat`]; the plant has no wings.
    Phantom,
    /// TWCC that believes in the flat plate.
    TwccFlat,
    /// TWCC that believes in the paper's network.
    TwccParnn,
    /// TWCC that is told what the plant's wing would do.
    TwccOracle,
    /// [`squirrel_core::control::plus`] with wings: ours.
    TwccPlus,
    /// The same with the wings folded: its fair rival.
    PcPlus,
    /// A planner that uses the wings, outside of the flight code (`squirrel-plan`).
    PlanWings,
    /// The same planner with the wings folded: its fair rival.
    PlanNoWings,
}

impl Arm {
    /// The arms that the flight code flies alone.
    pub const ALONE: [Self; 9] = [
        Self::Pc,
        Self::PcWingsOpen,
        Self::WiicNoWings,
        Self::Phantom,
        Self::TwccFlat,
        Self::TwccParnn,
        Self::TwccOracle,
        Self::TwccPlus,
        Self::PcPlus,
    ];

    /// All arms.
    pub fn all() -> impl Iterator<Item = Self> {
        Self::ALONE.into_iter().chain([Self::PlanWings, Self::PlanNoWings])
    }

    /// Whether commands come from a planner outside of the flight code.
    pub fn plans(self) -> bool {
        matches!(self, Self::PlanWings | Self::PlanNoWings)
    }

    /// Name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pc => "pc",
            Self::PcWingsOpen => "pc_wings_open",
            Self::WiicNoWings => "wiic_no_wings",
            Self::Phantom => "phantom",
            Self::TwccFlat => "twcc_flat",
            Self::TwccParnn => "twcc_parnn",
            Self::TwccOracle => "twcc_oracle",
            Self::TwccPlus => "twcc_plus",
            Self::PcPlus => "pc_plus",
            Self::PlanWings => "plan_wings",
            Self::PlanNoWings => "plan_no_wings",
        }
    }

    /// The arm of a name.
    ///
    /// # Errors
    /// One line that lists the names.
    pub fn parse(name: &str) -> Result<Self, String> {
        Self::all().find(|arm| arm.name() == name).ok_or_else(|| {
            let names = Self::all().map(Self::name).collect::<Vec<_>>().join(", ");
            format!("arm = {name}: no such arm; known are {names}")
        })
    }

    /// Whether a vehicle has what this arm needs to know.
    pub fn is_known_to(self, vehicle: &VehicleFile) -> bool {
        let mut twcc = vehicle.control.map(|control| control.twcc);
        twcc.as_mut().is_some_and(|twcc| self.configure(twcc, vehicle.weights.as_ref()).is_ok())
    }

    /// Gives the flight code this arm's policy.
    ///
    /// * `weights` - of the vehicle's network; [`Arm::TwccParnn`] needs them
    ///
    /// # Errors
    /// One line where they are needed and there are none.
    pub fn configure(
        self,
        twcc: &mut TwccParameters,
        weights: Option<&ParnnWeights>,
    ) -> Result<(), String> {
        twcc.policy = match self {
            // Of a planner: what flies before its first command, and where it is lost.
            Self::Pc | Self::PcPlus | Self::PlanWings | Self::PlanNoWings => WingPolicy::Folded,
            Self::PcWingsOpen => WingPolicy::Open,
            Self::WiicNoWings => WingPolicy::CoordinatedWithoutWings,
            Self::Phantom
            | Self::TwccFlat
            | Self::TwccParnn
            | Self::TwccOracle
            | Self::TwccPlus => WingPolicy::Coordinated,
        };
        twcc.force_model = match (self, weights) {
            (Self::TwccParnn, Some(weights)) => ForceModel::Parnn(*weights.parnn()),
            (Self::TwccParnn, None) => {
                let name = self.name();
                return Err(format!(
                    "arm = {name}: needs weights; wing.parnn_weights of the vehicle names none that were read"
                ));
            }
            (arm, _) if arm.is_given_the_force() => ForceModel::Given,
            _ => ForceModel::FlatPlate,
        };
        if !self.is_plus() && !self.plans() {
            twcc.plus = None;
        } else if self.is_plus() && twcc.plus.is_none() {
            return Err(format!(
                "arm = {}: needs [control.plus] of the vehicle, which is missing",
                self.name()
            ));
        }
        Ok(())
    }

    /// Whether the law is [`squirrel_core::control::plus`].
    fn is_plus(self) -> bool {
        matches!(self, Self::TwccPlus | Self::PcPlus)
    }

    /// The wing that the plant of this arm has.
    pub fn plant_wing(self, wing: &WingPlant) -> WingPlant {
        if self == Self::Phantom { WingPlant::None } else { wing.clone() }
    }

    /// Whether the simulator tells the flight code what the wings would do.
    pub fn is_given_the_force(self) -> bool {
        self == Self::TwccOracle
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_arms_are_one_to_one() {
        for arm in Arm::all() {
            assert_eq!(Arm::parse(arm.name()), Ok(arm));
        }
        assert!(Arm::parse("twcc").unwrap_err().contains("twcc_flat"));
    }
}
