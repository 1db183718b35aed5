//! Heat maps, matrices, row charts and wheels: cells, rows and spokes where the numbers say, and
//! nothing drawn for what is no number.

use proptest::prelude::*;
use squirrel_report::chart::{
    Axis, ChartRow, Dot, Extent, HeatGroup, HeatMap, Ink, Level, Limit, LineChart, Matrix, Range,
    RowChart, Series, Strip, Svg, Values, Wheel, WheelLine,
};

fn any_number() -> impl Strategy<Value = f64> {
    prop_oneof![
        any::<f64>(),
        -1e3..1e3,
        Just(0.0),
        Just(f64::NAN),
        Just(f64::INFINITY),
        Just(f64::MAX)
    ]
}

fn map(values: Vec<f64>) -> HeatMap {
    let scale = Axis::new("residual", "").with_range(Range::Exact(0.0, 6.0));
    HeatMap {
        label: "map".to_owned(),
        width: 900.0,
        x: Axis::new("time", "s"),
        from: 0.0,
        cell: 1.0,
        values: Values::new(&scale, std::iter::empty()),
        groups: vec![HeatGroup {
            title: "before".to_owned(),
            rows: vec![("fx".to_owned(), values.clone())],
        }],
        strips: vec![Strip { label: "speed".to_owned(), unit: "m/s".to_owned(), values }],
    }
}

fn rows(numbers: [f64; 5]) -> RowChart {
    let [from, to, low, high, at] = numbers;
    let extent = |from, to| vec![Extent { from, to, ink: Ink::Series(0), name: "x".to_owned() }];
    let mut chart = RowChart::new("rows", 570.0, Axis::new("size", "m"));
    chart.rows.push(ChartRow {
        label: "a".to_owned(),
        note: "b".to_owned(),
        bands: extent(low, high),
        bars: extent(from, to),
        intervals: extent(low, high),
        dots: vec![Dot { at, ink: Ink::Limit, name: String::new() }],
    });
    chart
}

fn matrix(values: Vec<Vec<f64>>) -> Matrix {
    let level = |below, bin| Level { below, bin, name: format!("below {below}") };
    Matrix {
        label: "pairs".to_owned(),
        names: ["a", "b", "c"].map(str::to_owned).to_vec(),
        values,
        levels: vec![level(9.0, 8), level(25.0, 3)],
    }
}

fn wheel(range: Range, names: &[&str], values: Vec<f64>) -> Wheel {
    let spokes = names.iter().map(|&name| name.to_owned()).collect();
    let mut wheel = Wheel::new("ratios", Axis::new("ratio", "").with_range(range), spokes);
    wheel.limits.push(Limit { y: 1.0, label: "pc".to_owned() });
    wheel.lines.push(WheelLine { name: "a<b".to_owned(), ink: Ink::Series(0), values });
    wheel
}

fn is_drawn(svg: &Svg) -> bool {
    let text = svg.as_str();
    text.starts_with("<svg")
        && !text.contains("NaN")
        && !text.contains("inf\"")
        && !text.contains("1000000")
}

proptest! {
    #[test]
    fn no_data_breaks_a_chart(
        values in prop::collection::vec(any_number(), 0..40),
        numbers in prop::array::uniform5(any_number()),
        cells in prop::collection::vec(prop::collection::vec(any_number(), 0..5), 0..5),
    ) {
        prop_assert!(is_drawn(&wheel(Range::Data, &["x"; 7][..cells.len()], values.clone()).svg()));
        prop_assert!(is_drawn(&map(values).svg()));
        prop_assert!(is_drawn(&rows(numbers).svg()));
        prop_assert!(is_drawn(&matrix(cells).svg()));
    }
}

#[test]
fn neighbours_of_one_colour_are_one_piece_and_gaps_stay_empty() {
    let pieces = |values: Vec<f64>| {
        let svg = map(values).svg();
        let cells = svg.as_str().split("<path class=\"fill h").skip(1).map(|p| {
            let (bin, rest) = p.split_once("\" d=\"").unwrap();
            (bin.parse::<usize>().unwrap(), rest.split('"').next().unwrap().matches('M').count())
        });
        cells.collect::<Vec<_>>()
    };
    assert_eq!(pieces(vec![0.1; 50]), [(0, 1)]);
    assert_eq!(pieces(vec![0.1, 9.0, 9.0, 0.1, f64::NAN, 0.1]), [(0, 3), (11, 1)]);
}

#[test]
fn bars_reach_as_far_as_their_numbers_say() {
    let svg = rows([0.0, 4.0, 1.0, 2.0, 3.0]).svg();
    let text = svg.as_str();
    let number = |class: &str, key: &str| -> f64 {
        let element = text.split(&format!("class=\"{class}\"")).nth(1).unwrap();
        element
            .split(&format!(" {key}=\""))
            .nth(1)
            .unwrap()
            .split('"')
            .next()
            .unwrap()
            .parse()
            .unwrap()
    };
    // The first of each class is its key in no legend: legends come last.
    let (bar, band) = (number("fill s0", "width"), number("shade s0", "width"));
    assert!((bar / band - 4.0).abs() < 0.01, "{bar} {band}");
    let from_zero = number("dot limit", "cx") - number("fill s0", "x");
    assert!((from_zero / bar - 0.75).abs() < 0.01, "{from_zero} {bar}");
}

/// The pairs of numbers of the wheel's line, without those of its key in the legend.
fn round(wheel: &Wheel) -> (String, Vec<[f64; 2]>) {
    let svg = wheel.svg();
    let d = svg
        .as_str()
        .split("<path class=\"line s0\" d=\"")
        .nth(1)
        .unwrap()
        .split('"')
        .next()
        .unwrap();
    let numbers = d.split(['M', ' ']).filter(|word| !word.is_empty());
    let numbers: Vec<f64> =
        numbers.map(|word| word.trim_end_matches("h0").parse().unwrap()).collect();
    (d.to_owned(), numbers.as_chunks().0.to_vec())
}

#[test]
fn a_wheel_has_its_numbers_on_its_spokes() {
    let wheel = wheel(Range::Exact(0.5, 1.5), &["n", "e", "s", "w"], vec![1.0, 1.5, 0.5, 9.0]);
    let (_, points) = round(&wheel);
    let text = wheel.svg().as_str().to_owned();
    let circle = text.split("<circle class=\"line limit\" cx=\"").nth(1).unwrap();
    let [x, y, ring] = [0, 2, 4].map(|i| circle.split('"').nth(i).unwrap().parse::<f64>().unwrap());
    assert_eq!(ring, 0.5 * wheel.rim_px);
    // Half way up, at the rim to the right, in the centre, beyond the axis at the rim to the left,
    // and closed.
    let wanted = [[x, y - ring], [x + 2.0 * ring, y], [x, y], [x - 2.0 * ring, y], [x, y - ring]];
    assert_eq!(points, wanted);
    assert!(
        text.contains(">a&lt;b</text>")
            && text.contains(">pc</text>")
            && text.contains(">w</text>")
    );
}

#[test]
fn a_spoke_without_a_number_opens_the_wheel() {
    let of = |values| round(&wheel(Range::Exact(0.0, 2.0), &["a", "b", "c", "d"], values)).0;
    assert_eq!(of(vec![1.0; 4]).matches('M').count(), 1);
    assert_eq!(of(vec![1.0, f64::NAN, 1.0, f64::INFINITY]).matches("h0").count(), 3);
    assert_eq!(of(vec![1.0, 1.0]).matches('M').count(), 2, "numbers that are missing are gaps");
}

#[test]
fn a_matrix_marks_what_is_below_its_levels() {
    let svg = matrix(vec![
        vec![f64::NAN, 8.9, 9.0],
        vec![8.9, f64::NAN, 25.0],
        vec![9.0, 25.0, f64::NAN],
    ])
    .svg();
    let text = svg.as_str();
    // One more each for the legend.
    assert_eq!((text.matches("fill h8").count(), text.matches("fill h3").count()), (3, 3));
    assert_eq!((text.matches(">8.9<").count(), text.matches(">25<").count()), (2, 2));
    let large = matrix(vec![vec![f64::NAN, 1e4, f64::INFINITY]]).svg();
    assert!(large.as_str().contains("&gt;999") && large.as_str().contains('\u{221e}'));
}

#[test]
fn strokes_stand_alone() {
    let mut chart = LineChart::new("", Axis::new("lag", "s"), Axis::new("correlation", ""));
    chart.series.push(Series::strokes(
        "",
        Ink::Series(0),
        &[1.0, 2.0, 3.0],
        &[0.0; 3],
        &[0.5, -0.5, f64::NAN],
    ));
    let svg = chart.svg();
    let d = svg
        .as_str()
        .split("<path class=\"line s0\" d=\"")
        .nth(1)
        .unwrap()
        .split('"')
        .next()
        .unwrap();
    assert_eq!(d.matches('M').count(), 3, "{d}");
    assert_eq!(d.matches("h0").count(), 1, "the end that is no number leaves a dot at zero: {d}");
}
