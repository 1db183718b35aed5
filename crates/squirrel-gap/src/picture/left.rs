//! Whether what is left is noise: correlation of the whitened leftover with itself and with the
//! inputs of the flight.
//!
//! ```text
//! r_k = sum e_t e_{t+k} / sum e_t^2      c_k = sum e_t u_{t-k} / sqrt(sum e_t^2 sum u_t^2)      99 %: 2.576 / sqrt(n)
//! Q   = n (n + 2) sum_k r_k^2 / (n - k)  ~ chi-square of lags minus order (Ljung and Box, 1978)
//! ```
//! The means of each piece are removed. All flights count together.

use super::CHANNELS;
use crate::name::Naming;
use crate::predictor::{DYNAMIC, Predictor};
use crate::report::{InputCorrelation, Whiteness};

/// Lags of the correlations.
const LAGS: usize = 40;
/// 99 % of a normal distribution lies within this many standard deviations.
const BAND: f64 = 2.576;

/// Of the leftover of each channel of the dynamics.
pub(super) fn whiteness(predictor: &Predictor, naming: &Naming) -> Vec<Whiteness> {
    let inputs: Vec<Vec<(&str, Vec<f64>)>> =
        (0..predictor.tracks.len()).map(|p| inputs(predictor, p)).collect();
    (0..DYNAMIC).filter_map(|channel| of_channel(predictor, naming, channel, &inputs)).collect()
}

fn of_channel(
    predictor: &Predictor,
    naming: &Naming,
    channel: usize,
    inputs: &[Vec<(&'static str, Vec<f64>)>],
) -> Option<Whiteness> {
    let (mut own, mut square, mut n, mut order, mut lag_s) = (vec![0.0; LAGS], 0.0, 0.0, 0, 0.0);
    let names: Vec<&str> = inputs.first()?.iter().map(|(name, _)| *name).collect();
    let mut with = vec![(vec![0.0; LAGS + 1], 0.0); names.len()];
    for segment in predictor.segments.iter().filter(|s| s.channel == channel && !s.is_trim()) {
        let white = naming.found.linear.whitener.apply(std::slice::from_ref(segment), &naming.left);
        if white.len() <= LAGS {
            continue;
        }
        (order, lag_s) = (segment.rows.len() - white.len(), segment.step_s);
        let e = centred(&white);
        n += e.len() as f64;
        square += product(&e, &e);
        for (k, sum) in own.iter_mut().enumerate() {
            *sum += product(&e, &e[k + 1..]);
        }
        for ((sums, input_square), (_, input)) in with.iter_mut().zip(&inputs[segment.piece]) {
            let u = centred(&input[order..]);
            *input_square += product(&u, &u);
            for (k, sum) in sums.iter_mut().enumerate() {
                *sum += product(&e[k..], &u);
            }
        }
    }
    if !(square > 0.0) {
        return None;
    }
    let autocorrelation: Vec<f64> = own.iter().map(|sum| sum / square).collect();
    let terms = autocorrelation.iter().enumerate().map(|(k, r)| r * r / (n - (k + 1) as f64));
    let ljung_box = n * (n + 2.0) * terms.sum::<f64>();
    // An input that does not vary correlates with nothing.
    let correlation =
        |sum: &f64, input: f64| if input > 0.0 { sum / (square * input).sqrt() } else { 0.0 };
    let values =
        |(sums, input): &(Vec<f64>, f64)| sums.iter().map(|sum| correlation(sum, *input)).collect();
    Some(Whiteness {
        channel: CHANNELS[channel].0.to_owned(),
        lag_s,
        autocorrelation,
        inputs: names
            .iter()
            .zip(&with)
            .map(|(name, sums)| InputCorrelation {
                input: (*name).to_owned(),
                values: values(sums),
            })
            .collect(),
        band_99: BAND / n.sqrt(),
        ljung_box,
        ljung_box_lags: LAGS,
        ljung_box_p: chi_square_tail(ljung_box, (LAGS - order) / 2),
    })
}

/// The inputs of one piece at the rows of its dynamics.
fn inputs(predictor: &Predictor, piece: usize) -> Vec<(&'static str, Vec<f64>)> {
    let track = &predictor.tracks[piece];
    let at = |of: &dyn Fn(usize) -> f64| -> Vec<f64> {
        (0..track.measured.len()).map(|i| of(track.edge() + i * track.every)).collect()
    };
    let commanded = |k: usize| predictor.commanded(track.flight, track.time_s[k]);
    let mut all = vec![
        ("throttle", at(&|k| commanded(k).0)),
        ("roll rate", at(&|k| track.omega()[k].x)),
        ("pitch rate", at(&|k| track.omega()[k].y)),
        ("yaw rate", at(&|k| track.omega()[k].z)),
    ];
    if predictor.has_wings() {
        all.push(("wings", at(&|k| commanded(k).1)));
    }
    all
}

fn centred(x: &[f64]) -> Vec<f64> {
    let mean = x.iter().sum::<f64>() / x.len() as f64;
    x.iter().map(|v| v - mean).collect()
}

/// Sum of products up to the end of the shorter one.
fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Probability that chi-square of `2 half` degrees of freedom is larger: a sum, because their
/// number is even.
fn chi_square_tail(x: f64, half: usize) -> f64 {
    let mut term = 1.0;
    let mut sum = 0.0;
    for i in 0..half {
        if i > 0 {
            term *= 0.5 * x / i as f64;
        }
        sum += term;
    }
    // Where the exponential is nothing, the sum may be infinite.
    let share = (-0.5 * x).exp();
    if share > 0.0 { (share * sum).min(1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_of_chi_square_are_those_of_tables() {
        // 95 % and 99 % points of 2, 10 and 32 degrees of freedom.
        for (x, half, p) in [
            (5.991, 1, 0.05),
            (9.210, 1, 0.01),
            (18.307, 5, 0.05),
            (46.194, 16, 0.05),
            (53.486, 16, 0.01),
        ] {
            let got = chi_square_tail(x, half);
            assert!((got - p).abs() < 2e-5, "{x}: {got}");
        }
        assert_eq!(chi_square_tail(0.0, 16), 1.0);
        assert_eq!(chi_square_tail(1e5, 16), 0.0);
    }
}
