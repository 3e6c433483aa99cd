//! Output of results: tables, the annotated video, the summary. Files are written completely or not at all.

pub mod canvas;
pub mod chart;
pub mod draw;
mod many;
pub mod pending;
pub mod plan;
pub mod printed;
pub mod row;
pub mod strip;
pub mod summary;
pub mod tables;
pub mod text;
pub mod text_table;
pub mod unfinished;
pub mod video;

use std::path::PathBuf;

use anyhow::Result;
use patchlock::Estimate;
use patchlock_media::Picture;

use row::Row;

/// One target in one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Seen {
    /// The row of the tables.
    pub row: Row,
    /// The tracker's estimate.
    pub estimate: Estimate,
}

/// A tracked frame with its results.
pub struct Tracked<'a> {
    /// Number of the frame in the source.
    pub frame: usize,
    /// The targets in this frame.
    pub targets: &'a [Seen],
    /// The pixels of the frame.
    pub picture: &'a Picture,
}

/// An output that receives tracked frames one by one.
pub trait Sink {
    /// Writes one frame.
    fn write(&mut self, tracked: &Tracked<'_>) -> Result<()>;

    /// Completes the output and moves it into place; returns the path if it is a file.
    fn finish(self: Box<Self>) -> Result<Option<PathBuf>>;
}
