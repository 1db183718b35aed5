//! The rigid wing against measured plates, and its camber against an exact arc: tests/data/wing.
//!
//! Fitted are the vortex part and the stall angle, to Eiffel's plates of aspect ratio 1 and 3. All
//! other points are held out.

use super::tests::{Coefficients, parameters, steady_coefficients};
use super::*;
use std::path::Path;

/// Rows of a table without its header, as text.
fn rows(file: &str) -> Vec<Vec<String>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/wing");
    let text = std::fs::read_to_string(folder.join(file)).unwrap();
    text.lines().skip(1).map(|line| line.split(',').map(str::to_owned).collect()).collect()
}
/// The same as numbers.
fn numbers<const N: usize>(file: &str) -> Vec<[f64; N]> {
    let row = |row: Vec<String>| core::array::from_fn(|i| row[i].parse().unwrap());
    rows(file).into_iter().map(row).collect()
}
/// A measured normal force.
struct Point {
    ratio: f64,
    angle_deg: f64,
    normal: f64,
}
fn broadside(source: &str) -> Vec<Point> {
    let of_source = |row: &Vec<String>| row[0] == source;
    let point = |row: Vec<String>| Point {
        ratio: row[1].parse().unwrap(),
        angle_deg: 90.0,
        normal: row[2].parse().unwrap(),
    };
    rows("broadside.csv").into_iter().filter(of_source).map(point).collect()
}
fn eiffel() -> Vec<Point> {
    let mut points = broadside("eiffel");
    for [ratio, angle_deg, over_broadside] in numbers("eiffel_1911_inclined.csv") {
        let plate = points.iter().find(|p| p.ratio == ratio && p.angle_deg == 90.0).unwrap();
        let normal = over_broadside * plate.normal;
        points.push(Point { ratio, angle_deg, normal });
    }
    points
}
fn pelletier_mueller() -> Vec<Point> {
    let point = |[ratio, angle_deg, lift, drag]: [f64; 4]| {
        let (sine, cosine) = angle_deg.to_radians().sin_cos();
        Point { ratio, angle_deg, normal: lift * cosine + drag * sine }
    };
    numbers("pelletier_mueller_2000.csv").into_iter().map(point).collect()
}
/// A plate: nothing bends it.
fn plate(ratio: f64, change: impl Fn(&mut MembraneParameters)) -> Membrane {
    let mut p =
        MembraneParameters { tension_n_per_m: 1e12, ..parameters() }.with_aspect_ratio(ratio);
    change(&mut p);
    Membrane::new(p).unwrap()
}
fn modelled(ratio: f64, angle_deg: f64) -> Coefficients {
    steady_coefficients(&plate(ratio, |_| {}), 7.0, angle_deg)
}
/// Error of the model, printed, and whether it is within 0.05 or 10 %.
fn error(point: &Point) -> (f64, bool) {
    let error = modelled(point.ratio, point.angle_deg).normal - point.normal;
    let share = error / point.normal.max(0.1);
    let (ratio, angle_deg, normal) = (point.ratio, point.angle_deg, point.normal);
    println!("{ratio:3} {angle_deg:4} deg: C_N {normal:.3}, {error:+.3} ({:+.0} %)", 100.0 * share);
    (error, error.abs() <= 0.05 || share.abs() <= 0.1)
}
/// Root mean square.
fn rms(errors: &[f64]) -> f64 {
    (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
}

#[test]
fn plates_that_were_fitted_and_plates_that_were_not_are_met() {
    let (mut fitted, mut held_out) = (Vec::new(), Vec::new());
    for point in eiffel().into_iter().filter(|p| p.ratio <= 3.0) {
        let (error, near) = error(&point);
        let fits = [1.0, 3.0].contains(&point.ratio);
        (if fits { &mut fitted } else { &mut held_out }).push(error);
        assert!(near, "aspect ratio {}, {} deg: {error}", point.ratio, point.angle_deg);
    }
    println!("rms: fitted {:.3}, held out {:.3}", rms(&fitted), rms(&held_out));
    assert!(fitted.len() == 8 && held_out.len() == 7);
    assert!(rms(&fitted) < 0.04 && rms(&held_out) < 0.08);
    for source in ["hoerner", "white"] {
        for point in broadside(source).into_iter().filter(|p| p.ratio <= 5.0) {
            assert!(error(&point).1, "{source}, aspect ratio {}", point.ratio);
        }
    }
}

/// Its first maximum is where a plate's is, within 3 deg.
#[test]
fn plates_stall_where_eiffel_saw_it() {
    for (ratio, measured_deg) in [(1.0, 37.0), (1.5, 26.0), (2.0, 21.0), (3.0, 20.0)] {
        let normal: Vec<f64> = (10..60).map(|a| modelled(ratio, f64::from(a)).normal).collect();
        let peak = normal.windows(2).position(|pair| pair[1] < pair[0]).unwrap();
        let peak_deg = 10.0 + peak as f64;
        println!("aspect ratio {ratio}: {peak_deg} deg, measured {measured_deg} deg");
        assert!((peak_deg - measured_deg).abs() <= 3.0, "{ratio}: {peak_deg} deg");
    }
}

/// Nothing of this laboratory was fitted. Before the stall the model is within 0.09 (aspect ratio
/// 1, whose points up to 10 deg were read as a straight line) and 5 % (2).
#[test]
fn another_laboratory_agrees_before_the_stall() {
    let mut errors = Vec::new();
    for point in pelletier_mueller() {
        let (error, near) = error(&point);
        if point.ratio == 1.0 && point.angle_deg <= 20.0 {
            assert!(error.abs() < 0.09, "{} deg: {error}", point.angle_deg);
        } else if point.ratio == 2.0 && point.angle_deg <= 15.0 {
            assert!(near, "{} deg: {error}", point.angle_deg);
        } else {
            // Its plates stall earlier than Eiffel's: see below.
            assert!((0.1..0.35).contains(&error), "{} deg: {error}", point.angle_deg);
            continue;
        }
        errors.push(error);
    }
    println!("rms {:.3}", rms(&errors));
    assert!(rms(&errors) < 0.045);
}

/// What the laboratories differ in is the stall: with this one's, 26 and 19 deg instead of 40 and
/// 24, the rest of its points is met too.
#[test]
fn the_other_laboratorys_plates_stall_earlier() {
    for point in pelletier_mueller().into_iter().filter(|p| p.angle_deg >= 20.0) {
        let stall_deg: f64 = if point.ratio == 1.0 { 26.0 } else { 19.0 };
        let early = plate(point.ratio, |p| p.stall_angle_rad = stall_deg.to_radians());
        let error = steady_coefficients(&early, 7.0, point.angle_deg).normal - point.normal;
        println!("{} {:4} deg: {error:+.3}", point.ratio, point.angle_deg);
        assert!(error.abs() < 0.105 * point.normal, "{} deg: {error}", point.angle_deg);
    }
}

/// Drag edge on and before the stall.
#[test]
fn a_thin_plate_has_the_drag_of_one() {
    for [ratio, angle_deg, _, drag] in numbers("pelletier_mueller_2000.csv") {
        if angle_deg <= 15.0 {
            let model = modelled(ratio, angle_deg);
            println!("{ratio} {angle_deg:4} deg: C_D {drag:.3}, {:.3}", model.drag);
            assert!((model.drag - drag).abs() < 0.03, "{ratio}, {angle_deg} deg: {}", model.drag);
        }
    }
}

/// A membrane that is the arc of a circle between fixed edges, under uniform pressure: its stretch
/// is known exactly, and with it the load `q C_N c / (E t)`, the Weber number.
#[test]
fn camber_follows_the_weber_number_of_an_arc() {
    let mut worst: f64 = 0.0;
    for prestrain in [0.0, 0.02, 0.05, 0.1] {
        let wing = MembraneParameters { prestrain, ..parameters() }.numbers();
        for step in 1..=25 {
            let camber = 0.01 * f64::from(step);
            // Over the chord.
            let radius = (0.25 + camber * camber) / (2.0 * camber);
            let stretch = 2.0 * radius * (0.5 / radius).asin();
            let weber = ((1.0 + prestrain) * stretch - 1.0) / radius;
            let off = wing.steady_camber(3.0 / 128.0 * weber) / camber - 1.0;
            worst = worst.max(off.abs());
        }
    }
    println!("worst {worst:.3}");
    assert!(worst < 0.15, "{worst}");
}

#[test]
fn the_force_does_not_jump_across_broadside() {
    // With all the camber that ten metres a second give.
    let wing = Membrane::new(parameters()).unwrap();
    let lift = |angle_deg: f64| steady_coefficients(&wing, 10.0, angle_deg).lift;
    let near = |angle_deg: f64, bound: f64| {
        assert!(lift(angle_deg).abs() < bound, "{angle_deg} deg: {}", lift(angle_deg));
    };
    near(90.0, 1e-9);
    near(89.99, 1e-3);
    near(90.01, 1e-3);
    assert!(lift(89.0) > 0.0 && lift(91.0) < 0.0);
    assert!((lift(89.0) + lift(91.0)).abs() < 1e-6);
}
