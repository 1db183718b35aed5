//! Weights survive the file bit for bit, and what is wrong with a file is said in one line that
//! names it.

use super::support::{AREA_M2, cambered, flight, folder, sets};
use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensors};
use squirrel_nn::model::Model;
use squirrel_nn::train::{Settings, Trainer};
use squirrel_nn::trained::Trained;
use squirrel_nn::windows::Windows;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

fn trained(model: Model) -> Trained {
    let (training, validation) = sets();
    let settings = Settings { epochs: 2, seed: u64::MAX, ..Settings::default() };
    let mut trainer =
        Trainer::new(model, "squirrel", AREA_M2, &training, &validation, settings).unwrap();
    while trainer.epoch().unwrap().is_some() {}
    let mut trained = trainer.best();
    trained.card.figures.insert("validation_rms_n".to_owned(), 0.1 + 0.2);
    trained.card.figures.insert("training_rms_n".to_owned(), 1.0 / 3.0);
    trained
}

/// A tensor on its way into a damaged file.
type Parts = BTreeMap<String, (Dtype, Vec<usize>, Vec<u8>)>;

/// Writes `good` again with something changed; returns what reading it says.
fn said(good: &Path, change: impl FnOnce(&mut Parts, &mut Option<String>)) -> String {
    let bytes = fs::read(good).unwrap();
    let file = SafeTensors::deserialize(&bytes).unwrap();
    let mut parts: Parts = file
        .tensors()
        .into_iter()
        .map(|(name, view)| (name, (view.dtype(), view.shape().to_vec(), view.data().to_vec())))
        .collect();
    let (_, header) = SafeTensors::read_metadata(&bytes).unwrap();
    let mut text = header.metadata().as_ref().map(|records| records["squirrel"].clone());
    change(&mut parts, &mut text);
    let views = parts.iter().map(|(name, (dtype, shape, data))| {
        (name.as_str(), TensorView::new(*dtype, shape.clone(), data).unwrap())
    });
    let metadata = text.map(|text| [("squirrel".to_owned(), text)].into_iter().collect());
    let bad = good.with_file_name("bad.safetensors");
    fs::write(&bad, safetensors::serialize(views, metadata).unwrap()).unwrap();
    let error = Trained::load(&bad).unwrap_err().to_string();
    assert!(!error.contains('\n'), "{error}");
    error.replace(&format!("{}: ", bad.display()), "")
}

#[test]
fn every_model_survives_its_file() {
    let folder = folder("round_trip");
    let (_, held_out) = sets();
    for model in Model::ALL {
        let (model, file) = (trained(model), folder.join(format!("{}.safetensors", model.name())));
        model.save(&file).unwrap();
        let loaded = Trained::load(&file).unwrap();
        assert_eq!(loaded, model);
        assert_eq!(loaded.forces_body_n(held_out.all()), model.forces_body_n(held_out.all()));
        let first = fs::read(&file).unwrap();
        loaded.save(&file).unwrap();
        assert_eq!(fs::read(&file).unwrap(), first, "the same bytes");
        assert_eq!(loaded.parnn(), model.parnn());
    }
    let names: Vec<_> = fs::read_dir(&folder).unwrap().map(|f| f.unwrap().file_name()).collect();
    assert_eq!(names.len(), Model::ALL.len(), "nothing half-written stays: {names:?}");
}

#[test]
fn parameters_from_elsewhere_take_the_place_of_our_own() {
    let own = trained(Model::Parnn);
    let mut parameters = own.parameters().to_vec();
    assert_eq!(own.with_parameters(parameters.clone()).unwrap(), own);
    parameters[3] = f32::NAN;
    let error = own.with_parameters(parameters.clone()).unwrap_err().to_string();
    assert!(error.contains("parameters = NaN: must be finite"), "{error}");
    parameters.pop();
    let error = own.with_parameters(parameters).unwrap_err().to_string();
    assert!(error.ends_with("numbers: must be as many as the model has"), "{error}");
}

#[test]
fn the_card_says_where_weights_come_from() {
    let (training, _) = sets();
    let card = trained(Model::Parnn).card;
    assert_eq!(
        (card.model, card.vehicle.as_str(), card.seed),
        (Model::Parnn, "squirrel", u64::MAX)
    );
    assert_eq!(card.data_hash, format!("{:016x}", training.hash()));
    assert!(card.domain.speed_m_s[1] > 7.0 && card.domain.speed_m_s[1] < 9.0, "{:?}", card.domain);
    assert!(card.domain.alpha_rad[0] < -0.3 && card.domain.alpha_rad[1] > 0.3, "{:?}", card.domain);
}

#[test]
fn wrong_tensors_are_named() {
    let good = folder("wrong_tensors").join("good.safetensors");
    trained(Model::Parnn).save(&good).unwrap();
    let error = said(&good, |parts, _| drop(parts.remove("second.hidden")));
    assert_eq!(error, "tensor second.hidden: missing");
    let error = said(&good, |parts, _| parts.get_mut("output.weight").unwrap().1 = vec![2, 8]);
    assert_eq!(error, "tensor output.weight: shape [2, 8], must be [8, 2]");
    let error = said(&good, |parts, _| {
        parts.get_mut("first.input").unwrap().2[12..16].copy_from_slice(&f32::NAN.to_le_bytes());
    });
    assert_eq!(error, "tensor first.input[3] = NaN: must be finite");
    let error = said(&good, |parts, _| {
        let extra = parts["first.bias"].clone();
        parts.insert("third.bias".to_owned(), extra);
    });
    assert_eq!(error, "tensor third.bias: unknown to this model");
    let error = said(&good, |parts, _| {
        *parts.get_mut("output.bias").unwrap() = (Dtype::F64, vec![2], vec![0; 16]);
    });
    assert_eq!(error, "tensor output.bias: numbers of type F64, must be F32");
}

#[test]
fn a_wrong_card_is_named() {
    let good = folder("wrong_card").join("good.safetensors");
    trained(Model::Parnn).save(&good).unwrap();
    let with = |from: &str, to: &str| {
        said(&good, |_, text| {
            let changed = text.as_ref().unwrap().replacen(from, to, 1);
            assert_ne!(Some(&changed), text.as_ref(), "{from} is not in the card");
            *text = Some(changed);
        })
    };
    assert_eq!(said(&good, |_, text| *text = None), "metadata squirrel: missing");
    assert!(with("\"seed\"", "\"sead\"").starts_with("metadata squirrel: unknown field `sead`"));
    assert!(
        with("\"parnn\"", "\"lstm\"")
            .starts_with("metadata squirrel: model = lstm: must be one of")
    );
    assert_eq!(with("\"format\":1", "\"format\":2"), "format = 2: this version reads 1");
    assert_eq!(with("\"area_m2\":0.04", "\"area_m2\":-0.04"), "area_m2 = -0.04: must be positive");
    let error = with("\"speed_scale_m_s\":10.0", "\"speed_scale_m_s\":12.0");
    assert_eq!(error, "normalisation.speed_scale_m_s = 12: the flight code divides by 10");
    assert_eq!(
        with("\"rows\":10", "\"rows\":5"),
        "normalisation.rows = 5: the flight code keeps 10"
    );
    // Another model's weights under this card.
    assert_eq!(
        with("\"parnn\"", "\"vanilla\""),
        "tensor output.weight: shape [8, 2], must be [8, 3]"
    );
}

#[test]
fn damaged_files_are_refused_without_panic() {
    let folder = folder("damaged");
    let (good, bad) = (folder.join("good.safetensors"), folder.join("bad.safetensors"));
    trained(Model::VanillaPlane).save(&good).unwrap();
    let bytes = fs::read(&good).unwrap();
    for length in (0..bytes.len()).step_by(7) {
        fs::write(&bad, &bytes[..length]).unwrap();
        let error = Trained::load(&bad).unwrap_err().to_string();
        assert!(
            error.contains("bad.safetensors: not a whole safetensors file: "),
            "{length}: {error}"
        );
    }
    fs::write(&bad, [0xff; 64]).unwrap();
    assert!(Trained::load(&bad).is_err());
    let error = Trained::load(&folder.join("none.safetensors")).unwrap_err().to_string();
    assert!(error.contains("none.safetensors: No such file"), "{error}");
}

#[test]
fn nothing_is_written_where_it_cannot_be_whole() {
    let folder = folder("unwritable");
    let mut model = trained(Model::Parnn);
    let file = folder.join("missing/weights.safetensors");
    let error = model.save(&file).unwrap_err().to_string();
    assert!(error.contains("missing/weights.safetensors: No such file"), "{error}");
    // A folder stands where the file should.
    let file = folder.join("taken");
    fs::create_dir_all(file.join("inside")).unwrap();
    assert!(model.save(&file).is_err());
    model.card.figures.insert("test_rms_n".to_owned(), f64::NAN);
    let error = model.save(&folder.join("nan.safetensors")).unwrap_err().to_string();
    assert!(error.ends_with("figures = test_rms_n: NaN: must be finite"), "{error}");
    let left: Vec<_> = fs::read_dir(&folder).unwrap().map(|f| f.unwrap().file_name()).collect();
    assert_eq!(left, ["taken"]);
}

#[test]
fn a_checkpoint_is_no_weights_file_and_the_other_way_round() {
    let folder = folder("checkpoint");
    let (training, validation) = sets();
    let (weights, checkpoint) = (folder.join("w.safetensors"), folder.join("c.safetensors"));
    trained(Model::Parnn).save(&weights).unwrap();
    let settings = Settings { epochs: 2, ..Settings::default() };
    let mut trainer =
        Trainer::new(Model::Parnn, "squirrel", AREA_M2, &training, &validation, settings).unwrap();
    trainer.save(&checkpoint).unwrap();
    trainer.epoch().unwrap();
    assert!(Trained::load(&checkpoint).unwrap_err().to_string().contains("metadata squirrel: "));
    let error = Trainer::resume(&weights, &training, &validation).unwrap_err().to_string();
    assert!(error.contains("w.safetensors: metadata squirrel: "), "{error}");
    let bytes = fs::read(&checkpoint).unwrap();
    let (from, to) = (br#"\"batch\":256"#, br#"\"batch\":  0"#);
    let at = bytes.windows(from.len()).position(|w| w == from).unwrap();
    let changed = [&bytes[..at], to, &bytes[at + from.len()..]].concat();
    fs::write(&weights, changed).unwrap();
    let error = Trainer::resume(&weights, &training, &validation).unwrap_err().to_string();
    assert!(error.ends_with("w.safetensors: batch = 0: must be at least 1"), "{error}");
    // One from before the first epoch goes on as well.
    let mut resumed = Trainer::resume(&checkpoint, &training, &validation).unwrap();
    resumed.epoch().unwrap();
    assert_eq!(resumed.best(), trainer.best());
}

#[test]
fn bad_windows_are_refused_by_flight_place_and_field() {
    let good = flight(0.0, 20, cambered);
    let says = |change: &dyn Fn(&mut squirrel_nn::windows::Window)| {
        let mut windows = good.clone();
        change(&mut windows[13]);
        Windows::new().push("f7", &windows).unwrap_err().to_string()
    };
    let error = says(&|w| w.velocity_body_m_s[2] = f32::INFINITY);
    assert!(
        error.starts_with("f7: window 13: velocity_body_m_s = [")
            && error.ends_with("must be finite")
    );
    assert!(says(&|w| w.rows[4][1] = f32::NAN).starts_with("f7: window 13: rows = ["));
    assert!(
        says(&|w| w.label_body_n[0] = f32::NAN).starts_with("f7: window 13: label_body_n = [NaN")
    );
    assert!(says(&|w| w.truth_body_n = Some([f32::NAN; 3])).contains("truth_body_n = [NaN"));
    let error = says(&|w| w.q_ned_from_body_wxyz = [0.0; 4]);
    assert_eq!(
        error,
        "f7: window 13: q_ned_from_body_wxyz = [0.0, 0.0, 0.0, 0.0]: must have norm 1"
    );

    let mut windows = Windows::new();
    windows.push("a", &good).unwrap();
    assert_eq!(windows.push("a", &good).unwrap_err().to_string(), "a: two flights have this name");
    assert_eq!(windows.split(&["b"]).unwrap_err().to_string(), "b: no flight has this name");
    let (kept, out) = windows.split(&["a"]).unwrap();
    assert_eq!((kept.all().len(), out.all().len()), (0, 20));
    let hash = windows.hash();
    let mut other = good.clone();
    other[3].rows[2][0] += 1e-6;
    let mut changed = Windows::new();
    changed.push("a", &other).unwrap();
    assert_ne!(changed.hash(), hash);
    assert_eq!(out.hash(), hash);
}
