//! Spectra and strengths against the forms of the specification, written down here once more.

use super::*;
use crate::flight::CONTROL_RATE_HZ;
use crate::plant::{GustModel, Wind, WindParameters};
use squirrel_core::effects::Effects;
use squirrel_core::vehicle::Vehicle;
use std::f64::consts::TAU;

const SPAN_M: f64 = 0.36;
const WIND_M_S: f64 = 3.0;
const HEIGHT_M: f64 = 30.0;
const SPEED_M_S: f64 = 7.0;
const DT_S: f64 = 1.0 / CONTROL_RATE_HZ as f64;

fn air(mean_ned_m_s: [f64; 3], seed: u64) -> Wind {
    let gust = GustModel::Mil { wind_6m_m_s: WIND_M_S };
    Wind::new(WindParameters { mean_ned_m_s, gust_sigma_m_s: 0.0, gust }, SPAN_M, seed)
}

fn flying(north: f64, east: f64, height_m: f64) -> Meeting {
    Meeting { through_air: In::new(Vector3::new(north, east, 0.0)), height_m }
}

/// `u v w p q r` for a flight to the east.
fn along_east(wind: &Wind) -> [f64; 6] {
    let (v, w) = (wind.velocity().vector, wind.angular_velocity().unwrap().vector);
    [v.y, -v.x, v.z, w.y, -w.x, w.z]
}

/// Lengths, m, and standard deviations, m/s, along, across and vertical.
fn low_altitude(height_m: f64) -> [[f64; 3]; 2] {
    let h = height_m / 0.3048;
    let (across, ratio) =
        (h / (0.177 + 0.000_823 * h).powf(1.2), (0.177 + 0.000_823 * h).powf(-0.4));
    let sigma = 0.1 * WIND_M_S;
    [[across, across, h].map(|feet| feet * 0.3048), [ratio * sigma, ratio * sigma, sigma]]
}

/// Spectrum of `u v w p q r` over circular frequency, one-sided.
fn spectra(omega: f64) -> [f64; 6] {
    let [[l_u, l_v, l_w], [s_u, s_v, s_w]] = low_altitude(HEIGHT_M);
    let (v, b) = (SPEED_M_S, SPAN_M);
    let across = |l: f64, s: f64| {
        let x = (l * omega / v).powi(2);
        s * s * l / (PI * v) * (1.0 + 3.0 * x) / (1.0 + x).powi(2)
    };
    let lag = |spans: f64| 1.0 + (spans * b * omega / (PI * v)).powi(2);
    [
        s_u * s_u * 2.0 * l_u / (PI * v) / (1.0 + (l_u * omega / v).powi(2)),
        across(l_v, s_v),
        across(l_w, s_w),
        s_w * s_w / (v * l_w) * 0.8 * (PI * l_w / (4.0 * b)).cbrt() / lag(4.0),
        (omega / v).powi(2) / lag(4.0) * across(l_w, s_w),
        (omega / v).powi(2) / lag(3.0) * across(l_v, s_v),
    ]
}

/// Discrete Fourier transform of a power of two of numbers: real and imaginary parts.
///
/// * `turns` - cosine and sine of the steps of a turn, as many as numbers in all
fn transform(x: &[[f64; 2]], turns: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let n = x.len();
    if n == 1 {
        return x.to_vec();
    }
    let part = |from: usize| {
        transform(&x.iter().skip(from).step_by(2).copied().collect::<Vec<_>>(), turns)
    };
    let (even, odd) = (part(0), part(1));
    let mut out = vec![[0.0; 2]; n];
    for k in 0..n / 2 {
        let ([cos, sin], [a, b]) = (turns[k * (turns.len() / n)], odd[k]);
        let turned = [a * cos + b * sin, b * cos - a * sin];
        out[k] = [even[k][0] + turned[0], even[k][1] + turned[1]];
        out[k + n / 2] = [even[k][0] - turned[0], even[k][1] - turned[1]];
    }
    out
}

/// Spectra from 0.1 to 6 Hz over those of the specification, of six hours of flight by Welch's
/// method: within 5 % in each band.
#[test]
fn spectra_are_those_of_the_specification_along_the_flight() {
    const SEGMENT: usize = 32_768;
    const SEGMENTS: usize = 400;
    const BANDS_HZ: [f64; 6] = [0.1, 0.3, 0.6, 1.2, 2.4, 6.0];
    let mut wind = air([0.0; 3], 3);
    let turn = |i: usize| TAU * i as f64 / SEGMENT as f64;
    let turns: Vec<[f64; 2]> = (0..SEGMENT).map(|i| [turn(i).cos(), turn(i).sin()]).collect();
    let window: Vec<f64> = turns.iter().map(|[cos, _]| 0.5 - 0.5 * cos).collect();
    let per_hz = 2.0 * DT_S / window.iter().map(|w| w * w).sum::<f64>() / SEGMENTS as f64;
    let bin_hz = 1.0 / (SEGMENT as f64 * DT_S);
    let bin = |hz: f64| (hz / bin_hz).ceil() as usize;
    let mut power = vec![[0.0; 6]; bin(6.0)];
    let mut flown: Vec<[f64; 6]> = Vec::new();
    for _ in 0..SEGMENTS {
        // Each segment has half of the one before.
        flown.drain(..flown.len() / 2);
        while flown.len() < SEGMENT {
            wind.advance(DT_S, || flying(0.0, SPEED_M_S, HEIGHT_M));
            flown.push(along_east(&wind));
        }
        // Two axes a transform: one as the imaginary part of the other.
        for axis in [0, 2, 4] {
            let both = flown.iter().zip(&window).map(|(row, w)| [row[axis] * w, row[axis + 1] * w]);
            let x = transform(&both.collect::<Vec<_>>(), &turns);
            for (k, power) in power.iter_mut().enumerate().skip(1) {
                let ([a, b], [c, d]) = (x[k], x[SEGMENT - k]);
                power[axis] += 0.25 * ((a + c).powi(2) + (b - d).powi(2)) * per_hz;
                power[axis + 1] += 0.25 * ((a - c).powi(2) + (b + d).powi(2)) * per_hz;
            }
        }
    }
    let ratio =
        |k: usize, axis: usize| power[k][axis] / (TAU * spectra(TAU * k as f64 * bin_hz)[axis]);
    let mut wrong = Vec::new();
    for (axis, name) in ["u", "v", "w", "p", "q", "r"].into_iter().enumerate() {
        for band in BANDS_HZ.windows(2) {
            let bins = bin(band[0])..bin(band[1]);
            let count = bins.len() as f64;
            let off = bins.map(|k| ratio(k, axis)).sum::<f64>() / count - 1.0;
            let line = format!("{name}, {} to {} Hz: {:+.1} %", band[0], band[1], 100.0 * off);
            println!("{line}");
            if !(off.abs() < 0.05) {
                wrong.push(line);
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// Steps of many lengths, so that few of them are many independent gusts.
#[test]
fn strengths_are_those_of_the_height() {
    for (height_m, counts_as_m) in
        [(0.5, 3.048), (3.048, 3.048), (30.0, 30.0), (150.0, 150.0), (304.8, 304.8), (900.0, 304.8)]
    {
        let mut wind = air([0.0; 3], 5);
        let steps = 40_000;
        let mut square = [0.0; 4];
        for _ in 0..steps {
            wind.advance(1.0, || flying(0.0, 600.0, height_m));
            for (sum, x) in square.iter_mut().zip(along_east(&wind)) {
                *sum += x * x / f64::from(steps);
            }
        }
        let [[.., l_w], [s_u, s_v, s_w]] = low_altitude(counts_as_m);
        // The integral of the spectrum of p.
        let p = s_w
            * (0.8 * (PI * l_w / (4.0 * SPAN_M)).cbrt() * PI * PI / (8.0 * SPAN_M * l_w)).sqrt();
        for (flown, form) in square.map(f64::sqrt).into_iter().zip([s_u, s_v, s_w, p]) {
            assert!((flown / form - 1.0).abs() < 0.03, "{height_m} m: {flown} for {form}");
        }
    }
}

#[test]
fn gusts_begin_as_they_go_on() {
    let mut square = Vector3::zeros();
    let mut rows = Vec::new();
    for seed in 0..20_000 {
        let wind = air([0.0; 3], seed);
        let gust = wind.velocity().vector;
        square += gust.component_mul(&gust) / 20_000.0;
        rows.push(wind.angular_velocity().unwrap().vector);
    }
    let [_, [s_u, _, s_w]] = low_altitude(3.048);
    for (flown, form) in square.iter().map(|x| x.sqrt()).zip([s_u, s_u, s_w]) {
        assert!((flown / form - 1.0).abs() < 0.03, "{flown} for {form}");
    }
    assert!(rows.iter().all(|row| row.y == 0.0 && row.z == 0.0), "pitch and yaw begin at rest");
}

/// Air that blows downwards more and more along the flight turns nose down, air that blows to the
/// right more and more turns to the right.
#[test]
fn rotations_have_the_sign_of_the_field() {
    let mut wind = air([0.0; 3], 9);
    let (mut before, mut pitch, mut yaw) = (along_east(&wind), 0.0, 0.0);
    for _ in 0..100_000 {
        wind.advance(0.02, || flying(0.0, SPEED_M_S, HEIGHT_M));
        let now = along_east(&wind);
        pitch += now[4] * (now[2] - before[2]);
        yaw += now[5] * (now[1] - before[1]);
        before = now;
    }
    assert!(pitch < 0.0 && yaw > 0.0, "{pitch}, {yaw}");
}

/// A vehicle that turns round, or stops in the wind, meets the same air in another order.
#[test]
fn a_turn_does_not_tear_the_air() {
    let mut wind = air([0.0, 2.0, 0.0], 4);
    for _ in 0..1000 {
        wind.advance(DT_S, || flying(0.0, -SPEED_M_S, HEIGHT_M));
    }
    let before = (wind.velocity().vector, wind.angular_velocity().unwrap().vector);
    for (north, east) in [(0.0, SPEED_M_S), (0.0, 0.5), (0.0, 0.0)] {
        wind.advance(0.0, || flying(north, east, HEIGHT_M));
        let now = (wind.velocity().vector, wind.angular_velocity().unwrap().vector);
        assert!((now.0 - before.0).norm() < 1e-12 && (now.1.y - before.1.y).abs() < 1e-12);
    }
    // Without a way of its own it meets the air against the wind.
    let along_wind = wind.angular_velocity();
    wind.advance(0.0, || flying(0.0, -2.0, HEIGHT_M));
    assert_eq!(wind.angular_velocity(), along_wind);
}

#[test]
fn the_same_seed_gives_the_same_air_and_none_without_wind() {
    let run = |seed| {
        let mut wind = air([0.0; 3], seed);
        (0..100).for_each(|_| wind.advance(0.01, || flying(3.0, 4.0, HEIGHT_M)));
        along_east(&wind)
    };
    assert_eq!(run(7), run(7));
    assert_ne!(run(7), run(8));
    let gust = GustModel::Mil { wind_6m_m_s: 0.0 };
    let calm = Wind::new(WindParameters { gust, ..WindParameters::calm() }, SPAN_M, 1);
    assert!(calm.angular_velocity().is_none() && calm.velocity() == In::zero());
}

#[test]
fn the_span_is_that_of_wings_or_rotors() {
    let file = crate::vehicle_file::VehicleFile::squirrel();
    let wind =
        WindParameters { gust: GustModel::Mil { wind_6m_m_s: 3.0 }, ..WindParameters::calm() };
    let first = |vehicle: &Vehicle<f64>| {
        let mut winds = Wind::of_flight(wind, vehicle, &Effects::none(), 1);
        winds[0].advance(DT_S, || flying(0.0, SPEED_M_S, HEIGHT_M));
        winds[0].angular_velocity().unwrap().vector.norm()
    };
    let mut bare = *file.vehicle.parameters();
    bare.wing = None;
    assert!(first(&Vehicle::new(bare).unwrap()) > first(&file.vehicle), "0.17 m for 0.36 m");
}
