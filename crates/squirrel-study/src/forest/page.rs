//! The forest as a page: where every flight ended, who came through, and every number.

use super::{BAND_M, Forest, Row, scenario, words};
use crate::campaign::Plan;
use crate::pages::{begin, chart_row, figure, head, ink, log, percent, row};
use crate::statistics::Share;
use squirrel_log::FlightLog;
use squirrel_report::chart::{Axis, Ink, Range, RowChart, Svg, Track, TrackChart, Values};
use squirrel_report::page::{Columns, Figure, Page};
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::FlightError;
use std::f64::consts::TAU;

/// The study as a page without network.
///
/// # Errors
/// A flight that fails.
pub fn page(study: &Forest, plan: &Plan) -> Result<String, FlightError> {
    let lead = "The paper's forest: 400 m through trunks of 1 m that stand 10.5 to 13.5 m apart, at 7 m/s, each turn 110 to 130 deg \
                away from a trunk that comes nearer than 5 m. A flight ends with its first contact.";
    let facts = [
        ("vehicle", study.vehicle.clone()),
        ("flights an arm", study.trials.to_string()),
        ("seed", study.seed.to_string()),
        ("effective thrust-to-weight", format!("{:.2}", study.thrust_to_weight)),
    ];
    let mut page = begin("The forest: who comes through", lead, &facts, &words(study));
    page.section(
        "Success",
        &format!(
            "In band: 400 m without contact, and never {BAND_M} m above or below the height of the start. Through: whatever \
             the height; above the trees nothing is proven. Wilson's 95 % intervals."
        ),
    );
    let successes =
        [("in band", (|row| row.in_band) as fn(&Row) -> Share), ("through", |row| row.through)];
    let figures = successes
        .map(|(what, of)| figure(what.to_owned(), String::new(), success(study, what, of)));
    page.figures(Columns::Two, &figures);
    maps(&mut page, study, plan)?;
    numbers(&mut page, study);
    Ok(page.html())
}

fn success(study: &Forest, what: &str, of: fn(&Row) -> Share) -> Svg {
    let axis = Axis::new(what, "%").with_range(Range::Exact(0.0, 100.0));
    let mut chart =
        RowChart::new(&format!("share of flights {what} by arm"), Columns::Two.width(), axis);
    chart.rows.extend(study.rows.iter().map(|row| {
        let Share { count, of, share } = of(row);
        chart_row(row.arm, share, format!("{count} of {of}"))
    }));
    chart.svg()
}

/// The first trial of an arm.
struct First {
    /// East and north, m.
    points: Vec<[f64; 2]>,
    /// m/s.
    speed: Vec<f64>,
}

impl First {
    fn read(log: &FlightLog) -> Result<Self, FlightError> {
        let channel = |name: &str| {
            let lacks = || FlightError(format!("the log lacks {name}"));
            log.channel(name).ok_or_else(lacks)
        };
        let (time, position) = channel("truth.position_ned_m")?;
        let (_, velocity) = channel("truth.velocity_ned_m_s")?;
        let rows = 0..time.len();
        let points = rows.clone().map(|i| position.row(i)).map(|p| [p[1], p[0]]).collect();
        let speed = rows.map(|i| velocity.row(i)).map(|v| v[0].hypot(v[1]).hypot(v[2])).collect();
        Ok(Self { points, speed })
    }
}

/// What all maps share, so that arms can be compared.
struct Maps<'a> {
    trunks: &'a [[f64; 3]],
    /// Half the edge of a map, m.
    reach_m: f64,
    values: Values,
}

fn maps(page: &mut Page, study: &Forest, plan: &Plan) -> Result<(), FlightError> {
    let scenario = scenario(plan, study.thrust_to_weight, 0)?;
    let fly = |row: &Row| {
        let arm = Arm::parse(row.arm).map_err(FlightError)?;
        First::read(&log(&plan.setup(arm, scenario.clone()))?)
    };
    let first = study.rows.iter().map(fly).collect::<Result<Vec<_>, _>>()?;
    let ends = study.rows.iter().flat_map(|row| &row.ends).map(|end| end.displacement_m);
    let places = ends.chain(first.iter().flat_map(|first| first.points.iter().copied()));
    let farthest =
        places.flatten().filter(|x| x.is_finite()).fold(20.0, |most: f64, x| most.max(x.abs()));
    let speed = Axis::new("speed", "m/s").with_range(Range::Including(0.0, 7.0));
    let maps = Maps {
        trunks: &scenario.all_obstacles(),
        reach_m: 1.08 * farthest,
        values: Values::new(&speed, first.iter().flat_map(|first| first.speed.iter().copied())),
    };
    page.section(
        "Where flights ended",
        "Every flight from its start in the middle: a red X where it hit, an O where it came through, whatever its height. The \
         dashed circle has the mean distance of the ends from the start. Grey dots are the trunks of the first trial, and the \
         track is that trial's, coloured by speed; other trials have other trunks.",
    );
    let map = |(row, first): (&Row, &First)| {
        let caption = format!(
            "{} of {} in band, {} through; on average {:.0} m flown and {:.0} m from the start.",
            row.in_band.count, row.in_band.of, row.through.count, row.path_m, row.displacement_m
        );
        figure(row.arm.to_owned(), caption, maps.draw(row, first))
    };
    let figures: Vec<Figure> = study.rows.iter().zip(&first).map(map).collect();
    page.figures(Columns::Three, &figures);
    Ok(())
}

impl Maps<'_> {
    fn draw(&self, row: &Row, first: &First) -> Svg {
        let axis =
            |name| Axis::new(name, "m").with_range(Range::Exact(-self.reach_m, self.reach_m));
        let plain = |ink, points| Track {
            name: String::new(),
            ink,
            dashed: false,
            points,
            values: Vec::new(),
            marks: Vec::new(),
        };
        let inside =
            |[north, east, _]: &&[f64; 3]| north.abs() < self.reach_m && east.abs() < self.reach_m;
        // Points between gaps are dots.
        let trunks = self.trunks.iter().filter(inside);
        let trunks = trunks.flat_map(|[north, east, _]| [[*east, *north], [f64::NAN; 2]]).collect();
        let round = |[east, north]: [f64; 2], radius: f64, corners: u32| {
            (0..=corners).map(move |k| {
                let angle = TAU * f64::from(k) / f64::from(corners);
                [east + radius * angle.sin(), north + radius * angle.cos()]
            })
        };
        // About 4 px.
        let size = 0.025 * self.reach_m;
        let (mut hit, mut through) = (Vec::new(), Vec::new());
        for end in &row.ends {
            let [north, east] = end.displacement_m;
            if end.through {
                through.extend(round([east, north], size, 12).chain([[f64::NAN; 2]]));
            } else {
                // From the middle, because the ink of limits is dashed: no arm is as long as a
                // dash.
                for (x, y) in [(-size, -size), (-size, size), (size, -size), (size, size)] {
                    hit.extend([[east, north], [east + x, north + y], [f64::NAN; 2]]);
                }
            }
        }
        let mean = round([0.0; 2], row.displacement_m, 72).collect();
        let track = Track {
            values: first.speed.clone(),
            marks: vec![[0.0; 2]],
            ..plain(ink(row.arm), first.points.clone())
        };
        TrackChart {
            label: format!("where flights of {} ended, from above", row.arm),
            width: Columns::Three.width(),
            plot_height: None,
            x: axis("east"),
            y: axis("north"),
            tracks: vec![
                plain(Ink::Muted, trunks),
                track,
                Track { dashed: true, ..plain(Ink::Reference, mean) },
                plain(Ink::Limit, hit),
                plain(Ink::Reference, through),
            ],
            obstacles: Vec::new(),
            notes: Vec::new(),
            values: Some(self.values.clone()),
        }
        .svg()
    }
}

fn numbers(page: &mut Page, study: &Forest) {
    page.section(
        "Every number",
        "Shares and their 95 % intervals in %; over phantom and over pc_plus: in band, less that of the rival on the same trials, \
         in points. Way, distance, climb and sink are means over the flights.",
    );
    let names = [
        "arm",
        "in band",
        "share",
        "through",
        "share",
        "over phantom",
        "over pc_plus",
        "path m",
        "from start m",
        "climb m",
        "sink m",
        "trunks met",
        "wings open s",
    ];
    let share = |share: Share| {
        let [value, low, high] =
            [share.share.value, share.share.low, share.share.high].map(|share| 100.0 * share + 0.0);
        [share.count.to_string(), format!("{value:.0} ({low:.0} to {high:.0})")]
    };
    let cells = |of: &Row| {
        let over = [of.over_phantom, of.over_pc_plus].map(|over| percent(over, 0));
        let means = [
            (of.path_m, 0),
            (of.displacement_m, 0),
            (of.height_gained_m, 1),
            (of.height_lost_m, 1),
        ];
        let rest = [(of.encounters, 1), (of.wings_open_s, 1)];
        let means = means.into_iter().chain(rest).map(|(x, digits)| format!("{x:.digits$}"));
        let counts = share(of.in_band).into_iter().chain(share(of.through));
        row(of.arm, counts.chain(over).chain(means))
    };
    let table = |page: &mut Page, rows: &[Row]| {
        page.table(&head(&names), &rows.iter().map(cells).collect::<Vec<_>>());
    };
    table(page, &study.rows);
    page.section(
        "With a limit of speed for all",
        "The same flights, with the limit of speed that ours has for the paper's laws too: what of the difference is that limit.",
    );
    table(page, &study.limited);
    page.section(
        "Turning away from the trunk",
        "The same flights with that limit, each turn to the side without the trunk instead of to one that was drawn.",
    );
    table(page, &study.away);
}
