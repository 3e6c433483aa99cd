//! The `patchlock` command.
fn main() {}
