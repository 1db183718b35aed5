//! `squirrel_core::lane` on every register of this processor: the elementary functions, and the
//! mixer.

use core::f64::consts::{PI, TAU};
use squirrel_core::control::mix::Table;
use squirrel_core::control::mixer::{Mixer, ThrustTorque};
use squirrel_core::lane::functions::{angle, cbrt, exp, half_turn_sine_and_cosine, ln, tanh, wrap};
use squirrel_core::lane::{BLOCK, Register, Row, load, store};
use squirrel_core::math::real;
use squirrel_core::nalgebra::Vector3;
use squirrel_sim::simd::{Kernel, Path, Paths};
use squirrel_sim::vehicle_file::VehicleFile;

/// Results of every function, a row each, for sixteen arguments.
struct Functions<S>([S; BLOCK]);

impl<S: Paths> Kernel<S> for Functions<S> {
    type Output = [[S; BLOCK]; 8];

    #[inline(always)]
    fn run<L: Register<Element = S>>(self) -> Self::Output {
        let mut out = [self.0; 8];
        for start in (0..BLOCK).step_by(L::WIDTH) {
            let x = L::load(&self.0[start..]);
            let fraction = x / (x + L::of(1.0));
            let cosine = (L::of(1.0) - fraction * fraction).root();
            let (half_sine, half_cosine) =
                half_turn_sine_and_cosine((fraction - L::of(0.5)) * L::of(PI));
            let results = [
                exp(L::of(0.0) - x),
                ln(x),
                tanh(x - L::of(3.0)),
                angle(fraction, cosine),
                cbrt(x),
                half_sine,
                half_cosine,
                wrap(x * L::of(0.25) - L::of(4.0)),
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
        let rows = S::run(Path::available()[0], Functions(x));
        for path in Path::available() {
            assert!(S::run(path, Functions(x)) == rows, "{}", path.name());
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

/// Sixteen demands of thrust, roll, pitch and yaw, a row each.
struct Mixes<'a>(&'a Table<Row<f32>, 4>, [Row<f32>; 4]);

impl Kernel<f32> for Mixes<'_> {
    /// Thrust of each rotor, and whether the demand was beyond them.
    type Output = [Row<f32>; 5];

    #[inline(always)]
    fn run<L: Register<Element = f32>>(self) -> Self::Output {
        let Self(table, demands) = self;
        let mut out = [[0.0; BLOCK]; 5];
        for start in (0..BLOCK).step_by(L::WIDTH) {
            let [thrust, roll, pitch, yaw] = load::<L, 4>(&demands, start);
            let mixed = Table::<L, 4>::load(table, start).mix(4, thrust, [roll, pitch, yaw]);
            let [a, b, c, d] = mixed.rotor_thrust_n;
            store(&[a, b, c, d, mixed.saturated], &mut out, start);
        }
        out
    }
}

/// A batch mixes as the flight code does, to the bit: 100 000 demands on each register, half of
/// them beyond what rotors give.
#[test]
fn the_mixer_is_the_flight_codes_on_every_path() {
    let mixer = Mixer::new(&VehicleFile::squirrel().vehicle.cast().unwrap()).unwrap();
    let mut table = Table::all([0.0; BLOCK]);
    (0..BLOCK).for_each(|lane| table.put(lane, &mixer.table().first()));
    let mut state = 1_u64;
    let mut draw = |size: f32| {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        size * ((state >> 40) as f32 / 16_777_216.0 - 0.5)
    };
    let (mut beyond, mut asked) = (0, 0);
    while asked < 100_000 {
        let demands: [[f32; 4]; BLOCK] =
            core::array::from_fn(|_| [6.0 + draw(12.0), draw(0.6), draw(0.6), draw(0.06)]);
        let rows = core::array::from_fn(|k| core::array::from_fn(|lane| demands[lane][k]));
        let alone = demands.map(|[thrust_n, roll, pitch, yaw]| {
            mixer.allocate(&ThrustTorque { thrust_n, torque_n_m: Vector3::new(roll, pitch, yaw) })
        });
        for path in Path::available() {
            let together = f32::run(path, Mixes(&table, rows));
            for (lane, alone) in alone.iter().enumerate() {
                for rotor in 0..4 {
                    let (one, other) = (together[rotor][lane], alone.rotor_thrust_n[rotor]);
                    assert_eq!(
                        one.to_bits(),
                        other.to_bits(),
                        "{}: {:?}",
                        path.name(),
                        demands[lane]
                    );
                }
                assert_eq!(together[4][lane] > 0.0, alone.saturated, "{}", path.name());
            }
        }
        beyond += alone.iter().filter(|alone| alone.saturated).count();
        asked += BLOCK;
    }
    let share = beyond as f64 / f64::from(u32::try_from(asked).unwrap());
    assert!((0.3..0.7).contains(&share), "{share} of the demands are at the limits");
}
