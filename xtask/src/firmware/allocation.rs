//! The weighted allocation: what random demands take, and whether the thrusts have the host's bits.

use super::{Figures, QEMU, emulate};
use crate::run::root;

/// The image's name of a kind of demand, and of the figures: mean and worst.
const KINDS: [(&str, [&str; 2]); 4] = [
    (
        "within",
        [
            "allocation, four rotors, within their limits, mean, instructions",
            "allocation, four rotors, within their limits, worst, instructions",
        ],
    ),
    ("beyond", ["allocation, four rotors, beyond their limits, mean, instructions", super::figures::BEYOND]),
    (
        "weak",
        [
            "allocation, four rotors, one weak or out, mean, instructions",
            "allocation, four rotors, one weak or out, worst, instructions",
        ],
    ),
    (
        "eight",
        ["allocation, eight rotors, beyond their limits, mean, instructions", super::figures::EIGHT_BEYOND],
    ),
];

/// Plays the demands.
///
/// # Errors
/// Other bits than the host's, or nothing that can be read.
pub(super) fn measure(figures: &mut Figures) -> Result<(), String> {
    let said = emulate("allocate", None, &root()?)?;
    read(&said.lines, figures)?;
    if !said.well {
        return Err("allocation: thrusts on the M7 are not the host's".to_owned());
    }
    eprintln!("allocation: thrusts of random demands are the host's");
    Ok(())
}

fn read(lines: &[String], figures: &mut Figures) -> Result<(), String> {
    for ((kind, names), line) in KINDS.iter().zip(lines) {
        let words: Vec<&str> = line.split(' ').collect();
        let numbers = match words[..] {
            [name, _, mean, worst] if name == *kind => mean.parse().ok().zip(worst.parse().ok()),
            _ => None,
        };
        let (mean, worst) = numbers.ok_or_else(|| format!("{QEMU}: allocate: said `{line}`"))?;
        figures.extend([(names[0], mean), (names[1], worst)]);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_the_image_become_figures() {
        let lines = ["within 9 1 2", "beyond 9 3 4", "weak 9 5 6", "eight 9 7 8"].map(str::to_owned);
        let mut figures = Figures::new();
        read(&lines, &mut figures).unwrap();
        assert_eq!(figures[super::super::figures::BEYOND], 4);
        assert_eq!(figures["allocation, four rotors, one weak or out, mean, instructions"], 5);
        assert!(read(&lines[1..], &mut figures).is_err());
    }
}
