//! From the flight code's commands to what motor controllers and servos read.
//!
//! DShot: sixteen bits a frame, most significant first: eleven of value, one that asks for
//! telemetry, four of checksum (the exclusive or of the three nibbles before it). A bit takes one
//! period of a timer; a one is high for three quarters of it, a zero for three eighths. Value 0
//! stops the motor, 1 to 47 are commands, 48 to 2047 are throttle.

use squirrel_core::vehicle::CommandKind;

/// Rotors that this board drives.
pub const ROTORS: usize = 4;
/// DShot bits a second.
pub const DSHOT_BIT_HZ: u32 = 300_000;
/// Bits of a frame, and one period of silence so that the line rests low.
const PERIODS: usize = 17;
/// Compare values of one frame to all rotors, bit by bit, rotor by rotor within a bit: what the
/// timer's DMA burst takes.
pub type Waveform = [u16; PERIODS * ROTORS];

const STOP: u16 = 0;
const THROTTLE_MIN: u16 = 48;
const THROTTLE_MAX: u16 = 2047;

/// DShot value of a rotor command; stop where the command is 0 or less, or no number.
///
/// * `kind` - unit of the command; `None` comes back for newtons, which no motor controller
///   understands
pub fn dshot_value(kind: CommandKind, command: f32) -> Option<u16> {
    let fraction = match kind {
        CommandKind::SpeedFraction | CommandKind::Duty => command,
        CommandKind::PwmMicroseconds => (command - 1000.0) / 1000.0,
        CommandKind::ThrustNewton => return None,
    };
    // Also what is no number.
    if !(fraction > 0.0) {
        return Some(STOP);
    }
    let range = THROTTLE_MAX - THROTTLE_MIN;
    Some(THROTTLE_MIN + rounded(fraction * f32::from(range)).min(range))
}

/// To the nearest; what is above the range is cut at its end.
#[allow(clippy::cast_sign_loss, reason = "asked with what is not below 0")]
fn rounded(x: f32) -> u16 {
    (x + 0.5) as u16
}

/// The sixteen bits of a frame without telemetry.
fn dshot_frame(value: u16) -> u16 {
    let body = value << 1;
    let checksum = (body ^ (body >> 4) ^ (body >> 8)) & 0xF;
    (body << 4) | checksum
}

/// Compare values of one frame to each rotor.
///
/// * `period` - of a bit, ticks of the timer
#[must_use]
pub fn dshot_waveform(values: [u16; ROTORS], period: u16) -> Waveform {
    let (zero, one) = (period / 8 * 3, period / 4 * 3);
    let mut waveform = [0; PERIODS * ROTORS];
    for (bit, compare) in waveform.chunks_exact_mut(ROTORS).take(16).enumerate() {
        for (compare, value) in compare.iter_mut().zip(values) {
            *compare = if dshot_frame(value) >> (15 - bit) & 1 == 1 { one } else { zero };
        }
    }
    waveform
}

/// Pulse of the left and the right wing's servo, us: folded to spread. The servos are mounted as
/// mirror images.
///
/// * `wings` - left, right; 0 folded to 1 spread; what is no number counts as folded
#[must_use]
pub fn servo_pulses_us(wings: [f32; 2]) -> [u32; 2] {
    let turned = wings.map(|wing| {
        let wing = if wing > 0.0 { wing.min(1.0) } else { 0.0 };
        u32::from(rounded(wing * 1000.0))
    });
    [1000 + turned[0], 2000 - turned[1]]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example that every description of DShot has: value 1046 without telemetry.
    #[test]
    fn a_frame_is_the_published_one() {
        assert_eq!(dshot_frame(1046), 0b1000_0010_1100_0110);
        assert_eq!(dshot_frame(0), 0);
    }

    #[test]
    fn commands_become_values_within_the_range_of_throttle() {
        use CommandKind::{Duty, PwmMicroseconds, SpeedFraction, ThrustNewton};
        for kind in [SpeedFraction, Duty] {
            assert_eq!(dshot_value(kind, 1e-6), Some(48), "not one of the commands below 48");
            assert_eq!(dshot_value(kind, 0.5), Some(1048));
            assert_eq!(dshot_value(kind, 1.0), Some(2047));
            assert_eq!(dshot_value(kind, f32::INFINITY), Some(2047));
            for stop in [0.0, -1.0, f32::NAN, f32::NEG_INFINITY] {
                assert_eq!(dshot_value(kind, stop), Some(0));
            }
        }
        assert_eq!(dshot_value(PwmMicroseconds, 1000.0), Some(0));
        assert_eq!(dshot_value(PwmMicroseconds, 2000.0), Some(2047));
        assert_eq!(dshot_value(ThrustNewton, 1.0), None);
    }

    /// Read back as a motor controller does: by the middle between a zero and a one.
    #[test]
    fn a_waveform_reads_back_as_its_frames() {
        let (values, period) = ([0, 48, 1046, 2047], 800);
        let waveform = dshot_waveform(values, period);
        for (rotor, value) in values.into_iter().enumerate() {
            let read = (0..16).fold(0u16, |frame, bit| {
                frame << 1 | u16::from(waveform[bit * ROTORS + rotor] > period / 16 * 9)
            });
            assert_eq!(read, dshot_frame(value));
            assert_eq!(waveform[16 * ROTORS + rotor], 0, "the line rests low");
        }
        assert!(waveform.iter().all(|compare| [0, 300, 600].contains(compare)));
    }

    #[test]
    fn servos_mirror_each_other_and_fold_on_nonsense() {
        assert_eq!(servo_pulses_us([0.0, 0.0]), [1000, 2000]);
        assert_eq!(servo_pulses_us([1.0, 1.0]), [2000, 1000]);
        assert_eq!(servo_pulses_us([0.25, 7.0]), [1250, 1000]);
        assert_eq!(servo_pulses_us([f32::NAN, -3.0]), [1000, 2000]);
    }
}
