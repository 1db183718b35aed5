//! Batteries of a block: `squirrel_core::dynamics::battery`, the table of open-circuit voltages by
//! selection.

use squirrel_core::dynamics::battery::{Charge, Pack, Stretch, shaft_power_w};
use squirrel_core::lane::Row;
use squirrel_core::math::{Real, real};
use squirrel_sim::plant::BatteryParameters;
use squirrel_sim::simd::{BLOCK, Paths, Register};

/// The packs of a block.
#[derive(Debug, Clone)]
pub(super) struct Packs<S: Copy> {
    /// Torque coefficient of the rotors.
    torque: Row<S>,
    pack: Pack<Row<S>>,
    pub(super) charge: Charge<Row<S>>,
    /// At least one; those that a vehicle lacks begin at infinity.
    pub(super) table: Vec<Stretch<Row<S>>>,
}

impl<S: Paths> Packs<S> {
    /// Nothing in any column that is used.
    pub(super) fn empty(stretches: usize) -> Self {
        let none = [real::<S>(0.0); BLOCK];
        let one = [real::<S>(1.0); BLOCK];
        Self {
            torque: none,
            pack: Pack { efficiency: one, capacity_as: one, ..Pack::all(none) },
            charge: Charge::all(none),
            table: vec![Stretch { width: one, ..Stretch::all(none) }; stretches.max(1)],
        }
    }

    /// Another pack in column `lane`, rested at its charge there.
    ///
    /// * `battery` - `None` for a voltage that stays at the reference
    pub(super) fn put(
        &mut self,
        lane: usize,
        battery: Option<&BatteryParameters>,
        reference_voltage_v: f64,
        torque: S,
        dt_s: f64,
    ) {
        let constant = BatteryParameters {
            cells: 1,
            capacity_ah: f64::INFINITY,
            r0_ohm: 0.0,
            r1_ohm: 0.0,
            tau1_s: f64::INFINITY,
            ocv_v_of_charge: vec![[0.0, reference_voltage_v], [1.0, reference_voltage_v]],
            efficiency: f64::INFINITY,
            idle_current_a: 0.0,
        };
        let b = battery.unwrap_or(&constant);
        self.torque[lane] = torque;
        self.pack.put(lane, &b.pack(dt_s).map(real));
        let mut stretches = b.stretches();
        for rows in &mut self.table {
            let beyond = Stretch { from: f64::INFINITY, width: 1.0, volt: 0.0, rise: 0.0 };
            rows.put(lane, &stretches.next().unwrap_or(beyond).map(real));
        }
    }

    /// A rested pack in column `lane`.
    pub(super) fn rest(&mut self, lane: usize, charge: S) {
        let none = real::<S>(0.0);
        let mut on = self.table[0].take(lane);
        for rows in &self.table[1..] {
            on = on.or_next(&rows.take(lane), charge);
        }
        let volt = on.volt_at(charge);
        let voltage_v = self.pack.cells[lane] * volt;
        self.charge.put(lane, &Charge { charge, rc_voltage_v: none, voltage_v, current_a: none });
    }
}

impl<S: Real> Packs<S> {
    /// One step of the vehicles from column `start` and on.
    ///
    /// * `speeds` - of the rotors before it, rad/s
    #[inline(always)]
    pub(super) fn step<L: Register<Element = S>, const ROTORS: usize>(
        &self,
        state: &mut Charge<L>,
        start: usize,
        speeds: &[L; ROTORS],
        dt: L,
    ) {
        let torque = L::load(&self.torque[start..]);
        let mut power_w = shaft_power_w(torque, speeds[0]);
        for i in 1..ROTORS {
            power_w = power_w + shaft_power_w(torque, speeds[i]);
        }
        let pack = Pack::<L>::load(&self.pack, start);
        pack.discharge(state, power_w, dt);
        let mut on = Stretch::<L>::load(&self.table[0], start);
        for rows in &self.table[1..] {
            on = on.or_next(&Stretch::load(rows, start), state.charge);
        }
        pack.settle(state, &on);
    }
}
