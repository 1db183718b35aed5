//! A turn at 7 m/s in front of a wall of trees, flown by a point mass with three limits of sideways
//! acceleration.

use std::collections::BTreeMap;

use squirrel_log::{Channel, FlightLog, Source};
use squirrel_report::flight::{FlightView, Heading};

const RATE_HZ: f64 = 300.0;
const SPEED_M_S: f64 = 7.0;
const TURN_RADIUS_M: f64 = 5.0;
const MASS_KG: f64 = 0.548;
const GRAVITY_M_S2: f64 = 9.81;

/// Obstacles of the manoeuvre: north, east, radius, m.
pub(crate) const OBSTACLES: [[f64; 3]; 2] = [[3.2, 4.0, 1.5], [-7.5, 6.0, 1.0]];

/// An arm: its name, the sideways acceleration that it can hold, m/s2, and whether it has wings.
pub(crate) const ARMS: [(&str, f64, bool); 3] =
    [("pc", 5.2, false), ("twcc_flat", 7.0, true), ("twcc_parnn", 8.6, true)];

/// North, east of the reference and its course: north, a quarter turn to the right, east.
fn reference(time_s: f64) -> ([f64; 2], [f64; 2]) {
    let straight_m = 15.0;
    let along = SPEED_M_S * time_s - straight_m;
    let quarter = TURN_RADIUS_M * std::f64::consts::FRAC_PI_2;
    if along < 0.0 {
        ([along - TURN_RADIUS_M, 0.0], [1.0, 0.0])
    } else if along < quarter {
        let (sin, cos) = (along / TURN_RADIUS_M).sin_cos();
        ([TURN_RADIUS_M * (sin - 1.0), TURN_RADIUS_M * (1.0 - cos)], [cos, sin])
    } else {
        ([0.0, TURN_RADIUS_M + along - quarter], [0.0, 1.0])
    }
}

fn source(time_s: Vec<f64>, channels: Vec<(&str, usize, Vec<f64>)>) -> Source {
    let channels = channels
        .into_iter()
        .map(|(name, width, values)| (name.to_owned(), Channel { width, values }))
        .collect();
    Source { time_s, channels }
}

/// Flies one arm for `duration_s`.
pub(crate) fn fly(hold_m_s2: f64, wings: bool, duration_s: f64) -> FlightLog {
    let samples = (duration_s * RATE_HZ) as usize + 1;
    let time: Vec<f64> = (0..samples).map(|i| i as f64 / RATE_HZ).collect();
    let (mut position, mut velocity) = ([-20.0, 0.0, 2.0], [SPEED_M_S, 0.0, 0.0]);
    let (mut tilt_n, mut tilt_e, mut open, mut noise) = (0.0_f64, 0.0_f64, 0.0_f64, 1_u32);
    let mut truth = [const { Vec::new() }; 3];
    let mut target = [const { Vec::new() }; 2];
    let mut wing = [const { Vec::new() }; 2];
    let (mut outer_time, mut outer) = (Vec::new(), [const { Vec::new() }; 3]);
    let mut inner = Vec::new();
    let (mut flag, mut thrust_command) = (0.0, 0.0);
    for (i, &t) in time.iter().enumerate() {
        let (r, course) = reference(t);
        let ahead = reference(t + 0.25).1;
        let mut wanted = [0, 1].map(|k| {
            let turn = (ahead[k] - course[k]) * SPEED_M_S / 0.25;
            turn + 3.0 * (r[k] - position[k]) + 2.5 * (SPEED_M_S * course[k] - velocity[k])
        });
        let size = wanted[0].hypot(wanted[1]);
        let limit = hold_m_s2.min(GRAVITY_M_S2 * 30f64.to_radians().tan() + 4.0 * open);
        if size > limit {
            wanted = wanted.map(|w| w * limit / size);
        }
        if i % 30 == 0 {
            flag = f64::from(u8::from(wings && size > 4.8));
            let cos = (limit.min(size) / GRAVITY_M_S2).atan().min(30f64.to_radians()).cos();
            thrust_command =
                (MASS_KG * GRAVITY_M_S2 / cos + 0.9 * (2.0 - position[2])).clamp(2.0, 6.6);
            let mode = if flag == 0.0 {
                0.0
            } else if thrust_command >= 6.6 {
                2.0
            } else {
                1.0
            };
            outer_time.push(t);
            for (channel, value) in outer.iter_mut().zip([flag, mode, thrust_command]) {
                channel.push(value);
            }
        }
        let dt = 1.0 / RATE_HZ;
        open += (flag - open) * dt / 0.07;
        tilt_n += (wanted[0].clamp(-5.66, 5.66) / GRAVITY_M_S2 - tilt_n) * dt / 0.09;
        tilt_e += (wanted[1].clamp(-5.66, 5.66) / GRAVITY_M_S2 - tilt_e) * dt / 0.09;
        let more = 1.0 + open * (limit / 5.66 - 1.0).max(0.0);
        let sink = -1.6 * (wanted[0].hypot(wanted[1]) / 9.0).powi(2) - 2.0 * velocity[2]
            + 2.0 * (2.0 - position[2]);
        for (k, a) in [tilt_n * GRAVITY_M_S2 * more, tilt_e * GRAVITY_M_S2 * more, sink]
            .into_iter()
            .enumerate()
        {
            velocity[k] += a * dt;
            position[k] += velocity[k] * dt;
        }
        noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let jitter = f64::from(noise >> 8) / f64::from(1 << 24) - 0.5;
        truth[0].extend([position[0], position[1], -position[2]]);
        truth[1].extend([velocity[0], velocity[1], -velocity[2]]);
        // Tilting forward is a negative rotation about the right axis.
        let (half, axis) = (0.5 * tilt_n.hypot(tilt_e).atan(), tilt_n.hypot(tilt_e).max(1e-12));
        let (sin, cos) = half.sin_cos();
        truth[2].extend([cos, sin * tilt_e / axis, -sin * tilt_n / axis, 0.0]);
        target[0].extend([r[0], r[1], -2.0]);
        target[1].extend([SPEED_M_S * course[0], SPEED_M_S * course[1], 0.0]);
        wing[0].extend([open, 0.97 * open]);
        wing[1].extend([flag, flag]);
        inner.push(thrust_command + 0.35 * jitter);
    }
    let ([position, velocity, attitude], [r, r_dot]) = (truth, target);
    let ([deployment, command], [flags, modes, thrust]) = (wing, outer);
    let sources = [
        (
            "truth",
            source(
                time.clone(),
                vec![
                    ("position_ned_m", 3, position),
                    ("velocity_ned_m_s", 3, velocity),
                    ("q_ned_from_body_wxyz", 4, attitude),
                ],
            ),
        ),
        (
            "reference",
            source(time.clone(), vec![("position_ned_m", 3, r), ("velocity_ned_m_s", 3, r_dot)]),
        ),
        (
            "wing",
            source(time.clone(), vec![("deployment", 2, deployment), ("command", 2, command)]),
        ),
        (
            "control.outer",
            source(
                outer_time,
                vec![("flag", 1, flags), ("mode", 1, modes), ("thrust_command_n", 1, thrust)],
            ),
        ),
        ("control.inner", source(time, vec![("thrust_n", 1, inner)])),
    ];
    let sources = sources.into_iter().map(|(name, source)| (name.to_owned(), source)).collect();
    FlightLog { metadata: BTreeMap::new(), sources }
}

/// The logs of all arms.
pub(crate) fn logs(duration_s: f64) -> Vec<FlightLog> {
    ARMS.iter().map(|&(_, hold, wings)| fly(hold, wings, duration_s)).collect()
}

/// The views on these logs.
pub(crate) fn views(logs: &[FlightLog]) -> Vec<FlightView<'_>> {
    let view = |(log, (arm, hold, _)): (_, &(&'static str, f64, bool))| FlightView {
        arm,
        log,
        obstacles: OBSTACLES.to_vec(),
        tilt_max_rad: 30f64.to_radians(),
        thrust_max_n: 6.6,
        summary: vec![
            ("RMS error, m".to_owned(), format!("{:.2}", 9.0 / hold)),
            ("largest error, m".to_owned(), format!("{:.2}", 20.0 / hold)),
            ("lowest height, m".to_owned(), format!("{:.2}", 2.0 - 0.1 * hold)),
            ("time at tilt limit, s".to_owned(), format!("{:.1}", 12.0 / hold)),
            ("clearance, m".to_owned(), format!("{:.2}", 0.2 * hold)),
        ],
    };
    logs.iter().zip(&ARMS).map(view).collect()
}

/// What stands above the panels.
pub(crate) fn heading() -> Heading {
    let fact = |name: &str, value: &str| (name.to_owned(), value.to_owned());
    Heading {
        title: "Quarter turn at 7 m/s, radius 5 m".to_owned(),
        lead: "Three arms fly the same turn around an obstacle; the turn needs 9.8 m/s\u{b2} sideways, more than a tilt of \
               30\u{b0} gives."
            .to_owned(),
        facts: vec![
            fact("vehicle", "squirrel, 0.548 kg"),
            fact("thrust-to-weight", "1.23"),
            fact("seed", "7"),
            fact("scenario", "avoid"),
            fact("wind", "none"),
        ],
        card: String::new(),
    }
}
