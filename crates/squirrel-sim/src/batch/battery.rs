//! Batteries on registers: `crate::plant::BatteryParameters`, the table of open-circuit voltages by selection.

use super::maths::{all, limit};
use super::rows::{Row, rows};
use super::simd::{BLOCK, Lanes, Paths};
use crate::plant::BatteryParameters;
use squirrel_core::math::real;

rows! {
    /// What does not change.
    Pack {
        torque, efficiency, floor_v, idle_a, r0_ohm, r1_ohm,
        /// `1 - exp(-dt / tau1)`.
        decay,
        /// Charge of the full pack, A s.
        capacity_as, cells
    }
}

rows! {
    /// What changes, as `crate::plant::BatteryState`.
    Charge { charge, rc_voltage_v, voltage_v, current_a }
}

rows! {
    /// A stretch of the table: it begins at a charge, and what voltage does on it.
    Stretch { from, width, volt, rise }
}

/// The packs of a block.
#[derive(Debug, Clone)]
pub(super) struct Packs<S: Copy> {
    pub(super) pack: Pack<Row<S>>,
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
        let cells = f64::from(b.cells);
        self.pack.put(
            lane,
            &Pack {
                torque,
                efficiency: real(b.efficiency),
                floor_v: real(0.5 * cells * b.ocv_v_of_charge[0][1]),
                idle_a: real(b.idle_current_a),
                r0_ohm: real(b.r0_ohm),
                r1_ohm: real(b.r1_ohm),
                decay: real(1.0 - (-dt_s / b.tau1_s).exp()),
                capacity_as: real(3600.0 * b.capacity_ah),
                cells: real(cells),
            },
        );
        for (number, stretch) in self.table.iter_mut().enumerate() {
            let [from, to] = match b.ocv_v_of_charge.get(number..number + 2) {
                Some([from, to]) => [*from, *to],
                _ => [[f64::INFINITY, 0.0], [f64::INFINITY, 0.0]],
            };
            let width = if from[0].is_finite() { to[0] - from[0] } else { 1.0 };
            let numbers = [from[0], width, from[1], to[1] - from[1]].map(real);
            let [from, width, volt, rise] = numbers;
            stretch.put(lane, &Stretch { from, width, volt, rise });
        }
    }

    /// A rested pack in column `lane`.
    pub(super) fn rest(&mut self, lane: usize, charge: S) {
        let none = real::<S>(0.0);
        let mut volt = none;
        for (number, stretch) in self.table.iter().enumerate() {
            let s = stretch.take(lane);
            if number == 0 || !(s.from > charge) {
                volt = s.volt + s.rise * limit((charge - s.from) / s.width, none, real(1.0));
            }
        }
        let voltage_v = self.pack.cells[lane] * volt;
        self.charge.put(lane, &Charge { charge, rc_voltage_v: none, voltage_v, current_a: none });
    }
}

impl<L: Lanes> Pack<L> {
    /// One step.
    ///
    /// * `speeds` - of the rotors before it, rad/s
    #[inline(always)]
    pub(super) fn step<const ROTORS: usize>(
        &self,
        state: &mut Charge<L>,
        table: &[Stretch<Row<L::Weight>>],
        start: usize,
        speeds: &[L; ROTORS],
        dt: L,
    ) {
        let mut power = self.torque * speeds[0] * speeds[0] * speeds[0];
        for i in 1..ROTORS {
            power = power + self.torque * speeds[i] * speeds[i] * speeds[i];
        }
        let none = L::zero();
        let current = power / (self.efficiency * state.voltage_v.upper(self.floor_v)) + self.idle_a;
        state.rc_voltage_v = state.rc_voltage_v + (current * self.r1_ohm - state.rc_voltage_v) * self.decay;
        state.charge = (state.charge - current * dt / self.capacity_as).upper(none);
        state.current_a = current;
        let mut on = Stretch::<L>::load(&table[0], start);
        for rows in &table[1..] {
            let next = Stretch::<L>::load(rows, start);
            let ahead = next.from - state.charge;
            on = Stretch {
                from: ahead.where_positive(on.from, next.from),
                width: ahead.where_positive(on.width, next.width),
                volt: ahead.where_positive(on.volt, next.volt),
                rise: ahead.where_positive(on.rise, next.rise),
            };
        }
        let share = limit((state.charge - on.from) / on.width, none, all(1.0));
        let open = self.cells * (on.volt + on.rise * share);
        state.voltage_v = (open - current * self.r0_ohm - state.rc_voltage_v).upper(none);
    }
}
