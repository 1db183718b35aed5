//! Time with open wings, of which nothing is known where a log does not say how the vehicle moves
//! through the air: at 5 m/s wings pull several times as hard as all that is to be found.

use super::series::{Series, Span};

/// For so long wings still fold after their command, and what they felt acts, s.
const FOLDING_S: f64 = 1.0;

/// Where wings are open, in order.
pub(super) fn open(command: &Series) -> Vec<Span> {
    let mut spans: Vec<Span> = Vec::new();
    let mut since = None;
    let samples = command.samples().map(|(t, wings)| (t, wings.iter().any(|wing| *wing != 0.0)));
    for (t, is_open) in samples.chain([(f64::INFINITY, false)]) {
        match (is_open, since) {
            (true, None) => since = Some(t),
            (false, Some(from)) => {
                match spans.last_mut() {
                    Some(last) if from <= last.1 => last.1 = t + FOLDING_S,
                    _ => spans.push((from, t + FOLDING_S)),
                }
                since = None;
            }
            _ => {}
        }
    }
    spans
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wings_are_open_until_they_had_time_to_fold() {
        let told = |commands: &[(f64, f64)]| {
            let (time_s, rows): (Vec<f64>, Vec<[f64; 2]>) =
                commands.iter().map(|(t, wing)| (*t, [0.0, *wing])).unzip();
            open(&Series::computed("wing.command", 2, (time_s, rows.concat())).unwrap())
        };
        assert_eq!(told(&[(0.0, 0.0), (5.0, 0.0)]), []);
        // The second opening falls into the first one's folding.
        let commands = [(0.0, 0.0), (2.0, 1.0), (3.0, 0.0), (3.5, 0.4), (4.0, 0.0), (8.0, 1.0)];
        assert_eq!(told(&commands), [(2.0, 5.0), (8.0, f64::INFINITY)]);
    }
}
