//! Vehicles that differ from each other, thrown into the air.
#![allow(dead_code, clippy::unwrap_used, reason = "each test file uses a part of it")]

use nalgebra::{Quaternion, Vector3, convert};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use squirrel_batch::{BODY_NUMBERS, Batch, Settings};
use squirrel_core::dynamics::State;
use squirrel_core::frames::In;
use squirrel_core::vehicle::Vehicle;
use squirrel_sim::simd::Paths;
use squirrel_sim::vehicle_file::VehicleFile;

/// Everything that a batch is told.
pub(crate) struct Thrown<T: Paths> {
    pub(crate) vehicles: Vec<Vehicle<T>>,
    pub(crate) states: Vec<State<T>>,
    pub(crate) winds: Vec<[T; 3]>,
    /// Four a vehicle.
    pub(crate) commands: Vec<T>,
}

impl<T: Paths> Thrown<T> {
    /// The first vehicles of an endless row: those of a smaller number are the same.
    pub(crate) fn new(count: usize) -> Self {
        let mut generator = Pcg64Mcg::seed_from_u64(6);
        let mut between = |low: f64, high: f64| {
            low + (high - low) * f64::from(generator.next_u32()) / 4_294_967_296.0
        };
        let mut out = Self {
            vehicles: Vec::new(),
            states: Vec::new(),
            winds: Vec::new(),
            commands: Vec::new(),
        };
        for number in 0..count {
            let mut p = *VehicleFile::squirrel().vehicle.parameters();
            p.mass_kg *= between(0.7, 1.4);
            p.inertia_kg_m2 *= between(0.7, 1.4);
            p.inertia_kg_m2[(0, 1)] = between(-2e-4, 2e-4);
            p.inertia_kg_m2[(1, 0)] = p.inertia_kg_m2[(0, 1)];
            p.drag.area_m2 *= between(0.5, 2.0);
            p.drag.linear_n_s_per_m = Vector3::from_fn(|_, _| between(0.0, 0.1));
            p.propulsion.time_constant_up_s =
                if number % 5 == 3 { 0.0 } else { between(0.02, 0.05) };
            let vehicle = Vehicle::new(p).unwrap();
            out.vehicles.push(vehicle.cast().unwrap());
            let mut state = State::at_rest();
            let mut vector = |size: f64| Vector3::from_fn(|_, _| convert(between(-size, size)));
            state.position = In::new(vector(100.0));
            state.velocity = In::new(vector(10.0));
            state.omega = In::new(vector(4.0));
            let q = vector(1.0);
            state.attitude = Quaternion::new(convert(0.5), q.x, q.y, q.z);
            state.attitude /= state.attitude.norm();
            out.winds.push(vector(3.0).into());
            for speed in &mut state.rotor_speed_rad_s[..4] {
                *speed = convert(between(0.0, 2000.0));
            }
            out.states.push(state);
            out.commands.extend((0..4).map(|_| convert::<f64, T>(between(0.2, 0.8))));
        }
        out
    }

    pub(crate) fn batch(&self, settings: Settings) -> Batch<T> {
        let mut batch = Batch::new(&self.vehicles, settings).unwrap();
        for (number, (state, wind)) in self.states.iter().zip(&self.winds).enumerate() {
            batch.reset(number, state).unwrap();
            batch.set_wind(number, In::new(Vector3::from(*wind))).unwrap();
        }
        batch.command(&self.commands).unwrap();
        batch
    }
}

/// The bits of all motions, a row a vehicle; `f32` by the `f64` of the same value.
pub(crate) fn bits<T: Paths, const ROTORS: usize>(batch: &mut Batch<T, ROTORS>) -> Vec<Vec<u64>> {
    let width = BODY_NUMBERS + ROTORS;
    let mut rows = vec![convert::<f64, T>(0.0); batch.len() * width];
    batch.write_states(&mut rows).unwrap();
    let bits = rows.iter().map(|x| nalgebra::try_convert::<T, f64>(*x).unwrap().to_bits());
    bits.collect::<Vec<_>>().chunks(width).map(<[u64]>::to_vec).collect()
}
