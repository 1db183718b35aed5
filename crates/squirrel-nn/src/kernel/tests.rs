//! Gradients against finite differences in f64, forces and gradients against PyTorch, and one
//! result on every path.

use super::simd::{Path, Paths};
use crate::heads::Sample;
use crate::model::{Model, network};
use crate::windows::Window;
use nalgebra::{Vector3, convert};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use squirrel_core::frames::In;
use squirrel_core::rnn::head::{Correction, Flow, TurnedNormal};
use squirrel_core::rnn::parnn::{INPUTS, WINDOW};

const AREA_M2: f64 = 0.04;
const NETWORKS: [Model; 5] =
    [Model::Parnn, Model::ParnnWindow1, Model::VanillaNed, Model::VanillaBody, Model::VanillaPlane];

struct Draw(Pcg64Mcg);

impl Draw {
    fn new(seed: u64) -> Self {
        Self(Pcg64Mcg::seed_from_u64(seed))
    }
    /// Uniform in [low, high).
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * f64::from(self.0.next_u32()) / 4_294_967_296.0
    }
    fn parameters<S: Paths>(&mut self, model: Model) -> Vec<S> {
        (0..model.parameters()).map(|_| convert(self.between(-0.7, 0.7))).collect()
    }
    /// Flow from everywhere; the first window stands still.
    fn samples<S: Paths>(&mut self, count: usize) -> Vec<Sample<S>> {
        let mut samples: Vec<Sample<S>> = Vec::new();
        for k in 0..count {
            let rows: [[S; INPUTS]; WINDOW] = core::array::from_fn(|_| {
                [convert(self.between(0.0, 1.0)), convert(self.between(-1.5, 1.5))]
            });
            let speed = if k == 0 { 0.02 } else { 8.0 };
            let velocity = core::array::from_fn(|_| convert(self.between(-speed, speed)));
            let target = core::array::from_fn(|_| convert(self.between(-2.0, 2.0)));
            samples.push(Sample::new(rows, velocity, target));
        }
        samples
    }
}

fn all(count: usize) -> Vec<u32> {
    (0..count as u32).collect()
}

#[test]
fn gradients_are_those_of_finite_differences() {
    const STEP: f64 = 1e-5;
    let count = 37;
    let members = all(count);
    for model in NETWORKS {
        let mut draw = Draw::new(4);
        let (samples, mut parameters) = (draw.samples::<f64>(count), draw.parameters::<f64>(model));
        let mut gradient = vec![0.0; parameters.len()];
        let loss = |parameters: &[f64]| {
            let mut ignored = vec![0.0; parameters.len()];
            model.gradient(Path::best(), parameters, AREA_M2, &samples, &members, &mut ignored)
        };
        model.gradient(Path::best(), &parameters, AREA_M2, &samples, &members, &mut gradient);
        let largest = gradient.iter().fold(0.0_f64, |m, g| m.max(g.abs()));
        assert!(largest > 0.01, "{}: nothing to compare: {largest}", model.name());
        for k in 0..parameters.len() {
            let middle = parameters[k];
            parameters[k] = middle + STEP;
            let above = loss(&parameters);
            parameters[k] = middle - STEP;
            let below = loss(&parameters);
            parameters[k] = middle;
            let difference = (above - below) / (2.0 * STEP);
            let error = (difference - gradient[k]).abs();
            assert!(
                error < 1e-7 * largest.max(1.0),
                "{}[{k}]: {} by differences {difference}",
                model.name(),
                gradient[k]
            );
        }
    }
}

/// The check above sees clipped windows and free ones.
#[test]
fn the_checked_windows_are_clipped_and_not() {
    let mut draw = Draw::new(4);
    let (samples, parameters) = (draw.samples::<f64>(37), draw.parameters::<f64>(Model::Parnn));
    let net = network::<f64, 2>(&parameters);
    let clipped = samples.iter().filter(|sample| {
        let correction = Correction::from_outputs(net.window(&sample.rows));
        TurnedNormal::new(&sample.flow, correction.alpha_w_rad).clipped
    });
    let clipped = clipped.count();
    assert!((3..34).contains(&clipped), "{clipped} of 37");
}

#[test]
fn every_path_gives_the_same_bits() {
    for model in NETWORKS {
        for count in [1, 7, 16, 37, 64] {
            let mut draw = Draw::new(9);
            let (samples, parameters) = (draw.samples::<f32>(count), draw.parameters::<f32>(model));
            // Not in order, as in training.
            let members: Vec<u32> = all(count).into_iter().rev().collect();
            let results = Path::available().into_iter().map(|path| {
                let mut gradient = vec![0.0; parameters.len()];
                let loss =
                    model.gradient(path, &parameters, 0.04, &samples, &members, &mut gradient);
                let forces = model.forces(path, &parameters, 0.04, &samples);
                let bits: Vec<u32> =
                    gradient.iter().chain(forces.as_flattened()).map(|x| x.to_bits()).collect();
                (path.name(), loss.to_bits(), bits)
            });
            let results: Vec<_> = results.collect();
            for other in &results[1..] {
                assert_eq!(results[0].1, other.1, "{} {count} {}", model.name(), other.0);
                assert_eq!(results[0].2, other.2, "{} {count} {}", model.name(), other.0);
            }
        }
    }
}

/// What was trained is what flies.
#[test]
fn the_forward_pass_has_the_bits_of_the_flight_code() {
    let mut draw = Draw::new(12);
    let (samples, parameters) = (draw.samples::<f32>(100), draw.parameters::<f32>(Model::Parnn));
    let net = network::<f32, 2>(&parameters);
    let mut rows: Vec<_> = samples.iter().map(|sample| sample.rows).collect();
    for (k, x) in [f32::NAN, f32::INFINITY, f32::MAX, -1e-40, -0.0].into_iter().enumerate() {
        rows[11 * k][k] = [x, -x];
    }
    for path in Path::available() {
        let outputs = super::forward::<WINDOW, 2, _>(path, &net, &rows);
        for (output, rows) in outputs.iter().zip(&rows) {
            let alone = net.window(rows);
            assert_eq!(output.map(f32::to_bits), alone.map(f32::to_bits), "{}", path.name());
        }
    }
}

#[derive(serde::Deserialize)]
struct Golden {
    area_m2: f32,
    windows: Vec<GoldenWindow>,
    models: std::collections::BTreeMap<String, GoldenModel>,
}

#[derive(serde::Deserialize)]
struct GoldenWindow {
    rows: [[f32; INPUTS]; WINDOW],
    velocity_body_m_s: [f32; 3],
    q_ned_from_body_wxyz: [f32; 4],
    label_body_n: [f32; 3],
}

#[derive(serde::Deserialize)]
struct GoldenModel {
    parameters: Vec<f32>,
    forces_n: Vec<[f64; 3]>,
    loss_n2: f64,
    gradient: Vec<f64>,
}

fn close(ours: f64, theirs: f64, tolerance: f64, what: &str) {
    assert!(
        (ours - theirs).abs() < tolerance * theirs.abs().max(1.0),
        "{what}: {ours}, PyTorch {theirs}"
    );
}

#[test]
fn forces_and_gradients_are_those_of_pytorch() {
    let golden: Golden =
        serde_json::from_str(include_str!("../../tests/golden/models.json")).unwrap();
    assert_eq!(golden.models.len(), NETWORKS.len());
    let windows = golden.windows.iter().map(|w| Window {
        rows: w.rows,
        velocity_body_m_s: w.velocity_body_m_s,
        q_ned_from_body_wxyz: w.q_ned_from_body_wxyz,
        label_body_n: w.label_body_n,
        truth_body_n: None,
    });
    let windows: Vec<Window> = windows.collect();
    for (name, torch) in &golden.models {
        let model = Model::find(name).unwrap();
        let samples: Vec<Sample<f32>> = windows.iter().map(|w| model.sample(w)).collect();
        let mut gradient = vec![0.0; torch.gradient.len()];
        assert_eq!(gradient.len(), model.parameters());
        for path in Path::available() {
            let parameters = &torch.parameters;
            let members = all(samples.len());
            let loss =
                model.gradient(path, parameters, golden.area_m2, &samples, &members, &mut gradient);
            let forces = model.forces(path, parameters, golden.area_m2, &samples);
            close(loss, torch.loss_n2, 1e-5, name);
            for (ours, theirs) in forces.as_flattened().iter().zip(torch.forces_n.as_flattened()) {
                close(f64::from(*ours), *theirs, 1e-5, name);
            }
            for (ours, theirs) in gradient.iter().zip(&torch.gradient) {
                close(f64::from(*ours), *theirs, 1e-5, name);
            }
        }
        // In f64 nothing is left but rounding: also of the attitude, which is held in f32.
        let double: Vec<f64> = torch.parameters.iter().map(|p| f64::from(*p)).collect();
        let samples: Vec<Sample<f64>> = samples
            .iter()
            .zip(&windows)
            .map(|(s, w)| Sample {
                rows: s.rows.map(|row| row.map(f64::from)),
                flow: Flow::new(In::new(Vector3::from(w.velocity_body_m_s.map(f64::from)))),
                target: s.target.map(f64::from),
            })
            .collect();
        let area = f64::from(golden.area_m2);
        let forces = model.forces(Path::best(), &double, area, &samples);
        for (ours, theirs) in forces.as_flattened().iter().zip(torch.forces_n.as_flattened()) {
            close(*ours, *theirs, 1e-12, name);
        }
    }
}
