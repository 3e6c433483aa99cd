//! Identifies the tracker that was run, so that runs of different trackers are never mixed.

use patchlock::TrackerConfig;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::files::sha256;
use patchlock_track::{UsedNetwork, settings};

/// The tracker that was run. Runs are comparable only if their identities are equal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Identity {
    /// The tracker of this project.
    Patchlock {
        /// Version of Patchlock.
        version: String,
        /// The build, [`patchlock::BUILD`].
        build: String,
        /// Name of the preset that the configuration is based on.
        preset: String,
        /// The configuration. Its seed is 0, since each run has its own.
        configuration: Box<TrackerConfig>,
        /// The network that the method follows with; the other methods have none.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        network: Option<UsedNetwork>,
    },
    /// An external program that speaks TraX.
    Trax {
        /// The command that starts it, with its arguments.
        command: Vec<String>,
    },
}

impl Identity {
    /// The identity of Patchlock with a configuration that began as a preset. If its method is
    /// another one now, the preset of that method is recorded.
    pub fn patchlock(configuration: &TrackerConfig, preset: &str) -> Self {
        Self::Patchlock {
            version: env!("CARGO_PKG_VERSION").to_string(),
            build: patchlock::BUILD.to_string(),
            preset: settings::basis(preset, configuration).to_string(),
            configuration: Box::new(with_seed(configuration, 0)),
            network: configuration.network.as_ref().map(UsedNetwork::from),
        }
    }

    /// The SHA-256 of its JSON, in hexadecimal.
    pub fn hash(&self) -> String {
        sha256(self.json().as_bytes())
    }

    /// The identity as a JSON object, as stored in manifests.
    pub(super) fn fields(&self) -> Value {
        serde_json::from_slice(self.json().as_bytes()).unwrap_or_default()
    }

    fn json(&self) -> String {
        serde_json::to_string(self).unwrap_or_default()
    }
}

/// The configuration with another seed.
pub(in crate::bench) fn with_seed(configuration: &TrackerConfig, seed: u64) -> TrackerConfig {
    let mut configuration = configuration.clone();
    configuration.seed = seed;
    configuration
}

/// The fields that differ between a stored identity and this one, in words.
pub(super) fn difference(stored: &Value, current: &Value) -> String {
    let (stored, current) = (flat(stored), flat(current));
    let value = |fields: &Map<String, Value>, name: &str| {
        fields.get(name).map_or("not set".to_string(), Value::to_string)
    };
    let names = stored.keys().chain(current.keys()).map(String::as_str);
    let names = patchlock_track::names::distinct(names.collect());
    let differing: Vec<String> = names
        .into_iter()
        .map(|name| (name, value(&stored, name), value(&current, name)))
        .filter(|(_, stored, current)| stored != current)
        .map(|(name, stored, current)| format!("{name} is {stored} there and {current} here"))
        .collect();
    patchlock_track::names::some_of(&differing)
}

/// The fields of an object, with nested objects flattened.
fn flat(value: &Value) -> Map<String, Value> {
    let mut all = Map::new();
    for (name, value) in value.as_object().into_iter().flatten() {
        match value.as_object() {
            Some(_) => all.extend(flat(value)),
            None => drop(all.insert(name.clone(), value.clone())),
        }
    }
    all
}
