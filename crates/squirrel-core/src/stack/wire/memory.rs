//! What a flight code remembers whose attitude comes from outside, so that a flight can be put
//! aside and taken up again, bit for bit.

use super::{Reader, Wire, Writer, wire_struct};
use crate::control::backstepping::AttitudeState;
use crate::control::position::{ForceResidual, PositionState};
use crate::control::supply::Supply;
use crate::control::twcc::TwccState;
use crate::estimate::force_residual::Felt;
use crate::estimate::monitor::Monitor;
use crate::estimate::navigator::{Health, NavigationState};
use crate::estimate::voting::{Difference, Unit, Voter};
use crate::estimate::wind::Wind;
use crate::guidance::mission::MissionState;
use crate::rnn::parnn::{History, WINDOW};
use crate::stack::failsafe::{FailsafeState, Watch};
use crate::stack::{Known, StackState};

/// A memory that has a place in the byte stream.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outside(StackState);

impl Outside {
    /// `None` where the flight code estimates, or has heard a battery: filters have no place in the
    /// stream.
    pub fn of(state: &StackState) -> Option<Self> {
        let mut navigation = state.navigation;
        navigation.voter = Voter::default();
        navigation.imu_hangs = false;
        navigation.health = Health::default();
        let is_outside =
            navigation == NavigationState::default() && state.supply == Supply::default();
        is_outside.then_some(Self(*state))
    }

    /// The memory.
    pub fn state(&self) -> &StackState {
        &self.0
    }
}

impl Wire for Outside {
    fn put(&self, to: &mut Writer<'_>) {
        let state = &self.0;
        state.navigation.voter.put(to);
        state.navigation.imu_hangs.put(to);
        state.navigation.health.put(to);
        state.monitor.put(to);
        state.known.put(to);
        state.time_us.put(to);
        state.outer_begin_us.put(to);
        state.failsafe.put(to);
        state.mission.put(to);
        state.twcc.put(to);
        state.filter.put(to);
        state.attitude.put(to);
        state.command.put(to);
        state.wing_command.put(to);
        state.saturated.put(to);
        state.rejected.put(to);
    }
    fn take(from: &mut Reader<'_>) -> Option<Self> {
        let mut navigation = NavigationState::default();
        navigation.voter = Wire::take(from)?;
        navigation.imu_hangs = Wire::take(from)?;
        navigation.health = Wire::take(from)?;
        Some(Self(StackState {
            navigation,
            monitor: Wire::take(from)?,
            supply: Supply::default(),
            known: Wire::take(from)?,
            time_us: Wire::take(from)?,
            outer_begin_us: Wire::take(from)?,
            failsafe: Wire::take(from)?,
            mission: Wire::take(from)?,
            twcc: Wire::take(from)?,
            filter: Wire::take(from)?,
            attitude: Wire::take(from)?,
            command: Wire::take(from)?,
            wing_command: Wire::take(from)?,
            saturated: Wire::take(from)?,
            rejected: Wire::take(from)?,
        }))
    }
}

impl<A: Wire, B: Wire> Wire for (A, B) {
    fn put(&self, to: &mut Writer<'_>) {
        self.0.put(to);
        self.1.put(to);
    }
    fn take(from: &mut Reader<'_>) -> Option<Self> {
        Some((Wire::take(from)?, Wire::take(from)?))
    }
}

impl Wire for History {
    fn put(&self, to: &mut Writer<'_>) {
        self.rows.put(to);
        (self.seen as u8).put(to);
    }
    fn take(from: &mut Reader<'_>) -> Option<Self> {
        let rows = Wire::take(from)?;
        let seen = usize::from(u8::take(from)?);
        (seen <= WINDOW).then_some(Self { rows, seen })
    }
}

wire_struct! {
    Voter { units, difference, voted, since_us, spikes }
    Unit { last, repeats, doubted_us, silent_us }
    Difference { omega, force }
    Monitor { commanded, omega, missing_n, torque_n_m, spread_ago_s, felt, wind, waited_s }
    Wind { velocity, deviation_m_s, waited_s }
    Felt { residual, along_n, spread_s }
    ForceResidual { short_n, wings_n, beside }
    Known { imu, attitude, gnss, altitude_m, wing_force, command }
    FailsafeState {
        active, imu, attitude, gnss, altitude, command_age_us, standing, turned_rad, climbed_m, attitude_hangs,
        altitude_hangs, better_us,
    }
    Watch { age_us, repeats }
    MissionState { turned, handled, encounters }
    TwccState { position, flag, mode, mode_age_s, clamped, last, history }
    PositionState { integral, last_error }
    AttitudeState { integral, followed_n_m, negative_sign }
}
