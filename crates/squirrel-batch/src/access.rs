//! What goes into a batch between its steps and what comes out: motions, commands, air, charge.

use super::exchange::Chunk;
use super::extra::Command;
use super::{Batch, BatchError, BatchVehicle, CHUNK, autopilot, place, shape};
use nalgebra::convert;
use squirrel_core::dynamics::State;
use squirrel_core::frames::{In, Ned};
use squirrel_core::lane::put;
use squirrel_sim::plant::{GustModel, Wind, WindParameters};
use squirrel_sim::simd::{BLOCK, Paths};

impl<T: Paths, const ROTORS: usize> Batch<T, ROTORS> {
    /// Puts one vehicle somewhere else: wings folded, battery full, load hanging. Its command and
    /// its wind stay; commands on their way are lost.
    ///
    /// * `state` - rotor speeds only where the vehicle has rotors
    ///
    /// # Errors
    /// A number that is not finite, an attitude that is not a unit quaternion, no such vehicle.
    pub fn reset(&mut self, number: usize, state: &State<T>) -> Result<(), BatchError> {
        self.check(number)?;
        if !state.is_finite() {
            return Err(BatchError::NotFinite { what: "state", vehicle: number });
        }
        let norm = nalgebra::try_convert(state.attitude.norm()).unwrap_or(f64::NAN);
        if !((norm - 1.0).abs() < 1e-3) {
            return Err(BatchError::Attitude { vehicle: number, norm });
        }
        let (chunk, block, lane) = place(number);
        let mut chunk = self.pool.chunk(chunk);
        let Chunk { blocks, drives, .. } = &mut *chunk;
        blocks[block].put_state(lane, state, &drives[block * BLOCK + lane]);
        if let Some(extra) = &mut blocks[block].extra {
            extra.rest(lane, convert(1.0));
        }
        if let Some(autopilots) = &mut blocks[block].autopilots {
            autopilots.rest(lane, autopilot::euler(state));
        }
        Ok(())
    }

    /// Rests the battery of one vehicle at a charge, 0..1; nothing where it has none.
    ///
    /// # Errors
    /// A charge out of range, no such vehicle.
    pub fn set_charge(&mut self, number: usize, charge: f64) -> Result<(), BatchError> {
        self.check(number)?;
        if !(0.0..=1.0).contains(&charge) {
            return Err(BatchError::Charge { vehicle: number, charge });
        }
        let (chunk, block, lane) = place(number);
        let mut chunk = self.pool.chunk(chunk);
        if let Some(packs) =
            chunk.blocks[block].extra.as_mut().and_then(|extra| extra.packs.as_mut())
        {
            packs.rest(lane, convert(charge));
        }
        Ok(())
    }

    /// Charge (0..1), terminal voltage (V) and current (A) of one vehicle's battery; `None` where
    /// no vehicle has one.
    ///
    /// # Errors
    /// No such vehicle.
    pub fn battery(&self, number: usize) -> Result<Option<[T; 3]>, BatchError> {
        self.check(number)?;
        let (chunk, block, lane) = place(number);
        let chunk = self.pool.chunk(chunk);
        let packs = chunk.blocks[block].extra.as_ref().and_then(|extra| extra.packs.as_ref());
        Ok(packs.map(|packs| {
            let now = packs.charge.take(lane);
            [now.charge, now.voltage_v, now.current_a]
        }))
    }

    /// Deployment of one vehicle's wings, left and right, 0 folded to 1 spread.
    ///
    /// # Errors
    /// No such vehicle.
    pub fn deployment(&self, number: usize) -> Result<[T; 2], BatchError> {
        self.check(number)?;
        let (chunk, block, lane) = place(number);
        Ok(self.pool.chunk(chunk).blocks[block].deployment(lane))
    }

    /// Motion of one vehicle.
    ///
    /// # Errors
    /// No such vehicle.
    pub fn state(&self, number: usize) -> Result<State<T>, BatchError> {
        self.check(number)?;
        let (chunk, block, lane) = place(number);
        Ok(self.pool.chunk(chunk).blocks[block].state(lane))
    }

    /// Tells the wings what to do from now on; nothing where no vehicle has any.
    ///
    /// * `commands` - a row of two for each vehicle, left and right, 0 folded to 1 spread; limited,
    ///   and 0 for NaN
    ///
    /// # Errors
    /// A length that is not twice [`Self::len`].
    pub fn command_wings(&mut self, commands: &[T]) -> Result<(), BatchError> {
        shape("wing commands", commands.len(), self.len() * 2)?;
        for (chunk, commands) in commands.chunks(2 * BLOCK * CHUNK).enumerate() {
            let mut chunk = self.pool.chunk(chunk);
            for (block, commands) in chunk.blocks.iter_mut().zip(commands.chunks(2 * BLOCK)) {
                let Some(extra) = &mut block.extra else { return Ok(()) };
                for (lane, command) in commands.chunks_exact(2).enumerate() {
                    let limited = |x| squirrel_core::math::limit(x, convert(0.0), convert(1.0));
                    let wings = [limited(command[0]), limited(command[1])];
                    if extra.latency_steps[lane] > 0 {
                        extra.send(lane, Command::Wings(wings));
                    } else {
                        extra.ask_wings(lane, wings);
                    }
                }
            }
        }
        Ok(())
    }

    /// Moving air about one vehicle from now on, as in a flight with this wind and seed: steady
    /// wind, its gusts, and those of the vehicle's `gust` effect. Gusts move at the rate of the
    /// flight code, 300 Hz.
    ///
    /// * `member` - the vehicle, for its effect
    ///
    /// # Errors
    /// A number that is not finite, a batch of the base model alone, no such vehicle.
    pub fn set_air(
        &mut self,
        number: usize,
        member: &BatchVehicle,
        wind: WindParameters,
        seed: u64,
    ) -> Result<(), BatchError> {
        self.check(number)?;
        let strength = match wind.gust {
            GustModel::Mil { wind_6m_m_s } => wind_6m_m_s,
            GustModel::GaussMarkov { .. } | GustModel::Dryden { .. } => wind.gust_sigma_m_s,
        };
        if !wind.mean_ned_m_s.iter().chain([&strength]).all(|x| x.is_finite()) {
            return Err(BatchError::NotFinite { what: "wind", vehicle: number });
        }
        let airs = Wind::of_flight(wind, &member.vehicle, &member.effects, seed);
        let (chunk, block, lane) = place(number);
        let mut chunk = self.pool.chunk(chunk);
        let block = &mut chunk.blocks[block];
        let Some(extra) = &mut block.extra else {
            return Err(BatchError::NotFitted { vehicle: number, what: "gust" });
        };
        extra.airs.put(lane, airs, extra.clock, self.settings.dt_s);
        put(&mut extra.air_omega, lane, extra.airs.angular_velocity(lane).vector.into());
        if let Some(air) = extra.airs.velocity(lane) {
            block.put_wind(lane, air);
        }
        Ok(())
    }

    /// Velocity of the air about one vehicle from now on, m/s; it does not move any more.
    ///
    /// # Errors
    /// A number that is not finite, no such vehicle.
    pub fn set_wind(&mut self, number: usize, wind: In<Ned, T>) -> Result<(), BatchError> {
        self.check(number)?;
        if !wind.vector.iter().all(T::is_finite) {
            return Err(BatchError::NotFinite { what: "wind", vehicle: number });
        }
        let (chunk, block, lane) = place(number);
        let mut chunk = self.pool.chunk(chunk);
        chunk.blocks[block].put_wind(lane, wind);
        if let Some(extra) = &mut chunk.blocks[block].extra {
            extra.airs.put(lane, Vec::new(), extra.clock, self.settings.dt_s);
            put(&mut extra.air_omega, lane, [convert(0.0); 3]);
        }
        Ok(())
    }
}
