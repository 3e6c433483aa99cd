//! What is known of a target besides its boxes.

use std::collections::BTreeMap;

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
    /// The values of all attributes in a frame, by name.
    pub fn at(&self, frame: usize) -> BTreeMap<&str, &str> {
        let fixed = self.attributes.iter().map(|(name, value)| (name.as_str(), value.as_str()));
        let changing = self.changes.iter().filter_map(|(name, values)| {
            let (_, value) = values.range(..=frame).next_back()?;
            Some((name.as_str(), value.as_str()))
        });
        fixed.chain(changing).collect()
    }
}
