//! Resolves a preset, a settings file and single settings to a validated configuration. Each
//! setting goes through [`TrackerConfig::set`].

use std::io;
use std::path::Path;

use patchlock::{Kind, Method, Parameter, Preset, TrackerConfig, Value};

use crate::models::{self, ModelPaths};
use crate::{Error, files};

/// The configuration of the preset with this name.
///
/// # Errors
/// [`Error::Preset`].
pub fn preset(name: &str) -> Result<TrackerConfig, Error> {
    let preset = name.parse::<Preset>().map(TrackerConfig::from);
    preset.map_err(|_| Error::Preset(name.to_string()))
}

/// The preset that a configuration is based on: this one, unless a settings file has chosen another
/// method; then the first preset of that method.
pub fn basis<'a>(name: &'a str, config: &TrackerConfig) -> &'a str {
    let has_method =
        |name: &&str| preset(name).is_ok_and(|preset| preset.method.name() == config.method.name());
    let all = Preset::ALL.map(Preset::name);
    std::iter::once(name).chain(all).find(has_method).unwrap_or(name)
}

/// Settings that take precedence over a settings file.
#[derive(Debug, Clone, Default)]
pub struct Overrides<'a> {
    /// Any settings, as `NAME=VALUE`. Words need no quotes.
    pub set: &'a [String],
    /// The seed of the random numbers; it takes precedence over one in `set`.
    pub seed: Option<u64>,
    /// The network and what runs it.
    pub paths: ModelPaths,
}

/// The configuration of a preset, with the settings of a file and then the overrides applied, and
/// with the network that the method needs; and the files of that network.
///
/// # Errors
/// [`Error`] if the preset is unknown, a file cannot be read or is invalid, or a setting is
/// unknown, has no effect with the method, or is out of range.
pub fn resolve(
    name: &str,
    file: Option<&Path>,
    overrides: Overrides<'_>,
) -> Result<(TrackerConfig, ModelPaths), Error> {
    let (mut config, paths) = match file {
        Some(file) => from_file(name, file)?,
        None => (preset(name)?, ModelPaths::default()),
    };
    let invalid = |error| Error::Setting(None, error);
    for given in overrides.set {
        let (name, value) = assignment(given)?;
        config.set(short_name(name), value).map_err(invalid)?;
    }
    if let Some(seed) = overrides.seed {
        config.set("seed", seed).map_err(invalid)?;
    }
    config.validate().map_err(invalid)?;
    let paths = ModelPaths {
        model: overrides.paths.model.or(paths.model),
        runtime: overrides.paths.runtime.or(paths.runtime),
    };
    config.network = paths.network(&config.method)?;
    Ok((config, paths))
}

/// The name and the value of `NAME=VALUE`.
fn assignment(given: &str) -> Result<(&str, Value), Error> {
    let (name, value) = given
        .split_once('=')
        .map(|(name, value)| (name.trim(), value.trim()))
        .filter(|(name, value)| !name.is_empty() && !value.is_empty())
        .ok_or_else(|| Error::Assignment(given.to_owned()))?;
    let read: Result<toml::Table, _> = format!("value = {value}").parse();
    let read = read.ok().filter(|table| table.len() == 1).and_then(|mut t| t.remove("value"));
    Ok((name, read.map_or_else(|| Value::from(value), |value| to_value(&value))))
}

/// The name of a setting without its groups, which may precede it as in `robust.search` and
/// `robust.patches.atoms`.
fn short_name(name: &str) -> &str {
    let is_path = |groups: &str, group: &str| match groups.split_once('.') {
        None => groups == group,
        Some((method, "patches")) => group == "patches" && Method::NAMES.contains(&method),
        Some(_) => false,
    };
    match name.rsplit_once('.') {
        Some((groups, short))
            if Parameter::named(short).is_some_and(|row| is_path(groups, row.group)) =>
        {
            short
        }
        _ => name,
    }
}

/// The configuration of a preset with the settings of a file applied, without a network, and the
/// files of the network that the settings file names, relative to the file. The table of a method
/// chooses that method; settings outside of tables are those of the method in use, since no two
/// settings have the same name.
///
/// # Errors
/// [`Error`] if the preset is unknown, the file cannot be read or is invalid, or a setting
/// is unknown, has no effect with the method, or is out of range.
pub fn from_file(name: &str, file: &Path) -> Result<(TrackerConfig, ModelPaths), Error> {
    let mut config = preset(name)?;
    let mut settings = read(file)?;
    let invalid = |error| Error::Setting(Some(file.to_path_buf()), error);
    let mut path = |name: &'static str| match settings.remove(name) {
        Some(toml::Value::String(path)) if models::is_word(Path::new(&path)) => {
            Ok(Some(path.into()))
        }
        Some(toml::Value::String(path)) => Ok(Some(file.with_file_name("").join(path))),
        Some(other) => {
            let value = other.to_string();
            Err(invalid(patchlock::Error::SettingKind { name, value, kind: Kind::Word }))
        }
        None => Ok(None),
    };
    let paths = ModelPaths { model: path("model")?, runtime: path("runtime")? };
    let mut tables = Vec::new();
    for name in Method::NAMES {
        match settings.remove(name) {
            Some(toml::Value::Table(table)) => tables.push((name, table)),
            Some(other) => {
                settings.insert(name.to_owned(), other);
            }
            None => {}
        }
    }
    if tables.len() > 1 {
        let methods = tables.into_iter().map(|(name, _)| name).collect();
        return Err(Error::ManyMethods(file.to_path_buf(), methods));
    }
    if let Some((method, table)) = tables.pop() {
        if method != config.method.name() {
            config = first_of(method, &config);
        }
        for (name, value) in table {
            let applied = match value {
                toml::Value::Table(patches) if name == "patches" => apply(&mut config, patches),
                value => config.set(&name, to_value(&value)),
            };
            applied.map_err(invalid)?;
        }
    }
    apply(&mut config, settings).map_err(invalid)?;
    config.validate().map_err(invalid)?;
    Ok((config, paths))
}

/// The first preset of a method, with the seed of another configuration.
fn first_of(method: &str, config: &TrackerConfig) -> TrackerConfig {
    let presets = Preset::ALL.map(TrackerConfig::from);
    let first = presets.into_iter().find(|preset| preset.method.name() == method);
    let mut first = first.unwrap_or_default();
    first.seed = config.seed;
    first
}

/// Applies settings that are not in a table.
fn apply(config: &mut TrackerConfig, settings: toml::Table) -> Result<(), patchlock::Error> {
    settings.iter().try_for_each(|(name, value)| config.set(name, to_value(value)))
}

/// What TOML has and settings have not becomes a word, which is of the wrong kind or none of the
/// choices.
fn to_value(value: &toml::Value) -> Value {
    value.clone().try_into().unwrap_or_else(|_| Value::Word(value.to_string()))
}

/// The kinds of the values that a setting takes, and their range, in words.
pub fn allowed(parameter: &Parameter) -> String {
    match parameter.kind {
        Kind::Whole => format!("a whole number, {}", parameter.range),
        _ => parameter.range.to_string(),
    }
}

/// The content of a settings file.
fn read(file: &Path) -> Result<toml::Table, Error> {
    let unreadable = |reason| Error::Settings(file.to_path_buf(), reason);
    let bytes = files::read(file).map_err(unreadable)?;
    let text =
        String::from_utf8(bytes).map_err(|_| unreadable(io::ErrorKind::InvalidData.into()))?;
    text.parse().map_err(|error: toml::de::Error| {
        let line = error
            .span()
            .map_or(1, |span| 1 + text[..span.start.min(text.len())].matches('\n').count());
        let reason = error.message().to_string();
        Error::NoToml(file.to_path_buf(), line, reason)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn resolved(preset: &str, text: &str, set: &[&str]) -> Result<TrackerConfig, Error> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("my.toml");
        std::fs::write(&file, text).unwrap();
        let set: Vec<String> = set.iter().map(|text| (*text).to_owned()).collect();
        let set = Overrides { set: &set, ..Overrides::default() };
        resolve(preset, Some(&file), set).map(|(config, _)| config)
    }

    #[test]
    fn settings_may_be_in_their_tables_or_outside() {
        let tables = "seed = 3\n[robust]\nsearch = 4\n[robust.patches]\natoms = 3";
        let config = resolved("robust", tables, &[]).unwrap();
        assert_eq!(config.get("search").unwrap(), Value::Number(4.0));
        assert_eq!(resolved("robust", "seed = 3\nsearch = 4\natoms = 3", &[]).unwrap(), config);
        let single = ["seed=3", "robust.search = 4", "robust.patches.atoms=3"];
        assert_eq!(resolved("robust", "", &single).unwrap(), config);
    }

    #[test]
    fn the_table_of_a_method_chooses_it() {
        let config = resolved("robust", "seed = 2\n[paper]\nparticles = 7", &[]).unwrap();
        assert_eq!((config.method.name(), config.seed), ("paper", 2));
        assert_eq!(basis("robust", &config), "paper");
        let both = resolved("robust", "[robust]\n[paper]\n", &[]);
        assert!(matches!(both, Err(Error::ManyMethods(..))), "{both:?}");
    }

    const MADE_UP: &str =
        concat!(env!("CARGO_MANIFEST_DIR"), "/../patchlock/tests/golden/network/vittrack.onnx");

    #[test]
    fn a_network_is_loaded_where_the_method_can_use_one() {
        let path = Path::new(MADE_UP);
        let with = |model: &Path, runtime: Option<&Path>| Overrides {
            paths: ModelPaths {
                model: Some(model.into()),
                runtime: runtime.map(Path::to_path_buf),
            },
            ..Overrides::default()
        };
        let (config, paths) = resolve("network", None, with(path, None)).unwrap();
        let network = config.network.expect("is loaded");
        assert_eq!((network.name(), paths.model.as_deref()), ("VitTrack", Some(path)));
        for preset in ["network", "robust"] {
            let in_file = resolved(preset, &format!("model = {MADE_UP:?}"), &[]).unwrap();
            assert_eq!(in_file.network.as_ref(), Some(&network));
        }
        let error = |preset, overrides| resolve(preset, None, overrides).expect_err("is refused");
        let none = Path::new("none");
        let missing = error("network", with(none, None));
        assert_eq!(resolve("robust", None, with(none, None)).unwrap().0.network, None);
        assert_eq!(resolved("robust", "model = \"none\"", &[]).unwrap().network, None);
        assert!(matches!(missing, Error::MissingModel("network")), "{missing}");
        assert!(matches!(error("paper", with(path, None)), Error::UnusedModel(..)));
        assert!(matches!(error("robust", with(none, Some(path))), Error::UnusedRuntime(_)));
    }

    #[test]
    fn wrong_settings_are_named() {
        let error = |preset, text, set: &[&str]| match resolved(preset, text, set) {
            Err(Error::Setting(_, error)) => error.to_string(),
            other => panic!("{other:?}"),
        };
        let set = |set| error("robust", "", &[set]);
        assert_eq!(set("serch=4"), "unknown setting `serch`");
        assert_eq!(set("search=99"), "the setting `search` is 99; allowed: 1.5 to 20");
        assert_eq!(set("search=wide"), "the setting `search` is wide; it takes a number");
        assert_eq!(set("search=[1, 2]"), "the setting `search` is [1, 2]; it takes a number");
        assert!(set("particles=9").contains("has no effect with the method `robust`"));
        assert_eq!(set("paper.search=4"), "unknown setting `paper.search`");
        assert_eq!(error("paper", "robust = 4", &[]), "unknown setting `robust`");
        let assignment = resolved("robust", "", &["search"]);
        assert!(matches!(assignment, Err(Error::Assignment(_))));
    }
}
