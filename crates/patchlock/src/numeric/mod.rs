//! What all other modules compute with: the instructions of the processor, inner products that give the same bits on
//! every processor, aligned rows, singular vectors and a team of threads.

pub mod aligned;
mod dot;
pub mod instructions;
pub mod singular;
pub mod thread_team;

pub use dot::{dot, dot_wide, dots_wide};
