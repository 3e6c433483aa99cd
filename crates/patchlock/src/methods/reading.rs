//! Reads a configuration from any self-describing format. Each setting goes through
//! [`TrackerConfig::set`].

use super::{Preset, TrackerConfig};
use crate::value::Value;
use serde::de::{Deserialize, Deserializer, Error};
use std::collections::BTreeMap;

/// A setting, or a table of settings.
#[derive(serde::Deserialize)]
#[serde(untagged)]
enum Entry {
    Flag(bool),
    Whole(i64),
    Number(f64),
    Word(String),
    Table(BTreeMap<String, Entry>),
}

impl<'de> Deserialize<'de> for TrackerConfig {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut entries = BTreeMap::<String, Entry>::deserialize(deserializer)?;
        // The first is the default, whether it is named or not.
        let named = Preset::ALL[1..].iter().find(|preset| entries.contains_key(preset.name()));
        let mut config = Self::from(named.copied().unwrap_or_default());
        let method = config.method.name();
        match entries.remove(method) {
            Some(Entry::Table(settings)) => {
                for (name, entry) in settings {
                    match entry {
                        Entry::Table(patches) if name == "patches" => read(&mut config, patches)?,
                        entry => read(&mut config, BTreeMap::from([(name, entry)]))?,
                    }
                }
            }
            Some(_) => return Err(D::Error::custom(format!("`{method}` is not a table"))),
            None => {}
        }
        read(&mut config, entries)?;
        Ok(config)
    }
}

/// Applies settings that are not in a table.
fn read<E: Error>(config: &mut TrackerConfig, settings: BTreeMap<String, Entry>) -> Result<(), E> {
    for (name, entry) in settings {
        let value = match entry {
            Entry::Flag(flag) => Value::Flag(flag),
            Entry::Whole(number) => Value::Whole(number),
            Entry::Number(number) => Value::Number(number),
            Entry::Word(word) => Value::Word(word),
            Entry::Table(_) => return Err(E::custom(format!("`{name}` is not a group here"))),
        };
        config.set(&name, value).map_err(E::custom)?;
    }
    Ok(())
}
