//! The benchmark: datasets in, trajectories on disk, scores and reports out.
//!
//! Data flow in one direction: [`dataset`] reads frames and ground truth, [`results`] reads a
//! tracker's boxes, [`metrics`] compares the two frame by frame and computes curves, [`score`]
//! averages them over targets and seeds, [`compare`] estimates how certain a difference is, and
//! [`report`] presents it all as a page. The runs of [`mod@bench`] make the boxes.
//!
//! [`protocol`] holds the thresholds of the comparison and documents every convention.
//!
//! Boxes are [`patchlock::BoundingBox`], in pixels counted from 0. The files of most benchmarks
//! count from 1: a dataset knows its [`origin`](dataset::Dataset::origin), and results are assumed
//! to have the same origin as the ground truth that they are scored against.

pub mod bench;
pub mod compare;
pub mod dataset;
pub mod error;
pub mod metrics;
pub mod protocol;
pub mod report;
pub mod results;
pub mod score;
pub mod trax;

pub use error::Error;
