//! Policies trained in Python, in the network of fixed size that flies.

use crate::arguments::{Array32, Numbers, rows};
use crate::error;
use crate::interrupt::look;
use crate::kept::{broken, reduced};
use crate::log::table;
use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyTuple};
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

/// Rows between two looks at Ctrl-C: some hundredths of a second.
const ROWS_A_LOOK: usize = 16_384;

impl Policy {
    /// What pickle kept.
    pub(crate) fn again(state: &Bound<'_, PyTuple>) -> PyResult<Self> {
        let broken = || broken("Policy");
        let state: Result<(Bound<'_, PyBytes>, String), _> = state.extract();
        let (bytes, name) = state.map_err(|_: PyErr| broken())?;
        let (numbers, rest) = bytes.as_bytes().as_chunks::<4>();
        let mut numbers = numbers.iter().map(|bytes| f32::from_le_bytes(*bytes));
        let mut policy = policy::Policy::filled(0.0);
        for number in policy.tensors_mut().into_iter().flatten() {
            *number = numbers.next().filter(|x| x.is_finite()).ok_or_else(broken)?;
        }
        if !rest.is_empty() || numbers.next().is_some() {
            return Err(broken());
        }
        Ok(Self { weights: PolicyWeights { policy, name } })
    }
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
        let mut actions = Vec::with_capacity(numbers.len() / OBSERVATION * ACTION);
        for some in numbers.chunks(ROWS_A_LOOK * OBSERVATION) {
            py.detach(|| {
                for observation in some.as_chunks::<OBSERVATION>().0 {
                    actions.extend(self.weights.policy.evaluate(observation));
                }
            });
            look(py)?;
        }
        table(py, actions, ACTION)
    }

    /// FNV-1a of the weights, 16 hexadecimal digits; flight logs have it as ``policy_hash``.
    #[getter]
    fn hash(&self) -> String {
        self.weights.hash()
    }

    /// Whether the other is a policy with the same weights.
    fn __eq__(
        &self,
        #[gen_stub(override_type(type_repr = "object"))] other: &Bound<'_, PyAny>,
    ) -> bool {
        other.cast::<Self>().is_ok_and(|other| self.weights.policy == other.get().weights.policy)
    }

    fn __hash__(&self) -> u64 {
        self.weights.policy.tensors().into_iter().flatten().fold(0, |before, x| {
            // Equal numbers have equal hashes, zeros of both signs too.
            let bits = if *x == 0.0 { 0 } else { x.to_bits() };
            (before ^ u64::from(bits)).wrapping_mul(0x0000_0100_0000_01B3)
        })
    }

    #[gen_stub(override_return_type(type_repr = "tuple[typing.Any, ...]", imports = ("typing")))]
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let numbers = self.weights.policy.tensors().into_iter().flatten();
        let bytes: Vec<u8> = numbers.flat_map(|x| x.to_le_bytes()).collect();
        reduced(py, "Policy", (PyBytes::new(py, &bytes), &self.weights.name))
    }

    /// The same: it never changes.
    fn __copy__(own: PyRef<'_, Self>) -> PyRef<'_, Self> {
        own
    }

    /// The same: it never changes.
    fn __deepcopy__<'py>(
        own: PyRef<'py, Self>,
        #[gen_stub(override_type(type_repr = "typing.Any", imports = ("typing")))] memo: &Bound<
            'py,
            PyAny,
        >,
    ) -> PyRef<'py, Self> {
        let _ = memo;
        own
    }

    fn __repr__(&self) -> String {
        format!("<Policy {}: {}>", self.weights.name, self.weights.hash())
    }
}
