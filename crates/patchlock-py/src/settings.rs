//! Builds a validated configuration from a preset and keyword arguments.

use std::path::Path;

use patchlock::{Error, PARAMETERS, Parameter, Preset, TrackerConfig, Value};
use patchlock_track::names::near_matches;
use patchlock_track::settings::Overrides;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict};

use crate::errors;

/// A preset with the settings of a TOML file and then some others changed.
pub fn resolve(
    preset: &str,
    file: Option<&Path>,
    overrides: Option<&Bound<'_, PyDict>>,
) -> PyResult<TrackerConfig> {
    let config = match file {
        None => preset.parse::<Preset>().map_err(errors::of_tracker)?.into(),
        Some(_) => patchlock_track::settings::resolve(preset, file, Overrides::default())
            .map_err(|error| errors::of_track(error.into()))?,
    };
    match overrides {
        Some(overrides) => changed(config, overrides),
        None => Ok(config),
    }
}

/// A configuration with some settings changed.
pub fn changed(
    mut config: TrackerConfig,
    overrides: &Bound<'_, PyDict>,
) -> PyResult<TrackerConfig> {
    for (name, value) in overrides {
        let name: String = name.extract()?;
        // `lambda` is a Python keyword, so as an argument it is written `lambda_`.
        let name = name.strip_suffix('_').unwrap_or(&name);
        config.set(name, to_value(&value)?).map_err(of_setting)?;
    }
    config.validate().map_err(errors::of_tracker)?;
    Ok(config)
}

fn of_setting(error: Error) -> PyErr {
    match &error {
        Error::UnknownSetting { name } => unknown(name),
        Error::SettingKind { .. } => PyTypeError::new_err(error.to_string()),
        _ => errors::of_tracker(error),
    }
}

fn to_value(value: &Bound<'_, PyAny>) -> PyResult<Value> {
    if value.is_instance_of::<PyBool>() {
        return Ok(Value::Flag(value.extract()?));
    }
    if let Ok(number) = value.extract::<i64>() {
        return Ok(Value::Whole(number));
    }
    if let Ok(number) = value.extract::<f64>() {
        return Ok(Value::Number(number));
    }
    Ok(Value::Word(value.extract().or_else(|_| value.repr().map(|text| text.to_string()))?))
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

/// The configuration as one flat Python dictionary; names are unique across groups.
pub fn to_dict<'py>(py: Python<'py>, config: &TrackerConfig) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for parameter in PARAMETERS.iter().filter(|row| row.is_used_by(&config.method)) {
        let value = config.get(parameter.name).map_err(errors::of_tracker)?;
        dict.set_item(parameter.name, to_python(py, &value)?)?;
    }
    Ok(dict)
}

fn to_python<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::Flag(flag) => flag.into_pyobject(py)?.to_owned().into_any(),
        Value::Word(word) => word.into_pyobject(py)?.into_any(),
        Value::Whole(number) => number.into_pyobject(py)?.into_any(),
        Value::Number(number) => number.into_pyobject(py)?.into_any(),
    })
}

/// One row of the table of settings: name, default, allowed, source, purpose.
type Row<'py> = (&'static str, Bound<'py, PyAny>, String, &'static str, String);

/// The rows of the table of settings: name, default, allowed values, source, purpose.
#[pyfunction]
pub fn parameters(py: Python<'_>) -> PyResult<Vec<Row<'_>>> {
    let configs = [Preset::Robust, Preset::Paper].map(TrackerConfig::from);
    let row = |parameter: &'static Parameter| -> PyResult<_> {
        let config = configs.iter().find(|config| parameter.is_used_by(&config.method));
        let default = config.unwrap_or(&configs[0]).get(parameter.name);
        let default = to_python(py, &default.map_err(errors::of_tracker)?)?;
        let purpose = parameter.purpose.split_whitespace().collect::<Vec<_>>().join(" ");
        Ok((parameter.name, default, parameter.range.to_string(), parameter.source, purpose))
    };
    PARAMETERS.iter().map(row).collect()
}
