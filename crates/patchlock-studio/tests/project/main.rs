//! Projects: edits, the file, what is read and written.

mod edits;
mod store;
mod support;
