//! Keys of vehicle files, and their values as Python's objects.

use crate::error;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyList};
use toml_edit::{DocumentMut, Item, Table, TableLike, Value};

/// Lists in lists that a file may have; it needs two.
const DEPTH_MAX: usize = 8;

/// The table that holds a key, and the last part of the key.
///
/// * `make` - tables that are missing
pub(crate) fn table_of<'a, 'k>(
    document: &'a mut DocumentMut,
    key: &'k str,
    make: bool,
) -> Result<(&'a mut dyn TableLike, &'k str), String> {
    let mut table: &mut dyn TableLike = document.as_table_mut();
    let mut parts = key.split('.').peekable();
    while let Some(part) = parts.next() {
        if parts.peek().is_none() {
            return Ok((table, part));
        }
        let (name, index) = match part.strip_suffix(']').and_then(|part| part.split_once('[')) {
            Some((name, index)) => {
                (name, Some(index.parse::<usize>().map_err(|_| format!("no table {part}"))?))
            }
            None => (part, None),
        };
        if make && index.is_none() && table.get(name).is_none() {
            let mut new = Table::new();
            // Only the headers of tables with numbers show.
            new.set_implicit(true);
            table.insert(name, Item::Table(new));
        }
        let inner = table.get_mut(name).ok_or_else(|| format!("no table {part}"))?;
        table = match index {
            None => inner.as_table_like_mut().ok_or_else(|| format!("{part} is not a table"))?,
            Some(index) => inner
                .as_array_of_tables_mut()
                .and_then(|tables| tables.get_mut(index))
                .ok_or_else(|| format!("no table {part}"))?,
        };
    }
    Err("empty".to_owned())
}

/// Sets a key, or takes it out.
pub(crate) fn set(document: &mut DocumentMut, key: &str, new: Option<Value>) -> Result<(), String> {
    let (table, name) = table_of(document, key, true)?;
    let Some(new) = new else {
        return table.remove(name).map(|_| ()).ok_or_else(|| "not there".to_owned());
    };
    let long = table
        .get_mut(name)
        .and_then(Item::as_table_like_mut)
        .filter(|long| long.contains_key("value"));
    if let Some(long) = long {
        long.insert("value", Item::Value(new));
        // It told where the old number was from.
        long.remove("source");
    } else {
        table.insert(name, Item::Value(new));
    }
    Ok(())
}

/// A Python object as a value.
///
/// * `depth` - of lists about it: one may hold itself
pub(crate) fn to_toml(key: &str, object: &Bound<'_, PyAny>, depth: usize) -> PyResult<Value> {
    if object.is_instance_of::<PyBool>() {
        return Ok(object.extract::<bool>()?.into());
    }
    if let Ok(text) = object.extract::<String>() {
        return Ok(text.into());
    }
    if let Ok(number) = object.extract::<i64>() {
        return Ok(number.into());
    }
    if let Ok(number) = object.extract::<f64>() {
        return Ok(number.into());
    }
    // What has no length may have no end.
    let is_list = depth < DEPTH_MAX && !object.is_instance_of::<PyDict>() && object.len().is_ok();
    if let (true, Ok(list)) = (is_list, object.try_iter()) {
        let list = list.map(|inner| to_toml(key, &inner?, depth + 1));
        return Ok(list.collect::<PyResult<toml_edit::Array>>()?.into());
    }
    Err(error::value(format!(
        "{key}: expected a number, text, truth value or list, got {}",
        object.get_type().name()?
    )))
}

/// A value as Python's own object.
pub(crate) fn to_python<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::Integer(x) => x.value().into_pyobject(py)?.into_any(),
        Value::Float(x) => x.value().into_pyobject(py)?.into_any(),
        Value::Boolean(x) => x.value().into_pyobject(py)?.to_owned().into_any(),
        Value::Array(list) => {
            PyList::new(py, list.iter().map(|x| to_python(py, x)).collect::<PyResult<Vec<_>>>()?)?
                .into_any()
        }
        other => other
            .as_str()
            .map_or_else(|| other.to_string(), str::to_owned)
            .into_pyobject(py)?
            .into_any(),
    })
}
