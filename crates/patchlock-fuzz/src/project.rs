//! Project files, with edits, undo and redo.

use patchlock_media::Limits;
use patchlock_studio::project::{Edit, Project, Store};
use patchlock_studio::tracking::review::suggestions;

use crate::check::{accepted, said};
use crate::parts;
use crate::scratch::Scratch;
use crate::tables::{exported, finite_boxes};

/// Steps after which an input is not followed any further.
const STEPS: usize = 32;

/// The first part is a project file; each further part is a list of edits as JSON, or `undo`,
/// `redo` or `save`.
pub fn project(data: &[u8]) {
    let mut parts = parts(data);
    let scratch = Scratch::new();
    let file = scratch.file("clip.json", parts.next().unwrap_or_default());
    let Some(mut store) = accepted(Store::open_shared(&file, None, Limits::default())) else {
        return;
    };
    sound(store.project());
    let first = content(store.project());
    for part in parts.take(STEPS) {
        match part {
            b"undo" => drop(store.step(false).expect("a step can be taken back")),
            b"redo" => drop(store.step(true).expect("a step can be done again")),
            b"save" => saved(&mut store),
            edits => {
                let Some(edits) = accepted(serde_json::from_slice::<Vec<Edit>>(edits)) else {
                    continue;
                };
                let before = content(store.project());
                match store.apply(edits) {
                    Ok(_) => sound(store.project()),
                    Err(error) => {
                        said(&error);
                        assert_eq!(content(store.project()), before, "a refused edit changed it");
                    }
                }
            }
        }
    }
    saved(&mut store);
    // Redo first, so that all steps are taken back.
    while store.step(true).expect("a step can be done again").is_some() {}
    let last = content(store.project());
    while store.step(false).expect("a step can be taken back").is_some() {}
    assert_eq!(content(store.project()), first, "undo does not restore");
    while store.step(true).expect("a step can be done again").is_some() {}
    assert_eq!(content(store.project()), last, "redo does not bring back");
    exported(store.project());
}

/// What undo and redo restore: ids that were used are never used again.
fn content(project: &Project) -> Project {
    Project { next_id: 0, ..project.clone() }
}

fn sound(project: &Project) {
    for target in &project.targets {
        finite_boxes(target);
        suggestions(target, project.video.frames)
            .iter()
            .for_each(|suggestion| assert!(suggestion.gain.is_finite(), "{suggestion:?}"));
    }
}

/// Saves a project and reads it again.
fn saved(store: &mut Store) {
    store.save().expect("a project can be saved");
    let read = Store::open_shared(store.path(), None, Limits::default())
        .expect("what was saved can be read");
    assert_eq!(read.project(), store.project());
}
