//! The picture of docs/guide/wing.md: normal force of rigid wings over the angle of attack, and
//! measured plates.

use squirrel_core::aero::Air;
use squirrel_core::dynamics::rk4;
use squirrel_core::frames::In;
use squirrel_core::math::AIR_DENSITY_KG_M3;
use squirrel_core::nalgebra::Vector3;
use squirrel_report::chart::{Axis, Ink, Note, Range, Svg, Track, TrackChart};
use squirrel_report::picture::picture;
use squirrel_sim::plant::{Membrane, MembraneParameters, MembraneState};
use std::error::Error;
use std::path::Path;

const SPEED_M_S: f64 = 7.0;
const AREA_PER_SIDE_M2: f64 = 0.02;
const MODEL: Ink = Ink::Series(2);
const EIFFEL: Ink = Ink::Series(0);
const PELLETIER: Ink = Ink::Series(1);
const HANDBOOKS: Ink = Ink::Series(3);
const HELD_OUT: Ink = Ink::Series(5);
/// Where a name stands, the name, its colour, and whether it ends there.
type Name = ([f64; 2], &'static str, Ink, bool);
const FITTED_NAMES: [Name; 6] = [
    ([50.0, 1.72], "the paper's 2 sin a", Ink::Reference, true),
    ([47.0, 1.20], "model", MODEL, false),
    ([31.0, 1.38], "Eiffel", EIFFEL, true),
    ([41.0, 0.80], "model, stall at 26 deg", MODEL, false),
    ([16.0, 0.45], "Pelletier, Mueller", PELLETIER, false),
    ([90.0, 1.30], "handbooks", HANDBOOKS, true),
];
const HELD_OUT_NAMES: [Name; 5] = [
    ([30.0, 1.18], "model, 1.5", HELD_OUT, false),
    ([27.0, 1.28], "Eiffel, 1.5", HELD_OUT, true),
    ([48.0, 0.93], "model, 2", MODEL, false),
    ([20.0, 1.06], "Eiffel, 2", EIFFEL, true),
    ([24.0, 0.68], "Pelletier, Mueller, 2", PELLETIER, false),
];

/// Rows of a table in `tests/data/wing`, without its header.
fn rows(file: &str) -> Result<Vec<Vec<String>>, Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/wing");
    let text = std::fs::read_to_string(folder.join(file))?;
    Ok(text.lines().skip(1).map(|line| line.split(',').map(str::to_owned).collect()).collect())
}

/// Aspect ratio, angle of attack in deg and normal force.
type Point = [f64; 3];

fn broadside(sources: &[&str]) -> Result<Vec<Point>, Box<dyn Error>> {
    rows("broadside.csv")?
        .iter()
        .filter(|row| sources.contains(&row[0].as_str()))
        .map(|row| Ok([row[1].parse()?, 90.0, row[2].parse()?]))
        .collect()
}

fn eiffel() -> Result<Vec<Point>, Box<dyn Error>> {
    let mut points = broadside(&["eiffel"])?;
    for row in rows("eiffel_1911_inclined.csv")? {
        let (ratio, angle_deg, over): (f64, f64, f64) =
            (row[0].parse()?, row[1].parse()?, row[2].parse()?);
        let plate = points.iter().find(|p| p[0] == ratio).ok_or("a plate without broadside")?;
        points.push([ratio, angle_deg, over * plate[2]]);
    }
    Ok(points)
}

fn pelletier_mueller() -> Result<Vec<Point>, Box<dyn Error>> {
    let point = |row: &Vec<String>| {
        let (angle_deg, lift, drag): (f64, f64, f64) =
            (row[1].parse()?, row[2].parse()?, row[3].parse()?);
        let (sine, cosine) = angle_deg.to_radians().sin_cos();
        Ok([row[0].parse()?, angle_deg, lift * cosine + drag * sine])
    };
    rows("pelletier_mueller_2000.csv")?.iter().map(point).collect()
}

/// Settled normal force of a wing that nothing bends, at each degree.
fn modelled(ratio: f64, stall_deg: Option<f64>) -> Result<Vec<[f64; 2]>, Box<dyn Error>> {
    let rigid = MembraneParameters {
        tension_n_per_m: 1e12,
        ..MembraneParameters::new(AREA_PER_SIDE_M2, 0.09).with_aspect_ratio(ratio)
    };
    let stall_angle_rad = stall_deg.map_or(rigid.stall_angle_rad, f64::to_radians);
    let wing = Membrane::new(MembraneParameters { stall_angle_rad, ..rigid })?;
    let scale = AIR_DENSITY_KG_M3 * AREA_PER_SIDE_M2 * SPEED_M_S * SPEED_M_S;
    let at = |angle_deg: f64| {
        let (sine, cosine) = angle_deg.to_radians().sin_cos();
        let air = Air::new(In::new(SPEED_M_S * Vector3::new(cosine, 0.0, sine)), In::zero());
        let mut state = MembraneState::at_rest();
        for _ in 0..500 {
            state = rk4(state, 5e-3, |s| wing.evaluate(&air, [0.0; 2], [1.0; 2], s).1);
        }
        let force = wing.evaluate(&air, [0.0; 2], [1.0; 2], &state).0.force.vector;
        [angle_deg, -force.z / scale]
    };
    Ok((0..=90).map(|angle_deg| at(f64::from(angle_deg))).collect())
}

fn curve(ink: Ink, dashed: bool, points: Vec<[f64; 2]>) -> Track {
    // Their names stand in the plot.
    Track { name: String::new(), ink, dashed, points, values: Vec::new(), marks: Vec::new() }
}

fn dots(ink: Ink, ratio: f64, points: &[Point]) -> Track {
    let marks = points.iter().filter(|p| p[0] == ratio).map(|p| [p[1], p[2]]).collect();
    Track { marks, ..curve(ink, false, Vec::new()) }
}

fn chart(label: &str, tracks: Vec<Track>, names: &[Name]) -> Svg {
    let note = |(at, text, ink, ends): &Name| Note {
        at: *at,
        text: (*text).to_owned(),
        ink: *ink,
        ends: *ends,
    };
    TrackChart {
        label: format!("normal force over angle of attack, {label}"),
        width: 405.0,
        plot_height: Some(270.0),
        x: Axis::new(&format!("{label}: angle of attack"), "deg")
            .with_range(Range::Exact(0.0, 92.0)),
        y: Axis::new("normal force coefficient", "").with_range(Range::Exact(0.0, 2.05)),
        tracks,
        obstacles: Vec::new(),
        notes: names.iter().map(note).collect(),
        values: None,
    }
    .svg()
}

/// Writes `wing.svg` into a folder.
pub(super) fn draw(folder: &Path) -> Result<(), Box<dyn Error>> {
    let (eiffel, pelletier, handbooks) =
        (eiffel()?, pelletier_mueller()?, broadside(&["hoerner", "white"])?);
    let believed = (0..=90).map(|a| [f64::from(a), 2.0 * f64::from(a).to_radians().sin()]);
    let fitted = vec![
        curve(Ink::Reference, true, believed.collect()),
        curve(MODEL, true, modelled(1.0, Some(26.0))?),
        curve(MODEL, false, modelled(1.0, None)?),
        dots(EIFFEL, 1.0, &eiffel),
        dots(PELLETIER, 1.0, &pelletier),
        dots(HANDBOOKS, 1.0, &handbooks),
    ];
    let held_out = vec![
        curve(HELD_OUT, false, modelled(1.5, None)?),
        curve(MODEL, false, modelled(2.0, None)?),
        dots(HELD_OUT, 1.5, &eiffel),
        dots(EIFFEL, 2.0, &eiffel),
        dots(PELLETIER, 2.0, &pelletier),
    ];
    let drawings = [
        chart("aspect ratio 1", fitted, &FITTED_NAMES),
        chart("aspect ratio 1.5 and 2, held out", held_out, &HELD_OUT_NAMES),
    ];
    let lead = [
        "Rigid rectangular plates. Vortex part and stall are fitted to Eiffel's plates of aspect ratio 1 and 3.",
        "No measured points between 37 and 90 deg were found.",
    ];
    let text = picture("Normal force of the wing and of measured plates", &lead, &drawings);
    Ok(std::fs::write(folder.join("wing.svg"), text)?)
}
