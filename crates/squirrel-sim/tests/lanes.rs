//! The elementary functions of `squirrel_core::lane` on every register of this processor.

use core::f64::consts::{PI, TAU};
use squirrel_core::lane::functions::{all, angle, cbrt, exp, half_turn_sine_and_cosine, ln, tanh, wrap};
use squirrel_core::lane::{BLOCK, Register};
use squirrel_core::math::real;
use squirrel_sim::batch::simd::{Kernel, Path, Paths};

/// Results of every function, a row each, for sixteen arguments.
struct Table<S>([S; BLOCK]);

impl<S: Paths> Kernel<S> for Table<S> {
    type Output = [[S; BLOCK]; 8];

    #[inline(always)]
    fn run<L: Register<Element = S>>(self) -> Self::Output {
        let mut out = [self.0; 8];
        for start in (0..BLOCK).step_by(L::WIDTH) {
            let x = L::load(&self.0[start..]);
            let fraction = x / (x + all(1.0));
            let cosine = (all::<L>(1.0) - fraction * fraction).root();
            let (half_sine, half_cosine) = half_turn_sine_and_cosine((fraction - all(0.5)) * all(PI));
            let results = [
                exp(all::<L>(0.0) - x),
                ln(x),
                tanh(x - all(3.0)),
                angle(fraction, cosine),
                cbrt(x),
                half_sine,
                half_cosine,
                wrap(x * all(0.25) - all(4.0)),
            ];
            for (row, result) in out.iter_mut().zip(results) {
                result.store(&mut row[start..]);
            }
        }
        out
    }
}

fn truth(x: f64) -> [f64; 8] {
    let half = (x / (x + 1.0) - 0.5) * PI;
    let turned = 0.25 * x - 4.0;
    [
        (-x).exp(),
        x.ln(),
        (x - 3.0).tanh(),
        (x / (x + 1.0)).asin(),
        x.cbrt(),
        half.sin(),
        half.cos(),
        turned - (turned / TAU).round() * TAU,
    ]
}

fn every_function<S: Paths>(tolerance: f64) {
    for step in 0..4000_u32 {
        let x: [S; BLOCK] = core::array::from_fn(|i| {
            real(10_f64.powf(-4.0 + 5.5 * (f64::from(step) * 16.0 + i as f64) / 64_000.0))
        });
        let rows = S::run(Path::available()[0], Table(x));
        for path in Path::available() {
            assert!(S::run(path, Table(x)) == rows, "{}", path.name());
        }
        for (i, x) in x.iter().enumerate() {
            let truth = truth(nalgebra::try_convert(*x).unwrap());
            for (number, (row, truth)) in rows.iter().zip(truth).enumerate() {
                let y: f64 = nalgebra::try_convert(row[i]).unwrap();
                assert!(
                    (y - truth).abs() < tolerance * truth.abs().max(0.1),
                    "{number} at {x}: {y} for {truth}"
                );
            }
        }
    }
}

#[test]
fn every_function_is_right_and_the_same_on_every_path() {
    every_function::<f32>(6e-6);
    every_function::<f64>(1e-8);
}
