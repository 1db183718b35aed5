//! Numbers that cannot be in the unit that the log says: voltage, specific force, commands.

use super::Found;
use super::flight::Flight;
use nalgebra::Vector3;
use squirrel_core::math::GRAVITY_M_S2;
use squirrel_core::vehicle::CommandKind;

/// Mean voltage over the vehicle's reference: half empty and another cell or two less are in it.
const VOLTAGE: (f64, f64) = (0.5, 1.6);
/// Mean size of specific force in flight, in g.
const FORCE_G: (f64, f64) = (0.5, 2.0);
/// A fraction that is larger than this in one sample of a hundred is none.
const FRACTION_MAX: f64 = 1.5;

pub(super) fn voltage(flight: &Flight) -> Found {
    let reference = flight.vehicle().parameters().propulsion.reference_voltage_v;
    let (mut sum, mut n) = (0.0, 0.0);
    for track in flight.tracks() {
        sum += track.voltage_v.iter().sum::<f64>();
        n += track.voltage_v.len() as f64;
    }
    let ratio = sum / n / reference;
    let remedy = match ratio {
        r if (VOLTAGE.0 * 1e3..VOLTAGE.1 * 1e3).contains(&r) => "it is in mV: `scale = 0.001`",
        r if (VOLTAGE.0 * 1e2..VOLTAGE.1 * 1e2).contains(&r) => {
            "it is in hundredths of a volt: `scale = 0.01`"
        }
        r if (VOLTAGE.0 * 10.0..VOLTAGE.1 * 10.0).contains(&r) => {
            "it is in tenths of a volt: `scale = 0.1`"
        }
        _ => "is it in volts, and of all cells together? see `scale`",
    };
    (!(VOLTAGE.0..VOLTAGE.1).contains(&ratio)).then(|| {
        let mean = ratio * reference;
        let words = format!(
            "its mean is {mean:.3} V where the vehicle's reference is {reference} V; {remedy}"
        );
        ("battery.voltage_v", words)
    })
}

/// A flying vehicle feels its weight along -z on average.
pub(super) fn force(flight: &Flight) -> Found {
    let channel = "imu.specific_force_body_m_s2";
    let all: Vec<Vector3<f64>> =
        flight.tracks().flat_map(|track| track.specific_force().iter().copied()).collect();
    let mean = all.iter().sum::<Vector3<f64>>() / all.len() as f64;
    let size = all.iter().map(Vector3::norm).sum::<f64>() / all.len() as f64;
    if !(FORCE_G.0..FORCE_G.1).contains(&(size / GRAVITY_M_S2)) {
        let remedy = match size {
            s if (0.95..FORCE_G.1).contains(&s) && mean.norm() > 0.8 * size => {
                "it is in g: `scale = 9.80665`"
            }
            s if (FORCE_G.0 * 1e3..FORCE_G.1 * 1e3).contains(&s) => {
                "it is in thousandths of g: `scale = 0.00980665`"
            }
            s if s < GRAVITY_M_S2 => {
                "gravity is taken off: this is the vehicle's acceleration, perhaps in the world frame; import what the accelerometer felt in the body"
            }
            _ => "is it in m/s^2? see `scale`",
        };
        return Some((
            channel,
            format!("its mean size is {size:.3} m/s^2, must be near 9.81 in flight; {remedy}"),
        ));
    }
    if mean.z > -0.5 * size {
        let along = (0..3).max_by(|a, b| mean[*a].abs().total_cmp(&mean[*b].abs())).unwrap_or(2);
        let remedy = if along == 2 {
            "its body frame has z up: `body = \"flu\"`, or `\"frd\"` where the map has that"
        } else {
            "its axes are in another order: put the column along the thrust last in `columns = [...]`"
        };
        return Some((
            channel,
            format!(
                "its mean is ({:.2}, {:.2}, {:.2}) m/s^2 where thrust points along -z; {remedy}",
                mean.x, mean.y, mean.z
            ),
        ));
    }
    None
}

/// Commands outside of what their kind can be.
pub(super) fn commands(flight: &Flight) -> Found {
    let p = flight.vehicle().parameters();
    let spans = flight.spans();
    let inside = |t: f64| spans.iter().any(|(from, until)| (*from..=*until).contains(&t));
    let mut all: Vec<f64> = flight
        .commands()
        .iter()
        .filter(|(t, _)| inside(*t))
        .flat_map(|(_, u)| u[..p.rotor_count].to_vec())
        .collect();
    all.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| all.get((share * all.len().saturating_sub(1) as f64) as usize).copied();
    let (low, middle, high) = (at(0.01)?, at(0.5)?, at(0.99)?);
    let of = format!("its middle is {middle:.4} and it goes up to {high:.4}");
    let remedy = match p.propulsion.command {
        CommandKind::SpeedFraction | CommandKind::Duty if high > FRACTION_MAX => match high {
            _ if low > 800.0 && high < 2300.0 => {
                "pulses of 1000 to 2000 us: `scale = 0.001, offset = -1.0`"
            }
            h if h <= 110.0 => "percent: `scale = 0.01`",
            h if h <= 260.0 => "0 to 255: `scale = 0.00392156862745098`",
            h if h <= 1100.0 => "0 to 1000: `scale = 0.001`",
            h if h <= 2100.0 => "0 to 2000: `scale = 0.0005`",
            h if h <= 4200.0 => "0 to 4095: `scale = 0.0002442002442`",
            h if h <= 70_000.0 => "0 to 65535: `scale = 1.5259021896696422e-5`",
            _ => "another unit: see `scale`",
        },
        CommandKind::SpeedFraction | CommandKind::Duty if low < -0.1 && middle.abs() < 0.5 => {
            "perhaps -1 to 1: `scale = 0.5, offset = 0.5`"
        }
        CommandKind::PwmMicroseconds if !(900.0..2200.0).contains(&middle) => {
            if high <= FRACTION_MAX {
                "fractions: `scale = 1000.0, offset = 1000.0`"
            } else {
                "another unit: see `scale`"
            }
        }
        _ => return None,
    };
    let wanted = match p.propulsion.command {
        CommandKind::PwmMicroseconds => "pulses of 1000 to 2000 us",
        _ => "fractions of 0 to 1",
    };
    Some((
        "rotor.command",
        format!("{of} where the vehicle takes {wanted}; it looks like {remedy}"),
    ))
}
