//! What was trained is what flies: the same bits from training's registers, the flight code and the
//! simulator's wing.

use super::support::{AREA_M2, cambered, flight, folder, sets};
use squirrel_core::dynamics::State;
use squirrel_core::frames::In;
use squirrel_core::nalgebra::Vector3;
use squirrel_nn::model::Model;
use squirrel_nn::train::{Settings, Trainer};
use squirrel_nn::trained::Trained;
use squirrel_sim::plant::{ParnnWing, Plant, ServoParameters, WingPlant};
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_sim::weights::ParnnWeights;
use std::path::Path;

/// Force by everyone, window by window.
fn compare(file: &Path) {
    let windows = flight(17.0, 200, cambered);
    let trained = Trained::load(file).unwrap();
    let by_training = trained.forces_body_n(&windows);
    let weights = ParnnWeights::load(file).unwrap();
    let flies = weights.parnn();
    assert_eq!(trained.parnn().as_ref(), Some(flies));

    let vehicle = VehicleFile::squirrel();
    let wing = ParnnWing { parnn: *flies, lateral_arm_m: 0.09 };
    let servo =
        ServoParameters { dead_time_s: 0.0, rate_max_per_s: f64::INFINITY, time_constant_s: 0.03 };
    let wing = WingPlant::Parnn { parnn: Box::new(wing), servo };
    let plant = Plant::new(vehicle.vehicle, vehicle.effects, wing, None, 1e-3).unwrap();
    let mut state = plant.initial_state(State::at_rest(), 1.0);
    let mut compared = 0;
    for (k, (window, trained)) in windows.iter().zip(&by_training).enumerate() {
        let velocity = Vector3::from(window.velocity_body_m_s);
        let flown = flies.estimate(&window.rows, In::new(velocity)).force.vector;
        assert_eq!(<[f32; 3]>::from(flown), *trained, "window {k}: flight code and training");
        // Level, so that the body's axes are those of the ground.
        let motion = State { velocity: In::new(velocity.map(f64::from)), ..State::at_rest() };
        plant.lead(&mut state, &motion, &[0.0; 8], [1.0; 2], 14.8, 0.1);
        if k >= 9 {
            let wing = plant.wing_force(&state, In::zero(), [1.0; 2]).vector;
            assert_eq!(wing, flown.map(f64::from), "window {k}: plant and flight code");
            compared += 1;
        }
    }
    assert!(compared > 150);
}

#[test]
fn weights_have_the_same_bits_in_training_in_flight_and_in_the_plant() {
    compare(
        &Path::new(env!("CARGO_MANIFEST_DIR")).join("../../vehicles/squirrel-parnn.safetensors"),
    );
    let (training, validation) = sets();
    let settings = Settings { epochs: 3, seed: 9, ..Settings::default() };
    let mut trainer =
        Trainer::new(Model::Parnn, "squirrel", AREA_M2, &training, &validation, settings).unwrap();
    while trainer.epoch().unwrap().is_some() {}
    let file = folder("flight").join("own.safetensors");
    trainer.best().save(&file).unwrap();
    compare(&file);
}

#[test]
fn models_that_do_not_fly_are_refused_by_the_simulator() {
    let folder = folder("no_flight");
    let (training, validation) = sets();
    for model in Model::ALL {
        let settings = Settings { epochs: 1, ..Settings::default() };
        let mut trainer =
            Trainer::new(model, "squirrel", AREA_M2, &training, &validation, settings).unwrap();
        trainer.epoch().unwrap();
        let file = folder.join(model.name());
        trainer.best().save(&file).unwrap();
        match (model, ParnnWeights::load(&file)) {
            (Model::Parnn, flies) => assert!(flies.is_ok(), "{flies:?}"),
            (_, refused) => {
                let expected =
                    format!("{}: model = {}: of all models", file.display(), model.name());
                let error = refused.unwrap_err().to_string();
                assert!(error.starts_with(&expected), "{error}");
            }
        }
    }
}
