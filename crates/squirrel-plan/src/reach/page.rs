//! The set as a page without network: both hulls in three dimensions, what is compared over thrust,
//! every number.

use super::{Case, Compared, Question, Reach, Wings};
use nalgebra::Vector3;
use squirrel_core::frames::In;
use squirrel_core::math::GRAVITY_M_S2;
use squirrel_report::chart::{Axis, Ink, LineChart, Range, Scene, SceneTrack, Series};
use squirrel_report::page::{Columns, Figure, Page, Row};
use squirrel_sim::setting::SettingError;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Wires of a hull around the vertical and from below to above.
const RINGS: u32 = 9;
const RIBS: u32 = 12;
/// Points of a wire.
const POINTS: u32 = 96;
/// Thrust-to-weight ratios of the curves.
const RATIOS: [f64; 10] = [1.05, 1.1, 1.15, 1.2, 1.3, 1.4, 1.6, 2.0, 2.5, 3.0];
/// Colour of folded wings.
const FOLDED: Ink = Ink::Series(0);
/// Colour of a choice of folded or spread.
const CHOICE: Ink = Ink::Series(1);

/// The page of a question and of the cases around it.
///
/// # Errors
/// As [`Reach::new`].
pub fn page(
    question: &Question,
    facts: &[(String, String)],
    cases: &[Case],
) -> Result<String, SettingError> {
    let lead = "Every acceleration that thrust, attitude and wings can make at once. Folded wings are compared with a choice of folded or \
                spread; spread wings push whether wanted or not.";
    let mut page = Page::new("What wings reach", lead);
    page.facts(facts);
    page.section(
        "Convex hulls of the accelerations",
        "Drag to turn. Wires join the points that lie furthest along directions on a grid; up is against gravity, the dot is no acceleration \
         at all.",
    );
    let hulls = Figure { drawings: vec![scene(&Reach::new(question)?).svg()], ..Figure::default() };
    page.figures(Columns::One, &[hulls]);
    page.section(
        "Over thrust",
        "At the velocity of the picture. The ratio is that of the limit of thrust to the weight.",
    );
    page.figures(Columns::Two, &curves(question)?);
    page.section("Every number", "With folded wings, with a choice, and their ratio.");
    numbers(&mut page, cases);
    Ok(page.html())
}

/// Both hulls as wires.
fn scene(reach: &Reach) -> Scene {
    let track = |name: &str, ink, dashed, points| {
        let (values, marks) = (Vec::new(), Vec::new());
        SceneTrack { name: name.to_owned(), ink, dashed, points, values, marks }
    };
    let wires = |name: &str, ink, dashed, wings| {
        let lines = wires(reach, wings).into_iter().enumerate();
        let lines =
            lines.map(move |(i, line)| track(if i == 0 { name } else { "" }, ink, dashed, line));
        lines.collect::<Vec<_>>()
    };
    let mut tracks = wires("folded", FOLDED, false, Wings::Folded);
    tracks.extend(wires("folded or spread", CHOICE, true, Wings::Spread));
    let nothing =
        SceneTrack { marks: vec![[0.0; 3]], ..track("", Ink::Reference, true, vec![[0.0; 3]]) };
    tracks.push(nothing);
    let axes = ["north", "east", "up"].map(|name| Axis::new(name, "m/s\u{b2}"));
    let label = "hulls of the accelerations".to_owned();
    Scene { label, axes, tracks, cylinders: Vec::new(), values: None }
}

/// Points of a hull along rings and ribs of directions: north, east, up, m/s^2.
fn wires(reach: &Reach, wings: Wings) -> Vec<Vec<[f64; 3]>> {
    let point = |turn: f64, rise: f64| {
        let ((s, c), (up, level)) = (turn.sin_cos(), rise.sin_cos());
        let [north, east, down] =
            reach.furthest(In::new(Vector3::new(level * c, level * s, -up)), wings).vector.into();
        [north, east, -down]
    };
    let share = |i: u32, of: u32| f64::from(i) / f64::from(of);
    let rings = (1..=RINGS).map(|i| {
        let rise = PI * share(i, RINGS + 1) - FRAC_PI_2;
        (0..=POINTS).map(|k| point(TAU * share(k, POINTS), rise)).collect()
    });
    let ribs = (0..RIBS).map(|i| {
        let turn = TAU * share(i, RIBS);
        (0..=POINTS).map(|k| point(turn, PI * share(k, POINTS) - FRAC_PI_2)).collect()
    });
    rings.chain(ribs).collect()
}

/// A chart over the thrust-to-weight ratio for each figure that is compared.
fn curves(question: &Question) -> Result<Vec<Figure>, SettingError> {
    let weight_n = question.mass_kg * GRAVITY_M_S2;
    let case =
        |ratio: f64| Case::of(&Question { thrust_max_n: ratio * weight_n, ..question.clone() });
    let cases = RATIOS.into_iter().map(case).collect::<Result<Vec<_>, _>>()?;
    let chart = |name: &str, unit: &str, least: f64, lines: [(&str, Ink, Vec<f64>); 2]| {
        let y = Axis::new(name, unit).with_range(Range::Including(least, least));
        let mut chart = LineChart::new(&format!("{name} over T/W"), Axis::new("T/W", ""), y);
        let line = |(name, ink, y)| Series::line(name, ink, RATIOS.to_vec(), y);
        chart.series = lines.map(line).into();
        Figure { title: name.to_owned(), drawings: vec![chart.svg()], ..Figure::default() }
    };
    let series = |i: usize, number: fn(Compared) -> f64| -> Vec<f64> {
        cases.iter().map(|case| case.figures()[i].2.map_or(f64::NAN, number)).collect()
    };
    let drawn = |i: &usize| cases.iter().any(|case| case.figures()[*i].2.is_some());
    let mut figures: Vec<Figure> = (0..3)
        .filter(drawn)
        .map(|i| {
            let folded = ("folded", FOLDED, series(i, |both| both.folded));
            let choice = ("folded or spread", CHOICE, series(i, |both| both.with_wings));
            let (name, unit, _) = cases[0].figures()[i];
            chart(name, unit, 0.0, [folded, choice])
        })
        .collect();
    let set = ("set", Ink::Series(2), series(3, |both| both.ratio()));
    let hull = ("hull", Ink::Series(3), series(4, |both| both.ratio()));
    figures.push(chart("volume over that of folded wings", "", 1.0, [set, hull]));
    Ok(figures)
}

fn numbers(page: &mut Page, cases: &[Case]) {
    let Some(first) = cases.first() else { return };
    let own = ["speed m/s", "descent deg", "T/W"].map(str::to_owned);
    let names = first.figures().map(|(name, unit, _)| format!("{name} {unit}"));
    let head: Vec<String> = own.into_iter().chain(names).collect();
    let rows = cases.iter().map(|case| {
        let own = [case.speed_m_s, case.descent_rad.to_degrees(), case.thrust_to_weight];
        let cell = |both: Option<Compared>| {
            both.map_or_else(
                || "\u{2013}".to_owned(),
                |both| {
                    format!(
                        "{:.2} \u{2192} {:.2} (\u{d7}{:.2})",
                        both.folded,
                        both.with_wings,
                        both.ratio()
                    )
                },
            )
        };
        let figures = case.figures().map(|(_, _, both)| cell(both));
        Row {
            ink: None,
            cells: own.map(|x| format!("{x:.2}")).into_iter().chain(figures).collect(),
        }
    });
    page.table(&head, &rows.collect::<Vec<_>>());
}
