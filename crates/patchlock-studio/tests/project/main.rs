//! Projects: edits, the file, what is read and written.

mod attributes;
mod edits;
mod exchange;
mod history;
mod images;
mod outlines;
mod shared;
mod store;
mod support;
