//! When a study has flown enough.

use squirrel_study::until::Until;

#[test]
fn rounds_double_and_end_with_the_most() {
    assert_eq!(Until::rounds(100).collect::<Vec<_>>(), [16, 32, 64, 100]);
    assert_eq!(Until::rounds(64).collect::<Vec<_>>(), [16, 32, 64]);
    assert_eq!(Until::rounds(3).collect::<Vec<_>>(), [3]);
}

#[test]
fn the_widest_interval_decides() {
    let text = |low: &str| {
        format!(
            r#"{{"arms": [{{"lost": {{"value": 0.5, "low": {low}, "high": 0.54}}}},
                {{"gain": {{"value": 4.0, "low": 3.84, "high": 4.1}}, "flights": 9}}]}}"#
        )
    };
    let until: Until = "5%".parse().unwrap();
    // 4 points of a share, and 0.16 of 4.
    let (met, widest) = until.is_met(&text("0.47")).unwrap();
    assert!(met && (widest - 0.04).abs() < 1e-12, "{widest}");
    assert!(!until.is_met(&text("0.44")).unwrap().0);
    assert!(!until.is_met(&text("null")).unwrap().0, "no interval yet");
    let error = until.is_met(r#"{"value": 1.0}"#).unwrap_err();
    assert!(error.to_string().starts_with("until: this study has no intervals"), "{error}");
}

#[test]
fn a_share_has_its_sign() {
    let half: Until = "2.5%".parse().unwrap();
    let reaching = |high: f64| format!(r#"{{"value": 0.5, "low": 0.5, "high": {high}}}"#);
    assert!(half.is_met(&reaching(0.524)).unwrap().0 && !half.is_met(&reaching(0.526)).unwrap().0);
    for wrong in ["5", "0%", "-1%", "101%", "%", "NaN%"] {
        assert!(wrong.parse::<Until>().is_err(), "{wrong}");
    }
}
