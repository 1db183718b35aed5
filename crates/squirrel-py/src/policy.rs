//! Policies trained in Python, in the network of fixed size that flies.

use crate::arguments::{Array32, Numbers, rows};
use crate::error;
use crate::log::table;
use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3_stub_gen::derive::{gen_stub_pyclass, gen_stub_pymethods};
use squirrel_core::policy::{self, ACTION, HIDDEN, OBSERVATION};
use squirrel_core::rnn::elman::Dense;
use squirrel_sim::weights::PolicyWeights;
use std::path::PathBuf;

/// A policy that flies: two layers of 32 tanh neurons and a linear output, from 25 numbers seen to
/// 4 numbers commanded.
///
/// What the numbers mean is written in `squirrel.policy`. Layers are
/// ``(weight, bias)`` as `torch.nn.Linear` has them: ``y = weight @ x + bias``.
///
/// Parameters
/// ----------
/// first : tuple of ndarray of float32, shapes (32, 25) and (32,)
/// second : tuple of ndarray of float32, shapes (32, 32) and (32,)
/// output : tuple of ndarray of float32, shapes (4, 32) and (4,)
///
/// Raises
/// ------
/// ValueError
///     Names the array, what was expected and what came.
#[gen_stub_pyclass]
#[pyclass(frozen, module = "squirrel._squirrel")]
pub(crate) struct Policy {
    pub(crate) weights: PolicyWeights,
}

/// A layer from how PyTorch has it: `weight[output][input]`.
fn dense<const IN: usize, const OUT: usize>(
    name: &str,
    (weight, bias): &(Array32<'_>, Array32<'_>),
) -> PyResult<Dense<IN, OUT>> {
    let weight =
        rows::<f32>(&format!("{name}[0]"), &weight.0, &[Some(OUT), Some(IN)], Numbers::Finite)?;
    let bias = rows::<f32>(&format!("{name}[1]"), &bias.0, &[Some(OUT)], Numbers::Finite)?;
    let transposed = |i: usize| std::array::from_fn(|o| weight.numbers()[o * IN + i]);
    Ok(Dense { weight: std::array::from_fn(transposed), bias: bias.row(0) })
}

#[gen_stub_pymethods]
#[pymethods]
impl Policy {
    #[new]
    #[pyo3(signature = (*, first, second, output))]
    fn new(
        first: (Array32<'_>, Array32<'_>),
        second: (Array32<'_>, Array32<'_>),
        output: (Array32<'_>, Array32<'_>),
    ) -> PyResult<Self> {
        let policy = policy::Policy {
            first: dense::<OBSERVATION, HIDDEN>("first", &first)?,
            second: dense::<HIDDEN, HIDDEN>("second", &second)?,
            output: dense::<HIDDEN, ACTION>("output", &output)?,
        };
        Ok(Self { weights: PolicyWeights { policy, name: "of Python".to_owned() } })
    }

    /// Read a weights file.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     A safetensors file that `save` wrote.
    ///
    /// Returns
    /// -------
    /// Policy
    ///
    /// Raises
    /// ------
    /// OSError
    ///     The file cannot be read.
    /// ValueError
    ///     One line that names the file, and the tensor or field with its value.
    #[staticmethod]
    fn load(path: PathBuf) -> PyResult<Self> {
        let weights = PolicyWeights::load(&path).map_err(|e| error::weights(&e))?;
        Ok(Self { weights })
    }

    /// Write a safetensors file for ``squirrel fly --policy``; it appears under its name only when
    /// it is whole.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     File to write.
    ///
    /// Raises
    /// ------
    /// OSError
    ///     The disk refuses.
    fn save(&self, path: PathBuf) -> PyResult<()> {
        PolicyWeights::save(&self.weights.policy, &path).map_err(|e| error::weights(&e))
    }

    /// What the policy answers, with the bits that fly.
    ///
    /// Parameters
    /// ----------
    /// observation : ndarray of float32, shape (n, 25)
    ///     As `squirrel.policy` has it.
    ///
    /// Returns
    /// -------
    /// ndarray of float32, shape (n, 4)
    ///     Roll, pitch, thrust, wings; what is beyond [-1, 1] counts as the limit.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     Names the argument, what was expected and what came.
    fn __call__<'py>(
        &self,
        py: Python<'py>,
        observation: Array32<'py>,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let seen = rows::<f32>(
            "observation",
            &observation.0,
            &[None, Some(OBSERVATION)],
            Numbers::Finite,
        )?;
        let numbers = seen.numbers();
        let actions: Vec<f32> = py.detach(|| {
            let each = numbers.as_chunks::<OBSERVATION>().0.iter();
            each.flat_map(|observation| self.weights.policy.evaluate(observation)).collect()
        });
        table(py, actions, ACTION)
    }

    /// FNV-1a of the weights, 16 hexadecimal digits; flight logs have it as ``policy_hash``.
    #[getter]
    fn hash(&self) -> String {
        self.weights.hash()
    }

    fn __repr__(&self) -> String {
        format!("<Policy {}: {}>", self.weights.name, self.weights.hash())
    }
}
