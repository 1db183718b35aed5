//! The chart toolkit: scales for any two numbers, curves that lose neither peaks nor gaps.

use proptest::prelude::*;
use squirrel_report::chart::{
    Axis, BINS, Ink, LARGEST, LineChart, Note, Range, Scale, Series, Svg, Track, TrackChart,
    Values, escape,
};
use squirrel_report::picture::picture;

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

fn check_scale(scale: &Scale) -> Result<(), TestCaseError> {
    prop_assert!(scale.lo() < scale.hi() && scale.lo().is_finite() && scale.hi().is_finite());
    let decade = 10f64.powf(scale.step().log10().floor());
    let mantissa = scale.step() / decade;
    let nice = [1.0, 2.0, 5.0, 10.0].iter().any(|m| (mantissa / m - 1.0).abs() < 1e-6);
    prop_assert!(nice, "step {:e}", scale.step());
    prop_assert!(scale.ticks().len() <= 24, "{} ticks", scale.ticks().len());
    for pair in scale.ticks().windows(2) {
        prop_assert!((pair[1] - pair[0]) / scale.step() - 1.0 < 1e-3, "{pair:?}");
        prop_assert!(pair[1] > pair[0]);
        prop_assert_ne!(scale.label(pair[0]), scale.label(pair[1]));
    }
    let margin = 1e-5 * scale.step();
    prop_assert!(
        scale.ticks().iter().all(|t| *t >= scale.lo() - margin && *t <= scale.hi() + margin)
    );
    Ok(())
}

proptest! {
    #[test]
    fn nice_scales_cover_their_range_with_few_round_ticks(a in any_number(), b in any_number(), n in 0_usize..12) {
        let scale = Scale::nice(a, b, n);
        check_scale(&scale)?;
        prop_assert!(scale.ticks().len() >= 2);
        prop_assert_eq!((scale.lo(), scale.hi()), (scale.ticks()[0], scale.ticks()[scale.ticks().len() - 1]));
        let margin = 1e-5 * scale.step();
        for end in [a, b].into_iter().filter(|v| v.abs() <= LARGEST) {
            prop_assert!(scale.lo() <= end + margin && end <= scale.hi() + margin, "{end:e}");
        }
    }

    #[test]
    fn exact_scales_keep_their_range(a in any_number(), b in any_number(), n in 1_usize..12) {
        let scale = Scale::exact(a, b, n);
        check_scale(&scale)?;
        if (b - a).abs() > 1e-6 * a.abs().max(b.abs()).max(1.0) && a.abs().max(b.abs()) <= LARGEST {
            prop_assert_eq!((scale.lo(), scale.hi()), (a.min(b), a.max(b)));
        }
    }

    #[test]
    fn no_data_breaks_a_line_chart(points in prop::collection::vec((any_number(), any_number()), 0..60)) {
        let (x, y) = points.into_iter().unzip();
        let mut chart = LineChart::new("any", Axis::new("x", "s"), Axis::new("y", "m"));
        chart.series.push(Series::steps("any", Ink::Series(0), x, y));
        let svg = chart.svg();
        prop_assert!(!svg.as_str().contains("NaN") && !svg.as_str().contains("inf"));
    }
}

#[test]
fn ticks_are_the_numbers_that_they_say() {
    let scale = Scale::nice(0.02, 0.98, 5);
    assert_eq!(scale.ticks(), [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]);
    let labels = |s: &Scale| s.ticks().iter().map(|t| s.label(*t)).collect::<Vec<_>>();
    assert_eq!(labels(&scale), ["0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
    assert_eq!(
        labels(&Scale::nice(-31.0, 12.0, 5)),
        ["\u{2212}40", "\u{2212}30", "\u{2212}20", "\u{2212}10", "0", "10", "20"]
    );
    assert_eq!(Scale::exact(0.3, 2.7, 5).ticks(), [0.5, 1.0, 1.5, 2.0, 2.5]);
    assert_eq!(labels(&Scale::nice(0.0, 4e6, 4)), ["0", "1e6", "2e6", "3e6", "4e6"]);
}

#[test]
fn a_constant_lies_in_the_middle() {
    for value in [0.0, 3.0, -1e16, 1e99] {
        let scale = Scale::exact(value, value, 5);
        assert!((scale.fraction(value) - 0.5).abs() < 1e-3, "{value:e}");
    }
}

fn curve_of(series: Series) -> String {
    let mut chart = LineChart::new(
        "",
        Axis::new("x", "s"),
        Axis::new("y", "m").with_range(Range::Exact(0.0, 1.0)),
    );
    chart.series.push(series);
    let svg = chart.svg();
    let path = svg.as_str().split("<path class=\"line s0\" d=\"").nth(1).unwrap();
    path.split('"').next().unwrap().to_owned()
}

#[test]
fn thinning_keeps_a_peak_of_one_sample() {
    let n = 100_000;
    let x: Vec<f64> = (0..n).map(|i| f64::from(i) * 1e-3).collect();
    let mut y = vec![0.25; x.len()];
    let flat = curve_of(Series::line("", Ink::Series(0), x.clone(), y.clone()));
    y[61_803] = 1.0;
    let peaked = curve_of(Series::line("", Ink::Series(0), x, y));
    assert!(flat.len() < 15_000, "{} characters", flat.len());
    // The plot begins 30 px below the upper edge: the peak touches it, the rest does not.
    let touches = |d: &str| d.split(['M', ' ']).filter(|w| *w == "30").count();
    assert_eq!((touches(&flat), touches(&peaked)), (0, 1));
}

#[test]
fn gaps_lift_the_pen_and_a_lone_sample_is_a_dot() {
    let y = vec![0.0, 0.5, f64::NAN, 1.0, f64::INFINITY, 0.5, 0.0];
    let x = (0..7).map(f64::from).collect();
    let d = curve_of(Series::line("", Ink::Series(0), x, y));
    assert_eq!(d.matches('M').count(), 3, "{d}");
    assert_eq!(d.matches("h0").count(), 1, "{d}");
}

#[test]
fn steps_hold_a_command_until_the_next() {
    let d = curve_of(Series::steps("", Ink::Series(0), vec![0.0, 1.0, 2.0], vec![0.0, 1.0, 1.0]));
    // Along the bottom (190 px below the top), up at once, along the top.
    assert_eq!(d, "M52 220 303 220 303 30 554 30");
}

#[test]
fn colour_grows_with_the_value_and_is_grey_without_one() {
    let n = 200;
    let points = (0..n).map(|i| [f64::from(i), 0.0]).collect();
    let mut values = (0..n).map(f64::from).collect::<Vec<_>>();
    values[150..].fill(f64::NAN);
    let axis = Axis::new("speed", "m/s").with_range(Range::Including(0.0, 200.0));
    let chart = TrackChart {
        label: String::new(),
        width: 570.0,
        plot_height: None,
        x: Axis::new("east", "m"),
        y: Axis::new("north", "m"),
        values: Some(Values::new(&axis, values.iter().copied())),
        tracks: vec![Track {
            name: String::new(),
            ink: Ink::Series(0),
            dashed: false,
            points,
            values,
            marks: Vec::new(),
        }],
        obstacles: Vec::new(),
        notes: Vec::new(),
    };
    let svg = chart.svg();
    let classes =
        svg.as_str().split("class=\"track ").skip(1).map(|p| p.split('"').next().unwrap());
    let wanted = (0..BINS * 3 / 4).map(|bin| format!("v{bin}")).chain(["muted".to_owned()]);
    assert_eq!(classes.collect::<Vec<_>>(), wanted.collect::<Vec<_>>());
}

#[test]
fn equal_scales_are_equal() {
    for (east, north) in [(40.0, 2.0), (2.0, 40.0), (10.0, 9.0), (0.0, 0.0), (1e90, 1.0)] {
        let chart = TrackChart {
            label: String::new(),
            width: 400.0,
            plot_height: None,
            x: Axis::new("east", "m"),
            y: Axis::new("north", "m"),
            values: None,
            tracks: vec![Track {
                name: String::new(),
                ink: Ink::Series(0),
                dashed: false,
                points: vec![[0.0, 0.0], [east, north]],
                values: Vec::new(),
                marks: Vec::new(),
            }],
            obstacles: Vec::new(),
            notes: Vec::new(),
        };
        let svg = chart.svg();
        let d = svg
            .as_str()
            .split("<path class=\"line s0\" d=\"")
            .nth(1)
            .unwrap()
            .split('"')
            .next()
            .unwrap();
        let n = d[1..]
            .split(' ')
            .map(|w| w.trim_end_matches("h0").parse::<f64>().unwrap())
            .collect::<Vec<_>>();
        let (dx, dy) = (n[2] - n[0], n[1] - n[3]);
        assert!((dx * north - dy * east).abs() <= 0.2 * (north + east), "{east} {north}: {d}");
        assert!(n.iter().all(|v| (0.0..=600.0).contains(v)), "{d}");
    }
}

/// A plot of two pixels a unit with these notes.
fn noted(notes: Vec<Note>) -> Svg {
    TrackChart {
        label: "a < b".to_owned(),
        width: 260.0,
        plot_height: Some(200.0),
        x: Axis::new("east", "m").with_range(Range::Exact(0.0, 100.0)),
        y: Axis::new("height", "m").with_range(Range::Exact(0.0, 100.0)),
        values: None,
        tracks: Vec::new(),
        obstacles: Vec::new(),
        notes,
    }
    .svg()
}

#[test]
fn a_note_stands_beside_its_point() {
    let note = |at, ends| Note { at, text: "pc & others".to_owned(), ink: Ink::Series(3), ends };
    let svg = noted(vec![
        note([50.0, 50.0], false),
        note([50.0, 0.0], true),
        note([f64::NAN, 0.0], true),
    ]);
    let texts: Vec<_> = svg.as_str().split("<text class=\"note s3\"").skip(1).collect();
    assert_eq!(texts.len(), 2, "{}", svg.as_str());
    // The plot begins 46 px from the left and 38 px from the top.
    assert!(
        texts[0].starts_with(" x=\"154\" y=\"142\" text-anchor=\"start\">pc &amp; others</text>"),
        "{}",
        texts[0]
    );
    assert!(texts[1].starts_with(" x=\"138\" y=\"242\" text-anchor=\"end\">"), "{}", texts[1]);
}

#[test]
fn a_picture_needs_nothing_else_and_is_light() {
    let drawing = noted(Vec::new());
    let [width, height] = drawing.size();
    let text = picture("left & right", &["first", "second"], &[drawing.clone(), drawing]);
    assert!(
        text.starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"576\" "),
        "{}",
        &text[..200]
    );
    assert_eq!(
        text.matches(&format!("<svg width=\"{width}\" height=\"{height}\" class=\"chart\""))
            .count(),
        2
    );
    assert!(text.contains(">left &amp; right</text>") && text.contains(">second</text>"));
    assert!(text.contains("--s0: #0072b2") && !text.contains("@media"));
    assert!(!text.contains("href") && !text.contains("url("), "loads something");
}

#[test]
fn text_is_made_safe() {
    assert_eq!(escape("a<b>&\"c'\u{7}"), "a&lt;b&gt;&amp;&quot;c&#39;\u{fffd}");
}
