//! The tracker benchmark: sequences in, trajectories on disk, scores out.
//!
//! The way of the data, in one direction: a [`dataset`] is read (frames and truth), a tracker's boxes are
//! read as [`results`], [`metrics`] compares the two frame by frame and makes curves, and [`score`] sums them
//! up over targets and seeds; [`compare`] says how sure a difference is, and [`report`] makes a page of it
//! all. The other way, [`export`] writes what was tracked for other tools.
//!
//! A tracker works in a [`session`], on its threads and with a clock; [`many_targets`] and the runs of
//! [`mod@bench`] are such sessions. [`settings`] makes its configuration.
//!
//! Every convention of the comparison is a field of one value, [`protocol::Protocol`].
//!
//! Boxes are [`patchlock::BoundingBox`]: pixels counted from 0. The files of most benchmarks count from 1; a
//! dataset knows its [`origin`](dataset::Dataset::origin), and results are taken to count as the truth does
//! that they are scored against.

pub mod bench;
pub mod compare;
pub mod dataset;
pub mod error;
pub mod export;
mod files;
pub mod many_targets;
pub mod metrics;
pub mod names;
pub mod protocol;
pub mod report;
pub mod results;
pub mod score;
pub mod session;
pub mod settings;
pub mod start_box;
pub mod text;
pub mod trax;

pub use error::Error;
