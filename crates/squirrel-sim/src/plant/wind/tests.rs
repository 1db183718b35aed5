//! Strengths and seeds of gusts of one length.

use super::*;

fn meeting() -> Meeting {
    Meeting { through_air: In::new(Vector3::new(5.0, 0.0, 0.0)), height_m: 30.0 }
}

fn spread(gust: GustModel, dt_s: f64) -> [f64; 3] {
    let mut wind = Wind::new(
        WindParameters { mean_ned_m_s: [2.0, 0.0, 0.0], gust_sigma_m_s: 1.5, gust },
        0.4,
        1,
    );
    let n = 400_000;
    let mut square = Vector3::zeros();
    for _ in 0..n {
        wind.advance(dt_s, meeting);
        let gust = wind.velocity().vector - Vector3::new(2.0, 0.0, 0.0);
        square += gust.component_mul(&gust);
    }
    (square / f64::from(n)).map(f64::sqrt).into()
}

#[test]
fn gusts_have_the_stated_size_whatever_the_step() {
    for dt_s in [0.003, 0.05] {
        for gust in [
            GustModel::GaussMarkov { time_constant_s: 0.5 },
            GustModel::Dryden { scale_length_m: 2.0 },
        ] {
            for sigma in spread(gust, dt_s) {
                assert!((sigma / 1.5 - 1.0).abs() < 0.06, "{gust:?} at {dt_s} s: {sigma}");
            }
        }
    }
}

#[test]
fn the_same_seed_gives_the_same_air() {
    let parameters = WindParameters {
        mean_ned_m_s: [0.0; 3],
        gust_sigma_m_s: 1.0,
        gust: GustModel::GaussMarkov { time_constant_s: 1.5 },
    };
    let run = |seed| {
        let mut wind = Wind::new(parameters, 0.4, seed);
        (0..100).for_each(|_| wind.advance(0.01, meeting));
        wind.velocity().vector
    };
    assert_eq!(run(7), run(7));
    assert_ne!(run(7), run(8));
}
