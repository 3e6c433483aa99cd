//! Values of attributes, from the frame of a change to the next change.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{Attribute, Target, by_frame};

/// The values of an attribute, by the frame from which each holds until the next.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Changes(#[serde(with = "by_frame")] pub BTreeMap<usize, String>);

impl Changes {
    /// The value that holds in a frame, if it has changed in it or before.
    pub fn at(&self, frame: usize) -> Option<&str> {
        self.0.range(..=frame).next_back().map(|(_, value)| value.as_str())
    }

    /// The values from a frame on, which are taken out.
    pub(super) fn split_off(&mut self, frame: usize) -> Self {
        Self(self.0.split_off(&frame))
    }
}

impl Target {
    /// The value of an attribute of its label in a frame. One that the attribute does not allow is
    /// passed over: the label may have been changed while the project was closed, or be another one.
    pub fn value<'a>(&'a self, attribute: &'a Attribute, frame: usize) -> &'a str {
        let changes = self.changes.get(&attribute.name).filter(|_| attribute.mutable);
        let said = changes.and_then(|changes| changes.at(frame));
        let said = said.or_else(|| self.attributes.get(&attribute.name).map(String::as_str));
        said.filter(|value| attribute.allows(value).is_ok()).unwrap_or(&attribute.default)
    }
}

/// The number of all changes, which is what their memory grows with.
pub fn count(changes: &BTreeMap<String, Changes>) -> usize {
    changes.values().map(|changes| changes.0.len()).sum()
}
