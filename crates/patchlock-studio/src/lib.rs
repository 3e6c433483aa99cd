//! Annotation of video: a [`project::Project`] holds the targets of a video with their key frames,
//! boxes that a person has drawn. [`tracking`] fills the frames between key frames, from both
//! sides, and says which frames are doubtful.
//!
//! With the feature `server`, `server` serves a page for the browser in which a person draws and
//! corrects.

/// Returns an error with this text, unless a condition holds.
macro_rules! ensure {
    ($condition:expr, $($text:tt)+) => {
        if !$condition {
            return Err(format!($($text)+));
        }
    };
}

#[cfg(feature = "server")]
mod engine;
pub mod export;
pub mod import;
#[cfg(feature = "server")]
mod page;
pub mod project;
#[cfg(feature = "server")]
pub mod server;
pub mod tracking;
