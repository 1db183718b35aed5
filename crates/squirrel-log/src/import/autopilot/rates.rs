//! What a log is too slow for, and what to set before the next flight.

use super::super::report::ChannelReport;
use super::Firmware;

/// A motor follows its command within 20 to 60 ms: half of that must be seen.
const COMMAND_MIN_HZ: f64 = 100.0;
/// What the body does within a tenth of a second must be seen.
const IMU_MIN_HZ: f64 = 100.0;

/// A line for each thing that these channels cannot show.
pub(super) fn notes(firmware: Firmware, channels: &[ChannelReport]) -> Vec<String> {
    let set = match firmware {
        Firmware::Px4 => "set SDLOG_PROFILE to 17 (default set and high rate) and fly excite_rich",
        Firmware::ArduPilot => {
            "set bits 0, 10 and 18 of LOG_BITMASK (fast attitude, RC output, fast IMU) and fly excite_rich"
        }
        Firmware::Blackbox => {
            "set blackbox_sample_rate to 1/1 or 1/2 (INAV: blackbox_rate_denom to 1) and fly excite_rich"
        }
    };
    let find = |name: &str| channels.iter().find(|report| report.channel == name);
    let mut notes = Vec::new();
    match find("rotor.command") {
        None => notes.push(format!(
            "no actuators in the log: nothing that depends on the rotors can be judged; {set}"
        )),
        Some(report) => match report.mean_rate_hz {
            Some(rate_hz) if rate_hz < COMMAND_MIN_HZ => notes.push(format!(
                "actuators at {rate_hz:.0} Hz: motor_lag and actuation_latency cannot be judged; {set}"
            )),
            _ => {}
        },
    }
    for (name, what) in [
        ("imu.omega_body_rad_s", "angular rate"),
        ("imu.specific_force_body_m_s2", "specific force"),
    ] {
        match find(name).map(|report| report.mean_rate_hz) {
            None => notes.push(format!("no {what} in the log: the gap workflow needs it; {set}")),
            Some(Some(rate_hz)) if rate_hz < IMU_MIN_HZ => notes.push(format!(
                "{what} at {rate_hz:.0} Hz: effects that act within {:.0} ms cannot be judged; {set}",
                2000.0 / rate_hz
            )),
            Some(_) => {}
        }
    }
    notes
}
