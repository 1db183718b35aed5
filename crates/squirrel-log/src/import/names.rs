//! Canonical channel names: which there are, how wide each is and which frame it is in.

/// What the name of a channel says about its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Three numbers in NED.
    VectorNed,
    /// Three numbers in FRD.
    VectorBody,
    /// `q_ned_from_body_wxyz`.
    Attitude,
    /// One number a rotor, in the order of the vehicle.
    PerRotor,
    /// This many numbers without a frame.
    Numbers(usize),
    /// Any count of numbers without a frame.
    Free,
}

/// The fixed names; `truth.*`, `reference.*` and `control.*` are open.
const FIXED: [(&str, Kind); 20] = [
    ("imu.omega_body_rad_s", Kind::VectorBody),
    ("imu.specific_force_body_m_s2", Kind::VectorBody),
    ("imu_2.omega_body_rad_s", Kind::VectorBody),
    ("imu_2.specific_force_body_m_s2", Kind::VectorBody),
    // The accelerometer turned into the world by the logged attitude, less gravity: what autopilots
    // log as acceleration.
    ("imu.acceleration_ned_m_s2", Kind::VectorNed),
    ("attitude.q_ned_from_body_wxyz", Kind::Attitude),
    // Angles of logs that lack one of them: nose right, nose up, right side down, in this order
    // from the world.
    ("attitude.yaw_rad", Kind::Numbers(1)),
    ("attitude.pitch_rad", Kind::Numbers(1)),
    ("attitude.roll_rad", Kind::Numbers(1)),
    ("gnss.position_ned_m", Kind::VectorNed),
    ("gnss.velocity_ned_m_s", Kind::VectorNed),
    ("baro.altitude_m", Kind::Numbers(1)),
    ("magnetometer.field_body_ut", Kind::VectorBody),
    ("range_finder.distance_m", Kind::Numbers(1)),
    ("battery.voltage_v", Kind::Numbers(1)),
    ("battery.current_a", Kind::Numbers(1)),
    ("rotor.command", Kind::PerRotor),
    ("rotor.speed_rad_s", Kind::PerRotor),
    ("wing.command", Kind::Numbers(2)),
    ("wing.deployment", Kind::Numbers(2)),
];
const OPEN: [&str; 3] = ["truth.", "reference.", "control."];

/// The kind of a canonical name; `None` if there is no such name.
pub(super) fn kind(name: &str) -> Option<Kind> {
    if let Some((_, kind)) = FIXED.iter().find(|(fixed, _)| *fixed == name) {
        return Some(*kind);
    }
    let rest = OPEN.iter().find_map(|prefix| name.strip_prefix(prefix))?;
    let word = |part: &str| {
        !part.is_empty()
            && part.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'_')
    };
    if !rest.split('.').all(word) {
        return None;
    }
    let quantity = rest.rsplit('.').next().unwrap_or(rest);
    let has = |frame: &str| format!("_{quantity}_").contains(frame);
    Some(if quantity.ends_with("q_ned_from_body_wxyz") {
        Kind::Attitude
    } else if has("_ned_") {
        Kind::VectorNed
    } else if has("_body_") {
        Kind::VectorBody
    } else if has("_rotor_") {
        Kind::PerRotor
    } else {
        Kind::Free
    })
}

/// The canonical names nearest to a wrong one, for an error message.
pub(super) fn nearest_canonical(name: &str) -> String {
    nearest(name, FIXED.iter().map(|(fixed, _)| *fixed))
        + "; truth.*, reference.* and control.* are open"
}

/// Up to three candidates by edit distance; those with the same first part (before a dot) alone, if
/// there are any.
pub(super) fn nearest<'a>(name: &str, candidates: impl Iterator<Item = &'a str>) -> String {
    let first = |s: &str| s.split('.').next().map(str::to_owned);
    let mut ranked: Vec<_> =
        candidates.map(|c| (first(c) != first(name), edit_distance(name, c), c)).collect();
    ranked.sort_unstable();
    ranked.dedup();
    let best = ranked.first().is_some_and(|(other, ..)| *other);
    ranked
        .iter()
        .filter(|(other, ..)| *other == best)
        .take(3)
        .map(|(.., c)| *c)
        .collect::<Vec<_>>()
        .join(", ")
}

/// Levenshtein distance over bytes: insertions, deletions, substitutions.
fn edit_distance(a: &str, b: &str) -> usize {
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, byte_a) in a.bytes().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, byte_b) in b.bytes().enumerate() {
            let substituted = diagonal + usize::from(byte_a != byte_b);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_suffix_of_an_open_name_says_its_frame() {
        assert_eq!(kind("truth.velocity_ned_m_s"), Some(Kind::VectorNed));
        assert_eq!(kind("truth.force_body_n"), Some(Kind::VectorBody));
        assert_eq!(kind("reference.q_ned_from_body_wxyz"), Some(Kind::Attitude));
        assert_eq!(kind("control.inner.moment_body_n_m"), Some(Kind::VectorBody));
        assert_eq!(kind("truth.rotor_speed_rad_s"), Some(Kind::PerRotor));
        assert_eq!(kind("control.thrust_n"), Some(Kind::Free));
    }

    #[test]
    fn names_outside_the_list_are_unknown() {
        for name in
            ["imu.omega", "time_s", "truth", "truth.", "truth..x", "truth.Ä", "control.a b", ""]
        {
            assert_eq!(kind(name), None, "{name}");
        }
    }

    #[test]
    fn near_names_come_first() {
        assert!(nearest_canonical("gyro.omega_body_rad_s").starts_with("imu.omega_body_rad_s"));
        assert!(nearest_canonical("battery.volt").starts_with("battery.voltage_v"));
        assert_eq!(edit_distance("kitten", "sitting"), 3);
    }
}
