//! Annotation of video: a [`project::Project`] holds the targets of a video with their key frames, boxes that
//! a person has drawn. [`tracking`] fills the frames between key frames, from both sides, and says which
//! frames are doubtful.

pub mod project;
pub mod tracking;
