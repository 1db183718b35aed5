//! The shipped weights with something changed, and vehicles that name them.

#![allow(dead_code, reason = "not every test uses all of it")]

use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensors};
use squirrel_sim::vehicle_file::{SQUIRREL_TOML, VehicleFile};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Tensors on their way into a changed file.
pub(crate) type Parts = BTreeMap<String, (Dtype, Vec<usize>, Vec<u8>)>;

/// The bytes of the shipped weights.
pub(crate) fn shipped() -> Vec<u8> {
    fs::read(format!("{}/../../vehicles/squirrel-parnn.safetensors", env!("CARGO_MANIFEST_DIR")))
        .unwrap()
}

/// The shipped weights with something changed.
pub(crate) fn changed(change: impl FnOnce(&mut Parts, &mut String)) -> Vec<u8> {
    rewritten(&shipped(), change)
}

/// Weights written again after a change of tensors and of the metadata.
pub(crate) fn rewritten(bytes: &[u8], change: impl FnOnce(&mut Parts, &mut String)) -> Vec<u8> {
    let file = SafeTensors::deserialize(bytes).unwrap();
    let mut parts: Parts = file
        .tensors()
        .into_iter()
        .map(|(name, view)| (name, (view.dtype(), view.shape().to_vec(), view.data().to_vec())))
        .collect();
    let (_, header) = SafeTensors::read_metadata(bytes).unwrap();
    let mut text = header.metadata().as_ref().unwrap()["squirrel"].clone();
    change(&mut parts, &mut text);
    let views = parts.iter().map(|(name, (dtype, shape, data))| {
        (name.as_str(), TensorView::new(*dtype, shape.clone(), data).unwrap())
    });
    let metadata = [("squirrel".to_owned(), text)].into_iter().collect();
    safetensors::serialize(views, Some(metadata)).unwrap()
}

/// Puts other ranges into the metadata.
pub(crate) fn set_domain(text: &mut String, speed_m_s: [f32; 2], alpha_rad: [f32; 2]) {
    let from = text.find("{\"speed_m_s\"").unwrap();
    let until = from + text[from..].find('}').unwrap() + 1;
    let domain = format!("{{\"speed_m_s\":{speed_m_s:?},\"alpha_rad\":{alpha_rad:?}}}");
    text.replace_range(from..until, &domain);
}

/// Weights that say nothing, `alpha_w = 0` and `gamma = 1`, about any flow.
pub(crate) fn silent() -> Vec<u8> {
    changed(|parts, text| {
        for (_, _, data) in parts.values_mut() {
            data.fill(0);
        }
        let bias = &mut parts.get_mut("output.bias").unwrap().2;
        bias[4..8].copy_from_slice(&0.541_324_85_f32.to_le_bytes());
        set_domain(text, [0.0, 100.0], [-2.0, 2.0]);
    })
}

/// An empty folder for one test.
pub(crate) fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// The text of the shipped vehicle, which names `own.safetensors`, with another model of the wing.
pub(crate) fn text_with(model: &str) -> String {
    let text = SQUIRREL_TOML.replace("\"squirrel-parnn.safetensors\"", "\"own.safetensors\"");
    assert_ne!(text, SQUIRREL_TOML);
    text.replace("model = \"membrane\"", &format!("model = \"{model}\""))
}

/// A vehicle file and its weights in a folder.
pub(crate) fn put(folder: &Path, model: &str, weights: &[u8]) -> PathBuf {
    fs::write(folder.join("own.safetensors"), weights).unwrap();
    let file = folder.join("vehicle.toml");
    fs::write(&file, text_with(model)).unwrap();
    file
}

/// The shipped vehicle with these weights and this model of the wing.
pub(crate) fn vehicle(name: &str, model: &str, weights: &[u8]) -> VehicleFile {
    VehicleFile::load(&put(&folder(name), model, weights)).unwrap()
}
