//! Builds a validated configuration from a preset and keyword arguments.

use std::path::Path;

use patchlock::{Error, Method, PARAMETERS, Parameter, Range, TrackerConfig};
use patchlock_track::names::near_matches;
use patchlock_track::settings::Overrides;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict};
use serde_json::{Map, Value};

use crate::errors;

/// A preset with the settings of a TOML file and then some others changed.
pub fn resolve(
    preset: &str,
    file: Option<&Path>,
    overrides: Option<&Bound<'_, PyDict>>,
) -> PyResult<TrackerConfig> {
    let config = match file {
        None => TrackerConfig::preset(preset).map_err(errors::of_tracker)?,
        Some(_) => patchlock_track::settings::resolve(preset, file, Overrides::default())
            .map_err(|error| errors::of_track(error.into()))?,
    };
    match overrides {
        Some(overrides) => changed(config, overrides),
        None => Ok(config),
    }
}

/// A configuration with some settings changed.
pub fn changed(config: TrackerConfig, overrides: &Bound<'_, PyDict>) -> PyResult<TrackerConfig> {
    let mut table = table(&config)?;
    let mut new = Vec::new();
    for (name, value) in overrides {
        let name: String = name.extract()?;
        // `lambda` is a Python keyword, so as an argument it is written `lambda_`.
        let name = name.strip_suffix('_').map_or(name.clone(), str::to_owned);
        let known = PARAMETERS.iter().find(|parameter| parameter.name == name);
        let parameter = known.ok_or_else(|| unknown(&name))?;
        let slot = slot(&mut table, parameter);
        let value = checked(parameter, &value, slot)?;
        if *slot != value {
            *slot = value;
            new.push(parameter);
        }
    }
    let config: TrackerConfig = serde_json::from_value(Value::Object(table))
        .map_err(|error| PyValueError::new_err(error.to_string()))?;
    config.validate().map_err(errors::of_tracker)?;
    match new.iter().find(|parameter| !parameter.is_used_by(config.method)) {
        Some(parameter) => Err(unused(parameter, config.method)),
        None => Ok(config),
    }
}

/// The entry of a setting in the table of a configuration.
fn slot<'a>(table: &'a mut Map<String, Value>, parameter: &Parameter) -> &'a mut Value {
    match parameter.group {
        "" => &mut table[parameter.name],
        group => &mut table[group][parameter.name],
    }
}

/// The configuration as a table of groups and names.
fn table(config: &TrackerConfig) -> PyResult<Map<String, Value>> {
    match serde_json::to_value(config) {
        Ok(Value::Object(table)) => Ok(table),
        other => Err(PyValueError::new_err(format!("the configuration is not a table: {other:?}"))),
    }
}

fn unused(parameter: &Parameter, method: Method) -> PyErr {
    let Parameter { group, name, .. } = parameter;
    PyValueError::new_err(format!(
        "{name} is a setting of the method {group} that {} does not use; add method=\"{group}\"{}",
        method.name(),
        if *group == "patchwise" { ", or use the preset 'paper'" } else { "" },
    ))
}

fn unknown(name: &str) -> PyErr {
    let near = near_matches(name, PARAMETERS.iter().map(|parameter| parameter.name));
    let meant = if near.is_empty() {
        String::new()
    } else {
        format!("did you mean {}? ", near.join(" or "))
    };
    PyTypeError::new_err(format!(
        "there is no setting '{name}'; {meant}patchlock.parameters() lists all"
    ))
}

/// The value, converted to the type of the setting and checked against its range.
fn checked(parameter: &Parameter, value: &Bound<'_, PyAny>, default: &Value) -> PyResult<Value> {
    let wrong_kind = |wanted: &str| {
        let shown = value.repr().map_or("this".to_string(), |text| text.to_string());
        PyTypeError::new_err(format!("{} takes {wanted}, not {shown}", parameter.name))
    };
    let outside = || {
        errors::of_tracker(Error::Config {
            field: parameter.name,
            value: value.to_string(),
            allowed: parameter.range.to_string(),
        })
    };
    match parameter.range {
        Range::Flag => match value.extract::<bool>() {
            Ok(flag) => Ok(Value::Bool(flag)),
            Err(_) => Err(wrong_kind("True or False")),
        },
        Range::Words(words) => match value.extract::<String>() {
            Ok(word) if words.contains(&word.as_str()) => Ok(Value::String(word)),
            Ok(_) => Err(outside()),
            Err(_) => Err(wrong_kind("a word")),
        },
        Range::Number { min, max } => {
            let whole = !default.is_f64();
            let wanted = if whole { "a whole number" } else { "a number" };
            let number = if value.is_instance_of::<PyBool>() { None } else { value.extract().ok() };
            let number: f64 = number.ok_or_else(|| wrong_kind(wanted))?;
            let integer: Option<i64> = value.extract().ok();
            match integer {
                _ if !(min..=max).contains(&number) => Err(outside()),
                Some(integer) if whole => Ok(Value::from(integer)),
                None if whole => Err(wrong_kind(wanted)),
                _ => Ok(Value::from(number)),
            }
        }
    }
}

/// The configuration as one flat Python dictionary; names are unique across groups.
pub fn to_dict<'py>(py: Python<'py>, config: &TrackerConfig) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let mut table = table(config)?;
    for parameter in PARAMETERS {
        dict.set_item(parameter.name, to_python(py, slot(&mut table, parameter))?)?;
    }
    Ok(dict)
}

fn to_python<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    match value {
        Value::Bool(flag) => Ok(flag.into_pyobject(py)?.to_owned().into_any()),
        Value::String(word) => Ok(word.into_pyobject(py)?.into_any()),
        Value::Number(number) if number.is_u64() => {
            Ok(number.as_u64().into_pyobject(py)?.into_any())
        }
        other => Ok(other.as_f64().into_pyobject(py)?.into_any()),
    }
}

/// One row of the table of settings: name, default, allowed, source, purpose.
type Row<'py> = (&'static str, Bound<'py, PyAny>, String, &'static str, String);

/// The rows of the table of settings: name, default, allowed values, source, purpose.
#[pyfunction]
pub fn parameters(py: Python<'_>) -> PyResult<Vec<Row<'_>>> {
    let defaults = to_dict(py, &TrackerConfig::default())?;
    let row = |parameter: &'static Parameter| -> PyResult<_> {
        let default = defaults.as_any().get_item(parameter.name)?;
        let purpose = parameter.purpose.split_whitespace().collect::<Vec<_>>().join(" ");
        Ok((parameter.name, default, parameter.range.to_string(), parameter.source, purpose))
    };
    PARAMETERS.iter().map(row).collect()
}
