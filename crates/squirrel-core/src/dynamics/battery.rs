//! Battery: open-circuit voltage over charge, inner resistance, one RC pair (docs/equations.md
//! D.5).
//!
//! `V = OCV(charge) - I R0 - V1`, `V1' = (I R1 - V1) / tau1`, `charge' = -I / capacity`. The
//! current carries the rotors' shaft power: `I = sum(Q_i Omega_i) / (efficiency V) + idle`. The
//! open-circuit voltage is a table, one [`Stretch`] after the other; the caller walks along it with
//! [`Stretch::or_next`].

use crate::lane::Lane;
use crate::lane::functions::limit;
use crate::numbers;

numbers! {
    /// What does not change.
    Pack {
        /// Shaft power over electric power.
        efficiency,
        /// Voltage below which the power law would ask for unbounded current, V.
        floor_v,
        /// Current of everything but the rotors, A.
        idle_a,
        /// Resistance of the pack with its leads, ohm.
        r0_ohm,
        /// Resistance of the RC pair, ohm.
        r1_ohm,
        /// `1 - exp(-dt / tau1)`.
        decay,
        /// Charge of the full pack, A s.
        capacity_as,
        /// Cells in series.
        cells
    }
}

numbers! {
    /// What changes.
    Charge {
        /// 1 full to 0 empty.
        charge,
        /// Voltage of the RC pair, V.
        rc_voltage_v,
        /// Terminal voltage, V.
        voltage_v,
        /// Current, A.
        current_a
    }
}

numbers! {
    /// A stretch of the table of a cell's open-circuit voltage: it begins at a charge, and what
    /// voltage does on it.
    Stretch {
        /// Charge at which it begins; infinite for one that is not there.
        from,
        /// Its width in charge.
        width,
        /// Voltage at its beginning, V.
        volt,
        /// How much the voltage rises on it, V.
        rise
    }
}

/// Shaft power of one rotor, W: `k_m Omega^3`.
#[inline(always)]
pub fn shaft_power_w<L: Lane>(torque_coefficient: L, speed: L) -> L {
    torque_coefficient * speed * speed * speed
}

impl<L: Lane> Pack<L> {
    /// Draws a current for a step; its voltage is told by [`Self::settle`].
    ///
    /// * `power_w` - shaft power of all rotors, W
    /// * `dt` - s
    #[inline(always)]
    pub fn discharge(&self, state: &mut Charge<L>, power_w: L, dt: L) {
        let current =
            power_w / (self.efficiency * state.voltage_v.upper(self.floor_v)) + self.idle_a;
        state.rc_voltage_v =
            state.rc_voltage_v + (current * self.r1_ohm - state.rc_voltage_v) * self.decay;
        state.charge = (state.charge - current * dt / self.capacity_as).upper(L::of(0.0));
        state.current_a = current;
    }

    /// The terminal voltage of a charge that lies on a stretch.
    #[inline(always)]
    pub fn settle(&self, state: &mut Charge<L>, on: &Stretch<L>) {
        let open = self.cells * on.volt_at(state.charge);
        state.voltage_v =
            (open - state.current_a * self.r0_ohm - state.rc_voltage_v).upper(L::of(0.0));
    }
}

impl<L: Lane> Stretch<L> {
    /// The next stretch where the charge lies on it or beyond, this one elsewhere.
    #[inline(always)]
    #[must_use]
    pub fn or_next(&self, next: &Self, charge: L) -> Self {
        let ahead = next.from - charge;
        Self {
            from: ahead.where_positive(self.from, next.from),
            width: ahead.where_positive(self.width, next.width),
            volt: ahead.where_positive(self.volt, next.volt),
            rise: ahead.where_positive(self.rise, next.rise),
        }
    }

    /// Voltage of a cell, V; held beyond the ends.
    #[inline(always)]
    pub fn volt_at(&self, charge: L) -> L {
        self.volt + self.rise * limit((charge - self.from) / self.width, L::of(0.0), L::of(1.0))
    }
}
