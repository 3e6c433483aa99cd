//! The labels that all clips of a folder have in common.

use patchlock_studio::project::{Edit, LABELS_FILE, SharedLabels};

use crate::check::accepted;
use crate::parts;
use crate::scratch::Scratch;

/// Edits after which an input is not followed any further.
const EDITS: usize = 32;

/// The first part is the file of the labels; each further part is an edit of them as JSON.
pub fn labels(data: &[u8]) {
    let mut parts = parts(data);
    let scratch = Scratch::new();
    scratch.file(LABELS_FILE, parts.next().unwrap_or_default());
    let mut shared = SharedLabels::new(scratch.folder());
    let Some(mut before) = accepted(shared.read()) else { return };
    for part in parts.take(EDITS) {
        let Some(edit) = accepted(serde_json::from_slice::<Edit>(part)) else { continue };
        // A label is in use or not by the length of its name.
        let in_use = |name: &str| name.len().is_multiple_of(2);
        let done = shared.update(|vocabulary| {
            vocabulary.apply(&edit, in_use)?;
            Ok(vocabulary.clone())
        });
        let now = SharedLabels::new(scratch.folder()).read().expect("what was written can be read");
        match accepted(done) {
            Some(changed) => assert_eq!(now.labels(), changed.labels()),
            None => assert_eq!(now, before, "a refused edit changed the file"),
        }
        before = now;
    }
}
