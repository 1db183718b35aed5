//! `squirrel reach`: the controllable accelerations with folded wings and with a choice of folded
//! or spread.

use super::vehicle;
use crate::output::{self, Table, say};
use crate::paths::Paths;
use serde::Serialize;
use squirrel_core::frames::In;
use squirrel_core::nalgebra::Vector3;
use squirrel_plan::reach::{Case, Compared, Question, Tilt, page};
use squirrel_plan::wing::{WingForce, WingModel};
use squirrel_sim::vehicle_file::VehicleFile;
use std::path::PathBuf;

/// Options of the command.
#[derive(Debug, clap::Args)]
pub(crate) struct Reach {
    /// Vehicle file, or the name of a bundled vehicle; squirrel if left out.
    #[arg(long)]
    vehicle: Option<PathBuf>,
    /// What spread wings do: flat, membrane, parnn. The paper's flat plate is the default, for
    /// which the set is known exactly; the others come from the vehicle file.
    #[arg(long, default_value = "flat")]
    wing: String,
    /// Velocity relative to the air: north, east, down, m/s.
    #[arg(long, value_delimiter = ',', allow_hyphen_values = true, default_value = "7,0,0")]
    velocity: Vec<f64>,
    /// Largest collective thrust over weight; the vehicle's limit if left out.
    #[arg(long)]
    thrust_to_weight: Option<f64>,
    /// How attitude is limited, at the vehicle's largest tilt: box (roll and pitch, as in flight),
    /// cone (angle to the vertical).
    #[arg(long, default_value = "box")]
    tilt: String,
    /// Heading of the box, rad; that of the velocity if left out.
    #[arg(long, allow_hyphen_values = true)]
    yaw_rad: Option<f64>,
    /// Speeds to sweep, in the direction of the velocity, m/s.
    #[arg(long, value_delimiter = ',')]
    speeds: Vec<f64>,
    /// Thrust-to-weight ratios to sweep.
    #[arg(long, value_delimiter = ',', conflicts_with = "thrust_to_weight")]
    ratios: Vec<f64>,
    /// Angles of descent to sweep, deg below the horizon, at the heading of the velocity.
    #[arg(long, value_delimiter = ',', allow_hyphen_values = true)]
    descent_deg: Vec<f64>,
    /// HTML page to write: the hulls in three dimensions and curves over thrust, for the first row.
    #[arg(long)]
    html: Option<PathBuf>,
    /// Write the numbers here as JSON.
    #[arg(long)]
    json: Option<PathBuf>,
}

#[derive(Serialize)]
struct Reached<'a> {
    vehicle: &'a str,
    mass_kg: f64,
    wing: &'static str,
    tilt: &'static str,
    tilt_max_rad: f64,
    /// Of the box; a cone has none.
    yaw_rad: Option<f64>,
    cases: &'a [Case],
}

impl Reach {
    pub(crate) fn run(&self) -> Result<(), String> {
        let paths = Paths::default().vehicle("--vehicle", &self.vehicle);
        paths.writes("--html", &self.html).writes("--json", &self.json).check()?;
        let vehicle = vehicle(self.vehicle.as_deref())?;
        let model = WingModel::parse(&self.wing).map_err(|e| format!("--{e}"))?;
        let wing = WingForce::of(&vehicle, model)?;
        let questions = self.questions(&vehicle, &wing)?;
        let bar = output::progress(questions.len() as u64, "cases");
        let case = |question| {
            bar.inc(1);
            Case::of(question)
        };
        let cases = questions.iter().map(case).collect::<Result<Vec<_>, _>>();
        bar.finish_and_clear();
        let (cases, Some(first)) = (cases?, questions.first()) else { return Ok(()) };

        let tilt = match first.tilt {
            Tilt::Box { .. } => "box",
            Tilt::Cone { .. } => "cone",
        };
        let yaw_rad = match first.tilt {
            Tilt::Box { yaw_rad, .. } => Some(yaw_rad),
            Tilt::Cone { .. } => None,
        };
        let tilt_max_rad = vehicle.vehicle.parameters().limits.tilt_max_rad;
        let limits = format!("{tilt}, {:.1} deg", tilt_max_rad.to_degrees());
        say(&format!(
            "{}: wings {}, tilt {limits}. Folded, with a choice of folded or spread, and the ratio.",
            vehicle.name,
            model.name()
        ));
        say(
            "Accelerations in m/s^2; braking is against the horizontal motion, volumes are ratios alone.\n",
        );
        table(&cases);
        if let Some(path) = &self.html {
            let fact = |name: &str, value: String| (name.to_owned(), value);
            let [north, east, down] = first.velocity.vector.into();
            let facts = [
                fact("vehicle", vehicle.name.clone()),
                fact("wings", model.name().to_owned()),
                fact("tilt", limits),
                fact("velocity north, east, down", format!("{north:.2}, {east:.2}, {down:.2} m/s")),
                fact("T/W", format!("{:.2}", cases[0].thrust_to_weight)),
                fact("version", env!("CARGO_PKG_VERSION").to_owned()),
            ];
            output::write_file(path, page(first, &facts, &cases)?.as_bytes())?;
            say(&format!("\npage: {}", path.display()));
        }
        let mass_kg = vehicle.vehicle.parameters().mass_kg;
        let wing = model.name();
        let vehicle = &vehicle.name;
        let reached =
            Reached { vehicle, mass_kg, wing, tilt, tilt_max_rad, yaw_rad, cases: &cases };
        output::write_json(self.json.as_deref(), &reached)
    }

    /// What the options ask, row by row.
    fn questions(&self, vehicle: &VehicleFile, wing: &WingForce) -> Result<Vec<Question>, String> {
        let (p, weight_n) = (vehicle.vehicle.parameters(), vehicle.vehicle.weight_n());
        let &[north, east, down] = self.velocity.as_slice() else {
            return Err(format!(
                "--velocity: {} numbers; must be north,east,down",
                self.velocity.len()
            ));
        };
        finite("--velocity", &self.velocity)?;
        let level = north.hypot(east);
        // Straight up or down has no heading; north will do.
        let heading_rad = if level > 0.0 { east.atan2(north) } else { 0.0 };
        let yaw_rad = self.yaw_rad.unwrap_or(heading_rad);
        finite("--yaw-rad", &[yaw_rad])?;
        let tilt = Tilt::named(&self.tilt, p.limits.tilt_max_rad, yaw_rad)
            .map_err(|e| format!("--{e}"))?;
        let or =
            |given: &[f64], own: f64| if given.is_empty() { vec![own] } else { given.to_vec() };
        let speeds = or(&self.speeds, level.hypot(down));
        let descents_deg = or(&self.descent_deg, down.atan2(level).to_degrees());
        let ratios =
            or(&self.ratios, self.thrust_to_weight.unwrap_or(p.limits.thrust_max_n / weight_n));
        if let Some(wrong) = descents_deg.iter().find(|x| !(-90.0..=90.0).contains(*x)) {
            return Err(format!("--descent-deg = {wrong}: must be -90 to 90"));
        }
        if let Some(wrong) = speeds.iter().find(|x| !(**x >= 0.0 && x.is_finite())) {
            return Err(format!("--speeds = {wrong}: must be finite and >= 0"));
        }
        if let Some(wrong) = ratios.iter().find(|x| !(**x > 0.0 && x.is_finite())) {
            let option = if self.ratios.is_empty() { "--thrust-to-weight" } else { "--ratios" };
            return Err(format!("{option} = {wrong}: must be finite and > 0"));
        }
        let mut questions = Vec::new();
        for speed in &speeds {
            for descent_deg in &descents_deg {
                let ((sin, cos), (s, c)) =
                    (descent_deg.to_radians().sin_cos(), heading_rad.sin_cos());
                let velocity = In::new(Vector3::new(cos * c, cos * s, sin) * *speed);
                let question = |ratio: &f64| Question {
                    mass_kg: p.mass_kg,
                    thrust_max_n: ratio * weight_n,
                    tilt,
                    velocity,
                    wing: wing.clone(),
                };
                questions.extend(ratios.iter().map(question));
            }
        }
        Ok(questions)
    }
}

fn finite(option: &str, numbers: &[f64]) -> Result<(), String> {
    match numbers.iter().find(|x| !x.is_finite()) {
        Some(wrong) => Err(format!("{option} = {wrong}: must be finite")),
        None => Ok(()),
    }
}

fn table(cases: &[Case]) {
    let head = [
        "m/s", "down deg", "T/W", "up", "wings", "ratio", "brake", "wings", "ratio", "at a_z=0",
        "wings", "ratio", "set", "hull",
    ];
    let mut table = Table::new(&head);
    for case in cases {
        let own = [case.speed_m_s, case.descent_rad.to_degrees(), case.thrust_to_weight];
        let number = |x: f64| if x.is_finite() { format!("{x:.2}") } else { "-".to_owned() };
        let three = |both: Option<Compared>| {
            both.map_or([f64::NAN; 3], |both| [both.folded, both.with_wings, both.ratio()])
        };
        let [up, free, level, set, hull] = case.figures().map(|(_, _, both)| three(both));
        let cells = own.into_iter().chain(up).chain(free).chain(level).chain([set[2], hull[2]]);
        // Plus zero turns a rounded minus zero round.
        table.row(cells.map(|x| number((100.0 * x).round() / 100.0 + 0.0)).collect());
    }
    table.print();
}
