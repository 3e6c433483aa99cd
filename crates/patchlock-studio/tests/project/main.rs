//! Projects: edits, the file, what is read and written.

mod edits;
mod exchange;
mod store;
mod support;
