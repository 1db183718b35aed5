//! Whole vehicles on lanes: wings and effects on top of the base model of [`lanes`](super::lanes),
//! and a step of all.
//!
//! Wings and effects that a batch does not have are constants of the code, so that they cost
//! nothing.

use super::lanes::{Airframe, Held, Motion, airflow, body_rate, plus_scaled, rotor_rates, rotors};
use super::rotors::spin;
use super::{Surroundings, body, with_effects};
use crate::aero::membrane::{Membrane, Side};
use crate::aero::{Airflow, BodyWrench, drag, flat_plate};
use crate::effects::{PendulumState, Prepared, Present, Swing};
use crate::lane::Lane;
use crate::lane::vector::{self, minus, rotation, transposed_times, unit};

/// No wing.
pub const NONE: u8 = 0;
/// Flat plate.
pub const FLAT: u8 = 1;
/// Membrane.
pub const MEMBRANE: u8 = 2;

/// What the derivative looks at of a vehicle that has more than the base model.
#[derive(Debug, Clone, Copy)]
pub struct Whole<L: Lane, const ROTORS: usize> {
    /// What does not change.
    pub airframe: Airframe<L, ROTORS>,
    /// Wind and rotor targets.
    pub held: Held<L, ROTORS>,
    /// Angular velocity of the air, NED, rad/s, where it turns.
    pub air_omega: Option<[L; 3]>,
    /// Flat wings.
    pub plate: flat_plate::Pair<L>,
    /// Membrane wings.
    pub membrane: Membrane<L>,
    /// Which effects there are.
    pub present: Present,
    /// Their numbers.
    pub effects: Prepared<L>,
    /// Signs of the rotors' spin about +z.
    pub spin: [L; ROTORS],
    /// A load over a step.
    pub swing: Swing<L>,
    /// Where it hangs.
    pub load: PendulumState<L>,
    /// Mean deployment over the step, left and right.
    pub deployment: [L; 2],
    /// Rate of the angle of attack of each side, rad/s, held over a step.
    pub angle_rate: [L; 2],
}

impl<L: Lane, const ROTORS: usize> Whole<L, ROTORS> {
    /// The same on other lanes.
    #[inline(always)]
    pub fn map<M: Lane>(&self, f: impl Fn(L) -> M) -> Whole<M, ROTORS> {
        Whole {
            airframe: self.airframe.map(&f),
            held: self.held.map(&f),
            air_omega: self.air_omega.map(|air_omega| air_omega.map(&f)),
            plate: self.plate.map(&f),
            membrane: self.membrane.map(&f),
            present: self.present,
            effects: self.effects.map(&f),
            spin: self.spin.map(&f),
            swing: self.swing.map(&f),
            load: self.load.map(&f),
            deployment: self.deployment.map(&f),
            angle_rate: self.angle_rate.map(&f),
        }
    }
}

/// One step: the motion and the membranes at its end. Servos, battery, load and air are stepped
/// beside it.
///
/// * `stages` - one of Euler's, or four of [`runge_kutta`](super::runge_kutta); their number is no
///   constant, so that the derivative is compiled once for both
#[inline(always)]
pub fn step<L: Lane, const ROTORS: usize, const WING: u8, const EFFECTS: bool>(
    whole: &Whole<L, ROTORS>,
    stages: &[[L; 2]],
    state: &Motion<L, ROTORS>,
    sides: &[Side<L>; 2],
) -> (Motion<L, ROTORS>, [Side<L>; 2]) {
    let (mut stage, mut next, mut sides_stage, mut sides_next) = (*state, *state, *sides, *sides);
    for k in 0..stages.len() {
        let (rate, sides_rate) =
            derivative::<L, ROTORS, WING, EFFECTS>(whole, &stage, &sides_stage);
        let [ahead, weight] = stages[k];
        if k + 1 < stages.len() {
            stage = plus_scaled(state, ahead, &rate);
            if WING == MEMBRANE {
                sides_stage = moved(sides, ahead, &sides_rate);
            }
        }
        next = plus_scaled(&next, weight, &rate);
        if WING == MEMBRANE {
            sides_next = moved(&sides_next, weight, &sides_rate);
        }
    }
    next.attitude = unit(&next.attitude);
    (next, sides_next)
}

/// Each side's distance from the x axis, m.
#[inline(always)]
pub fn lateral<L: Lane>(arm_m: L) -> [L; 2] {
    [L::of(0.0) - arm_m, arm_m]
}

#[inline(always)]
fn moved<L: Lane>(sides: &[Side<L>; 2], h: L, rate: &[Side<L>; 2]) -> [Side<L>; 2] {
    [sides[0].plus_scaled(h, &rate[0]), sides[1].plus_scaled(h, &rate[1])]
}

/// Motion through the air.
#[inline(always)]
pub fn air<L: Lane, const ROTORS: usize, const EFFECTS: bool>(
    whole: &Whole<L, ROTORS>,
    state: &Motion<L, ROTORS>,
    columns: &[[L; 3]; 3],
) -> Airflow<L> {
    let mut wind = whole.held.wind;
    if EFFECTS {
        let [north, east] = whole.effects.wind(whole.present, L::of(0.0) - state.position[2]);
        (wind[0], wind[1]) = (wind[0] + north, wind[1] + east);
    }
    let mut air = airflow(state, &wind, columns);
    if let Some(air_omega) = &whole.air_omega {
        air.omega = minus(&air.omega, &transposed_times(columns, air_omega));
    }
    air
}

/// Rate of the motion and of the membranes.
#[inline(always)]
fn derivative<L: Lane, const ROTORS: usize, const WING: u8, const EFFECTS: bool>(
    whole: &Whole<L, ROTORS>,
    state: &Motion<L, ROTORS>,
    sides: &[Side<L>; 2],
) -> (Motion<L, ROTORS>, [Side<L>; 2]) {
    let columns = rotation(&state.attitude);
    let rotor_rate = rotor_rates(&whole.airframe, &whole.held, &state.rotor_speed);
    let (sum, sides_rate) =
        wrench::<L, ROTORS, WING, EFFECTS>(whole, state, sides, &columns, &rotor_rate);
    (body_rate(&whole.airframe, state, &columns, &sum, rotor_rate), sides_rate)
}

/// Force and moment without gravity, body frame, and the rates of the membranes.
///
/// * `columns` - the attitude's rotation to the world
/// * `rotor_rate` - of the rotor speeds, rad/s^2
#[inline(always)]
fn wrench<L: Lane, const ROTORS: usize, const WING: u8, const EFFECTS: bool>(
    whole: &Whole<L, ROTORS>,
    state: &Motion<L, ROTORS>,
    sides: &[Side<L>; 2],
    columns: &[[L; 3]; 3],
    rotor_rate: &[L; ROTORS],
) -> (BodyWrench<L>, [Side<L>; 2]) {
    let none = L::of(0.0);
    let air = air::<L, ROTORS, EFFECTS>(whole, state, columns);
    let airframe = &whole.airframe;
    let rotors = rotors(airframe, &state.rotor_speed);

    let mut sides_rate = *sides;
    let mut rest = BodyWrench::zero();
    if WING == FLAT {
        rest = whole.plate.wrench(whole.plate.normal_forces(&air, &whole.deployment));
    }
    if WING == MEMBRANE {
        let y = lateral(whole.membrane.arm_m);
        let (rate, open) = (&whole.angle_rate, &whole.deployment);
        let ([f, m], left) = wing(&whole.membrane, &air, y[0], [rate[0], open[0]], &sides[0]);
        let ([g, n], right) = wing(&whole.membrane, &air, y[1], [rate[1], open[1]], &sides[1]);
        rest = BodyWrench { force: vector::plus(&f, &g), moment: vector::plus(&m, &n) };
        sides_rate = [left, right];
    }
    let wing_force = rest.force;
    rest.force = minus(&rest.force, &drag(&airframe.linear_drag, airframe.quadratic_drag, &air));
    if !EFFECTS {
        return (rotors.plus(&rest), sides_rate);
    }
    let mut rotor_spin = [none; 2];
    if Prepared::<L>::feel_rotor_spin(whole.present) {
        rotor_spin = [spin(&whole.spin, &state.rotor_speed), spin(&whole.spin, rotor_rate)];
    }
    let at = Surroundings {
        flow: &air,
        omega: &state.omega,
        ned_from_body: columns,
        height_m: none - state.position[2],
        inverse_mass: airframe.inverse_mass,
        rotor_spin,
        rotor_speed: &state.rotor_speed,
        wing_force,
        wings: &whole.plate,
        deployment: whole.deployment,
        tether: if whole.present.has_load() { Some(whole.swing.tether(&whole.load)) } else { None },
    };
    let sum = if L::FITS_A_REGISTER {
        with_effects(&whole.effects, whole.present, [&rotors, &rest], &at)
    } else {
        effects_apart(&whole.effects, whole.present, [&rotors, &rest], &at)
    };
    (sum, sides_rate)
}

/// Force and moment without gravity; what an accelerometer reads without scale and bias, m/s^2, and
/// the angular acceleration, rad/s^2. Body frame, with all effects.
///
/// * `accelerometer_m` - its place from the centre of mass
#[inline(always)]
pub fn felt<L: Lane, const ROTORS: usize, const WING: u8>(
    whole: &Whole<L, ROTORS>,
    state: &Motion<L, ROTORS>,
    sides: &[Side<L>; 2],
    accelerometer_m: &[L; 3],
) -> (BodyWrench<L>, [[L; 3]; 2]) {
    let columns = rotation(&state.attitude);
    let airframe = &whole.airframe;
    let rotor_rate = rotor_rates(airframe, &whole.held, &state.rotor_speed);
    let (sum, _) = wrench::<L, ROTORS, WING, true>(whole, state, sides, &columns, &rotor_rate);
    let inertia = [&airframe.inertia, &airframe.inertia_inverse];
    let turning = body::angular_acceleration(inertia, &state.omega, &sum.moment);
    let centre = vector::scaled(&sum.force, airframe.inverse_mass);
    let felt = body::specific_force(&centre, [&state.omega, &turning], accelerometer_m);
    (sum, [felt, turning])
}

/// [`Membrane::evaluate`]: in place, or as a function of its own, see [`Lane::FITS_A_REGISTER`].
#[inline(always)]
fn wing<L: Lane>(
    membrane: &Membrane<L>,
    air: &Airflow<L>,
    y: L,
    [rate, open]: [L; 2],
    side: &Side<L>,
) -> ([[L; 3]; 2], Side<L>) {
    if L::FITS_A_REGISTER {
        membrane.evaluate(air, y, rate, open, side)
    } else {
        wing_apart(membrane, air, y, [rate, open], side)
    }
}

// One instance for both sides and any number of rotors.
#[inline(never)]
fn wing_apart<L: Lane>(
    membrane: &Membrane<L>,
    air: &Airflow<L>,
    y: L,
    [rate, open]: [L; 2],
    side: &Side<L>,
) -> ([[L; 3]; 2], Side<L>) {
    membrane.evaluate(air, y, rate, open, side)
}

#[inline(never)]
fn effects_apart<L: Lane>(
    numbers: &Prepared<L>,
    present: Present,
    wrenches: [&BodyWrench<L>; 2],
    at: &Surroundings<'_, L>,
) -> BodyWrench<L> {
    with_effects(numbers, present, wrenches, at)
}
