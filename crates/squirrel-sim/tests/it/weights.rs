//! Weights come from their file with their bits, and what is wrong with them is said in one line
//! that names it.

use super::weights_support::{Parts, changed, folder, put, set_domain, shipped, text_with};
use safetensors::Dtype;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{Integrator, Setup};
use squirrel_sim::plant::WingPlant;
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::{SQUIRREL_TOML, VehicleFile};
use squirrel_sim::weights::ParnnWeights;
use std::fs;

/// What loading a vehicle with these weights says, behind the names of both files.
fn said(name: &str, weights: &[u8]) -> String {
    let folder = folder(name);
    let error = VehicleFile::load(&put(&folder, "membrane", weights)).unwrap_err().to_string();
    assert!(!error.contains('\n'), "{error}");
    let (file, weights) = (folder.join("vehicle.toml"), folder.join("own.safetensors"));
    let before = format!(
        "{}: wing.parnn_weights = own.safetensors: {}: ",
        file.display(),
        weights.display()
    );
    error.strip_prefix(&before).unwrap_or_else(|| panic!("{error}")).to_owned()
}

#[test]
fn weights_keep_their_bits_through_file_and_log() {
    let bytes = shipped();
    let weights = ParnnWeights::parse("shipped", bytes.clone()).unwrap();
    let numbers = weights.parnn().net.tensors().concat();
    assert_eq!(numbers.len(), 242);
    for number in &numbers {
        let le = number.to_le_bytes();
        assert!(bytes.windows(4).any(|w| w == le), "{number} is not in the file");
    }
    // A row of a matrix is an input: the file's second row of the first layer is what the angle of
    // attack does.
    let offset = bytes.len() - 4 * 242;
    let stored = |tensor: usize, i: usize| {
        let at = offset + tensor + 4 * i;
        f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
    };
    assert_eq!(weights.parnn().net.first.input[1][3], stored(288, 8 + 3));
    assert_eq!(weights.parnn().net.second.hidden[2][7], stored(456, 2 * 8 + 7));
    assert_eq!(ParnnWeights::from_hex("log", &weights.to_hex()).unwrap(), weights);
    assert_eq!(
        VehicleFile::squirrel().weights.unwrap(),
        weights,
        "the program has the shipped ones in it"
    );
}

#[test]
fn a_wrong_tensor_is_named() {
    let with = |change: fn(&mut Parts)| said("wrong_tensor", &changed(|parts, _| change(parts)));
    assert_eq!(with(|p| drop(p.remove("second.hidden"))), "tensor second.hidden: missing");
    let error = with(|p| p.get_mut("output.weight").unwrap().1 = vec![2, 8]);
    assert_eq!(error, "tensor output.weight: shape [2, 8], must be [8, 2]");
    let error = with(|p| {
        p.get_mut("first.input").unwrap().2[12..16].copy_from_slice(&f32::NAN.to_le_bytes());
    });
    assert_eq!(error, "tensor first.input[3] = NaN: must be finite");
    let error = with(|p| drop(p.insert("third.bias".to_owned(), p["first.bias"].clone())));
    assert_eq!(error, "tensor third.bias: unknown to this model");
    let error = with(|p| *p.get_mut("output.bias").unwrap() = (Dtype::F64, vec![2], vec![0; 16]));
    assert_eq!(error, "tensor output.bias: numbers of type F64, must be F32");
}

#[test]
fn another_model_or_another_meaning_is_named() {
    let with = |from: &str, to: &str| {
        let weights = changed(|_, text| {
            assert!(text.contains(from), "{from} is not in {text}");
            *text = text.replacen(from, to, 1);
        });
        said("wrong_card", &weights)
    };
    let error = with("\"parnn\"", "\"vanilla_body\"");
    assert_eq!(error, "model = vanilla_body: of all models only \"parnn\" flies");
    assert!(with("\"parnn\"", "\"parnn_window_1\"").starts_with("model = parnn_window_1: "));
    assert_eq!(with("\"format\":1", "\"format\":2"), "format = 2: this version reads 1");
    let error = with("\"speed_scale_m_s\":10.0", "\"speed_scale_m_s\":1.0");
    assert_eq!(error, "normalisation.speed_scale_m_s = 1: the flight code divides by 10");
    assert_eq!(with("\"area_m2\":0.04", "\"area_m2\":0.0"), "area_m2 = 0: must be positive");
    let backwards = changed(|_, text| set_domain(text, [8.0, 2.0], [-1.0, 1.0]));
    assert!(
        said("backwards", &backwards)
            .starts_with("domain.speed_m_s = 2: must be two finite numbers")
    );
    let truncated = &shipped()[..1500];
    assert!(said("truncated", truncated).starts_with("not a whole safetensors file: "));
    assert!(said("empty", &[]).starts_with("not a whole safetensors file: "));
}

#[test]
fn weights_of_another_wing_are_refused_and_those_of_a_sister_are_not() {
    let with = |area: &str| {
        let weights = changed(|_, text| {
            *text = text.replacen("\"area_m2\":0.04", &format!("\"area_m2\":{area}"), 1);
        });
        VehicleFile::load(&put(&folder("area"), "membrane", &weights)).map_err(|e| e.to_string())
    };
    let error = with("0.05").unwrap_err();
    assert!(error.contains("own.safetensors: area_m2 = 0.05: trained on another wing"), "{error}");
    assert!(error.ends_with("wing.area_per_side_m2 makes 0.04"), "{error}");
    assert!(with("0.041").is_ok());
}

#[test]
fn a_missing_file_is_named_and_the_shipped_weights_need_none() {
    let folder = folder("missing");
    let file = put(&folder, "membrane", &[]);
    fs::remove_file(folder.join("own.safetensors")).unwrap();
    let error = VehicleFile::load(&file).unwrap_err().to_string();
    let path = folder.join("own.safetensors");
    assert!(
        error.contains(&format!("own.safetensors: {}: No such file", path.display())),
        "{error}"
    );
    // A copy of the shipped vehicle anywhere finds its weights; a damaged file beside it is not
    // passed over.
    fs::write(&file, SQUIRREL_TOML).unwrap();
    assert!(VehicleFile::load(&file).unwrap().weights.is_some());
    fs::write(folder.join("squirrel-parnn.safetensors"), b"no").unwrap();
    assert!(
        VehicleFile::load(&file).unwrap_err().to_string().contains("not a whole safetensors file")
    );
}

#[test]
fn an_arm_or_a_wing_without_its_weights_says_so() {
    let without = |text: String| {
        let line = text.lines().find(|line| line.starts_with("parnn_weights")).unwrap().to_owned();
        VehicleFile::parse(&text.replace(&line, ""), "file").map_err(|e| e.to_string())
    };
    let vehicle = without(SQUIRREL_TOML.to_owned()).unwrap();
    let scenario = Scenario::find("avoid").unwrap();
    let setup = Setup { vehicle, arm: Arm::TwccParnn, scenario, integrator: Integrator::Rk4 };
    let error = setup.stack().unwrap_err().to_string();
    assert_eq!(
        error,
        "squirrel: arm = twcc_parnn: needs weights; wing.parnn_weights of the vehicle names none that were read"
    );
    let error = without(text_with("parnn")).unwrap_err();
    assert_eq!(error, "file: wing.parnn_weights: missing; wing.model = \"parnn\" needs it");
    let error = VehicleFile::parse(&text_with("parnn"), "file").unwrap_err().to_string();
    assert!(
        error.starts_with("file: wing.parnn_weights = own.safetensors: not at hand"),
        "{error}"
    );
    let (head, wing) = SQUIRREL_TOML.split_once("[wing]").unwrap();
    let (_, tail) = wing.split_once("[battery]").unwrap();
    let wingless = format!("{head}[wing]\nparnn_weights = \"a\"\n[battery]{tail}");
    let error = VehicleFile::parse(&wingless, "file").unwrap_err().to_string();
    assert_eq!(error, "file: wing.parnn_weights = a: given, but wing.model names no wing");
    let paper = SQUIRREL_TOML.replace("model = \"membrane\"", "model = \"parnn\"");
    let paper = VehicleFile::parse(&paper, "file").unwrap();
    assert!(matches!(paper.wing, WingPlant::Parnn { .. }), "{:?}", paper.wing);
}
