//! Random demands for the weighted allocation: the same here and in the tests of the host, which include this file.

use squirrel_core::control::allocation::{Allocation, AllocationTerms, Weights};
use squirrel_core::control::mixer::ThrustTorque;
use squirrel_core::nalgebra::{Matrix3, Vector3};
use squirrel_core::vehicle::{
    CommandKind, Drag, Limits, MAX_ROTORS, Parameters, PerRotor, Propulsion, Rotor, Vehicle,
};

/// Demands of a kind.
pub const EACH: u32 = 2500;
/// Hash of all thrusts of all kinds, one after the other.
pub const EXPECTED: u64 = 0x7016_8A40_D740_0E06;
/// Where it starts.
pub const HASH_START: u64 = 0xCBF2_9CE4_8422_2325;
/// Most thrust of a rotor, N.
const MOST_N: f32 = 5.4;

/// What is asked of whom.
#[derive(Clone, Copy, PartialEq)]
pub enum Kind {
    /// Four rotors, what they can give.
    Within,
    /// Four rotors, up to three times what they can give.
    Beyond,
    /// Four rotors, one of them out or weak.
    Weak,
    /// Eight rotors, up to three times what they can give, some of them weak.
    Eight,
}

/// In the order of the hash.
pub const KINDS: [Kind; 4] = [Kind::Within, Kind::Beyond, Kind::Weak, Kind::Eight];

/// A demand, the thrusts before, and what each rotor can give.
pub struct Case {
    demand: ThrustTorque,
    before: PerRotor<f32>,
    most: PerRotor<f32>,
}

impl Case {
    /// A function of its own, as a task of a real board would call it.
    #[inline(never)]
    pub fn allocate(&self, allocation: &Allocation) -> AllocationTerms {
        allocation.allocate(&self.demand, &self.before, &self.most)
    }
}

/// Demands of one kind.
pub struct Draws {
    kind: Kind,
    state: u64,
}

impl Draws {
    /// From the begin.
    #[must_use]
    pub fn new(kind: Kind) -> Self {
        Self { kind, state: 1 }
    }

    /// The airframe of the kind: the squirrel's X, or eight rotors around it.
    #[must_use]
    pub fn allocation(&self) -> Option<Allocation> {
        const X: [[f64; 2]; 4] = [[0.085, -0.085], [-0.085, -0.085], [-0.085, 0.085], [0.085, 0.085]];
        const AROUND: [[f64; 2]; 4] = [[0.0, -0.15], [-0.15, 0.0], [0.0, 0.15], [0.15, 0.0]];
        let places = if self.kind == Kind::Eight { [X, AROUND] } else { [X, X] };
        let mut rotors = [Rotor::unused(); MAX_ROTORS];
        let rotor_count = if self.kind == Kind::Eight { 8 } else { 4 };
        for (i, (rotor, [x, y])) in rotors.iter_mut().zip(places.as_flattened()).take(rotor_count).enumerate()
        {
            *rotor = Rotor::planar(*x, *y, if i % 2 == i / 4 { -1.0 } else { 1.0 });
        }
        let vehicle = Vehicle::new(Parameters {
            mass_kg: 0.548,
            inertia_kg_m2: Matrix3::from_diagonal(&Vector3::new(3.22e-3, 4.68e-3, 7.72e-3)),
            rotors,
            rotor_count,
            propulsion: Propulsion {
                command: CommandKind::SpeedFraction,
                speed_max_rad_s: 3000.0,
                thrust_coefficient_n_s2: 6.0e-7,
                torque_coefficient_n_m_s2: 6.6e-9,
                time_constant_up_s: 0.03,
                time_constant_down_s: 0.03,
                reference_voltage_v: 14.8,
                thrust_curve: None,
            },
            drag: Drag { linear_n_s_per_m: Vector3::zeros(), area_m2: 0.01 },
            wing: None,
            limits: Limits { tilt_max_rad: 0.52, thrust_max_n: 40.0, rotor_thrust_max_n: None },
        });
        Allocation::new(&vehicle.ok()?, &Weights::default()).ok()
    }

    fn within(&mut self, low: f32, high: f32) -> f32 {
        self.state =
            self.state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * ((self.state >> 40) as f32 / 16_777_216.0)
    }

    /// The next one.
    pub fn case(&mut self) -> Case {
        let total = MOST_N * if self.kind == Kind::Eight { 8.0 } else { 4.0 };
        let (thrust, torque) = match self.kind {
            Kind::Within => (self.within(0.3, 0.6), 0.08),
            Kind::Weak => (self.within(0.2, 0.5), 0.2),
            Kind::Beyond | Kind::Eight => (self.within(0.0, 3.0), 3.0),
        };
        let mut axis = |arm: f32| total * arm * torque * self.within(-1.0, 1.0);
        let torque_n_m = Vector3::new(axis(0.06), axis(0.06), axis(0.008));
        let (mut before, mut most) = ([0.0; MAX_ROTORS], [MOST_N; MAX_ROTORS]);
        for f in &mut before {
            *f = self.within(0.0, MOST_N);
        }
        if matches!(self.kind, Kind::Weak | Kind::Eight) {
            let (weak, left) = (self.within(0.0, total / MOST_N), self.within(-MOST_N, MOST_N));
            for (i, f) in most.iter_mut().enumerate() {
                if weak >= i as f32 && weak < (i + 1) as f32 {
                    *f = if left > 0.0 { left } else { 0.0 };
                }
            }
        }
        Case { demand: ThrustTorque { thrust_n: total * thrust, torque_n_m }, before, most }
    }
}

/// FNV-1a over the bits of an answer.
#[must_use]
pub fn hash(before: u64, answer: &AllocationTerms) -> u64 {
    let bits = answer.rotor_thrust_n.iter().flat_map(|f| f.to_bits().to_le_bytes());
    bits.fold(before, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3))
}
