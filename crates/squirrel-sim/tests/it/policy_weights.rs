//! A policy's file: its bits come back, and what is wrong with it is said in one line that names
//! it.

use super::weights_support::{Parts, folder, rewritten, shipped};
use safetensors::{Dtype, SafeTensors};
use squirrel_core::policy::Policy;
use squirrel_sim::weights::PolicyWeights;
use std::fs;

fn policy() -> Policy {
    let mut policy = Policy::filled(0.0);
    for (k, number) in policy.tensors_mut().into_iter().flatten().enumerate() {
        *number = (k as f32).sin();
    }
    policy
}

#[test]
fn a_policy_comes_back_with_its_bits() {
    let folder = folder("policy_round_trip");
    let (one, two) = (folder.join("one.safetensors"), folder.join("two.safetensors"));
    PolicyWeights::save(&policy(), &one).unwrap();
    let read = PolicyWeights::load(&one).unwrap();
    assert_eq!((read.policy, read.name.as_str()), (policy(), "one.safetensors"));
    PolicyWeights::save(&read.policy, &two).unwrap();
    assert_eq!(fs::read(&one).unwrap(), fs::read(&two).unwrap());
    let mut other = read.clone();
    other.policy.output.bias[3] = -other.policy.output.bias[3];
    assert_ne!(other.hash(), read.hash());
    // As other tools see it: a row of a matrix is an input.
    let bytes = fs::read(&one).unwrap();
    let file = SafeTensors::deserialize(&bytes).unwrap();
    let first = file.tensor("first.weight").unwrap();
    assert_eq!(first.shape(), [25, 32]);
    assert_eq!(first.data()[4 * 33..4 * 34], policy().first.weight[1][1].to_le_bytes());
}

/// What loading says of a file with something changed, behind the file's name.
fn said(change: impl FnOnce(&mut Parts, &mut String)) -> String {
    let folder = folder("policy_wrong");
    let path = folder.join("own.safetensors");
    PolicyWeights::save(&policy(), &path).unwrap();
    fs::write(&path, rewritten(&fs::read(&path).unwrap(), change)).unwrap();
    let error = PolicyWeights::load(&path).unwrap_err().to_string();
    assert!(!error.contains('\n'), "{error}");
    error
        .strip_prefix(&format!("{}: ", path.display()))
        .unwrap_or_else(|| panic!("{error}"))
        .to_owned()
}

#[test]
fn what_is_wrong_is_named_with_its_value() {
    assert_eq!(said(|p, _| drop(p.remove("second.bias"))), "tensor second.bias: missing");
    let shape = said(|p, _| p.get_mut("first.weight").unwrap().1 = vec![32, 25]);
    assert_eq!(shape, "tensor first.weight: shape [32, 25], must be [25, 32]");
    let nan = said(|p, _| {
        p.get_mut("output.bias").unwrap().2[8..12].copy_from_slice(&f32::NAN.to_le_bytes());
    });
    assert_eq!(nan, "tensor output.bias[2] = NaN: must be finite");
    let more =
        said(|p, _| drop(p.insert("third.bias".to_owned(), (Dtype::F32, vec![1], vec![0; 4]))));
    assert_eq!(more, "tensor third.bias: unknown to this model");
    let with = |from: &str, to: &str| {
        said(|_, text| {
            assert!(text.contains(from), "{from} is not in {text}");
            *text = text.replacen(from, to, 1);
        })
    };
    assert_eq!(with("\"policy\"", "\"parnn\""), "kind = parnn: must be \"policy\"");
    assert_eq!(with("\"format\":1", "\"format\":2"), "format = 2: this version reads 1");
    assert_eq!(with("\"hidden\":32", "\"hidden\":64"), "hidden = 64: the flight code has 32");
    assert!(with(",\"action\":4", "").contains("metadata squirrel:"));
}

#[test]
fn what_is_no_policy_is_refused_and_nothing_half_written_stays() {
    let folder = folder("policy_none");
    let model = folder.join("model.safetensors");
    fs::write(&model, shipped()).unwrap();
    let error = PolicyWeights::load(&model).unwrap_err().to_string();
    assert!(error.starts_with(&format!("{}: metadata squirrel: ", model.display())), "{error}");
    fs::write(&model, &shipped()[..100]).unwrap();
    let error = PolicyWeights::load(&model).unwrap_err().to_string();
    assert!(error.contains("not a whole safetensors file"), "{error}");
    let mut nan = policy();
    nan.second.bias[5] = f32::NAN;
    let path = folder.join("nan.safetensors");
    let error = PolicyWeights::save(&nan, &path).unwrap_err().to_string();
    assert!(error.ends_with("tensor second.bias[5] = NaN: must be finite"), "{error}");
    assert!(PolicyWeights::save(&policy(), &folder.join("no/such/folder.safetensors")).is_err());
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
}
