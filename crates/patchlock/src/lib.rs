//! Patchlock: a visual object tracker.
