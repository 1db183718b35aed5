//! How a vehicle looks: what is drawn, from the numbers of its vehicle file.
//!
//! A piece is a shape, a frame that the page moves ("body", "rotor.0", "left.front", ...), and how
//! the shape lies in that frame. What a frame does at an instant is the page's business; which
//! pieces there are, and so how many triangles a frame costs, is decided here.

use serde::Serialize;

/// A rotor as it is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RotorShape {
    /// Hub in the body frame, m.
    pub hub_body_m: [f64; 3],
    /// 1 for a rotor that turns clockwise seen from above, -1 for the other way, 0 where unknown.
    pub spin: f64,
    /// Radius of the propeller, m.
    pub radius_m: f64,
}

/// A pair of wings as it is drawn: a membrane between two parallel cranks a side, which swing in
/// the wings' plane.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct WingShape {
    /// Middle of the right wing's root in the body frame, m; the left one mirrors it.
    pub root_body_m: [f64; 3],
    /// Length of the root, m.
    pub chord_m: f64,
    /// Length of a crank, m: how far a spread wing reaches from its root.
    pub span_m: f64,
    /// Angle of a crank from straight back, outwards, where the wing is folded, deg.
    pub folded_deg: f64,
    /// How far a crank swings from folded to spread, deg.
    pub stroke_deg: f64,
}

impl WingShape {
    /// What a servo with a crank sweeps, deg; folded, it lies a little below the body.
    const STROKE_DEG: f64 = 100.0;

    /// Of the numbers of a vehicle file.
    ///
    /// * `area_per_side_m2` - of one wing
    /// * `centre_body_m` - of the right wing
    pub fn new(area_per_side_m2: f64, chord_m: f64, centre_body_m: [f64; 3]) -> Self {
        let span_m = area_per_side_m2 / chord_m;
        let [x, y, z] = centre_body_m;
        let stroke_deg = Self::STROKE_DEG;
        Self {
            root_body_m: [x, y - 0.5 * span_m, z],
            chord_m,
            span_m,
            folded_deg: 90.0 - stroke_deg,
            stroke_deg,
        }
    }

    /// Angle of a crank from straight back, deg.
    ///
    /// * `deployment` - 0 folded, 1 spread
    pub fn crank_deg(&self, deployment: f64) -> f64 {
        self.folded_deg + self.stroke_deg * deployment
    }
}

/// A vehicle as it is drawn.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Body {
    /// Rotors, in command order.
    pub rotors: Vec<RotorShape>,
    /// Wings, if it has any.
    pub wing: Option<WingShape>,
    /// Height of the airframe, m.
    pub height_m: f64,
    /// Weight, N, where it is known.
    pub weight_n: Option<f64>,
}

impl Body {
    /// Stands in for a vehicle of which only the number of rotors is known: hubs on a circle, half
    /// a step from straight ahead.
    pub fn unknown(rotors: usize) -> Self {
        let rotors = rotors.max(1);
        let angle = |k: usize| (k as f64 + 0.5) / rotors as f64 * std::f64::consts::TAU;
        let radius_m = 0.12 * (0.5 * std::f64::consts::TAU / rotors as f64).sin().clamp(0.2, 0.65);
        let rotor = |k: usize| {
            let hub_body_m = [0.12 * angle(k).cos(), 0.12 * angle(k).sin(), 0.0];
            RotorShape { hub_body_m, spin: 0.0, radius_m }
        };
        Self {
            rotors: (0..rotors).map(rotor).collect(),
            wing: None,
            height_m: 0.03,
            weight_n: None,
        }
    }

    /// Mean distance of the hubs from the middle, m.
    pub(super) fn reach_m(&self) -> f64 {
        let sum: f64 = self.rotors.iter().map(|r| r.hub_body_m[0].hypot(r.hub_body_m[1])).sum();
        let mean = sum / self.rotors.len().max(1) as f64;
        if mean.is_finite() && mean > 1e-3 { mean } else { 0.1 }
    }
}

/// A piece of the scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Piece {
    /// Shape.
    pub(super) mesh: &'static str,
    /// Frame that moves it.
    pub(super) on: String,
    /// Colour, a variable of the style sheet; "own" is that of the flight.
    pub(super) ink: &'static str,
    /// Below one it is drawn after all that hides what is behind it.
    pub(super) alpha: f32,
    /// How it lies in its frame: rows of a matrix.
    pub(super) at: [f32; 12],
}

/// A place and a size in a frame: turned about z, then moved.
struct At {
    size: [f64; 3],
    turn_rad: f64,
    place: [f64; 3],
}

impl At {
    fn rows(&self) -> [f32; 12] {
        let (sin, cos) = self.turn_rad.sin_cos();
        let ([x, y, z], [a, b, c]) = (self.size, self.place);
        [cos * x, -sin * y, 0.0, a, sin * x, cos * y, 0.0, b, 0.0, 0.0, z, c]
            .map(|number| (number * 1e5).round() as f32 / 1e5)
    }
}

/// A piece that is not turned.
fn piece(
    mesh: &'static str,
    on: &str,
    (ink, alpha): (&'static str, f32),
    size: [f64; 3],
    place: [f64; 3],
) -> Piece {
    let at = At { size, turn_rad: 0.0, place }.rows();
    Piece { mesh, on: on.to_owned(), ink, alpha, at }
}

/// Arrows of the scene, and the colour of each.
pub(super) const ARROWS: [(&str, &str); 5] = [
    ("thrust", "s2"),
    ("wing_force", "s3"),
    ("weight", "muted"),
    ("wind", "s4"),
    ("velocity", "s5"),
];

/// The pieces of a vehicle and of what goes with it: arrows, shadow, the mark of its reference.
///
/// * `arrows` - names of those that the flight has, and how many there are of each
pub(super) fn pieces(body: &Body, arrows: &[(&str, usize)], reference: bool) -> Vec<Piece> {
    let r = body.reach_m();
    let half_height = (0.5 * body.height_m).clamp(0.05 * r, 0.2 * r);
    let frame = ("frame", 1.0);
    let mut all = vec![
        piece("hull", "body", ("hull", 1.0), [0.8 * r, 0.27 * r, half_height], [0.0; 3]),
        // What tells the front from the back.
        piece(
            "ball",
            "body",
            ("own", 1.0),
            [0.3 * r, 0.19 * r, 0.9 * half_height],
            [0.35 * r, 0.0, -0.6 * half_height],
        ),
    ];
    for (k, rotor) in body.rotors.iter().enumerate() {
        let [x, y, z] = rotor.hub_body_m;
        let (on, radius) = (format!("rotor.{k}"), rotor.radius_m);
        let arm = At {
            size: [x.hypot(y), 0.09 * r, 0.06 * r],
            turn_rad: y.atan2(x),
            place: [0.5 * x, 0.5 * y, 0.5 * z],
        };
        let at = arm.rows();
        all.push(Piece { mesh: "box", on: "body".to_owned(), ink: frame.0, alpha: 1.0, at });
        let motor = [0.09 * r, 0.09 * r, 0.16 * r];
        all.push(piece("cylinder", "body", frame, motor, [x, y, z - 0.05 * r]));
        let blade = [1.94 * radius, 0.12 * radius, 0.015 * r];
        all.push(piece("box", &on, ("frame", 0.55), blade, [0.0, 0.0, -0.15 * r]));
        let above = [0.0, 0.0, -0.16 * r];
        all.push(piece("ring", &on, ("own", 0.55), [radius; 3], above));
        all.push(piece("disc", &on, ("own", 0.13), [radius; 3], above));
    }
    if let Some(wing) = &body.wing {
        all.extend(["left", "right"].iter().flat_map(|side| wing_pieces(wing, side, r)));
    }
    all.push(piece("disc", "shadow", ("ink", 0.22), [1.1 * r, 1.1 * r, 1.0], [0.0; 3]));
    all.push(piece("box", "drop", ("ink", 0.3), [0.02 * r, 0.02 * r, 1.0], [0.0, 0.0, 0.5]));
    if reference {
        all.push(piece("ball", "reference", ("ink", 0.75), [0.11 * r; 3], [0.0; 3]));
    }
    for (name, ink) in ARROWS {
        let count = arrows.iter().find(|(own, _)| *own == name).map_or(0, |(_, count)| *count);
        for (k, part) in (0..count).flat_map(|k| [(k, "shaft"), (k, "head")]) {
            all.push(piece(part, &format!("{name}.{part}.{k}"), (ink, 1.0), [1.0; 3], [0.0; 3]));
        }
    }
    all
}

/// Two cranks, the edge that they carry, the membrane and its ribs.
fn wing_pieces(wing: &WingShape, side: &str, r: f64) -> Vec<Piece> {
    let (thin, frame) = (0.05 * r, ("frame", 1.0));
    let crank = [wing.span_m, thin, thin];
    let on = |what: &str| format!("{side}.{what}");
    let middle = [0.5 * wing.span_m, 0.0, 0.0];
    let mut all = vec![
        piece("box", &on("front"), frame, crank, middle),
        piece("box", &on("rear"), frame, crank, middle),
        piece("box", &on("edge"), frame, [wing.chord_m + thin, thin, thin], [0.0; 3]),
        piece("sheet", &on("skin"), ("own", 0.9), [1.0; 3], [0.0; 3]),
    ];
    for k in 1..5 {
        let at = [f64::from(k) / 5.0 - 0.5, 0.5, 0.0];
        all.push(piece("box", &on("skin"), ("own", 1.0), [0.012, 1.0, 0.25 * thin], at));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_wing_has_the_area_and_the_centre_of_the_file() {
        let wing = WingShape::new(0.02, 0.2, [0.01, 0.09, 0.02]);
        assert!((wing.span_m - 0.1).abs() < 1e-12 && (wing.crank_deg(1.0) - 90.0).abs() < 1e-12);
        assert!((wing.root_body_m[1] + 0.5 * wing.span_m - 0.09).abs() < 1e-12);
        assert!((wing.crank_deg(0.0) + 10.0).abs() < 1e-12);
        assert!((wing.crank_deg(0.5) - 40.0).abs() < 1e-12);
    }

    #[test]
    fn a_vehicle_that_nothing_is_known_of_has_its_rotors() {
        for count in [0, 1, 4, 8] {
            let body = Body::unknown(count);
            assert_eq!(body.rotors.len(), count.max(1));
            assert!((body.reach_m() - 0.12).abs() < 1e-9, "{count}");
            let names: Vec<_> = pieces(&body, &[], false).into_iter().map(|p| p.on).collect();
            assert!(names.contains(&format!("rotor.{}", count.max(1) - 1)), "{names:?}");
        }
    }
}
