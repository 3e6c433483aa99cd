//! The tracker as a whole, on rendered scenes with known truth.

mod bad_frames;
mod boxes;
mod fields;
mod film;
mod following;
mod multi;
mod observer;
mod same_boxes;
mod snapshot;
