//! Arms: who flies. Each pairs a controller with a plant, so that what a gain comes from can be
//! told apart.

use crate::plant::WingPlant;
use crate::vehicle_file::VehicleFile;
use crate::weights::ParnnWeights;
use squirrel_core::control::plus::{Feels, Plus};
use squirrel_core::control::position::PositionGains;
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
    /// The controller of [`Arm::TwccParnn`], likewise.
    PhantomParnn,
    /// TWCC that believes in the flat plate.
    TwccFlat,
    /// TWCC that believes in the paper's network.
    TwccParnn,
    /// TWCC that is told what the plant's wing would do.
    TwccOracle,
    /// [`Arm::TwccFlat`], as well armed as ours: with the reference's motion fed forward and the
    /// limits of `[control.plus]`.
    TwccFlatFf,
    /// [`Arm::TwccParnn`], likewise.
    TwccParnnFf,
    /// [`squirrel_core::control::plus`] with wings: ours.
    TwccPlus,
    /// The same with the wings folded: its fair rival.
    PcPlus,
    /// The same by incremental inversion ([`Feels::Everything`]): what feeling instead of believing
    /// is worth.
    Indi,
    /// A planner that uses the wings, outside of the flight code (`squirrel-plan`).
    PlanWings,
    /// The same planner with the wings folded: its fair rival.
    PlanNoWings,
}

impl Arm {
    /// The arms that the flight code flies alone.
    pub const ALONE: [Self; 13] = [
        Self::Pc,
        Self::PcWingsOpen,
        Self::WiicNoWings,
        Self::Phantom,
        Self::PhantomParnn,
        Self::TwccFlat,
        Self::TwccParnn,
        Self::TwccOracle,
        Self::TwccFlatFf,
        Self::TwccParnnFf,
        Self::TwccPlus,
        Self::PcPlus,
        Self::Indi,
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
            Self::PhantomParnn => "phantom_parnn",
            Self::TwccFlat => "twcc_flat",
            Self::TwccParnn => "twcc_parnn",
            Self::TwccOracle => "twcc_oracle",
            Self::TwccFlatFf => "twcc_flat_ff",
            Self::TwccParnnFf => "twcc_parnn_ff",
            Self::TwccPlus => "twcc_plus",
            Self::PcPlus => "pc_plus",
            Self::Indi => "indi",
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
    /// * `weights` - of the vehicle's network, which arms that believe it need
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
            Self::Pc | Self::PcPlus | Self::Indi | Self::PlanWings | Self::PlanNoWings => {
                WingPolicy::Folded
            }
            Self::PcWingsOpen => WingPolicy::Open,
            Self::WiicNoWings => WingPolicy::CoordinatedWithoutWings,
            Self::Phantom
            | Self::PhantomParnn
            | Self::TwccFlat
            | Self::TwccParnn
            | Self::TwccOracle
            | Self::TwccFlatFf
            | Self::TwccParnnFf
            | Self::TwccPlus => WingPolicy::Coordinated,
        };
        twcc.force_model = match (self, weights) {
            (arm, Some(weights)) if arm.believes_the_network() => {
                ForceModel::Parnn(*weights.parnn())
            }
            (arm, None) if arm.believes_the_network() => {
                let name = self.name();
                return Err(format!(
                    "arm = {name}: needs weights; wing.parnn_weights of the vehicle names none that were read"
                ));
            }
            (arm, _) if arm.is_given_the_force() => ForceModel::Given,
            _ => ForceModel::FlatPlate,
        };
        let needs_plus = matches!(
            self,
            Self::TwccPlus | Self::PcPlus | Self::Indi | Self::TwccFlatFf | Self::TwccParnnFf
        );
        let plus = match twcc.plus.take() {
            None if needs_plus => {
                let name = self.name();
                return Err(format!(
                    "arm = {name}: needs [control.plus] of the vehicle, which is missing"
                ));
            }
            plus => plus,
        };
        match (self, plus) {
            (Self::TwccFlatFf | Self::TwccParnnFf, Some(plus)) => twcc.position = plus.position,
            (Self::Indi, Some(plus)) => {
                // What acts is felt already: a large integral beside it would count it twice.
                let integral_max_m = twcc.position.integral_max_m;
                let position = PositionGains { integral_max_m, ..plus.position };
                twcc.plus = Some(Plus { position, feels: Feels::Everything, ..plus });
            }
            // Of planners it is what flies where commands cease.
            (arm, plus) if needs_plus || arm.plans() => twcc.plus = plus,
            _ => {}
        }
        Ok(())
    }

    fn believes_the_network(self) -> bool {
        matches!(self, Self::TwccParnn | Self::TwccParnnFf | Self::PhantomParnn)
    }

    /// The wing that the plant of this arm has.
    pub fn plant_wing(self, wing: &WingPlant) -> WingPlant {
        if matches!(self, Self::Phantom | Self::PhantomParnn) {
            WingPlant::None
        } else {
            wing.clone()
        }
    }

    /// Whether the simulator tells the flight code what the wings would do.
    pub fn is_given_the_force(self) -> bool {
        self == Self::TwccOracle
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle_file::VehicleFile;
    use squirrel_core::control::plus::TiltLimit;

    /// Rivals as well armed: the paper's law with our gains, ours with another belief.
    #[test]
    fn rivals_have_what_ours_has() {
        let file = VehicleFile::squirrel();
        let of = |arm: Arm| {
            let mut twcc = file.control.unwrap().twcc;
            arm.configure(&mut twcc, file.weights.as_ref()).unwrap();
            twcc
        };
        let ours = of(Arm::TwccPlus);
        let plus = ours.plus.unwrap();
        let fed = of(Arm::TwccFlatFf);
        assert_eq!(fed.position, plus.position);
        assert_eq!(
            TwccParameters { position: of(Arm::TwccFlat).position, ..fed },
            of(Arm::TwccFlat)
        );
        assert_eq!(of(Arm::TwccParnnFf).force_model, of(Arm::TwccParnn).force_model);
        assert_eq!(of(Arm::PhantomParnn), of(Arm::TwccParnn));
        let indi = of(Arm::Indi);
        assert_eq!(
            (indi.policy, indi.plus.unwrap().feels),
            (WingPolicy::Folded, Feels::Everything)
        );
        let mut bare = file.control.unwrap().twcc;
        bare.plus = None;
        for arm in [Arm::TwccFlatFf, Arm::Indi] {
            let error = arm.configure(&mut bare.clone(), None).unwrap_err();
            assert!(error.contains("needs [control.plus]"), "{error}");
        }
    }

    /// Ours lean in a cone unless the vehicle file asks for the box of the paper's laws.
    #[test]
    fn a_file_may_ask_for_the_papers_box() {
        let with = |line: &str| {
            let file = VehicleFile::squirrel();
            let text = file.text.replace("[control.plus]", &format!("[control.plus]\n{line}"));
            assert!(line.is_empty() || text != file.text);
            VehicleFile::parse(&text, "squirrel.toml")
        };
        for (line, limit) in [("", TiltLimit::Cone), ("tilt_limit = \"box\"", TiltLimit::Box)] {
            let file = with(line).unwrap();
            for arm in [Arm::TwccPlus, Arm::PcPlus, Arm::Indi] {
                let mut twcc = file.control.unwrap().twcc;
                arm.configure(&mut twcc, None).unwrap();
                assert_eq!(twcc.plus.unwrap().tilt_limit, limit, "{line} {arm:?}");
            }
        }
        let error = with("tilt_limit = \"sphere\"").unwrap_err().to_string();
        assert!(error.contains("sphere") && error.contains("`box` or `cone`"), "{error}");
    }

    #[test]
    fn names_and_arms_are_one_to_one() {
        for arm in Arm::all() {
            assert_eq!(Arm::parse(arm.name()), Ok(arm));
        }
        assert!(Arm::parse("twcc").unwrap_err().contains("twcc_flat"));
    }
}
