//! What is known of a target besides its boxes.

use std::collections::BTreeMap;

use crate::names;

/// What is known of a target besides its boxes.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TargetMetadata {
    /// Its class, such as `car`.
    pub label: String,
    /// Values of attributes that are the same in all frames, by name.
    pub attributes: BTreeMap<String, String>,
    /// Values of the others, by name and by the frame from which they hold until the next one.
    pub changes: BTreeMap<String, BTreeMap<usize, String>>,
}

impl TargetMetadata {
    /// The names and values of all attributes in a frame, ordered by name.
    pub fn at(&self, frame: usize) -> Vec<(&str, &str)> {
        let names = self.attributes.keys().chain(self.changes.keys()).map(String::as_str);
        let value = |name: &str| {
            let changed = self.changes.get(name).and_then(|all| all.range(..=frame).next_back());
            changed.map(|(_, value)| value).or_else(|| self.attributes.get(name))
        };
        let names = names::distinct(names.collect()).into_iter();
        names.filter_map(|name| Some((name, value(name)?.as_str()))).collect()
    }
}
