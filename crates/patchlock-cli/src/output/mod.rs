//! Results out: tables, the annotated video, the summary. Every file is complete or not there at all.

pub mod canvas;
pub mod chart;
mod crowd;
pub mod draw;
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
    /// The line of the tables.
    pub row: Row,
    /// What the tracker said.
    pub estimate: Estimate,
}

/// Everything there is to say about one tracked frame.
pub struct Tracked<'a> {
    /// Number of the frame in the source.
    pub frame: usize,
    /// The targets that are in it.
    pub targets: &'a [Seen],
    /// The frame.
    pub picture: &'a Picture,
}

/// Something that takes tracked frames, one after the other.
pub trait Sink {
    /// Takes one frame.
    fn write(&mut self, tracked: &Tracked<'_>) -> Result<()>;

    /// Completes the output and puts it in its place; gives the file, if it is one.
    fn finish(self: Box<Self>) -> Result<Option<PathBuf>>;
}
