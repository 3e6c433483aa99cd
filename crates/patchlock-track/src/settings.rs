//! Resolves a preset, a TOML file of overrides and a seed to a validated configuration.

use std::io;
use std::path::{Path, PathBuf};

use patchlock::{Method, PARAMETERS, PRESETS, Parameter, Range, TrackerConfig};

use crate::files;
use crate::names::near_matches;

/// Invalid settings.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SettingsError {
    /// There is no such preset.
    #[error("there is no preset {}", if name.is_empty() { "\"\"" } else { name })]
    Preset {
        /// The name as given.
        name: String,
    },
    /// The file cannot be read.
    #[error("cannot read the configuration {}: {reason}", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// The error of the operating system.
        reason: io::Error,
    },
    /// The file is not valid TOML.
    #[error("{}, line {line}, is not valid TOML: {reason}", file.display())]
    NoToml {
        /// The file.
        file: PathBuf,
        /// Line, counted from 1.
        line: usize,
        /// What is wrong.
        reason: String,
    },
    /// There is no such setting.
    #[error("{}: there is no setting {name}", file.display())]
    Unknown {
        /// The file.
        file: PathBuf,
        /// The name as given.
        name: String,
        /// Similar names.
        near: Vec<&'static str>,
    },
    /// The setting was removed, and the value differs from the one that is now always used.
    #[error("{}: {reason}", file.display())]
    Removed {
        /// The file.
        file: PathBuf,
        /// Why it was removed, and what replaces it.
        reason: String,
    },
    /// A setting has an invalid value.
    #[error("{}: {name} = {value} {fault}", file.display())]
    Value {
        /// The file.
        file: PathBuf,
        /// The setting.
        name: &'static str,
        /// The value as given.
        value: String,
        /// What is wrong.
        fault: &'static str,
        /// The allowed values.
        allowed: String,
    },
    /// The setting belongs to another method than the one in use.
    #[error("{}: the method in use, {}, has no use for {name} = {value}", file.display(), method.name())]
    Unused {
        /// The file.
        file: PathBuf,
        /// The setting.
        name: &'static str,
        /// The value as given.
        value: String,
        /// The method in use.
        method: Method,
        /// The method that the setting belongs to.
        owner: &'static str,
    },
    /// A setting on the command line is not of the form `NAME=VALUE`.
    #[error("--set {given}: not of the form NAME=VALUE")]
    Assignment {
        /// The text as given.
        given: String,
    },
    /// An option was given that the method in use ignores.
    #[error("{option}: the method in use, {}, has no use for it", method.name())]
    UnusedOption {
        /// The option.
        option: &'static str,
        /// The method in use.
        method: Method,
        /// The method that the option belongs to.
        owner: &'static str,
    },
    /// The configuration as a whole is invalid.
    #[error("{0}")]
    OutOfRange(String),
    /// The configuration cannot be converted to TOML or back.
    #[error("{0}")]
    Table(String),
}

impl SettingsError {
    /// Whether the settings are invalid (a usage error), as opposed to the file being unreadable.
    pub fn is_misuse(&self) -> bool {
        !matches!(self, Self::Unreadable { .. } | Self::Table(_))
    }

    /// One line on what the user can do about the error, if anything.
    pub fn advice(&self) -> Option<String> {
        Some(match self {
            Self::Preset { .. } => format!("the presets are {}", PRESETS.join(", ")),
            Self::Unreadable { .. } => {
                "patchlock config > my.toml writes one to start from".to_string()
            }
            Self::NoToml { .. } => {
                "each line is name = value, with text values in quotes".to_string()
            }
            Self::Unknown { near, .. } if near.is_empty() => {
                "patchlock config shows all settings".to_string()
            }
            Self::Unknown { near, .. } => {
                format!("did you mean {}? patchlock config shows all settings", near.join(" or "))
            }
            Self::Value { name, allowed, .. } => format!("{name} takes: {allowed}"),
            Self::Unused { owner, file, .. } if file == Path::new(SET) => {
                format!("--set method={owner} chooses the method that uses it")
            }
            Self::Unused { owner, .. } => {
                format!(
                    "method = \"{owner}\" at the beginning of the file chooses the method that uses it"
                )
            }
            Self::Assignment { .. } => {
                "such as --set search=7; patchlock config shows all settings".to_string()
            }
            Self::UnusedOption { option, owner, .. } => {
                format!("leave {option} out, or choose the method {owner} with --preset {owner}")
            }
            Self::OutOfRange(_) => {
                "patchlock config shows every setting with its range".to_string()
            }
            Self::Removed { .. } | Self::Table(_) => return None,
        })
    }
}

/// The preset with this name.
///
/// # Errors
/// [`SettingsError::Preset`].
pub fn preset(name: &str) -> Result<TrackerConfig, SettingsError> {
    TrackerConfig::preset(name).map_err(|_| SettingsError::Preset { name: name.to_string() })
}

/// The preset that a configuration is based on: this one, unless a settings file has chosen another method;
/// then the first preset of that method.
pub fn basis<'a>(preset: &'a str, config: &TrackerConfig) -> &'a str {
    let has_method = |name: &&str| {
        TrackerConfig::preset(name).is_ok_and(|preset| preset.method == config.method)
    };
    std::iter::once(preset).chain(PRESETS.iter().copied()).find(has_method).unwrap_or(preset)
}

/// Settings given on the command line, which take precedence over a settings file.
#[derive(Debug, Clone, Copy, Default)]
pub struct Overrides<'a> {
    /// `--set`: any settings, as `NAME=VALUE`; the other options take precedence over them.
    pub set: &'a [String],
    /// `--seed`: the seed of the random numbers.
    pub seed: Option<u64>,
    /// `--rotate`: whether rotation in the frame is followed; only for the method `robust`.
    pub rotate: Option<bool>,
}

impl Overrides<'_> {
    fn apply(self, config: &mut TrackerConfig) -> Result<(), SettingsError> {
        if !self.set.is_empty() {
            *config = apply(config.clone(), assignments(self.set)?, Path::new(SET))?;
            let out_of_range = |error| SettingsError::OutOfRange(format!("{SET}: {error}"));
            config.validate().map_err(out_of_range)?;
        }
        if let Some(seed) = self.seed {
            config.seed = seed;
        }
        if let Some(rotate) = self.rotate {
            let (method, owner) = (config.method, Method::Robust.name());
            if method != Method::Robust {
                return Err(SettingsError::UnusedOption { option: "--rotate", method, owner });
            }
            config.robust.rotate = rotate;
        }
        Ok(())
    }
}

/// The option that changes single settings; errors name it in place of a file.
const SET: &str = "--set";

/// The table that a settings file with these assignments would hold. Words need no quotes.
fn assignments(given: &[String]) -> Result<toml::Table, SettingsError> {
    let mut table = toml::Table::new();
    for assignment in given {
        let (name, value) = assignment
            .split_once('=')
            .map(|(name, value)| (name.trim(), value.trim()))
            .filter(|(name, value)| !name.is_empty() && !value.is_empty())
            .ok_or_else(|| SettingsError::Assignment { given: assignment.clone() })?;
        let read: Result<toml::Table, _> = format!("value = {value}").parse();
        let read = read.ok().filter(|table| table.len() == 1).and_then(|mut t| t.remove("value"));
        let value = read.unwrap_or_else(|| toml::Value::String(value.to_string()));
        // A group may be named, as in patchwise.particles.
        let name = match name.split_once('.') {
            Some((group, name))
                if PARAMETERS.iter().any(|row| (row.group, row.name) == (group, name)) =>
            {
                name
            }
            _ => name,
        };
        table.insert(name.to_string(), value);
    }
    Ok(table)
}

/// The configuration of a preset, with the overrides of a file and then of the options applied.
///
/// # Errors
/// [`SettingsError`] if the preset is unknown, the file cannot be read or is invalid, or the method ignores
/// one of the options.
pub fn resolve(
    name: &str,
    file: Option<&Path>,
    options: Overrides<'_>,
) -> Result<TrackerConfig, SettingsError> {
    let mut config = preset(name)?;
    if let Some(file) = file {
        config = with_file(config, file)?;
    }
    options.apply(&mut config)?;
    config.validate().map_err(|error| SettingsError::OutOfRange(error.to_string()))?;
    Ok(config)
}

fn with_file(config: TrackerConfig, file: &Path) -> Result<TrackerConfig, SettingsError> {
    let unreadable = |reason| SettingsError::Unreadable { file: file.to_path_buf(), reason };
    let bytes = files::read(file).map_err(unreadable)?;
    let text =
        String::from_utf8(bytes).map_err(|_| unreadable(io::ErrorKind::InvalidData.into()))?;
    let changes: toml::Table = text.parse().map_err(|error: toml::de::Error| {
        let line = error
            .span()
            .map_or(1, |span| 1 + text[..span.start.min(text.len())].matches('\n').count());
        let reason = error.message().to_string();
        SettingsError::NoToml { file: file.to_path_buf(), line, reason }
    })?;
    let config = apply(of_version_0_1(config, &changes), changes, file)?;
    let out_of_range = |error| SettingsError::OutOfRange(format!("{}: {error}", file.display()));
    config.validate().map_err(out_of_range)?;
    Ok(config)
}

/// With the paper's tracker, if the file has settings outside of their group, as version 0.1 wrote them, and
/// no method.
fn of_version_0_1(mut config: TrackerConfig, changes: &toml::Table) -> TrackerConfig {
    let read = changes.clone().try_into::<TrackerConfig>();
    if !changes.contains_key("method") && read.is_ok_and(|read| read.method == Method::Patchwise) {
        config.method = Method::Patchwise;
    }
    config
}

/// Applies the changes one at a time, so that an invalid one can be named. The settings of a group are in a
/// table of the group's name, but are also accepted at the top level, since setting names are unique across
/// groups.
fn apply(
    config: TrackerConfig,
    changes: toml::Table,
    file: &Path,
) -> Result<TrackerConfig, SettingsError> {
    let table = toml::Table::try_from(&config);
    let mut table = table.map_err(|error| SettingsError::Table(error.to_string()))?;
    let before = table.clone();
    for (name, value) in changes {
        let is_group = PARAMETERS.iter().any(|row| !name.is_empty() && row.group == name);
        match value {
            toml::Value::Table(settings) if is_group => {
                for (field, value) in &settings {
                    apply_one(&mut table, (Some(&name), field), value, file)?;
                }
            }
            value => apply_one(&mut table, (None, &name), &value, file)?,
        }
    }
    let config: Result<TrackerConfig, _> = table.clone().try_into();
    let config = config.map_err(|error| SettingsError::Table(error.to_string()))?;
    refuse_unused(config.method, (&before, &table), file)?;
    Ok(config)
}

/// Refuses a changed setting that the method does not use: it would have no effect.
fn refuse_unused(
    method: Method,
    (before, after): (&toml::Table, &toml::Table),
    file: &Path,
) -> Result<(), SettingsError> {
    for parameter in PARAMETERS.iter().filter(|parameter| !parameter.is_used_by(method)) {
        let Parameter { group, name, .. } = *parameter;
        let value = |table: &toml::Table| table.get(group)?.get(name).cloned();
        if let Some(value) = value(after).filter(|after| value(before).as_ref() != Some(after)) {
            let (file, value) = (file.to_path_buf(), value.to_string());
            return Err(SettingsError::Unused { file, name, value, method, owner: group });
        }
    }
    Ok(())
}

/// Changes one setting in the table of a configuration. `group` is the table that contains it in the file.
fn apply_one(
    table: &mut toml::Table,
    (group, name): (Option<&str>, &str),
    value: &toml::Value,
    file: &Path,
) -> Result<(), SettingsError> {
    let row = |row: &&Parameter| row.name == name && group.is_none_or(|group| row.group == group);
    let Some(parameter) = PARAMETERS.iter().find(row) else {
        return unknown(name, value, file);
    };
    let slot = match parameter.group {
        "" => table.get_mut(name),
        group => table.get_mut(group).and_then(|group| group.get_mut(name)),
    };
    let before = slot.map(|slot| std::mem::replace(slot, value.clone()));
    let checked: Result<TrackerConfig, _> = table.clone().try_into();
    checked.map_err(|_| invalid_value(parameter, value, before.as_ref(), file)).map(drop)
}

/// Handles an unknown setting: an error, unless an earlier version had it and the value is the one always
/// used now.
fn unknown(name: &str, value: &toml::Value, file: &Path) -> Result<(), SettingsError> {
    let alone = toml::Table::from_iter([(name.to_string(), value.clone())]);
    match alone.try_into::<TrackerConfig>() {
        Ok(_) => Ok(()),
        Err(error) if error.message().contains("no longer exists") => {
            let reason = error.message().to_string();
            Err(SettingsError::Removed { file: file.to_path_buf(), reason })
        }
        Err(_) => {
            let near = near_matches(name, PARAMETERS.iter().map(|parameter| parameter.name));
            Err(SettingsError::Unknown { file: file.to_path_buf(), name: name.to_string(), near })
        }
    }
}

/// The error for an invalid value; `before` is a valid one.
fn invalid_value(
    parameter: &Parameter,
    value: &toml::Value,
    before: Option<&toml::Value>,
    file: &Path,
) -> SettingsError {
    let Parameter { name, range, .. } = parameter;
    let is_number = value.is_integer() || value.is_float();
    let fault = match range {
        Range::Words(_) if value.is_str() => "is not one of the allowed words",
        Range::Number { .. } if is_number => "is out of range",
        _ => "has the wrong type",
    };
    let whole = if before.is_some_and(toml::Value::is_integer) { "a whole number, " } else { "" };
    SettingsError::Value {
        file: file.to_path_buf(),
        name,
        value: value.to_string(),
        fault,
        allowed: format!("{whole}{range}"),
    }
}
