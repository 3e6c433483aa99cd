//! The Python class `Config` and those of its groups: settings by attribute.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use patchlock::{
    Error, Method, NetworkError, NetworkUse, PARAMETERS, Parameter, Preset, TrackerConfig, Value,
};
use patchlock_track::names::near_matches;
use patchlock_track::{ModelPaths, settings};
use pyo3::exceptions::{PyAttributeError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors;
use crate::network::{self, Model, Network, RuntimeName, check_use};

/// What `__reduce__` returns: a function and the arguments from which it makes equal settings.
type ReduceValue<'py> =
    (Bound<'py, PyAny>, (&'static str, Bound<'py, PyDict>, Option<Py<Network>>));

/// The group of the patch model, in those of the methods that have one.
const PATCHES: &str = "patches";

/// The attribute that holds the network.
const MODEL: &str = "model";

/// The settings of a tracker.
///
/// The preset chooses the method, `robust`, `paper` or `network`. The settings of the method are in the group of
/// its name, those of the patch model of `robust` and `paper` in the group `patches` in it:
///
/// ```python
/// config = patchlock.Config()
/// config.seed = 3
/// config.robust.search = 7
/// config.robust.patches.templates = 8
/// ```
///
/// `parameters()` describes every setting. A tracker copies its settings when it starts, so a later change has
/// no effect on it. Settings can be compared, copied and pickled. A pickle holds the paths of the network's
/// files, not the network; see `Network`.
///
/// Args:
///     preset: The preset to start from; `PRESETS` lists the names.
///     file: A TOML file with settings that differ from the preset, as `patchlock config` writes it.
///     settings: Settings to change, by name, such as `search=7`.
///     model: The network: a `Network`, what `Network` takes, or `"none"`. By default that of the file, or
///         else `"patchnet"` with `robust` and `network`.
///     runtime: What runs the network, as for `Network`, if `model` is not a `Network`.
///
/// Raises:
///     AttributeError: An attribute is not a setting, or belongs to another method.
///     TypeError: The value of a setting or of an argument has the wrong type, or a keyword argument is not a
///         setting.
///     ValueError: There is no such preset, the value of a setting is not allowed, the file is invalid, or the
///         network can't be used.
///     OSError: A file can't be read.
///     ImportError: `runtime` is `"onnxruntime"`, which is not installed.
#[pyclass(frozen, module = "patchlock")]
pub struct Config {
    /// All settings, as the group without a name.
    all: Group,
    /// The network of the settings.
    model: Option<Py<Network>>,
}

/// A group of settings: a view of its [`Config`].
#[pyclass(frozen, subclass, module = "patchlock")]
pub struct Group {
    /// The settings that a [`Config`] and its groups share.
    shared: Arc<Mutex<TrackerConfig>>,
    name: &'static str,
}

/// The settings of the method `robust`: `Config.robust`.
#[pyclass(frozen, extends = Group, module = "patchlock")]
pub struct RobustConfig;

/// The settings of the method `paper`: `Config.paper`.
#[pyclass(frozen, extends = Group, module = "patchlock")]
pub struct PaperConfig;

/// The settings of the method `network`: `Config.network`.
#[pyclass(frozen, extends = Group, module = "patchlock")]
pub struct NetworkConfig;

/// The settings of the patch model: `Config.robust.patches` or `Config.paper.patches`.
#[pyclass(frozen, extends = Group, module = "patchlock")]
pub struct PatchModelConfig;

/// Settings with the Python object of their network.
pub struct Settings {
    pub config: TrackerConfig,
    pub model: Option<Py<Network>>,
}

impl Settings {
    /// The settings of a preset, with the network that it has by default.
    pub fn of_preset(py: Python<'_>, preset: Preset) -> PyResult<Self> {
        let settings = Self { config: preset.into(), model: None };
        let model = Model::default_of(&settings.config.method);
        settings.with(py, model, None)
    }

    /// The settings with this network, or with their own.
    fn with(
        self,
        py: Python<'_>,
        model: Option<Model>,
        runtime: Option<RuntimeName>,
    ) -> PyResult<Self> {
        let Some(model) = model else {
            return match runtime {
                Some(_) => Err(network::unused_runtime()),
                None => Ok(self),
            };
        };
        let (mut config, model) = (self.config, model.network(py, runtime)?);
        config.network = model.as_ref().map(|model| model.get().to_rust());
        check_use(&config.method, config.network.as_ref())?;
        Ok(Self { config, model })
    }

    /// The settings with changes by name, from the keyword arguments of a call that has these others.
    fn changed(
        mut self,
        changes: Option<&Bound<'_, PyDict>>,
        arguments: &[&str],
    ) -> PyResult<Self> {
        changes.map_or(Ok(()), |changes| apply(&mut self.config, changes, arguments))?;
        Ok(self)
    }
}

impl Config {
    /// An object with these settings.
    pub fn of(settings: Settings) -> Self {
        let Settings { config, model } = settings;
        Self { all: Group { shared: Arc::new(Mutex::new(config)), name: "" }, model }
    }

    /// A copy of the settings.
    pub fn settings(&self, py: Python<'_>) -> Settings {
        Settings { config: self.all.lock().clone(), model: self.model(py) }
    }
}

#[pymethods]
impl Config {
    #[new]
    #[pyo3(signature = (preset = "robust", file = None, *, model = None, runtime = None, **settings))]
    fn new(
        py: Python<'_>,
        preset: &str,
        file: Option<PathBuf>,
        model: Option<Model>,
        runtime: Option<RuntimeName>,
        settings: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let (config, paths) = match &file {
            None => (named(preset)?.into(), ModelPaths::default()),
            Some(file) => settings::from_file(preset, file).map_err(errors::of_track)?,
        };
        // The file names the network and its runtime where the arguments do not.
        let model = model.or_else(|| paths.model.map(Model::of_path));
        let model = model.or_else(|| Model::default_of(&config.method));
        let is_loaded = matches!(model, Some(Model::Loaded(_)));
        let of_file = paths.runtime.filter(|_| !is_loaded).map(RuntimeName);
        let chosen = Settings { config, model: None }.with(py, model, runtime.or(of_file))?;
        Ok(Self::of(chosen.changed(settings, &["preset", "file", "model", "runtime"])?))
    }

    /// The network; `None` if there is none.
    #[getter]
    fn model(&self, py: Python<'_>) -> Option<Py<Network>> {
        self.model.as_ref().map(|model| model.clone_ref(py))
    }

    /// All settings: a dictionary of `seed` and of the method's group, whose settings are a dictionary, too.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let config = self.all.lock();
        let (all, group, patches) = (PyDict::new(py), PyDict::new(py), PyDict::new(py));
        for (parameter, value) in used(&config) {
            let dict = match parameter.group {
                "" => &all,
                PATCHES => &patches,
                _ => &group,
            };
            dict.set_item(parameter.name, to_python(py, value)?)?;
        }
        if config.method.patches().is_some() {
            group.set_item(PATCHES, patches)?;
        }
        all.set_item(config.method.name(), group)?;
        Ok(all)
    }

    fn __getattr__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        self.all.__getattr__(py, name)
    }

    fn __setattr__(&self, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        if name == MODEL {
            let message =
                "model can't be changed; patchlock.Config(\"network\", model=...) sets it";
            return Err(PyAttributeError::new_err(message));
        }
        self.all.__setattr__(name, value)
    }

    fn __dir__(&self) -> Vec<&'static str> {
        let others = [MODEL, "to_dict"];
        others.into_iter().chain(self.all.__dir__()).collect()
    }

    fn __eq__(&self, other: &Self) -> bool {
        // Two locks at once could wait for each other.
        let other = other.all.lock().clone();
        *self.all.lock() == other
    }

    fn __repr__(&self) -> String {
        let config = self.all.lock();
        let (preset, changes) = basis(&config);
        let place = |parameter: &Parameter| match parameter.group {
            "" => parameter.name.to_owned(),
            PATCHES => format!("{}.{PATCHES}.{}", config.method.name(), parameter.name),
            group => format!("{group}.{}", parameter.name),
        };
        let changes: String = changes
            .iter()
            .map(|(parameter, value)| format!(", {}={value}", place(parameter)))
            .collect();
        let model = config.network.as_ref();
        let model = model.map_or(String::new(), |model| format!(", model='{}'", model.name()));
        format!("<Config '{preset}'{changes}{model}>")
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<ReduceValue<'py>> {
        let restore = py.import("patchlock._patchlock")?.getattr("_restore_config")?;
        let (preset, changes) = basis(&self.all.lock());
        let dict = PyDict::new(py);
        for (parameter, value) in changes {
            dict.set_item(parameter.name, to_python(py, value)?)?;
        }
        Ok((restore, (preset.name(), dict, self.model(py))))
    }
}

impl Group {
    fn lock(&self) -> MutexGuard<'_, TrackerConfig> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A group in this one, as an object of its class.
    fn inner<'py>(&self, py: Python<'py>, name: &'static str) -> PyResult<Bound<'py, PyAny>> {
        let group = PyClassInitializer::from(Self { shared: Arc::clone(&self.shared), name });
        Ok(match name {
            "robust" => Bound::new(py, group.add_subclass(RobustConfig))?.into_any(),
            "paper" => Bound::new(py, group.add_subclass(PaperConfig))?.into_any(),
            "network" => Bound::new(py, group.add_subclass(NetworkConfig))?.into_any(),
            PATCHES => Bound::new(py, group.add_subclass(PatchModelConfig))?.into_any(),
            _ => Bound::new(py, group)?.into_any(),
        })
    }
}

#[pymethods]
impl Group {
    fn __getattr__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let config = self.lock();
        if let Some(inner) = groups(&config, self.name).iter().find(|inner| **inner == name) {
            if *inner != PATCHES && *inner != config.method.name() {
                return Err(PyAttributeError::new_err(other_method(inner, &config)));
            }
            return self.inner(py, inner);
        }
        check_name(&config, self.name, name)?;
        let value = config.get(name);
        to_python(py, value.map_err(|error| PyAttributeError::new_err(error.to_string()))?)
    }

    fn __setattr__(&self, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        let mut config = self.lock();
        if groups(&config, self.name).contains(&name) {
            let message = format!("{name} is a group of settings; change them one by one");
            return Err(PyAttributeError::new_err(message));
        }
        let parameter = check_name(&config, self.name, name)?;
        change(&mut config, parameter, value)
    }

    fn __dir__(&self) -> Vec<&'static str> {
        names(&self.lock(), self.name)
    }

    fn __eq__(&self, other: &Self) -> bool {
        let of = |group: &Self| -> Vec<_> {
            used(&group.lock()).filter(|(row, _)| row.group == group.name).collect()
        };
        self.name == other.name && of(self) == of(other)
    }

    fn __repr__(&self) -> String {
        let config = self.lock();
        let settings: Vec<_> = used(&config)
            .filter(|(parameter, _)| parameter.group == self.name)
            .map(|(parameter, value)| format!("{}={value}", parameter.name))
            .collect();
        format!("<{} {}>", self.name, settings.join(", "))
    }
}

/// Called by pickle.
#[pyfunction]
#[pyo3(name = "_restore_config", signature = (preset, changes, model = None))]
pub fn restore_config(
    py: Python<'_>,
    preset: &str,
    changes: &Bound<'_, PyDict>,
    model: Option<Py<Network>>,
) -> PyResult<Config> {
    let settings = Settings { config: named(preset)?.into(), model: None };
    let settings = settings.with(py, model.map(Model::Loaded), None)?;
    Ok(Config::of(settings.changed(Some(changes), &[])?))
}

/// A copy of settings that fit each other, with the network that the method needs. Settings by name
/// are keyword arguments of a function that has these `arguments`, too.
#[pyfunction]
#[pyo3(
    name = "_checked_config",
    signature = (config, preset, model, runtime, settings = None, arguments = None)
)]
pub fn checked_config(
    py: Python<'_>,
    config: Option<Choice>,
    preset: Option<&str>,
    model: Option<Model>,
    runtime: Option<RuntimeName>,
    settings: Option<&Bound<'_, PyDict>>,
    arguments: Option<Vec<String>>,
) -> PyResult<Config> {
    let arguments: Vec<&str> = arguments.iter().flatten().map(String::as_str).collect();
    let settings = chosen(py, (config, preset), (model, runtime), (settings, &arguments))?;
    settings.config.validate().map_err(errors::of_tracker)?;
    let network = settings.config.method.info().network;
    if network == NetworkUse::Required && settings.model.is_none() {
        return Err(errors::of_tracker(NetworkError::None.into()));
    }
    Ok(Config::of(settings))
}

/// The argument `config` of a tracker.
pub struct Choice(Settings);

impl<'py> FromPyObject<'_, 'py> for Choice {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        match object.cast::<Config>() {
            Ok(config) => Ok(Self(config.get().settings(object.py()))),
            Err(_) => Err(PyTypeError::new_err(format!(
                "config is a patchlock.Config, not {}; preset= takes the name of a preset",
                errors::shown(&object)
            ))),
        }
    }
}

/// The keyword arguments of a tracker, besides settings.
pub const ARGUMENTS: [&str; 6] = ["config", "preset", "model", "runtime", "threads", "channels"];

/// The settings that the arguments `config` or `preset`, `model` and `runtime` choose, with the changes
/// of a call that has these keyword arguments.
pub fn chosen(
    py: Python<'_>,
    (config, preset): (Option<Choice>, Option<&str>),
    (model, runtime): (Option<Model>, Option<RuntimeName>),
    (changes, arguments): (Option<&Bound<'_, PyDict>>, &[&str]),
) -> PyResult<Settings> {
    let (settings, model) = match (config, preset) {
        (Some(_), Some(_)) => {
            return Err(PyValueError::new_err(
                "config and preset are both given; patchlock.Config takes the name of a preset",
            ));
        }
        (Some(Choice(settings)), None) => (settings, model),
        (None, preset) => {
            let config = TrackerConfig::from(preset.map_or(Ok(Preset::default()), named)?);
            let model = model.or_else(|| Model::default_of(&config.method));
            (Settings { config, model: None }, model)
        }
    };
    settings.with(py, model, runtime)?.changed(changes, arguments)
}

/// The preset of this name.
fn named(preset: &str) -> PyResult<Preset> {
    preset.parse().map_err(errors::of_tracker)
}

/// Changes settings by name. They are given beside these `arguments`, one of which may be meant.
pub fn apply(
    config: &mut TrackerConfig,
    changes: &Bound<'_, PyDict>,
    arguments: &[&str],
) -> PyResult<()> {
    for (name, value) in changes {
        let name: String = name.extract()?;
        let parameter = Parameter::named(&name).ok_or_else(|| {
            let settings = PARAMETERS.iter().map(|parameter| parameter.name);
            PyTypeError::new_err(unknown(&name, settings.chain(arguments.iter().copied())))
        })?;
        change(config, parameter, &value)?;
    }
    Ok(())
}

/// Changes a setting.
fn change(
    config: &mut TrackerConfig,
    parameter: &Parameter,
    value: &Bound<'_, PyAny>,
) -> PyResult<()> {
    config.set(parameter.name, to_value(parameter, value)?).map_err(|error| match error {
        Error::SettingKind { .. } => wrong_kind(parameter, value),
        error @ Error::UnusedSetting { .. } => {
            let preset = owner(parameter);
            PyValueError::new_err(format!("{error} (preset=\"{preset}\" chooses it)"))
        }
        error => errors::of_value(error),
    })
}

/// The first preset whose method uses a setting.
fn owner(parameter: &Parameter) -> Preset {
    let uses = |preset: &Preset| parameter.is_used_by(&TrackerConfig::from(*preset).method);
    Preset::ALL.into_iter().find(uses).unwrap_or_default()
}

/// The preset of the method that settings differ from least, and the settings that differ.
pub fn basis(config: &TrackerConfig) -> (Preset, Vec<(&'static Parameter, Value)>) {
    let changes = |preset: Preset| {
        let begun = TrackerConfig::from(preset);
        let differ = |(parameter, value): &(&Parameter, Value)| {
            begun.get(parameter.name).as_ref() != Ok(value)
        };
        (preset, used(config).filter(differ).collect::<Vec<_>>())
    };
    let has_method =
        |preset: &Preset| TrackerConfig::from(*preset).method.name() == config.method.name();
    let all = Preset::ALL.into_iter().filter(has_method).map(changes);
    all.min_by_key(|(_, changes)| changes.len()).unwrap_or_default()
}

/// The settings that the method uses, with their values.
fn used(config: &TrackerConfig) -> impl Iterator<Item = (&'static Parameter, Value)> {
    PARAMETERS.iter().filter_map(|parameter| Some((parameter, config.get(parameter.name).ok()?)))
}

/// The groups directly in a group; the empty name is that of the whole configuration.
fn groups(config: &TrackerConfig, group: &str) -> &'static [&'static str] {
    match group {
        "" => &Method::NAMES,
        _ if group == config.method.name() && config.method.patches().is_some() => &[PATCHES],
        _ => &[],
    }
}

/// The attributes of a group.
fn names(config: &TrackerConfig, group: &str) -> Vec<&'static str> {
    let method = config.method.name();
    let settings = PARAMETERS.iter().filter(|row| row.group == group).map(|row| row.name);
    let inner = groups(config, group).iter().copied();
    settings.chain(inner.filter(|name| *name == method || *name == PATCHES)).collect()
}

/// The row of a setting, which must be in the group.
fn check_name(
    config: &TrackerConfig,
    group: &'static str,
    name: &str,
) -> PyResult<&'static Parameter> {
    let message = match Parameter::named(name) {
        Some(parameter) if parameter.group == group => return Ok(parameter),
        Some(parameter) if !parameter.is_used_by(&config.method) => {
            let owner = owner(parameter).name();
            format!("{name} is in {}: {}", parameter.group, other_method(owner, config))
        }
        Some(parameter) => {
            let method = config.method.name();
            let place = match parameter.group {
                "" => "config".to_owned(),
                PATCHES => format!("config.{method}.{PATCHES}"),
                group => format!("config.{group}"),
            };
            format!("{name} is a setting in another group: {place}.{name}")
        }
        None => unknown(name, names(config, group).into_iter()),
    };
    Err(PyAttributeError::new_err(message))
}

/// Why the group of a method can't be used.
fn other_method(group: &str, config: &TrackerConfig) -> String {
    format!(
        "these settings have the method {}, not {group}; start from patchlock.Config(\"{group}\")",
        config.method.name()
    )
}

fn unknown<'a>(name: &str, names: impl Iterator<Item = &'a str>) -> String {
    let near = near_matches(name, names);
    let meant = match near.is_empty() {
        true => String::new(),
        false => format!("did you mean {}? ", near.join(" or ")),
    };
    format!("there is no setting '{name}'; {meant}patchlock.parameters() lists all")
}

fn wrong_kind(parameter: &Parameter, value: &Bound<'_, PyAny>) -> PyErr {
    let Parameter { name, kind, range, .. } = parameter;
    PyTypeError::new_err(format!(
        "the setting `{name}` is {}; it takes {kind}; allowed: {range}",
        errors::shown(value)
    ))
}

/// A Python value as the value of a setting.
fn to_value(parameter: &Parameter, value: &Bound<'_, PyAny>) -> PyResult<Value> {
    value
        .extract()
        .map(Value::Flag)
        .or_else(|_| value.extract().map(Value::Whole))
        .or_else(|_| value.extract().map(Value::Number))
        .or_else(|_| value.extract().map(Value::Word))
        .map_err(|_: PyErr| wrong_kind(parameter, value))
}

fn to_python(py: Python<'_>, value: Value) -> PyResult<Bound<'_, PyAny>> {
    Ok(match value {
        Value::Flag(flag) => flag.into_pyobject(py)?.to_owned().into_any(),
        Value::Whole(number) => number.into_pyobject(py)?.into_any(),
        Value::Number(number) => number.into_pyobject(py)?.into_any(),
        Value::Word(word) => word.into_pyobject(py)?.into_any(),
    })
}

/// One row of the table of settings: group, name, default, allowed, source, purpose.
type Row<'py> = (&'static str, &'static str, Bound<'py, PyAny>, String, &'static str, &'static str);

/// The rows of the table of settings: group, name, default, allowed values, source, purpose.
#[pyfunction]
#[pyo3(signature = (research = false))]
pub fn parameters(py: Python<'_>, research: bool) -> PyResult<Vec<Row<'_>>> {
    let defaults = Preset::ALL.map(TrackerConfig::from);
    let row = |parameter: &Parameter| {
        let Parameter { group, name, range, source, purpose, .. } = *parameter;
        let config = defaults.iter().find(|config| parameter.is_used_by(&config.method));
        let default = config.unwrap_or(&defaults[0]).get(name).map_err(errors::of_tracker)?;
        Ok((group, name, to_python(py, default)?, range.to_string(), source, purpose))
    };
    let is_listed = |row: &&Parameter| {
        let used = |config: &&TrackerConfig| row.is_used_by(&config.method);
        research || defaults.iter().filter(used).any(|config| row.is_stable_for(&config.method))
    };
    PARAMETERS.iter().filter(is_listed).map(row).collect()
}
