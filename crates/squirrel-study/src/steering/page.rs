//! Steering angles and speeds as a page: the paper's wheels (Fig. 9), tracks of one cell, and every
//! number.

use super::{
    ANGLES_DEG, Mean, SPEEDS_M_S, Steering, THRUST_TO_WEIGHT, Wings, conditions, ratio, words,
};
use crate::campaign::Plan;
use crate::pages::{begin, figure, head, ink, row, tracks};
use squirrel_report::chart::{Axis, Limit, Range, Svg, Wheel, WheelLine};
use squirrel_report::page::{Columns, Figure, Page};
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::FlightError;

/// Where tracks are shown: scarce thrust, the paper's angle and about its speed.
const SHOWN_DEG: f64 = 120.0;
/// m/s.
const SHOWN_M_S: f64 = 7.0;
/// Of which arms.
const SHOWN: [Arm; 4] = [Arm::Pc, Arm::TwccFlat, Arm::TwccParnn, Arm::TwccPlus];
/// Above this ratio a line would press all others into the centre.
const LARGEST_RATIO: f64 = 1.1;

/// The study as a page without network.
///
/// # Errors
/// A flight that fails.
pub fn page(study: &Steering, plan: &Plan) -> Result<String, FlightError> {
    let lead = "The avoidance manoeuvre at several steering angles and speeds, R_d 5 m: the error of each arm over that of pc, less \
                than 1 is better. In paper mode the plant's wing is the network that twcc_parnn believes in, as in the paper's \
                simulations; independent is the vehicle's own wing.";
    let facts = [
        ("vehicle", study.vehicle.clone()),
        ("trials an arm and cell", study.trials.to_string()),
        ("seed", study.seed.to_string()),
    ];
    let mut page = begin("Steering angles and speeds", lead, &facts, &words(study));
    page.section(
        "Wheels: the paper's arms",
        "A spoke for each steering angle, a mean over the speeds, and for each speed, a mean over the angles. The distance from \
         the centre is the error over that of pc, whose circle is red: inside it is better. The centre is not zero; wheels of \
         one thrust-to-weight ratio have one scale. Where lines coincide, the last of the legend is in front.",
    );
    wheels(&mut page, study, &|arm| !is_plus(arm));
    page.section(
        "Wheels: the law that chooses wings and attitude together",
        "The same from zero: twcc_plus and its wingless rival pc_plus, and twcc_parnn to compare with.",
    );
    wheels(&mut page, study, &|arm| is_plus(arm) || arm == Arm::TwccParnn.name());
    flown(&mut page, study, plan)?;
    numbers(&mut page, study);
    Ok(page.html())
}

fn is_plus(arm: &str) -> bool {
    [Arm::TwccPlus, Arm::PcPlus].iter().any(|plus| plus.name() == arm)
}

/// Which ratios a wheel shows.
type Spokes = fn(&Mean) -> &[f64];

/// A row of wheels for each ratio and plant: by angle and by speed.
fn wheels(page: &mut Page, study: &Steering, shown: &dyn Fn(&str) -> bool) {
    let by: [(&str, Spokes, Vec<String>); 2] = [
        (
            "angle",
            |mean| &mean.ratio_by_angle,
            ANGLES_DEG.iter().map(|angle| format!("{angle:.0} deg")).collect(),
        ),
        (
            "speed",
            |mean| &mean.ratio_by_speed,
            SPEEDS_M_S.iter().map(|speed| format!("{speed:.0} m/s")).collect(),
        ),
    ];
    let mut figures: Vec<Figure> = Vec::new();
    for thrust_to_weight in THRUST_TO_WEIGHT {
        let of_ratio = |mean: &&Mean| mean.thrust_to_weight == thrust_to_weight && shown(mean.arm);
        let means =
            || study.means.iter().filter(of_ratio).filter(|mean| mean.arm != Arm::Pc.name());
        let ratios = |mean: &Mean| [&mean.ratio_by_angle[..], &mean.ratio_by_speed].concat();
        // Too large on one plant is too large on both: the same arms are compared.
        let most = |arm: &str| {
            largest(&means().filter(|mean| mean.arm == arm).flat_map(ratios).collect::<Vec<_>>())
        };
        let is_large = |arm: &str| most(arm) > LARGEST_RATIO;
        let mut drawn: Vec<&Mean> = means().filter(|mean| !is_large(mean.arm)).collect();
        // The paper's arm in front: others may hide behind it.
        drawn.sort_by_key(|mean| mean.arm == Arm::TwccParnn.name());
        let mut range = drawn
            .iter()
            .flat_map(|mean| ratios(mean))
            .fold([1.0, 1.0], |[low, high]: [f64; 2], ratio| [low.min(ratio), high.max(ratio)]);
        if drawn.iter().any(|mean| is_plus(mean.arm)) {
            range[0] = 0.0;
        }
        let of_plant =
            means().filter(|mean| mean.wings == Wings::Independent && is_large(mean.arm));
        let left_out: Vec<String> = of_plant
            .map(|mean| {
                format!("{} is left out, with ratios up to {:.2}", mean.arm, most(mean.arm))
            })
            .collect();
        let caption = if left_out.is_empty() { String::new() } else { left_out.join("; ") + "." };
        for wings in Wings::ALL {
            for (what, spokes, names) in &by {
                let title = format!("{}, T/W {thrust_to_weight:.1}, by {what}", wings.name());
                let of: Vec<&Mean> =
                    drawn.iter().filter(|mean| mean.wings == wings).copied().collect();
                let drawing = wheel(&title, names, &of, *spokes, range);
                figures.push(figure(title, caption.clone(), drawing));
            }
        }
    }
    page.figures(Columns::Two, &figures);
}

fn largest(ratios: &[f64]) -> f64 {
    ratios.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

fn wheel(
    title: &str,
    names: &[String],
    means: &[&Mean],
    spokes: Spokes,
    [low, high]: [f64; 2],
) -> Svg {
    let axis = Axis::new("error over pc", "").with_range(Range::Including(low, high));
    let mut wheel = Wheel::new(&format!("error over that of pc, {title}"), axis, names.to_vec());
    wheel.width = Columns::Two.width();
    wheel.limits.push(Limit { y: 1.0, label: "pc".to_owned() });
    wheel.lines.extend(means.iter().map(|mean| WheelLine {
        name: mean.arm.to_owned(),
        ink: ink(mean.arm),
        values: spokes(mean).to_vec(),
    }));
    wheel.svg()
}

/// Tracks of the first trial in one cell.
fn flown(page: &mut Page, study: &Steering, plan: &Plan) -> Result<(), FlightError> {
    let is = |x: f64, wanted: f64| (x - wanted).abs() < 1e-9;
    // Cells are in the order of their conditions.
    let is_shown = |cell: &super::Cell| {
        cell.wings == Wings::Independent
            && is(cell.thrust_to_weight, THRUST_TO_WEIGHT[0])
            && is(cell.angle_deg, SHOWN_DEG)
            && is(cell.speed_m_s, SHOWN_M_S)
    };
    let conditions = conditions(&plan.vehicle)?;
    let Some(condition) = study.cells.iter().position(is_shown).and_then(|i| conditions.get(i))
    else {
        return Ok(());
    };
    page.section(
        &format!(
            "One cell: {SHOWN_DEG:.0} deg at {SHOWN_M_S:.0} m/s, T/W {:.1}",
            THRUST_TO_WEIGHT[0]
        ),
        "The first trial on the independent plant, coloured by speed.",
    );
    tracks(page, plan, condition, &SHOWN)
}

fn numbers(page: &mut Page, study: &Steering) {
    let cells = ANGLES_DEG.len() * SPEEDS_M_S.len();
    page.section(
        "Means",
        &format!(
            "Means over {cells} cells of the error over that of pc; horizontal: of errors without height; better: in how many cells."
        ),
    );
    let mut names =
        head(&["arm", "plant", "T/W", "all", "horizontal", "better than pc", "than twcc_flat"]);
    names.extend(ANGLES_DEG.iter().map(|angle| format!("{angle:.0} deg")));
    names.extend(SPEEDS_M_S.iter().map(|speed| format!("{speed:.0} m/s")));
    let of_mean = |mean: &Mean| {
        let place = [mean.wings.name().to_owned(), format!("{:.1}", mean.thrust_to_weight)];
        let all = [mean.ratio, mean.ratio_horizontal].map(|ratio| format!("{ratio:.3}"));
        let better = [mean.better, mean.better_than_flat].map(|count| count.to_string());
        let ratios = mean
            .ratio_by_angle
            .iter()
            .chain(&mean.ratio_by_speed)
            .map(|ratio| format!("{ratio:.3}"));
        row(mean.arm, place.into_iter().chain(all).chain(better).chain(ratios))
    };
    page.table(&names, &study.means.iter().map(of_mean).collect::<Vec<_>>());

    page.section(
        "Every number",
        "Ratio: of the mean error to that of pc, with its paired 95 % interval.",
    );
    let names = [
        "arm",
        "plant",
        "T/W",
        "angle deg",
        "speed m/s",
        "RMSE m",
        "horizontal m",
        "ratio",
        "95 % interval",
        "lost m",
        "gained m",
        "wings open s",
    ];
    let mut rows = Vec::new();
    for cell in &study.cells {
        for of in &cell.rows {
            let ratio = ratio(of.gain);
            rows.push(row(
                of.arm,
                [
                    cell.wings.name().to_owned(),
                    format!("{:.1}", cell.thrust_to_weight),
                    format!("{:.0}", cell.angle_deg),
                    format!("{:.0}", cell.speed_m_s),
                    format!("{:.2}", of.rmse_m),
                    format!("{:.2}", of.rmse_horizontal_m),
                    format!("{:.3}", ratio.value),
                    format!("{:.3} to {:.3}", ratio.low, ratio.high),
                    format!("{:.2}", of.height_lost_m),
                    format!("{:.2}", of.height_gained_m),
                    format!("{:.2}", of.wings_open_s),
                ],
            ));
        }
    }
    page.table(&head(&names), &rows);
}
