//! A plant on lanes: its numbers as [`Whole`], and what it says at many measured motions at once.
//!
//! The equations are those of [`Plant::led`], on registers of moments, so that the bits are, too. A
//! residual of a flight asks at thousands of moments, and of dozens of hypotheses.

use super::{Led, Plant, PlantState, WingPlant};
use crate::simd::{BLOCK, Kernel, Path, Paths, Register};
use squirrel_core::aero::flat_plate;
use squirrel_core::aero::membrane::{Membrane, Side};
use squirrel_core::dynamics::lanes::{Airframe, Held, Motion};
use squirrel_core::dynamics::rotors::spin_signs;
use squirrel_core::dynamics::whole::{self, FLAT, MEMBRANE, Whole};
use squirrel_core::effects::{PendulumState, Swing};
use squirrel_core::frames::{Body, In, Wrench};
use squirrel_core::lane::{Row, load, put, store, take};
use squirrel_core::nalgebra::Vector3;
use squirrel_core::vehicle::{MAX_ROTORS, PerRotor, ROTOR_BLOCK};

impl Plant {
    /// What does not change from moment to moment, in still air with folded wings; `None` where the
    /// wings are a network.
    pub(super) fn whole<const ROTORS: usize>(&self) -> Option<Whole<f64, ROTORS>> {
        let first = |all: &PerRotor<f64>| core::array::from_fn(|i| all[i]);
        let own = self.vehicle.parameters().wing;
        let (plate, membrane) = match &self.wing {
            // No wing is one of no area: a variant of its own would only be compiled once more.
            WingPlant::None => (None, None),
            WingPlant::Flat { wing, .. } => (Some(*wing), None),
            WingPlant::Membrane { membrane, .. } => (own, Some(membrane.parameters().numbers())),
            WingPlant::Parnn { .. } => return None,
        };
        let mut airframe = Airframe::new(&self.vehicle, self.acting.rotor_extra_time_constant_s());
        if self.rotor_speeds {
            airframe.inverse_lag = [0.0; 2];
        }
        Some(Whole {
            airframe,
            held: Held::all(0.0),
            air_omega: None,
            plate: plate.as_ref().map_or(flat_plate::Pair::all(0.0), flat_plate::Pair::new),
            membrane: membrane.unwrap_or(Membrane::all(0.0)),
            present: self.acting.present(),
            effects: *self.acting.numbers(),
            spin: first(&spin_signs(&self.vehicle)),
            swing: self.swing.unwrap_or(Swing::all(0.0)),
            load: PendulumState::at_rest(),
            deployment: [0.0; 2],
            angle_rate: [0.0; 2],
        })
    }

    /// Nothing yet, for about so many states of this plant or of one that differs in numbers alone.
    pub fn side_by_side(&self, states: usize) -> SideBySide {
        let network = matches!(self.wing, WingPlant::Parnn { .. }).then(Vec::new);
        SideBySide { states: 0, rows: Vec::with_capacity(states.div_ceil(BLOCK)), network }
    }

    /// What [`Self::led`] says at each state, in order; in air that moves only by effects.
    pub fn led_at(&self, states: &SideBySide) -> Vec<Led> {
        self.ask(states, false)
    }

    /// Likewise with rotors that stand still.
    pub fn led_at_without_rotors(&self, states: &SideBySide) -> Vec<Led> {
        self.ask(states, true)
    }

    fn ask(&self, states: &SideBySide, still: bool) -> Vec<Led> {
        if self.vehicle.rotor_blocks() == 1 {
            self.ask_of::<ROTOR_BLOCK>(states, still)
        } else {
            self.ask_of::<MAX_ROTORS>(states, still)
        }
    }

    fn ask_of<const ROTORS: usize>(&self, states: &SideBySide, still: bool) -> Vec<Led> {
        let Some(whole) = self.whole::<ROTORS>() else {
            let stopped = |state: &PlantState| {
                let mut state = *state;
                if still {
                    state.body.rotor_speed_rad_s = [0.0; MAX_ROTORS];
                }
                self.led(&state)
            };
            return states.network.iter().flatten().map(stopped).collect();
        };
        let place_m = self.effects.accelerometer_position().vector.into();
        let (whole, path) = (&whole, Path::best());
        let mut led = Vec::with_capacity(states.states);
        for blocks in states.rows.chunks(BLOCKS) {
            let felt = if matches!(self.wing, WingPlant::Membrane { .. }) {
                f64::run(path, Ask::<ROTORS, MEMBRANE> { whole, blocks, still, place_m })
            } else {
                f64::run(path, Ask::<ROTORS, FLAT> { whole, blocks, still, place_m })
            };
            for (rows, [force, moment, specific, turning]) in blocks.iter().zip(&felt) {
                for lane in 0..BLOCK.min(states.states - led.len()) {
                    led.push(Led {
                        wrench: Wrench { force: vector(force, lane), moment: vector(moment, lane) },
                        specific_force: self.read(vector(specific, lane), rows.time_s[lane]),
                        angular_acceleration: vector(turning, lane),
                    });
                }
            }
        }
        led
    }
}

/// The vector in column `lane`.
fn vector(rows: &[Row<f64>; 3], lane: usize) -> In<Body, f64> {
    In::new(Vector3::from(take(rows, lane)))
}

/// Blocks that are asked at once: what comes out of them stays near the processor.
const BLOCKS: usize = 8;

/// States that have met measured motions. They are laid side by side once, and many plants are
/// asked.
#[derive(Debug)]
pub struct SideBySide {
    states: usize,
    rows: Vec<Rows>,
    /// The states as they are, too, for wings that are a network.
    network: Option<Vec<PlantState>>,
}

/// One block of states.
#[derive(Debug, Clone)]
struct Rows {
    motion: Motion<Row<f64>, MAX_ROTORS>,
    target_speed: [Row<f64>; MAX_ROTORS],
    sides: [Side<Row<f64>>; 2],
    angle_rate: [Row<f64>; 2],
    deployment: [Row<f64>; 2],
    load: PendulumState<Row<f64>>,
    time_s: Row<f64>,
}

impl Rows {
    fn empty() -> Self {
        let none = [0.0; BLOCK];
        Self {
            motion: Motion::all(none),
            target_speed: [none; MAX_ROTORS],
            sides: [Side::all(none); 2],
            angle_rate: [none; 2],
            deployment: [none; 2],
            load: PendulumState::all(none),
            time_s: none,
        }
    }
}

impl SideBySide {
    /// One more state.
    pub fn push(&mut self, state: &PlantState) {
        if let Some(network) = &mut self.network {
            network.push(*state);
        }
        let lane = self.states % BLOCK;
        if lane == 0 {
            self.rows.push(Rows::empty());
        }
        let Some(rows) = self.rows.last_mut() else { return };
        rows.motion.put(lane, &Motion::from(&state.body));
        put(&mut rows.target_speed, lane, state.drive.target_rad_s);
        for side in 0..2 {
            rows.sides[side].put(lane, &state.membrane.side(side));
        }
        put(&mut rows.angle_rate, lane, state.wing_angle_rate_rad_s);
        put(&mut rows.deployment, lane, state.deployment());
        rows.load.put(lane, &state.load);
        rows.time_s[lane] = state.time_s;
        self.states += 1;
    }
}

/// [`whole::felt`] at each state of some blocks.
struct Ask<'a, const ROTORS: usize, const WING: u8> {
    whole: &'a Whole<f64, ROTORS>,
    blocks: &'a [Rows],
    /// Rotors stand still.
    still: bool,
    place_m: [f64; 3],
}

/// Force, moment, specific force without scale and bias, and angular acceleration of a block.
type Felt = [[Row<f64>; 3]; 4];

impl<const ROTORS: usize, const WING: u8> Kernel<f64> for Ask<'_, ROTORS, WING> {
    type Output = Vec<Felt>;

    #[inline(always)]
    fn run<L: Register<Element = f64>>(self) -> Vec<Felt> {
        let mut vehicle = self.whole.map(L::splat);
        let place_m = self.place_m.map(L::splat);
        let mut out = vec![[[[0.0; BLOCK]; 3]; 4]; self.blocks.len()];
        for (rows, out) in self.blocks.iter().zip(&mut out) {
            for start in (0..BLOCK).step_by(L::WIDTH) {
                let all = Motion::<L, MAX_ROTORS>::load(&rows.motion, start);
                let mut rotor_speed = [L::of(0.0); ROTORS];
                for i in 0..ROTORS {
                    if !self.still {
                        rotor_speed[i] = all.rotor_speed[i];
                    }
                    vehicle.held.target_speed[i] = L::load(&rows.target_speed[i][start..]);
                }
                let state = Motion {
                    position: all.position,
                    velocity: all.velocity,
                    attitude: all.attitude,
                    omega: all.omega,
                    rotor_speed,
                };
                let [left, right] = &rows.sides;
                let sides = [Side::load(left, start), Side::load(right, start)];
                vehicle.angle_rate = load(&rows.angle_rate, start);
                vehicle.deployment = load(&rows.deployment, start);
                vehicle.load = PendulumState::load(&rows.load, start);
                let (sum, felt) =
                    whole::felt::<L, ROTORS, WING>(&vehicle, &state, &sides, &place_m);
                store(&sum.force, &mut out[0], start);
                store(&sum.moment, &mut out[1], start);
                store(&felt[0], &mut out[2], start);
                store(&felt[1], &mut out[3], start);
            }
        }
        out
    }
}
