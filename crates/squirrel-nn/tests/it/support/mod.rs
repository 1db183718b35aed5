//! Flights made up from a formula, so that it is known what there is to learn.

use squirrel_core::frames::In;
use squirrel_core::nalgebra::Vector3;
use squirrel_core::rnn::head::{Correction, Flow, force};
use squirrel_core::rnn::parnn::{History, features};
use squirrel_nn::windows::{Window, Windows};
use std::path::PathBuf;

pub(crate) const AREA_M2: f32 = 0.04;

/// A swinging flight at up to 8 m/s whose wing follows the corrected flat plate.
pub(crate) fn flight(
    phase: f32,
    count: usize,
    correction: impl Fn(f32) -> Correction<f32>,
) -> Vec<Window> {
    let (mut history, mut windows) = (History::new(), Vec::new());
    let mut k = 0;
    while windows.len() < count {
        let t = 0.1 * k as f32 + phase;
        let swing = |rate: f32, size: f32| size * (rate * t).sin();
        let velocity = [4.0 + swing(0.7, 3.5), swing(1.1, 2.0), swing(0.9, 2.5) + swing(2.3, 0.7)];
        let velocity = In::new(Vector3::from(velocity));
        let row = features(velocity);
        history.push(row);
        k += 1;
        let Some(rows) = history.window() else { continue };
        let half = 0.5 * t;
        windows.push(Window {
            rows: *rows,
            velocity_body_m_s: velocity.vector.into(),
            q_ned_from_body_wxyz: [half.cos(), 0.0, 0.0, half.sin()],
            label_body_n: force(&Flow::new(velocity), correction(row[1]), AREA_M2).vector.into(),
            truth_body_n: None,
        });
    }
    windows
}

/// A wing that feels a larger angle than there is, the more so the larger it is, and half as much
/// force again.
pub(crate) fn cambered(alpha_rad: f32) -> Correction<f32> {
    Correction { alpha_w_rad: 0.4 * alpha_rad, gamma: 1.5 - 0.3 * alpha_rad.abs() }
}

/// Two flights of the cambered wing to learn from, one to judge by.
pub(crate) fn sets() -> (Windows, Windows) {
    let mut all = Windows::new();
    for (name, phase, count) in [("a", 0.0, 300), ("b", 50.0, 277), ("held out", 123.0, 150)] {
        all.push(name, &flight(phase, count, cambered)).expect("sound");
    }
    all.split(&["held out"]).expect("there")
}

/// An empty folder for one test.
#[allow(dead_code, reason = "not every test writes files")]
pub(crate) fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("writable");
    folder
}
