//! Training finds what is there, stops when it should, and gives the same bits however it is run.

use super::support::{AREA_M2, cambered, flight, folder, sets};
use squirrel_core::frames::In;
use squirrel_core::nalgebra::Vector3;
use squirrel_core::rnn::head::Correction;
use squirrel_nn::NnError;
use squirrel_nn::kernel::simd::Path;
use squirrel_nn::model::Model;
use squirrel_nn::train::{Settings, Trainer};
use squirrel_nn::trained::{ForceError, Trained};
use squirrel_nn::windows::Windows;

const SHORT: Settings =
    Settings { epochs: 6, batch: 50, rate: 3e-3, clip: 5.0, patience: 100, seed: 3 };

fn train(model: Model, settings: Settings) -> Trained {
    let (training, validation) = sets();
    let mut trainer =
        Trainer::new(model, "test", AREA_M2, &training, &validation, settings).unwrap();
    while trainer.epoch().unwrap().is_some() {}
    trainer.best()
}

fn error_n(trained: &Trained, windows: &Windows) -> f64 {
    let labels: Vec<[f32; 3]> = windows.all().iter().map(|w| w.label_body_n).collect();
    ForceError::of(&trained.forces_body_n(windows.all()), &labels).rms_n
}

#[test]
fn networks_learn_a_wing_that_the_flat_plate_misses() {
    let (_, held_out) = sets();
    let settings = Settings { epochs: 150, ..SHORT };
    let plate = error_n(&train(Model::FlatPlate, settings), &held_out);
    let scaled = error_n(&train(Model::ScaledFlatPlate, settings), &held_out);
    assert!(scaled < 0.9 * plate, "one number must help: {scaled} N, plate {plate} N");
    for model in [Model::Parnn, Model::ParnnWindow1, Model::VanillaPlane] {
        let learned = error_n(&train(model, settings), &held_out);
        assert!(learned < 0.25 * scaled, "{}: {learned} N, scaled plate {scaled} N", model.name());
    }
}

/// The vehicle turns in yaw, and the network sees speed and angle of attack only.
#[test]
fn a_network_without_direction_cannot_learn_a_force_in_ned() {
    let (_, held_out) = sets();
    let settings = Settings { epochs: 60, ..SHORT };
    let ned = error_n(&train(Model::VanillaNed, settings), &held_out);
    let plane = error_n(&train(Model::VanillaPlane, settings), &held_out);
    assert!(ned > 2.0 * plane, "{ned} N, in the plane of the flow {plane} N");
}

#[test]
fn one_number_is_found_exactly() {
    let mut windows = Windows::new();
    let scaled = |_: f32| Correction { alpha_w_rad: 0.0, gamma: 1.37 };
    windows.push("a", &flight(0.0, 200, scaled)).unwrap();
    let trainer =
        Trainer::new(Model::ScaledFlatPlate, "test", AREA_M2, &windows, &Windows::new(), SHORT)
            .unwrap();
    assert!(trainer.is_done());
    let best = trainer.best();
    let [scale] = best.parameters() else { panic!("one parameter") };
    assert!((scale - 1.37).abs() < 1e-6, "{scale}");
}

#[test]
fn every_path_trains_the_same_weights() {
    let (training, validation) = sets();
    for model in [Model::Parnn, Model::VanillaBody] {
        let weights = Path::available().into_iter().map(|path| {
            let trainer =
                Trainer::new(model, "test", AREA_M2, &training, &validation, SHORT).unwrap();
            let mut trainer = trainer.on(path);
            while trainer.epoch().unwrap().is_some() {}
            (trainer.best().parameters().to_vec(), trainer.history().to_vec())
        });
        let weights: Vec<_> = weights.collect();
        for other in &weights[1..] {
            assert_eq!(*other, weights[0], "{}", model.name());
        }
    }
}

#[test]
fn a_resumed_training_ends_at_the_same_bits() {
    let (training, validation) = sets();
    let file = folder("resume").join("half.safetensors");
    let mut trainer =
        Trainer::new(Model::Parnn, "test", AREA_M2, &training, &validation, SHORT).unwrap();
    for epoch in 0.. {
        if epoch == 3 {
            trainer.save(&file).unwrap();
        }
        if trainer.epoch().unwrap().is_none() {
            break;
        }
    }
    let mut resumed = Trainer::resume(&file, &training, &validation).unwrap();
    assert_eq!(resumed.history(), &trainer.history()[..3]);
    while resumed.epoch().unwrap().is_some() {}
    assert_eq!(resumed.history(), trainer.history());
    assert_eq!(resumed.best(), trainer.best());
    assert_eq!(resumed.history().len(), SHORT.epochs);

    let error = Trainer::resume(&file, &validation, &validation).unwrap_err().to_string();
    assert!(
        error.contains("half.safetensors: data_hash = ") && error.contains("at hand"),
        "{error}"
    );
    let error = Trainer::resume(&file, &training, &training).unwrap_err().to_string();
    assert!(error.contains("half.safetensors: validation_hash = "), "{error}");
}

#[test]
fn another_seed_gives_other_weights() {
    let a = train(Model::Parnn, SHORT);
    assert_eq!(a, train(Model::Parnn, SHORT));
    assert_ne!(a.parameters(), train(Model::Parnn, Settings { seed: 4, ..SHORT }).parameters());
}

/// What is validated has its force turned round, so that all learning makes it worse.
#[test]
fn training_stops_where_the_validation_gets_no_better() {
    let (training, _) = sets();
    let mut turned = flight(9.0, 100, cambered);
    for window in &mut turned {
        window.label_body_n = window.label_body_n.map(|f| -f);
    }
    let mut validation = Windows::new();
    validation.push("turned", &turned).unwrap();
    let settings = Settings { epochs: 50, patience: 4, ..SHORT };
    let mut trainer =
        Trainer::new(Model::VanillaPlane, "test", AREA_M2, &training, &validation, settings)
            .unwrap();
    while trainer.epoch().unwrap().is_some() {}
    let errors: Vec<f64> = trainer.history().iter().map(|e| e.validation.unwrap()).collect();
    let best = errors.iter().copied().fold(f64::INFINITY, f64::min);
    let at = errors.iter().position(|e| *e == best).unwrap();
    assert_eq!(errors.len(), at + 1 + settings.patience, "{errors:?}");
    let kept = error_n(&trainer.best(), &validation).powi(2);
    assert!((kept - best).abs() < 1e-9 * best, "{kept} {best}");
}

#[test]
fn a_trained_parnn_flies_with_the_same_bits() {
    let (_, held_out) = sets();
    for model in [Model::Parnn, Model::ParnnWindow1] {
        let trained = train(model, SHORT);
        let flies = trained.parnn().unwrap();
        let forces = trained.forces_body_n(held_out.all());
        for (force, window) in forces.iter().zip(held_out.all()) {
            let rows = &window.rows[window.rows.len() - model.window()..];
            let estimate = flies.estimate(rows, In::new(Vector3::from(window.velocity_body_m_s)));
            assert_eq!(
                <[f32; 3]>::from(estimate.force.vector).map(f32::to_bits),
                force.map(f32::to_bits)
            );
        }
    }
    assert_eq!(train(Model::VanillaBody, SHORT).parnn(), None);
}

#[test]
fn what_cannot_be_trained_is_one_line() {
    let (training, validation) = sets();
    let fails = |settings: Settings, area_m2: f32, training: &Windows| {
        let mut trainer = match Trainer::new(
            Model::VanillaBody,
            "test",
            area_m2,
            training,
            &validation,
            settings,
        ) {
            Ok(trainer) => trainer,
            Err(error) => return error.to_string(),
        };
        loop {
            match trainer.epoch() {
                Ok(Some(_)) => {}
                Ok(None) => panic!("trained"),
                Err(error) => return error.to_string(),
            }
        }
    };
    let none = Windows::new();
    let cases = [
        (SHORT, AREA_M2, &none, "training: has no windows, at least one is needed"),
        (Settings { batch: 0, ..SHORT }, AREA_M2, &training, "batch = 0: must be at least 1"),
        (Settings { epochs: 0, ..SHORT }, AREA_M2, &training, "epochs = 0: must be 1 to 100000"),
        (
            Settings { epochs: 100_001, ..SHORT },
            AREA_M2,
            &training,
            "epochs = 100001: must be 1 to 100000",
        ),
        (Settings { rate: f64::NAN, ..SHORT }, AREA_M2, &training, "rate = NaN: must be positive"),
        (Settings { clip: -1.0, ..SHORT }, AREA_M2, &training, "clip = -1: must be positive"),
        (SHORT, f32::INFINITY, &training, "area_m2 = inf: must be positive"),
    ];
    for (settings, area, windows, expected) in cases {
        assert_eq!(fails(settings, area, windows), expected);
    }
    let diverged = fails(Settings { rate: 1e30, ..SHORT }, AREA_M2, &training);
    assert!(
        diverged.starts_with("vanilla_body: loss = ") && diverged.contains("in epoch 1"),
        "{diverged}"
    );
    let unknown = "lstm".parse::<Model>().unwrap_err();
    assert!(matches!(unknown, NnError::Setting { field: "model", .. }), "{unknown}");
    for model in Model::ALL {
        assert_eq!(model.name().parse::<Model>().unwrap(), model);
    }
}
